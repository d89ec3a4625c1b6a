//! Texels without data: left out of coarser levels by every filter, against the slow way in 64-bit floats;
//! and everywhere in the same way, if a file is built, read where it lies, decoded into memory, or replaced
//! in part.

use std::fs::File;
use std::path::{Path, PathBuf};

use crate::common::{texels, tiles};
use crate::filters::weights;
use crate::pyramids::whole;
use tempfile::TempDir;
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::{ColorType, Gray16, Gray32Float, RGB8};
use tiff::tags::Tag;
use vastex_build::{
    BuildOptions, CropSource, DecodeOptions, Decoding, Kernel, LayerFilter, LevelsFrom, Meaning, NodataRule,
    Notice, TiffSource, build,
};
use vastex_core::{NodataValue, PagePos};
use vastex_tiles::{Container, TileSource};

const MISSING: f32 = -9999.0;

/// A TIFF file of small strips that says which value stands for no data.
fn tiff<C: ColorType>(
    directory: &TempDir,
    name: &str,
    size: [u32; 2],
    nodata: &str,
    texels: &[C::Inner],
) -> PathBuf
where
    [C::Inner]: tiff::encoder::TiffValue,
{
    let path = directory.path().join(name);
    let mut encoder = TiffEncoder::new(File::create(&path).unwrap()).unwrap();
    let mut image = encoder.new_image::<C>(size[0], size[1]).unwrap();
    image.rows_per_strip(16).unwrap();
    image.encoder().write_tag(Tag::Unknown(42113), nodata).unwrap();
    image.write_data(texels).unwrap();
    path
}

/// Returns true if there is no data at a place: in discs of several sizes, and in single texels.
fn is_hole(x: u32, y: u32) -> bool {
    let disc = |cx: i64, cy: i64, r: i64| (i64::from(x) - cx).pow(2) + (i64::from(y) - cy).pow(2) < r * r;
    disc(20, 14, 11) || disc(70, 50, 30) || disc(0, 60, 9) || (x * 7 + y * 13).is_multiple_of(17)
}

/// Heights with holes.
fn heights(size: [u32; 2]) -> Vec<f32> {
    let noise = texels((size[0] * size[1]) as usize, 3);
    let at = |i: u32| {
        let (x, y) = (i % size[0], i / size[0]);
        if is_hole(x, y) { MISSING } else { 100.0 * (x as f32 * 0.2).sin() + f32::from(noise[i as usize]) }
    };
    (0..size[0] * size[1]).map(at).collect()
}

/// A level of a container as floats, and its columns and rows.
fn level(path: &Path, level: u32) -> (Vec<f32>, [i64; 2]) {
    let tiles = std::sync::Arc::new(Container::open_file(path).unwrap());
    let source = CropSource::of_tiles(tiles, None, level).unwrap();
    let size = source.size().map(i64::from);
    (whole(source).as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect(), size)
}

/// What a texel should be: its value, or nothing; and nothing of that where it hangs by a thread.
fn expected(kernel: Kernel, from: &(Vec<f32>, [i64; 2]), factor: i64, at: [i64; 2]) -> Option<Option<f64>> {
    let (texels, size) = from;
    let (first, weights) = weights(kernel, factor);
    let mut around: Vec<(f64, f64)> = Vec::new();
    for (j, wy) in weights.iter().enumerate() {
        for (i, wx) in weights.iter().enumerate() {
            let [x, y] = [(0, i), (1, j)]
                .map(|(axis, tap)| (factor * at[axis] + first + tap as i64).clamp(0, size[axis] - 1));
            around.push((wx * wy, texels[(y * size[0] + x) as usize].into()));
        }
    }
    let known: Vec<(f64, f64)> =
        around.iter().copied().filter(|(_, value)| *value != f64::from(MISSING)).collect();
    let values = || known.iter().map(|(_, value)| *value);
    Some(match kernel {
        Kernel::Min => values().min_by(f64::total_cmp),
        Kernel::Max => values().max_by(f64::total_cmp),
        Kernel::Majority => {
            let count = |value: f64| values().filter(|other| *other == value).count();
            let bits = |value: f64| (value as f32).to_bits();
            values().min_by_key(|value| (usize::MAX - count(*value), bits(*value)))
        }
        _ => {
            let weight: f64 = known.iter().map(|(weight, _)| weight).sum();
            let least = if weights.iter().any(|weight| *weight < 0.0) { 0.5 } else { 0.0 };
            if (weight - least).abs() < 1e-5 && weight != 0.0 {
                return None;
            }
            let sum: f64 = known.iter().map(|(weight, value)| weight * value).sum();
            (weight > least).then(|| sum / weight)
        }
    })
}

#[test]
fn every_filter_leaves_out_what_is_unknown() {
    let directory = tempfile::tempdir().unwrap();
    let size = [93, 71];
    let path = tiff::<Gray32Float>(&directory, "in.tif", size, "-9999", &heights(size));
    for kernel in Kernel::ALL {
        for from in LevelsFrom::ALL {
            if kernel.picks() && from != LevelsFrom::Chain {
                continue;
            }
            let filter = LayerFilter { from, ..LayerFilter::new(kernel, Meaning::Stored) };
            let output = directory.path().join("out.vastex");
            let options =
                BuildOptions { filter: Some(filter), page: 32, threads: 2, ..BuildOptions::default() };
            let report = build(&[&path], &output, &options, &()).unwrap();
            let nodata = NodataValue::new(MISSING);
            assert!(report.layers[0].notices.contains(&Notice::NodataLeftOut(nodata)));
            let container = Container::open_file(&output).unwrap();
            assert_eq!(container.filters(), [format!("{filter}/nodata=-9999")]);
            assert_eq!(container.description().layers[0].nodata, Some(nodata));
            let levels = container.description().geometry.levels().len();
            let all: Vec<_> = (0..levels as u32).map(|number| level(&output, number)).collect();
            let mut holes = 0;
            for number in 1..levels {
                let source = match from {
                    LevelsFrom::Chain => number - 1,
                    LevelsFrom::TwoFiner => number.saturating_sub(2),
                    LevelsFrom::Finest => 0,
                };
                let (coarse, [width, height]) = &all[number];
                for (i, found) in coarse.iter().enumerate() {
                    let at = [i as i64 % width, i as i64 / width];
                    let Some(expected) = expected(kernel, &all[source], 1 << (number - source), at) else {
                        continue;
                    };
                    holes += usize::from(expected.is_none());
                    let is_right = match expected {
                        None => *found == MISSING,
                        Some(expected) => (f64::from(*found) - expected).abs() < 0.05,
                    };
                    assert!(
                        is_right,
                        "{filter} level {number} {at:?} of {width}x{height}: {found}, {expected:?}"
                    );
                }
            }
            assert!(holes > 10, "{filter}: {holes}");
        }
    }
}

/// Tiles of whatever shows a file, by their pages.
fn read(source: &dyn TileSource, pos: PagePos) -> Vec<u8> {
    pollster::block_on(source.read(pos)).unwrap().bytes.to_vec()
}

#[test]
fn files_are_the_same_where_they_lie_in_memory_and_built() {
    let size = [300, 207];
    let directory = tempfile::tempdir().unwrap();
    let black: Vec<u8> = {
        let noise = texels((size[0] * size[1] * 3) as usize, 8);
        let texel = |i: usize| {
            if is_hole(i as u32 / 3 % size[0] / 3, i as u32 / 3 / size[0] / 3) { 0 } else { noise[i] / 40 }
        };
        (0..noise.len()).map(texel).collect()
    };
    let words: Vec<u16> =
        heights(size).iter().map(|v| if *v == MISSING { 65535 } else { (*v + 200.0) as u16 }).collect();
    for (path, nodata) in [
        (tiff::<RGB8>(&directory, "black.tif", size, "0", &black), 0.0),
        (tiff::<Gray16>(&directory, "words.tif", size, "65535", &words), 65535.0),
        (tiff::<Gray32Float>(&directory, "heights.tif", size, "-9999", &heights(size)), MISSING),
    ] {
        let output = path.with_extension("vastex");
        build(&[&path], &output, &BuildOptions::default(), &()).unwrap();
        let in_place = TiffSource::open(&path).unwrap();
        let in_memory = Decoding::open(&path, &DecodeOptions::default()).unwrap().run(&()).unwrap();
        let (description, built) = tiles(&output);
        for source in [&in_place as &dyn TileSource, &*in_memory] {
            assert_eq!(source.description().layers, description.layers);
            assert_eq!(description.layers[0].nodata, Some(NodataValue::new(nodata)));
            for (pos, tile) in &built {
                assert!(read(source, *pos) == *tile, "{}: {pos}", path.display());
            }
        }
        // Taken for values, they are mixed.
        let plain = path.with_extension("plain.vastex");
        let options = BuildOptions { nodata: NodataRule::Off, ..BuildOptions::default() };
        build(&[&path], &plain, &options, &()).unwrap();
        let (description, plain) = tiles(&plain);
        assert_eq!(description.layers[0].nodata, None);
        assert!(plain != built);
        // A value may be named, too.
        let options = BuildOptions { nodata: NodataRule::Value(NodataValue::new(nodata)), ..options };
        let named = path.with_extension("named.vastex");
        build(&[&path], &named, &options, &()).unwrap();
        assert!(tiles(&named).1 == built);
    }
}
