//! The step that has volumes drawn in a browser, and compares them with what the same code draws natively.
//!
//! `apps/browser` is compiled for the browser by the compiler of the step `wasm`, and started in headless
//! Chromium, whose software driver draws. Natively its test draws the same pictures of the same container,
//! with whatever adapter the machine has. No code of a pixel may be further apart than [`MOST`]. Where there
//! is no compiler the step is skipped, loudly, as `wasm` is; where there is no browser too, but in CI.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::browser::site::{self, Answer, Site};
use crate::outcome::{Outcome, cargo_test};
use crate::{once, setup, shell, wasm};

const PAGE: &str = include_str!("web.html");
/// How far apart two codes of 8 bits may be.
const MOST: u8 = 3;
/// The test that draws natively, and what tells it where to leave the pictures.
const TEST: &str = "pictures::the_head_is_drawn_by_the_code_that_draws_it_in_a_browser";
const PICTURES: &str = "VASTEX_BROWSER_PICTURES";
const CONTAINER: &str = "head.vastex";
const PACKAGE: &str = "vastex-browser";
/// What writes the JavaScript beside the program: a workspace of its own, compiled once.
const BINDGEN: &str = "xtask/bindgen/Cargo.toml";
const SCRIPT: &str = "vastex_browser.js";
const PROGRAM: &str = "vastex_browser_bg.wasm";

pub(crate) fn check() -> Result<Outcome> {
    if let Err(error) = setup::ensure(&setup::BROWSER) {
        if shell::is_ci() {
            return Err(error);
        }
        println!("\n!!!! SKIPPED: {error:#}, so nothing says what volumes look like in a browser !!!!\n");
        return Ok(Outcome::Skipped("no browser".to_owned()));
    }
    let Some(program) = wasm::build_program(PACKAGE)? else {
        println!(
            "\n!!!! SKIPPED: there is no compiler for browsers, so nothing says what volumes look like in one !!!!\n"
        );
        return Ok(Outcome::Skipped("no compiler for browsers".to_owned()));
    };
    let directory = shell::target_dir().join("web");
    fs::create_dir_all(&directory)?;
    if !write_script(&program, &directory)? {
        println!(
            "\n!!!! SKIPPED: the crates of {BINDGEN} cannot be fetched, so nothing says what volumes look like in a browser !!!!\n"
        );
        return Ok(Outcome::Skipped("no crates of wasm-bindgen's tool".to_owned()));
    }
    let natively = drawn_natively(&directory)?;
    let read = |name: &str| fs::read(directory.join(name)).with_context(|| name.to_owned());
    let mut shown = Shown {
        script: read(SCRIPT)?,
        program: read(PROGRAM)?,
        container: read(CONTAINER)?,
        pictures: BTreeMap::new(),
        costs: Vec::new(),
        wrong: Vec::new(),
        done: None,
    };
    site::show(&mut shown, 1)?;
    if !shown.wrong.is_empty() {
        bail!("the browser complains:\n{}", shown.wrong.join("\n"));
    }
    shown.costs.iter().for_each(|cost| println!("  {cost}"));
    for (name, native) in &natively {
        let in_browser = shown.pictures.get(name).with_context(|| format!("the browser drew no {name}"))?;
        fs::write(directory.join(format!("{name}.browser")), in_browser)?;
        let apart = compare(native, in_browser).with_context(|| name.clone())?;
        println!("  {name}: up to {} of 255 apart, {:.1} % of the pixels equal", apart.most, apart.equal);
        if apart.most > MOST {
            bail!(
                "{name}: codes are up to {} apart, and {MOST} are allowed; both pictures are in {}",
                apart.most,
                directory.display()
            );
        }
    }
    println!("{} pictures as they are natively, by {}", natively.len(), shown.done.unwrap_or_default());
    Ok(Outcome::Passed)
}

/// Writes what starts the program, where the program is newer; false where the tool that does it cannot be
/// fetched.
fn write_script(program: &Path, directory: &Path) -> Result<bool> {
    let time = |path: &Path| fs::metadata(path).and_then(|data| data.modified());
    let written = directory.join(PROGRAM);
    if let (Ok(written), Ok(made)) = (time(&written), time(program))
        && written > made
        && directory.join(SCRIPT).is_file()
    {
        return Ok(true);
    }
    let mut fetch = shell::cargo("fetch");
    if shell::run(fetch.args(["--locked", "--quiet", "--manifest-path", BINDGEN])).is_err() {
        return Ok(false);
    }
    let mut command = shell::cargo("run");
    // Others' code, and a few lines: nothing that lints are for.
    command.args(["--quiet", "--manifest-path", BINDGEN]).env_remove(once::WRAPPER);
    command
        .arg("--target-dir")
        .arg(shell::target_dir().join("bindgen"))
        .arg("--")
        .arg(program)
        .arg(directory);
    shell::run(&mut command)?;
    Ok(true)
}

/// Has the container built and the pictures drawn by this machine's adapter; their bytes, by their names.
fn drawn_natively(directory: &Path) -> Result<BTreeMap<String, Vec<u8>>> {
    for old in pictures_in(directory)? {
        fs::remove_file(old)?;
    }
    let mut command = cargo_test();
    command.args(["--workspace", "--test", "suite", "--", "--exact", TEST]).env(PICTURES, directory);
    shell::output(&mut command)?;
    let mut pictures = BTreeMap::new();
    for path in pictures_in(directory)? {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        pictures.insert(name, fs::read(&path)?);
    }
    match pictures.len() {
        0 => bail!("no test has drawn anything; it may have another name than {TEST}"),
        _ => Ok(pictures),
    }
}

fn pictures_in(directory: &Path) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(directory)?.collect::<std::io::Result<Vec<_>>>()?;
    let paths = entries.into_iter().map(|entry| entry.path());
    Ok(paths.filter(|path| path.extension().is_some_and(|own| own == "rgba")).collect())
}

/// How far two pictures are apart.
#[derive(Debug, PartialEq)]
struct Apart {
    most: u8,
    /// The share of pixels that are the same, in percent.
    equal: f64,
}

fn compare(one: &[u8], other: &[u8]) -> Result<Apart> {
    if one.len() != other.len() || one.is_empty() {
        bail!("pictures of {} and {} bytes", one.len(), other.len());
    }
    let most = one.iter().zip(other).map(|(one, other)| one.abs_diff(*other)).max().unwrap_or(0);
    let pixels = one.chunks(4).zip(other.chunks(4));
    let equal = pixels.filter(|(one, other)| one == other).count();
    Ok(Apart { most, equal: 100.0 * equal as f64 / one.chunks(4).count() as f64 })
}

/// What the page is shown, and what it has said.
struct Shown {
    script: Vec<u8>,
    program: Vec<u8>,
    container: Vec<u8>,
    pictures: BTreeMap<String, Vec<u8>>,
    costs: Vec<String>,
    wrong: Vec<String>,
    done: Option<String>,
}

impl Site for Shown {
    fn respond(&mut self, path: &str, body: &str) -> Answer {
        if let Some(name) = path.strip_prefix("/picture/") {
            match bytes(body) {
                Some(pixels) => drop(self.pictures.insert(name.to_owned(), pixels)),
                None => self.wrong.push(format!("{name} is no picture")),
            }
            return Answer::plain("");
        }
        match path {
            "/" => return Answer::of("text/html; charset=utf-8", PAGE),
            "/vastex_browser.js" => return Answer::of("text/javascript", self.script.clone()),
            "/vastex_browser_bg.wasm" => return Answer::of("application/wasm", self.program.clone()),
            "/container" => return Answer::of("application/octet-stream", self.container.clone()),
            "/cost" => self.costs.push(body.to_owned()),
            "/wrong" => self.wrong.push(body.to_owned()),
            "/done" => self.done = Some(body.to_owned()),
            _ => return Answer::missing(),
        }
        Answer::plain("")
    }

    fn is_done(&self) -> bool {
        self.done.is_some()
    }
}

/// Bytes of two digits each.
fn bytes(digits: &str) -> Option<Vec<u8>> {
    let digit = |code: &u8| char::from(*code).to_digit(16).map(|digit| digit as u8);
    let pairs = digits.as_bytes().chunks(2).map(|pair| match pair {
        [high, low] => Some((digit(high)? << 4) | digit(low)?),
        _ => None,
    });
    pairs.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_what_was_posted() {
        assert_eq!(bytes("00ff10"), Some(vec![0, 255, 16]));
        assert_eq!((bytes("0"), bytes("0g"), bytes("")), (None, None, Some(Vec::new())));
    }

    #[test]
    fn pictures_that_differ_are_told_apart() {
        let (one, other) = ([0, 10, 20, 255, 9, 9, 9, 255], [0, 10, 20, 255, 9, 13, 9, 255]);
        assert_eq!(compare(&one, &other).unwrap(), Apart { most: 4, equal: 50.0 });
        assert!(compare(&one, &other[..4]).is_err() && compare(&[], &[]).is_err());
    }

    /// The program in the browser and what writes its JavaScript must be of one version.
    #[test]
    fn the_workspace_and_the_tool_have_one_version_of_wasm_bindgen() {
        let version = |lock: &str| {
            let text = fs::read_to_string(shell::root().join(lock)).unwrap();
            let mut lines = text.lines().skip_while(|line| *line != "name = \"wasm-bindgen-shared\"");
            lines.nth(1).unwrap().to_owned()
        };
        assert_eq!(version("Cargo.lock"), version("xtask/bindgen/Cargo.lock"));
    }
}
