//! Lints and documentation from the compilation that the tests need anyway, where whoever calls asks for it.
//!
//! Clippy checks the workspace, and all it is made of, apart from what is compiled, and so does `cargo doc`:
//! from an empty directory that is a quarter of all that is compiled. Where cargo is told to compile the
//! workspace by Clippy's compiler ([`WRAPPER`], as `.ci/run` does), lints are found on the way, and rustdoc
//! reads what was compiled. What a developer compiles stays that of the plain compiler.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, bail};

use crate::outcome::cargo_test;
use crate::shell;

/// Names to cargo what compiles the crates of the workspace.
pub(crate) const WRAPPER: &str = "RUSTC_WORKSPACE_WRAPPER";
/// Clippy's compiler, which does all that rustc does.
const CLIPPY: &str = "clippy-driver";
/// Names to this program, where cargo calls it in rustdoc's place, the directory for the pages.
const PAGES: &str = "VASTEX_PAGES";
/// Features of the workspace that nothing but tests asks for.
const OF_TESTS: [&str; 2] = ["checks", "test-device"];

/// Returns true if the workspace is compiled by Clippy's compiler.
pub(crate) fn is_asked_for() -> bool {
    env::var_os(WRAPPER)
        .is_some_and(|wrapper| Path::new(&wrapper).file_stem().is_some_and(|name| name == CLIPPY))
}

/// Compiles every target of the workspace, and fails where a lint fires, but compiles all the same, so that
/// the steps after this one have what they need.
pub(crate) fn lint() -> Result<()> {
    let mut command = cargo_test();
    command.args(["--workspace", "--all-targets", "--no-run"]).env("CARGO_TERM_COLOR", "never");
    let said = shell::run_with_stderr(&mut command)?;
    let warned: Vec<&str> = said.iter().map(String::as_str).filter(|line| is_warned(line)).collect();
    match &*warned {
        [] => Ok(()),
        warned => bail!("lints fire:\n{}", warned.join("\n")),
    }
}

/// Returns true for a line that warns of anything, as lints do, also where nothing was compiled anew: how
/// many there are in a crate is said in words that may change.
fn is_warned(line: &str) -> bool {
    line.starts_with("warning")
}

/// Writes the pages of every library into a directory: cargo calls this program as it would call rustdoc for
/// the examples of the documentation, and so with all that was compiled.
pub(crate) fn document(pages: &Path) -> Result<()> {
    if pages.exists() {
        fs::remove_dir_all(pages).with_context(|| pages.display().to_string())?;
    }
    let libraries = libraries()?;
    // Rustdoc links to the pages of another crate where there is a directory for them.
    for library in &libraries {
        fs::create_dir_all(pages.join(library))?;
    }
    let mut command = shell::cargo("test");
    command.env("RUSTDOC", env::current_exe()?).env(PAGES, pages).env("RUSTDOCFLAGS", "-D warnings");
    shell::run(command.args(["--workspace", "--doc", "--no-fail-fast"]))?;
    match libraries.iter().find(|library| !pages.join(library).join("index.html").is_file()) {
        None => Ok(()),
        Some(library) => bail!("cargo has not had {library} documented, as it does where `doctest` is false"),
    }
}

/// The names by which Rust knows the libraries of the workspace.
fn libraries() -> Result<Vec<String>> {
    let mut packages = vec![shell::root().join("xtask")];
    for folder in ["crates", "apps"] {
        for entry in fs::read_dir(shell::root().join(folder))? {
            packages.push(entry?.path());
        }
    }
    packages.retain(|package| package.join("src/lib.rs").is_file());
    packages
        .iter()
        .map(|package| {
            let manifest = fs::read_to_string(package.join("Cargo.toml"))?;
            let name = manifest.lines().find_map(|line| line.strip_prefix("name = "));
            let name = name.with_context(|| format!("{} has no name", package.display()))?;
            Ok(name.trim_matches('"').replace('-', "_"))
        })
        .collect()
}

/// Does what rustdoc does, where cargo calls this program in its place; `None` where a person calls it.
pub(crate) fn in_place_of_rustdoc() -> Option<ExitCode> {
    let pages = env::var_os(PAGES)?;
    let manifest = env::var_os("CARGO_MANIFEST_DIR").map(|package| Path::new(&package).join("Cargo.toml"));
    let manifest = manifest.and_then(|manifest| fs::read_to_string(manifest).ok()).unwrap_or_default();
    let mut rustdoc = Command::new("rustdoc");
    let told = without_tests(env::args_os().skip(1));
    rustdoc.args(as_published(told, &dependencies(&manifest))).arg("--out-dir").arg(pages);
    let succeeds = rustdoc.status().is_ok_and(|status| status.success());
    Some(if succeeds { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// What rustdoc is told, without what makes it run examples in place of writing pages.
fn without_tests(told: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let (mut kept, mut is_value) = (Vec::new(), false);
    for word in told {
        let text = word.to_string_lossy();
        let is_of_tests = is_value || text.starts_with("--test");
        // The options but the first have a value, which is the next word.
        is_value = !is_value && is_of_tests && text != "--test" && !text.contains('=');
        if !is_of_tests {
            kept.push(word);
        }
    }
    kept
}

/// What rustdoc is told, without the crates and features that only tests have: pages are to link to what a
/// reader of the published crate has, too.
fn as_published(told: Vec<OsString>, dependencies: &[String]) -> Vec<OsString> {
    let mut kept: Vec<OsString> = Vec::new();
    let mut words = told.into_iter();
    while let Some(word) = words.next() {
        let value = match &*word.to_string_lossy() {
            "--extern" | "--cfg" => words.next(),
            _ => None,
        };
        let text = value.as_ref().map(|value| value.to_string_lossy().into_owned()).unwrap_or_default();
        let is_of_tests = match &*word.to_string_lossy() {
            "--extern" => {
                let name = text.split('=').next().unwrap_or_default();
                !dependencies.iter().any(|dependency| dependency == name)
            }
            "--cfg" => OF_TESTS.iter().any(|feature| text == format!("feature=\"{feature}\"")),
            _ => false,
        };
        if !is_of_tests {
            kept.push(word);
            kept.extend(value);
        }
    }
    kept
}

/// The names by which Rust knows what a package depends on, by its manifest, but for what its tests alone do.
fn dependencies(manifest: &str) -> Vec<String> {
    let (mut names, mut is_listed) = (Vec::new(), false);
    for line in manifest.lines().map(str::trim) {
        if line.starts_with('[') {
            is_listed = line == "[dependencies]" || line.ends_with(".dependencies]");
        } else if is_listed && let Some((name, _)) = line.split_once(['.', '=', ' ']) {
            names.push(name.replace('-', "_"));
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rustdoc_is_told_nothing_of_tests() {
        let told = |words: &str| words.split(' ').map(OsString::from).collect::<Vec<_>>();
        let all = "--crate-name a --test src/lib.rs --test-run-directory /a --test-args --quiet -L dependency=x \
                   --test-runtool=y --cfg z -D warnings";
        assert_eq!(
            without_tests(told(all).into_iter()),
            told("--crate-name a src/lib.rs -L dependency=x --cfg z -D warnings")
        );
    }

    #[test]
    fn pages_know_nothing_of_what_tests_alone_have() {
        let manifest = "[package]\nname = \"a\"\n\n[dependencies]\n# Of b alone.\nb-c.workspace = true\nd = { workspace = true }\n\n\
                        [target.'cfg(unix)'.dependencies]\ne = \"1\"\n\n[dev-dependencies]\nf.workspace = true\n";
        let known = dependencies(manifest);
        assert!(["b_c", "d", "e"].iter().all(|name| known.iter().any(|known| known == name)), "{known:?}");
        assert!(!known.iter().any(|known| known == "f" || known == "name"), "{known:?}");
        let told = |words: &str| words.split(' ').map(OsString::from).collect::<Vec<_>>();
        let all = "--extern a=/a.rlib --extern b_c=/b.rlib --cfg feature=\"checks\" --cfg feature=\"z\" --extern f=/f.rlib src/lib.rs";
        assert_eq!(
            as_published(told(all), &known),
            told("--extern b_c=/b.rlib --cfg feature=\"z\" src/lib.rs")
        );
    }

    #[test]
    fn libraries_are_those_of_the_workspace() {
        let libraries = libraries().unwrap();
        for name in ["vastex", "vastex_core", "vastex_browser", "xtask"] {
            assert!(libraries.iter().any(|library| library == name), "{name} of {libraries:?}");
        }
        assert!(!libraries.iter().any(|library| library == "vastex_cli"), "it is a program alone");
    }

    #[test]
    fn a_lint_that_fires_is_told_from_the_rest_of_what_cargo_says() {
        for line in [
            "warning: unused variable: `a`",
            "warning[E0000]: of another kind",
            "warning: `vastex` (lib) generated 1 warning",
            "warning: `vastex-core` (lib test) generated 4 warnings (run `cargo clippy --fix` to apply 1)",
        ] {
            assert!(is_warned(line), "{line}");
        }
        for line in ["   Compiling vastex v0.1.0", "  = note: `#[warn(unused)]` is on", "    Finished"] {
            assert!(!is_warned(line), "{line}");
        }
    }
}
