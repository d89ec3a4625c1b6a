//! What `vastex render` keeps of a run in files, of images and of volumes.

use std::path::{Path, PathBuf};

use super::super::ClapArgs;

/// Files about a run.
#[derive(Clone, Debug, ClapArgs)]
pub(crate) struct RunFilesArgs {
    /// Where to write what each frame wanted, for `vastex replay`
    #[arg(long, value_name = "FILE")]
    pub(crate) record_trace: Option<PathBuf>,
    /// Where to write how each pool stood after each frame, a line for each: docs/telemetry.md names the
    /// columns
    #[arg(long, value_name = "FILE")]
    pub(crate) stats_csv: Option<PathBuf>,
    /// The same as a JSON array of objects
    #[arg(long, value_name = "FILE")]
    pub(crate) stats_json: Option<PathBuf>,
}

impl RunFilesArgs {
    /// Where each of the files is to be, if it is asked for, with what it is.
    pub(crate) fn places(&self) -> [(&'static str, Option<&Path>); 3] {
        [
            ("trace", self.record_trace.as_deref()),
            ("CSV file", self.stats_csv.as_deref()),
            ("JSON file", self.stats_json.as_deref()),
        ]
    }
}
