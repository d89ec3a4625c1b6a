//! TIFF pyramids of other programs in the place of containers, and regions of whatever can be opened.

use std::path::Path;

use crate::tool::Sandbox;

/// Copies a file of `assets/tiff` into the sandbox.
fn copy(sandbox: &Sandbox, name: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/tiff").join(name);
    sandbox.write(name, &std::fs::read(path).unwrap());
}

/// A grey TIFF of tiles of 256x256 texels without coarser levels, whose tiles are not there, and whose colour
/// profile is none.
fn tiff_without_its_tiles(columns: u32, rows: u32) -> Vec<u8> {
    let count = columns * rows;
    let mut file = [b"II\x2a\0".as_slice(), &(8 + 8 * count).to_le_bytes()].concat();
    [1 << 30, 65_536]
        .into_iter()
        .for_each(|word: u32| file.extend(word.to_le_bytes().repeat(count as usize)));
    let entries = [
        (256, 1, columns * 256),
        (257, 1, rows * 256),
        (258, 1, 8),
        (259, 1, 1),
        (262, 1, 1),
        (277, 1, 1),
        (322, 1, 256),
        (323, 1, 256),
        (324, count, 8),
        (325, count, 8 + 4 * count),
        (34_675, 128, 8),
    ];
    file.extend((entries.len() as u16).to_le_bytes());
    for (tag, count, value) in entries {
        let [tag, kind]: [u16; 2] = [tag, if tag == 34_675 { 7 } else { 4 }];
        file.extend([tag, kind].map(u16::to_le_bytes).concat());
        file.extend([count, value].map(u32::to_le_bytes).concat());
    }
    file.extend([0; 4]);
    file
}

/// Without levels all tiles would have to be read to show it, and one of many is not even shown so.
#[test]
fn of_an_image_of_tiles_without_levels_no_tile_is_read_to_describe_it() {
    let sandbox = Sandbox::new();
    for (columns, rows, levels, is_built_first) in [(3, 2, 11, false), (64, 64, 15, true)] {
        sandbox.write("tiles.tif", &tiff_without_its_tiles(columns, rows));
        let told = sandbox.run(&["info", "tiles.tif", "--json"]).expect_code(0).json();
        assert_eq!(told["kind"], "tiff");
        assert_eq!(told["size"], serde_json::json!([256 * columns, 256 * rows]));
        assert_eq!(
            (&told["levels"], &told["stored_levels"][0]["tile"]),
            (&levels.into(), &serde_json::json!([256, 256]))
        );
        let text = sandbox.run(&["info", "tiles.tif", "--estimate", "640x480"]).expect_code(0).stdout;
        assert!(text.contains("the file stores 1") && text.contains("640 x 480"), "{text}");
        // What is true of its tiles where they lie is not said where it is built before it is shown.
        for words in ["11, of which", "shown as", "shown as they are stored"] {
            assert_eq!(text.contains(words), !is_built_first, "{words}: {text}");
        }
        assert_eq!(text.contains("into the cache before it is shown"), is_built_first, "{text}");
        assert_eq!(told["notices"].as_array().unwrap().is_empty(), is_built_first, "{told}");
    }
}

#[test]
fn pyramids_are_described_and_drawn_without_a_build() {
    let sandbox = Sandbox::new();
    copy(&sandbox, "slide-jpeg.svs");
    copy(&sandbox, "cog-jpeg.tif");
    let slide = sandbox.run(&["info", "slide-jpeg.svs", "--json"]).expect_code(0).json();
    assert_eq!(slide["kind"], "tiff");
    assert_eq!(slide["size"], serde_json::json!([203, 141]));
    assert_eq!(slide["magnification"], 20.0);
    assert_eq!(slide["pixel_size"], serde_json::json!({ "size": [0.499, 0.499], "unit": "µm" }));
    let roles: Vec<_> =
        slide["other_images"].as_array().unwrap().iter().map(|image| image["role"].clone()).collect();
    assert_eq!(roles, ["thumbnail", "label", "macro"]);
    let text = sandbox.run(&["info", "cog-jpeg.tif", "--estimate", "640x480"]).expect_code(0).stdout;
    for words in ["EPSG:32633", "level 1: 101 x 70 texels", "mask 203 x 141", "10 metre", "640 x 480"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    sandbox.run(&["build", "cog-jpeg.tif", "-o", "built.vastex", "--page", "128"]).expect_code(0);
    for (source, picture) in [("cog-jpeg.tif", "a.png"), ("built.vastex", "b.png")] {
        sandbox.run(&["render", source, "--size", "203x141", "-o", picture]).expect_code(0);
    }
    assert!(
        sandbox.read("a.png") == sandbox.read("b.png"),
        "the file and what is built of it look different"
    );
}

/// Names and values of what a file says, each in one line of the text or in one word of the JSON.
#[test]
fn what_a_file_says_in_words_is_told_whole() {
    let sandbox = Sandbox::new();
    for (name, said) in [
        (
            "cog-deflate-u16.tif",
            &[
                ("samples", "1 of 16 bits, whole numbers, grey, black is 0"),
                ("GTModelType", "projected (1)"),
                ("GTRasterType", "texels are areas (1)"),
                ("ProjectedCRS", "EPSG:32633"),
                ("GeodeticCitation", "WGS 84"),
                ("GeogAngularUnits", "degree (9102)"),
            ][..],
        ),
        (
            "slide-jpeg.svs",
            &[
                ("samples", "3 of 8 bits, whole numbers, YCbCr"),
                ("software", "tifffile.py"),
                ("description", "Aperio Image Library v12.0.15\n203x141 [0,0 203x141] (203x141)"),
                ("AppMag", "20"),
                ("MPP", "0.4990"),
            ],
        ),
        (
            "ome-slide.ome.tif",
            &[
                ("OME Creator", "tifffile.py 2026.3.3"),
                ("Image Name", "detail & edge"),
                ("Pixels PhysicalSizeX", "0.25"),
            ],
        ),
    ] {
        copy(&sandbox, name);
        let told = sandbox.run(&["info", name, "--json"]).expect_code(0).json();
        let text = sandbox.run(&["info", name]).expect_code(0).stdout;
        for (name, value) in said {
            let words = told["words"].as_array().unwrap();
            assert!(words.iter().any(|w| w["name"] == *name && w["value"] == *value), "{name}: {told}");
            let first = value.lines().next().unwrap();
            let is_told = |line: &str| line.trim().starts_with(name) && line.ends_with(first);
            assert!(text.lines().any(is_told), "{name}: {text}");
        }
    }
    let text = sandbox.run(&["info", "ome-slide.ome.tif"]).expect_code(0).stdout;
    let images =
        r#"macro ("macro image") 101 x 70, label ("label image") 17 x 15, image ("detail & edge") 50 x 40"#;
    assert!(text.contains(images), "{text}");
    // A file of one strip says as much as a pyramid.
    let texels: Vec<u8> = vec![7; 3000 * 40];
    sandbox.write("strip.tif", &crate::nodata::tiff([3000, 40], 1, 5, &texels));
    let told = sandbox.run(&["info", "strip.tif", "--json"]).expect_code(0).json();
    assert_eq!((&told["nodata"], &told["words"][0]["name"]), (&"5".into(), &"samples".into()));
}

/// Sizes, places and the magnification stay where a file is built, and where a container is changed.
#[test]
fn a_container_keeps_how_large_texels_are_and_where_they_lie() {
    let sandbox = Sandbox::new();
    for (name, keys) in [
        ("cog-deflate-u16.tif", &["pixel_size", "place"][..]),
        ("slide-jpeg.svs", &["pixel_size", "magnification"]),
        ("ome-slide.ome.tif", &["pixel_size"]),
    ] {
        copy(&sandbox, name);
        let said = sandbox.run(&["info", name, "--json"]).expect_code(0).json();
        for (levels, output) in [(&[][..], "a.vastex"), (&["--levels", "keep"], "b.vastex")] {
            let build = [&["build", name, "-o", output, "--quiet"], levels].concat();
            sandbox.run(&build).expect_code(0);
            let kept = sandbox.run(&["info", output, "--json"]).expect_code(0).json();
            for key in keys {
                assert!(!said[key].is_null() && kept[key] == said[key], "{name}: {kept} for {said}");
            }
            let text = sandbox.run(&["info", output]).expect_code(0).stdout;
            assert!(text.contains("  texel       "), "{text}");
        }
    }
    sandbox.run(&["build", "cog-deflate-u16.tif", "-o", "c.vastex", "--quiet"]).expect_code(0);
    let said = |output: &str| sandbox.run(&["info", output, "--json"]).expect_code(0).json()["place"].clone();
    let before = said("c.vastex");
    assert_eq!(before["epsg"], 32633);
    for part in ["1/2", "2/2"] {
        let output = format!("{}.part", &part[..1]);
        let build = ["build", "cog-deflate-u16.tif", "--shard", part, "-o", &output, "--quiet"];
        sandbox.run(&build).expect_code(0);
    }
    sandbox.run(&["merge", "1.part", "2.part", "-o", "d.vastex", "--quiet"]).expect_code(0);
    assert_eq!(said("d.vastex"), before);
    // Of a file that says nothing nothing is kept.
    sandbox.write_png("image.png", [30, 20]);
    sandbox.run(&["build", "image.png", "-o", "e.vastex", "--quiet"]).expect_code(0);
    assert!(said("e.vastex").is_null());
}

#[test]
fn other_images_of_a_file_are_opened_by_their_names() {
    let sandbox = Sandbox::new();
    copy(&sandbox, "slide-jpeg.svs");
    let label = sandbox.run(&["info", "slide-jpeg.svs:label", "--json"]).expect_code(0).json();
    assert_eq!(label["size"], serde_json::json!([17, 15]));
    sandbox.run(&["render", "slide-jpeg.svs:macro", "--size", "42x24", "-o", "a.png"]).expect_code(0);
    let crop = ["crop", "slide-jpeg.svs:label", "--at", "1,2", "--size", "16x13", "-o", "a.tif"];
    sandbox.run(&crop).expect_code(0);
    for command in
        [&["info", "slide-jpeg.svs:labels"][..], &["render", "slide-jpeg.svs:labels", "-o", "b.png"]]
    {
        let ended = sandbox.run(command).expect_code(1);
        assert!(ended.stderr.contains("the others are thumbnail, label, macro"), "{ended}");
    }
}

/// What is built before it is shown is told of, too: strips that are too large to be read in place, and what
/// is stored turned.
#[test]
fn files_that_are_not_shown_in_place_are_told_of() {
    let sandbox = Sandbox::new();
    // Grey, of one strip at the end of the file, which may be a hole.
    let write = |name: &str, [width, height]: [u32; 2], orientation: u32| {
        let entries = [
            (256u16, width),
            (257, height),
            (258, 8),
            (259, 1),
            (262, 1),
            (273, 512),
            (274, orientation),
            (278, height),
            (279, width * height),
        ];
        let mut file = [b"II\x2a\0".to_vec(), 8u32.to_le_bytes().to_vec()].concat();
        file.extend((entries.len() as u16).to_le_bytes());
        for (tag, value) in entries {
            file.extend([tag.to_le_bytes(), 4u16.to_le_bytes()].concat());
            file.extend([1u32.to_le_bytes(), value.to_le_bytes()].concat());
        }
        file.resize(512, 0);
        std::fs::write(sandbox.path(name), file).unwrap();
        let file = std::fs::File::options().write(true).open(sandbox.path(name)).unwrap();
        file.set_len(512 + u64::from(width) * u64::from(height)).unwrap();
    };
    write("strip.tif", [8200, 8200], 1);
    write("turned.tif", [40, 30], 6);
    for (name, size) in [("strip.tif", [8200, 8200]), ("turned.tif", [30, 40])] {
        let told = sandbox.run(&["info", name, "--json"]).expect_code(0).json();
        assert_eq!((&told["kind"], &told["size"]), (&"image".into(), &serde_json::json!(size)), "{told}");
        let text = sandbox.run(&["info", name]).expect_code(0).stdout;
        assert!(text.contains("build it into their cache"), "{text}");
    }
}

#[test]
fn a_region_is_written_as_it_is_stored_or_not_at_all() {
    let sandbox = Sandbox::with_container();
    copy(&sandbox, "cog-zstd-f32.tif");
    copy(&sandbox, "slide-jpeg.svs");
    let before = sandbox.names();
    let region = ["--at", "8,16", "--size", "24x5"];
    let json = |source: &str, output: &str| {
        sandbox.run(&[&["crop", source, "-o", output, "--json"], &region[..]].concat()).expect_code(0).json()
    };
    let summary = json("cog-zstd-f32.tif", "a.npy");
    assert_eq!((&summary["dtype"], &summary["channels"]), (&"f4".into(), &1.into()));
    assert_eq!(sandbox.read("a.npy").len(), 128 + 24 * 5 * 4);
    assert_eq!(json("image.vastex", "b.tif")["channels"], 4);
    assert_eq!(json("image.png", "c.png")["channels"], 3);
    assert_eq!(json("planet:9", "d.npy")["dtype"], "u1");
    assert_eq!(json("slide-jpeg.svs", "e.TIFF")["size"], serde_json::json!([24, 5]));
    for made in ["a.npy", "b.tif", "c.png", "d.npy", "e.TIFF"] {
        std::fs::remove_file(sandbox.path(made)).unwrap();
    }
    let refused = |args: &[&str], code: i32, words: &[&str]| {
        let ended = sandbox.run(&[&["crop"], args].concat()).expect_code(code);
        for word in words {
            assert!(ended.stderr.contains(word), "{args:?} does not say {word:?}: {ended}");
        }
        assert_eq!(sandbox.names(), before, "{args:?} left something behind");
    };
    let at = |at: &'static str, size: &'static str| ["--at", at, "--size", size];
    refused(
        &[&["cog-zstd-f32.tif", "-o", "x.npy"], &at("200,0", "4x1")[..]].concat(),
        1,
        &["203x141", "cog-zstd"],
    );
    refused(
        &[&["cog-zstd-f32.tif", "-o", "x.png"], &at("0,0", "4x1")[..]].concat(),
        1,
        &["floats of 32 bits", ".npy"],
    );
    for place in [&["--at", "-1,0"][..], &["--at=-1,0"]] {
        let args = [place, &["cog-zstd-f32.tif", "--size", "4x1", "-o", "x.npy"]].concat();
        refused(&args, 1, &["4x1 texels at -1,0 reach beyond the edge: level 0 has 203x141"]);
    }
    let level = [&["slide-jpeg.svs", "--level", "1", "-o", "x.npy"], &at("0,0", "4x1")[..]].concat();
    refused(&level, 1, &["no level 1", "0 (203x141), 2 (50x35), 4 (12x8)"]);
    let layer = [&["image.vastex", "--layer", "height", "-o", "x.npy"], &at("0,0", "4x1")[..]].concat();
    refused(&layer, 1, &["height", "color"]);
    refused(&[&["missing.tif", "-o", "x.npy"], &at("0,0", "4x1")[..]].concat(), 1, &["missing.tif"]);
    refused(
        &[&["image.png", "-o", "image.png"], &at("0,0", "4x1")[..]].concat(),
        1,
        &["image.png: is the source as well as the output"],
    );
    refused(&[&["image.png", "-o", "x.jpg"], &at("0,0", "4x1")[..]].concat(), 2, &[".npy, .png or .tif"]);
    refused(&[&["image.png", "-o", "x.npy"], &at("0,0", "0x1")[..]].concat(), 2, &["at least one"]);
    refused(&[&["image.png", "-o", "no/x.npy"], &at("0,0", "4x1")[..]].concat(), 1, &["does not exist"]);
}

#[test]
fn a_region_does_not_take_the_place_of_what_it_is_of() {
    let sandbox = Sandbox::with_container();
    copy(&sandbox, "cog-jpeg.tif");
    copy(&sandbox, "slide-jpeg.svs");
    std::fs::rename(sandbox.path("slide-jpeg.svs"), sandbox.path("slide.tif")).unwrap();
    let export = ["export", "image.vastex", "--layout", "deepzoom", "-o", "zoom", "--format", "png"];
    sandbox.run(&export).expect_code(0);
    let tile = "zoom/zoom_files/0/0_0.png";
    for (source, output) in [
        ("planet:8:cog-jpeg.tif", "cog-jpeg.tif"),
        ("slide.tif:label", "slide.tif"),
        ("planet:8:slide.tif:macro", "slide.tif"),
        ("cog-jpeg.tif", "cog-jpeg.tif"),
        ("zoom", tile),
        ("zoom/zoom.dzi", tile),
    ] {
        let before = sandbox.read(output);
        let refused = sandbox.run(&["crop", source, "--at", "0,0", "--size", "4x4", "-o", output]);
        let said = refused.expect_code(1).stderr;
        assert!(said.contains("choose another"), "{source}: {said}");
        assert_eq!(sandbox.read(output), before, "{source}");
    }
}

#[test]
fn no_output_of_a_picture_takes_the_place_of_what_is_drawn() {
    let sandbox = Sandbox::with_container();
    copy(&sandbox, "slide-jpeg.svs");
    let before = sandbox.read("slide-jpeg.svs");
    let label = "slide-jpeg.svs:label";
    for args in [
        &[label, "-o", "slide-jpeg.svs"][..],
        &[label, "--record-trace", "slide-jpeg.svs"],
        &[label, "--stats-csv", "slide-jpeg.svs"],
        &["planet:8:slide-jpeg.svs:label", "--stats-json", "slide-jpeg.svs"],
        &["image.vastex", "--over", label, "-o", "slide-jpeg.svs"],
    ] {
        let said = sandbox.run(&[&["render", "--size", "16x16"], args].concat()).expect_code(1).stderr;
        assert!(said.contains("choose another name for the output"), "{args:?}: {said}");
        assert_eq!(sandbox.read("slide-jpeg.svs"), before, "{args:?}");
    }
}
