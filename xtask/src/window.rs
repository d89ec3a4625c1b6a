//! The step that opens the program's window, on displays that are none.
//!
//! What the window shows is drawn by the same code as the pictures, which the tests compare; here it is
//! opened, redrawn and closed, with containers and with images that nobody built (`starts`), and used by keys
//! and pointer (`hands`): an image, a planet and a volume, side by side on displays of their own, with a
//! picture of every step of that in `target/window/*/steps`. Where there is no virtual display the step is
//! skipped, loudly. `cargo xtask campaign screen-reader` uses it by ear, by what it says on a session `bus`.

mod bus;
mod display;
mod hands;
mod png;
mod starts;

use std::fs;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail, ensure};

use crate::outcome::Outcome;
use crate::{setup, shell};

/// What goes on beside each other: much of each is waiting, and the second has what the third was.
const PARTS: [Part; 3] =
    [("image", hands::use_window), ("planet", planet_and_starts), ("volume", volume_and_dense_screen)];

/// A part's name, and what it does in a directory of its own.
type Part = (&'static str, fn(&Path) -> Result<()>);

pub(crate) fn check() -> Result<Outcome> {
    if !cfg!(target_os = "linux") {
        return Ok(Outcome::Skipped("virtual displays are looked for on Linux only".to_owned()));
    }
    if let Err(error) = setup::ensure(&setup::VIRTUAL_DISPLAY) {
        println!("\n!!!! SKIPPED: {error:#}, so nothing says whether the window still opens !!!!\n");
        return Ok(Outcome::Skipped("no virtual display".to_owned()));
    }
    // The program as its tests have it: asked for by itself it would be compiled anew, with fewer features.
    shell::run(shell::cargo("test").args(["--quiet", "--workspace", "--test", "program", "--no-run"]))?;
    let place = shell::target_dir().join("window");
    if place.exists() {
        fs::remove_dir_all(&place)?;
    }
    let failed: Vec<String> = thread::scope(|scope| {
        let run = |(name, part): (&'static str, fn(&Path) -> Result<()>)| {
            let place = place.join(name);
            let begun = Instant::now();
            fs::create_dir_all(place.join("steps"))?;
            part(&place).with_context(|| format!("the window with {name}"))?;
            println!("the window with {name}: {:.0} s", begun.elapsed().as_secs_f64());
            Ok(())
        };
        let parts = PARTS.map(|part| scope.spawn(move || run(part)));
        let ended =
            parts.map(|part| part.join().unwrap_or_else(|_| Err(anyhow!("a part of the step panicked"))));
        ended.into_iter().filter_map(Result::err).map(|error| format!("{error:#}")).collect()
    });
    match &*failed {
        [] => Ok(Outcome::Passed),
        failed => bail!("{}", failed.join("; ")),
    }
}

/// `cargo xtask campaign screen-reader`: the window as a screen reader knows it. Where anything lacks that it
/// needs, it fails.
pub(crate) fn by_ear() -> Result<()> {
    ensure!(
        cfg!(target_os = "linux"),
        "campaign screen-reader runs on Linux only, where such a reader is D-Bus"
    );
    setup::ensure(&setup::VIRTUAL_DISPLAY)?;
    setup::ensure(&setup::ACCESSIBILITY)?;
    let mut build = shell::cargo("test");
    build.args(["--quiet", "--workspace", "--test", "program", "--no-run"]);
    shell::run(build.args(["--features", "vastex-cli/screen-reader"]))?;
    let place = shell::target_dir().join("window/reader");
    if place.exists() {
        fs::remove_dir_all(&place)?;
    }
    fs::create_dir_all(place.join("steps"))?;
    hands::use_by_ear(&place)
}

/// The starts come after the planet, since that has its image built, and on its display.
fn planet_and_starts(place: &Path) -> Result<()> {
    hands::use_broken(&inner(place, "broken")?)?;
    hands::use_planet(place)?;
    starts::check(place)
}

fn volume_and_dense_screen(place: &Path) -> Result<()> {
    hands::use_volume(place)?;
    hands::use_dense_screen(&inner(place, "dense")?)
}

/// A directory within another, with room for pictures of steps.
fn inner(place: &Path, name: &str) -> Result<PathBuf> {
    let inner = place.join(name);
    fs::create_dir_all(inner.join("steps"))?;
    Ok(inner)
}

fn program() -> PathBuf {
    shell::target_dir().join("debug/vastex")
}
