//! A part of `cargo xtask bench build`: how the peak memory of a build grows with the width and the height of
//! the image.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Result;

use crate::inputs::Input;
use crate::measure;

/// The first is the one that the others are compared with: twice as wide, twice as high.
const INPUTS: [Input; 3] = [
    Input::Mirrored { across: 1, down: 1 },
    Input::Mirrored { across: 2, down: 1 },
    Input::Mirrored { across: 1, down: 2 },
];
/// What a build of twice the width, or of twice the height, may take at most, times what the first takes.
const LIMITS: [f64; 3] = [1.0, 2.0, 1.1];
/// Peaks of one build differ with how its threads take turns.
const RUNS: usize = 3;

/// The highest peak of several builds of each image, for the report.
pub(crate) fn compare(directory: &Path, vastex: &Path) -> Result<String> {
    let mut page = String::from("\n## Peak memory and the image's shape\n\n");
    writeln!(
        page,
        "`vastex build IN -o OUT --page 256 --compress none`, the highest of {RUNS} runs of each.\n\n\
         | image | peak MB | of the first | at most | |\n|---|---|---|---|---|"
    )?;
    let mut first = None;
    for (input, limit) in INPUTS.into_iter().zip(LIMITS) {
        let peak = peak_mb(&input.make(directory)?, directory, vastex)?;
        let share = peak / *first.get_or_insert(peak);
        let says = if share <= limit { "holds" } else { "DOES NOT HOLD" };
        let [width, height] = input.size();
        writeln!(page, "| {width}x{height} | {peak:.1} | {share:.2} | {limit:.1} | {says} |")?;
    }
    Ok(page)
}

fn peak_mb(image: &Path, directory: &Path, vastex: &Path) -> Result<f64> {
    let output = directory.join("shape.vastex");
    let (image, to) = (image.to_string_lossy(), output.to_string_lossy());
    let arguments = ["build", &image, "-o", &to, "--page", "256", "--compress", "none"].map(str::to_owned);
    let peak = |_| Ok(measure::run(&vastex.to_string_lossy(), &arguments, &output)?.peak_mb);
    let peaks: Vec<f64> = (0..RUNS).map(peak).collect::<Result<_>>()?;
    Ok(peaks.into_iter().fold(0.0, f64::max))
}
