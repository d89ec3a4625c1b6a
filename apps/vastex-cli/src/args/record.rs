//! The words of the hidden `vastex record`, which `cargo xtask record` calls.

use std::path::PathBuf;

use clap::Subcommand;

/// What is recorded of what this program does, to be compared with what another version of it does.
#[derive(Debug, Subcommand)]
pub(crate) enum RecordArgs {
    /// Decisions and events of simulated worlds, traces, sets learnt of them and replays
    Worlds {
        /// Where to write; the directory is made where there is none
        directory: PathBuf,
        /// Only those whose names begin so
        #[arg(long, default_value = "")]
        only: String,
    },
    /// Feedback, page tables and pictures
    Frames {
        /// Where to write; the directory is made where there is none
        directory: PathBuf,
        /// A file of lines, each a name and the words for `vastex render`
        cases: PathBuf,
    },
    /// What a trace's file says, on stdout
    Trace {
        /// The trace
        file: PathBuf,
    },
    /// How far two pictures of a record differ, on stdout, which stays empty if they do not
    Difference {
        /// A picture
        was: PathBuf,
        /// Another
        is: PathBuf,
    },
}
