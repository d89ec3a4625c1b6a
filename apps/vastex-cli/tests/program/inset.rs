//! Insets: finer levels in some places only, as the program builds, tells of, draws and changes them.

use crate::tool::Sandbox;

/// `world.vastex`, of 300x200 texels with pages of 64, and an inset over its middle that is two levels finer.
fn sandbox_with_inset() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write_png("world.png", [300, 200]);
    sandbox.write_png("inset.png", [300, 260]);
    let args = ["build", "world.png", "-o", "world.vastex", "--page", "64", "--inset", "inset.png@500,300,2"];
    let built = sandbox.run(&[&args[..], &["--json"]].concat()).expect_code(0).json();
    assert_eq!(built["size"], serde_json::json!([1200, 800]));
    assert_eq!(sandbox.names(), ["inset.png", "world.png", "world.vastex"]);
    sandbox
}

#[test]
fn info_tells_which_levels_are_sparse_and_what_that_saved() {
    let sandbox = sandbox_with_inset();
    sandbox.run(&["verify", "world.vastex"]).expect_code(0);
    let info = sandbox.run(&["info", "world.vastex", "--json"]).expect_code(0).json();
    // Columns 500 to 800 and rows 300 to 560 of level 0 lie in 6 and 5 pages.
    assert_eq!(info["pages_by_level"], serde_json::json!([19 * 13, 10 * 7, 5 * 4, 3 * 2, 2]));
    assert_eq!(info["tiles_by_level"], serde_json::json!([6 * 5, 4 * 3, 5 * 4, 3 * 2, 2]));
    let tile = info["layers"][0]["tile_bytes"].as_u64().unwrap();
    let count = |key: &str| info[key].as_u64().unwrap();
    let saved = |key: &str| info["saved_bytes"][key].as_u64().unwrap();
    assert_eq!(saved("absent"), (count("pages") - count("tiles")) * tile);
    let all =
        saved("absent") + saved("constant") + saved("shared") + saved("compression") + count("stored_bytes");
    assert_eq!(all, count("pages") * tile);
    let text = sandbox.run(&["info", "world.vastex"]).expect_code(0).stdout;
    assert!(
        text.contains("level 0: 30 tiles for 247 pages") && text.contains("absent    275, which saves"),
        "{text}"
    );
    assert!(!text.contains("level 2:"), "{text}");
}

#[test]
fn a_texture_with_an_inset_draws_changes_and_is_exported() {
    let sandbox = sandbox_with_inset();
    for scene in ["image", "globe"] {
        let args =
            ["render", "world.vastex", "--on", scene, "--size", "320x180", "-o", "picture.png", "--json"];
        assert_eq!(sandbox.run(&args).expect_code(0).json()["converged"], true);
    }
    sandbox.run(&["replace", "world.vastex", "--at", "10,20", "inset.png"]).expect_code(0);
    sandbox.run(&["verify", "world.vastex"]).expect_code(0);
    let info = sandbox.run(&["info", "world.vastex", "--json"]).expect_code(0).json();
    assert_eq!(info["tiles_by_level"][0], 6 * 5 + 5 * 5);
    sandbox.run(&["export", "world.vastex", "--layout", "deepzoom", "-o", "tiles", "--quiet"]).expect_code(0);
    sandbox.run(&["build", "tiles", "-o", "again.vastex", "--quiet"]).expect_code(0);
}

#[test]
fn insets_that_do_not_suit_are_refused() {
    let sandbox = sandbox_with_inset();
    let refused = |inset: &str, more: &[&str], code: i32| {
        let args = ["build", "world.png", "-o", "out.vastex", "--page", "64", "--inset", inset];
        let stderr = sandbox.run(&[&args[..], more].concat()).expect_code(code).stderr;
        assert_eq!(sandbox.names(), ["inset.png", "world.png", "world.vastex"]);
        stderr
    };
    assert!(refused("inset.png@500,300", &[], 2).contains("as in rome.png@8192,4096,3"));
    assert!(refused("inset.png@0,0,1", &["--shard", "1/2"], 2).contains("--shard"));
    assert!(refused("inset.png@901,0,2", &[], 1).contains("1200x800 texels at that level"));
    assert!(refused("none.png@0,0,2", &[], 1).contains("none.png"));
}

/// `ground.vastex`: colours in blocks, and heights at half their resolution.
fn sandbox_with_layers() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write_png("color.png", [300, 200]);
    sandbox.write_png("height.png", [150, 100]);
    let args = ["build", "-o", "ground.vastex", "--layer", "color=color.png:bc7-srgb", "--layer"];
    let more =
        ["height=height.png:rgba8", "--page", "64", "--border", "8", "--address", "wrap,clamp", "--quiet"];
    sandbox.run(&[&args[..], &more].concat()).expect_code(0);
    sandbox
}

#[test]
fn layers_are_replaced_by_name() {
    let sandbox = sandbox_with_layers();
    sandbox.write_png("c.png", [120, 61]);
    sandbox.write_png("h.png", [60, 31]);
    let replace = |args: &[&str], code: i32| {
        let before = sandbox.read("ground.vastex");
        let ended = sandbox.run(&[&["replace", "ground.vastex"], args].concat()).expect_code(code);
        assert!(code == 0 || sandbox.read("ground.vastex") == before);
        ended.stderr
    };
    // Round the edge of 300 columns.
    let both = ["--layer", "color=c.png", "--layer", "height=h.png:rgba8"];
    replace(&[&["--at", "240,20", "--json"], &both[..]].concat(), 0);
    sandbox.run(&["verify", "ground.vastex"]).expect_code(0);
    for layer in ["color", "height"] {
        let args =
            ["render", "ground.vastex", "--layer-shown", layer, "--size", "160x90", "-o", "p.png", "--json"];
        assert_eq!(sandbox.run(&args).expect_code(0).json()["converged"], true);
    }
    assert!(replace(&["--at", "0,0", "c.png"], 1).contains("has the layers color, height; say into which"));
    assert!(replace(&["--at", "0,0", "--layer", "depth=c.png"], 1).contains("no layer \"depth\""));
    assert!(replace(&[&["--at", "241,20"], &both[..]].concat(), 1).contains("begin at 240,20"));
    assert!(replace(&["--at", "0,0", "--layer", "color=c.png:bc1"], 1).contains("has bc7-srgb, and not bc1"));
    assert!(replace(&["--at", "0,0"], 2).contains("IMAGE"));
    assert!(replace(&["--at", "0,0", "c.png", "--layer", "color=c.png"], 2).contains("cannot be used with"));
}

#[test]
fn insets_go_into_layers_by_name() {
    let sandbox = sandbox_with_layers();
    sandbox.write_png("in.png", [100, 80]);
    let build = |insets: &[&str], code: i32| {
        let args = ["build", "-o", "out.vastex", "--layer", "color=color.png:bc7-srgb", "--layer"];
        let more = ["height=height.png:rgba8", "--page", "64", "--border", "8", "--address", "wrap,clamp"];
        let insets: Vec<&str> = insets.iter().flat_map(|inset| ["--inset", *inset]).collect();
        sandbox.run(&[&args[..], &more, &insets, &["--json"]].concat()).expect_code(code)
    };
    // Of 1200 columns the colours' image has the last 50 and the first 50, of 300 the heights'.
    let built = build(&["color=in.png@1150,100,2", "height=in.png@250,20,1"], 0).json();
    assert_eq!(built["size"], serde_json::json!([1200, 800]));
    sandbox.run(&["verify", "out.vastex"]).expect_code(0);
    assert!(build(&["in.png@0,0,1"], 1).stderr.contains("the layers color, height"));
    assert!(build(&["depth=in.png@0,0,1"], 1).stderr.contains("the layers color, height"));
}

#[cfg(unix)]
#[test]
fn what_a_killed_build_with_insets_left_is_gone_on_with_or_removed() {
    use crate::resume::signal_at;

    let sandbox = Sandbox::new();
    sandbox.write_png("world.png", [700, 540]);
    sandbox.write_png("a.png", [700, 600]);
    sandbox.write_png("b.png", [540, 460]);
    let names = ["a.png", "b.png", "out.vastex", "world.png"];
    let insets = ["--inset", "a.png@1200,240,2", "--inset", "b.png@160,80,1", "--quiet"];
    let build = [&["build", "world.png", "-o", "out.vastex", "--page", "40"], &insets[..]].concat();
    let resume = [&build[..], &["--resume"]].concat();
    sandbox.run(&build).expect_code(0);
    let whole = sandbox.read("out.vastex");
    let mut left = 0;
    for case in 0..9u32 {
        std::fs::remove_file(sandbox.path("out.vastex")).unwrap();
        let args = if case % 2 == 0 { &build } else { &resume };
        let share = u64::from(5 + case * 35 % 90);
        let killed = signal_at(&sandbox, args, "KILL", whole.len() as u64 * share / 100);
        assert_eq!(killed.code, None, "case {case}: {killed}");
        let texture = sandbox.names().into_iter().find(|name| name.ends_with(".insets"));
        left += u32::from(texture.is_some());
        // A kill may come between a file's last name and the end of its journal.
        if let Some(texture) = texture {
            sandbox.write(&format!(".{texture}.journal"), b"left");
        }
        // Without --resume, with it, and by a build without insets.
        if case % 3 == 2 {
            sandbox.run(&["build", "a.png", "-o", "out.vastex", "--quiet"]).expect_code(0);
        } else {
            sandbox.run(if case % 3 == 0 { &build } else { &resume }).expect_code(0);
            assert!(sandbox.read("out.vastex") == whole, "case {case}: other bytes");
        }
        assert_eq!(sandbox.names(), names, "case {case}");
    }
    assert!(left > 1, "{left}");
}
