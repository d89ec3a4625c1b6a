//! The image of a layer, of which regions change.

use png::{BitDepth, ColorType};
use vastex_build::{LayerFilter, LayerImage, LayerInput};
use vastex_core::LayerFormat;

use super::sandbox::Sandbox;
use super::{texels, write_png};

/// The image of one layer.
#[derive(Clone)]
pub struct Image {
    pub name: &'static str,
    /// Texels of the texture along one of it.
    pub scale: u32,
    pub color: ColorType,
    pub depth: BitDepth,
    pub format: Option<LayerFormat>,
    pub filter: Option<LayerFilter>,
    /// Of the texture.
    pub whole: [u32; 2],
    pub data: Vec<u8>,
}

impl Image {
    pub fn new(name: &'static str, scale: u32, color: ColorType, whole: [u32; 2]) -> Image {
        let mut image = Image {
            name,
            scale,
            color,
            depth: BitDepth::Eight,
            format: None,
            filter: None,
            whole,
            data: Vec::new(),
        };
        let [width, height] = image.size();
        image.data = texels((width * height) as usize * image.texel(), scale * 77 + width);
        image
    }

    pub fn size(&self) -> [u32; 2] {
        self.whole.map(|n| n.div_ceil(self.scale))
    }

    pub fn texel(&self) -> usize {
        self.depth as usize / 8 * self.color.samples()
    }

    /// The whole as a file.
    pub fn input(&self, sandbox: &Sandbox) -> LayerInput {
        let path = sandbox.path(&format!("{}.png", self.name));
        write_png(&path, self.size(), self.color, self.depth, &self.data);
        LayerInput { name: self.name.into(), path, format: self.format, filter: self.filter }
    }

    /// Texels of a region of the texture that crosses wrapping edges, along one axis.
    pub fn part_len(&self, axis: usize, at: u32, len: u32) -> u32 {
        let (end, whole, of) = (at + len, self.whole[axis], |n: u32| n.div_ceil(self.scale));
        if end <= whole { of(end) - at / self.scale } else { of(whole) - at / self.scale + of(end - whole) }
    }

    /// Changes a region, given in texels of the texture, of the whole; what goes there as a file.
    pub fn change(
        &mut self,
        sandbox: &Sandbox,
        at: [u32; 2],
        len: [u32; 2],
        new: impl Fn([u32; 2], usize) -> u8,
    ) -> LayerImage {
        let size = [0, 1].map(|a| self.part_len(a, at[a], len[a]));
        let (texel, row) = (self.texel(), self.size()[0]);
        let mut part = Vec::new();
        for y in 0..size[1] {
            for x in 0..size[0] {
                let bytes: Vec<u8> = (0..texel).map(|byte| new([x, y], byte)).collect();
                let whole = [x + at[0] / self.scale, y + at[1] / self.scale];
                let whole = [0, 1].map(|a| whole[a] % self.size()[a]);
                self.data[(whole[1] * row + whole[0]) as usize * texel..][..texel].copy_from_slice(&bytes);
                part.extend(bytes);
            }
        }
        let path = sandbox.path(&format!("{}-part.png", self.name));
        write_png(&path, size, self.color, self.depth, &part);
        LayerImage { layer: Some(self.name.into()), path, format: None, filter: None }
    }
}
