//! A part of `cargo xtask bench build`: builds of block-compressed layers beside the bare encoders.
//!
//! The encoders are libraries, so the measuring is done where they are linked: in examples of `vastex-build`.

use std::path::Path;

use anyhow::Result;

use crate::shell;

/// What stands above the table. The table follows, from the example.
const INTRODUCTION: &str = "\n## Block compression beside the bare encoder\n\n\
    `cargo run --release -p vastex-build --features measure --example block_speed -- IN`: the build of a container without further\n\
    compression, and the encoder alone on the texels of its tiles, all levels and borders counted, by as many threads and with the same preset. The\n\
    build also reads the image, filters it in linear light and writes the file, which costs as much whatever the encoder, so the\n\
    fastest ones feel it most. Reading and writing have threads of their own: beside one encoding thread they have a processor to\n\
    themselves, beside as many as there are processors they take theirs. \"Busy\" are the build's processors at work, as the mean over the\n\
    build. Nothing stands at the place of the output: replacing a file there takes a while in which nothing else is to do, since the file\n\
    system gives its memory back, and some (ext4) first bring the new one to the disk. PSNR is that of level 0.\n\n";

/// What stands above the table of encoders at work.
const AT_WORK: &str = "\n## Encoders at work at once\n\n\
    `cargo run --release -p vastex-build --features measure --example encoders_at_work -- IN`: how many threads are encoding at\n\
    once, as the mean from the first block of a build to its last, by threads and texels of a page. The encoder sleeps as long as\n\
    the slowest preset takes, 7 megatexels a second, so as many can be at work as there are threads, however few processors there\n\
    are: what is seen is what locks, queues and the order of work cost.\n\n";

/// Measures an image in `rounds` rounds, for the report; `stamp` says when and of what, where the page does
/// not.
pub(crate) fn compare(image: &Path, rounds: usize, stamp: &str) -> Result<String> {
    let example = ["--release", "--quiet", "-p", "vastex-build", "--features", "measure"];
    let mut command = shell::cargo("run");
    command.args(example).args(["--example", "block_speed", "--"]).arg(image).arg(rounds.to_string());
    let table = shell::output(&mut command)?;
    let gap = if stamp.is_empty() { "" } else { "\n" };
    Ok(format!("{INTRODUCTION}{stamp}{gap}{table}"))
}

/// Counts the encoders that are at work at once while an image is built, for the report.
pub(crate) fn encoders_at_work(image: &Path) -> Result<String> {
    let example = ["--release", "--quiet", "-p", "vastex-build", "--features", "measure"];
    let mut command = shell::cargo("run");
    let table =
        shell::output(command.args(example).args(["--example", "encoders_at_work", "--"]).arg(image))?;
    Ok(format!("{AT_WORK}{table}"))
}
