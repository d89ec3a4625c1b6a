//! Small volumes: Zarr of both versions, with chunks of Blosc and in shards, labels, a plate, an archive,
//! NIfTI in one file and in two, raw; those of other programs, and those that are built here.

use anyhow::Result;

use super::{grainy, volume_files};
use crate::tree::Tree;

/// Voxels along z, y and x of the images here.
const SHAPE: [usize; 3] = [3, 4, 6];
/// Of a chunk.
const CHUNK: [usize; 3] = [2, 4, 3];

fn chunk_values() -> Vec<u8> {
    let bytes = 2 * CHUNK.iter().product::<usize>();
    grainy(12, bytes)
}

/// A chunk of Blosc whose streams are stored as they are, but for one of LZ4 that is all literals.
fn blosc(values: &[u8], flags: u8) -> Vec<u8> {
    let [lz4, literals] = [1_u8 << 5, values.len() as u8];
    let mut packed = vec![0xf0, literals - 15];
    packed.extend(values);
    let is_packed = flags & 1 == 0;
    let stream = if is_packed { &packed[..] } else { values };
    let mut chunk = vec![2, 1, lz4 | 0x10 | flags, 2];
    for number in [values.len(), values.len(), 16 + 4 + 4 + stream.len(), 20, stream.len()] {
        chunk.extend((number as u32).to_le_bytes());
    }
    chunk.extend(stream);
    chunk
}

fn image(path: &str) -> String {
    format!(
        r#"{{"multiscales":[{{"version":"0.4","axes":[{{"name":"z","type":"space"}},{{"name":"y","type":"space","unit":"nm"}},{{"name":"x","type":"space","unit":"um"}}],
"datasets":[{{"path":"{path}","coordinateTransformations":[{{"type":"scale","scale":[2,1,1]}},{{"type":"translation","translation":[0,0.5,0.5]}}]}}]}}],
"omero":{{"channels":[{{"label":"a","color":"FF0000","window":{{"min":0,"max":9,"start":1,"end":5}}}}]}}}}"#
    )
}

fn v2_array(compressor: &str, separator: char) -> String {
    format!(
        r#"{{"zarr_format":2,"shape":{SHAPE:?},"chunks":{CHUNK:?},"dtype":"<u2","compressor":{compressor},"fill_value":7,"order":"C","filters":null,"dimension_separator":"{separator}"}}"#
    )
}

fn text(name: &str, text: &str) -> (String, Vec<u8>) {
    (name.to_owned(), text.as_bytes().to_vec())
}

fn v2() -> Tree {
    let mut files = vec![text(".zgroup", r#"{"zarr_format":2}"#), text(".zattrs", &image("0"))];
    files.push(text("0/.zarray", &v2_array(r#"{"id":"blosc","cname":"lz4","clevel":5,"shuffle":1}"#, '.')));
    files.push(("0/0.0.0".into(), blosc(&chunk_values(), 0)));
    files.push(("0/1.0.1".into(), blosc(&chunk_values(), 1)));
    files.push(("0/0.0.1".into(), blosc(&chunk_values(), 4)));
    Tree { files }
}

fn v3_shards() -> Tree {
    let array = r#"{"zarr_format":3,"node_type":"array","shape":[3,4,6],"data_type":"uint16","chunk_grid":{"name":"regular","configuration":{"chunk_shape":[4,4,6]}},
"chunk_key_encoding":{"name":"default","configuration":{"separator":"/"}},"fill_value":0,"codecs":[{"name":"sharding_indexed","configuration":{"chunk_shape":[2,4,3],
"codecs":[{"name":"transpose","configuration":{"order":[2,1,0]}},{"name":"bytes","configuration":{"endian":"big"}}],"index_codecs":[{"name":"bytes","configuration":{"endian":"little"}}],
"index_location":"end"}}],"dimension_names":["z","y","x"]}"#;
    let values = chunk_values();
    let mut shard = [values.clone(), values.clone()].concat();
    let len = values.len() as u64;
    for number in [0, len, u64::MAX, u64::MAX, len, len, u64::MAX, u64::MAX] {
        shard.extend(number.to_le_bytes());
    }
    let group = format!(r#"{{"zarr_format":3,"node_type":"group","attributes":{{"ome":{}}}}}"#, image("s0"));
    Tree { files: vec![text("zarr.json", &group), text("s0/zarr.json", array), ("s0/c/0/0/0".into(), shard)] }
}

/// A block of LZ4 of 512 bytes: literals, a match that repeats three of them, and literals again.
fn lz4_of_512() -> Vec<u8> {
    let mut packed = vec![0xff, 20 - 15];
    packed.extend(grainy(3, 20));
    packed.extend([3, 0, 255, 206, 0xc0]);
    packed.extend(grainy(5, 12));
    packed
}

/// A frame of Zstandard of up to 255 bytes, which are stored as they are.
fn zstd(values: &[u8]) -> Vec<u8> {
    let block = ((values.len() as u32) << 3 | 1).to_le_bytes();
    [&[0x28, 0xb5, 0x2f, 0xfd, 0x20, values.len() as u8][..], &block[..3], values].concat()
}

/// Two levels: of Blosc with a stream of LZ4 for each byte of a value, and of Zstandard and a checksum.
fn v3_codecs() -> Tree {
    let array = |side: u32, codec: &str| {
        format!(
            r#"{{"zarr_format":3,"node_type":"array","shape":[{side},{side},{side}],"data_type":"uint16","chunk_grid":{{"name":"regular","configuration":{{"chunk_shape":[{side},{side},{side}]}}}},
"chunk_key_encoding":{{"name":"default","configuration":{{"separator":"/"}}}},"fill_value":0,"codecs":[{{"name":"bytes","configuration":{{"endian":"little"}}}},{codec}],"dimension_names":["z","y","x"]}}"#
        )
    };
    let blosc = r#"{"name":"blosc","configuration":{"cname":"lz4","clevel":5,"shuffle":"shuffle","typesize":2,"blocksize":0}}"#;
    let sealed = r#"{"name":"zstd","configuration":{"level":3,"checksum":false}},{"name":"crc32c"}"#;
    let dataset = |path: u32, side: u32| {
        format!(
            r#"{{"path":"{path}","coordinateTransformations":[{{"type":"scale","scale":[{side},{side},{side}]}}]}}"#
        )
    };
    let group = format!(
        r#"{{"zarr_format":3,"node_type":"group","attributes":{{"ome":{{"version":"0.5","multiscales":[{{"axes":[{{"name":"z","type":"space"}},{{"name":"y","type":"space"}},{{"name":"x","type":"space"}}],
"datasets":[{},{}]}}]}}}}}}"#,
        dataset(0, 1),
        dataset(1, 2)
    );
    let stream = lz4_of_512();
    let len = (stream.len() as u32).to_le_bytes();
    let streams = [&len[..], &stream, &len, &stream].concat();
    let mut fine = vec![2, 1, 1 << 5 | 1, 2];
    for number in [1024, 1024, 20 + streams.len() as u32, 20] {
        fine.extend(number.to_le_bytes());
    }
    fine.extend(streams);
    let mut coarse = zstd(&grainy(12, 128));
    coarse.extend(vastex_volume::crc32c(&coarse).to_le_bytes());
    let files = vec![
        text("zarr.json", &group),
        text("0/zarr.json", &array(8, blosc)),
        ("0/c/0/0/0".into(), fine),
        text("1/zarr.json", &array(4, sealed)),
        ("1/c/0/0/0".into(), coarse),
    ];
    Tree { files }
}

/// An image of version 0.1, whose axes nobody names, with labels of 64 bits beside it.
fn labels() -> Tree {
    let chunk = |bytes: usize| grainy(12, bytes * CHUNK.iter().product::<usize>());
    let array = |dtype: &str, shape: &str, chunks: &str| {
        format!(
            r#"{{"zarr_format":2,"shape":{shape},"chunks":{chunks},"dtype":"{dtype}","compressor":null,"fill_value":0,"order":"C","filters":null}}"#
        )
    };
    let five = r#"{"multiscales":[{"version":"0.1","datasets":[{"path":"0"}]}]}"#;
    let of_labels = r##"{"multiscales":[{"version":"0.4","axes":[{"name":"z","type":"space"},{"name":"y","type":"space"},{"name":"x","type":"space"}],
"datasets":[{"path":"0"}]}],"image-label":{"version":"0.4","colors":[{"label-value":3,"rgba":[255,0,0,128]},{"label-value":9,"rgba":[0,9,0,255]}],"source":{"image":"../../"}}}"##;
    let files = vec![
        text(".zattrs", five),
        text("0/.zarray", &array(">f4", "[1,2,3,4,6]", "[1,1,2,4,3]")),
        ("0/0.0.0.0.0".into(), chunk(4)),
        ("0/0.1.1.0.1".into(), chunk(4)),
        text("labels/.zattrs", r#"{"labels":["cells"]}"#),
        text("labels/cells/.zattrs", of_labels),
        text("labels/cells/0/.zarray", &array("<u8", "[3,4,6]", "[2,4,3]")),
        ("labels/cells/0/0.0.0".into(), chunk(8)),
    ];
    Tree { files }
}

fn plate() -> Tree {
    let plate = r#"{"plate":{"version":"0.4","wells":[{"path":"A/1"},{"path":"A/2"}]}}"#;
    let files = vec![
        text(".zattrs", plate),
        text("A/1/.zattrs", r#"{"well":{"images":[{"path":"0"}]}}"#),
        text("A/1/0/.zattrs", &image("0")),
        text("A/1/0/0/.zarray", &v2_array("null", '/')),
        ("A/1/0/0/0/0/0".into(), chunk_values()),
    ];
    Tree { files }
}

/// The files of a tree as an archive of stored entries.
fn archive(tree: &Tree) -> Vec<u8> {
    let (mut bytes, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in &tree.files {
        let header = bytes.len() as u32;
        let len = (content.len() as u32).to_le_bytes();
        let middle = [
            &[20, 0, 0, 0, 0, 0, 0, 0, 0, 0][..],
            &[0; 4],
            &len,
            &len,
            &(name.len() as u16).to_le_bytes(),
            &[0; 2],
        ];
        let middle = middle.concat();
        bytes.extend([b"PK\x03\x04", &middle[..], name.as_bytes(), content].concat());
        directory.extend(
            [b"PK\x01\x02\x14\0", &middle[..], &[0; 10], &header.to_le_bytes(), name.as_bytes()].concat(),
        );
    }
    let count = (tree.files.len() as u16).to_le_bytes();
    let place = (bytes.len() as u32).to_le_bytes();
    let len = (directory.len() as u32).to_le_bytes();
    [&bytes[..], &directory, b"PK\x05\x06\0\0\0\0", &count, &count, &len, &place, &[0; 2]].concat()
}

fn nifti() -> Vec<u8> {
    let mut header = vec![0; 352];
    header[..4].copy_from_slice(&348_i32.to_le_bytes());
    for (n, side) in [4_i16, 6, 4, 3, 2].into_iter().enumerate() {
        header[40 + 2 * n..][..2].copy_from_slice(&side.to_le_bytes());
        header[76 + 4 * n..][..4].copy_from_slice(&1.5_f32.to_le_bytes());
    }
    header[70..72].copy_from_slice(&512_i16.to_le_bytes());
    header[108..112].copy_from_slice(&352_f32.to_le_bytes());
    header[344..348].copy_from_slice(b"n+1\0");
    header.extend(grainy(12, 2 * 6 * 4 * 3 * 2));
    header
}

/// The header and the values in files of their own.
fn nifti_pair() -> Tree {
    let whole = nifti();
    let (mut header, values) = (whole[..348].to_vec(), whole[352..].to_vec());
    header[108..112].fill(0);
    header[344..348].copy_from_slice(b"ni1\0");
    Tree { files: vec![("b.hdr".into(), header), ("b.img".into(), values)] }
}

fn raw() -> Tree {
    let described = "width = 6\nheight = 4\ndepth = 3\nchannels = 2\nsample = \"u16\"\nendian = \"big\"\noffset = 2\norder = \"planar\"\n";
    Tree { files: vec![text("a.raw.toml", described), ("a.raw".into(), grainy(12, 2 + 2 * 6 * 4 * 3 * 2))] }
}

/// A volume, or a list of them, each.
pub(crate) fn volumes() -> Result<Vec<Vec<u8>>> {
    let file = |name: &str, content: Vec<u8>| Tree { files: vec![(name.to_owned(), content)] };
    let archive = file("a.zip", archive(&v2()));
    let nifti = file("a.nii", nifti());
    let mut trees =
        vec![v2(), v3_shards(), v3_codecs(), labels(), plate(), archive, nifti, nifti_pair(), raw()];
    trees.extend(volume_files::built(&raw())?);
    trees.extend(volume_files::found()?);
    Ok(trees.iter().map(Tree::encode).collect())
}
