//! What can be seen of an image while it is built or decoded: a smaller picture where there is a quick way to
//! one, else the rows that have been read.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use vastex_build::{ImageHeader, MemoryImage, Progress, RowReader};

use super::observer::OpenObserver;

/// Texels along the longer side of a preview: at least and at most, where it is read by itself, and at most,
/// where it is made of the rows that a build reads.
const READ_SIDE: u32 = 1024;
const LARGEST_READ_SIDE: u32 = 4096;
const BUILT_SIDE: u32 = 2048;
/// Rows of a preview that are read at once.
const ROWS: u32 = 64;
/// How long a preview is read at a time while another program is waited for.
const READ_TIME: Duration = Duration::from_millis(50);

/// The preview of one image, for an observer that wants one.
pub(super) struct Preview<'a> {
    path: &'a Path,
    wraps: bool,
    observer: &'a dyn OpenObserver,
    /// True if a quick way was looked for.
    is_begun: bool,
    picture: Picture,
    /// Of the image, while another program builds it.
    reader: Option<Box<dyn RowReader>>,
}

enum Picture {
    /// There is none yet.
    None,
    /// One that others fill: it is shown once there is something in it.
    Given(Arc<MemoryImage>),
    /// Rows are added to it.
    Growing(Growing),
    /// All of it is shown, or there is nothing to gain.
    Done,
}

struct Growing {
    picture: Arc<MemoryImage>,
    /// Of the image.
    size: [u32; 2],
    is_shown: bool,
}

impl Growing {
    fn push(&mut self, rows: &[u8], observer: &dyn OpenObserver) {
        self.picture.push(rows);
        if self.picture.rows() > 0 && !std::mem::replace(&mut self.is_shown, true) {
            observer.preview(&self.picture, self.size);
        }
    }
}

impl<'a> Preview<'a> {
    pub(super) fn new(path: &'a Path, wraps: bool, observer: &'a dyn OpenObserver) -> Preview<'a> {
        let picture = if observer.wants_preview() { Picture::None } else { Picture::Done };
        Preview { path, wraps, observer, is_begun: false, picture, reader: None }
    }

    /// Returns true if something is shown, or there is nothing to gain.
    pub(super) fn is_seen(&self) -> bool {
        match &self.picture {
            Picture::None | Picture::Given(_) => false,
            Picture::Growing(growing) => growing.is_shown,
            Picture::Done => true,
        }
    }

    /// Leaves what is shown as it is.
    pub(super) fn leave(&mut self) {
        self.picture = Picture::Done;
    }

    /// Has an image shown that is being decoded into memory, unless there is a quicker way or it is small.
    pub(super) fn take(&mut self, image: Arc<MemoryImage>) {
        let [width, height] = image.image_size();
        if matches!(self.picture, Picture::None) {
            self.picture = if width.max(height) > BUILT_SIDE { Picture::Given(image) } else { Picture::Done };
        }
    }

    /// Called before rows are read, and again while they are: reads a smaller picture, if there is a quick
    /// way to one. Whatever is wrong with the image is found again, and said, where all of it is read.
    pub(super) fn begin(&mut self) {
        if let Picture::Given(image) = &self.picture
            && image.rows() > 0
        {
            self.observer.preview(image, image.image_size());
            self.picture = Picture::Done;
        }
        if matches!(self.picture, Picture::Done) || std::mem::replace(&mut self.is_begun, true) {
            return;
        }
        let Ok(Some(reduced)) = vastex_build::open_reduced(self.path, READ_SIDE) else { return };
        let Ok(whole) = vastex_build::open(self.path) else { return };
        let size = [whole.header().width, whole.header().height];
        let mut reader = vastex_build::in_srgb(reduced);
        let header = reader.header().clone();
        let halvings = MemoryImage::halvings_to_side(&header, LARGEST_READ_SIDE);
        let Ok(picture) = MemoryImage::new(&header, halvings, self.wraps) else { return };
        let mut growing = Growing { picture: Arc::new(picture), size, is_shown: false };
        while self.observer.advance(0.0).is_continue() && read_rows(&mut *reader, &mut growing, self.observer)
        {
        }
        if growing.is_shown {
            self.picture = Picture::Done;
        }
    }

    /// Called again and again while another program builds the image: reads some more of it, for the preview
    /// alone.
    pub(super) fn read_on(&mut self) {
        self.begin();
        if matches!(self.picture, Picture::Done) {
            return;
        }
        if self.reader.is_none() {
            let opened = vastex_build::open_while(self.path, &|| self.observer.advance(0.0));
            self.reader = opened.ok().map(vastex_build::in_srgb);
        }
        let Some(mut reader) = self.reader.take() else { return };
        let begun = Instant::now();
        if self.grow(reader.header())
            && let Picture::Growing(growing) = &mut self.picture
        {
            let mut is_more = true;
            while is_more && begun.elapsed() < READ_TIME {
                is_more = read_rows(&mut *reader, growing, self.observer);
            }
            // One that is at its end, or at damage, is not read again.
            match is_more {
                true => self.reader = Some(reader),
                false => self.picture = Picture::Done,
            }
        }
    }

    /// Returns true if there is a picture that grows with the rows of an image.
    fn grow(&mut self, image: &ImageHeader) -> bool {
        if matches!(self.picture, Picture::None) {
            let halvings = MemoryImage::halvings_to_side(image, BUILT_SIDE);
            self.picture = match MemoryImage::new(image, halvings, self.wraps) {
                Ok(picture) if halvings > 0 => Picture::Growing(Growing {
                    picture: Arc::new(picture),
                    size: [image.width, image.height],
                    is_shown: false,
                }),
                _ => Picture::Done,
            };
        }
        matches!(self.picture, Picture::Growing(_))
    }

    /// Adds rows that were read, from the row `first` of the image on. Those that are there already are left
    /// out, as where a build begins anew.
    pub(super) fn add(&mut self, image: &ImageHeader, first: u32, rows: &[u8]) {
        // What was read while another program built it is there already.
        self.reader = None;
        if !self.grow(image) {
            return;
        }
        let Picture::Growing(growing) = &mut self.picture else { return };
        let known = growing.picture.image_rows().checked_sub(first);
        if let Some(new) = known.and_then(|known| rows.get(known as usize * image.row_bytes()..)) {
            growing.push(new, self.observer);
        }
    }
}

/// Has the work before the first row broken off where an observer wants it no more.
struct Watched<'a>(&'a dyn OpenObserver);

impl Progress for Watched<'_> {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        self.0.advance(0.0)
    }

    fn beginning(&self, _: f64) -> ControlFlow<()> {
        self.0.advance(0.0)
    }
}

/// Adds the next rows of a reader; returns true if there may be more.
fn read_rows(reader: &mut dyn RowReader, growing: &mut Growing, observer: &dyn OpenObserver) -> bool {
    let header = reader.header();
    let left = header.height - growing.picture.image_rows();
    let mut rows = vec![0; left.min(ROWS) as usize * header.row_bytes()];
    let read = match growing.picture.image_rows() {
        0 if left > 0 => vastex_build::read_first_rows(reader, &mut rows, &Watched(observer)),
        _ if left > 0 => vastex_build::read_further_rows(reader, &mut rows, &|| observer.advance(0.0)),
        _ => None,
    };
    let is_read = read.is_some_and(|read| read.is_ok());
    if is_read {
        growing.push(&rows, observer);
    }
    is_read
}
