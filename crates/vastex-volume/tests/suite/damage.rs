//! What a part that cannot be read costs: itself, told with its path, and nothing else.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use pollster::block_on;
use vastex_core::PagePos;
use vastex_tiles::{ReadError, TileSource};
use vastex_volume::{Opened, VolumeRegion, VolumeSource, open};

use crate::fixtures::{path, unpacked, volume};
use crate::generated::{Level, places, random, source, write};

/// Two levels whose values are 100 and 200, and where `bright` says so 1000; the finer one has 40 voxels a
/// side, and both chunks of 10.
fn two_levels(directory: &Path) {
    let levels = [Level::new([40; 3], [10; 3], [1.0; 3]), Level::new([20; 3], [10; 3], [2.0; 3])];
    let value = |level: usize, [x, _, _]: [u64; 3], bytes: &mut Vec<u8>| {
        let of = if x == 0 { 1000 } else { [100_u16, 200][level] };
        bytes.extend(of.to_le_bytes());
    };
    write(directory, "<u2", &levels, value, |_, _| true);
}

#[test]
fn a_damaged_chunk_counts_for_no_window_and_is_told_once() {
    let directory = tempfile::tempdir().unwrap();
    two_levels(directory.path());
    // One that has the bright ones.
    let damage = |level: usize, chunk: &str| {
        fs::write(directory.path().join(format!("{level}/{chunk}")), b"cut").unwrap();
    };
    damage(0, "1.1.0");
    let first = source(&volume(directory.path()).into());
    let found = block_on(first.percentiles(&[0.0, 0.5, 1.0])).unwrap();
    assert_eq!(found, [100.0, 100.0, 1000.0]);
    assert_eq!(block_on(first.usual_window()).unwrap(), [100.0, 1000.0]);
    let faults = first.faults();
    assert!(faults.len() == 1 && faults[0].error().path.ends_with("0/1.1.0"), "{faults:?}");
    // Where nothing is left of the level, the next one; where nothing is left at all, what values can be.
    let places = || (0..64).map(|n| format!("{}.{}.{}", n / 16, n / 4 % 4, n % 4));
    places().for_each(|chunk| damage(0, &chunk));
    let second = source(&volume(directory.path()).into());
    assert_eq!(block_on(second.percentiles(&[0.5])).unwrap(), [200.0]);
    (0..8).for_each(|n| damage(1, &format!("{}.{}.{}", n / 4, n / 2 % 2, n % 2)));
    let third = source(&volume(directory.path()).into());
    assert_eq!(block_on(third.usual_window()).unwrap(), [0.0, 65535.0]);
}

/// What the tail has of a level: its voxels, without borders.
fn in_tail(source: &VolumeSource, level: u8, at: [u32; 3]) -> u16 {
    all_in_tail(source, level, &[at])[0]
}

/// The same of several voxels.
fn all_in_tail(source: &VolumeSource, level: u8, voxels: &[[u32; 3]]) -> Vec<u16> {
    let geometry = &source.description().geometry;
    let tile = block_on(source.read(geometry.tail_pos())).unwrap().decode(source.description()).unwrap();
    let (offset, size) = (geometry.tail().offset(level), geometry.tile());
    let value = |at: &[u32; 3]| {
        let [x, y, z]: [u32; 3] = std::array::from_fn(|axis| offset[axis] + at[axis] + 1);
        let texel = ((z * size[1] + y) * size[0] + x) as usize;
        u16::from_le_bytes(tile[2 * texel..][..2].try_into().unwrap())
    };
    voxels.iter().map(value).collect()
}

#[test]
fn the_next_finer_level_stands_for_what_the_coarsest_lacks() {
    let levels = [
        Level::new([48, 40, 30], [16; 3], [1.0; 3]),
        Level { moved: [0.0, 0.5, 0.0], ..Level::new([12, 10, 8], [12, 10, 4], [4.0; 3]) },
    ];
    let (directory, whole) = random(&levels, |_, _| true);
    let opened = || Arc::new(volume(directory.path()));
    let sound = source(&whole);
    let geometry = &sound.description().geometry;
    assert_eq!(geometry.tail().first_level(), 1, "the coarser level is the tail");
    let at = [7, 5, 2];
    let stored = in_tail(&sound, 1, at);
    let behind = in_tail(&sound, 1, [7, 5, 6]);
    fs::write(directory.path().join("1/0.0.0"), b"damaged").unwrap();
    let damaged = source(&opened());
    // The voxel of the finer level that the middle lies in.
    let of_finer = {
        let middle = damaged.levels().level(1).world_from_voxel(at.map(|at| f64::from(at) + 0.5));
        let voxel = damaged.levels().level(0).voxel_from_world(middle).map(|at| at.floor() as u64);
        let region = VolumeRegion { level: 0, channel: 0, time: 0, at: voxel, size: [1; 3] };
        u16::from_le_bytes(block_on(damaged.volume().read(&region)).unwrap().try_into().unwrap())
    };
    assert_ne!(of_finer, stored);
    assert_eq!(in_tail(&damaged, 1, at), of_finer);
    assert_eq!(in_tail(&damaged, 1, [7, 5, 6]), behind, "the other chunk is as it was");
    let faults = damaged.faults();
    assert!(faults.len() == 1 && faults[0].error().path.ends_with("1/0.0.0"), "{faults:?}");
    // The finer level is whole.
    for pos in geometry.pages_of_level(0) {
        block_on(damaged.read(pos)).unwrap();
    }
    // Without it, the fill value.
    for entry in fs::read_dir(directory.path().join("0")).unwrap() {
        let path = entry.unwrap().path();
        if !path.ends_with(".zarray") {
            fs::write(path, b"damaged").unwrap();
        }
    }
    assert_eq!(in_tail(&source(&opened()), 1, at), 3);
}

#[test]
fn a_volume_of_nothing_but_damage_is_not_searched_for_what_might_stand_for_it() {
    let levels = [128, 64, 32, 16].map(|side| Level::new([side; 3], [16; 3], [128.0 / side as f64; 3]));
    let (directory, _) = random(&levels, |_, _| false);
    for (level, across) in [8, 4, 2, 1].into_iter().enumerate() {
        for [x, y, z] in places([across; 3]) {
            fs::write(directory.path().join(format!("{level}/{z}.{y}.{x}")), b"damaged").unwrap();
        }
    }
    let source = source(&Arc::new(volume(directory.path())));
    assert_eq!(source.description().geometry.tail().first_level(), 4);
    assert_eq!(in_tail(&source, 4, [2, 6, 7]), 3, "the fill value");
}

/// A copy that broke off has no more than its fine levels.
#[test]
fn levels_further_down_stand_for_several_coarse_ones_but_not_without_end() {
    let levels = [64, 32, 16].map(|side| Level::new([side; 3], [4; 3], [64.0 / side as f64; 3]));
    let value = |_: usize, _: [u64; 3], bytes: &mut Vec<u8>| bytes.extend(1000_u16.to_le_bytes());
    // Level 3 has 8 voxels a side and is made; each of them comes of one chunk of level 1.
    let found = |damaged: u64| {
        let directory = tempfile::tempdir().unwrap();
        write(directory.path(), "<u2", &levels, value, |_, _| true);
        for (level, across) in [(1, 8), (2, 4)] {
            for [x, y, z] in places([across; 3]).filter(|[_, _, z]| level == 2 || *z < damaged) {
                fs::write(directory.path().join(format!("{level}/{z}.{y}.{x}")), b"damaged").unwrap();
            }
        }
        let source = source(&Arc::new(volume(directory.path())));
        let voxels: Vec<[u32; 3]> = places([8; 3]).map(|at| at.map(|at| at as u32)).collect();
        all_in_tail(&source, 3, &voxels).iter().filter(|value| **value == 1000).count()
    };
    assert_eq!(found(2), 512);
    assert_eq!(found(8), 256, "as many as are looked for");
}

#[test]
fn what_is_no_file_is_no_absent_chunk() {
    let (directory, _) = random(&[Level::new([40; 3], [20; 3], [1.0; 3])], |_, _| true);
    let chunk = directory.path().join("0/0.0.0");
    fs::remove_file(&chunk).unwrap();
    fs::create_dir(&chunk).unwrap();
    let volume = Arc::new(volume(directory.path()));
    let region = VolumeRegion { level: 0, channel: 0, time: 0, at: [0; 3], size: [40; 3] };
    let error = block_on(volume.read(&region)).unwrap_err().to_string();
    assert!(error.contains("0/0.0.0") && error.contains("no file"), "{error}");
    // Nor is it known to be absent before it is read.
    let source = source(&volume);
    let page = PagePos::at(0, [0; 3]);
    assert!(!source.is_absent(page));
    let error = block_on(source.read(page)).unwrap_err();
    assert!(matches!(&error, ReadError::Store { place, .. } if place.ends_with("0/0.0.0")), "{error}");
}

/// The metadata of a level, named otherwise than anything that is known.
fn with_unknown_codec(directory: &Path, level: usize) {
    let meta = directory.join(format!("{level}/.zarray"));
    let text = fs::read_to_string(&meta).unwrap();
    fs::write(meta, text.replace("\"filters\":null", "\"filters\":[{\"id\":\"delta\",\"dtype\":\"<u2\"}]"))
        .unwrap();
}

#[test]
fn levels_that_are_left_out_keep_their_numbers() {
    let levels = [40, 20, 10].map(|side| Level::new([side; 3], [10; 3], [40.0 / side as f64; 3]));
    for (lacking, numbers, finest) in [
        (&[0][..], [None, Some(0), Some(1)], Some("0")),
        (&[1], [Some(0), None, Some(1)], None),
        (&[0, 1], [None, None, Some(0)], Some("0")),
        (&[2], [Some(0), Some(1), None], None),
    ] {
        let (directory, _) = random(&levels, |_, _| true);
        lacking.iter().for_each(|level| with_unknown_codec(directory.path(), *level));
        let volume = volume(directory.path());
        let about = volume.about();
        for (number, place) in numbers.into_iter().enumerate() {
            match (about.level_numbered(number), place) {
                (Ok(found), Some(place)) => assert_eq!(found, place, "{lacking:?}"),
                (Err(error), None) => {
                    let error = error.to_string();
                    assert!(
                        error.contains("delta") && error.contains(&format!("{number}/.zarray")),
                        "{error}"
                    );
                }
                (found, _) => panic!("{lacking:?}, level {number}: {found:?}"),
            }
        }
        assert_eq!(about.finest_left_out().map(|left| &*left.path), finest, "{lacking:?}");
        let error = about.level_numbered(3).unwrap_err().to_string();
        assert!(error.contains("levels 0 to 2"), "{error}");
    }
    // One of other values is none of the pyramid, and keeps its number, too.
    let (directory, _) = random(&levels, |_, _| true);
    let meta = directory.path().join("1/.zarray");
    let text = fs::read_to_string(&meta).unwrap();
    fs::write(&meta, text.replace("<u2", "<u4")).unwrap();
    let unlike = volume(directory.path());
    let [first, second, third] = [0, 1, 2].map(|number| unlike.about().level_numbered(number));
    assert_eq!((first.unwrap(), third.unwrap()), (0, 1));
    let error = second.unwrap_err().to_string();
    assert!(error.contains("'1' has other values, channels or times"), "{error}");
    // So does one that says nothing of how fine it is, or something else, or is listed in another order; and
    // one that is as large as another one.
    for (sides, order, scales, others, numbers) in [
        ([32, 16, 8], [0, 1, 2], Some([1.0, 1.0, 1.0]), &[1][..], [Some(0), None, Some(1)]),
        ([32, 16, 8], [2, 1, 0], None, &[1], [Some(0), None, Some(1)]),
        ([32, 16, 8], [0, 1, 2], Some([1.0, 0.5, 4.0]), &[1], [Some(0), None, Some(1)]),
        ([32, 32, 16], [0, 1, 2], None, &[1], [Some(0), None, Some(1)]),
        ([32, 32, 16], [0, 1, 2], None, &[], [Some(0), None, Some(1)]),
    ] {
        let levels = sides.map(|side| Level::new([side; 3], [8; 3], [1.0; 3]));
        let (directory, _) = random(&levels, |_, _| true);
        for level in others {
            let meta = directory.path().join(format!("{level}/.zarray"));
            let text = fs::read_to_string(&meta).unwrap();
            fs::write(&meta, text.replace("<u2", "<u4")).unwrap();
        }
        let meta = directory.path().join(".zattrs");
        let mut said: serde_json::Value = serde_json::from_slice(&fs::read(&meta).unwrap()).unwrap();
        let dataset = |level: usize| match scales {
            Some(scales) => serde_json::json!({
                "path": level.to_string(),
                "coordinateTransformations": [{"type": "scale", "scale": vec![scales[level]; 3]}],
            }),
            None => serde_json::json!({ "path": level.to_string() }),
        };
        said["multiscales"][0]["datasets"] = order.map(dataset).to_vec().into();
        fs::write(&meta, said.to_string()).unwrap();
        let volume = volume(directory.path());
        let found = [0, 1, 2].map(|number| volume.about().level_numbered(number).ok());
        assert_eq!(found, numbers, "{sides:?} {order:?} {scales:?} {others:?}");
        assert_eq!(volume.about().finest_left_out(), None);
    }
    // So does one that cannot be opened, and one without a path, where scales say nothing or are in another
    // order than the list.
    let scales = |scales: [f64; 3]| move |level: usize| scales[level];
    for (lacking, order, said, numbers) in [
        (&[0][..], [0, 1, 2], scales([1.0; 3]), [None, Some(0), Some(1)]),
        (&[1], [0, 1, 2], scales([1.0; 3]), [Some(0), None, Some(1)]),
        (&[0, 1], [2, 1, 0], scales([1.0, 2.0, 4.0]), [None, None, Some(0)]),
    ] {
        let levels = [32, 16, 8].map(|side| Level::new([side; 3], [8; 3], [1.0; 3]));
        for has_path in [true, false] {
            let (directory, _) = random(&levels, |_, _| true);
            let dataset = |level: usize| {
                let scale = serde_json::json!([{"type": "scale", "scale": vec![said(level); 3]}]);
                match has_path || !lacking.contains(&level) {
                    true => serde_json::json!({
                        "path": level.to_string(), "coordinateTransformations": scale,
                    }),
                    false => serde_json::json!({ "coordinateTransformations": scale }),
                }
            };
            if has_path {
                lacking.iter().for_each(|level| with_unknown_codec(directory.path(), *level));
            }
            let meta = directory.path().join(".zattrs");
            let mut said: serde_json::Value = serde_json::from_slice(&fs::read(&meta).unwrap()).unwrap();
            said["multiscales"][0]["datasets"] = order.map(dataset).to_vec().into();
            fs::write(&meta, said.to_string()).unwrap();
            let volume = volume(directory.path());
            let found = [0, 1, 2].map(|number| volume.about().level_numbered(number).ok());
            assert_eq!(found, numbers, "{lacking:?} {order:?} {has_path}");
            if let (true, [finest, ..]) = (has_path && numbers[0].is_none(), lacking) {
                let left = volume.about().finest_left_out().map(|left| left.path.clone());
                assert_eq!(left, Some(finest.to_string()));
            }
        }
    }
    // What a file says comes to nobody as it is.
    let (directory, _) = random(&levels, |_, _| true);
    let (meta, name) = (directory.path().join(".zattrs"), format!("1\u{1b}[31m{}", "x".repeat(150)));
    fs::rename(directory.path().join("1"), directory.path().join(&name)).unwrap();
    let text = fs::read_to_string(directory.path().join(&name).join(".zarray")).unwrap();
    fs::write(directory.path().join(&name).join(".zarray"), text.replace("<u2", "<u4")).unwrap();
    let mut said: serde_json::Value = serde_json::from_slice(&fs::read(&meta).unwrap()).unwrap();
    said["multiscales"][0]["datasets"][1]["path"] = name.into();
    fs::write(&meta, said.to_string()).unwrap();
    let error = volume(directory.path()).about().level_numbered(1).unwrap_err().to_string();
    assert!(error.contains("other values") && !error.contains('\u{1b}') && error.len() < 300, "{error}");
    // One that is not there is left out like any other; of the fixture's nobody knows how fine they are.
    let (directory, _) = random(&levels, |_, _| true);
    fs::remove_dir_all(directory.path().join("0")).unwrap();
    let error = volume(directory.path()).about().level_numbered(0).unwrap_err().to_string();
    assert!(error.contains("/0: is listed as a level and is not there"), "{error}");
    assert_eq!(volume(&path("odd-metadata.zip")).about().finest_left_out(), None);
}

#[test]
fn wells_that_are_unsound_leave_the_others() {
    for (name, said) in
        [("../../x", "'../../x' is not below the plate"), ("A/7", "A/7/.zattrs: is no sound JSON")]
    {
        let directory = unpacked("plate");
        let broken = directory.path().join("A/7");
        fs::create_dir_all(&broken).unwrap();
        fs::write(broken.join(".zattrs"), "{\"well\": ").unwrap();
        let file = directory.path().join(".zattrs");
        let mut meta: serde_json::Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
        meta["plate"]["wells"].as_array_mut().unwrap().insert(0, serde_json::json!({ "path": name }));
        fs::write(&file, meta.to_string()).unwrap();
        let Opened::Images(list) = open(directory.path()).unwrap() else { panic!("a plate") };
        assert_eq!(list.images, ["A/1/0", "A/1/1"]);
        let odd = list.oddities.join("\n");
        assert!(odd.contains(said) && odd.contains("left out"), "{odd}");
    }
}

#[test]
fn times_have_a_step_and_a_unit() {
    let directory = unpacked("v04-center");
    let file = directory.path().join(".zattrs");
    let mut said: serde_json::Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    let image = &mut said["multiscales"][0];
    image["axes"][0]["unit"] = "second".into();
    for dataset in image["datasets"].as_array_mut().unwrap() {
        dataset["coordinateTransformations"][0]["scale"][0] = 2.5.into();
    }
    fs::write(&file, said.to_string()).unwrap();
    let volume = volume(directory.path());
    let about = volume.about();
    // The pyramid has a scale of 0.1 for all of its levels.
    assert_eq!((about.times, about.time_step, about.time_unit.as_deref()), (2, Some(0.25), Some("second")));
}

/// Of a pair of files either is the volume.
#[test]
fn values_of_a_pair_are_read_by_their_header() {
    let directory = tempfile::tempdir().unwrap();
    let one = fs::read(path("one.nii")).unwrap();
    let (mut header, values) = (one[..352].to_vec(), &one[352..]);
    header[344..348].copy_from_slice(b"ni1\0");
    header[108..112].copy_from_slice(&0_f32.to_le_bytes());
    let [hdr, img] = ["one.hdr", "one.img"].map(|name| directory.path().join(name));
    fs::write(&img, values).unwrap();
    let error = open(&img).unwrap_err().to_string();
    assert!(error.contains("a file .hdr"), "{error}");
    fs::write(&hdr, header).unwrap();
    assert!(vastex_volume::is_volume(&img));
    let found = [&hdr, &img].map(|path| crate::fixtures::whole(&volume(path), 0, 0));
    assert!(found[0] == found[1] && found[0] == crate::fixtures::whole(&volume(&path("one.nii")), 0, 0));
    assert_eq!(vastex_volume::files_of_volume(&img), [hdr, img]);
    // A header that has its own values is of no other file.
    let whole = fs::read(path("one.nii")).unwrap();
    fs::write(directory.path().join("two.hdr"), &whole).unwrap();
    let two = directory.path().join("two.img");
    fs::write(&two, [0; 4000]).unwrap();
    assert!(open(&two).is_err() && vastex_volume::files_of_volume(&two) == [two.clone()]);
    // The header has its values in another file than this one.
    let gzipped = directory.path().join("one.img.gz");
    fs::write(&gzipped, b"other values").unwrap();
    let error = open(&gzipped).unwrap_err().to_string();
    assert!(error.contains("one.img.gz") && error.contains("in another file"), "{error}");
}
