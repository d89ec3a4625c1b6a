//! Sound inputs to start from: small containers, parts, images and tile directories of every kind, made here.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use anyhow::{Context, Result};
use bytes::Bytes;
use vastex_build::{
    BuildOptions, ExportOptions, Layout, PartOf, ReplaceOptions, TileFormat, build, export, replace,
};
use vastex_core::{Description, Geometry, GeometrySpec, LayerFormat};
use vastex_tiles::{Compression, Container, ContainerWriter, EncodedTile, WriterOptions};

use crate::rng::Rng;
use crate::tree::Tree;

/// Containers of every codec, an aligned one of several layers, and one that was changed in place.
pub(crate) fn containers() -> Result<Vec<Vec<u8>>> {
    let codecs = [Compression::None, Compression::Lz4, Compression::Zstd(1)];
    let mut all = codecs
        .map(|compression| container(&[LayerFormat::R8], compression, 1))
        .into_iter()
        .collect::<Result<Vec<_>>>()?;
    all.push(container(&[LayerFormat::R8, LayerFormat::R16], Compression::Lz4, 4096)?);
    let directory = tempfile::tempdir()?;
    let (image, patch, path) =
        (directory.path().join("i.tif"), directory.path().join("p.tif"), directory.path().join("c.vastex"));
    fs::write(&image, tiff(40, 24)?)?;
    fs::write(&patch, tiff(9, 7)?)?;
    build(&[&image], &path, &small_build(), &())?;
    replace(&path, [3, 5], &[&patch], &ReplaceOptions::default(), &())?;
    all.push(fs::read(&path)?);
    Ok(all)
}

fn container(formats: &[LayerFormat], compression: Compression, align: u32) -> Result<Vec<u8>> {
    let geometry = Geometry::new(GeometrySpec { page: 8, border: 1, ..GeometrySpec::image(20, 20) })?;
    let of_one = |format: &LayerFormat| Description::one_layer(geometry.clone(), *format);
    let mut description = of_one(&formats[0]);
    description.layers = formats.iter().flat_map(|format| of_one(format).layers).collect();
    for (n, layer) in description.layers.iter_mut().enumerate() {
        layer.name = format!("layer {n}");
    }
    let options = WriterOptions { compression, align, ..WriterOptions::default() };
    let mut writer = ContainerWriter::new(Cursor::new(Vec::new()), "seed", description.clone(), options)?;
    let mut rng = Rng::new(1);
    for (n, pos) in description.geometry.pages().enumerate() {
        // Noise, runs, one colour, and one tile twice.
        let run = [1, 30, usize::MAX, 30][n % 4];
        let mut texels = Vec::new();
        while texels.len() < description.tile_bytes() {
            let left = description.tile_bytes() - texels.len();
            texels.resize(
                texels.len() + run.min(left),
                if n % 4 == 3 { 9 + (left % 7) as u8 } else { rng.next() as u8 },
            );
        }
        writer.append(pos, EncodedTile::new(Bytes::from(texels), &description, compression))?;
    }
    Ok(writer.complete()?.0.into_inner())
}

fn small_build() -> BuildOptions {
    BuildOptions { page: 8, border: 1, threads: 1, ..BuildOptions::default() }
}

/// A container in two parts, and one in a single part.
pub(crate) fn parts() -> Result<Vec<Vec<u8>>> {
    let directory = tempfile::tempdir()?;
    let image = directory.path().join("i.tif");
    fs::write(&image, tiff(24, 20)?)?;
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

/// Small images: grey TIFF, plain and deflated, PNG and JPEG.
pub(crate) fn images() -> Result<Vec<Vec<u8>>> {
    let mut all = vec![tiff(20, 14)?, tiff_deflate(20, 14)?];
    for format in [TileFormat::Png, TileFormat::Jpeg] {
        let tree = exported(Layout::DeepZoom, Some(format), Some(16), [20, 14])?;
        let (_, tile) = tree
            .files
            .into_iter()
            .max_by_key(|(name, content)| (!name.ends_with(".dzi"), content.len()))
            .context("no tiles")?;
        all.push(tile);
    }
    Ok(all)
}

pub(crate) fn deep_zoom() -> Result<Vec<Vec<u8>>> {
    let both = [TileFormat::Png, TileFormat::Jpeg];
    both.map(|format| Ok(exported(Layout::DeepZoom, Some(format), Some(16), [20, 14])?.encode()))
        .into_iter()
        .collect()
}

pub(crate) fn gaia_sky() -> Result<Vec<Vec<u8>>> {
    let both = [TileFormat::Png, TileFormat::Jpeg];
    both.map(|format| Ok(exported(Layout::GaiaSky, Some(format), Some(16), [64, 32])?.encode()))
        .into_iter()
        .collect()
}

pub(crate) fn celestia() -> Result<Vec<Vec<u8>>> {
    let both = [TileFormat::Png, TileFormat::Jpeg];
    both.map(|format| Ok(exported(Layout::Celestia, Some(format), Some(64), [256, 128])?.encode()))
        .into_iter()
        .collect()
}

/// Pages of this layout always have 512 texels.
pub(crate) fn prototype() -> Result<Vec<Vec<u8>>> {
    Ok(vec![exported(Layout::Prototype, None, None, [20, 14])?.encode()])
}

fn exported(
    layout: Layout,
    format: Option<TileFormat>,
    tile_size: Option<u32>,
    size: [u32; 2],
) -> Result<Tree> {
    let directory = tempfile::tempdir()?;
    let at = |name: &str| directory.path().join(name);
    fs::write(at("i.tif"), tiff(size[0], size[1])?)?;
    build(&[at("i.tif")], &at("c.vastex"), &small_build(), &())?;
    let options = ExportOptions { format, tile_size, threads: 1, ..ExportOptions::new(layout) };
    export(&Container::open_file(at("c.vastex"))?, &at("tree"), &options, &())?;
    Ok(Tree::read(Path::new(&at("tree")))?)
}

fn tiff(width: u32, height: u32) -> Result<Vec<u8>> {
    encode_tiff(width, height, ::tiff::encoder::Compression::Uncompressed)
}

fn tiff_deflate(width: u32, height: u32) -> Result<Vec<u8>> {
    encode_tiff(width, height, ::tiff::encoder::Compression::Deflate(::tiff::encoder::DeflateLevel::Fast))
}

/// A smooth grey image with a little grain.
fn encode_tiff(width: u32, height: u32, compression: ::tiff::encoder::Compression) -> Result<Vec<u8>> {
    let mut rng = Rng::new(2);
    let texels: Vec<u8> =
        (0..width * height).map(|n| (n % width * 3 + n / width * 2) as u8 ^ (rng.next() % 4) as u8).collect();
    let mut out = Cursor::new(Vec::new());
    let mut encoder = ::tiff::encoder::TiffEncoder::new(&mut out)?.with_compression(compression);
    encoder.write_image::<::tiff::encoder::colortype::Gray8>(width, height, &texels)?;
    Ok(out.into_inner())
}
