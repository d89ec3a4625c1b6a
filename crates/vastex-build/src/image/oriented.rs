//! Pictures that are stored turned or mirrored, upright.
//!
//! Mirrored left to right is a matter of each row. For every other orientation the first upright row is made
//! of the last stored row, or of all of them, so the whole image is held.

use std::sync::Arc;

use crate::image::{Beginning, Helpers, ImageHeader, InputFault, Notice, RowReader};

/// Rows that are read at once and turned: texels of as many neighbours are written side by side.
const BAND: u32 = 32;

/// The picture of `inner`, upright.
pub(super) fn upright(inner: Box<dyn RowReader>) -> Box<dyn RowReader> {
    let mut header = inner.header().clone();
    let Some(turn) = Turn::new(header.orientation) else { return inner };
    header.notices.push(Notice::Turned(header.orientation));
    header.orientation = 1;
    if turn.transposes {
        (header.width, header.height) = (header.height, header.width);
    }
    if turn.needs_all() {
        let bytes = header.image_bytes();
        let band = u64::from(BAND) * inner.header().row_bytes() as u64;
        header.hold_whole_image(bytes, "an image that is stored turned or upside down");
        header.memory = header.memory.saturating_add(band);
    }
    let seen = inner.header().notices.len();
    let beginning = match turn.needs_all() {
        true => Some(Arc::new(Beginning::after(inner.beginning()))),
        false => inner.beginning(),
    };
    Box::new(Oriented { inner, header, turn, beginning, image: Vec::new(), next_row: 0, seen })
}

/// Returns true if a picture is stored in another position than upright.
pub(super) fn is_turned(header: &ImageHeader) -> bool {
    Turn::new(header.orientation).is_some()
}

/// What leads from the stored picture to the upright one: first mirrored, then transposed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Turn {
    /// True if the last stored column is the first.
    mirrors_x: bool,
    /// True if the last stored row is the first.
    mirrors_y: bool,
    /// True if columns become rows.
    transposes: bool,
}

impl Turn {
    /// Nothing for the upright 1, and for what is no orientation.
    fn new(orientation: u16) -> Option<Turn> {
        (2..=8).contains(&orientation).then_some(Turn {
            mirrors_x: matches!(orientation, 2 | 3 | 7 | 8),
            mirrors_y: matches!(orientation, 3 | 4 | 6 | 7),
            transposes: orientation >= 5,
        })
    }

    /// Returns true if the first row needs more than the first stored one.
    fn needs_all(self) -> bool {
        self.mirrors_y || self.transposes
    }
}

struct Oriented {
    inner: Box<dyn RowReader>,
    header: ImageHeader,
    turn: Turn,
    /// Of the first row: all that is stored, where it is needed.
    beginning: Option<Arc<Beginning>>,
    /// All rows, upright, once the first is asked for, where they are needed.
    image: Vec<u8>,
    next_row: u32,
    /// Notices of `inner` that are among the own ones.
    seen: usize,
}

impl Oriented {
    /// Reads all that is stored, and puts it where it belongs.
    fn load(&mut self) -> Result<(), InputFault> {
        let len = usize::try_from(self.header.image_bytes()).map_err(|_| too_large())?;
        self.image.try_reserve_exact(len).map_err(|_| too_large())?;
        self.image.resize(len, 0);
        let (row_bytes, height) = (self.inner.header().row_bytes(), self.inner.header().height);
        let mut band = vec![0; BAND.min(height) as usize * row_bytes];
        for first in (0..height).step_by(BAND as usize) {
            if let Some(beginning) = &self.beginning {
                beginning.go_on(first.into(), height.into())?;
            }
            let rows = &mut band[..BAND.min(height - first) as usize * row_bytes];
            self.inner.read_rows(rows)?;
            match self.turn.transposes {
                true => self.place_columns(rows, first),
                false => self.place_rows(rows, first),
            }
        }
        self.beginning.iter().for_each(|beginning| beginning.note(1, 1));
        Ok(())
    }

    /// Puts stored rows, from row `first` on, where they belong as rows.
    fn place_rows(&mut self, rows: &[u8], first: u32) {
        let (row_bytes, texel) = (self.header.row_bytes(), self.header.format.texel_bytes());
        for (stored, row) in (first..).zip(rows.chunks_exact(row_bytes)) {
            let y = if self.turn.mirrors_y { self.header.height - 1 - stored } else { stored };
            let target = &mut self.image[y as usize * row_bytes..][..row_bytes];
            target.copy_from_slice(row);
            if self.turn.mirrors_x {
                mirror(target, texel);
            }
        }
    }

    /// Puts stored rows, from row `first` on, where they belong as columns.
    fn place_columns(&mut self, rows: &[u8], first: u32) {
        let (row_bytes, texel) = (self.header.row_bytes(), self.header.format.texel_bytes());
        let (stored_row_bytes, count) =
            (self.inner.header().row_bytes(), rows.len() / self.inner.header().row_bytes());
        // Stored rows that follow one another are neighbouring columns.
        let left = match self.turn.mirrors_y {
            true => self.header.width as usize - first as usize - count,
            false => first as usize,
        };
        for (y, target) in self.image.chunks_exact_mut(row_bytes).enumerate() {
            let column = if self.turn.mirrors_x { self.header.height as usize - 1 - y } else { y };
            let target = &mut target[left * texel..][..count * texel];
            for (i, to) in target.chunks_exact_mut(texel).enumerate() {
                let row = if self.turn.mirrors_y { count - 1 - i } else { i };
                to.copy_from_slice(&rows[row * stored_row_bytes + column * texel..][..texel]);
            }
        }
    }
}

impl RowReader for Oriented {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn tolerate(&mut self) {
        self.inner.tolerate();
    }

    fn memory_ahead(&self, pieces: usize) -> u64 {
        self.inner.memory_ahead(pieces)
    }

    fn beginning(&self) -> Option<Arc<Beginning>> {
        self.beginning.clone()
    }

    fn take_help(&mut self, helpers: &Helpers) {
        self.inner.take_help(helpers);
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        let (row_bytes, texel) = (self.header.row_bytes(), self.header.format.texel_bytes());
        if self.turn.needs_all() {
            if self.image.is_empty() {
                self.load()?;
            }
            rows.copy_from_slice(&self.image[self.next_row as usize * row_bytes..][..rows.len()]);
        } else {
            self.inner.read_rows(rows)?;
            rows.chunks_exact_mut(row_bytes).for_each(|row| mirror(row, texel));
        }
        self.next_row += (rows.len() / row_bytes) as u32;
        if self.next_row == self.header.height {
            self.image = Vec::new();
        }
        self.header.add_notices_of(self.inner.header(), &mut self.seen);
        Ok(())
    }
}

/// Turns a row of texels of so many bytes round.
fn mirror(row: &mut [u8], texel: usize) {
    row.reverse();
    row.chunks_exact_mut(texel).for_each(<[u8]>::reverse);
}

fn too_large() -> InputFault {
    InputFault::Unsupported {
        what: "a turned image of a size that no memory holds".into(),
        remedy: "save it upright",
    }
}
