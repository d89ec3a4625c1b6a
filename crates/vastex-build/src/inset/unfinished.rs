//! The file in which a texture waits for its insets: `.NAME.FINGERPRINT-INSETS.insets` beside the output.
//!
//! Its name says of which build it is and how many insets are in it, so that a build that was killed can be gone on with. It
//! belongs to whoever has claimed the output's place; where nobody goes on with it, whoever builds there next removes it.

use std::path::{Path, PathBuf};

use twox_hash::XxHash3_64;
use vastex_core::Description;
use vastex_tiles::WriteError;

use crate::error::BuildError;
use crate::layers::{self, OpenLayer};
use crate::{BuildOptions, place};

/// Stands for all that decides the bytes of a texture with insets.
pub(super) fn fingerprint(
    layers: &[OpenLayer],
    texture: &Description,
    options: &BuildOptions,
) -> Result<u64, BuildError> {
    // What their files hold is part of the fingerprint of all inputs.
    let insets: Vec<_> = options.insets.iter().map(|inset| (&inset.layer, inset.at, inset.finer)).collect();
    let filters = super::filters(layers, options)?;
    let same = layers::fingerprint(layers, options)?.here;
    let all = (same, texture, filters, options.align, insets);
    Ok(XxHash3_64::oneshot(format!("{all:?}").as_bytes()))
}

/// Refuses to go on with a build without insets where one with insets was interrupted.
pub(crate) fn refuse_left(output: &Path, resume: bool) -> Result<(), BuildError> {
    match resume && !left(output).is_empty() {
        true => Err(other_build(output)),
        false => Ok(()),
    }
}

/// Removes what interrupted builds with insets left beside an output, whose place the caller has claimed.
pub(crate) fn remove_left(output: &Path) {
    for found in left(output) {
        // What cannot be removed is in nobody's way.
        let _ = std::fs::remove_file(found.path);
    }
}

fn other_build(output: &Path) -> BuildError {
    let of = "another input or other options";
    BuildError::Output(WriteError::OtherBuild { name: output.display().to_string(), of })
}

/// The file of a build under way. Removed when dropped, unless the build may be resumed.
pub(super) struct Unfinished {
    output: PathBuf,
    path: PathBuf,
    fingerprint: u64,
    /// Whether the texture without insets is there.
    is_built: bool,
    insets: usize,
    is_kept: bool,
}

impl Unfinished {
    /// What an interrupted build of the same fingerprint left, if `resume` says so, or nothing yet; all else is removed. The
    /// caller has claimed the output's place.
    pub(super) fn find(output: &Path, fingerprint: u64, resume: bool) -> Result<Unfinished, BuildError> {
        let output = place::resolved(output).unwrap_or_else(|| output.into());
        if !resume {
            remove_left(&output);
        }
        let left = left(&output);
        if left.iter().any(|found| found.fingerprint != fingerprint) {
            return Err(other_build(&output));
        }
        let built = left.iter().filter(|found| found.is_whole).map(|found| found.insets).max();
        let insets = built.unwrap_or(0);
        let path = path(&output, fingerprint, insets);
        Ok(Unfinished { output, path, fingerprint, is_built: built.is_some(), insets, is_kept: resume })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the texture without insets is there.
    pub(super) fn is_built(&self) -> bool {
        self.is_built
    }

    pub(super) fn set_built(&mut self) {
        self.is_built = true;
    }

    /// Insets that are in.
    pub(super) fn insets(&self) -> usize {
        self.insets
    }

    /// One more is in. Should this name be lost, putting that inset in again changes nothing.
    pub(super) fn count_inset(&mut self) -> Result<(), BuildError> {
        let path = path(&self.output, self.fingerprint, self.insets + 1);
        std::fs::rename(&self.path, &path).map_err(|error| {
            BuildError::Output(WriteError::Io { name: self.path.display().to_string(), error })
        })?;
        (self.path, self.insets) = (path, self.insets + 1);
        Ok(())
    }

    /// It is not needed any more.
    pub(super) fn remove(mut self) {
        self.is_kept = false;
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if !self.is_kept {
            // Where it was never made there is nothing to remove.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

fn path(output: &Path, fingerprint: u64, insets: usize) -> PathBuf {
    let name = output.file_name().unwrap_or_default().to_string_lossy();
    output.with_file_name(format!(".{name}.{fingerprint:016x}-{insets}.insets"))
}

/// A file that a build with insets left, or has.
struct Left {
    path: PathBuf,
    fingerprint: u64,
    insets: usize,
    /// Whether it is the texture, and not what was written of it so far.
    is_whole: bool,
}

/// All of an output's.
fn left(output: &Path) -> Vec<Left> {
    let output = place::resolved(output).unwrap_or_else(|| output.into());
    let (Some(name), Some(directory)) = (output.file_name(), output.parent()) else { return Vec::new() };
    let name = name.to_string_lossy();
    // Where the directory cannot be read, the writer says so.
    let Ok(entries) = std::fs::read_dir(directory) else { return Vec::new() };
    let found = |entry: std::fs::DirEntry| {
        let (fingerprint, insets, is_whole) = parse(&entry.file_name().to_string_lossy(), &name)?;
        Some(Left { path: entry.path(), fingerprint, insets, is_whole })
    };
    entries.flatten().filter_map(found).collect()
}

/// The fingerprint and the insets that a file's name tells of, if it is one of the output `of`, and whether it is whole.
fn parse(name: &str, of: &str) -> Option<(u64, usize, bool)> {
    let suffixes = [(".insets", true), (".insets.partial", false), (".insets.journal", false)];
    let (rest, is_whole) =
        suffixes.iter().find_map(|(suffix, is_whole)| Some((name.strip_suffix(suffix)?, *is_whole)))?;
    // What a writer writes beside a file has one more dot in front.
    let rest = if is_whole { rest } else { rest.strip_prefix('.')? };
    let (fingerprint, insets) =
        rest.strip_prefix('.')?.strip_prefix(of)?.strip_prefix('.')?.split_once('-')?;
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    if fingerprint.len() != 16 || !digits(fingerprint) || !digits(insets) {
        return None;
    }
    Some((u64::from_str_radix(fingerprint, 16).ok()?, insets.parse().ok()?, is_whole))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_told_by_their_names() {
        let own = path(Path::new("/a/b.vastex"), 0x12, 3);
        assert_eq!(own, Path::new("/a/.b.vastex.0000000000000012-3.insets"));
        let parsed = |name: &str| parse(name, "b.vastex");
        assert_eq!(parsed(".b.vastex.0000000000000012-3.insets"), Some((0x12, 3, true)));
        assert_eq!(parsed("..b.vastex.0000000000000012-0.insets.partial"), Some((0x12, 0, false)));
        assert_eq!(parsed("..b.vastex.0000000000000012-0.insets.journal"), Some((0x12, 0, false)));
        for other in [
            "b.vastex",
            ".b.vastex.partial",
            ".b.vastex.12.insets",
            ".b.vastex.0000000000000012-.insets",
            ".b.vastex.+000000000000012-3.insets",
            ".c.vastex.0000000000000012-3.insets",
            ".b.vastex.c.0000000000000012-3.insets",
            ".b.vastex.0000000000000012-3.insets.partial",
        ] {
            assert_eq!(parsed(other), None, "{other}");
        }
    }
}
