//! Containers of every codec, format and shape, one that was changed in place, and parts.

use std::fs;
use std::io::Cursor;

use anyhow::Result;
use bytes::Bytes;
use vastex_build::{BuildOptions, PartOf, ReplaceOptions, build, replace};
use vastex_core::{AddressMode, Description, Geometry, GeometrySpec, Layer, LayerFormat};
use vastex_tiles::{Compression, ContainerWriter, EncodedTile, WriterOptions};

use super::{small_build, tiffs};
use crate::rng::Rng;
use crate::tree::Tree;

/// What sets one container apart from another.
struct Kind {
    spec: GeometrySpec,
    layers: Vec<Layer>,
    compression: Compression,
    align: u32,
    /// True if every fifth page has no tile.
    lacks_pages: bool,
}

impl Kind {
    /// A small image of one layer.
    fn image(format: LayerFormat, compression: Compression) -> Kind {
        let spec = GeometrySpec { page: 8, border: 1, ..GeometrySpec::image(20, 20) };
        Kind { spec, layers: vec![Layer::new("color", format)], compression, align: 1, lacks_pages: false }
    }

    /// An image of layers at such shares of the resolution, with pages that suit blocks.
    fn layers(layers: &[(LayerFormat, u32)], compression: Compression) -> Kind {
        let layers: Vec<Layer> = layers
            .iter()
            .enumerate()
            .map(|(n, &(format, scale))| Layer { scale, ..Layer::new(format!("layer {n}"), format) })
            .collect();
        let most = layers.iter().map(|layer| layer.scale).max().unwrap_or(1);
        let (page, border) = (8 * most, 4 * most);
        let size = 12 * most;
        let tail_align = Description::tail_align(&layers);
        let spec = GeometrySpec { page, border, tail_align, ..GeometrySpec::image(size, size) };
        Kind { spec, layers, compression, align: 1, lacks_pages: false }
    }

    fn bytes(self) -> Result<Vec<u8>> {
        let description = Description::new(Geometry::new(self.spec)?, self.layers);
        let options =
            WriterOptions { compression: self.compression, align: self.align, ..WriterOptions::default() };
        let mut writer = ContainerWriter::new(Cursor::new(Vec::new()), "seed", description.clone(), options)?;
        let mut rng = Rng::new(1);
        let last = description.geometry.page_count() - 1;
        for (n, pos) in (0..).zip(description.geometry.pages()) {
            // The tail is always there.
            if self.lacks_pages && n % 5 == 2 && n != last {
                continue;
            }
            let texels = Bytes::from(texels(n as usize, description.tile_bytes(), &mut rng));
            writer.append(pos, EncodedTile::new(texels, &description, self.compression))?;
        }
        Ok(writer.complete()?.0.into_inner())
    }
}

/// Noise, runs, one colour, and one tile twice.
fn texels(n: usize, len: usize, rng: &mut Rng) -> Vec<u8> {
    let run = [1, 30, usize::MAX, 30][n % 4];
    let mut texels = Vec::new();
    while texels.len() < len {
        let left = len - texels.len();
        let value = if n % 4 == 3 { 9 + (left % 7) as u8 } else { rng.next() as u8 };
        texels.resize(texels.len() + run.min(left), value);
    }
    texels
}

/// Containers of every codec, format, address mode and shape, aligned ones, one that lacks pages, a volume,
/// and one that was changed in place.
pub(crate) fn containers() -> Result<Vec<Vec<u8>>> {
    use LayerFormat::*;
    let codecs = [Compression::None, Compression::Lz4, Compression::Zstd(1)];
    let mut kinds: Vec<Kind> = codecs.map(|compression| Kind::image(R8, compression)).into();
    let mut two = Kind::image(R8, Compression::Lz4);
    two.layers.push(Layer::new("height", R16));
    kinds.push(Kind { align: 4096, ..two });
    kinds.push(Kind { lacks_pages: true, ..Kind::image(Rgba8Srgb, Compression::Lz4) });
    let mut wrapping = Kind::image(Rg8, Compression::None);
    wrapping.spec.address = [AddressMode::Wrap, AddressMode::Mirror, AddressMode::Clamp];
    kinds.push(wrapping);
    let mut bordered = Kind::image(Rgba8, Compression::Zstd(1));
    bordered.spec.address = [AddressMode::Border; 3];
    kinds.push(bordered);
    let mut volume = Kind::image(R16Float, Compression::Lz4);
    volume.spec = GeometrySpec { page: 8, border: 1, ..GeometrySpec::volume([9, 5, 6]) };
    kinds.push(volume);
    kinds.push(Kind::layers(&[(Rgba16, 1), (Rgba16Float, 2), (R32Float, 1)], Compression::Zstd(1)));
    kinds.push(Kind::layers(&[(Bc1, 1), (Bc3Srgb, 1), (Bc4, 1)], Compression::Lz4));
    kinds.push(Kind::layers(&[(Bc7Srgb, 1), (Bc5, 2), (Bc6h, 1)], Compression::None));
    let mut all = kinds.into_iter().map(Kind::bytes).collect::<Result<Vec<_>>>()?;
    all.push(replaced()?);
    Ok(all)
}

/// A container of an image into which a smaller one was put.
fn replaced() -> Result<Vec<u8>> {
    let directory = tempfile::tempdir()?;
    let at = |name: &str| directory.path().join(name);
    fs::write(at("i.tif"), tiffs::grey([40, 24])?)?;
    fs::write(at("p.tif"), tiffs::grey([9, 7])?)?;
    build(&[at("i.tif")], &at("c.vastex"), &small_build(), &())?;
    replace(&at("c.vastex"), [3, 5], &[at("p.tif")], &ReplaceOptions::default(), &())?;
    Ok(fs::read(at("c.vastex"))?)
}

/// What is exported: a layer of every depth, in blocks and not, whole and with pages missing, and one that
/// was changed.
pub(crate) fn exports() -> Result<Vec<Vec<u8>>> {
    use LayerFormat::*;
    let wide = |kind: Kind| Kind { spec: GeometrySpec { size: [32, 16, 1], ..kind.spec }, ..kind };
    let kinds = [
        Kind::image(Rgba8Srgb, Compression::Lz4),
        wide(Kind::image(R8, Compression::None)),
        Kind { lacks_pages: true, ..wide(Kind::image(Rgba8, Compression::Zstd(1))) },
        Kind::image(Rgba16, Compression::Lz4),
        wide(Kind::image(R16, Compression::None)),
        Kind::image(R32Float, Compression::None),
        Kind::layers(&[(Bc1Srgb, 1), (R8, 2)], Compression::None),
        Kind::layers(&[(Bc5, 1)], Compression::Lz4),
    ];
    let mut all = kinds.into_iter().map(Kind::bytes).collect::<Result<Vec<_>>>()?;
    all.push(replaced()?);
    Ok(all)
}

/// A container in two parts, and one in a single part.
pub(crate) fn parts() -> Result<Vec<Vec<u8>>> {
    let directory = tempfile::tempdir()?;
    let image = directory.path().join("i.tif");
    fs::write(&image, tiffs::grey([24, 20])?)?;
    let mut all = Vec::new();
    for parts in [1, 2] {
        let mut tree = Tree::default();
        for part in 1..=parts {
            let name = format!("{part}");
            let path = directory.path().join(&name);
            let options = BuildOptions { part: PartOf::new(part, parts), ..small_build() };
            build(&[&image], &path, &options, &())?;
            tree.files.push((name, fs::read(&path)?));
        }
        all.push(tree.encode());
    }
    Ok(all)
}
