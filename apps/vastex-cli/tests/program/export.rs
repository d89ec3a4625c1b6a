//! From a container to the tile directories of other programs, and back.

use crate::tool::Sandbox;

#[test]
fn every_layout_is_written_and_built_again() {
    let sandbox = Sandbox::with_container();
    for layout in ["gaiasky", "celestia", "deepzoom", "prototype"] {
        let args = ["export", "image.vastex", "--layout", layout, "-o", layout, "--json"];
        let report = sandbox.run(&args).expect_code(0).json();
        let expected = if ["deepzoom", "prototype"].contains(&layout) { [300, 200] } else { [512, 256] };
        assert_eq!(report["size"], serde_json::json!(expected), "{report}");
        let resampled =
            report["notices"].as_array().unwrap().iter().any(|n| n.as_str().unwrap().contains("resampled"));
        assert_eq!(resampled, expected == [512, 256], "{report}");
        sandbox.run(&["build", layout, "-o", "again.vastex", "--quiet"]).expect_code(0);
        let info = sandbox.run(&["info", "again.vastex", "--json"]).expect_code(0).json();
        assert_eq!(info["size"], serde_json::json!(expected));
        let wraps = info["address"][0] == "wrap";
        assert_eq!(wraps, resampled, "planets wrap, images do not: {info}");
    }
    for layout in ["gaiasky", "deepzoom", "deepzoom/deepzoom.dzi"] {
        let refused = sandbox.run(&["verify", layout]).expect_code(1).stderr;
        assert!(refused.contains(layout) && refused.contains("`vastex build`"), "{refused}");
        let info = sandbox.run(&["info", layout]).expect_code(0);
        assert!(info.stdout.contains("tile"), "{info}");
    }
    sandbox.run(&["build", "celestia/celestia.ctx", "-o", "again.vastex"]).expect_code(0);
    sandbox.run(&["build", "deepzoom/deepzoom.dzi", "-o", "again.vastex"]).expect_code(0);
}

#[test]
fn a_directory_is_drawn_like_the_container_it_came_from() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [600, 400]);
    sandbox.run(&["build", "image.png", "-o", "image.vastex", "--page", "256", "--quiet"]).expect_code(0);
    let export = ["export", "image.vastex", "--layout", "deepzoom", "-o", "zoom", "--format", "png"];
    sandbox.run(&[&export[..], &["--tile-size", "256"]].concat()).expect_code(0);
    for (source, picture) in [("image.vastex", "a.png"), ("zoom", "b.png"), ("zoom/zoom.dzi", "c.png")] {
        let args = ["render", source, "--on", "plane", "--size", "200x120", "-o", picture, "--json"];
        assert_eq!(sandbox.run(&args).expect_code(0).json()["converged"], true);
    }
    assert!(sandbox.read("a.png") == sandbox.read("b.png") && sandbox.read("b.png") == sandbox.read("c.png"));
}

#[test]
fn options_reach_the_tiles() {
    let sandbox = Sandbox::with_container();
    let help = sandbox.run(&["export", "--help"]).expect_code(0).stdout;
    assert!(help.contains("Examples:\n  vastex export "), "{help}");
    let export = |options: &[&str]| {
        let begin = ["export", "image.vastex", "--json"];
        sandbox.run(&[&begin[..], options].concat()).expect_code(0).json()
    };
    let zoom = export(&[
        "--layout",
        "deepzoom",
        "-o",
        "zoom",
        "--format",
        "png",
        "--tile-size",
        "100",
        "--overlap",
        "0",
        "--threads",
        "1",
    ]);
    assert_eq!((&zoom["format"], &zoom["levels"]), (&"png".into(), &10.into()));
    assert!(sandbox.path("zoom/zoom_files/9/2_1.png").is_file());
    let small = export(&["--layout", "deepzoom", "-o", "small", "--quality", "20", "--layer", "color"]);
    let large = export(&["--layout", "deepzoom", "-o", "large", "--quality", "95"]);
    assert!(small["bytes"].as_u64() < large["bytes"].as_u64());
    let coarse = export(&["--layout", "gaiasky", "-o", "coarse", "--tile-size", "64", "--finest-level", "1"]);
    assert_eq!((&coarse["levels"], &coarse["tiles"]), (&2.into(), &10.into()));
    sandbox.write_png("part.png", [128, 64]);
    sandbox.run(&["build", "part.png", "-o", "part.vastex", "--quiet"]).expect_code(0);
    let part = [
        "export",
        "part.vastex",
        "--layout",
        "gaiasky",
        "-o",
        "part",
        "--tile-size",
        "64",
        "--format",
        "png",
    ];
    let place = ["--finest-level", "3", "--first-column", "4", "--first-row", "7", "--quiet"];
    sandbox.run(&[&part[..], &place].concat()).expect_code(0);
    assert!(
        sandbox.path("part/level3/tx_4_7.png").is_file() && sandbox.path("part/level3/tx_5_7.png").is_file()
    );
}

#[test]
fn what_cannot_be_exported_is_refused_and_leaves_nothing() {
    let sandbox = Sandbox::with_container();
    let before = sandbox.names();
    for (args, code, says) in [
        (&["image.png", "--layout", "deepzoom", "-o", "out"][..], 1, "not a Vastex container"),
        (&["none.vastex", "--layout", "deepzoom", "-o", "out"], 1, "no such file"),
        (&["image.vastex", "--layout", "deepzoom", "-o", "image.png"], 1, "choose another"),
        (&["image.vastex", "--layout", "gaiasky", "-o", "out", "--tile-size", "100"], 2, "powers of two"),
        (&["image.vastex", "--layout", "deepzoom", "-o", "out", "--tile-size", "0"], 2, "a tile of 0 texels"),
        (&["image.vastex", "--layout", "prototype", "-o", "out", "--format", "jpg"], 2, "pages are PNG"),
        (
            &["image.vastex", "--layout", "deepzoom", "-o", "out", "--finest-level", "3"],
            2,
            "those of planets",
        ),
        (&["image.vastex", "--layout", "deepzoom", "-o", "no/out"], 1, "does not exist: make it"),
        (&["image.vastex", "--layout", "gaiasky", "-o", "out", "--first-row", "1"], 2, "--finest-level"),
        (&["image.vastex", "--layout", "deepzoom", "-o", "out", "--quality", "0"], 2, "--quality"),
        (&["image.vastex", "--layout", "zoomify", "-o", "out"], 2, "gaiasky"),
        (&["image.vastex", "-o", "out"], 2, "--layout"),
    ] {
        let ended = sandbox.run(&[&["export"], args].concat()).expect_code(code);
        assert!(ended.stderr.contains(says) && ended.stdout.is_empty(), "{ended}");
    }
    assert_eq!(sandbox.names(), before);
}
