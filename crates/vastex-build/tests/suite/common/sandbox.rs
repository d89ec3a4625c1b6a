//! Images and containers of several layers in a directory of their own.

use std::path::{Path, PathBuf};

use bytes::Bytes;
use half::f16;
use png::{BitDepth, ColorType};
use vastex_build::{BuildOptions, LayerInput, build};
use vastex_core::{Description, LayerFormat, PagePos};
use vastex_tiles::decode_layer;

use super::{texels, write_png};

/// A directory with images.
pub struct Sandbox(tempfile::TempDir);

impl Sandbox {
    pub fn new() -> Sandbox {
        Sandbox(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// An image of 8 bits.
    pub fn image(&self, name: &str, size: [u32; 2], color: ColorType, data: &[u8]) -> PathBuf {
        write_png(&self.path(name), size, color, BitDepth::Eight, data);
        self.path(name)
    }

    pub fn build(&self, inputs: &[LayerInput], options: &BuildOptions) -> PathBuf {
        build(inputs, &self.path("out.vastex"), options, &()).unwrap();
        self.path("out.vastex")
    }

    /// Builds into a place of its own.
    pub fn build_as(&self, name: &str, inputs: &[LayerInput], options: &BuildOptions) -> PathBuf {
        build(inputs, &self.path(name), options, &()).unwrap();
        self.path(name)
    }

    pub fn error(&self, inputs: &[LayerInput], options: &BuildOptions) -> String {
        let error = build(inputs, &self.path("none.vastex"), options, &()).unwrap_err().to_string();
        assert!(!self.path("none.vastex").exists());
        error
    }

    /// The names of all files.
    pub fn names(&self) -> Vec<String> {
        let names = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<_> = names.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

pub fn layer(name: &str, path: &Path, format: Option<LayerFormat>) -> LayerInput {
    LayerInput { name: name.into(), format, ..path.into() }
}

/// Hills with a little noise: what block compression is made for.
pub fn hills(size: [u32; 2], channels: usize) -> Vec<u8> {
    let noise = texels((size[0] * size[1]) as usize * channels, 5);
    let wave = |i: usize| {
        let (texel, channel) = (i / channels, i % channels);
        let (x, y) = ((texel % size[0] as usize) as f64, (texel / size[0] as usize) as f64);
        let height = (x / (9.0 + channel as f64)).sin() + (y / 13.0).cos();
        (128.0 + 50.0 * height + f64::from(noise[i] % 4)) as u8
    };
    (0..noise.len()).map(wave).collect()
}

/// The number that a texel's channel stands for.
pub fn values(format: LayerFormat, texels: &[u8]) -> Vec<f64> {
    use LayerFormat::*;
    let two = || texels.as_chunks::<2>().0.iter();
    match format.decoded() {
        R8 | Rg8 | Rgba8 | Rgba8Srgb => texels.iter().map(|&v| f64::from(v) / 255.0).collect(),
        R16 | Rgba16 => two().map(|&v| f64::from(u16::from_le_bytes(v)) / 65535.0).collect(),
        R16Float | Rgba16Float => two().map(|&v| f16::from_le_bytes(v).to_f64()).collect(),
        _ => texels.as_chunks::<4>().0.iter().map(|&v| f64::from(f32::from_le_bytes(v))).collect(),
    }
}

/// The texels of one layer of a tile.
pub fn layer_texels(description: &Description, number: usize, tile: &[u8]) -> Vec<u8> {
    decode_layer(description, number, &Bytes::copy_from_slice(tile)).to_vec()
}

/// Fails unless tiles beside each other decode to the same texels, in every layer, wherever they hold the
/// same place of a level. Gives back how many pairs there were.
pub fn assert_neighbours_agree(description: &Description, tiles: &[(PagePos, Vec<u8>)]) -> usize {
    let tile_of = |pos: PagePos| tiles.iter().find(|(at, _)| *at == pos).map(|(_, tile)| tile);
    let mut pairs = 0;
    for (pos, tile) in tiles.iter().filter(|(pos, _)| !description.geometry.is_tail(*pos)) {
        for [x, y] in [[1, 0], [0, 1]] {
            let Some(other) = tile_of(PagePos { x: pos.x + x, y: pos.y + y, ..*pos }) else { continue };
            pairs += 1;
            for (number, layer) in description.layers.iter().enumerate() {
                let texel = layer.format.texel_bytes();
                let side = (description.geometry.tile()[0] / layer.scale) as usize;
                let page = (description.geometry.page()[0] / layer.scale) as usize;
                let [a, b] = [tile, other].map(|tile| layer_texels(description, number, tile));
                let pitch = side * texel;
                for row in 0..if y == 1 { side - page } else { side } {
                    let of = |texels: &[u8], first: usize, row: usize| {
                        texels[row * pitch..][first * texel..pitch].to_vec()
                    };
                    let (a, b) = match y {
                        1 => (of(&a, 0, row + page), of(&b, 0, row)),
                        _ => (of(&a, page, row), of(&b, 0, row)[..(side - page) * texel].to_vec()),
                    };
                    assert!(a == b, "{pos} and the one {x},{y} from it differ in {}, row {row}", layer.name);
                }
            }
        }
    }
    pairs
}
