//! Memory of chunks, of files and of bricks that comes back when nobody has it any more: it is half a
//! megabyte each, again and again, and fresh memory costs as much as filling it.

use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;

/// Pieces of memory that are kept, and their bytes: as many as are decoded, put together and handed on at
/// once, about.
const MOST: usize = 32;
const MOST_BYTES: usize = 16 << 20;
/// Bytes of a piece: of less, fresh memory costs nothing to speak of.
const LEAST_OF_ONE: usize = 4 << 10;
const MOST_OF_ONE: usize = 4 << 20;

/// Memory that waits for its next use, up to 16 MiB.
#[derive(Debug, Default)]
pub(crate) struct Spare(Mutex<Vec<Piece>>);

/// A piece of memory, and who gave it: it may still be in a cache of that thread's processor, which makes it
/// dear to every other.
#[derive(Debug)]
struct Piece {
    memory: Vec<u8>,
    from: usize,
}

/// A number that no other thread has that is at work.
fn this_thread() -> usize {
    thread_local! {
        static OWN: u8 = const { 0 };
    }
    OWN.with(|own| std::ptr::from_ref(own).addr())
}

impl Spare {
    /// So many bytes with anything in them; none where there is nothing of about that size.
    pub(crate) fn take(&self, bytes: usize) -> Vec<u8> {
        if bytes < LEAST_OF_ONE {
            return Vec::new();
        }
        let fits = |piece: &Piece| (bytes..=bytes + bytes / 4).contains(&piece.memory.capacity());
        let this = this_thread();
        let found = self.with(|kept| {
            let own = kept.iter().rposition(|piece| piece.from == this && fits(piece));
            Some(kept.remove(own.or_else(|| kept.iter().position(fits))?))
        });
        let mut memory = found.map(|piece| piece.memory).unwrap_or_default();
        if memory.capacity() > 0 {
            memory.resize(bytes, 0);
        }
        memory
    }

    /// Memory that nobody needs any more.
    pub(crate) fn give(&self, memory: Vec<u8>) {
        if !(LEAST_OF_ONE..=MOST_OF_ONE).contains(&memory.capacity()) {
            return;
        }
        // The first to come make room: their sizes may be no longer asked for.
        let piece = Piece { memory, from: this_thread() };
        let gone = self.with(|kept| {
            kept.push(piece);
            let mut bytes = 0;
            let fits = |piece: &&Piece| {
                bytes += piece.memory.capacity();
                bytes <= MOST_BYTES
            };
            let stay = kept.iter().rev().take(MOST).take_while(fits).count();
            kept.drain(..kept.len() - stay).collect::<Vec<_>>()
        });
        drop(gone);
    }

    /// Values that nobody changes any more, whose memory comes back here with the last who has them.
    pub(crate) fn lend(self: &Arc<Spare>, values: Vec<u8>) -> Bytes {
        match (LEAST_OF_ONE..=MOST_OF_ONE).contains(&values.capacity()) {
            true => Bytes::from_owner(Lent { values, home: self.clone() }),
            false => values.into(),
        }
    }

    fn with<T>(&self, work: impl FnOnce(&mut Vec<Piece>) -> T) -> T {
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
        self.home.give(std::mem::take(&mut self.values));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOME: usize = 10_000;

    #[test]
    fn memory_comes_back_to_who_wants_about_as_much() {
        let spare = Arc::new(Spare::default());
        assert!(spare.take(SOME).is_empty());
        let values = spare.lend(vec![7; SOME]);
        let (also, place) = (values.clone(), values.as_ptr());
        drop(values);
        assert!(spare.take(SOME).is_empty(), "somebody has it");
        drop(also);
        assert!(spare.take(SOME + 1).is_empty() && spare.take(SOME / 2).is_empty(), "of another size");
        let again = spare.take(SOME - 100);
        assert_eq!((again.as_ptr(), again.len()), (place, SOME - 100));
        assert!(spare.take(SOME).is_empty());
        spare.give(again);
        let whole = spare.take(SOME);
        assert_eq!((whole.as_ptr(), whole.len()), (place, SOME));
    }

    #[test]
    fn each_thread_gets_its_own_again() {
        let spare = Spare::default();
        let own = vec![0; SOME];
        let place = own.as_ptr();
        spare.give(own);
        std::thread::scope(|scope| scope.spawn(|| spare.give(vec![0; SOME])).join()).unwrap();
        let again = spare.take(SOME);
        assert_eq!(again.as_ptr(), place);
        assert_eq!(spare.take(SOME).len(), SOME, "the other's, where there is none of its own");
    }

    #[test]
    fn what_waits_has_a_bound() {
        let spare = Arc::new(Spare::default());
        let lent: Vec<Bytes> = (0..3 * MOST).map(|n| spare.lend(vec![0; SOME + n])).collect();
        drop(lent);
        assert_eq!(spare.with(|kept| kept.len()), MOST);
        for size in [MOST_OF_ONE, 3 << 20, LEAST_OF_ONE] {
            (0..20).for_each(|_| drop(spare.lend(vec![0; size])));
            let bytes = spare.with(|kept| kept.iter().map(|piece| piece.memory.capacity()).sum::<usize>());
            assert!(bytes <= MOST_BYTES, "{bytes}");
            assert_eq!(spare.take(size).len(), size);
        }
        drop(spare.lend(vec![0; MOST_OF_ONE + 1]));
        drop(spare.lend(vec![0; LEAST_OF_ONE - 1]));
        assert!(spare.take(MOST_OF_ONE + 1).is_empty() && spare.take(LEAST_OF_ONE - 1).is_empty());
    }
}
