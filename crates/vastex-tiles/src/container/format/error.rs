//! What can be wrong with a container as a whole. A fault of one tile is a [`ReadError`](crate::ReadError).

use crate::stores::StoreError;

use super::layout::{Fields, PART_MAGIC, VERSION};

/// Why a container cannot be opened. Every message names the file, the place in it, and the remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ContainerError {
    /// The store could not be opened or read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The file is no container.
    #[error("{name}: not a Vastex container ({found}){}", remedy(found))]
    Foreign {
        /// The file or URL.
        name: String,
        /// What the file seems to be, as "it is a JPEG image".
        found: String,
    },
    /// The file is one part of a container, made with others by `vastex build --shard`.
    #[error("{name}: this is part {part} of {parts} of a container; join all parts with `vastex merge`")]
    Part {
        /// The file or URL.
        name: String,
        /// The number of the part, counted from 1, as the file states it.
        part: u32,
        /// The number of parts, as the file states it.
        parts: u32,
    },
    /// The file is of a version that this program cannot read.
    #[error(
        "{name}: the container is of version {version}, this program reads version {VERSION}; update it, or build the file again"
    )]
    Version {
        /// The file or URL.
        name: String,
        /// The file's version.
        version: u32,
    },
    /// The file needs something that this program does not know.
    #[error("{name}: {what}; update this program, or build the file again")]
    Unsupported {
        /// The file or URL.
        name: String,
        /// What this program does not know.
        what: String,
    },
    /// The file is of a volume, which is not read here.
    #[error("{name}: {what}")]
    OfVolume {
        /// The file or URL.
        name: String,
        /// What cannot be done, and what to do.
        what: String,
    },
    /// The file ends too early.
    #[error("{name}: truncated: {len} of {expected} bytes; copy it again, or build it again")]
    Truncated {
        /// The file or URL.
        name: String,
        /// Bytes that the file has.
        len: u64,
        /// Bytes that the file should have at least.
        expected: u64,
    },
    /// Bytes of the file are not those that were written.
    #[error("{name}: {place}: {fault}; copy the file anew, or build it again")]
    Damaged {
        /// The file or URL.
        name: String,
        /// Where in the file.
        place: String,
        /// What is wrong there.
        fault: String,
    },
}

impl ContainerError {
    pub(crate) fn damaged(name: &str, place: &str, fault: &str) -> ContainerError {
        ContainerError::Damaged { name: name.into(), place: place.into(), fault: fault.into() }
    }

    pub(crate) fn truncated(name: &str, len: u64, expected: u64) -> ContainerError {
        ContainerError::Truncated { name: name.into(), len, expected }
    }

    /// The error for a file that begins with `bytes`, which are not those of a container.
    pub(crate) fn foreign(name: &str, bytes: &[u8]) -> ContainerError {
        match part_of(bytes) {
            Some([part, parts]) => ContainerError::Part { name: name.into(), part, parts },
            None => ContainerError::Foreign { name: name.into(), found: guess(bytes).into() },
        }
    }
}

/// Number and count of a part, or `None` if a file that begins so is no part.
fn part_of(bytes: &[u8]) -> Option<[u32; 2]> {
    let mut fields = Fields::new(bytes.strip_prefix(&PART_MAGIC)?);
    let [_version, part, parts] = [fields.u32().ok()?, fields.u32().ok()?, fields.u32().ok()?];
    Some([part, parts])
}

/// What to do with a file that is no container: images can become one.
fn remedy(found: &str) -> &'static str {
    if found.ends_with(" image") { "; make one of it with `vastex build`" } else { "" }
}

/// What a file that begins so probably is.
fn guess(bytes: &[u8]) -> &'static str {
    const KNOWN: [(&[u8], &str); 7] = [
        (b"\x89PNG", "it is a PNG image"),
        (b"\xff\xd8\xff", "it is a JPEG image"),
        (b"II*\0", "it is a TIFF image"),
        (b"MM\0*", "it is a TIFF image"),
        (b"II+\0", "it is a BigTIFF image"),
        (b"MM\0+", "it is a BigTIFF image"),
        (b"PK\x03\x04", "it is a ZIP archive"),
    ];
    if let Some((_, what)) = KNOWN.iter().find(|(magic, _)| bytes.starts_with(magic)) {
        return what;
    }
    if bytes.iter().all(|&byte| byte == 0) {
        return "it is all zeros";
    }
    let head = &bytes[..bytes.len().min(256)];
    let is_text = |byte: &u8| matches!(byte, b'\t' | b'\n' | b'\r' | 0x20..=0x7e | 0x80..);
    if head.iter().all(is_text) && head.iter().filter(|byte| byte.is_ascii()).count() * 2 >= head.len() {
        return "it is a text file";
    }
    "of a kind that is not known"
}
