//! The part of `cargo xtask bench volumes` that draws: what a picture of each mode costs, how near it is to
//! one of ordinary textures, how good it is in how much memory, and how soon there is one in a window.
//!
//! Drawing is on whatever adapter there is: a software driver's times are a processor's.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::{SIZE, Scripts, build, vastex, words};
use crate::measure::{self, GNU_TIME, median};
use crate::{setup, shell};

/// Pixels of a picture.
const PICTURE: &str = "512x512";
/// Where the camera is, in perspective.
const VIEW: &str = "around:yaw=30,pitch=20";
const MODES: [&str; 5] = ["mip", "minip", "average", "emission", "iso"];
/// Modes that are drawn in several amounts of memory.
const BY_MEMORY: [&str; 3] = ["mip", "average", "emission"];
/// Sizes of their pool in MiB.
const POOLS: [&str; 7] = ["2", "4", "8", "16", "32", "64", "128"];
/// A pool that holds all of it.
const ALL: &str = "512";

/// A volume: what the page calls it, where it lies, and the value of its surface.
struct Drawn {
    name: String,
    path: PathBuf,
    iso: &'static str,
}

/// The part of the page.
pub(super) fn page(scripts: &Scripts, input: &Path, directory: &Path, runs: usize) -> Result<String> {
    shell::run(shell::cargo("build").args(["--release", "-p", "vastex-cli"]))?;
    let cells = directory.join("pictures.zarr");
    if cells.exists() {
        std::fs::remove_dir_all(&cells).with_context(|| format!("cannot remove {}", cells.display()))?;
    }
    shell::run(shell::command(&words(&vastex())).args(build(input, &cells, "")))?;
    let head = shell::root().join("assets/volumes/head.zip");
    let [width, height, depth] = SIZE;
    let volumes = [
        Drawn { name: "the real head, three channels of 98x116x94".to_owned(), path: head, iso: "100" },
        Drawn { name: format!("blobs with noise, {width}x{height}x{depth}"), path: cells, iso: "2000" },
    ];
    let mut page = format!(
        "\n## Pictures\n\n\
         {PICTURE} pixels in perspective (`{VIEW}`), by `vastex render --on volume`, until all that is wanted is there. PSNR is beside a picture of ordinary\n\
         textures of the same levels (`--compare`). Frames before the last one draw what rays ask for alone. CPU seconds are of the whole program.\n\
         In iso a ray that grazes a surface meets it in one picture and may miss it in the other: one pixel of the head does, which is all of its PSNR.\n\n{}\n\n",
        measure::stamp()?
    );
    page.push_str("| volume | mode | frames | CPU s | mip bias | bricks wanted | chunks decoded | MB read | PSNR dB |\n|---|---|---|---|---|---|---|---|---|\n");
    for volume in &volumes {
        for mode in MODES {
            page.push_str(&row_of_mode(volume, mode, directory, runs)?);
        }
    }
    page.push_str(&by_memory(scripts, &volumes[1], directory)?);
    page.push_str(&in_window(&volumes, directory, runs)?);
    Ok(page)
}

/// The arguments that draw a volume.
fn render(volume: &Drawn, mode: &str, output: &Path, more: &[&str]) -> Vec<String> {
    let path = words(&volume.path);
    let first = ["render", &path, "--on", "volume", "--mode", mode, "--view", VIEW, "--size", PICTURE];
    let surface = if mode == "iso" { &["--iso", volume.iso][..] } else { &[] };
    let output = words(output);
    let last = ["--cache", "off", "--json", "-o", &output];
    [&first[..], surface, more, &last].concat().into_iter().map(str::to_owned).collect()
}

/// What a program says, and its processor time in seconds.
fn heard(arguments: &[String], directory: &Path) -> Result<(String, f64)> {
    let report = directory.join("picture-time.txt");
    let mut command = shell::command(GNU_TIME);
    command.args(["-f", "%U %S", "-o"]).arg(&report).arg(vastex()).args(arguments);
    let said = shell::output(&mut command)?;
    let times = std::fs::read_to_string(&report)?;
    let seconds = times.split_whitespace().filter_map(|time| time.parse::<f64>().ok()).sum();
    Ok((said, seconds))
}

fn figure(said: &str, name: &str) -> Result<f64> {
    measure::number(said, name).with_context(|| format!("{name} is not in {said}"))
}

fn row_of_mode(volume: &Drawn, mode: &str, directory: &Path, runs: usize) -> Result<String> {
    let picture = directory.join("picture.png");
    let drawn = render(volume, mode, &picture, &[]);
    let (mut times, mut said) = (Vec::new(), String::new());
    for _ in 0..runs {
        let seconds;
        (said, seconds) = heard(&drawn, directory)?;
        times.push(seconds);
    }
    let (compared, _) = heard(&render(volume, mode, &picture, &["--compare"]), directory)?;
    // Pictures that are the same have no such figure.
    let psnr = measure::number(&compared, "psnr_db");
    let psnr = psnr.map_or_else(|| "the same".to_owned(), |psnr| format!("{psnr:.1}"));
    Ok(format!(
        "| {} | {mode} | {} | {:.2} | {} | {} | {} | {:.1} | {psnr} |\n",
        volume.name,
        figure(&said, "frames")?,
        median(times),
        figure(&said, "mip_bias")?,
        figure(&said, "bricks_wanted")?,
        figure(&said, "chunks_decoded")?,
        figure(&said, "bytes_read")? / 1e6,
    ))
}

/// How near a picture in a small pool is to the one in a pool that holds everything.
fn by_memory(scripts: &Scripts, volume: &Drawn, directory: &Path) -> Result<String> {
    let mut page = format!(
        "\n### In how much memory\n\n\
         Of {}: PSNR in dB beside the picture in a pool that holds all that is wanted, and in parentheses the mip bias that makes the bricks fit. A\n\
         picture in less memory is coarser, and nothing is loaded twice.\n\n| pool MiB |{}\n|---|{}\n",
        volume.name,
        BY_MEMORY.map(|mode| format!(" {mode} |")).concat(),
        "---|".repeat(BY_MEMORY.len()),
    );
    let mut columns = Vec::new();
    for mode in BY_MEMORY {
        let (mut pictures, mut biases) = (Vec::new(), Vec::new());
        for pool in [ALL].iter().chain(&POOLS) {
            let picture = directory.join(format!("picture-{pool}.png"));
            let (said, _) = heard(&render(volume, mode, &picture, &["--pool-mib", pool]), directory)?;
            biases.push(figure(&said, "mip_bias")?);
            let values = picture.with_extension("npy");
            let mut crop = shell::command(&words(&vastex()));
            crop.arg("crop").arg(&picture).args(["--at", "0,0", "--size", PICTURE, "-o"]).arg(&values);
            shell::run(crop.arg("--quiet"))?;
            pictures.push(values);
        }
        let said = shell::output(
            shell::command(&words(&scripts.python)).arg(scripts.script("psnr.py")).args(&pictures),
        )?;
        let found: Vec<String> = said.lines().map(str::to_owned).collect();
        columns.push(found.into_iter().zip(biases.into_iter().skip(1)).collect::<Vec<_>>());
    }
    for (index, pool) in POOLS.iter().enumerate() {
        write!(page, "| {pool} |")?;
        for column in &columns {
            match column.get(index) {
                Some((psnr, _)) if psnr == "inf" => write!(page, " the same |")?,
                Some((psnr, bias)) => write!(page, " {psnr} ({bias:.2}) |")?,
                None => write!(page, " |")?,
            }
        }
        page.push('\n');
    }
    Ok(page)
}

/// How soon a window shows a volume.
fn in_window(volumes: &[Drawn], directory: &Path, runs: usize) -> Result<String> {
    setup::ensure(&setup::VIRTUAL_DISPLAY)?;
    let mut page = String::from(
        "\n### In a window\n\n\
         `vastex view` at 1280x720, three slices and a maximum side by side; milliseconds from the call to open, with the device and the window there, to the\n\
         first picture of the volume, and to the last brick. Medians.\n\n\
         | volume | first picture | all bricks | a frame, 95 % |\n|---|---|---|---|\n",
    );
    for volume in volumes {
        let mut seen = [const { Vec::new() }; 3];
        for _ in 0..runs {
            let mut command = shell::command("xvfb-run");
            command.args(["-a", "-s", "-screen 0 1280x800x24"]).arg(vastex()).arg("view").arg(&volume.path);
            command.args(["--times", "--size", "1280x720", "--cache", "off"]);
            let said = shell::output(command.current_dir(directory))?;
            for (seen, name) in seen.iter_mut().zip(["source_ms", "sharp_ms", "frame_p95_ms"]) {
                seen.push(figure(&said, name)?);
            }
        }
        let [first, all, frame] = seen.map(median);
        writeln!(page, "| {} | {first:.0} | {all:.0} | {frame:.0} |", volume.name)?;
    }
    Ok(page)
}
