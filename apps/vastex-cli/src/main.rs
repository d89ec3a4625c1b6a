//! The program `vastex`: makes containers of images and shows them, in a window or headless.
//!
//! Here are the words of the command line and what is said to people and scripts; what is done stands in the
//! libraries. Exit codes: 0 done; 1 something is wrong with the input or the machine; 2 something is wrong
//! with the command line; 130 ended by Ctrl-C.

mod args;
mod commands;
mod disk_cache;
mod explained;
mod gpu;
#[cfg(feature = "view")]
mod link;
#[cfg(feature = "volumes")]
mod made_levels;
mod open;
mod output;
mod parts;
mod pictures;
mod places;
mod planet;
mod progress;
mod report;
#[cfg(feature = "view")]
mod screenshot;
mod shortage;
mod telemetry;
#[cfg(feature = "view")]
mod view;
#[cfg(all(feature = "view", feature = "volumes"))]
mod volumes;

use std::io::IsTerminal;
use std::process::ExitCode;

use args::Command;
#[cfg(unix)]
use signal_hook::consts::SIGXFSZ;
use tracing_subscriber::Layer;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

fn main() -> ExitCode {
    let words = args::with_volume(args::with_view(std::env::args_os().collect()), open::is_volume);
    #[cfg(feature = "view")]
    let mut args = args::parsed(words);
    #[cfg(not(feature = "view"))]
    let mut args = <args::Args as clap::Parser>::parse_from(words);
    if let Err(error) = args.follow_links().and_then(|()| args.check()) {
        error.exit();
    }
    start_log(args.verbose);
    survive_file_limits();
    let outcome = match args.command {
        #[cfg(feature = "build")]
        Command::Build(args) => commands::build_kind::run(&args),
        #[cfg(feature = "build")]
        Command::Crop(args) => commands::crop::run(&args),
        #[cfg(feature = "build")]
        Command::Export(args) => commands::export::run(&args),
        #[cfg(feature = "build")]
        Command::Merge(args) => commands::merge::run(&args),
        #[cfg(feature = "build")]
        Command::Replace(args) => commands::replace::run(&args),
        #[cfg(feature = "record")]
        Command::Record(args) => commands::record::run(&args),
        Command::Info(args) => commands::info::run(&args),
        Command::Verify(args) => commands::verify::run(&args),
        Command::Render(mut args) => {
            open::pick_bands(&mut args.scene).and_then(|()| commands::render::run(&args))
        }
        #[cfg(feature = "volumes")]
        Command::RenderVolume(args) => commands::render_volume::run(&args),
        Command::Replay(args) => commands::replay::run(&args),
        Command::Learn(args) => commands::learn::run(&args),
        #[cfg(feature = "view")]
        Command::View(args) => view::run(*args),
    };
    outcome.unwrap_or_else(|error| {
        report::say(&format!("error: {}", report::message(&error)));
        ExitCode::FAILURE
    })
}

/// Makes a write beyond the limit for files (`ulimit -f`) an error like that of a full disk. The system would
/// end the program, whose partial output would stay.
fn survive_file_limits() {
    #[cfg(unix)]
    if let Err(error) = signal_hook::flag::register(SIGXFSZ, Default::default()) {
        report::say(&format!("note: writes beyond the limit for files may leave a partial file: {error}"));
    }
}

/// Logs go to stderr: warnings of Vastex, and more for each `-v`; `RUST_LOG` has the last word.
fn start_log(verbose: u8) {
    let level = [LevelFilter::WARN, LevelFilter::INFO, LevelFilter::DEBUG, LevelFilter::TRACE];
    let level = level[usize::from(verbose.min(3))];
    let asked = std::env::var("RUST_LOG").ok().filter(|asked| !asked.is_empty());
    let targets = asked.and_then(|asked| asked.parse::<Targets>().ok());
    let targets = targets
        .unwrap_or_else(|| Targets::new().with_default(LevelFilter::ERROR).with_target("vastex", level));
    // Colour codes are for people, not for files.
    let is_terminal = std::io::stderr().is_terminal();
    let lines = tracing_subscriber::fmt::layer().with_ansi(is_terminal).with_writer(std::io::stderr);
    tracing_subscriber::registry().with(lines.with_filter(targets)).init();
}
