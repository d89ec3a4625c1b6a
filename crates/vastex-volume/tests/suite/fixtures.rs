//! The fixtures that `fixtures/make.py` writes, as archives and as directories, and the arrays that they must
//! read as.

use std::io::Read;
use std::path::{Path, PathBuf};

use pollster::block_on;
use tempfile::TempDir;
use vastex_volume::{DType, Opened, Volume, VolumeRegion, open};

/// Where a fixture lies.
pub(crate) fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

/// An array of NumPy.
pub(crate) struct Expected {
    pub(crate) descr: String,
    /// Along t, c, z, y and x.
    pub(crate) shape: [u64; 5],
    pub(crate) bytes: Vec<u8>,
}

/// The array that a fixture must read as.
pub(crate) fn expected(name: &str) -> Expected {
    let file = std::fs::File::open(path(&format!("expected/{name}.npy.gz"))).unwrap();
    let mut npy = Vec::new();
    flate2::read::GzDecoder::new(file).read_to_end(&mut npy).unwrap();
    let header = usize::from(u16::from_le_bytes([npy[8], npy[9]]));
    let text = String::from_utf8(npy[10..10 + header].to_vec()).unwrap();
    let after = |key: &str| text.split_once(&format!("'{key}': ")).unwrap().1.to_owned();
    let descr = after("descr").split('\'').nth(1).unwrap().to_owned();
    let shape = after("shape").split_once(')').unwrap().0.trim_start_matches('(').to_owned();
    let shape: Vec<u64> = shape.split(", ").map(|side| side.trim_end_matches(',').parse().unwrap()).collect();
    Expected { descr, shape: shape.try_into().unwrap(), bytes: npy[10 + header..].to_vec() }
}

/// The files of an archive of stored entries, in a directory.
pub(crate) fn unpacked(name: &str) -> TempDir {
    let bytes = std::fs::read(path(&format!("{name}.zip"))).unwrap();
    let directory = tempfile::tempdir().unwrap();
    let number =
        |at: usize, len: usize| (0..len).fold(0, |n, byte| n | usize::from(bytes[at + byte]) << (8 * byte));
    let mut at = 0;
    while bytes[at..].starts_with(b"PK\x03\x04") {
        assert_eq!(number(at + 8, 2), 0, "{name} has an entry that is not stored");
        let (len, name_len) = (number(at + 18, 4), number(at + 26, 2));
        let data = at + 30 + name_len + number(at + 28, 2);
        let file = directory.path().join(std::str::from_utf8(&bytes[at + 30..at + 30 + name_len]).unwrap());
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, &bytes[data..data + len]).unwrap();
        at = data + len;
    }
    directory
}

pub(crate) fn volume(path: &Path) -> Volume {
    match open(path).unwrap() {
        Opened::Volume(volume) => *volume,
        Opened::Images(list) => panic!("{}: is {}", path.display(), list.what),
    }
}

/// The whole of a channel and a time of the finest level.
pub(crate) fn whole(volume: &Volume, channel: u64, time: u64) -> Vec<u8> {
    let region = VolumeRegion { level: 0, channel, time, at: [0; 3], size: volume.about().size() };
    block_on(volume.read(&region)).unwrap()
}

/// A short name of NumPy, with its byte order.
pub(crate) fn descr(dtype: DType) -> String {
    let order = if dtype.bytes() == 1 { '|' } else { '<' };
    format!("{order}{}", dtype.short_name())
}

/// Compares every value of every channel and time, then boxes at odd places.
pub(crate) fn check(name: &str, volume: &Volume, expected: &Expected) {
    let [times, channels, depth, height, width] = expected.shape;
    let about = volume.about();
    assert_eq!(descr(about.dtype), expected.descr, "{name}");
    assert_eq!(
        (about.times, about.channels, about.size()),
        (times, channels, [width, height, depth]),
        "{name}"
    );
    let bytes = (width * height * depth) as usize * about.dtype.bytes();
    let plane =
        |time: u64, channel: u64| &expected.bytes[(time * channels + channel) as usize * bytes..][..bytes];
    for time in 0..times {
        for channel in 0..channels {
            assert!(
                whole(volume, channel, time) == plane(time, channel),
                "{name}: channel {channel}, time {time}"
            );
        }
    }
    let width_bytes = about.dtype.bytes();
    for n in 0..40_u64 {
        let pick =
            |salt: u64, side: u64| (n.wrapping_mul(0x9e37_79b9) ^ salt.wrapping_mul(0x85eb_ca6b)) % side;
        let at = [pick(1, width), pick(2, height), pick(3, depth)];
        let size = [1 + pick(4, width - at[0]), 1 + pick(5, height - at[1]), 1 + pick(6, depth - at[2])];
        let (channel, time) = (pick(7, channels), pick(8, times));
        let found = block_on(volume.read(&VolumeRegion { level: 0, channel, time, at, size })).unwrap();
        let plane = plane(time, channel);
        let mut wanted = Vec::new();
        for z in at[2]..at[2] + size[2] {
            for y in at[1]..at[1] + size[1] {
                let begin = (((z * height + y) * width + at[0]) as usize) * width_bytes;
                wanted.extend_from_slice(&plane[begin..begin + size[0] as usize * width_bytes]);
            }
        }
        assert!(found == wanted, "{name}: {size:?} at {at:?}, channel {channel}, time {time}");
    }
}
