//! A part of `cargo xtask bench build`: a real mask of the whole Earth, 43200x21600 texels of land or water,
//! from PNG.
//!
//! Most of its pages are all land or all water, so it shows what is saved where tiles are constant or alike.
//! The mask is fetched, never kept here.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::measure::{self, Run, medians};
use crate::{python, shell};

/// Where it comes from: a package of Python's, in the public domain's data and the MIT licence's code.
const PACKAGE: &str = "global-land-mask==1.0.0";
const WHEEL: &str = "global_land_mask-1.0.0-py3-none-any.whl";
const SIZE: [usize; 2] = [43_200, 21_600];
/// The peak that a build of it may have, in units of 10^6 bytes.
const PEAK_LIMIT_MB: f64 = 200.0;

/// Unpacks the mask: true where there is water, and land has to be 255.
const UNPACK: &str = "import io, sys, zipfile, numpy\n\
    wheel = zipfile.ZipFile(sys.argv[1])\n\
    mask = numpy.load(io.BytesIO(wheel.read('global_land_mask/globe_combined_mask_compressed.npz')))['mask']\n\
    numpy.where(mask, numpy.uint8(0), numpy.uint8(255)).tofile(sys.argv[2])\n";

/// Builds it `runs` times and says what that took and saved, for the report.
pub(crate) fn measure(directory: &Path, vastex: &Path, runs: usize) -> Result<String> {
    let (image, output) = (png(directory)?, directory.join("land.vastex"));
    let arguments = ["build", &image.to_string_lossy(), "-o", &output.to_string_lossy()].map(str::to_owned);
    let runs: Vec<Run> = (0..runs)
        .map(|_| measure::run(&vastex.to_string_lossy(), &arguments, &output))
        .collect::<Result<_>>()?;
    let info = shell::output(shell::command(&vastex.to_string_lossy()).arg("info").arg(&output))?;
    // The first line is the path of the file on this machine.
    let info = info.split_once('\n').map_or(info.as_str(), |(_, rest)| rest);
    let Run { wall, cpu, written_mb, .. } = medians(&runs);
    let peak = runs.iter().map(|run| run.peak_mb).fold(0.0, f64::max);
    let says = if peak < PEAK_LIMIT_MB { "holds" } else { "DOES NOT HOLD" };
    let [width, height] = SIZE;
    let mut page = format!("\n## A real mask of land and water, {width}x{height}, from PNG\n\n");
    writeln!(
        page,
        "`vastex build land.png -o land.vastex`, medians of {} runs: {wall:.1} s, {cpu:.1} s of CPU, {:.0} Mpix/s, a PNG of \
         {:.1} MB, a container of {written_mb:.1} MB.\n\n\
         - Peak memory under {PEAK_LIMIT_MB:.0} MB in every run: {says} (the highest is {peak:.0} MB).\n\n\
         What `vastex info` says of it:\n\n```\n{}\n```",
        runs.len(),
        (width * height) as f64 / 1e6 / wall,
        std::fs::metadata(&image)?.len() as f64 / 1e6,
        info.trim_end(),
    )?;
    Ok(page)
}

/// The mask as a PNG of 8 bits, made unless it is there.
fn png(directory: &Path) -> Result<PathBuf> {
    let png = directory.join("land.png");
    if png.exists() {
        return Ok(png);
    }
    let (python, wheel, raw) =
        (python::with_packages(directory)?, directory.join(WHEEL), directory.join("land.raw"));
    if !wheel.exists() {
        println!("fetching a real mask of land and water, since the benchmark builds it");
        python::download(directory, PACKAGE).with_context(|| {
            format!("the mask cannot be fetched; put {WHEEL} into {}", directory.display())
        })?;
    }
    shell::run(shell::command(&python.to_string_lossy()).args(["-c", UNPACK]).arg(&wheel).arg(&raw))?;
    let [width, height] = SIZE.map(|side| side.to_string());
    let loaded = directory.join("land.tif");
    shell::run(shell::command("vips").arg("rawload").arg(&raw).arg(&loaded).args([&width, &height, "1"]))?;
    shell::run(shell::command("vips").arg("pngsave").arg(&loaded).arg(&png))?;
    std::fs::remove_file(raw)?;
    std::fs::remove_file(loaded)?;
    Ok(png)
}
