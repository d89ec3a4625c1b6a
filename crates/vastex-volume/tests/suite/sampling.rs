//! Slices, planes and points beside a naive oracle that shares nothing with them but the stored values.

use std::sync::Arc;

use pollster::block_on;
use tempfile::TempDir;
use vastex_volume::{SliceAxis, Volume, VolumeOptions, VolumePlane, VolumeRegion, VolumeSource, VoxelValue};

use crate::fixtures::{expected, path, volume};
use crate::generated::{Level, random, source};

/// A stored level as numbers, with its place in the world.
struct Oracle {
    values: Vec<f64>,
    size: [u64; 3],
    scale: [f64; 3],
    origin: [f64; 3],
    /// The box of level 0.
    bounds: [[f64; 3]; 2],
}

impl Oracle {
    fn new(volume: &Volume, level: usize) -> Oracle {
        let about = volume.about();
        let of = &about.levels[level];
        let region = VolumeRegion { level, channel: 0, time: 0, at: [0; 3], size: of.size };
        let bytes = block_on(volume.read(&region)).unwrap();
        let finest = &about.levels[0];
        let end =
            std::array::from_fn(|axis| finest.origin[axis] + finest.scale[axis] * finest.size[axis] as f64);
        Oracle {
            values: bytes
                .chunks(2)
                .map(|value| f64::from(u16::from_le_bytes([value[0], value[1]])))
                .collect(),
            size: of.size,
            scale: of.scale,
            origin: of.origin,
            bounds: [finest.origin, end],
        }
    }

    fn at(&self, voxel: [i64; 3]) -> f64 {
        let [x, y, z] = std::array::from_fn(|axis| voxel[axis].clamp(0, self.size[axis] as i64 - 1) as u64);
        self.values[((z * self.size[1] + y) * self.size[0] + x) as usize]
    }

    /// One axis after the other, where the implementation sums eight.
    fn sample(&self, world: [f64; 3]) -> Option<f64> {
        if (0..3).any(|axis| world[axis] < self.bounds[0][axis] || world[axis] > self.bounds[1][axis]) {
            return None;
        }
        let place: [f64; 3] =
            std::array::from_fn(|axis| (world[axis] - self.origin[axis]) / self.scale[axis] - 0.5);
        let first = place.map(|place| place.floor() as i64);
        let mix = |a: f64, b: f64, axis: usize| a + (b - a) * (place[axis] - first[axis] as f64);
        let along_x = |y: i64, z: i64| {
            let at = |x: i64| self.at([first[0] + x, first[1] + y, first[2] + z]);
            mix(at(0), at(1), 0)
        };
        let along_y = |z: i64| mix(along_x(0, z), along_x(1, z), 1);
        Some(mix(along_y(0), along_y(1), 2))
    }
}

fn anisotropic() -> (tempfile::TempDir, Arc<Volume>) {
    let levels = [
        Level::new([61, 47, 23], [16, 16, 8], [0.5, 0.5, 2.0]),
        Level::new([30, 23, 23], [16, 16, 8], [61.0 / 60.0, 47.0 / 46.0, 2.0]),
        Level { moved: [0.1, 0.0, 0.4], ..Level::new([10, 7, 11], [16, 16, 8], [3.1, 3.1, 4.0]) },
    ];
    random(&levels, |_, chunk| chunk != [1, 1, 1])
}

#[test]
fn oblique_planes_equal_the_oracle() {
    let (_directory, volume) = anisotropic();
    let source = source(&volume);
    let planes = [
        VolumePlane {
            corner: [-1.0, -1.0, -1.0],
            right: [0.61, 0.2, 0.3],
            down: [-0.1, 0.5, 0.9],
            size: [60, 50],
        },
        VolumePlane {
            corner: [15.0, 0.0, 0.0],
            right: [0.0, 0.5, 0.0],
            down: [0.0, 0.0, 0.7],
            size: [48, 66],
        },
        VolumePlane {
            corner: [0.0, 20.0, 50.0],
            right: [0.9, 0.1, -0.4],
            down: [0.0, -0.7, -0.9],
            size: [40, 30],
        },
    ];
    for level in 0..3 {
        let oracle = Oracle::new(&volume, level.into());
        for plane in &planes {
            let found = block_on(source.sample_plane(level, plane)).unwrap();
            assert_eq!(found.len() as u32, plane.size[0] * plane.size[1]);
            let mut inside = 0;
            for (n, found) in found.into_iter().enumerate() {
                let world = plane.world_from_pixel(n as u32 % plane.size[0], n as u32 / plane.size[0]);
                let expected = oracle.sample(world);
                assert_eq!(found.is_some(), expected.is_some(), "{world:?}");
                let Some((found, expected)) = found.zip(expected) else { continue };
                assert!(
                    (f64::from(found) - expected).abs() < 1e-3,
                    "level {level}, {world:?}: {found}, {expected}"
                );
                inside += 1;
            }
            assert!(inside > 100);
        }
    }
}

#[test]
fn places_at_middles_are_the_stored_values_and_faces_repeat_them() {
    let (_directory, volume) = anisotropic();
    let source = source(&volume);
    let oracle = Oracle::new(&volume, 0);
    let at = |voxel: [f64; 3]| {
        block_on(source.sample_at(0, source.levels().level(0).world_from_voxel(voxel))).unwrap()
    };
    assert_eq!(at([3.5, 7.5, 2.5]).map(f64::from), Some(oracle.at([3, 7, 2])));
    assert_eq!(at([0.0, 7.5, 2.5]).map(f64::from), Some(oracle.at([0, 7, 2])));
    assert_eq!(at([61.0, 47.0, 23.0]).map(f64::from), Some(oracle.at([60, 46, 22])));
    assert_eq!((at([61.01, 0.0, 0.0]), at([-0.01, 0.0, 0.0])), (None, None));
}

#[test]
fn slices_hold_the_stored_values() {
    let (_directory, volume) = anisotropic();
    let source = source(&volume);
    for (level, axis, index) in [
        (0, SliceAxis::Z, 22),
        (0, SliceAxis::Y, 13),
        (0, SliceAxis::X, 60),
        (1, SliceAxis::Z, 5),
        (1, SliceAxis::X, 41),
        (2, SliceAxis::Y, 46),
    ] {
        let size = source.slice_size(level, axis);
        let found = block_on(source.slice(level, axis, index, [0, 0], size)).unwrap();
        let oracle = Oracle::new(&volume, level.into());
        // The slice that the middle of the voxel of level 0 lies in.
        let along = match axis {
            SliceAxis::X => 0,
            SliceAxis::Y => 1,
            SliceAxis::Z => 2,
        };
        let finest = &volume.about().levels[0];
        let world = finest.origin[along] + (f64::from(index) + 0.5) * finest.scale[along];
        let slice = ((world - oracle.origin[along]) / oracle.scale[along]).floor() as i64;
        let mut values = found.chunks(2).map(|value| f64::from(u16::from_le_bytes([value[0], value[1]])));
        for down in 0..i64::from(size[1]) {
            for right in 0..i64::from(size[0]) {
                let voxel = match axis {
                    SliceAxis::X => [slice, right, down],
                    SliceAxis::Y => [right, slice, down],
                    SliceAxis::Z => [right, down, slice],
                };
                assert_eq!(values.next(), Some(oracle.at(voxel)), "level {level}, {axis:?}, {voxel:?}");
            }
        }
        // A part of it is a part of it.
        let part = block_on(source.slice(level, axis, index, [3, 2], [2, 4])).unwrap();
        let row = |y: usize| &found[((y + 2) * size[0] as usize + 3) * 2..][..4];
        assert_eq!(part, (0..4).flat_map(row).copied().collect::<Vec<u8>>());
    }
    for (level, index, at, size) in
        [(0, 23, [0, 0], [1, 1]), (0, 0, [60, 0], [2, 1]), (0, 0, [0, 0], [0, 1]), (30, 0, [0, 0], [1, 1])]
    {
        let error = block_on(source.slice(level, SliceAxis::Z, index, at, size)).unwrap_err().to_string();
        assert!(error.contains("there are") || error.contains("beyond"), "{error}");
    }
}

#[test]
fn a_point_gives_its_value_and_its_level() {
    let (_directory, volume) = anisotropic();
    let source = source(&volume);
    let world = source.levels().level(0).world_from_voxel([40.2, 12.9, 7.3]);
    for level in 0..3 {
        let oracle = Oracle::new(&volume, level.into());
        let point = block_on(source.value_at(level, world)).unwrap().unwrap();
        assert_eq!((point.level, point.is_made), (level, false));
        assert_eq!(point.value.to_f64(), oracle.at(point.voxel.map(i64::from)));
    }
    let coarsest = source.levels().levels().len() as u8 - 1;
    let point = block_on(source.value_at(coarsest, world)).unwrap().unwrap();
    assert!(point.is_made && point.voxel == [0; 3]);
    assert_eq!(block_on(source.value_at(0, [-1.0, 0.0, 0.0])).unwrap(), None);
    assert_eq!(block_on(source.value_at(0, [f64::NAN; 3])).unwrap(), None);
}

#[test]
fn labels_of_64_bits_are_read_exactly() {
    let volume = Arc::new(volume(&path("v04-center.zip/labels/cells")));
    let expected = expected("v04-center-labels");
    let source = VolumeSource::open(volume, &VolumeOptions::default()).unwrap();
    let [_, _, depth, height, width] = expected.shape;
    let mut largest = 0;
    for (n, value) in expected.bytes.chunks(8).enumerate().take((depth * height * width) as usize) {
        let n = n as u64;
        let voxel = [n % width, n / width % height, n / width / height].map(|at| at as f64 + 0.5);
        let world = source.levels().level(0).world_from_voxel(voxel);
        let point = block_on(source.value_at(0, world)).unwrap().unwrap();
        let stored = u64::from_le_bytes(value.try_into().unwrap());
        let found = match point.value {
            VoxelValue::Unsigned(value) => value,
            VoxelValue::Signed(value) => value as u64,
            VoxelValue::Float(_) => panic!("labels are no floats"),
        };
        assert_eq!(found, stored);
        largest = largest.max(stored);
    }
    assert!(largest > 1 << 53, "{largest}");
}

#[test]
fn percentiles_are_those_of_the_sorted_values() {
    let (_directory, volume) = random(&[Level::new([50, 40, 30], [16, 16, 16], [1.0; 3])], |_, _| true);
    let source = source(&volume);
    let mut values = Oracle::new(&volume, 0).values;
    values.sort_by(f64::total_cmp);
    let last = values.len() - 1;
    let shares = [0.0, 0.5, 0.998, 1.0, 7.0, -1.0];
    let found = block_on(source.percentiles(&shares)).unwrap();
    let expected = shares.map(|share: f64| values[(share.clamp(0.0, 1.0) * last as f64).round() as usize]);
    assert_eq!(found, expected);
    // Many at once, in any order, are the same.
    let many = [&shares[..], &[0.3; 20]].concat();
    let found = block_on(source.percentiles(&many)).unwrap();
    assert_eq!((&found[..6], found[6]), (&expected[..], values[(0.3 * last as f64).round() as usize]));
    let window = block_on(source.usual_window()).unwrap();
    assert_eq!(window, [0.005, 0.998].map(|share: f64| values[(share * last as f64).round() as usize]));
}

#[test]
fn windows_are_those_of_the_file_unless_they_say_nothing() {
    let source_of = |name: &str, channel: u64| {
        let volume = Arc::new(volume(&path(name)));
        VolumeSource::open(volume, &VolumeOptions { channel, ..VolumeOptions::default() }).unwrap()
    };
    let named = source_of("v04-center.zip", 0);
    let window = named.volume().about().channel_info[0].window.unwrap();
    assert_eq!(block_on(named.usual_window()).unwrap(), window);
    // One value everywhere.
    let (_directory, volume) = random(&[Level::new([9, 9, 9], [9, 9, 9], [1.0; 3])], |_, _| false);
    assert_eq!(block_on(source(&volume).usual_window()).unwrap(), [3.0, 4.0]);
}

/// Channels of 8 bits of which this is said, with values from 0 to 19 and windows of all that bytes can be.
fn dim_channels(said: &[&str]) -> (TempDir, Arc<Volume>) {
    let directory = tempfile::tempdir().unwrap();
    let axes = ["c", "z", "y", "x"].map(|name| format!("{{\"name\":\"{name}\"}}")).join(",");
    let window = "{\"min\":0,\"max\":255,\"start\":0,\"end\":255}";
    let channel = |said: &&str| format!("{{{said}\"window\":{window}}}");
    let (count, channels) = (said.len(), said.iter().map(channel).collect::<Vec<_>>().join(","));
    let about = format!(
        "{{\"multiscales\":[{{\"version\":\"0.4\",\"axes\":[{axes}],\"datasets\":[{{\"path\":\"0\"}}]}}],\
         \"omero\":{{\"channels\":[{channels}]}}}}"
    );
    let array = format!(
        "{{\"zarr_format\":2,\"shape\":[{count},5,4,2],\"chunks\":[{count},5,4,2],\"dtype\":\"|u1\",\
         \"compressor\":null,\"fill_value\":0,\"order\":\"C\",\"filters\":null,\"dimension_separator\":\".\"}}"
    );
    std::fs::create_dir(directory.path().join("0")).unwrap();
    let values: Vec<u8> = (0..40 * count as u8).map(|n| n % 20).collect();
    for (key, content) in [
        (".zgroup", b"{\"zarr_format\":2}".as_slice()),
        (".zattrs", about.as_bytes()),
        ("0/.zarray", array.as_bytes()),
        ("0/0.0.0.0", &values),
    ] {
        std::fs::write(directory.path().join(key), content).unwrap();
    }
    let volume = Arc::new(volume(directory.path()));
    (directory, volume)
}

#[test]
fn windows_of_all_that_bytes_can_be_say_nothing_unless_they_are_of_colours() {
    for (colors, window) in [
        (vec!["00FFFF", "FF00FF", "FFFF00"], [0.0, 19.0]),
        (vec!["FF0000", "00FF00", "00FFFF"], [0.0, 19.0]),
        (vec!["FF0000", "00FF00", "0000FF"], [0.0, 255.0]),
        (vec!["FF0000", "00FF00", "0000FF", ""], [0.0, 255.0]),
        (vec!["FF0000", "00FF00", "0000FF", "hidden"], [0.0, 255.0]),
        (vec!["FF0000", "00FF00", "0000FF", "FFFFFF"], [0.0, 19.0]),
    ] {
        let said = colors.iter().map(|color| match *color {
            "" => String::new(),
            "hidden" => "\"color\":\"FFFFFF\",\"active\":false,".to_owned(),
            color => format!("\"color\":\"{color}\","),
        });
        let said: Vec<String> = said.collect();
        let (_directory, volume) = dim_channels(&said.iter().map(String::as_str).collect::<Vec<_>>());
        for channel in 0..colors.len() as u64 {
            let options = VolumeOptions { channel, ..VolumeOptions::default() };
            let source = VolumeSource::open(volume.clone(), &options).unwrap();
            assert_eq!(block_on(source.usual_window()).unwrap(), window, "{colors:?} {channel}");
        }
    }
}
