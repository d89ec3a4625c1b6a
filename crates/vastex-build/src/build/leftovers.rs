//! The files in which textures wait for their insets, `.NAME.FINGERPRINT-INSETS.insets` beside the output:
//! their names, and what becomes of those that interrupted builds left.

use std::path::{Path, PathBuf};

use vastex_tiles::WriteError;

use super::error::BuildError;
use super::place;

/// Refuses to go on with a build without insets where one with insets was interrupted.
pub(crate) fn refuse(output: &Path, resume: bool) -> Result<(), BuildError> {
    match resume && !all(output).is_empty() {
        true => Err(other_build(output)),
        false => Ok(()),
    }
}

/// Removes what interrupted builds with insets left beside an output, whose place the caller has claimed.
pub(crate) fn remove(output: &Path) {
    for found in all(output) {
        // What cannot be removed is in nobody's way.
        let _ = std::fs::remove_file(found.path);
    }
}

/// Why a build cannot go on with what was left beside the output.
pub(crate) fn other_build(output: &Path) -> BuildError {
    let of = "another input or other options".to_owned();
    BuildError::Output(WriteError::OtherBuild { name: output.display().to_string(), of })
}

/// Where a texture waits into which so many insets are put.
pub(crate) fn path(output: &Path, fingerprint: u64, insets: usize) -> PathBuf {
    let name = output.file_name().unwrap_or_default().to_string_lossy();
    output.with_file_name(format!(".{name}.{fingerprint:016x}-{insets}.insets"))
}

/// A file that a build with insets left, or has.
pub(crate) struct Leftover {
    pub(crate) path: PathBuf,
    /// Of the build.
    pub(crate) fingerprint: u64,
    /// Insets that are in.
    pub(crate) insets: usize,
    /// True if it is the texture, and not what was written of it so far.
    pub(crate) is_whole: bool,
}

/// All of an output's.
pub(crate) fn all(output: &Path) -> Vec<Leftover> {
    let output = place::resolved(output).unwrap_or_else(|| output.into());
    let (Some(name), Some(directory)) = (output.file_name(), output.parent()) else { return Vec::new() };
    let name = name.to_string_lossy();
    // Where the directory cannot be read, the writer says so.
    let Ok(entries) = std::fs::read_dir(directory) else { return Vec::new() };
    let found = |entry: std::fs::DirEntry| {
        let (fingerprint, insets, is_whole) = parse(&entry.file_name().to_string_lossy(), &name)?;
        Some(Leftover { path: entry.path(), fingerprint, insets, is_whole })
    };
    entries.flatten().filter_map(found).collect()
}

/// The fingerprint and the insets that a file's name tells of, if it is one of the output `of`, and whether
/// it is whole.
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
