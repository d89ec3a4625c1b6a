//! Memory of bricks that comes back when nobody has them any more: a brick is half a megabyte, and fresh
//! memory costs as much as filling it.

use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;

/// Pieces of memory that are kept: as many as are put together and handed on at once, about.
const MOST: usize = 16;
/// Bytes of the largest one that is kept.
const MOST_BYTES: usize = 4 << 20;

/// Memory of one size, waiting.
#[derive(Debug, Default)]
pub(crate) struct Spare(Mutex<Vec<Vec<u8>>>);

impl Spare {
    /// So many bytes with anything in them; fewer, none, where there is nothing of that size.
    pub(super) fn take(&self, bytes: usize) -> Vec<u8> {
        self.with(|kept| {
            let found = kept.iter().rposition(|memory| memory.len() == bytes)?;
            Some(kept.swap_remove(found))
        })
        .unwrap_or_default()
    }

    /// Values that nobody changes any more, whose memory comes back here with the last who has them.
    pub(crate) fn lend(self: &Arc<Spare>, values: Vec<u8>) -> Bytes {
        match values.len() <= MOST_BYTES {
            true => Bytes::from_owner(Lent { values, home: self.clone() }),
            false => values.into(),
        }
    }

    fn with<T>(&self, work: impl FnOnce(&mut Vec<Vec<u8>>) -> T) -> T {
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

struct Lent {
    values: Vec<u8>,
    home: Arc<Spare>,
}

impl AsRef<[u8]> for Lent {
    fn as_ref(&self) -> &[u8] {
        &self.values
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        let values = std::mem::take(&mut self.values);
        // The first to come makes room: its size may be no longer asked for.
        let gone = self.home.with(|kept| {
            let gone = (kept.len() >= MOST).then(|| kept.remove(0));
            kept.push(values);
            gone
        });
        drop(gone);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_comes_back_and_has_a_bound() {
        let spare = Arc::new(Spare::default());
        assert!(spare.take(10).is_empty());
        let values = spare.lend(vec![7; 10]);
        let (also, place) = (values.clone(), values.as_ptr());
        drop(values);
        assert!(spare.take(10).is_empty(), "somebody has it");
        drop(also);
        assert!(spare.take(9).is_empty(), "of another size");
        let again = spare.take(10);
        assert_eq!(again.as_ptr(), place);
        assert!(spare.take(10).is_empty());
        let lent: Vec<Bytes> = (0..3 * MOST).map(|n| spare.lend(vec![0; n + 1])).collect();
        drop(lent);
        assert_eq!(spare.with(|kept| kept.len()), MOST);
        drop(spare.lend(vec![0; MOST_BYTES + 1]));
        assert!(spare.take(MOST_BYTES + 1).is_empty());
    }
}
