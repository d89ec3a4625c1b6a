//! Damaged and lying volumes: every one is refused with a message that names the path, or read; none takes
//! more than it may.

use std::path::{Path, PathBuf};

use pollster::block_on;
use vastex_volume::{Opened, VolumeRegion, open};

use crate::fixtures::{path, unpacked};

/// Voxels that are read of a volume whose size may be a lie.
const MOST_SIDE: u64 = 64;

/// Opens and reads what there is; gives the first error.
fn read(path: &Path) -> Result<(), String> {
    let volume = match open(path).map_err(|error| error.to_string())? {
        Opened::Volume(volume) => volume,
        Opened::Images(_) => return Ok(()),
    };
    block_on(volume.count_bricks(false)).map_err(|error| error.to_string())?;
    let about = volume.about();
    for level in 0..about.levels.len() {
        let size = about.levels[level].size.map(|side| side.min(MOST_SIDE));
        let at = std::array::from_fn(|axis| about.levels[level].size[axis] - size[axis]);
        for time in [about.times - 1, 0] {
            let region = VolumeRegion { level, channel: about.channels - 1, time, at, size };
            block_on(volume.read(&region)).map_err(|error| error.to_string())?;
        }
    }
    Ok(())
}

/// A fixture with one of its files changed.
fn changed(name: &str, key: &str, change: impl FnOnce(&mut Vec<u8>)) -> Result<(), String> {
    let directory = unpacked(name);
    let file = directory.path().join(key);
    let mut bytes = std::fs::read(&file).unwrap();
    change(&mut bytes);
    std::fs::write(&file, bytes).unwrap();
    read(directory.path())
}

fn replaced(name: &str, key: &str, from: &str, to: &str) -> String {
    let error = changed(name, key, |bytes| {
        let text: String = String::from_utf8(bytes.clone()).unwrap().split_whitespace().collect();
        assert!(text.contains(from), "{text}");
        *bytes = text.replace(from, to).into_bytes();
    });
    error.unwrap_err()
}

#[test]
fn lying_shapes_and_chunks_are_refused() {
    for (name, key, from, to, says) in [
        ("v2-fortran", "0/.zarray", "\"shape\":[5,", "\"shape\":[0,", "side of 0"),
        ("v2-fortran", "0/.zarray", "\"shape\":[5,", "\"shape\":[99999999999,", "side of 99999999999"),
        ("v2-fortran", "0/.zarray", "\"shape\":[5,", "\"shape\":[-5,", "list of whole numbers"),
        ("v2-fortran", "0/.zarray", "\"chunks\":[2,", "\"chunks\":[2000000000,", "larger than"),
        ("v2-fortran", "0/.zarray", "\"chunks\":[2,", "\"chunks\":[0,", "hold nothing"),
        ("v2-fortran", "0/.zarray", "\"chunks\":[2,", "\"chunks\":[2,2,", "axes"),
        ("v2-fortran", "0/.zarray", "\"chunks\":[2,", "\"chunks\":[3,", "bytes"),
        ("v2-fortran", "0/.zarray", ">i2", "<U7", "the type \"<U7\""),
        ("v2-fortran", "0/.zarray", "\"gzip\"", "\"lzma\"", "'lzma'"),
        ("v2-fortran", "0/.zarray", "\"gzip\"", "\"zstd\"", "zstd"),
        ("v05-flat", "0/zarr.json", "\"regular\"", "\"rectilinear\"", "'rectilinear'"),
        ("v05-flat", "0/zarr.json", "\"uint8\"", "\"complex64\"", "complex64"),
        ("v05-flat", "0/zarr.json", "\"name\":\"bytes\"", "\"name\":\"vlen-utf8\"", "vlen-utf8"),
        (
            "v05-shards",
            "0/zarr.json",
            "\"chunk_shape\":[1,1,4,10,10]",
            "\"chunk_shape\":[1,1,5,10,10]",
            "cannot be cut",
        ),
        (
            "v05-shards",
            "0/zarr.json",
            "\"chunk_shape\":[1,1,4,10,10]",
            "\"chunk_shape\":[1,1,4,10,0]",
            "cannot be cut",
        ),
        (
            "v05-shards",
            "0/zarr.json",
            "\"chunk_shape\":[1,1,12,20,30]",
            "\"chunk_shape\":[1,1,1200000000,20000000000,30]",
            "empty or larger",
        ),
    ] {
        let error = replaced(name, key, from, to);
        assert!(error.contains(says), "{name}: {to}: {error}");
        assert!(error.contains("0/"), "{error} names no path");
    }
}

#[test]
fn chunks_that_are_cut_off_or_of_others_are_named() {
    for (name, key) in [
        ("v01-dots", "0/0.0.0.0.0"),
        ("v2-fortran", "0/0/0/0"),
        ("v2-nested-unsaid", "0/0/0/0"),
        ("v05-flat", "0/c/0/0"),
        ("blosc-blosclz-1-uint16", "0/0/0/0"),
        ("blosc-zlib-1-float64", "0/0/0/0"),
        ("v3-transposed", "0/0.0.0"),
    ] {
        let whole = std::fs::read(unpacked(name).path().join(key)).unwrap().len();
        for len in [0, 1, 3, whole / 2, whole - 1] {
            let directory = unpacked(name);
            let file = directory.path().join(key);
            let bytes = std::fs::read(&file).unwrap();
            std::fs::write(&file, &bytes[..len]).unwrap();
            // The whole level, so that this chunk is among what is read.
            let Opened::Volume(volume) = open(directory.path()).unwrap() else { panic!() };
            let size = volume.about().size();
            let region = VolumeRegion { level: 0, channel: 0, time: 0, at: [0; 3], size };
            let error = block_on(volume.read(&region)).unwrap_err().to_string();
            assert!(error.contains(key), "{name}, {len} of {whole}: {error}");
        }
    }
}

#[test]
fn shards_that_are_damaged_are_named() {
    let key = "0/c/0/0/0/0/0";
    for (what, says) in [("cut", "checksum"), ("short", "cut off"), ("sum", "checksum"), ("empty", "cut off")]
    {
        let error = changed("v05-shards", key, |bytes| match what {
            "cut" => bytes.truncate(bytes.len() / 2),
            "short" => bytes.truncate(20),
            "sum" => *bytes.last_mut().unwrap() ^= 1,
            _ => bytes.clear(),
        });
        let error = error.map_or_else(|error| error, |()| String::new());
        assert!(error.contains(says) && error.contains(key), "{what}: {error}");
    }
}

#[test]
fn an_archive_that_is_cut_off_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let bytes = std::fs::read(path("v05-flat.zip")).unwrap();
    let file = directory.path().join("cut.zip");
    for len in (4..bytes.len()).step_by(97).chain([bytes.len() - 1]) {
        std::fs::write(&file, &bytes[..len]).unwrap();
        let error = read(&file).unwrap_err();
        assert!(error.contains("cut.zip"), "{error}");
    }
}

#[test]
fn files_of_other_kinds_that_are_cut_off_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    for name in ["one.nii", "two.nii.gz", "planar.raw", "layers.tif"] {
        std::fs::copy(path("planar.raw.toml"), directory.path().join("planar.raw.toml")).unwrap();
        let bytes = std::fs::read(path(name)).unwrap();
        let file = directory.path().join(name);
        for len in [bytes.len() - 1, bytes.len() / 2] {
            std::fs::write(&file, &bytes[..len]).unwrap();
            match read(&file) {
                Err(error) => assert!(error.contains(name), "{error}"),
                // Fewer pages are a smaller stack, which says so.
                Ok(()) => assert_eq!(name, "layers.tif"),
            }
        }
    }
}

/// The same numbers every time.
fn random(state: &mut u64) -> usize {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) as usize
}

fn files_below(directory: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { files_below(&path, files) } else { files.push(path) }
    }
    files.sort();
}

/// Bytes changed anywhere are read or refused; the fuzzer does more of it (`vastex-fuzz`).
#[test]
fn no_damage_makes_it_panic() {
    let mut state = 18;
    for name in ["v04-center", "v05-shards", "v3-shards-transposed", "v06-systems", "odd-metadata", "plate"] {
        let directory = unpacked(name);
        let mut files = Vec::new();
        files_below(directory.path(), &mut files);
        for _ in 0..60 {
            let file = &files[random(&mut state) % files.len()];
            let sound = std::fs::read(file).unwrap();
            let mut bytes = sound.clone();
            for _ in 0..1 + random(&mut state) % 4 {
                if bytes.is_empty() {
                    break;
                }
                let at = random(&mut state) % bytes.len();
                match random(&mut state) % 4 {
                    0 => bytes[at] ^= 1 << (random(&mut state) % 8),
                    1 => bytes[at] = b"0129-[]{}\",:e"[random(&mut state) % 13],
                    2 => bytes.truncate(at),
                    _ => bytes.insert(at, b'9'),
                }
            }
            std::fs::write(file, &bytes).unwrap();
            if let Err(error) = read(directory.path()) {
                assert!(!error.is_empty());
            }
            std::fs::write(file, &sound).unwrap();
        }
    }
}
