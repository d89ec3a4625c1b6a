//! Runs the test programs of the workspace, two at a time, each within a limit.
//!
//! Cargo runs one after the other, and each has tests at its end that leave all but one processor idle. On
//! two processors, from an empty target directory, the step took 980 s so and 1,028 s in cargo's order. What
//! a program prints comes in one piece when it has ended.

use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use xtask::limited::within;

use crate::shell;

const AT_ONCE: usize = 2;
/// What no test program takes on any machine; the longest takes five minutes on two busy processors. One that
/// hangs is killed then: the tests are named that had not ended, and what it had printed is shown.
pub(crate) const LIMIT: Duration = Duration::from_secs(10 * 60);

/// A program that cargo has compiled.
pub(crate) struct Program {
    path: PathBuf,
    /// The package that it is of, in which its tests run.
    package: PathBuf,
    /// The file that cargo says it is made of.
    source: String,
    bytes: u64,
}

/// Compiles all tests and examples of the workspace, in one invocation, so that features unify and nothing is
/// compiled twice, and runs all test programs and the examples of the documentation. `prepare` sets what each
/// is run with.
pub(crate) fn run(prepare: impl Fn(&mut Command) + Sync) -> Result<()> {
    let mut programs = compiled()?;
    // What is largest mostly takes longest, and nothing long should be left for the end.
    programs.sort_by_key(|program| std::cmp::Reverse(program.bytes));
    let (waiting, failed) = (Mutex::new(VecDeque::from(programs)), Mutex::new(Vec::new()));
    thread::scope(|scope| {
        for _ in 0..AT_ONCE {
            scope.spawn(|| {
                let next = || locked(&waiting).pop_front();
                while let Some(program) = next() {
                    if let Err(error) = program.run(&prepare) {
                        locked(&failed).push(format!("{error:#}"));
                    }
                }
            });
        }
    });
    let mut failed = failed.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut examples = shell::cargo("test");
    examples.args(["--workspace", "--doc", "--no-fail-fast"]);
    prepare(&mut examples);
    failed.extend(shell::run(&mut examples).err().map(|error| format!("{error:#}")));
    match failed.as_slice() {
        [] => Ok(()),
        failed => bail!("{}", failed.join("; ")),
    }
}

/// Compiles all tests and examples of the workspace and names the test programs.
pub(crate) fn compiled() -> Result<Vec<Program>> {
    let mut compile = shell::cargo("test");
    compile.args(["--workspace", "--no-run"]).env("CARGO_TERM_COLOR", "never");
    let said = shell::run_with_stderr(&mut compile)?;
    let programs: Vec<Program> = said.iter().filter_map(|line| program(line)).collect::<Result<_>>()?;
    if programs.is_empty() {
        bail!("cargo has named no test program; what it says has changed");
    }
    Ok(programs)
}

impl Program {
    /// The package that it is of, as a path from the root.
    pub(crate) fn of(&self) -> &Path {
        shown(&self.package)
    }

    /// The names of its tests, but of those that are ignored.
    pub(crate) fn tests(&self) -> Result<Vec<String>> {
        let ignored = self.listed(&["--list", "--ignored"])?;
        let mut tests = self.listed(&["--list"])?;
        tests.retain(|test| !ignored.contains(test));
        Ok(tests)
    }

    fn listed(&self, options: &[&str]) -> Result<Vec<String>> {
        let listed = within(self.command().args(options), LIMIT)?;
        if !listed.status.success() {
            let said = String::from_utf8_lossy(&listed.stderr).into_owned();
            bail!(
                "{} of {} does not list its tests ({}): {said}",
                self.source,
                self.of().display(),
                listed.status
            );
        }
        let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
        Ok(listed.lines().filter_map(|line| line.strip_suffix(": test")).map(str::to_owned).collect())
    }

    /// A command that runs one of its tests alone.
    pub(crate) fn alone(&self, test: &str) -> Command {
        let mut command = self.command();
        command.args(["--exact", test]);
        command
    }

    fn command(&self) -> Command {
        let mut command = Command::new(&self.path);
        command.current_dir(&self.package);
        shell::forget_package(&mut command);
        command
    }

    fn run(&self, prepare: &(impl Fn(&mut Command) + Sync)) -> Result<()> {
        let mut command = self.command();
        prepare(&mut command);
        let (begun, name) =
            (Instant::now(), format!("{} of {}", self.source, shown(&self.package).display()));
        println!("== {name} begins ==");
        let ended = within(&mut command, LIMIT).map_err(|error| {
            let what = match &running(&format!("{error:#}"))[..] {
                [] => name.clone(),
                tests => format!("{name}, at work on {}", tests.join(", ")),
            };
            error.context(what)
        })?;
        let all = [&ended.stdout[..], &ended.stderr].concat();
        // In one piece, whatever else is printed meanwhile.
        print!("\n== {name}, {:.0} s ==\n{}", begun.elapsed().as_secs_f64(), String::from_utf8_lossy(&all));
        if !ended.status.success() {
            bail!("{name} failed: {}", ended.status);
        }
        Ok(())
    }
}

/// The tests that a program had begun and not ended, by what the harness prints: of tests beside each other
/// their names once they run for a minute, of tests one after the other each name before its result.
fn running(printed: &str) -> Vec<&str> {
    let mut running = Vec::new();
    for told in printed.lines().filter_map(|line| line.strip_prefix("test ")) {
        if let Some(name) = told.strip_suffix(" has been running for over 60 seconds") {
            running.push(name);
        } else if let Some((name, result)) = told.split_once(" ... ") {
            running.retain(|other| *other != name);
            if !["ok", "FAILED", "ignored"].iter().any(|end| result.starts_with(end)) {
                running.push(name);
            }
        }
    }
    running
}

/// The program that a line of cargo's names, as in `Executable tests/suite.rs
/// (target/debug/deps/suite-0123)`, if it names any.
fn program(line: &str) -> Option<Result<Program>> {
    let named = line.trim_start().strip_prefix("Executable ")?.strip_suffix(')')?;
    let (what, path) = named.split_once(" (")?;
    let source = what.strip_prefix("unittests ").unwrap_or(what).to_owned();
    let path = shell::root().join(path);
    Some(package(&path, &source).and_then(|package| {
        let bytes = fs::metadata(&path)?.len();
        Ok(Program { path, package, source, bytes })
    }))
}

/// The package of a program, by the list of files that the compiler leaves beside it.
fn package(program: &Path, source: &str) -> Result<PathBuf> {
    let list = program.with_extension("d");
    let text = fs::read_to_string(&list).with_context(|| list.display().to_string())?;
    let package = package_of(&text, source);
    let package = package.with_context(|| format!("{}: does not begin with {source}", list.display()))?;
    Ok(shell::root().join(package))
}

/// The package of a list of files: the first of Rust is the one that cargo named. Clippy's compiler names its
/// settings before that.
fn package_of<'a>(list: &'a str, source: &str) -> Option<&'a str> {
    let mut files = list.lines().next()?.split_once(": ")?.1.split(' ');
    files.find(|file| file.ends_with(".rs"))?.strip_suffix(source)
}

fn shown(package: &Path) -> &Path {
    package.strip_prefix(shell::root()).unwrap_or(package)
}

fn locked<T>(shared: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_that_had_not_ended_are_named() {
        let beside = "running 3 tests\ntest a::one ... ok\ntest b has been running for over 60 seconds\n\
                      test c has been running for over 60 seconds\ntest c ... FAILED\ntest d ... ignored, why\n";
        assert_eq!(running(beside), ["b"]);
        assert_eq!(running("test a ... ok\ntest b - should panic ... ok\ntest c ... "), ["c"]);
        assert!(running("error: it printed nothing").is_empty());
    }

    #[test]
    fn a_package_is_found_by_either_compiler() {
        let source = "tests/suite/main.rs";
        for first in ["", "/a/clippy.toml "] {
            let list = format!("/a/suite-0.d: {first}crates/b/{source} crates/b/tests/suite/c.rs\n\nd:\n");
            assert_eq!(package_of(&list, source), Some("crates/b/"), "{list}");
            assert_eq!(package_of(&list, "src/lib.rs"), None);
        }
        assert_eq!(package_of("", source), None);
    }

    #[test]
    #[ignore = "only that it is ignored matters"]
    fn an_ignored_test() {}

    #[test]
    fn a_program_is_found_with_its_package() {
        let path = std::env::current_exe().unwrap();
        let line = format!("  Executable unittests src/lib.rs ({})", path.display());
        // This very program is of the library or of the program of the package.
        let line =
            if package(&path, "src/lib.rs").is_ok() { line } else { line.replace("lib.rs", "main.rs") };
        let program = program(&line).unwrap().unwrap();
        assert_eq!((&program.path, &program.package), (&path, &shell::root().join("xtask")));
        assert!(program.bytes > 0 && shown(&program.package) == Path::new("xtask"));
        // Of its tests one is ignored, which is not listed.
        let tests = program.tests().unwrap();
        let is_listed =
            |name: &str| tests.iter().any(|test| test == &format!("test_programs::tests::{name}"));
        assert!(
            is_listed("a_program_is_found_with_its_package") && !is_listed("an_ignored_test"),
            "{tests:?}"
        );
        let no_harness = Program { path: PathBuf::from("rustc"), ..program };
        assert!(no_harness.tests().unwrap_err().to_string().contains("does not list its tests"));
        assert!(super::program("   Compiling vastex v0.1.0").is_none());
        assert!(super::program("  Executable tests/gone.rs (target/debug/deps/gone-0)").unwrap().is_err());
    }
}
