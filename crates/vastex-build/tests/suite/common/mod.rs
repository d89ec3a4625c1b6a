//! Image files made on the spot, and the pyramid the slow way: the oracle of the tests here.

#![allow(unreachable_pub, reason = "a module of a test program")]

pub mod exr;
pub mod files;
pub mod image;
pub mod profiles;
pub mod sandbox;

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use vastex_build::{BuildOptions, BuildReport, build};
use vastex_core::{AddressMode, Description, LayerFormat, PagePos};
use vastex_tiles::{Container, TileSource};

/// A texel's channels; one that a format lacks is absent.
pub type Texel = Vec<u32>;

/// Bytes that look like noise in places and are smooth in others, the same for the same seed.
pub fn texels(len: usize, seed: u32) -> Vec<u8> {
    let mut state = seed | 1;
    (0..len)
        .map(|i| {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            if (i / 600) % 3 == 0 { (i / 7) as u8 } else { state as u8 }
        })
        .collect()
}

pub fn write_png(path: &Path, size: [u32; 2], color: png::ColorType, depth: png::BitDepth, data: &[u8]) {
    let file = BufWriter::new(File::create(path).unwrap());
    let mut encoder = png::Encoder::new(file, size[0], size[1]);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
}

pub fn build_file(input: &Path, options: &BuildOptions) -> (PathBuf, BuildReport) {
    let output = input.with_extension("vastex");
    let report = build(&[input], &output, options, &()).unwrap();
    (output, report)
}

/// Every tile of a container, decoded. Pages without a tile are left out.
pub fn tiles(path: &Path) -> (Description, Vec<(PagePos, Vec<u8>)>) {
    let container = Container::open_file(path).unwrap();
    let description = (**container.description()).clone();
    let present = |pos: &PagePos| container.present().is_none_or(|present| present.contains(*pos));
    let tiles = description.geometry.pages().filter(present).map(|pos| {
        let tile = pollster::block_on(container.read(pos)).unwrap();
        (pos, tile.decode(&description).unwrap().to_vec())
    });
    let tiles = tiles.collect();
    (description, tiles)
}

/// One level, texel by texel.
pub struct NaiveLevel {
    size: [i64; 2],
    texels: Vec<Texel>,
}

impl NaiveLevel {
    fn at(&self, x: i64, y: i64, address: [AddressMode; 2]) -> &Texel {
        let [x, y] = [step_inside(x, self.size[0], address[0]), step_inside(y, self.size[1], address[1])];
        &self.texels[(y * self.size[0] + x) as usize]
    }
}

/// Walks into `0..size` step by step.
fn step_inside(mut i: i64, size: i64, mode: AddressMode) -> i64 {
    while !(0..size).contains(&i) {
        i = match mode {
            AddressMode::Clamp | AddressMode::Border => i + if i < 0 { 1 } else { -1 },
            AddressMode::Wrap => i + if i < 0 { size } else { -size },
            AddressMode::Mirror if i < 0 => -1 - i,
            AddressMode::Mirror => 2 * size - 1 - i,
        };
    }
    i
}

/// All levels of an image, whose texels are those of its layer.
pub fn naive_levels(description: &Description, linear: bool, layer: &[u8]) -> Vec<NaiveLevel> {
    let format = description.layers[0].format;
    let address = [description.geometry.address()[0], description.geometry.address()[1]];
    let size = description.geometry.size();
    let parse = |bytes: &[u8]| match format {
        LayerFormat::R16 => vec![u32::from(u16::from_le_bytes([bytes[0], bytes[1]]))],
        _ => bytes.iter().map(|&b| u32::from(b)).collect(),
    };
    let texels = layer.chunks(format.texel_bytes()).map(parse).collect();
    let mut levels = vec![NaiveLevel { size: [size[0].into(), size[1].into()], texels }];
    while levels.last().unwrap().size != [1, 1] {
        let finer = levels.last().unwrap();
        let size = finer.size.map(|n| (n + 1) / 2);
        let mut texels = Vec::new();
        for y in 0..size[1] {
            for x in 0..size[0] {
                let four =
                    [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[i, j]| finer.at(2 * x + i, 2 * y + j, address));
                texels.push(naive_mean(format, linear, four));
            }
        }
        levels.push(NaiveLevel { size, texels });
    }
    levels
}

fn naive_mean(format: LayerFormat, linear: bool, four: [&Texel; 4]) -> Texel {
    let color = matches!(format, LayerFormat::Rgba8 | LayerFormat::Rgba8Srgb);
    let plain = |c: usize| (four.iter().map(|t| t[c]).sum::<u32>() + 2) / 4;
    if !color || !linear {
        return (0..four[0].len()).map(plain).collect();
    }
    let srgb = format == LayerFormat::Rgba8Srgb;
    let decode = |v: u32| {
        let s = f64::from(v) / 255.0;
        let l = if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) };
        if srgb { (l * 65535.0).round() as u64 } else { v.into() }
    };
    let encode = |v: u64| {
        let l = v as f64 / 65535.0;
        let s = if l <= 0.0031308 { l * 12.92 } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 };
        if srgb { (s * 255.0).round() as u32 } else { v as u32 }
    };
    let transparent = four.iter().all(|t| t[3] == 0);
    let weight = |t: &Texel| if transparent { 1 } else { u64::from(t[3]) };
    let total: u64 = four.iter().map(|t| weight(t)).sum();
    let mean =
        |c: usize| encode((four.iter().map(|t| weight(t) * decode(t[c])).sum::<u64>() + total / 2) / total);
    vec![mean(0), mean(1), mean(2), plain(3)]
}

/// The bytes of a tile, texel by texel.
pub fn naive_tile(description: &Description, levels: &[NaiveLevel], pos: PagePos) -> Vec<u8> {
    let (geometry, format) = (&description.geometry, description.layers[0].format);
    let address = [geometry.address()[0], geometry.address()[1]];
    let (page, border, side) =
        (i64::from(geometry.page()[0]), i64::from(geometry.border()[0]), i64::from(geometry.tile()[0]));
    let mut tile = vec![0; description.tile_bytes()];
    let mut put = |x: i64, y: i64, texel: &Texel| {
        let at = (y * side + x) as usize * format.texel_bytes();
        match format {
            LayerFormat::R16 => tile[at..at + 2].copy_from_slice(&(texel[0] as u16).to_le_bytes()),
            _ => texel.iter().enumerate().for_each(|(c, &v)| tile[at + c] = v as u8),
        }
    };
    if !geometry.is_tail(pos) {
        let level = &levels[usize::from(pos.level)];
        for y in 0..side {
            for x in 0..side {
                let (u, v) = (i64::from(pos.x) * page + x - border, i64::from(pos.y) * page + y - border);
                put(x, y, level.at(u, v, address));
            }
        }
        return tile;
    }
    for number in pos.level..=geometry.coarsest() {
        let (level, offset) = (&levels[usize::from(number)], geometry.tail().offset(number).map(i64::from));
        for y in -border..level.size[1] + border {
            for x in -border..level.size[0] + border {
                put(offset[0] + border + x, offset[1] + border + y, level.at(x, y, address));
            }
        }
    }
    tile
}

/// Checks every tile of a container against the slow way.
pub fn check_against_naive(container: &Path, linear: bool, layer: &[u8]) {
    let (description, tiles) = tiles(container);
    let levels = naive_levels(&description, linear, layer);
    for (pos, texels) in tiles {
        let expected = naive_tile(&description, &levels, pos);
        if texels != expected {
            let at = texels.iter().zip(&expected).position(|(a, b)| a != b).unwrap();
            let texel = at / description.block_bytes();
            let side = description.geometry.tile()[0] as usize;
            panic!("{pos}: differs first at tile texel {}, {}", texel % side, texel / side);
        }
    }
}
