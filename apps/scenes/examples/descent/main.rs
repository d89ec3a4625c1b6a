//! A flight from orbit down to two metres above the ground, over a generated planet of 2^31 texels round the
//! equator: an image of it (the one under assets/, or any in plate carrée projection) with detail of its own
//! below its texels, down to 2 cm.
//!
//! `cargo run --release -p vastex-scenes --example descent -- earth.vastex descent/` writes pictures of
//! places on the way; a number behind the directory is the texels round the equator, as a binary logarithm.
//! The file is made by `vastex build assets/earth-color-10800x5400.jpg -o earth.vastex --address wrap,clamp
//! --compress none`.

#![expect(clippy::print_stdout, reason = "an example tells what it does")]

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use vastex::source::PlanetSource;
use vastex::{Pace, Settings};
use vastex_scenes::{Descent, GlobePose, Picture, headless_gpu, planet_image};

const SIZE: [u32; 2] = [960, 540];
/// Frames between two pictures on the way down.
const EVERY: u64 = 60;
/// Frames after which each of them must be sharp.
const PATIENCE: u64 = 2000;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, directory, rest @ ..] = &arguments[..] else {
        bail!("name the image's container and the directory for pictures, as in earth.vastex descent/");
    };
    let bits = rest.first().map_or(Ok(PlanetSource::MOST_BITS), |bits| bits.parse())?;
    std::fs::create_dir_all(directory).context(directory.clone())?;
    let image = planet_image(&*vastex::open(file)?).context(file.clone())?;
    let source = Arc::new(PlanetSource::new(image, bits)?);
    let settings =
        Settings { pace: Pace::LockStep { latency_frames: 1 }, picture: SIZE, ..Settings::default() };
    let mut descent = Descent::new(&headless_gpu()?, source, SIZE, settings)?;
    for frame in 0..Descent::FRAMES {
        let pose = Descent::pose(frame);
        descent.frame(&pose)?;
        if frame % EVERY == 0 || frame + 1 == Descent::FRAMES {
            still(&mut descent, &pose)?;
            write_png(&Path::new(directory).join(format!("{frame:03}.png")), &descent.picture())?;
        }
    }
    Ok(())
}

/// Holds a pose until it is sharp, and tells how it is.
fn still(descent: &mut Descent, pose: &GlobePose) -> Result<()> {
    for frame in 0..PATIENCE {
        let stats = descent.frame(pose)?;
        // What has converged before the pose was held says nothing of it.
        if stats.converged && frame > 20 {
            let height = pose.altitude / GlobePose::METRE;
            let (pool, table) = (stats.pool_bytes >> 20, stats.table_bytes >> 10);
            let loaded = stats.pager.loaded;
            println!(
                "{height:12.1} m: {loaded} tiles loaded; GPU memory: pool {pool} MiB, page table {table} KiB"
            );
            return Ok(());
        }
    }
    bail!("not sharp after {PATIENCE} frames")
}

fn write_png(path: &Path, picture: &Picture) -> Result<()> {
    let file = std::fs::File::create(path).with_context(|| path.display().to_string())?;
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), picture.size[0], picture.size[1]);
    encoder.set_color(png::ColorType::Rgba);
    let mut rgba = picture.rgba.clone();
    rgba.chunks_exact_mut(4).for_each(|pixel| pixel[3] = 255);
    Ok(encoder.write_header()?.write_image_data(&rgba)?)
}
