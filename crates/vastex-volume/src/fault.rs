//! What can be wrong with a volume: the path where it is wrong, what it is, and what to do.

/// Why a volume, or a part of it, cannot be read, or what is made of it cannot be kept.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {fault}")]
pub struct VolumeError {
    /// The file, or the key below the directory or archive that was opened.
    pub path: String,
    /// What is wrong there.
    pub fault: VolumeFault,
}

/// What went wrong with what a [`crate::VolumeSource`] reads and makes for itself, and what became of it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SourceFault {
    /// Voxels cannot be read.
    #[error("{0}; what else can be read, or the fill value, stands for it")]
    Voxels(VolumeError),
    /// Made levels cannot be kept in the directory that was given for them.
    #[error("{0}; levels that are made are kept in memory from here on")]
    Directory(VolumeError),
}

impl SourceFault {
    /// What went wrong, and where.
    pub fn error(&self) -> &VolumeError {
        let (SourceFault::Voxels(error) | SourceFault::Directory(error)) = self;
        error
    }
}

/// What is wrong.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VolumeFault {
    /// The system refuses a read.
    #[error("cannot be read: {0}")]
    Read(String),
    /// The system refuses to write.
    #[error("cannot be written: {0}")]
    Write(String),
    /// There is nothing that is read as a volume.
    #[error("{0}")]
    NoVolume(String),
    /// What is stored contradicts itself, or ends too early.
    #[error("{0}")]
    Damaged(String),
    /// The volume is stored in a way that is not read.
    #[error("{0}")]
    Unsupported(String),
    /// Reading the volume would take more memory than is allowed.
    #[error("{0}")]
    TooLarge(String),
    /// What was asked for is not in the volume.
    #[error("{0}")]
    Request(String),
}

impl VolumeError {
    /// An error at a path.
    pub(crate) fn new(path: impl Into<String>, fault: VolumeFault) -> VolumeError {
        // Parts of the path may be names that metadata give.
        VolumeError { path: printable(&path.into()), fault }
    }
}

impl VolumeFault {
    /// Returns true if there is no volume at all, rather than a faulty one.
    pub fn is_no_volume(&self) -> bool {
        matches!(self, VolumeFault::NoVolume(_))
    }

    /// The fault, with the place where it is.
    pub(crate) fn at(self, path: impl Into<String>) -> VolumeError {
        VolumeError::new(path, self)
    }
}

/// What is said where a file is not there that was there before.
pub(crate) const VANISHED: &str =
    "it was there when the volume was opened, and is gone; put it back, or the disk that it lies on";

/// What is stored contradicts itself.
pub(crate) fn damaged(what: impl Into<String>) -> VolumeFault {
    VolumeFault::Damaged(what.into())
}

/// The volume is stored in a way that is not read.
pub(crate) fn unsupported(what: impl Into<String>) -> VolumeFault {
    VolumeFault::Unsupported(what.into())
}

/// Things that are told of one volume.
const MOST_ODDITIES: usize = 200;

/// What was wrong without keeping a volume from being read. The first 200 are kept and the others counted,
/// so that metadata which are odd everywhere take no memory for it.
#[derive(Debug, Default)]
pub(crate) struct Oddities {
    said: Vec<String>,
    left: usize,
}

impl Oddities {
    /// Keeps one, or counts it.
    pub(crate) fn push(&mut self, oddity: String) {
        match self.said.len() < MOST_ODDITIES {
            true => self.said.push(oddity),
            false => self.left += 1,
        }
    }

    /// Keeps those that there is room for, and counts the others.
    pub(crate) fn extend(&mut self, oddities: impl IntoIterator<Item = String>) {
        oddities.into_iter().for_each(|oddity| self.push(oddity));
    }

    /// Oddities that were kept, and how many more there were.
    pub(crate) fn into_vec(mut self) -> Vec<String> {
        if self.left > 0 {
            self.said.push(format!("and {} more", self.left));
        }
        self.said
    }
}

/// A text of others as it may be shown: control characters, which a terminal would obey, are replaced.
pub(crate) fn printable(text: &str) -> String {
    text.chars().map(|one| if one.is_control() { char::REPLACEMENT_CHARACTER } else { one }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oddities_without_end_take_no_memory() {
        let mut oddities = Oddities::default();
        oddities.extend((0..1000).map(|n| n.to_string()));
        assert_eq!(oddities.said.len(), MOST_ODDITIES);
        let said = oddities.into_vec();
        assert_eq!((said[199].as_str(), said[200].as_str(), said.len()), ("199", "and 800 more", 201));
    }

    #[test]
    fn errors_have_no_control_characters() {
        let error = damaged("is odd").at("a\x1b]0;b\u{7}");
        assert_eq!(error.to_string(), "a\u{fffd}]0;b\u{fffd}: is odd");
    }
}
