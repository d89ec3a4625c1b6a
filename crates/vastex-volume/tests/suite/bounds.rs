//! What is believed of a file at most, seen from outside: metadata without end, plates, pipes, runs, damage.

use std::path::Path;
use std::sync::mpsc;
use std::time::Duration;

use pollster::block_on;
use serde_json::{Value, json};
use vastex_volume::{BrickLayout, BrickPos, ImageList, Opened, open};

use crate::fixtures::{unpacked, volume};

fn change(file: &Path, change: impl FnOnce(&mut Value)) {
    let mut value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    change(&mut value);
    std::fs::write(file, value.to_string()).unwrap();
}

fn images(path: &Path) -> ImageList {
    match open(path).unwrap() {
        Opened::Images(list) => list,
        Opened::Volume(_) => panic!("{} is one image", path.display()),
    }
}

#[test]
fn transformations_of_all_levels_are_applied_once() {
    let directory = unpacked("v04-center");
    change(&directory.path().join(".zattrs"), |value| {
        value["multiscales"][0]["coordinateTransformations"] = vec![json!(0); 1000].into();
    });
    let volume = volume(directory.path());
    let oddities = &volume.about().oddities;
    assert_eq!((volume.about().levels.len(), oddities.len()), (3, 201));
    let more: usize = oddities[200].split(' ').nth(1).unwrap().parse().unwrap();
    assert!((800..900).contains(&more), "{more}");
}

#[test]
fn wells_are_read_once_and_up_to_a_number_of_images() {
    let directory = unpacked("plate");
    let before = images(directory.path());
    change(&directory.path().join(".zattrs"), |value| {
        let wells = value["plate"]["wells"].as_array_mut().unwrap();
        *wells = wells.iter().cycle().take(1000 * wells.len()).cloned().collect();
    });
    assert_eq!(images(directory.path()).images, before.images);

    let directory = tempfile::tempdir().unwrap();
    let wells: Vec<Value> = ["a", "b", "absent"].map(|path| json!({ "path": path })).into();
    let write = |key: &str, value: Value| {
        let file = directory.path().join(key);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, value.to_string()).unwrap();
    };
    write(".zattrs", json!({"plate": {"wells": wells}}));
    let fields: Vec<Value> = (0..60_000).map(|n| json!({"path": n.to_string()})).collect();
    for well in ["a/.zattrs", "b/.zattrs"] {
        write(well, json!({"well": {"images": fields}}));
    }
    let found = images(directory.path());
    assert_eq!((found.images.len(), found.images[99_999].as_str()), (100_000, "b/39999"));
    assert!(found.oddities.len() == 1 && found.oddities[0].contains("more than"), "{:?}", found.oddities);
}

#[test]
fn images_whose_names_would_steer_a_terminal_are_left_out() {
    let directory = tempfile::tempdir().unwrap();
    let labels = json!({"labels": ["cells", "\u{1b}]0;x\u{7}", "nuclei"]});
    std::fs::write(directory.path().join(".zattrs"), labels.to_string()).unwrap();
    let found = images(directory.path());
    assert_eq!(found.images, ["cells", "nuclei"]);
    assert!(
        found.oddities.len() == 1 && found.oddities[0].contains("control characters"),
        "{:?}",
        found.oddities
    );
    assert!(!found.oddities[0].contains(char::is_control), "{:?}", found.oddities);
}

#[test]
fn metadata_and_chains_of_codecs_have_a_length() {
    let directory = unpacked("v2-fortran");
    let file = directory.path().join("0/.zarray");
    let sound = std::fs::read(&file).unwrap();
    let refused = || open(directory.path()).unwrap_err().to_string();
    std::fs::write(&file, [&sound[..], &vec![b' '; 9 << 20]].concat()).unwrap();
    let error = refused();
    assert!(error.contains("8 MiB") && error.contains("0/.zarray"), "{error}");
    std::fs::write(&file, &sound).unwrap();
    change(&file, |value| value["filters"] = vec![json!({"id": "shuffle"}); 8].into());
    let error = refused();
    assert!(error.contains("9 codecs") && error.contains("0/.zarray"), "{error}");
}

#[cfg(unix)]
#[test]
fn pipes_are_no_metadata() {
    let directory = unpacked("v05-flat");
    let file = directory.path().join("zarr.json");
    std::fs::remove_file(&file).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(&file).status().unwrap().success());
    let (said, told) = mpsc::channel();
    let path = directory.path().to_owned();
    std::thread::spawn(move || said.send(open(&path).map(drop)));
    let error = told.recv_timeout(Duration::from_secs(30)).unwrap().unwrap_err().to_string();
    assert!(error.contains("zarr.json") && error.contains("it is no file"), "{error}");
}

/// A large stack as ImageJ writes it: one directory, a description, and so many bytes of 4x4 pages. Of its
/// pixels 10 lie in a unit along x, and 8 along y.
fn imagej(bytes: usize) -> Vec<u8> {
    let description = b"ImageJ=1.54f\nimages=1000\nslices=1000\nunit=micron\nspacing=0.5\n\0";
    let place = 8 + 2 + 12 * 12 + 4;
    let pixels = place + description.len() as u32;
    let values = pixels + 16;
    let tags: [(u16, u16, u32, u32); 12] = [
        (256, 4, 1, 4),
        (257, 4, 1, 4),
        (258, 3, 1, 8),
        (259, 3, 1, 1),
        (262, 3, 1, 1),
        (270, 2, description.len() as u32, place),
        (273, 4, 1, values),
        (278, 4, 1, 4),
        (279, 4, 1, 16),
        (282, 5, 1, pixels),
        (283, 5, 1, pixels + 8),
        (296, 3, 1, 1),
    ];
    let mut file = b"II\x2a\0\x08\0\0\0\x0c\0".to_vec();
    for (tag, kind, count, value) in tags {
        file.extend([&tag.to_le_bytes()[..], &kind.to_le_bytes(), &count.to_le_bytes()].concat());
        file.extend(value.to_le_bytes());
    }
    let rationals = [100_000_u32, 10_000, 80_000, 10_000].map(u32::to_le_bytes).concat();
    file.extend([&[0; 4][..], description, &rationals, &vec![7; bytes]].concat());
    file
}

#[test]
fn a_run_of_pages_is_as_long_as_its_file() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("run.tif");
    std::fs::write(&file, imagej(16_000)).unwrap();
    let whole = volume(&file);
    assert_eq!((whole.about().size(), whole.about().oddities.len()), ([4, 4, 1000], 0));
    let about = whole.about();
    assert_eq!((about.levels[0].scale, about.unit.as_deref()), ([0.1, 0.125, 0.5], Some("micron")));
    std::fs::write(&file, imagej(3 * 16 + 5)).unwrap();
    let cut = volume(&file);
    assert_eq!(cut.about().size(), [4, 4, 3]);
    assert!(cut.about().oddities[0].contains("long enough for 3"), "{:?}", cut.about().oddities);
    std::fs::write(&file, imagej(16)).unwrap();
    assert!(open(&file).is_err());
}

#[test]
fn a_damaged_chunk_fails_its_own_bricks_alone() {
    let directory = unpacked("v2-fortran");
    std::fs::write(directory.path().join("0/0/0/0"), b"damaged").unwrap();
    let volume = volume(directory.path());
    let layout = BrickLayout { side: 2, border: 0 };
    let counts = volume.about().size().map(|side| side.div_ceil(2));
    let mut wanted = Vec::new();
    for n in 0..counts.iter().product() {
        let at = [n % counts[0], n / counts[0] % counts[1], n / counts[0] / counts[1]];
        wanted.push(BrickPos { level: 0, channel: 0, time: 0, at });
    }
    let mut found = Vec::new();
    block_on(volume.read_bricks(layout, &wanted, &mut |pos, brick| found.push((pos, brick)))).unwrap();
    assert_eq!(found.len(), wanted.len());
    let (sound, failed): (Vec<_>, Vec<_>) = found.into_iter().partition(|(_, brick)| brick.is_ok());
    assert!(!sound.is_empty() && !failed.is_empty());
    for (pos, brick) in failed {
        let chunk = volume.about().levels[0].chunk;
        assert!((0..3).all(|axis| 2 * pos.at[axis] < chunk[axis]), "{pos:?}");
        assert!(brick.unwrap_err().to_string().contains("0/0/0/0"));
    }
}
