//! Colour profiles: what a file says of its colours, and its rows in sRGB.
//!
//! | file | where |
//! |---|---|
//! | JPEG, TIFF | an ICC profile |
//! | PNG | code points (`cICP`), else an ICC profile, else a gamma and primaries (`gAMA`, `cHRM`) |
//!
//! Readers only say what is there; [`in_srgb`] follows it, for pictures. A profile is judged by what it does:
//! one that leaves colours as they are is sRGB, whatever its name, and one that leaves greys as they are when
//! the result is light is linear. The arithmetic is that of `moxcms`, without its paths for single
//! processors, so the bytes are the same on all.

mod managed;
mod meaning;

use std::sync::Arc;

use crate::image::{Notice, PixelFormat};

pub use managed::in_srgb;

/// What a file says of its colours, if they may be other than sRGB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Profile(Stored);

/// A profile as the file has it.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Stored {
    /// An ICC profile; no bytes where its parts do not fit together.
    Icc(Arc<[u8]>),
    /// What PNG's `gAMA` and `cHRM` say.
    Curve {
        /// The exponent that led from light to what is stored, times 100,000.
        gamma: Option<u32>,
        /// x and y of white, red, green and blue, times 100,000.
        chromaticities: Option<[[u32; 2]; 4]>,
    },
    /// The numbers of primaries and transfer curve in ITU-T H.273, as in PNG's `cICP`.
    CodePoints {
        primaries: u8,
        transfer: u8,
        /// True if the samples are red, green and blue over their full range.
        is_plain: bool,
    },
}

impl Profile {
    /// The profile's name: that of an ICC profile, or what a file says instead of one.
    pub fn name(&self) -> String {
        match self.meaning() {
            Ok(meaning) => meaning.name,
            Err(no_meaning) => no_meaning.name,
        }
    }

    /// What there is to say where the numbers of an image of that kind are taken as they are; `None` if
    /// the profile would not change them.
    pub(crate) fn left(&self, format: PixelFormat, why: &'static str) -> Option<Notice> {
        let is_followed = self.meaning().is_ok_and(|meaning| managed::changes_nothing(&meaning, format));
        (!is_followed).then(|| Notice::ProfileIgnored { name: self.name(), why })
    }

    /// Bytes that are kept of it.
    fn bytes(&self) -> u64 {
        match &self.0 {
            Stored::Icc(bytes) => bytes.len() as u64,
            _ => 0,
        }
    }

    pub(crate) fn icc(bytes: impl Into<Arc<[u8]>>) -> Profile {
        Profile(Stored::Icc(bytes.into()))
    }

    /// `None` if PNG's chunks say nothing.
    pub(super) fn curve(gamma: Option<u32>, chromaticities: Option<[[u32; 2]; 4]>) -> Option<Profile> {
        (gamma.is_some() || chromaticities.is_some())
            .then_some(Profile(Stored::Curve { gamma, chromaticities }))
    }

    pub(super) fn code_points(primaries: u8, transfer: u8, is_plain: bool) -> Profile {
        Profile(Stored::CodePoints { primaries, transfer, is_plain })
    }
}
