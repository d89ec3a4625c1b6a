//! What is wrong with an input file, and what the reader of the message can do about it.
//!
//! Which file it is, whoever opened it adds.

use std::io;
use std::path::PathBuf;

use vastex_tiles::read_advice;

/// What is wrong with an input file.
#[derive(Debug, thiserror::Error)]
pub enum InputFault {
    /// The file cannot be opened or read.
    #[error("{}", unreadable(.0))]
    Io(io::Error),
    /// Whoever opened the input wants it no more.
    #[error("is not wanted any more")]
    BrokenOff,
    /// The input is a device or a pipe, which may never end.
    #[error("is a device or a pipe; name an image file")]
    NotAFile,
    /// The input is a directory without tiles.
    #[error(
        "no tile layout recognised in this directory; name an image file, the directory of tiles itself, or its .dzi or .ctx file"
    )]
    Directory,
    /// The input is a file where the tiles of a directory are asked for.
    #[error("holds no tiles; make a container of an image first: `vastex build IMAGE -o IMAGE.vastex`")]
    NoTiles,
    /// The input is a tile directory, or a part of one, that is not laid out as its readers expect.
    #[error("{why}; {remedy}")]
    Layout {
        /// What is wrong and where.
        why: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A file of a tile directory has a fault.
    #[error("{path}: {fault}", path = path.display())]
    Tile {
        /// The file in the directory.
        path: PathBuf,
        /// What is wrong with the file.
        #[source]
        fault: Box<InputFault>,
    },
    /// The file has no bytes.
    #[error("is empty; name an image file")]
    Empty,
    /// The file begins like text.
    #[error("is a text file, not an image; JPEG, PNG, TIFF, OpenEXR, raw files and mosaics can be read")]
    Text,
    /// The file is a Vastex container, which builds write and do not read.
    #[error(
        "is a Vastex container already; `vastex view` shows it, and `vastex export` makes tile directories of it"
    )]
    Container,
    /// The file is one part of a container.
    #[error("is a part of a Vastex container; join all parts with `vastex merge`")]
    Part,
    /// The file begins like no known format.
    #[error(
        "is of no known image format (it begins with {0}); convert it to JPEG, PNG, TIFF or OpenEXR, or name it NAME.raw and describe \
         its texels in NAME.raw.toml"
    )]
    UnknownFormat(String),
    /// The file ends too early.
    #[error("is truncated: it ends {place}; copy or download it again")]
    Truncated {
        /// Where in the image it ends.
        place: String,
    },
    /// The compressed data of the picture end or make no sense, and all that follows would be made up.
    #[error(
        "is damaged {place}: its data end there or make no sense, and the rest would be a guess; copy or download it again, or \
         take it as it is (--tolerant)"
    )]
    Guess {
        /// Where in the image.
        place: String,
    },
    /// The file's bytes make no sense.
    #[error("is damaged {place}: {why}; copy or download it again, or save it anew")]
    Damaged {
        /// Where in the image.
        place: String,
        /// What the decoder said.
        why: String,
    },
    /// The file is a sound image of a kind that cannot be read.
    #[error("holds {what}, which cannot be read; {remedy}")]
    Unsupported {
        /// What the file holds.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// None of the other images of a file has the name by which one is asked for.
    #[error("has no image '{name}' beside its first one; {}", list(.names))]
    NoImage {
        /// The name.
        name: String,
        /// Names of the images that the file has beside its first one.
        names: Vec<String>,
    },
    /// The image does not have the bands that are asked for.
    #[error(
        "has no bands '{bands}'; it has {count}, counted from 1: name one, or those that are red, green and blue, as in FILE:bands=3,2,1"
    )]
    NoBands {
        /// The bands asked for.
        bands: String,
        /// How many bands the image has.
        count: u16,
    },
    /// The file says that its image has no rows or no columns.
    #[error("says that it has {width}x{height} texels; an image needs at least one")]
    NoTexels {
        /// Texels per row.
        width: u64,
        /// Rows.
        height: u64,
    },
}

impl From<io::Error> for InputFault {
    /// The message says all that a person needs, so that the error is no source to be told behind it.
    fn from(error: io::Error) -> InputFault {
        InputFault::Io(error)
    }
}

impl InputFault {
    /// A tile directory, a mosaic or a raw file is not laid out as its reader expects.
    pub(crate) fn layout(why: impl Into<String>, remedy: &'static str) -> InputFault {
        InputFault::Layout { why: why.into(), remedy }
    }
}

/// Where a reader was, for messages: before row `row`, counted from 0 at the top, of `height`.
pub(crate) fn near_row(row: u32, height: u32) -> String {
    format!("near row {row} of {height}")
}

/// What a person can do about a file that the system does not give.
fn unreadable(error: &io::Error) -> String {
    match is_too_many_open(error) {
        true => format!("cannot be read: {error}; let the program open more files (`ulimit -n`)"),
        // What has a remedy says by itself what is wrong.
        false if read_advice(error) != error.to_string() => read_advice(error),
        false => format!("cannot be read: {error}"),
    }
}

/// Returns true if so many files are open that the system opens no further one, for this program or at all.
fn is_too_many_open(error: &io::Error) -> bool {
    const TOO_MANY_OPEN: [i32; 2] = [24, 23];
    cfg!(unix) && error.raw_os_error().is_some_and(|number| TOO_MANY_OPEN.contains(&number))
}

/// What other images there are.
fn list(names: &[String]) -> String {
    match names {
        [] => "there is no other".to_owned(),
        names => format!("the others are {}", names.join(", ")),
    }
}
