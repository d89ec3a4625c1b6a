//! Layers of every format and resolution, border colours and texels that keep their positions: the same as an
//! ordinary texture.

use std::sync::Arc;

use crate::common::{Tiles, gpu, is_processor, play, settings};
use crate::pictures::assert_alike;
use vastex::source::{ReadError, ReadFuture};
use vastex::survey::{Box3, TexelPositions, fold};
use vastex::{
    AddressMode, CpuTexture, Description, Filter, Geometry, GeometrySpec, Layer, LayerFormat, PagePos,
    TileSource,
};
use vastex_core::PageSet;
use vastex_scenes::{
    Comparison, DisplayOptions, Gpu, LayerOptions, Offscreen, Path, ReferenceKind, Scene, Until,
};

/// A texture whose layers are grain, another on every level; compressed ones of blocks of any content.
struct Grain {
    description: Arc<Description>,
    /// Where texels lie: by this, not by the description, which a broken one states wrongly.
    texel: fn(level: u8, texel: [u32; 2], channel: u32) -> f32,
    tiles: Tiles,
}

fn hash(values: [u32; 4]) -> u32 {
    let mixed = values
        .into_iter()
        .fold(0x9e37_79b1_u32, |hash, n| (hash ^ n).wrapping_mul(0x85eb_ca6b).rotate_left(13));
    (mixed ^ mixed >> 15).wrapping_mul(0xc2b2_ae35) >> 3
}

/// Checks that lie at the same place on all levels, since a pixel between two of them may take either, and
/// noise.
fn grain(level: u8, [x, y]: [u32; 2], channel: u32) -> f32 {
    let noise = (hash([level.into(), x, y, channel]) & 0xff) as f32 / 255.0;
    let check = ((((x << level) >> 5) + ((y << level) >> 5) + channel) & 1) as f32;
    0.3 + 0.25 * check + 0.04 * noise
}

impl Grain {
    fn new(spec: GeometrySpec, layers: &[Layer]) -> Arc<Grain> {
        let spec = GeometrySpec { tail_align: Description::tail_align(layers), ..spec };
        let geometry = Geometry::new(spec).unwrap();
        let description =
            Description { border_color: [160, 90, 120, 255], ..Description::new(geometry, layers.to_vec()) };
        description.check().unwrap();
        Arc::new(Grain { description: Arc::new(description), texel: grain, tiles: Tiles::default() })
    }

    fn tile(&self, pos: PagePos) -> Vec<u8> {
        let layers = self.description.layers.iter();
        layers.flat_map(|layer| self.layer(layer, pos)).collect()
    }

    fn layer(&self, layer: &Layer, pos: PagePos) -> Vec<u8> {
        let shape = self.description.geometry.of_layer(layer.scale);
        let mut blocks = vec![0; self.description.layer_bytes(layer)];
        if !shape.is_tail(pos) {
            self.fill(layer, &shape, pos.level, shape.level_box_of_tile(pos), [0; 3], &mut blocks);
            return blocks;
        }
        for level in pos.level..=shape.coarsest() {
            let (level_box, offset) = (shape.level_box_of_tail(level), shape.tail().offset(level));
            self.fill(layer, &shape, level, level_box, offset, &mut blocks);
        }
        blocks
    }

    fn fill(
        &self,
        layer: &Layer,
        shape: &Geometry,
        level: u8,
        at: Box3,
        offset: [u32; 3],
        blocks: &mut [u8],
    ) {
        let (side, bytes) = (layer.format.block_side(), layer.format.block_bytes());
        let across = shape.tile()[0] / side;
        let [columns, rows] = [0, 1].map(|a| at.size[a].div_ceil(side));
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            let block = self.block(
                layer,
                shape,
                level,
                [0, 1].map(|a| at.origin[a].div_euclid(side.into()) + i64::from([column, row][a])),
            );
            let first = ((offset[1] / side + row) * across + offset[0] / side + column) as usize * bytes;
            blocks[first..first + bytes].copy_from_slice(&block);
        }
    }

    /// A texel, or a block, by its place in the level.
    fn block(&self, layer: &Layer, shape: &Geometry, level: u8, [x, y]: [i64; 2]) -> Vec<u8> {
        let (format, mode, size) = (layer.format, shape.address(), shape.level(level).size);
        if format.is_compressed() {
            let blocks = [0, 1].map(|a| size[a].div_ceil(4));
            let [x, y] = [fold(mode[0], x, blocks[0]), fold(mode[1], y, blocks[1])];
            return (0..4)
                .flat_map(|n| hash([level.into(), x, y, n]).to_le_bytes())
                .take(format.block_bytes())
                .collect();
        }
        let border = self.description.border_color;
        let value = |channel: u32| match shape.is_border_color(level, [x, y, 0]) {
            true => f32::from(border[channel as usize]) / 255.0,
            false => {
                let [x, y, _] = shape.fold_texel(level, [x, y, 0]);
                (self.texel)(level, [x, y], channel)
            }
        };
        let channels = format.channels() as u32;
        match format.block_bytes() as u32 / channels {
            1 => (0..channels).map(|c| (value(c) * 255.0).round() as u8).collect(),
            2 if matches!(format, LayerFormat::R16 | LayerFormat::Rgba16) => {
                (0..channels).flat_map(|c| ((value(c) * 65535.0).round() as u16).to_le_bytes()).collect()
            }
            2 => (0..channels).flat_map(|c| half::f16::from_f32(value(c)).to_le_bytes()).collect(),
            _ => (0..channels).flat_map(|c| value(c).to_le_bytes()).collect(),
        }
    }
}

impl TileSource for Grain {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn present(&self) -> Option<&Arc<PageSet>> {
        None
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let known = self.description.geometry.contains(pos);
        Box::pin(async move {
            if known {
                Ok(self.tiles.get(pos, || self.tile(pos)))
            } else {
                Err(ReadError::NoSuchTile { pos })
            }
        })
    }
}

fn spec(page: u32, border: u32, address: AddressMode) -> GeometrySpec {
    GeometrySpec { page, border, address: [address; 3], ..GeometrySpec::image(512, 256) }
}

fn compare_on(
    gpu: &Gpu,
    source: Arc<dyn TileSource>,
    (layer, range): (&str, Option<[f32; 2]>),
    path: Path,
    filter: Filter,
) -> (Comparison, ReferenceKind) {
    let layer = LayerOptions { name: Some(layer.into()), range, ..LayerOptions::default() };
    let shown = DisplayOptions { layers: vec![layer], ..DisplayOptions::default() };
    let mut offscreen =
        Offscreen::showing(&shown, gpu, source, Scene::Plane, [160, 90], settings(16, filter)).unwrap();
    play(&mut offscreen, path);
    offscreen.compare().unwrap()
}

fn compare(source: Arc<dyn TileSource>, layer: &str, path: Path, filter: Filter) -> Comparison {
    compare_on(gpu(), source, (layer, None), path, filter).0
}

/// Each range that a layer of this format is shown by, with the filter: none, where black and white are 0 and
/// 1, and for BC6H, whose light reaches the largest half float, also all of that.
fn by_ranges(format: LayerFormat, filter: Filter) -> Vec<(Filter, Option<[f32; 2]>)> {
    let all = (format == LayerFormat::Bc6h).then_some((filter, Some([0.0, 65_504.0])));
    [(filter, None)].into_iter().chain(all).collect()
}

/// A device on which nothing is there that can be done without.
fn bare_gpu() -> Gpu {
    let descriptor = wgpu::DeviceDescriptor { required_limits: gpu().adapter.limits(), ..Default::default() };
    let (device, queue) = pollster::block_on(gpu().adapter.request_device(&descriptor)).unwrap();
    Gpu::new(gpu().instance.clone(), gpu().adapter.clone(), device, queue)
}

/// Blocks of any content have the contrast of noise, and drivers decode some of them with a difference of
/// 2/255.
const COMPRESSED_PSNR_DB: f64 = 38.0;

/// The least likeness of pictures of BC6H that are shown without a range, so with light far above white, on a
/// GPU: one step of a filter's weight (docs/draw-checks.md, "What a GPU may differ by") of the brightest
/// texel is 256 times white, so that a pixel that hardly has such a texel is black or white by that. Wrong
/// blocks would be so in whole, not in some of their pixels.
const BRIGHT_PSNR_DB: f64 = 34.0;
const BRIGHT_SHARE: f64 = 0.02;

fn assert_shown(format: LayerFormat, range: Option<[f32; 2]>, comparison: &Comparison, what: &str) {
    if format == LayerFormat::Bc6h && range.is_none() && !is_processor() {
        let is_near = comparison.psnr_db > BRIGHT_PSNR_DB && comparison.share_beyond_3_255 < BRIGHT_SHARE;
        assert!(is_near, "{what}: {format:?} {comparison:?}");
    } else if format.is_compressed() {
        assert!(comparison.psnr_db > COMPRESSED_PSNR_DB, "{what}: {format:?} {range:?} {comparison:?}");
    } else {
        assert_alike(comparison, &format!("{what}: {format:?}"));
    }
}

/// The filter that most use, and each of the others in turn.
fn two_filters(nth: usize) -> [Filter; 2] {
    let others = Filter::KINDS.into_iter().filter(|&filter| filter != Filter::Trilinear);
    let others: Vec<Filter> = others.collect();
    [Filter::Trilinear, others[nth % others.len()]]
}

#[test]
fn every_format_equals_an_ordinary_texture() {
    for (nth, format) in LayerFormat::ALL.into_iter().enumerate() {
        let layers = [Layer::new("first", LayerFormat::R8), Layer::new("second", format)];
        let source = Grain::new(spec(64, 4, AddressMode::Wrap), &layers);
        for (filter, range) in two_filters(nth).into_iter().flat_map(|filter| by_ranges(format, filter)) {
            let (comparison, _) = compare_on(gpu(), source.clone(), ("second", range), Path::Still, filter);
            assert_shown(format, range, &comparison, &format!("as it is, {filter}"));
        }
    }
}

#[test]
fn what_a_device_cannot_do_is_done_without_it() {
    use LayerFormat::{Bc1Srgb, Bc4, Bc5, Bc6h, Bc7, R16, R32Float, Rgba16};
    let bare = bare_gpu();
    for (nth, format) in [Bc1Srgb, Bc4, Bc5, Bc6h, Bc7, R16, R32Float, Rgba16].into_iter().enumerate() {
        let layers = [Layer { scale: 2, ..Layer::new("a", LayerFormat::Bc4) }, Layer::new("b", format)];
        let source = Grain::new(spec(64, 8, AddressMode::Wrap), &layers);
        for (filter, range) in two_filters(nth).into_iter().flat_map(|filter| by_ranges(format, filter)) {
            let (comparison, kind) = compare_on(&bare, source.clone(), ("b", range), Path::Still, filter);
            // Decoded blocks are ordinary texels; what is filtered in the shader has no ordinary texture.
            let expected = if format.is_compressed() { ReferenceKind::Gpu } else { ReferenceKind::Cpu };
            assert_eq!(kind, expected, "{format:?}");
            assert_shown(format, range, &comparison, &format!("without features, {filter}"));
        }
    }
}

#[test]
fn layers_at_a_fraction_of_the_resolution_have_no_seams() {
    let layers = [
        Layer::new("color", LayerFormat::Rgba8Srgb),
        Layer { scale: 2, ..Layer::new("half", LayerFormat::R16) },
        Layer { scale: 4, ..Layer::new("quarter", LayerFormat::Rgba8) },
        Layer { scale: 2, ..Layer::new("blocks", LayerFormat::Bc5) },
    ];
    for (address, size) in [(AddressMode::Wrap, [512, 256]), (AddressMode::Clamp, [500, 333])] {
        let spec = GeometrySpec { size: [size[0], size[1], 1], ..spec(64, 8, address) };
        let source = Grain::new(spec, &layers);
        let shown = layers.iter().filter(|l| address == AddressMode::Wrap || !l.format.is_compressed());
        for (nth, layer) in shown.enumerate() {
            for filter in two_filters(nth) {
                let comparison = compare(source.clone(), &layer.name, Path::Zoom, filter);
                let what = format!("{} {filter:?} {address:?}", layer.name);
                assert_shown(layer.format, None, &comparison, &what);
            }
        }
    }
}

#[test]
fn border_colours_and_kept_positions_equal_an_ordinary_texture() {
    let kept = TexelPositions::Kept;
    for (positions, address) in [
        (TexelPositions::Centered, AddressMode::Border),
        (kept, AddressMode::Border),
        (kept, AddressMode::Clamp),
        (kept, AddressMode::Wrap),
    ] {
        for (width, height) in [(512, 256), (333, 500)] {
            let spec = GeometrySpec { positions, size: [width, height, 1], ..spec(64, 4, address) };
            let source = Grain::new(spec, &[Layer::new("color", LayerFormat::Rgba8)]);
            let comparison = compare(source, "color", Path::Still, Filter::Trilinear);
            let what = format!("{positions:?} {address:?} {width}x{height}");
            if positions == TexelPositions::Centered {
                assert_alike(&comparison, &what);
            }
            // With kept positions one pixel in a thousand of far, grainy levels may differ by more than
            // elsewhere; positions off by the offset, which is up to half a texel everywhere, cost far more.
            let is_alike = comparison.share_within_1_255 >= 0.998 && comparison.psnr_db > 55.0;
            assert!(is_alike, "{what}: {comparison:?}");
        }
    }
}

/// A layer whose texels are told to be at another resolution than they are is another picture.
#[test]
fn a_wrong_scale_is_seen() {
    struct Lying(Arc<Grain>, Arc<Description>);
    impl TileSource for Lying {
        fn description(&self) -> &Arc<Description> {
            &self.1
        }
        fn read(&self, pos: PagePos) -> ReadFuture<'_> {
            self.0.read(pos)
        }
    }
    let layer = |scale| [Layer { scale, ..Layer::new("a", LayerFormat::R8) }];
    let truth = Grain::new(spec(64, 8, AddressMode::Wrap), &layer(2));
    let picture = |source: Arc<dyn TileSource>| {
        let mut offscreen =
            Offscreen::new(gpu(), source, Scene::Plane, [160, 90], settings(16, Filter::Trilinear)).unwrap();
        assert!(offscreen.run(Path::Still, Until::Converged, |_, _| ()).unwrap().converged);
        offscreen.picture()
    };
    // The same tiles, said to be those of a texture of half the size at full resolution: the same texels,
    // another place.
    let half = GeometrySpec { size: [256, 128, 1], ..spec(32, 4, AddressMode::Wrap) };
    let lie =
        Description::new(Geometry::new(GeometrySpec { tail_align: 4, ..half }).unwrap(), layer(1).to_vec());
    assert_eq!(lie.tile_bytes(), truth.description.tile_bytes());
    let honest = picture(truth.clone());
    let lying = picture(Arc::new(Lying(truth, Arc::new(lie))));
    let alike = Comparison::of(&honest, &lying);
    assert!(alike.share_within_1_255 < 0.9 && alike.psnr_db < 45.0, "{alike:?}");
}

/// With kept positions a texel of any level lies where the first of those that it covers lies: a ramp is the
/// same on all.
#[test]
fn texels_that_keep_their_positions_line_up_on_all_levels() {
    const SIDE: u32 = 1024;
    let ramp = |positions| {
        let spec = GeometrySpec { positions, page: 64, ..GeometrySpec::image(SIDE, SIDE) };
        let grain = Grain::new(spec, &[Layer::new("ramp", LayerFormat::R32Float)]);
        let texel: fn(u8, [u32; 2], u32) -> f32 =
            |level, [x, _], _| ((x << level) as f32 + 0.5) / SIDE as f32;
        let tiles = Tiles::default();
        let source = Arc::new(Grain { description: grain.description.clone(), texel, tiles });
        CpuTexture::new(source, 0, Filter::Trilinear, 0).unwrap()
    };
    let error = |texture: &CpuTexture, level: f32| {
        let step = level.exp2() / SIDE as f32;
        let sample = |u: f32| texture.sample_grad([u, 0.4], [step, 0.0], [0.0, step]).unwrap()[0];
        [0.2, 0.37, 0.5, 0.61].map(|u| (sample(u) - u).abs()).into_iter().fold(0.0, f32::max) * SIDE as f32
    };
    let (kept, centered) = (ramp(TexelPositions::Kept), ramp(TexelPositions::Centered));
    for level in [0.0, 0.5, 1.0, 2.3, 4.0, 6.7] {
        assert!(error(&kept, level) < 0.01, "level {level}: {} texels", error(&kept, level));
    }
    assert!(
        error(&centered, 4.0) > 7.0,
        "without the offset the ramp must be off by half a texel of the level"
    );
}
