//! Volumes as other programs write them: the smaller fixtures of `vastex-volume`. Volumes as `vastex-build`
//! makes them.

use std::fs;

use anyhow::{Context, Result};
use vastex_build::{
    ContainerOptions, VolumeFormat, VolumeOptions, ZarrCodec, ZarrOptions, ZarrVersion, build_volume,
};

use crate::tree::Tree;

macro_rules! fixture {
    ($name:literal) => {
        ($name, include_bytes!(concat!("../../../vastex-volume/fixtures/", $name)))
    };
}

/// Files that are read as they are; a raw one needs its description beside it.
const FILES: [&[(&str, &[u8])]; 7] = [
    &[fixture!("deflated.zip")],
    &[fixture!("one.nii")],
    &[fixture!("two.nii.gz")],
    &[fixture!("imagej.tif")],
    &[fixture!("ome.ome.tif")],
    &[fixture!("layers.tif")],
    &[fixture!("planar.raw"), fixture!("planar.raw.toml")],
];

/// Zarr in archives of stored entries: what is in them is a directory of the seed.
const ZARR: [(&str, &[u8]); 19] = [
    fixture!("bioformats2raw.zip"),
    fixture!("blosc-blosclz-1-uint16.zip"),
    fixture!("blosc-lz4hc-2-uint16.zip"),
    fixture!("blosc-zlib-1-float64.zip"),
    fixture!("blosc-zstd-1-bool.zip"),
    fixture!("blosc-zstd-2-float32.zip"),
    fixture!("custom-axis.zip"),
    fixture!("odd-metadata.zip"),
    fixture!("plain-array.zip"),
    fixture!("v03-names.zip"),
    fixture!("v05-axis-order.zip"),
    fixture!("v05-flat.zip"),
    fixture!("v06-systems.zip"),
    fixture!("v2-absent.zip"),
    fixture!("v2-fortran.zip"),
    fixture!("v2-nested-unsaid.zip"),
    fixture!("v2-shuffle.zip"),
    fixture!("v3-shards-transposed.zip"),
    fixture!("v3-transposed.zip"),
];

/// A volume, or a list of them, each.
pub(super) fn found() -> Result<Vec<Tree>> {
    let file = |(name, content): &(&str, &[u8])| ((*name).to_owned(), content.to_vec());
    let mut all: Vec<Tree> =
        FILES.iter().map(|files| Tree { files: files.iter().map(file).collect() }).collect();
    for (name, archive) in ZARR {
        all.push(unpacked(archive).with_context(|| name.to_owned())?);
    }
    Ok(all)
}

/// The files of an archive of stored entries.
fn unpacked(archive: &[u8]) -> Result<Tree> {
    let number = |at: usize, len: usize| {
        let bytes = archive.get(at..at + len).context("the archive ends early")?;
        anyhow::Ok(bytes.iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte)))
    };
    let (mut tree, mut at) = (Tree::default(), 0);
    while archive[at..].starts_with(b"PK\x03\x04") {
        anyhow::ensure!(number(at + 8, 2)? == 0, "the archive has an entry that is not stored");
        let (len, name_len) = (number(at + 18, 4)?, number(at + 26, 2)?);
        let data = at + 30 + name_len + number(at + 28, 2)?;
        let name = String::from_utf8(archive[at + 30..at + 30 + name_len].to_vec())?;
        if !name.ends_with('/') {
            tree.files.push((name, archive[data..data + len].to_vec()));
        }
        at = data + len;
    }
    Ok(tree)
}

/// A container and two directories of OME-Zarr made of a tree that holds a raw file, with all levels.
pub(super) fn built(raw: &Tree) -> Result<Vec<Tree>> {
    let directory = tempfile::tempdir()?;
    raw.write(directory.path());
    let input = directory.path().join("a.raw");
    let make = |name: &str, format: VolumeFormat| {
        let options = VolumeOptions { format, threads: 1, ..VolumeOptions::default() };
        let output = directory.path().join(name);
        build_volume(&input, &output, &options, &())?;
        anyhow::Ok(output)
    };
    let container = ContainerOptions { page: 8, ..ContainerOptions::default() };
    let container = make("a.vastex", VolumeFormat::Container(container))?;
    let mut all = vec![Tree { files: vec![("a.vastex".to_owned(), fs::read(container)?)] }];
    for (version, shards, codec) in
        [(ZarrVersion::V05, 2, ZarrCodec::Zstd(3)), (ZarrVersion::V04, 1, ZarrCodec::Gzip(6))]
    {
        let options = ZarrOptions { version, chunk: [3, 2, 2], shards, codec };
        all.push(Tree::read(&make(&format!("{version:?}.zarr"), VolumeFormat::Zarr(options))?)?);
    }
    Ok(all)
}
