//! A Python of the benchmarks' own, so that nothing is installed into the system's.

use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::{setup, shell};

/// What the anchors that are written in Python need, and what unpacks inputs that are kept in its formats, as
/// `pip` knows it.
const PACKAGES: [&str; 2] = ["numpy", "opencv-python-headless"];

/// The interpreter, made unless it is there.
pub(crate) fn with_packages(directory: &Path) -> Result<PathBuf> {
    with(directory, "python", &PACKAGES)
}

/// An interpreter of that name with these packages, made unless it is there.
pub(crate) fn with(directory: &Path, name: &str, packages: &[&str]) -> Result<PathBuf> {
    let home = directory.join(name);
    let python = home.join("bin/python");
    if !python.exists() {
        setup::ensure(&setup::PYTHON)?;
        println!("making a Python with {}, since the benchmark needs it", packages.join(" and "));
        shell::run(shell::command("python3").args(["-m", "venv"]).arg(&home))?;
        pip(&home, &["install", "--quiet"], packages)?;
    }
    Ok(python)
}

/// Adds a package to an interpreter that [`with`] made, unless its module is there; returns true if it is
/// there now. It may be that there is no network, or no such package for this machine.
pub(crate) fn add_if_possible(directory: &Path, name: &str, module: &str, package: &str) -> bool {
    let home = directory.join(name);
    let python = home.join("bin/python").to_string_lossy().into_owned();
    let is_there = || shell::succeeds(shell::command(&python).args(["-c", &format!("import {module}")]));
    is_there() || (pip(&home, &["install", "--quiet"], &[package]).is_ok() && is_there())
}

/// Fetches one package, as it is published, into the directory.
pub(crate) fn download(directory: &Path, package: &str) -> Result<()> {
    let into = directory.to_string_lossy();
    pip(&directory.join("python"), &["download", "--quiet", "--no-deps", "--dest", &into], &[package])
}

fn pip(home: &Path, command: &[&str], packages: &[&str]) -> Result<()> {
    let pip = home.join("bin/pip");
    shell::run(shell::command(&pip.to_string_lossy()).args(command).args(packages))
}
