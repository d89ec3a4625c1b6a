//! A planet of several virtual textures, each with its own size and format, in one shader.
//!
//! `cargo run -p vastex-scenes --example planet -- color=earth.vastex height=elevation.vastex planet.png`
//! draws it without a window. Attributes are `color`, `height`, `night` and `clouds`; any may be left out.
//! The files are made by `vastex build IMAGE -o FILE --address wrap,clamp`.

#![expect(clippy::print_stdout, reason = "an example tells what it does")]

use anyhow::{Context, Result, bail};
use vastex::{Pace, Settings};
use vastex_scenes::{Attribute, Part, Path, Picture, Planet, Scene, headless_gpu};

const SIZE: [u32; 2] = [960, 540];
/// Frames after which it must be sharp.
const PATIENCE: u64 = 2000;

fn main() -> Result<()> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let output = arguments.pop().context("name the textures, as in color=earth.vastex, and the picture")?;
    let parts: Vec<Part> = arguments.iter().map(|argument| part(argument)).collect::<Result<_>>()?;
    let gpu = headless_gpu()?;
    let settings = Settings { pace: Pace::LockStep { latency_frames: 1 }, ..Settings::default() };
    let mut planet = Planet::new(&gpu, parts, SIZE, settings)?;
    for frame in 0.. {
        let stats = planet.frame(Path::Still.pose(Scene::Globe, 2.0, frame))?;
        if stats.converged {
            println!(
                "sharp after {frame} frames: {} tiles of {} pools",
                stats.pager.loaded,
                stats.pools.len()
            );
            break;
        }
        if frame == PATIENCE {
            bail!("not sharp after {PATIENCE} frames: {} tiles are missing", stats.pager.missing);
        }
    }
    write_png(&output, &planet.picture())
}

/// `color=earth.vastex`.
fn part(argument: &str) -> Result<Part> {
    let (name, file) =
        argument.split_once('=').with_context(|| format!("{argument}: no attribute, as in color=FILE"))?;
    let attribute = Attribute::ALL.into_iter().find(|attribute| attribute.name() == name);
    let attribute = attribute
        .with_context(|| format!("{name}: no attribute; there are color, height, night and clouds"))?;
    Ok((attribute, vastex::open(file).context(file.to_owned())?))
}

fn write_png(path: &str, picture: &Picture) -> Result<()> {
    let file = std::fs::File::create(path).context(path.to_owned())?;
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), picture.size[0], picture.size[1]);
    encoder.set_color(png::ColorType::Rgba);
    let mut rgba = picture.rgba.clone();
    rgba.chunks_exact_mut(4).for_each(|pixel| pixel[3] = 255);
    Ok(encoder.write_header()?.write_image_data(&rgba)?)
}
