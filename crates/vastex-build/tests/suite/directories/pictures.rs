//! Pictures in memory: of PNG files, and of the levels of a container, texel by texel.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use vastex_build::{BuildOptions, ExportOptions, ExportReport, build, export};
use vastex_core::{AddressMode, Geometry, LayerFormat, PagePos};
use vastex_tiles::Container;

use crate::common::{texels, tiles, write_png};

/// Four channels; grey stands in the first three, alpha that is missing is the largest value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Picture {
    pub(crate) size: [u32; 2],
    pub(crate) texels: Vec<[u16; 4]>,
}

impl Picture {
    pub(crate) fn new(size: [u32; 2]) -> Picture {
        Picture { size, texels: vec![[0; 4]; (size[0] * size[1]) as usize] }
    }

    pub(crate) fn at(&self, x: u32, y: u32) -> [u16; 4] {
        assert!(x < self.size[0] && y < self.size[1]);
        self.texels[(y * self.size[0] + x) as usize]
    }

    pub(crate) fn set(&mut self, x: u32, y: u32, texel: [u16; 4]) {
        assert!(x < self.size[0] && y < self.size[1]);
        self.texels[(y * self.size[0] + x) as usize] = texel;
    }

    #[track_caller]
    pub(crate) fn expect(&self, expected: &Picture) {
        assert_eq!(self.size, expected.size);
        if let Some(at) = (0..self.texels.len()).find(|&i| self.texels[i] != expected.texels[i]) {
            let (x, y) = (at as u32 % self.size[0], at as u32 / self.size[0]);
            panic!("differs first at {x}, {y}: {:?}, expected {:?}", self.texels[at], expected.texels[at]);
        }
    }

    pub(crate) fn of_png(path: &Path) -> Picture {
        let file = std::fs::File::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        let samples: Vec<u16> = match info.bit_depth {
            png::BitDepth::Sixteen => bytes.chunks(2).map(|s| u16::from_be_bytes([s[0], s[1]])).collect(),
            _ => bytes.iter().map(|&s| s.into()).collect(),
        };
        let most = if info.bit_depth == png::BitDepth::Sixteen { u16::MAX } else { 255 };
        let texels = samples.chunks(info.color_type.samples()).map(|t| widened(t, most)).collect();
        Picture { size: [info.width, info.height], texels }
    }
}

fn widened(texel: &[u16], most: u16) -> [u16; 4] {
    match *texel {
        [v] => [v, v, v, most],
        [v, a] => [v, v, v, a],
        [r, g, b] => [r, g, b, most],
        [r, g, b, a] => [r, g, b, a],
        _ => unreachable!("no texel has so many channels"),
    }
}

/// All levels of a container, page by page. Where a page has no tile its parent's texels stand, each four
/// times.
pub(crate) fn levels(container: &Path) -> Vec<Picture> {
    let (description, tiles) = tiles(container);
    let (geometry, format) = (&description.geometry, description.layers[0].format);
    let mut levels: Vec<_> =
        geometry.levels().iter().map(|level| Picture::new([level.size[0], level.size[1]])).collect();
    let side = geometry.tile()[0];
    let mut tiles: HashMap<_, _> = tiles.into_iter().collect();
    for pos in geometry.pages() {
        let Some(bytes) = tiles.remove(&pos) else {
            repeat_parent(&mut levels, pos, geometry.page()[0]);
            continue;
        };
        let texel = |x: u32, y: u32| {
            let start = (y * side + x) as usize * format.texel_bytes();
            let bytes = &bytes[start..start + format.texel_bytes()];
            match format {
                LayerFormat::R16 => widened(&[u16::from_le_bytes([bytes[0], bytes[1]])], u16::MAX),
                _ => widened(&bytes.iter().map(|&b| u16::from(b)).collect::<Vec<_>>(), 255),
            }
        };
        let numbers =
            if geometry.is_tail(pos) { pos.level..=geometry.coarsest() } else { pos.level..=pos.level };
        for number in numbers {
            copy(geometry, &mut levels[usize::from(number)], number, [pos.x, pos.y], &texel);
        }
    }
    levels
}

fn repeat_parent(levels: &mut [Picture], pos: PagePos, page: u32) {
    let (finer, coarser) = levels.split_at_mut(usize::from(pos.level) + 1);
    let (level, parent) = (&mut finer[usize::from(pos.level)], &coarser[0]);
    for y in pos.y * page..((pos.y + 1) * page).min(level.size[1]) {
        for x in pos.x * page..((pos.x + 1) * page).min(level.size[0]) {
            level.set(x, y, parent.at(x / 2, y / 2));
        }
    }
}

fn copy(
    geometry: &Geometry,
    level: &mut Picture,
    number: u8,
    [x, y]: [u32; 2],
    texel: &dyn Fn(u32, u32) -> [u16; 4],
) {
    let (page, border) = (geometry.page()[0], geometry.border()[0]);
    let in_tail = number >= geometry.tail().first_level();
    let offset = if in_tail { geometry.tail().offset(number) } else { [0; 3] };
    let side = if in_tail { u32::MAX } else { page };
    for v in 0..side.min(level.size[1] - y * page) {
        for u in 0..side.min(level.size[0] - x * page) {
            level.set(x * page + u, y * page + v, texel(offset[0] + border + u, offset[1] + border + v));
        }
    }
}

/// A directory for one test.
pub(crate) struct Sandbox {
    dir: TempDir,
}

impl Sandbox {
    pub(crate) fn new() -> Sandbox {
        Sandbox { dir: tempfile::tempdir().unwrap() }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Builds a picture of noise; gives its container.
    pub(crate) fn container(&self, size: [u32; 2], color: png::ColorType, depth: png::BitDepth) -> PathBuf {
        let bytes = color.samples() * if depth == png::BitDepth::Sixteen { 2 } else { 1 };
        let data = texels(size[0] as usize * size[1] as usize * bytes, size[0] ^ size[1]);
        write_png(&self.path("image.png"), size, color, depth, &data);
        self.build("image.png", "image.vastex")
    }

    pub(crate) fn rgb(&self, size: [u32; 2]) -> PathBuf {
        self.container(size, png::ColorType::Rgb, png::BitDepth::Eight)
    }

    pub(crate) fn build(&self, input: &str, output: &str) -> PathBuf {
        // As planets are, so that a tree and the image it was made of have the same coarse levels.
        let address = [AddressMode::Wrap, AddressMode::Clamp];
        let options = BuildOptions { page: 64, address, ..BuildOptions::default() };
        build(&[self.path(input)], &self.path(output), &options, &()).unwrap();
        self.path(output)
    }

    pub(crate) fn export(&self, container: &Path, target: &str, options: &ExportOptions) -> ExportReport {
        export(&Container::open_file(container).unwrap(), &self.path(target), options, &()).unwrap()
    }

    /// The names of all that is there, hidden things too.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.dir.path()).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}
