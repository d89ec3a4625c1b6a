//! Containers that keep the levels of a pyramid: the tiles that the pyramid is shown by, and what does not go
//! with that.

use std::path::PathBuf;

use pollster::block_on;
use vastex_build::{
    BuildError, BuildOptions, DirectorySource, ExportOptions, LayerInput, Layout, PartOf, TileFormat, build,
    export,
};
use vastex_core::{AddressMode, LayerFormat};
use vastex_tiles::{Container, TileSource, conformance};

use super::{fixture, open};
use crate::common::sandbox::Sandbox;
use crate::common::texels;

fn keeping() -> BuildOptions {
    BuildOptions { keep_levels: true, ..BuildOptions::default() }
}

/// Each page of a container is that of a source.
fn check_tiles(source: &dyn TileSource, container: &Container, name: &str) {
    assert_eq!(conformance(container), Ok(()), "{name}");
    assert_eq!(source.description(), container.description(), "{name}");
    for pos in source.description().geometry.pages() {
        let texels =
            |tiles: &dyn TileSource| block_on(tiles.read(pos)).unwrap().decode(source.description()).unwrap();
        assert!(texels(source) == texels(container), "{pos} of {name} differs");
    }
}

#[test]
fn a_container_has_the_levels_of_the_pyramid() {
    for name in
        ["cog-deflate-u16.tif", "cog-zstd-f32.tif", "maketx.tx", "slide-jpeg.svs", "vips-subifd-jpeg.tif"]
    {
        let (source, sandbox) = (open(&fixture(name)), Sandbox::new());
        let page = source.description().geometry.page()[0];
        let options = BuildOptions { page, ..keeping() };
        let output = sandbox.path("kept.vastex");
        let report = build(&[fixture(name)], &output, &options, &()).unwrap();
        check_tiles(&*source, &Container::open_file(&output).unwrap(), name);
        assert_eq!(report.tiles, source.description().geometry.page_count(), "{name}");
        assert_eq!(sandbox.names(), ["kept.vastex"], "nothing else is left");
    }
}

#[test]
fn levels_are_kept_that_no_filter_would_make() {
    // Of the real picture; another level 1 could only come from the file.
    let (name, sandbox) = ("vips-chained.tif", Sandbox::new());
    let made = sandbox.build_as("made.vastex", &[fixture(name).as_path().into()], &BuildOptions::default());
    let options = BuildOptions { page: 128, ..keeping() };
    let kept = sandbox.build_as("kept.vastex", &[fixture(name).as_path().into()], &options);
    let open = |path: &PathBuf| Container::open_file(path).unwrap();
    let (made, kept) = (open(&made), open(&kept));
    let geometry = &made.description().geometry;
    assert_eq!(geometry, &kept.description().geometry);
    let differs = |level: u8| {
        let texels = |container: &Container, pos| block_on(container.read(pos)).unwrap().bytes;
        geometry.pages_of_level(level).any(|pos| texels(&made, pos) != texels(&kept, pos))
    };
    assert!(!differs(0) && differs(1), "level 1 is the file's own, by another filter");
}

#[test]
fn a_directory_keeps_its_levels_too_and_blocks_are_made_of_them() {
    let (sandbox, size) = (Sandbox::new(), [600, 400]);
    let image = sandbox.image("image.png", size, png::ColorType::Rgb, &texels(600 * 400 * 3, 4));
    let container = sandbox.build_as("image.vastex", &[image.as_path().into()], &BuildOptions::default());
    let container = Container::open_file(&container).unwrap();
    let options = ExportOptions { format: Some(TileFormat::Png), ..ExportOptions::new(Layout::DeepZoom) };
    let zoom = sandbox.path("zoom");
    export(&container, &zoom, &options, &()).unwrap();
    let source = DirectorySource::open(&zoom).unwrap();
    let page = source.description().geometry.page()[0];
    let kept = sandbox.build_as("kept.vastex", &[zoom.as_path().into()], &BuildOptions { page, ..keeping() });
    check_tiles(&source, &Container::open_file(&kept).unwrap(), "a directory");
    if cfg!(feature = "bc") {
        let input = LayerInput { format: Some(LayerFormat::Bc1Srgb), ..zoom.as_path().into() };
        let options = BuildOptions { address: [AddressMode::Clamp, AddressMode::Mirror], ..keeping() };
        let blocks = Container::open_file(sandbox.build_as("blocks.vastex", &[input], &options)).unwrap();
        assert_eq!(conformance(&blocks), Ok(()));
        assert_eq!(blocks.description().layers[0].format, LayerFormat::Bc1Srgb);
        assert_eq!(blocks.description().geometry.address()[1], AddressMode::Mirror);
    }
}

#[test]
fn what_does_not_go_with_kept_levels_is_refused_by_its_name() {
    let sandbox = Sandbox::new();
    let pyramid = || LayerInput::from(fixture("maketx.tx").as_path());
    let refused = |input: LayerInput, options: BuildOptions| sandbox.error(&[input], &options);
    let with = |change: &dyn Fn(&mut BuildOptions)| {
        let mut options = keeping();
        change(&mut options);
        refused(pyramid(), options)
    };
    assert!(with(&|options| options.linear = false).contains("--linear off"));
    assert!(with(&|options| options.drop_transparent = true).contains("--drop-transparent"));
    assert!(with(&|options| options.mask = Some("mask.png".into())).contains("a mask"));
    assert!(with(&|options| options.part = PartOf::new(1, 2)).contains("--shard"));
    assert!(with(&|options| options.resume = true).contains("--resume"));
    assert!(with(&|options| options.filter = Some("kaiser".parse().unwrap())).contains("a filter"));
    let format = LayerInput { format: Some(LayerFormat::R32Float), ..pyramid() };
    let error = refused(format, keeping());
    assert!(error.contains("r32f") && error.contains("bc7-srgb"), "{error}");
    let image = sandbox.image("image.png", [40, 30], png::ColorType::Rgb, &texels(3600, 4));
    let error = refused(image.as_path().into(), keeping());
    assert!(error.contains("image.png") && error.contains("no levels to keep"), "{error}");
    let error = refused(fixture("lzw-imagecodecs.tif").as_path().into(), keeping());
    assert!(error.contains("without further levels"), "{error}");
    let two = build(&[pyramid(), pyramid()], &sandbox.path("none.vastex"), &keeping(), &());
    assert!(matches!(two, Err(BuildError::KeptLevels("several layers"))));
}
