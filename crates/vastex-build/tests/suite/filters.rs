//! Every kernel, meaning and address mode against the slow way in 64-bit floats, each level from the one that
//! it is made of.

use std::collections::BTreeMap;

use crate::common::{build_file, texels, tiles, write_png};
use png::{BitDepth, ColorType};
use vastex_build::{BuildError, BuildOptions, Kernel, LayerFilter, LevelsFrom, Meaning};
use vastex_core::AddressMode::{self, Border, Clamp, Mirror, Wrap};
use vastex_core::{Description, LayerFormat, PagePos, TexelPositions, fold, is_border_color};
use vastex_tiles::Compression;

const COLOR: [u8; 4] = [200, 30, 90, 160];

/// One level as values of 0 to 1, as stored.
struct Level {
    size: [u32; 2],
    channels: usize,
    values: Vec<f64>,
}

impl Level {
    fn at(&self, address: [AddressMode; 2], [x, y]: [i64; 2]) -> Vec<f64> {
        let [w, h] = self.size;
        if is_border_color(address[0], x, w) || is_border_color(address[1], y, h) {
            return self.border_color();
        }
        let at = (fold(address[1], y, h) * w + fold(address[0], x, w)) as usize * self.channels;
        self.values[at..at + self.channels].to_vec()
    }

    fn border_color(&self) -> Vec<f64> {
        COLOR[..self.channels].iter().map(|&v| f64::from(v) / 255.0).collect()
    }
}

/// The levels of a container, put together from their tiles.
fn levels(description: &Description, tiles: &[(PagePos, Vec<u8>)]) -> Vec<Level> {
    let (geometry, format) = (&description.geometry, description.layers[0].format);
    let (texel, side) = (format.texel_bytes(), geometry.tile()[0] as usize);
    let tile = |pos| &tiles.iter().find(|(of, _)| *of == pos).unwrap().1;
    let level = |number: u8| {
        let [w, h, _] = geometry.level(number).size;
        let mut values = Vec::new();
        for y in 0..h {
            for x in 0..w {
                let (bytes, at) = if number >= geometry.tail().first_level() {
                    (tile(geometry.tail_pos()), geometry.tile_texel_from_tail_texel(number, [x, y, 0]))
                } else {
                    let (page, border) = (geometry.page()[0], geometry.border()[0]);
                    let pos = PagePos::new_2d(number, x / page, y / page);
                    (tile(pos), [x % page + border, y % page + border, 0])
                };
                let texel = &bytes[(at[1] as usize * side + at[0] as usize) * texel..][..texel];
                match format {
                    LayerFormat::R16 => {
                        values.push(f64::from(u16::from_le_bytes([texel[0], texel[1]])) / 65535.0);
                    }
                    _ => values.extend(texel.iter().map(|&v| f64::from(v) / 255.0)),
                }
            }
        }
        Level { size: [w, h], channels: format.channels(), values }
    };
    (0..=geometry.coarsest()).map(level).collect()
}

/// Weights for a factor, from the texel `first` before the factor times the index on. Written down anew, as
/// docs/format.md does.
pub(crate) fn weights(kernel: Kernel, factor: i64) -> (i64, Vec<f64>) {
    let sinc = |x: f64| (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x);
    let bessel = |x: f64| {
        (0..40).map(|n| ((x / 2.0).powi(n) / (1..=n).map(f64::from).product::<f64>()).powi(2)).sum::<f64>()
    };
    let sampled = |window: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let place = |k| (k as f64 + 0.5) / factor as f64 - 3.0;
        (0..6 * factor).map(place).map(|x| sinc(x) * window(x / 3.0)).collect()
    };
    let half = factor / 2;
    let repeated = |first: i64, weights: &[f64]| {
        (first * half, weights.iter().flat_map(|&weight| vec![weight; half as usize]).collect::<Vec<_>>())
    };
    // Each weight is the top of a hat that reaches to its neighbours.
    let drawn = |weights: &[f64]| {
        let middle = weights.len() as i64 / 2;
        let reach = (middle + 1) * half - 1;
        let hat = |x: f64| (1.0 - x.abs()).max(0.0);
        let at = |texel: i64| {
            let hats = (-middle..).zip(weights);
            hats.map(|(place, weight)| weight * hat(texel as f64 / half as f64 - place as f64)).sum()
        };
        (-reach, (-reach..=reach).map(at).collect())
    };
    let (first, weights) = match kernel {
        Kernel::Gauss4 => repeated(-1, &[1.0, 3.0, 3.0, 1.0]),
        Kernel::Sharpen4 => repeated(-1, &[-1.0, 5.0, 5.0, -1.0]),
        Kernel::Gauss3 => drawn(&[1.0, 2.0, 1.0]),
        Kernel::Sharpen5 => drawn(&[-1.0, 2.0, 6.0, 2.0, -1.0]),
        Kernel::Kaiser => (-5 * half, sampled(&|t| bessel(4.0 * (1.0 - t * t).sqrt()) / bessel(4.0))),
        Kernel::Lanczos => (-5 * half, sampled(&sinc)),
        Kernel::Nearest => (0, vec![1.0]),
        Kernel::Box | Kernel::Min | Kernel::Max | Kernel::Majority => repeated(0, &[1.0, 1.0]),
    };
    let sum: f64 = weights.iter().sum();
    (first, weights.iter().map(|weight| weight / sum).collect())
}

fn linear(s: f64) -> f64 {
    if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

fn srgb(l: f64) -> f64 {
    if l <= 0.0031308 { l * 12.92 } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 }
}

/// What a texel should be, of those around it with their weights; `None` if that hangs by a thread.
fn mixed(filter: LayerFilter, is_srgb: bool, around: &[(f64, Vec<f64>)]) -> Option<Vec<f64>> {
    let channels = around[0].1.len();
    let sum = |value: &dyn Fn(&[f64]) -> f64| around.iter().map(|(w, texel)| w * value(texel)).sum::<f64>();
    let each = |pick: &dyn Fn(&[f64]) -> f64| {
        (0..channels).map(|c| pick(&around.iter().map(|(_, t)| t[c]).collect::<Vec<_>>())).collect()
    };
    Some(match (filter.kernel, filter.meaning) {
        (Kernel::Min, _) => each(&|values| values.iter().copied().fold(f64::MAX, f64::min)),
        (Kernel::Max, _) => each(&|values| values.iter().copied().fold(f64::MIN, f64::max)),
        (Kernel::Majority, _) => {
            let count = |texel: &Vec<f64>| around.iter().filter(|(_, other)| other == texel).count();
            let most = around.iter().map(|(_, texel)| count(texel)).max()?;
            let last_first =
                |texel: &Vec<f64>| texel.iter().rev().map(|v| (v * 65535.0) as u64).collect::<Vec<_>>();
            around
                .iter()
                .map(|(_, texel)| texel)
                .filter(|texel| count(texel) == most)
                .min_by_key(|t| last_first(t))?
                .clone()
        }
        (_, Meaning::LinearColor) => {
            let alpha = sum(&|t| t[3]);
            if around.iter().any(|(_, t)| t[3] > 0.0) && alpha < 0.02 {
                return None;
            }
            let decode = |v: f64| if is_srgb { linear(v) } else { v };
            let encode = |v: f64| if is_srgb { srgb(v.clamp(0.0, 1.0)) } else { v };
            let color = |c: usize| match alpha > 0.0 {
                true => encode(sum(&|t| t[3] * decode(t[c])) / alpha),
                false => encode(sum(&|t| decode(t[c]))),
            };
            vec![color(0), color(1), color(2), alpha]
        }
        (_, Meaning::Normal) => {
            let z = |t: &[f64]| {
                let [x, y] = [0, 1].map(|c| 2.0 * t[c] - 1.0);
                (1.0 - x * x - y * y).max(0.0).sqrt()
            };
            let vector = [sum(&|t| 2.0 * t[0] - 1.0), sum(&|t| 2.0 * t[1] - 1.0), sum(&z)];
            let length = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
            if length < 0.02 {
                return None;
            }
            vec![0.5 + 0.5 * vector[0] / length, 0.5 + 0.5 * vector[1] / length]
        }
        _ => (0..channels).map(|c| sum(&|t| t[c])).collect(),
    })
}

/// What texel `i` of a level is made of along one axis: each texel of the finer level, nothing for the border
/// colour, with its weight.
fn parts(
    mode: AddressMode,
    size: u32,
    i: i64,
    factor: i64,
    (first, weights): &(i64, Vec<f64>),
) -> BTreeMap<Option<u32>, f64> {
    let mut parts = BTreeMap::new();
    for (place, weight) in (factor * i + first..).zip(weights) {
        let texel = (!is_border_color(mode, place, size)).then(|| fold(mode, place, size));
        *parts.entry(texel).or_insert(0.0) += weight;
    }
    parts
}

/// The texels around one, each with its weight.
fn around(finer: &Level, address: [AddressMode; 2], at: [i64; 2], weights: &Weights) -> Vec<(f64, Vec<f64>)> {
    let Weights { factor, taps, picks } = weights;
    if *picks {
        let four = [[0, 0], [1, 0], [0, 1], [1, 1]];
        let weight = |i: i64| taps.1.get(i as usize).copied().unwrap_or(0.0);
        return four
            .map(|[i, j]| (weight(i) * weight(j), finer.at(address, [2 * at[0] + i, 2 * at[1] + j])))
            .to_vec();
    }
    let [across, down] = [0, 1].map(|axis| parts(address[axis], finer.size[axis], at[axis], *factor, taps));
    let mut around = Vec::new();
    for (y, wy) in &down {
        for (x, wx) in &across {
            let texel = match (x, y) {
                (Some(x), Some(y)) => finer.at(address, [i64::from(*x), i64::from(*y)]),
                _ => finer.border_color(),
            };
            around.push((wx * wy, texel));
        }
    }
    around
}

/// How a level is made of a finer one.
struct Weights {
    factor: i64,
    taps: (i64, Vec<f64>),
    picks: bool,
}

/// The level that another is made from.
fn source(from: LevelsFrom, level: usize) -> usize {
    match from {
        LevelsFrom::Chain => level - 1,
        LevelsFrom::TwoFiner => level.saturating_sub(2),
        LevelsFrom::Finest => 0,
    }
}

/// Checks each level against the one that it is made from, as both are stored.
fn check_levels(path: &std::path::Path, filter: LayerFilter) {
    let (description, tiles) = tiles(path);
    let (geometry, format) = (&description.geometry, description.layers[0].format);
    let address = [geometry.address()[0], geometry.address()[1]];
    let levels = levels(&description, &tiles);
    let steps = if format == LayerFormat::R16 { 65535.0 } else { 255.0 };
    for (number, coarse) in levels.iter().enumerate().skip(1) {
        let source = source(filter.from, number);
        let factor = 1 << (number - source);
        let weights = Weights { factor, taps: weights(filter.kernel, factor), picks: filter.kernel.picks() };
        for y in 0..i64::from(coarse.size[1]) {
            for x in 0..i64::from(coarse.size[0]) {
                let around = around(&levels[source], address, [x, y], &weights);
                let Some(expected) = mixed(filter, format.is_srgb(), &around) else { continue };
                for (found, expected) in coarse.at(address, [x, y]).iter().zip(expected) {
                    let off = (found - expected.clamp(0.0, 1.0)).abs() * steps;
                    // Light has 16 bits, and colour the least weight of 2^-20: both show where alpha is
                    // faint. Sums of a hundred 32-bit floats are off by hundredths of a step of 16 bits.
                    let most = match filter.meaning {
                        Meaning::LinearColor => 0.6,
                        _ if steps > 255.0 => 0.53,
                        _ => 0.51,
                    };
                    assert!(off < most, "{filter} {address:?} level {number} ({x}, {y}): {off} steps off");
                }
            }
        }
    }
}

fn options(filter: &str, address: [AddressMode; 2], page: u32) -> BuildOptions {
    BuildOptions {
        filter: Some(filter.parse().unwrap()),
        address,
        border_color: COLOR,
        page,
        border: 3,
        compression: Compression::None,
        threads: 2,
        ..BuildOptions::default()
    }
}

/// Every kernel with each of the meanings and every way to the finer level, where they go together.
fn filters(meanings: &[Meaning]) -> Vec<LayerFilter> {
    let mut filters = Vec::new();
    for kernel in Kernel::ALL {
        for &meaning in meanings {
            for from in LevelsFrom::ALL {
                let filter = LayerFilter { kernel, meaning, from, nodata: None };
                if !kernel.picks() || filter == LayerFilter::new(kernel, Meaning::Stored) {
                    filters.push(filter);
                }
            }
        }
    }
    filters
}

fn check_all(color: ColorType, depth: BitDepth, meanings: &[Meaning]) {
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join("in.png");
    for (size, page) in [([37, 29], 8), ([10, 50], 16), ([5, 3], 8)] {
        let bytes = depth as usize / 8 * color.samples() * (size[0] * size[1]) as usize;
        write_png(&input, size, color, depth, &texels(bytes, size[0]));
        for filter in filters(meanings) {
            for address in [[Clamp; 2], [Wrap; 2], [Mirror; 2], [Border; 2], [Wrap, Border]] {
                let (output, _) = build_file(&input, &options(&filter.to_string(), address, page));
                check_levels(&output, filter);
            }
        }
    }
}

#[test]
fn every_kernel_makes_what_the_slow_way_makes_of_data() {
    check_all(ColorType::Grayscale, BitDepth::Eight, &[Meaning::Stored]);
    check_all(ColorType::Grayscale, BitDepth::Sixteen, &[Meaning::Stored]);
}

#[test]
fn every_kernel_makes_what_the_slow_way_makes_of_vectors() {
    check_all(ColorType::GrayscaleAlpha, BitDepth::Eight, &[Meaning::Stored, Meaning::Normal]);
}

#[test]
fn every_kernel_makes_what_the_slow_way_makes_of_colour() {
    check_all(ColorType::Rgba, BitDepth::Eight, &[Meaning::Stored, Meaning::LinearColor]);
}

#[test]
fn the_bytes_depend_on_no_number_of_threads() {
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join("in.png");
    write_png(&input, [350, 250], ColorType::Rgb, BitDepth::Eight, &texels(350 * 250 * 3, 5));
    for filter in ["kaiser-linear", "sharpen5", "majority", "gauss4-linear@two", "lanczos-linear@zero"] {
        let built = [1, 2, 5].map(|threads| {
            let options = BuildOptions { threads, ..options(filter, [Mirror, Wrap], 30) };
            std::fs::read(build_file(&input, &options).0).unwrap()
        });
        assert!(built[0] == built[1] && built[0] == built[2], "{filter}");
    }
}

#[test]
fn one_value_stays_on_all_levels() {
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join("in.png");
    let value = [0x9c, 0x41];
    write_png(&input, [150, 99], ColorType::Grayscale, BitDepth::Sixteen, &value.repeat(150 * 99));
    for filter in filters(&[Meaning::Stored]) {
        let (output, report) = build_file(&input, &options(&filter.to_string(), [Clamp, Wrap], 16));
        let (description, tiles) = tiles(&output);
        for level in levels(&description, &tiles) {
            assert!(level.values.iter().all(|&v| v == f64::from(0x9c41) / 65535.0), "{filter}");
        }
        assert_eq!(report.layers[0].filter, filter);
    }
}

#[test]
fn memory_does_not_grow_with_the_height_for_wide_kernels() {
    let dir = tempfile::tempdir().unwrap();
    let inputs = [3_000u32, 15_000].map(|height| {
        let input = dir.path().join(format!("{height}.png"));
        let data = texels(32 * height as usize, 9);
        write_png(&input, [32, height], ColorType::Grayscale, BitDepth::Eight, &data);
        input
    });
    for (filter, address) in [
        ("kaiser", Wrap),
        ("lanczos", Mirror),
        ("kaiser@two", Wrap),
        ("sharpen5", Border),
        ("kaiser@zero", Wrap),
        ("gauss3@zero", Mirror),
        ("box@zero", Clamp),
    ] {
        let held = [0, 1].map(|n: usize| {
            let mut options = options(filter, [address; 2], 16);
            let report = build_file(&inputs[n], &options).1;
            assert!(report.row_bytes_held <= report.memory, "{filter} {address:?}: {report:?}");
            // How far two threads get ahead of each other hangs on the machine. One holds what it needs.
            options.threads = 1;
            build_file(&inputs[n], &options).1.row_bytes_held
        });
        assert!(held[1] < held[0] + held[0] / 2, "{filter} {address:?}: {held:?}");
    }
}

#[test]
fn min_and_max_enclose_everything_below_them() {
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join("in.png");
    write_png(&input, [77, 53], ColorType::Grayscale, BitDepth::Sixteen, &texels(77 * 53 * 2, 3));
    for (name, encloses) in [("min", (|a, b| a <= b) as fn(f64, f64) -> bool), ("max", |a, b| a >= b)] {
        let (output, _) = build_file(&input, &options(name, [Clamp; 2], 16));
        let (description, tiles) = tiles(&output);
        let levels = levels(&description, &tiles);
        for (number, level) in levels.iter().enumerate() {
            for y in 0..53i64 {
                for x in 0..77i64 {
                    let over = level.at([Clamp; 2], [x >> number, y >> number])[0];
                    assert!(encloses(over, levels[0].at([Clamp; 2], [x, y])[0]), "{name} level {number}");
                }
            }
        }
        let top = levels.last().unwrap().values[0];
        assert!(levels[0].values.contains(&top));
    }
}

#[test]
fn the_fewer_roundings_the_nearer_to_the_finest() {
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join("in.png");
    let size = [256, 192];
    write_png(&input, size, ColorType::Grayscale, BitDepth::Eight, &texels((size[0] * size[1]) as usize, 7));
    let off = ["box", "box@two", "box@zero"].map(|name| {
        let (output, _) = build_file(&input, &options(name, [Clamp; 2], 16));
        let (description, tiles) = tiles(&output);
        let levels = levels(&description, &tiles);
        let mut sum = 0.0;
        for y in 0..24i64 {
            for x in 0..32i64 {
                let all: f64 =
                    (0..64).map(|i| levels[0].at([Clamp; 2], [8 * x + i % 8, 8 * y + i / 8])[0]).sum();
                sum += (levels[3].at([Clamp; 2], [x, y])[0] - all / 64.0).powi(2);
            }
        }
        sum
    });
    assert!(off[2] < off[1] && off[1] < off[0], "{off:?}");
}

#[test]
fn odd_kernels_say_so_and_what_does_not_suit_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join("in.png");
    write_png(&input, [20, 20], ColorType::Grayscale, BitDepth::Eight, &texels(400, 3));
    for (name, positions) in [("gauss3", TexelPositions::Kept), ("gauss4", TexelPositions::Centered)] {
        let (output, _) = build_file(&input, &options(name, [Clamp; 2], 16));
        assert_eq!(tiles(&output).0.geometry.spec().positions, positions);
    }
    let refused = |options: &BuildOptions| {
        let error = vastex_build::build(&[&input], &dir.path().join("out.vastex"), options, &()).unwrap_err();
        assert!(matches!(error, BuildError::Filter(_)), "{error}");
        error.to_string()
    };
    assert!(refused(&options("box-normal", [Clamp; 2], 16)).contains("a layer of r8 holds no normals"));
    for levels_from in [LevelsFrom::TwoFiner, LevelsFrom::Finest] {
        let options = BuildOptions { levels_from, ..options("min", [Clamp; 2], 16) };
        assert!(refused(&options).contains("picks values"));
    }
}
