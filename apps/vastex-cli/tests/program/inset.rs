//! Insets: finer levels in some places only, as the program builds, tells of, draws and changes them.

use crate::tool::Desk;

/// `world.vastex`, of 300x200 texels with pages of 64, and an inset over its middle that is two levels finer.
fn desk_with_inset() -> Desk {
    let desk = Desk::new();
    desk.write_png("world.png", [300, 200]);
    desk.write_png("inset.png", [300, 260]);
    let args = ["build", "world.png", "-o", "world.vastex", "--page", "64", "--inset", "inset.png@500,300,2"];
    let built = desk.run(&[&args[..], &["--json"]].concat()).expect_code(0).json();
    assert_eq!(built["size"], serde_json::json!([1200, 800]));
    assert_eq!(desk.names(), ["inset.png", "world.png", "world.vastex"]);
    desk
}

#[test]
fn info_tells_which_levels_are_sparse_and_what_that_saved() {
    let desk = desk_with_inset();
    desk.run(&["verify", "world.vastex"]).expect_code(0);
    let info = desk.run(&["info", "world.vastex", "--json"]).expect_code(0).json();
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
    let text = desk.run(&["info", "world.vastex"]).expect_code(0).stdout;
    assert!(
        text.contains("level 0: 30 tiles for 247 pages") && text.contains("absent    275, which saves"),
        "{text}"
    );
    assert!(!text.contains("level 2:"), "{text}");
}

#[test]
fn a_texture_with_an_inset_draws_changes_and_is_exported() {
    let desk = desk_with_inset();
    for scene in ["image", "globe"] {
        let args =
            ["render", "world.vastex", "--on", scene, "--size", "320x180", "-o", "picture.png", "--json"];
        assert_eq!(desk.run(&args).expect_code(0).json()["converged"], true);
    }
    desk.run(&["replace", "world.vastex", "--at", "10,20", "inset.png"]).expect_code(0);
    desk.run(&["verify", "world.vastex"]).expect_code(0);
    let info = desk.run(&["info", "world.vastex", "--json"]).expect_code(0).json();
    assert_eq!(info["tiles_by_level"][0], 6 * 5 + 5 * 5);
    desk.run(&["export", "world.vastex", "--layout", "deepzoom", "-o", "tiles", "--quiet"]).expect_code(0);
    desk.run(&["build", "tiles", "-o", "again.vastex", "--quiet"]).expect_code(0);
}

#[test]
fn insets_that_do_not_suit_are_refused() {
    let desk = desk_with_inset();
    let refused = |inset: &str, more: &[&str], code: i32| {
        let args = ["build", "world.png", "-o", "out.vastex", "--page", "64", "--inset", inset];
        let stderr = desk.run(&[&args[..], more].concat()).expect_code(code).stderr;
        assert_eq!(desk.names(), ["inset.png", "world.png", "world.vastex"]);
        stderr
    };
    assert!(refused("inset.png@500,300", &[], 2).contains("as in rome.png@8192,4096,3"));
    assert!(refused("inset.png@0,0,1", &["--resume"], 2).contains("--resume"));
    assert!(refused("inset.png@0,0,1", &["--shard", "1/2"], 2).contains("--shard"));
    assert!(refused("inset.png@901,0,2", &[], 1).contains("1200x800 texels at that level"));
    assert!(refused("none.png@0,0,2", &[], 1).contains("none.png"));
}
