//! How far a reader is with what it must decode before its first row is there, and whether that is still
//! wanted.

use std::io::{self, BufRead, Read, Seek, SeekFrom};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::InputFault;

/// Parts of a whole that are told apart.
const PARTS: u32 = 1 << 16;

/// The work of a reader before its first row, as other threads see it: it decodes all of a progressive JPEG,
/// of an interlaced PNG, of an OpenEXR file of tiles, or of a picture that is stored turned. A mosaic of such
/// pictures has such work before many of its rows.
#[derive(Debug, Default)]
pub struct Beginning {
    parts: AtomicU32,
    is_broken_off: AtomicBool,
    /// What comes before it, and is half of the work.
    before: Option<Arc<Beginning>>,
    /// True if it is not of the first row alone.
    is_of_all_rows: bool,
    /// The work of a piece that is done now.
    piece: Mutex<Option<Arc<Beginning>>>,
}

impl Beginning {
    /// What follows other work.
    pub(super) fn after(before: Option<Arc<Beginning>>) -> Beginning {
        Beginning { before, ..Beginning::default() }
    }

    /// What comes before any row, of pieces that are known once it comes.
    pub(super) fn of_pieces() -> Beginning {
        Beginning { is_of_all_rows: true, ..Beginning::default() }
    }

    /// Returns true if rows after the first may take as long as that. How much of it is done is not known
    /// then.
    pub fn is_of_all_rows(&self) -> bool {
        self.is_of_all_rows
    }

    /// The work of a piece follows, if it is any.
    pub(super) fn turn_to(&self, piece: Option<Arc<Beginning>>) {
        let mut place = self.piece.lock().unwrap_or_else(PoisonError::into_inner);
        *place = piece;
        // What is broken off from here on finds the piece.
        if self.is_broken_off() {
            place.iter().for_each(|piece| piece.break_off());
        }
    }

    /// How much of it is done, from 0 to 1.
    pub fn share(&self) -> f64 {
        let own = f64::from(self.parts.load(Ordering::Relaxed)) / f64::from(PARTS);
        self.before.as_ref().map_or(own, |before| f64::midpoint(before.share(), own))
    }

    /// Has the reader end with an error, soon.
    pub fn break_off(&self) {
        self.before.iter().for_each(|before| before.break_off());
        self.is_broken_off.store(true, Ordering::Relaxed);
        let piece = self.piece.lock().unwrap_or_else(PoisonError::into_inner);
        piece.iter().for_each(|piece| piece.break_off());
    }

    /// Returns true once [`Beginning::break_off`] was called.
    pub fn is_broken_off(&self) -> bool {
        self.is_broken_off.load(Ordering::Relaxed)
    }

    /// So many bytes of all are done.
    pub(super) fn note(&self, bytes: u64, all: u64) {
        let parts = u128::from(bytes) * u128::from(PARTS) / u128::from(all.max(1));
        self.parts.store(parts.min(PARTS.into()) as u32, Ordering::Relaxed);
    }

    /// So much of all is done. Fails where nobody wants it any more.
    pub(super) fn go_on(&self, done: u64, all: u64) -> Result<(), InputFault> {
        self.check()?;
        self.note(done, all);
        Ok(())
    }

    /// Fails where nobody wants it any more.
    pub(super) fn check(&self) -> io::Result<()> {
        if self.is_broken_off() { Err(io::Error::other("it is not wanted any more")) } else { Ok(()) }
    }
}

/// A file that says how much of it was taken, and that fails where nobody wants it any more.
pub(super) struct Watched<R> {
    inner: R,
    /// Bytes of the file, and those that were taken.
    len: u64,
    taken: u64,
    beginning: Arc<Beginning>,
}

impl<R> Watched<R> {
    /// A file of so many bytes.
    pub(super) fn new(inner: R, len: u64, beginning: Arc<Beginning>) -> Watched<R> {
        Watched { inner, len, taken: 0, beginning }
    }
}

impl<R: BufRead> Read for Watched<R> {
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        let available = self.fill_buf()?;
        let count = available.len().min(buf.len());
        buf[..count].copy_from_slice(&available[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for Watched<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.beginning.check()?;
        self.inner.fill_buf()
    }

    fn consume(&mut self, bytes: usize) {
        self.taken += bytes as u64;
        self.beginning.note(self.taken, self.len);
        self.inner.consume(bytes);
    }
}

impl<R: BufRead + Seek> Seek for Watched<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.taken = self.inner.seek(to)?;
        Ok(self.taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_piece_ends_with_the_whole_whenever_that_is_broken_off() {
        let whole = Beginning::of_pieces();
        let [first, second, third] = [(); 3].map(|()| Arc::new(Beginning::default()));
        whole.turn_to(Some(first.clone()));
        whole.turn_to(Some(second.clone()));
        whole.break_off();
        assert!(whole.check().is_err() && second.check().is_err());
        assert!(first.check().is_ok(), "it was done before");
        whole.turn_to(Some(third.clone()));
        assert!(third.check().is_err());
    }

    #[test]
    fn what_is_taken_is_told_and_ends_where_it_is_not_wanted() {
        let beginning = Arc::new(Beginning::default());
        let mut taken = Watched::new(&[7; 100][..], 100, beginning.clone());
        let mut some = [0; 25];
        taken.read_exact(&mut some).unwrap();
        assert!(some == [7; 25] && (beginning.share() - 0.25).abs() < 1e-3);
        beginning.break_off();
        assert!(taken.read_exact(&mut some).is_err());
    }
}
