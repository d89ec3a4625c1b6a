//! Directories as sources of tiles, page by page, against the containers that they were exported from.

use std::fs;

use pollster::block_on;
use vastex_build::{BuildOptions, DirectorySource, ExportOptions, Layout, TileFormat, build};
use vastex_core::{AddressMode, PagePos};
use vastex_tiles::{Container, ReadError, Tiers, TileSource, conformance};

use crate::directories::pictures::Sandbox;

/// Exports a picture of noise.
fn export(sandbox: &Sandbox, size: [u32; 2], wraps: bool, options: ExportOptions) {
    sandbox.rgb(size);
    let x = if wraps { AddressMode::Wrap } else { AddressMode::Clamp };
    let build_options = BuildOptions { address: [x, AddressMode::Clamp], ..BuildOptions::default() };
    let container = sandbox.path("exported.vastex");
    build(&[sandbox.path("image.png")], &container, &build_options, &()).unwrap();
    sandbox.export(&container, "tree", &ExportOptions { format: Some(TileFormat::Png), ..options });
}

/// Compares every page with that of a container with the same pages.
fn expect_the_pages_of(sandbox: &Sandbox, opened: &str, size: [u32; 2]) {
    let source = DirectorySource::open(sandbox.path(opened)).unwrap();
    assert_eq!(conformance(&source), Ok(()));
    let geometry = &source.description().geometry;
    let address = [geometry.address()[0], geometry.address()[1]];
    let options = BuildOptions { page: geometry.page()[0], address, ..BuildOptions::default() };
    let built = sandbox.path("same.vastex");
    build(&[sandbox.path("image.png")], &built, &options, &()).unwrap();
    let container = Container::open_file(&built).unwrap();
    assert_eq!((source.description(), geometry.size()), (container.description(), [size[0], size[1], 1]));
    for pos in geometry.pages() {
        let texels = |source: &dyn TileSource| {
            block_on(source.read(pos)).unwrap().decode(container.description()).unwrap()
        };
        assert!(texels(&source) == texels(&container), "{pos} of {opened} differs");
    }
}

#[test]
fn deep_zoom_gives_the_pages_of_the_container() {
    for (size, tile, overlap) in [([301, 199], 64, 3), ([700, 513], 254, 1), ([1, 300], 16, 0)] {
        let sandbox = Sandbox::new();
        let options = ExportOptions::new(Layout::DeepZoom);
        export(
            &sandbox,
            size,
            false,
            ExportOptions { tile_size: Some(tile), overlap: Some(overlap), ..options },
        );
        expect_the_pages_of(&sandbox, "tree", size);
        expect_the_pages_of(&sandbox, "tree/tree.dzi", size);
    }
}

#[test]
fn the_prototype_gives_them_and_what_it_lacks_is_filtered() {
    let sandbox = Sandbox::new();
    export(&sandbox, [1030, 130], false, ExportOptions::new(Layout::Prototype));
    expect_the_pages_of(&sandbox, "tree", [1030, 130]);
    for level in 1..3 {
        for (x, y) in [(0, 0), (1, 0)] {
            let _ = fs::remove_file(sandbox.path(&format!("tree/pages/{level}_{x}_{y}.png")));
        }
    }
    expect_the_pages_of(&sandbox, "tree", [1030, 130]);
}

#[test]
fn planets_give_them_and_wrap() {
    for layout in [Layout::GaiaSky, Layout::Celestia] {
        let sandbox = Sandbox::new();
        let options = ExportOptions { tile_size: Some(64), ..ExportOptions::new(layout) };
        export(&sandbox, [512, 256], true, options);
        expect_the_pages_of(&sandbox, "tree", [512, 256]);
        let source = DirectorySource::open(sandbox.path("tree")).unwrap();
        assert_eq!(source.description().geometry.address()[0], AddressMode::Wrap);
    }
}

/// The red of a texel of level 0 of a source whose pages have 128 texels and borders of 4.
fn red(source: &DirectorySource, x: u32, y: u32) -> u8 {
    let tile = block_on(source.read(PagePos::new_2d(0, x / 128, y / 128))).unwrap();
    let texels = tile.decode(source.description()).unwrap();
    texels[((y % 128 + 4) * 136 + x % 128 + 4) as usize * 4]
}

#[test]
fn what_is_missing_is_interpolated_from_the_ancestor() {
    let sandbox = Sandbox::new();
    let options = ExportOptions { tile_size: Some(64), ..ExportOptions::new(Layout::GaiaSky) };
    export(&sandbox, [512, 256], true, options);
    let whole = DirectorySource::open(sandbox.path("tree")).unwrap();
    let beside = red(&whole, 191, 70);
    fs::remove_file(sandbox.path("tree/level2/tx_3_1.png")).unwrap();
    let sparse = DirectorySource::open(sandbox.path("tree")).unwrap();
    assert_eq!(conformance(&sparse), Ok(()));
    // Beside the hole all is as it was.
    assert_eq!(red(&sparse, 191, 70), beside);
    // In it, the coarser level's texels, a quarter of a texel off their middles.
    let tile = block_on(whole.read(PagePos::new_2d(1, 0, 0))).unwrap();
    let coarse = tile.decode(whole.description()).unwrap();
    let at = |x: u32, y: u32| f32::from(coarse[((y + 4) * 136 + x + 4) as usize * 4]);
    let mix = |a: f32, b: f32| a + (b - a) * 0.25;
    let expected = mix(mix(at(100, 40), at(101, 40)), mix(at(100, 41), at(101, 41)));
    assert_eq!(red(&sparse, 201, 81), expected.round() as u8);
}

#[test]
fn a_lost_file_fails_its_pages_until_it_is_back() {
    let sandbox = Sandbox::new();
    let options =
        ExportOptions { tile_size: Some(128), overlap: Some(0), ..ExportOptions::new(Layout::DeepZoom) };
    export(&sandbox, [600, 500], false, options);
    let (file, away) = (sandbox.path("tree/tree_files/10/2_2.png"), sandbox.path("away.png"));
    fs::rename(&file, &away).unwrap();
    let source = DirectorySource::open(sandbox.path("tree")).unwrap();
    let read = |x, y| block_on(source.read(PagePos::new_2d(0, x, y)));
    match read(2, 2) {
        Err(ReadError::Store { place, .. }) => assert!(place.ends_with("2_2.png"), "{place}"),
        other => panic!("{other:?}"),
    }
    // A page whose border alone lies in the file fails, too; one that is farther away does not.
    assert!(read(1, 2).is_err() && read(0, 0).is_ok());
    fs::write(&file, b"\x89PNG\r\n\x1a\n and no more").unwrap();
    assert!(matches!(read(2, 2), Err(ReadError::Damaged { .. })));
    fs::rename(&away, &file).unwrap();
    assert!(read(2, 2).is_ok() && read(1, 2).is_ok());
}

#[test]
fn what_is_no_directory_is_refused_with_a_remedy() {
    let sandbox = Sandbox::new();
    let message = |path: &str| match DirectorySource::open(sandbox.path(path)) {
        Ok(_) => panic!("{path} is opened"),
        Err(error) => error.to_string(),
    };
    sandbox.rgb([20, 10]);
    assert!(message("image.png").contains("vastex build IMAGE"));
    assert!(message("nothing").contains("nothing: there is no such file"));
    fs::create_dir(sandbox.path("empty")).unwrap();
    assert!(message("empty").contains("no tile layout recognised"));
}

#[test]
fn reads_of_files_are_counted() {
    let sandbox = Sandbox::new();
    let options = ExportOptions::new(Layout::DeepZoom);
    export(&sandbox, [300, 200], false, ExportOptions { tile_size: Some(64), overlap: Some(0), ..options });
    let source = DirectorySource::open(sandbox.path("tree")).unwrap();
    let tiers = || {
        let mut tiers = Tiers::default();
        source.add_tiers(&mut tiers);
        tiers.store
    };
    let opened = tiers();
    // A page of 128 texels and its border of 4 lie on 3x3 files; asked for again, they are at hand.
    for _ in 0..2 {
        block_on(source.read(PagePos::new_2d(0, 0, 0))).unwrap();
        assert_eq!(tiers().reads - opened.reads, 9);
    }
    let files = ["0_0", "0_1", "0_2", "1_0", "1_1", "1_2", "2_0", "2_1", "2_2"];
    let bytes =
        files.map(|name| fs::metadata(sandbox.path(&format!("tree/tree_files/9/{name}.png"))).unwrap().len());
    assert_eq!(tiers().bytes - opened.bytes, bytes.iter().sum::<u64>());
}
