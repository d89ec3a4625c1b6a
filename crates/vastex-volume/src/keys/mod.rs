//! Bytes under keys: where the files of a Zarr hierarchy lie.
//!
//! A [`KeyStore`] is read by ranges of the value of a key, so that a directory, an archive and, later, a
//! server are read by the same code. A key that is not there is an answer, not an error: an absent chunk has
//! the fill value.

mod directory;
mod positioned;
mod zip;
mod zip_directory;
#[cfg(test)]
mod zip_written;

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;

use bytes::Bytes;

use crate::fault::{VolumeError, VolumeFault, damaged};
use crate::spare::Spare;
pub(crate) use directory::Directory;
pub(crate) use zip::{Zip, is_zip};
#[cfg(test)]
pub(crate) use zip_written::{Packing, archive};

/// Which bytes of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Span {
    /// All, refused where there are more than so many.
    Whole {
        /// Bytes at most.
        most: u64,
    },
    /// Exactly `len` bytes from `offset` on; a value that ends before is damaged.
    Range {
        /// First byte.
        offset: u64,
        /// Number of bytes.
        len: usize,
    },
    /// Exactly the last so many bytes.
    Last(usize),
}

/// A read or a listing under way.
pub(crate) type KeyFuture<'a, T> = Pin<Box<dyn Future<Output = Result<T, VolumeError>> + Send + 'a>>;

/// Values by keys, which are names with slashes between them. Shared by threads.
pub(crate) trait KeyStore: Send + Sync {
    /// The directory or the archive, for messages.
    fn name(&self) -> &str;

    /// Memory for what is read of it, and for what is made of that.
    fn spare(&self) -> &Arc<Spare>;

    /// Bytes of a value; `None` if there is no such key.
    fn read<'a>(&'a self, key: &'a str, span: Span) -> KeyFuture<'a, Option<Bytes>>;

    /// Hands out the keys of values below a prefix, without it, at any depth, at most `most` of them. Returns
    /// whether there are more. Names that have others below them may be handed out, too.
    fn list<'a>(
        &'a self,
        prefix: &'a str,
        most: usize,
        found: &'a mut (dyn FnMut(&str) + Send),
    ) -> KeyFuture<'a, bool>;

    /// Returns true if all keys are in memory, so that a listing reads nothing.
    fn is_listed(&self) -> bool;

    /// Bytes that are read, or inflated, for a part of a value that has so many; none where the value is
    /// refused before it is read.
    fn bytes_for_part(&self, _key: &str, len: u64) -> u64 {
        len
    }

    /// The names right below a prefix that have something below them in turn, in order: those among the first
    /// `most` names that the store finds, whichever these are. More are not looked at.
    fn groups<'a>(&'a self, prefix: &'a str, most: usize) -> KeyFuture<'a, Vec<String>>;
}

/// A key below another.
pub(crate) fn join(prefix: &str, key: &str) -> String {
    match (prefix.trim_matches('/'), key.trim_matches('/')) {
        ("", key) => key.into(),
        (prefix, "") => prefix.into(),
        (prefix, key) => format!("{prefix}/{key}"),
    }
}

/// Where a key lies, for messages.
pub(crate) fn shown(keys: &dyn KeyStore, key: &str) -> String {
    match key {
        "" => keys.name().into(),
        key => format!("{}/{key}", keys.name().trim_end_matches('/')),
    }
}

/// The parts of a key, or nothing where one of them leads elsewhere: metadata of others may name any path.
pub(crate) fn parts(key: &str) -> Option<Vec<&str>> {
    let parts: Vec<&str> = key.split('/').filter(|part| !part.is_empty() && *part != ".").collect();
    let leads_away = |part: &&str| *part == ".." || part.contains(['\\', '\0']) || part.ends_with(':');
    (!parts.iter().any(leads_away)).then_some(parts)
}

/// The bounds of a span within a value of so many bytes.
pub(crate) fn bounds(span: Span, len: u64) -> Result<(u64, usize), VolumeFault> {
    match span {
        Span::Whole { most } if len > most => Err(VolumeFault::TooLarge(format!(
            "has {len} bytes, where at most {most} can be right; is it what it is named?"
        ))),
        Span::Whole { .. } => Ok((0, usize::try_from(len).map_err(|_| damaged("is too long"))?)),
        Span::Range { offset, len: wanted } => match offset.checked_add(wanted as u64) {
            Some(end) if end <= len => Ok((offset, wanted)),
            _ => Err(damaged(format!(
                "has {len} bytes, where {wanted} at {offset} are said to lie: it is cut off, or its index is wrong"
            ))),
        },
        Span::Last(wanted) => match len.checked_sub(wanted as u64) {
            Some(offset) => Ok((offset, wanted)),
            None => {
                Err(damaged(format!("has {len} bytes, less than the {wanted} of its index: it is cut off")))
            }
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_lead_nowhere_else() {
        assert_eq!(parts("scale0/stent ü"), Some(vec!["scale0", "stent ü"]));
        assert_eq!(parts("/a//./b/"), Some(vec!["a", "b"]));
        for bad in ["../a", "a/../../b", "a\\b", "c:/a", "a\0"] {
            assert_eq!(parts(bad), None, "{bad:?}");
        }
    }

    #[test]
    fn spans_stay_within_values() {
        assert_eq!(bounds(Span::Range { offset: 3, len: 4 }, 7), Ok((3, 4)));
        assert_eq!(bounds(Span::Last(4), 7), Ok((3, 4)));
        for bad in
            [Span::Range { offset: 4, len: 4 }, Span::Range { offset: u64::MAX, len: 4 }, Span::Last(8)]
        {
            assert!(bounds(bad, 7).is_err(), "{bad:?}");
        }
        assert!(bounds(Span::Whole { most: 6 }, 7).is_err());
    }
}
