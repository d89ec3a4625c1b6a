//! What volumes say of themselves: scales, origins, conventions, channels, lists, and what was odd.

use pollster::block_on;
use vastex_volume::{BrickCount, Convention, DType, Opened, Volume, open};

use crate::fixtures::{path, unpacked, volume};

fn scales(volume: &Volume) -> Vec<[f64; 3]> {
    volume.about().levels.iter().map(|level| level.scale).collect()
}

fn origins(volume: &Volume) -> Vec<[f64; 3]> {
    volume.about().levels.iter().map(|level| level.origin).collect()
}

fn oddities(name: &str) -> String {
    volume(&path(name)).about().oddities.join("\n")
}

#[test]
fn levels_lie_where_their_convention_says() {
    let center = volume(&path("v04-center.zip"));
    assert_eq!(center.about().convention, Convention::Center);
    assert_eq!(scales(&center), [[0.5, 0.5, 3.0], [1.0, 1.0, 3.0], [3.0, 3.0, 3.0]]);
    assert_eq!(origins(&center), [[-0.25, -0.25, -1.5]; 3]);
    let corner = volume(&path("v05-corner.zip"));
    assert_eq!(corner.about().convention, Convention::Corner);
    assert_eq!(scales(&corner), [[0.5, 0.5, 2.0], [1.0, 1.0, 2.0], [1.5, 1.5, 4.0]]);
    assert_eq!(origins(&corner), [[0.0; 3]; 3]);
    assert_eq!(corner.about().unit.as_deref(), Some("micrometer"));
    let draft = volume(&path("v06-systems.zip"));
    assert_eq!(draft.about().convention, Convention::Center);
    // z is in nanometres there, x in micrometres.
    assert_eq!(scales(&draft)[0].map(|side| (side * 1e6).round() / 1e6), [1.0, 1.0, 2.0]);
    assert_eq!(scales(&volume(&path("v05-axis-order.zip"))), [[0.5, 0.25, 2.0]]);
    let old = volume(&path("v01-dots.zip"));
    assert_eq!(scales(&old), [[1.0; 3], [2.0, 2.0, 1.0]]);
}

#[test]
fn ome_zarr_py_is_read_by_its_own_convention() {
    for name in ["ome-zarr-py-04.zip", "ome-zarr-py-05.zip"] {
        let volume = volume(&path(name));
        let about = volume.about();
        assert!(about.levels.len() > 1 && about.oddities.is_empty(), "{name}: {:?}", about.oddities);
        for level in &about.levels {
            // Its scales are what makes levels of rounded sizes equally large.
            for axis in 0..2 {
                assert_eq!(level.scale[axis] * level.size[axis] as f64, about.size()[axis] as f64, "{name}");
            }
            // Whatever the writer's convention, all levels begin at one corner.
            assert_eq!(level.origin, about.levels[0].origin, "{name}");
        }
    }
}

#[test]
fn channels_are_what_omero_says() {
    let volume = volume(&path("v04-center.zip"));
    let about = volume.about();
    assert_eq!((about.name.as_deref(), about.version.as_deref()), (Some("cells"), Some("0.4")));
    assert_eq!(about.labels, ["cells"]);
    let [first, second] = &about.channel_info[..] else { panic!("{:?}", about.channel_info) };
    assert_eq!(
        (first.name.as_deref(), first.color, first.window),
        (Some("DAPI"), Some([0, 0, 255]), Some([0.0, 1500.0]))
    );
    assert_eq!(
        (second.color, second.window, second.is_active),
        (Some([0, 255, 0]), Some([5.0, 100.0]), Some(false))
    );
    let odd = about.oddities.join("\n");
    for part in ["3 channels, and there are 2", "'#'", "beyond 0 to 100"] {
        assert!(odd.contains(part), "{odd}");
    }
}

#[test]
fn what_was_odd_is_said() {
    for (name, parts) in [
        (
            "odd-metadata.zip",
            &[
                "no JSON",
                "'gone' is listed and is not there",
                "without a path",
                "no finite number",
                "'warp'",
                "the scale -1",
                "finest to the coarsest",
                "no number of six digits",
                "describes 1 channels, and there are 2",
            ][..],
        ),
        ("v2-nested-unsaid.zip", &["'/' is taken"]),
        ("custom-axis.zip", &["'phase' of 2"]),
        ("v05-corner.zip", &["'scale3/cells ü' is listed and is not there"]),
        ("v01-dots.zip", &["no scale is given of the level '1'"]),
        ("plain-array.zip", &["without metadata of an image"]),
        ("v06-systems.zip", &["nanometer"]),
    ] {
        let odd = oddities(name);
        for part in parts {
            assert!(odd.contains(part), "{name}: {part}:\n{odd}");
        }
    }
    for name in ["v05-shards.zip", "v05-flat.zip", "v2-fortran.zip", "deflated.zip", "v3-transposed.zip"] {
        assert_eq!(oddities(name), "", "{name}");
    }
}

#[test]
fn a_path_that_leads_elsewhere_is_not_followed() {
    let directory = unpacked("odd-metadata");
    let odd = volume(directory.path()).about().oddities.join("\n");
    assert!(odd.contains("leads out of the directory"), "{odd}");
}

#[test]
fn lists_name_their_images() {
    for (name, what, images) in [
        ("plate.zip", "a plate", vec!["A/1/0", "A/1/1"]),
        ("bioformats2raw.zip", "a file of several images", vec!["0", "1"]),
    ] {
        let Opened::Images(list) = open(&path(name)).unwrap() else { panic!("{name}") };
        assert_eq!(
            (list.what, &list.images),
            (what, &images.iter().map(|s| (*s).to_owned()).collect()),
            "{name}"
        );
        let found = volume(&path(name).join(images[1]));
        assert_eq!(found.about().size(), [8, 6, 2], "{name}");
    }
    let Opened::Images(list) = open(&path("plate.zip")).unwrap() else { panic!() };
    assert!(list.oddities[0].contains("A/2"), "{:?}", list.oddities);
    let Opened::Images(well) = open(&path("plate.zip").join("A/1")).unwrap() else { panic!() };
    assert_eq!(well.images, ["0", "1"]);
}

#[test]
fn images_that_do_not_lie_below_their_list_are_left_out() {
    let directory = tempfile::tempdir().unwrap();
    let labels = r#"{"labels": ["cells", "../../cells", "", "./", "/cells/fine"]}"#;
    std::fs::write(directory.path().join(".zattrs"), labels).unwrap();
    let Opened::Images(list) = open(directory.path()).unwrap() else { panic!() };
    assert_eq!(list.images, ["cells", "/cells/fine"]);
    let odd = list.oddities.join("\n");
    assert_eq!(list.oddities.len(), 3, "{odd}");
    assert!(odd.contains("'../../cells' is not below"), "{odd}");
}

#[test]
fn absent_bricks_are_counted_without_reading_values() {
    let count = |volume: &Volume| block_on(volume.count_bricks(false)).unwrap();
    // 70 voxels a side are two bricks; the only stored chunk lies in the first.
    let absent = volume(&path("v2-absent.zip"));
    assert_eq!(count(&absent), BrickCount { bricks: 8, absent: Some(7) });
    assert_eq!(count(&volume(unpacked("v2-absent").path())), BrickCount { bricks: 8, absent: Some(7) });
    // Of two times, each one brick; that of the second has chunks at its upper rows.
    assert_eq!(count(&volume(&path("v05-shards.zip"))), BrickCount { bricks: 2, absent: Some(0) });
    assert_eq!(count(&volume(&path("one.nii"))), BrickCount { bricks: 2, absent: Some(0) });
}

#[test]
fn other_kinds_say_what_they_are() {
    let nifti = volume(&path("one.nii"));
    let about = nifti.about();
    assert_eq!((about.kind, about.dtype, about.value_scale), ("nifti", DType::I16, Some([2.5, -3.0])));
    assert_eq!((about.levels[0].scale, about.unit.as_deref()), ([0.5, 0.75, 2.0], Some("millimeter")));
    let imagej = volume(&path("imagej.tif"));
    assert_eq!((imagej.about().levels[0].scale, imagej.about().times), ([1.0, 1.0, 0.5], 2));
    let ome = volume(&path("ome.ome.tif"));
    let about = ome.about();
    assert_eq!(
        (about.levels[0].scale, about.channel_info[1].name.as_deref()),
        ([0.3, 0.3, 1.5], Some("GFP"))
    );
    let raw = volume(&path("planar.raw.toml"));
    assert_eq!((raw.about().levels[0].scale, raw.about().unit.as_deref()), ([0.5, 0.5, 2.0], Some("mm")));
}

/// A path need not be a text: what lies beside an image is found all the same.
#[cfg(target_os = "linux")]
#[test]
fn labels_beside_an_image_are_opened_where_its_path_is_no_text() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    let directory = tempfile::tempdir().unwrap();
    let archive = directory.path().join(OsStr::from_bytes(b"cells\xff.zip"));
    std::fs::copy(path("v04-center.zip"), &archive).unwrap();
    let image = volume(&archive);
    let labels = volume(&image.about().labels_at("cells"));
    assert!(labels.about().is_label);
    assert_eq!((&image.about().root, labels.about().root.starts_with(&archive)), (&archive, true));
}
