//! What an application wants to know, and the queue in which it waits to be asked for.

use std::collections::VecDeque;
use std::fmt;

use crate::table::pool::PoolId;
use crate::texture::page::{PageId, TextureNumber};
use crate::wanted::groups::GroupNumber;

/// Something that an application wants to know: that a picture is complete, that a pool is too small, that a
/// tile could not be had. Events wait in a queue until they are asked for, the oldest first.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Event {
    /// For a whole jitter cycle, or for as many as the answers between which the pixels of a view take turns,
    /// no page was newly wanted, and none was missing at the bias in force, in any pool. Said once, whenever
    /// it has become so; what was just added counts from its first feedback on.
    Converged {
        /// The frame.
        frame: u64,
    },
    /// The pool's working set does not fit; said when the bias rises.
    Oversubscribed {
        /// The pool.
        pool: PoolId,
        /// Pages of the working set at bias 0, with their ancestors and the pins.
        wanted: u32,
        /// Slots of the pool.
        slots: u32,
        /// Slots that hold a tile; the pool's residency is the share that they are of all.
        occupied: u32,
        /// The bias now in force, in eighths of a level.
        bias_eighths: u16,
        /// The textures that want most, at most three, largest first.
        largest: Vec<TexturePages>,
    },
    /// The device had no memory for a pool of the size that was asked for, so that it was made smaller.
    PoolReduced {
        /// The pool.
        pool: PoolId,
        /// Bytes asked for.
        asked: u64,
        /// Bytes that the pool has.
        bytes: u64,
    },
    /// The bind groups that read a pool were replaced: whoever keeps one, or a render bundle that names one,
    /// makes it anew.
    BindGroupsChanged {
        /// The pool.
        pool: PoolId,
    },
    /// A group was removed, since one of its members was.
    GroupRemoved {
        /// The group.
        group: GroupNumber,
    },
    /// A tile could not be read; reported once, until it recovers. It is tried again with back-off; its
    /// ancestor stays on screen.
    Failed {
        /// The pool of its texture.
        pool: PoolId,
        /// The page.
        page: PageId,
        /// What the page's source said.
        why: String,
    },
    /// A tile that had failed is here.
    Recovered {
        /// The pool of its texture.
        pool: PoolId,
        /// The page.
        page: PageId,
    },
    /// Nobody asked for events for so long that the oldest were dropped.
    Lost {
        /// How many.
        events: u64,
    },
}

/// One line for a log: what happened, where, and for what is too small by how much.
impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of_page = |page: &PageId| {
            format!("a page of level {} of texture {}", page.level(), page.texture().number())
        };
        match self {
            Event::Converged { frame } => write!(f, "frame {frame}: all that is wanted is there"),
            Event::Oversubscribed { pool, wanted, slots, occupied, bias_eighths, largest } => {
                write!(
                    f,
                    "pool {} is too small for what is in view: {wanted} pages are wanted, it has {slots} slots \
                     ({occupied} taken), so that pictures are {} levels coarser",
                    pool.number(),
                    f64::from(*bias_eighths) / 8.0
                )?;
                largest.iter().enumerate().try_for_each(|(nth, texture)| {
                    let lead = if nth == 0 { "; most is wanted by" } else { "," };
                    write!(f, "{lead} texture {} ({} pages)", texture.texture.number(), texture.wanted)
                })
            }
            Event::PoolReduced { pool, asked, bytes } => write!(
                f,
                "the device has no memory for a pool {} of {asked} bytes; it has {bytes}",
                pool.number()
            ),
            Event::BindGroupsChanged { pool } => {
                write!(f, "the bind groups that read pool {} are others than before", pool.number())
            }
            Event::GroupRemoved { group } => {
                write!(f, "group {} is gone, since one of its members was removed", group.number().number())
            }
            Event::Failed { page, why, .. } => {
                write!(f, "{} failed and will be tried again: {why}", of_page(page))
            }
            Event::Recovered { page, .. } => write!(f, "{}, which had failed, is there", of_page(page)),
            Event::Lost { events } => write!(f, "{events} events were dropped, since nobody asked for them"),
        }
    }
}

/// The part of a pool that one texture takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TexturePages {
    /// The texture.
    pub texture: TextureNumber,
    /// The texture's pages in the working set at bias 0, the tail not counted.
    pub wanted: u32,
    /// Slots that hold its tiles, its tail among them.
    pub resident: u32,
}

/// Events that nobody has asked for yet. The oldest are dropped where they would be too many, and that is an
/// event too.
#[derive(Clone, Debug, Default)]
pub(crate) struct EventQueue {
    events: VecDeque<Event>,
    lost: u64,
}

impl EventQueue {
    /// Events that can wait.
    pub(crate) const CAPACITY: usize = 1024;

    pub(crate) fn push(&mut self, event: Event) {
        match event {
            Event::Lost { events } => self.lost += events,
            event => {
                if self.events.len() == EventQueue::CAPACITY {
                    self.events.pop_front();
                    self.lost += 1;
                }
                self.events.push_back(event);
            }
        }
    }

    /// The next event; first of all that some were lost.
    pub(crate) fn poll(&mut self) -> Option<Event> {
        match std::mem::take(&mut self.lost) {
            0 => self.events.pop_front(),
            events => Some(Event::Lost { events }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::page::{Dims, PagePos};

    fn frames(queue: &mut EventQueue) -> Vec<Event> {
        std::iter::from_fn(|| queue.poll()).collect()
    }

    #[test]
    fn events_that_nobody_asks_for_do_not_pile_up() {
        let (mut queue, all) = (EventQueue::default(), EventQueue::CAPACITY as u64 + 5);
        (0..all).for_each(|frame| queue.push(Event::Converged { frame }));
        let mut expected = vec![Event::Lost { events: 5 }];
        expected.extend((5..all).map(|frame| Event::Converged { frame }));
        assert_eq!(frames(&mut queue), expected);
        queue.push(Event::Converged { frame: all });
        assert_eq!(frames(&mut queue), [Event::Converged { frame: all }], "a loss is said once");
    }

    #[test]
    fn an_event_is_one_line() {
        let pool = PoolId::new(2);
        let texture = |number| TextureNumber::new(number).unwrap();
        let page = PageId::new(texture(5), Dims::D2, PagePos::new_2d(1, 3, 4)).unwrap();
        let largest = [(5, 600), (7, 20)]
            .map(|(number, wanted)| TexturePages { texture: texture(number), wanted, resident: 9 })
            .to_vec();
        let (wanted, slots, occupied, bias_eighths) = (620, 500, 499, 4);
        let lines = [
            (Event::Converged { frame: 9 }, "frame 9: all that is wanted is there"),
            (
                Event::Oversubscribed { pool, wanted, slots, occupied, bias_eighths, largest },
                "pool 2 is too small for what is in view: 620 pages are wanted, it has 500 slots (499 taken), so that \
                 pictures are 0.5 levels coarser; most is wanted by texture 5 (600 pages), texture 7 (20 pages)",
            ),
            (
                Event::PoolReduced { pool, asked: 70, bytes: 60 },
                "the device has no memory for a pool 2 of 70 bytes; it has 60",
            ),
            (
                Event::Failed { pool, page, why: "the disk is gone".into() },
                "a page of level 1 of texture 5 failed and will be tried again: the disk is gone",
            ),
            (Event::BindGroupsChanged { pool }, "the bind groups that read pool 2 are others than before"),
            (Event::Recovered { pool, page }, "a page of level 1 of texture 5, which had failed, is there"),
            (Event::Lost { events: 3 }, "3 events were dropped, since nobody asked for them"),
        ];
        lines.into_iter().for_each(|(event, line)| assert_eq!(event.to_string(), line));
    }

    #[test]
    fn what_one_queue_lost_the_next_one_says() {
        let (mut first, mut second) = (EventQueue::default(), EventQueue::default());
        (0..EventQueue::CAPACITY as u64 + 3).for_each(|frame| first.push(Event::Converged { frame }));
        (0..4).for_each(|frame| second.push(Event::Converged { frame }));
        frames(&mut first).into_iter().for_each(|event| second.push(event));
        assert_eq!(second.poll(), Some(Event::Lost { events: 3 + 4 }));
        assert_eq!(second.poll(), Some(Event::Converged { frame: 3 }), "the oldest that is left");
    }
}
