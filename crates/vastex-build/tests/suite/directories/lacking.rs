//! Textures that lack tiles, exported: planets lack them too, everything else shows the nearest ancestor.

use std::fs;
use std::io::Cursor;
use std::sync::Arc;

use pollster::block_on;
use vastex_build::{ExportOptions, Layout, TileFormat, export};
use vastex_core::{Description, Dims, Geometry, GeometrySpec, Layer, LayerFormat, PagePos};
use vastex_tiles::{
    Compression, Container, ContainerWriter, EncodedTile, MemoryStore, PropertySource, TileSource,
    WriterOptions,
};

use crate::directories::pictures::{Picture, Sandbox};

/// The generated source without the eastern half of level 0.
fn western(size: [u32; 2]) -> Container {
    let spec = GeometrySpec { page: 16, border: 2, ..GeometrySpec::image(size[0], size[1]) };
    let source = PropertySource::new(Geometry::new(spec).unwrap());
    container(source.description(), |pos| {
        let keeps = pos.level > 0 || pos.x < size[0] / 32;
        keeps.then(|| block_on(source.read(pos)).unwrap().bytes.to_vec())
    })
}

fn container(description: &Description, texels: impl Fn(PagePos) -> Option<Vec<u8>>) -> Container {
    let out = Cursor::new(Vec::new());
    let mut writer =
        ContainerWriter::new(out, "memory", description.clone(), WriterOptions::default()).unwrap();
    for pos in description.geometry.pages() {
        if let Some(texels) = texels(pos) {
            writer.append(pos, EncodedTile::new(texels.into(), description, Compression::None)).unwrap();
        }
    }
    let bytes = writer.complete().unwrap().0.into_inner();
    block_on(Container::open(Arc::new(MemoryStore::new("memory", bytes)))).unwrap()
}

fn options(layout: Layout) -> ExportOptions {
    ExportOptions { format: Some(TileFormat::Png), ..ExportOptions::new(layout) }
}

#[test]
fn planets_lack_the_tiles_that_the_texture_lacks() {
    let (sandbox, source) = (Sandbox::new(), western([128, 64]));
    let target = sandbox.path("planet");
    let report =
        export(&source, &target, &ExportOptions { tile_size: Some(16), ..options(Layout::GaiaSky) }, &())
            .unwrap();
    let names = |level: &str| fs::read_dir(target.join(level)).unwrap().count();
    assert_eq!((names("level0"), names("level1"), names("level2")), (2, 8, 16));
    assert_eq!(report.tiles, 26);
    assert!(target.join("level2/tx_3_0.png").exists() && !target.join("level2/tx_4_0.png").exists());
}

#[test]
fn other_layouts_show_the_nearest_ancestor() {
    let (sandbox, source) = (Sandbox::new(), western([100, 70]));
    export(
        &source,
        &sandbox.path("deep"),
        &ExportOptions { tile_size: Some(200), ..options(Layout::DeepZoom) },
        &(),
    )
    .unwrap();
    let finest = Picture::of_png(&sandbox.path("deep/deep_files/7/0_0.png"));
    for y in 0..70 {
        for x in 0..100 {
            let (level, texel) = if x < 48 { (0, [x, y, 0]) } else { (1, [x / 2, y / 2, 0]) };
            let color = PropertySource::color_from_texel(Dims::D2, level, texel).map(u16::from);
            assert_eq!(finest.at(x, y), color, "{x}, {y}");
        }
    }
}

#[test]
fn a_layer_of_half_the_resolution_is_a_picture_of_half_the_size() {
    let sandbox = Sandbox::new();
    let layers = vec![
        Layer::new("color", LayerFormat::Rgba8),
        Layer { scale: 2, ..Layer::new("mask", LayerFormat::Bc4) },
    ];
    let spec = GeometrySpec {
        page: 16,
        border: 8,
        tail_align: Description::tail_align(&layers),
        ..GeometrySpec::image(100, 70)
    };
    let description = Description::new(Geometry::new(spec).unwrap(), layers);
    // Blocks of one value, which says the page.
    let value = |pos: PagePos| (pos.x * 3 + pos.y * 20 + 60 * u32::from(pos.level) + 5) as u8;
    let source = container(&description, |pos| {
        let mut texels = vec![0; description.layer_range(0).end];
        let blocks = description.layer_blocks(&description.layers[1]) as usize;
        texels.extend([value(pos), value(pos), 0, 0, 0, 0, 0, 0].repeat(blocks));
        Some(texels)
    });
    let chosen =
        ExportOptions { layer: Some("mask".into()), tile_size: Some(200), ..options(Layout::DeepZoom) };
    let report = export(&source, &sandbox.path("mask"), &chosen, &()).unwrap();
    assert_eq!(report.size, [50, 35]);
    let picture = Picture::of_png(&sandbox.path("mask/mask_files/6/0_0.png"));
    for (x, y) in [(0, 0), (7, 7), (8, 7), (49, 34)] {
        assert_eq!(picture.at(x, y)[0], u16::from(value(PagePos::new_2d(0, x / 8, y / 8))), "{x}, {y}");
    }
}
