//! How far the levels of a container lie from those made straight from level 0 in 64-bit floats, in dB: the
//! table of docs/filters.md; and what the builds cost. The image is so large that level 5 is not in the tail.
//! `cargo run --release -p vastex-build --example filter_quality -- IMAGE`
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a measurement that is run by hand")]

mod clock;

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use clock::{median, time};
use vastex_build::{BuildOptions, Kernel, LayerFilter, LevelsFrom, Meaning, build};
use vastex_core::{LayerFormat, PagePos};
use vastex_tiles::{Container, TileSource};

/// Rows of texels, as light where it is colour.
struct Plane {
    size: [usize; 2],
    channels: usize,
    values: Vec<f64>,
}

/// Builds of each filter; the ratios of their times are taken within one round, for machines are not equally
/// fast for long.
const ROUNDS: usize = 3;

fn main() {
    let image = PathBuf::from(std::env::args().nth(1).unwrap());
    let is_color = vastex_build::open(&image).unwrap().header().format.channels() > 1;
    println!("| filter | level 1 | 2 | 3 | 4 | 5 | CPU time |\n|---|---|---|---|---|---|---|");
    for (kernel, stretched) in
        [(Kernel::Box, &box_filter as &dyn Fn(usize) -> Vec<f64>), (Kernel::Kaiser, &kaiser)]
    {
        let meaning = if is_color { Meaning::LinearColor } else { Meaning::Stored };
        let filters = LevelsFrom::ALL.map(|from| LayerFilter { kernel, meaning, from, nodata: None });
        let dir = tempfile::tempdir().unwrap();
        let output = |filter: LayerFilter| dir.path().join(format!("{filter}.vastex"));
        let rounds: Vec<_> =
            (0..ROUNDS).map(|_| filters.map(|filter| seconds(&image, &output(filter), filter))).collect();
        for (i, filter) in filters.into_iter().enumerate() {
            let ratio = median(rounds.iter().map(|round| round[i] / round[0]).collect());
            let container = Container::open_file(output(filter)).unwrap();
            let finest = plane(&container, 0);
            let off: Vec<_> = (1..=5u8)
                .map(|level| format!("{:.1}", psnr(&container, level, &finest, &stretched(1 << level))))
                .collect();
            println!("| `{filter}` | {} | {ratio:.1} |", off.join(" | "));
        }
    }
}

/// What a build takes of the processors.
fn seconds(image: &Path, output: &Path, filter: LayerFilter) -> f64 {
    let options = BuildOptions { filter: Some(filter), ..BuildOptions::default() };
    time(|| {
        build(&[image], output, &options, &()).unwrap();
    })
    .cpu
}

fn box_filter(factor: usize) -> Vec<f64> {
    vec![1.0 / factor as f64; factor]
}

fn kaiser(factor: usize) -> Vec<f64> {
    let bessel = |x: f64| {
        (1..50)
            .fold((1.0, 1.0), |(sum, term), n| {
                let term = term * (x / (2.0 * f64::from(n))).powi(2);
                (sum + term, term)
            })
            .0
    };
    let at = |k: usize| {
        let x = (k as f64 + 0.5) / factor as f64 - 3.0;
        (PI * x).sin() / (PI * x) * bessel(4.0 * (1.0 - (x / 3.0).powi(2)).sqrt())
    };
    let weights: Vec<f64> = (0..6 * factor).map(at).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| weight / sum).collect()
}

fn linear(s: f64) -> f64 {
    if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

fn srgb(l: f64) -> f64 {
    if l <= 0.0031308 { l * 12.92 } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 }
}

/// A level; of colour the first three channels, as light.
fn plane(container: &Container, level: u8) -> Plane {
    let description = container.description();
    let (geometry, format) = (&description.geometry, description.layers[0].format);
    let [width, height, _] = geometry.level(level).size.map(|n| n as usize);
    let (texel, side) = (format.texel_bytes(), geometry.tile()[0] as usize);
    let (page, border) = (geometry.page()[0] as usize, geometry.border()[0] as usize);
    let channels = format.channels().min(3);
    let mut values = vec![0.0; width * height * channels];
    for pos in geometry.pages_of_level(level) {
        let tile = pollster::block_on(container.read(pos)).unwrap().decode(description).unwrap();
        let PagePos { x: column, y: row, .. } = pos;
        for y in 0..page.min(height - row as usize * page) {
            for x in 0..page.min(width - column as usize * page) {
                let bytes = &tile[((y + border) * side + x + border) * texel..][..texel];
                let at = ((row as usize * page + y) * width + column as usize * page + x) * channels;
                for c in 0..channels {
                    values[at + c] = match format {
                        LayerFormat::R16 => f64::from(u16::from_le_bytes([bytes[0], bytes[1]])) / 65535.0,
                        LayerFormat::Rgba8Srgb => linear(f64::from(bytes[c]) / 255.0),
                        _ => f64::from(bytes[c]) / 255.0,
                    };
                }
            }
        }
    }
    Plane { size: [width, height], channels, values }
}

/// Of a level against the ideal one, in values as they are stored, the outermost texels left out.
fn psnr(container: &Container, level: u8, finest: &Plane, weights: &[f64]) -> f64 {
    let is_srgb = container.description().layers[0].format.is_srgb();
    let (stored, factor) = (plane(container, level), 1usize << level);
    let (first, [width, height]) = ((weights.len() - factor) / 2, stored.size);
    let encode = |v: f64| if is_srgb { srgb(v.clamp(0.0, 1.0)) } else { v.clamp(0.0, 1.0) };
    let c = stored.channels;
    let whole = finest.size[0] * c;
    let (mut sum, mut count) = (0.0, 0u64);
    for y in 3..height - 4 {
        let mut row = vec![0.0; whole];
        for (k, weight) in weights.iter().enumerate() {
            let from = &finest.values[(y * factor + k - first) * whole..][..whole];
            row.iter_mut().zip(from).for_each(|(to, from)| *to += weight * from);
        }
        for x in 3..width - 4 {
            for channel in 0..c {
                let ideal: f64 = weights
                    .iter()
                    .enumerate()
                    .map(|(k, weight)| weight * row[(x * factor + k - first) * c + channel])
                    .sum();
                sum += (encode(ideal) - encode(stored.values[(y * width + x) * c + channel])).powi(2);
                count += 1;
            }
        }
    }
    -10.0 * (sum / count as f64).log10()
}
