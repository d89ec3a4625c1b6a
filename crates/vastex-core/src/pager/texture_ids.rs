//! The numbers of textures, and of groups: who has which, and when one may be given again.
//!
//! A number is in exactly one state. That of a texture which was removed waits until nothing can name the old
//! one any more: neither feedback that is under way nor a load that the loader has yet to answer.
//!
//! | from | to | when |
//! |---|---|---|
//! | free | taken, grouped | a texture or a group is added |
//! | taken, grouped | leaving | it is removed |
//! | leaving | free | every load has ended, and no feedback is under way from before |

use crate::table::pool::PoolId;
use crate::texture::page::TextureNumber;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Free,
    Taken(PoolId),
    /// By a group.
    Grouped,
    /// `since` is the newest frame whose feedback may name the texture.
    Leaving {
        pool: Option<PoolId>,
        since: u64,
        loads: u32,
    },
}

/// Which numbers of textures and groups are taken, and when one may be given again.
#[derive(Clone, Debug, Default)]
pub(crate) struct TextureIds {
    states: Vec<State>,
    leaving: u32,
}

impl TextureIds {
    /// The lowest number that is free.
    pub(crate) fn first_free(&self) -> Option<TextureNumber> {
        let free = self.states.iter().position(|state| *state == State::Free);
        TextureNumber::new(u16::try_from(free.unwrap_or(self.states.len())).ok()?)
    }

    /// Gives a number that is free to a texture of a pool.
    pub(crate) fn take(&mut self, texture: TextureNumber, pool: PoolId) {
        self.set(texture, State::Taken(pool));
    }

    /// Gives a number that is free to a group.
    pub(crate) fn take_for_group(&mut self, number: TextureNumber) {
        self.set(number, State::Grouped);
    }

    fn set(&mut self, texture: TextureNumber, state: State) {
        let number = usize::from(texture.number());
        if self.states.len() <= number {
            self.states.resize(number + 1, State::Free);
        }
        self.states[number] = state;
    }

    fn state(&self, texture: TextureNumber) -> State {
        self.states.get(usize::from(texture.number())).copied().unwrap_or(State::Free)
    }

    /// The pool of a texture that there is.
    pub(crate) fn pool_of(&self, texture: TextureNumber) -> Option<PoolId> {
        match self.state(texture) {
            State::Taken(pool) => Some(pool),
            State::Free | State::Grouped | State::Leaving { .. } => None,
        }
    }

    /// A load of the texture has ended; says in which pool, also after the texture was removed.
    pub(crate) fn load_ended(&mut self, texture: TextureNumber) -> Option<PoolId> {
        match self.states.get_mut(usize::from(texture.number()))? {
            State::Free | State::Grouped => None,
            State::Taken(pool) => Some(*pool),
            State::Leaving { pool, loads, .. } => {
                *loads = loads.saturating_sub(1);
                *pool
            }
        }
    }

    /// The texture or group was removed in frame `since`, with so many loads under way.
    pub(crate) fn leave(&mut self, texture: TextureNumber, since: u64, loads: u32) {
        let pool = self.pool_of(texture);
        if pool.is_some() || self.state(texture) == State::Grouped {
            self.states[usize::from(texture.number())] = State::Leaving { pool, since, loads };
            self.leaving += 1;
        }
    }

    /// The oldest frame whose feedback is under way, if any is: numbers that nothing names any more are free.
    pub(crate) fn free_those_left(&mut self, oldest_feedback: Option<u64>) {
        if self.leaving == 0 {
            return;
        }
        for state in &mut self.states {
            if let State::Leaving { since, loads: 0, .. } = state
                && oldest_feedback.is_none_or(|oldest| oldest > *since)
            {
                *state = State::Free;
                self.leaving -= 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_free_again_when_neither_feedback_nor_load_can_name_it() {
        let (mut numbers, pool) = (TextureIds::default(), PoolId::new(3));
        let [first, second] = [0, 1].map(|number| TextureNumber::new(number).unwrap());
        numbers.take(first, pool);
        numbers.leave(first, 10, 2);
        assert_eq!((numbers.pool_of(first), numbers.first_free()), (None, Some(second)));
        numbers.free_those_left(None);
        assert_eq!(numbers.first_free(), Some(second), "two loads are under way");
        assert_eq!([numbers.load_ended(first), numbers.load_ended(first)], [Some(pool); 2]);
        for (oldest, free) in [(9, second), (10, second), (11, first)] {
            numbers.free_those_left(Some(oldest));
            assert_eq!(numbers.first_free(), Some(free), "feedback of frame {oldest} is under way");
        }
        assert_eq!(numbers.load_ended(first), None);
    }
}
