//! The file in which a texture waits for its insets, beside the output.
//!
//! Its name ([`leftovers`]) says of which build it is and how many insets are in it, so that a build that was
//! killed can be gone on with. It belongs to whoever has claimed the output's place; where nobody goes on
//! with it, whoever builds there next removes it.

use std::path::{Path, PathBuf};

use twox_hash::XxHash3_64;
use vastex_core::Description;
use vastex_tiles::WriteError;

use crate::build::layers::{self, OpenLayer};
use crate::build::{BuildError, BuildOptions, leftovers, place};
use crate::progress::Progress;

/// Stands for all that decides the bytes of a texture with insets.
pub(super) fn fingerprint(
    layers: &[OpenLayer],
    texture: &Description,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<u64, BuildError> {
    // What their files hold is part of the fingerprint of all inputs.
    let insets: Vec<_> = options.insets.iter().map(|inset| (&inset.layer, inset.at, inset.finer)).collect();
    let filters = super::filters(layers, options)?;
    let same = layers::fingerprint(layers, options, progress)?.here;
    let all = (same, texture, filters, options.align, insets);
    Ok(XxHash3_64::oneshot(format!("{all:?}").as_bytes()))
}

/// The file of a build under way. Removed when dropped, unless the build may be resumed.
pub(super) struct Unfinished {
    output: PathBuf,
    path: PathBuf,
    fingerprint: u64,
    /// True if the texture without insets is there.
    is_built: bool,
    insets: usize,
    is_kept: bool,
}

impl Unfinished {
    /// What an interrupted build of the same fingerprint left, if `resume` says so, or nothing yet; all else
    /// is removed. The caller has claimed the output's place.
    pub(super) fn find(output: &Path, fingerprint: u64, resume: bool) -> Result<Unfinished, BuildError> {
        let output = place::resolved(output).unwrap_or_else(|| output.into());
        if !resume {
            leftovers::remove(&output);
        }
        let left = leftovers::all(&output);
        if left.iter().any(|found| found.fingerprint != fingerprint) {
            return Err(leftovers::other_build(&output));
        }
        let built = left.iter().filter(|found| found.is_whole).map(|found| found.insets).max();
        let insets = built.unwrap_or(0);
        let path = leftovers::path(&output, fingerprint, insets);
        Ok(Unfinished { output, path, fingerprint, is_built: built.is_some(), insets, is_kept: resume })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns true if the texture without insets is there.
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
        let path = leftovers::path(&self.output, self.fingerprint, self.insets + 1);
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
            // Where it was never made there is nothing to remove. A build that was killed when the texture
            // had just got its name may have left its journal.
            let _ = std::fs::remove_file(&self.path);
            leftovers::remove(&self.output);
        }
    }
}
