//! What the exporter refuses, and that it leaves nothing behind.

use std::cell::Cell;
use std::ops::ControlFlow;

use vastex_build::{ExportError, ExportOptions, Layout, Progress, TileFormat, export};
use vastex_tiles::Container;

use crate::directories::pictures::Sandbox;

#[test]
fn impossible_options_say_what_is_possible() {
    let sandbox = Sandbox::new();
    let container = Container::open_file(sandbox.rgb([300, 200])).unwrap();
    let deep = Layout::DeepZoom;
    let of = ExportOptions::new;
    for (options, says) in [
        (ExportOptions { tile_size: Some(0), ..of(deep) }, "a tile of 0 texels"),
        (ExportOptions { tile_size: Some(u32::MAX), ..of(deep) }, "at most 8192"),
        (ExportOptions { overlap: Some(300), ..of(deep) }, "an overlap of 300"),
        (ExportOptions { tile_size: Some(100), ..of(Layout::GaiaSky) }, "powers of two from 4 to 1024"),
        (ExportOptions { tile_size: Some(32), ..of(Layout::Celestia) }, "powers of two from 64"),
        (ExportOptions { overlap: Some(1), ..of(Layout::Celestia) }, "Celestia's have none"),
        (ExportOptions { finest_level: Some(15), ..of(Layout::GaiaSky) }, "levels 0 to 14"),
        (ExportOptions { finest_level: Some(13), ..of(Layout::Celestia) }, "levels 0 to 12"),
        (ExportOptions { finest_level: Some(3), ..of(deep) }, "those of planets"),
        (ExportOptions { first_tile: Some([0, 0]), ..of(deep) }, "those of planets"),
        (ExportOptions { first_tile: Some([0, 0]), ..of(Layout::GaiaSky) }, "not made of whole tiles"),
        (
            ExportOptions {
                first_tile: Some([9, u32::MAX]),
                tile_size: Some(4),
                finest_level: Some(8),
                ..of(Layout::GaiaSky)
            },
            "ends at column 84",
        ),
        (ExportOptions { tile_size: Some(256), ..of(Layout::Prototype) }, "512"),
        (ExportOptions { format: Some(TileFormat::Jpeg), ..of(Layout::Prototype) }, "pages are PNG"),
        (ExportOptions { layer: Some("height".into()), ..of(deep) }, "no layer 'height'; there is color"),
    ] {
        let error = export(&container, &sandbox.path("out"), &options, &()).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
    assert_eq!(sandbox.names(), ["image.png", "image.vastex"]);
}

#[test]
fn what_jpeg_cannot_hold_is_refused_or_becomes_png() {
    let sandbox = Sandbox::new();
    let container = sandbox.container([64, 64], png::ColorType::Grayscale, png::BitDepth::Sixteen);
    let container = Container::open_file(container).unwrap();
    let options = ExportOptions { format: Some(TileFormat::Jpeg), ..ExportOptions::new(Layout::DeepZoom) };
    let error = export(&container, &sandbox.path("out"), &options, &()).unwrap_err().to_string();
    assert!(error.contains("r16"), "{error}");
    let report =
        export(&container, &sandbox.path("out"), &ExportOptions::new(Layout::DeepZoom), &()).unwrap();
    assert_eq!(report.format, TileFormat::Png);
}

#[test]
fn only_an_empty_directory_makes_way() {
    let sandbox = Sandbox::new();
    let container = Container::open_file(sandbox.rgb([64, 64])).unwrap();
    let options = ExportOptions::new(Layout::DeepZoom);
    let refused =
        |name: &str| export(&container, &sandbox.path(name), &options, &()).unwrap_err().to_string();
    std::fs::create_dir_all(sandbox.path("full/of")).unwrap();
    assert!(refused("full").contains("is not empty"));
    assert!(refused("image.png").contains("there is a file of this name"));
    assert!(refused("no/such/place").contains("cannot be made"));
    assert!(refused("a<b").contains("choose another"));
    std::fs::create_dir(sandbox.path("empty")).unwrap();
    export(&container, &sandbox.path("empty"), &options, &()).unwrap();
    assert!(sandbox.path("empty/empty.dzi").is_file());
    assert_eq!(sandbox.names(), ["empty", "full", "image.png", "image.vastex"]);
}

#[cfg(unix)]
#[test]
fn a_link_is_filled_or_refused_before_the_work() {
    struct Never;
    impl Progress for Never {
        fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
            panic!("the work has begun")
        }
    }
    let sandbox = Sandbox::new();
    let container = Container::open_file(sandbox.rgb([64, 64])).unwrap();
    let options = ExportOptions::new(Layout::DeepZoom);
    std::fs::create_dir(sandbox.path("real")).unwrap();
    for (to, link) in [("real", "link"), ("nowhere", "dangling")] {
        std::os::unix::fs::symlink(to, sandbox.path(link)).unwrap();
    }
    let error = export(&container, &sandbox.path("dangling"), &options, &Never).unwrap_err().to_string();
    assert!(error.contains("dangling: is a link that leads to no directory"), "{error}");
    for name in ["link", "link/"] {
        export(&container, &sandbox.path(name), &options, &()).unwrap();
        assert!(sandbox.path("link").is_symlink() && sandbox.path("real/link.dzi").is_file());
        std::fs::remove_dir_all(sandbox.path("real")).unwrap();
        std::fs::create_dir(sandbox.path("real")).unwrap();
    }
    assert_eq!(sandbox.names(), ["dangling", "image.png", "image.vastex", "link", "real"]);
}

#[test]
fn a_part_with_borders_is_told_to_differ_at_its_edge() {
    let sandbox = Sandbox::new();
    let container = Container::open_file(sandbox.rgb([124, 62])).unwrap();
    let notices = |finest: u32, first: [u32; 2], overlap: u32, tile: u32, name: &str| {
        let options = ExportOptions {
            tile_size: Some(tile),
            overlap: Some(overlap),
            finest_level: Some(finest),
            first_tile: Some(first),
            format: Some(TileFormat::Png),
            ..ExportOptions::new(Layout::GaiaSky)
        };
        let report = export(&container, &sandbox.path(name), &options, &()).unwrap();
        report.notices.iter().any(|notice| notice.to_string().contains("at the edge of the part"))
    };
    assert!(notices(2, [1, 1], 1, 64, "part"));
    // The whole planet as a part of itself: the very tiles that it gives as a whole.
    assert!(!notices(0, [0, 0], 1, 64, "all"));
    let whole = ExportOptions {
        tile_size: Some(64),
        overlap: Some(1),
        format: Some(TileFormat::Png),
        ..ExportOptions::new(Layout::GaiaSky)
    };
    export(&container, &sandbox.path("whole"), &whole, &()).unwrap();
    for tile in ["level0/tx_0_0.png", "level0/tx_1_0.png"] {
        let [a, b] = ["all", "whole"].map(|name| std::fs::read(sandbox.path(name).join(tile)).unwrap());
        assert!(a == b, "{tile}");
    }
}

#[test]
fn a_cancelled_export_leaves_nothing() {
    struct After(Cell<u32>);
    impl Progress for After {
        fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
            match self.0.get().checked_sub(1) {
                Some(left) => {
                    self.0.set(left);
                    ControlFlow::Continue(())
                }
                None => ControlFlow::Break(()),
            }
        }
    }
    let sandbox = Sandbox::new();
    let container = Container::open_file(sandbox.rgb([300, 200])).unwrap();
    let options = ExportOptions { tile_size: Some(64), ..ExportOptions::new(Layout::DeepZoom) };
    for steps in [0, 1, 3, 9] {
        let stop = After(Cell::new(steps));
        let error = export(&container, &sandbox.path("out"), &options, &stop).unwrap_err();
        assert!(matches!(error, ExportError::Cancelled), "{error}");
        assert_eq!(sandbox.names(), ["image.png", "image.vastex"]);
    }
}
