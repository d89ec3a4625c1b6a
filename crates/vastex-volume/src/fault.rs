//! What can be wrong with a volume: the path where it is wrong, what it is, and what to do.

/// Why a volume, or a part of it, cannot be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {fault}")]
pub struct VolumeError {
    /// The file, or the key below the directory or archive that was opened.
    pub path: String,
    /// What is wrong there.
    pub fault: VolumeFault,
}

/// What is wrong.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VolumeFault {
    /// The system refuses a read.
    #[error("cannot be read: {0}")]
    Read(String),
    /// There is nothing that is read as a volume.
    #[error("{0}")]
    NoVolume(String),
    /// What is stored contradicts itself, or ends too early.
    #[error("{0}")]
    Damaged(String),
    /// It is stored in a way that is not read.
    #[error("{0}")]
    Unsupported(String),
    /// Reading it would take more memory than is allowed.
    #[error("{0}")]
    TooLarge(String),
    /// What was asked for is not in the volume.
    #[error("{0}")]
    Request(String),
}

impl VolumeError {
    /// An error at a path.
    pub(crate) fn new(path: impl Into<String>, fault: VolumeFault) -> VolumeError {
        VolumeError { path: path.into(), fault }
    }
}

impl VolumeFault {
    /// Whether there is no volume at all, rather than a faulty one.
    pub fn is_no_volume(&self) -> bool {
        matches!(self, VolumeFault::NoVolume(_))
    }

    /// The fault, with the place where it is.
    pub(crate) fn at(self, path: impl Into<String>) -> VolumeError {
        VolumeError::new(path, self)
    }
}

/// What is stored contradicts itself.
pub(crate) fn damaged(what: impl Into<String>) -> VolumeFault {
    VolumeFault::Damaged(what.into())
}

/// It is stored in a way that is not read.
pub(crate) fn unsupported(what: impl Into<String>) -> VolumeFault {
    VolumeFault::Unsupported(what.into())
}
