//! Inputs of several files: raw files with their descriptions, mosaics, and tile directories of every layout.

use std::fs;
use std::path::Path;

use anyhow::Result;
use vastex_build::{ExportOptions, Layout, TileFormat, build, export};
use vastex_tiles::Container;

use super::{SIZE, grainy, images, jpeg, small_build, tiffs};
use crate::tree::Tree;

fn tree(files: &[(&str, &[u8])]) -> Vec<u8> {
    Tree { files: files.iter().map(|(name, content)| ((*name).to_owned(), content.to_vec())).collect() }
        .encode()
}

/// Raw files of every sample, order and number of channels.
pub(crate) fn raws() -> Result<Vec<Vec<u8>>> {
    let kinds = [
        ("u8", 1, 4, "offset = 7\nfirst_row = \"bottom\""),
        ("u16", 2, 3, "order = \"planar\"\nendian = \"big\""),
        ("f16", 2, 1, "linear = false"),
        ("f32", 4, 2, "order = \"interleaved\"\nendian = \"little\""),
    ];
    let of_kind = |(sample, bytes, channels, more): (&str, usize, usize, &str)| {
        let [width, height] = SIZE;
        let offset = if more.starts_with("offset") { 7 } else { 0 };
        let row = width as usize * bytes * channels;
        let text = format!(
            "width = {width}\nheight = {height}\nsample = \"{sample}\"\nchannels = {channels}\n{more}\n"
        );
        let texels = grainy(row, row * height as usize + offset);
        tree(&[("a.raw", &texels), ("a.raw.toml", text.as_bytes())])
    };
    Ok(kinds.map(of_kind).to_vec())
}

/// A mosaic of pieces at places, with a gap and an overlap, and one of a grid.
pub(crate) fn mosaics() -> Result<Vec<Vec<u8>>> {
    let (tall, wide, flat) = (images::png_of([9, 14], 3), images::png_of([14, 9], 1), tiffs::grey([9, 9])?);
    let raw = b"width = 9\nheight = 5\nsample = \"u8\"\n";
    let placed = b"vastex mosaic\n# two pieces\n0 0 tall.png\n4 7 wide.png\n30 2 a.raw\n";
    let grid = b"vastex mosaic\ngrid t_{x}_{y}.tif\n";
    let progressive = jpeg::jpeg([9, 14], 3, true)?;
    let mixed = b"vastex mosaic\n0 0 tall.png\n9 0 b.jpg\n";
    Ok(vec![
        tree(&[
            ("m.txt", placed),
            ("tall.png", &tall),
            ("wide.png", &wide),
            ("a.raw", &grainy(9, 45)),
            ("a.raw.toml", raw),
        ]),
        tree(&[
            ("m.txt", grid),
            ("t_0_0.tif", &flat),
            ("t_1_0.tif", &tiffs::grey([4, 9])?),
            ("t_0_1.tif", &tiffs::grey([9, 3])?),
            ("t_1_1.tif", &tiffs::grey([4, 3])?),
        ]),
        tree(&[("m.txt", mixed), ("tall.png", &tall), ("b.jpg", &progressive)]),
    ])
}

/// Tiles with and without overlap, grey and colour, and a manifest as other programs write it.
pub(crate) fn deep_zoom() -> Result<Vec<Vec<u8>>> {
    let of = |format, overlap, channels| {
        let options = ExportOptions { overlap: Some(overlap), ..planned(Layout::DeepZoom, format, 16) };
        exported(&options, SIZE, channels)
    };
    let mut other = of(TileFormat::Png, 0, 1)?;
    for (_, content) in other.files.iter_mut().filter(|(name, _)| name.ends_with(".dzi")) {
        let [width, height] = SIZE;
        *content = format!(
            "<?xml version='1.0'?>\n<!-- by hand -->\n<dz:Image xmlns:dz='http://schemas.microsoft.com/deepzoom/2009' \
             Overlap='0' TileSize='16' Format='png'><dz:Size Height='{height}' Width='{width}'></dz:Size></dz:Image>"
        )
        .into_bytes();
    }
    Ok(vec![of(TileFormat::Png, 0, 1)?.encode(), of(TileFormat::Jpeg, 2, 3)?.encode(), other.encode()])
}

/// Trees that are whole, have borders, lack tiles, and misname a level.
pub(crate) fn gaia_sky() -> Result<Vec<Vec<u8>>> {
    let of = |format, overlap, channels| {
        let options = ExportOptions { overlap, ..planned(Layout::GaiaSky, format, 16) };
        exported(&options, [64, 32], channels)
    };
    let mut partial = of(TileFormat::Png, None, 1)?;
    partial.files.retain(|(name, _)| !name.contains("tx_1_1") && !name.contains("tx_3_0"));
    for (name, _) in &mut partial.files {
        *name = name.replace("level01", "level011").replace("level1/", "level011/");
    }
    let whole = of(TileFormat::Jpeg, None, 3)?;
    Ok(vec![
        of(TileFormat::Png, None, 1)?.encode(),
        whole.encode(),
        of(TileFormat::Png, Some(1), 1)?.encode(),
        partial.encode(),
    ])
}

/// A tree with its context, and one that begins at another split with another prefix.
pub(crate) fn celestia() -> Result<Vec<Vec<u8>>> {
    let of = |format| exported(&planned(Layout::Celestia, format, 64), [128, 64], 1);
    let mut other = of(TileFormat::Png)?;
    for (name, content) in &mut other.files {
        if name.ends_with(".ctx") {
            let text = "# by hand\nVirtualTexture\n{\n ImageDirectory \".\"\n BaseSplit 0\n TileSize 64\n TileType \"png\"\n \
                        TilePrefix \"t-\"\n}\n";
            *content = text.as_bytes().to_vec();
        }
        *name = name.replace("tx_", "t-");
    }
    Ok(vec![of(TileFormat::Png)?.encode(), of(TileFormat::Jpeg)?.encode(), other.encode()])
}

/// Pages of this layout always have 512 texels.
pub(crate) fn prototype() -> Result<Vec<Vec<u8>>> {
    Ok(vec![exported(&ExportOptions::new(Layout::Prototype), SIZE, 1)?.encode()])
}

fn planned(layout: Layout, format: TileFormat, tile_size: u32) -> ExportOptions {
    ExportOptions { format: Some(format), tile_size: Some(tile_size), ..ExportOptions::new(layout) }
}

fn exported(options: &ExportOptions, size: [u32; 2], channels: u32) -> Result<Tree> {
    let directory = tempfile::tempdir()?;
    let at = |name: &str| directory.path().join(name);
    fs::write(at("i.png"), images::png_of(size, channels))?;
    build(&[at("i.png")], &at("c.vastex"), &small_build(), &())?;
    let options = ExportOptions { threads: 1, ..options.clone() };
    export(&Container::open_file(at("c.vastex"))?, &at("tree"), &options, &())?;
    Ok(Tree::read(Path::new(&at("tree")))?)
}
