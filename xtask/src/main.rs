//! What a person types in a clone of Vastex: `cargo xtask test | shaders | demo | bench | campaign`.
//!
//! It drives other programs (cargo, the package manager, libvips) and says what it does; whatever can be
//! asserted about the code itself is a test under `tests/` and not a command here. It stays small and free of
//! heavy dependencies, since everybody compiles it first.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program for the terminal")]

mod bench;
mod bench_view;
mod bench_volumes;
mod block_speed;
mod browser;
mod campaign;
mod damage;
mod demo;
mod demo_program;
mod drivers;
mod facade_docs;
mod figures;
mod for_windows;
mod gaia_sky;
mod inputs;
mod kills;
mod land_mask;
mod measure;
mod once;
mod outcome;
mod python;
mod record_command;
mod setup;
mod shaders;
mod shapes;
mod shell;
mod test;
mod test_programs;
mod times;
mod wasm;
mod web;
mod wgsl;
mod window;

use std::process::ExitCode;

use figures::{DECIDE, DRAW, FETCH, SLOW, TEXTURES};
use shell::Usage;

const HELP: &str = "\
Everything that is done in a clone of Vastex. What the machine lacks is installed on Debian and Ubuntu, and named elsewhere.

Usage: cargo xtask <COMMAND>

Commands:
  test [STEP]..            the whole suite with its set-up, or only the steps named
  test -p CRATE [WORD]     the tests of one crate, or those of them whose names contain a word
  times [WORD]..           the processor time of each test by itself, of all or of those whose names contain a word, dearest first
  times viewer             the same of the viewer of images and planets, with the window
  shaders DIR              every shader text that the project can hand to a device, one file each
  demo                     the real Earth as a virtual texture: in a window where there is a display, else as pictures
  bench build [OPTIONS]    preparing data beside libvips, in the same run
      blocks                 only builds in blocks beside the bare encoders
      --runs N               interleaved runs of each program [default: 5]
      --write                put the figures into docs/bench-build.md
  bench fetch [--write]    reading and decoding tiles beside bare reads and decoders; into docs/bench-fetch.md
  bench slow [--write]     a disk cache before a source slowed on purpose; into docs/bench-slow.md
  bench decide [--write]   what a frame's decisions cost on one core; into docs/bench-decide.md
  bench textures [--write] what 200 textures cost the thread that draws; into docs/bench-textures.md
  bench draw [--write]     frames beside those of an ordinary texture, on this machine's adapter, with a verdict for each thing that
                           is asked of a GPU; into docs/bench-draw.md, of a GPU docs/bench-draw-gpu.md
  bench draw SECTION..     only these: operations, filters, fading, feedback, tables, second_level, sizes, targets, uploads, volumes
  bench view [--write]     how soon something can be seen of a file, beside libvips' thumbnail; into docs/bench-view.md
  bench volumes [OPTIONS]  pyramids of volumes beside ome-zarr-py, bricks beside decoding alone, boxes beside zarr-python and tensorstore;
                           what pictures cost; into docs/bench-volumes.md
      levels, reading, pictures  only these; what the page has of the others is kept
      --runs N               interleaved runs of each program [default: 3]
      --write                put the figures there
  record DIR               what must stay while code moves, as plain files: decisions, pictures, hashes of what is built, help, names
      --compare              make it anew and name each difference from what lies in DIR
      --only PART,..         only these: worlds, frames, files, help, names, tests
  campaign [--minutes N]   the random tests with ever more cases [default: 10 minutes]
  campaign browser         every shader text in a browser, of which the suite takes a part
  campaign screen-reader   the window with what tells screen readers of it, as one hears and uses it
  campaign windows         the workspace compiled for Windows, by MinGW, which is installed; nothing is linked or run
  campaign kills           builds that are killed, resumed and compared
      --count N              builds, each killed one to three times [default: 200]
  campaign flips           bits flipped in containers of every kind
      --count N              bits [default: 10000]
  campaign fuzz            damaged files for every reader; by cargo-fuzz, which is installed
      --minutes M            for each target [default: 30]
      --target T             only this one: container, part, image, profile, raw, mosaic, deep_zoom, gaia_sky,
                             celestia, prototype, export, volume
  help                     this text

Examples:
  cargo xtask test
  cargo xtask test format clippy
  cargo xtask test -p vastex-core bias
  cargo xtask bench build --runs 9 --write

Exit codes: 0 done, 1 something failed, 2 the command line is wrong.
";

fn main() -> ExitCode {
    if let Some(ended) = once::in_place_of_rustdoc() {
        return ended;
    }
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match dispatch(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is::<Usage>() => {
            eprintln!("error: {error}\n\n{HELP}");
            ExitCode::from(2)
        }
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn dispatch(arguments: &[&str]) -> anyhow::Result<()> {
    match arguments {
        ["help" | "--help" | "-h", ..] | [_, "--help" | "-h", ..] => {
            print!("{HELP}");
            Ok(())
        }
        ["test", steps @ ..] => test::run(steps),
        ["times", words @ ..] => times::run(words),
        ["demo"] => demo::run(),
        ["shaders", arguments @ ..] => shaders::run(arguments),
        ["bench", "build", options @ ..] => bench::build(options),
        ["bench", "fetch", options @ ..] => FETCH.bench(options),
        ["bench", "slow", options @ ..] => SLOW.bench(options),
        ["bench", "decide", options @ ..] => DECIDE.bench(options),
        ["bench", "textures", options @ ..] => TEXTURES.bench(options),
        ["bench", "draw", options @ ..] => DRAW.bench(options),
        ["bench", "view", options @ ..] => bench_view::run(options),
        ["bench", "volumes", options @ ..] => bench_volumes::volumes(options),
        ["bench", other, ..] => Err(Usage(format!(
            "no benchmark is called '{other}'; there are: build, decide, draw, fetch, slow, textures, view, volumes"
        ))
        .into()),
        ["bench"] => Err(Usage(
            "which benchmark? There are: build, decide, draw, fetch, slow, textures, view, volumes".to_owned(),
        )
        .into()),
        ["record", options @ ..] => record_command::run(options, HELP),
        ["campaign", "browser"] => browser::campaign(),
        ["campaign", "browser", other, ..] => {
            Err(Usage(format!("campaign browser takes no argument '{other}'")).into())
        }
        ["campaign", "screen-reader"] => window::by_ear(),
        ["campaign", "screen-reader", other, ..] => {
            Err(Usage(format!("campaign screen-reader takes no argument '{other}'")).into())
        }
        ["campaign", "windows"] => for_windows::check(),
        ["campaign", "windows", other, ..] => {
            Err(Usage(format!("campaign windows takes no argument '{other}'")).into())
        }
        ["campaign", "kills", options @ ..] => kills::run(options),
        ["campaign", "flips", options @ ..] => damage::flips(options),
        ["campaign", "fuzz", options @ ..] => damage::fuzz(options),
        ["campaign", options @ ..] => campaign::run(options),
        ["demo", other, ..] => Err(Usage(format!("demo takes no argument '{other}'")).into()),
        [other, ..] => Err(Usage(format!("no command is called '{other}'")).into()),
        [] => Err(Usage("a command is missing".to_owned()).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_command_line_is_a_usage_error() {
        for arguments in [
            &[][..],
            &["tset"],
            &["bench"],
            &["bench", "paint"],
            &["bench", "draw", "--fast"],
            &["bench", "fetch", "--fast"],
            &["bench", "build", "--runs"],
            &["bench", "build", "--runs", "0"],
            &["campaign", "--minutes", "soon"],
            &["campaign", "kills", "--count", "none"],
            &["campaign", "flips", "--count", "0"],
            &["campaign", "fuzz", "--target", "moon"],
            &["campaign", "fuzz", "--minutes"],
            &["campaign", "shaders", "--all"],
            &["campaign", "browser", "--all"],
            &["campaign", "screen-reader", "--all"],
            &["campaign", "windows", "--all"],
            &["demo", "mars"],
            &["record"],
            &["record", "a", "b"],
            &["record", "a", "--only", "moon"],
            &["times", "--fast"],
            &["shaders"],
            &["shaders", "--fast"],
            &["shaders", "a", "b"],
            &["test", "tset"],
            &["test", "-p"],
            &["test", "-p", "vastex-moon"],
            &["test", "-p", "vastex", "a", "b"],
        ] {
            let error = dispatch(arguments).unwrap_err();
            assert!(error.is::<Usage>(), "{arguments:?}: {error:#}");
        }
    }
}
