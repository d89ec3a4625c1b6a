//! A part of `cargo xtask bench build`: builds of block-compressed layers beside the bare encoders.
//!
//! The encoders are libraries, so the measuring is done where they are linked: in an example of `vastex-build`.

use std::path::Path;

use anyhow::Result;

use crate::shell;

/// What stands above the table. The table follows, from the example.
const INTRODUCTION: &str = "\n## Block compression beside the bare encoder\n\n\
    `cargo run --release -p vastex-build --example block_speed -- IN`: the build of a container without further compression, and\n\
    the encoder alone on the texels of its tiles, all levels and borders counted, by as many threads and with the same preset. The\n\
    build also reads the image, filters it in linear light and writes the file, which costs as much whatever the encoder, so the\n\
    fastest ones feel it most. Reading and writing have threads of their own: beside one encoding thread they have a processor to\n\
    themselves, beside as many as there are processors they take theirs. PSNR is that of level 0.\n\n";

/// Measures an image in `rounds` rounds, for the report.
pub(crate) fn compare(image: &Path, rounds: usize) -> Result<String> {
    let example = ["--release", "--quiet", "-p", "vastex-build", "--example", "block_speed", "--"];
    let table = shell::output(shell::cargo("run").args(example).arg(image).arg(rounds.to_string()))?;
    Ok(format!("{INTRODUCTION}{table}"))
}
