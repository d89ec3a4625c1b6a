//! What a world's pager decided and told, as lines of text: for records that are compared over versions.
//!
//! The form of the lines stays whatever types and fields are called. A page is `texture:level/x,y`, with `,z`
//! in volumes. Where a load stands among those that wait is said by its place in their order, since ranks
//! themselves are numbers without meaning.

use std::collections::BTreeMap;
use std::fmt::{self, Write};

use crate::pager::decision::Upload;
use crate::pager::event::Event;
use crate::pager::tickets::{Progress, Ticket, TicketState};
use crate::residency::resize::SlotMove;
use crate::residency::stats::Stats;
use crate::sim::loader::{Loads, Outcome};
use crate::table::pool::{PoolId, Slot};
use crate::table::{ChangeRule, TableChange, TableEntry};
use crate::texture::page::{Dims, PageId, TextureNumber};

/// The lines of a world, where somebody wants them; writes nothing otherwise.
#[derive(Debug, Default)]
pub struct Log {
    lines: Option<String>,
    dims: BTreeMap<TextureNumber, Dims>,
    /// Tickets are named in the order in which they were given.
    tickets: Vec<Ticket>,
    biases: BTreeMap<PoolId, u16>,
    frame: u64,
    /// The frame under whose head the last line stands.
    head: u64,
}

impl Log {
    /// Keeps lines from now on.
    pub fn begin(&mut self) {
        self.lines.get_or_insert_default();
    }

    /// The lines so far, which are kept no longer.
    pub fn take(&mut self) -> String {
        self.lines.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Adds a line of the caller's own.
    pub fn line(&mut self, line: fmt::Arguments<'_>) {
        let Some(lines) = &mut self.lines else { return };
        if self.head != self.frame {
            self.head = self.frame;
            lines.push_str(&format!("frame {}\n", self.frame));
        }
        // Writing to a string cannot fail.
        let _ = writeln!(lines, "{line}");
    }

    /// The counts of a pool, a line for each.
    pub fn counts(&mut self, pool: PoolId, stats: &Stats) {
        let pool = pool.number();
        for (name, count) in counts(stats) {
            self.line(format_args!("pool {pool} {name} {count}"));
        }
    }

    pub(crate) fn frame(&mut self, frame: u64) {
        self.frame = frame;
    }

    pub(crate) fn texture(&mut self, texture: TextureNumber, dims: Dims, pool: PoolId, tail: Slot) {
        self.dims.insert(texture, dims);
        let (texture, pool) = (texture.number(), pool.number());
        self.line(format_args!("texture {texture} in pool {pool} tail in slot {}", tail.index()));
    }

    pub(crate) fn arrived(&mut self, page: PageId, outcome: Outcome) {
        let how = match outcome {
            Outcome::Tile => "tile",
            Outcome::Failure => "failure",
            Outcome::Cancelled => "cancelled",
        };
        self.of_page("arrived", page, format_args!(" {how}"));
    }

    pub(crate) fn cancel(&mut self, page: PageId) {
        self.of_page("cancel", page, format_args!(""));
    }

    pub(crate) fn request(&mut self, page: PageId, loads: &Loads) {
        self.in_turn("request", page, loads);
    }

    pub(crate) fn rerank(&mut self, page: PageId, loads: &Loads) {
        self.in_turn("rerank", page, loads);
    }

    pub(crate) fn begun(&mut self, page: PageId) {
        self.of_page("begun", page, format_args!(""));
    }

    pub(crate) fn upload(&mut self, pool: PoolId, upload: &Upload) {
        let evicted = upload.evicted.map(|page| format!(" evicts {}", self.page(page))).unwrap_or_default();
        let (pool, slot) = (pool.number(), upload.slot.index());
        self.of_page("upload", upload.page, format_args!(" to pool {pool} slot {slot}{evicted}"));
    }

    pub(crate) fn table_changes(&mut self, changes: &[TableChange]) {
        let entry = |entry: TableEntry| format!("{}@{}", entry.level(), entry.slot().index());
        for change in changes {
            let replaced = match change.rule {
                ChangeRule::Coarser => "coarser".to_owned(),
                ChangeRule::Naming(named) => entry(named),
            };
            self.of_page("table", change.page, format_args!(" {replaced} -> {}", entry(change.entry)));
        }
    }

    /// The mip bias of a pool, where it is another than before.
    pub(crate) fn bias(&mut self, pool: PoolId, eighths: u16) {
        if self.biases.insert(pool, eighths).unwrap_or(0) != eighths {
            self.line(format_args!("bias of pool {} {eighths}/8", pool.number()));
        }
    }

    pub(crate) fn event(&mut self, event: &Event) {
        match event {
            Event::Converged { frame } => self.line(format_args!("converged in frame {frame}")),
            Event::Oversubscribed { pool, wanted, slots, occupied, bias_eighths, largest } => {
                let of_texture = |texture: &crate::pager::event::TexturePages| {
                    format!(" {}:{}/{}", texture.texture.number(), texture.wanted, texture.resident)
                };
                let largest: String = largest.iter().map(of_texture).collect();
                let pool = pool.number();
                self.line(format_args!(
                    "oversubscribed pool {pool} wanted {wanted} slots {slots} occupied {occupied} bias {bias_eighths}/8 largest{largest}"
                ));
            }
            Event::PoolReduced { pool, asked, bytes } => {
                self.line(format_args!("reduced pool {} asked {asked} bytes {bytes}", pool.number()));
            }
            Event::Failed { pool, page, why } => {
                self.of_page("failed", *page, format_args!(" of pool {}: {why}", pool.number()));
            }
            Event::Recovered { pool, page } => {
                self.of_page("recovered", *page, format_args!(" of pool {}", pool.number()));
            }
            // What there is of a GPU is not in a simulated world.
            Event::BindGroupsChanged { .. } | Event::GroupRemoved { .. } => {}
            Event::Lost { events } => self.line(format_args!("lost {events} events")),
        }
    }

    pub(crate) fn asked(&mut self, ticket: Ticket) {
        self.tickets.push(ticket);
        self.line(format_args!("ticket {} given", self.tickets.len() - 1));
    }

    pub(crate) fn ended(&mut self, ticket: Ticket, progress: &Progress) {
        let state = match progress.state {
            TicketState::Open => "open",
            TicketState::Done => "done",
            TicketState::Late => "late",
            TicketState::Released => "released",
        };
        let Progress { pages, resident, failed, .. } = progress;
        let number = self.tickets.iter().position(|given| *given == ticket).unwrap_or(usize::MAX);
        self.line(format_args!("ticket {number} {state} pages {pages} resident {resident} failed {failed}"));
    }

    pub(crate) fn moved(&mut self, pool: PoolId, slots: u32, moves: &[SlotMove]) {
        let pool = pool.number();
        self.line(format_args!("pool {pool} has {slots} slots"));
        for SlotMove { from, to } in moves {
            self.line(format_args!("moved in pool {pool} slot {} to {}", from.index(), to.index()));
        }
    }

    fn in_turn(&mut self, what: &str, page: PageId, loads: &Loads) {
        if self.lines.is_none() {
            return;
        }
        match loads.place(page) {
            Some(place) => self.of_page(what, page, format_args!(" place {place}")),
            None => self.of_page(what, page, format_args!("")),
        }
    }

    fn of_page(&mut self, what: &str, page: PageId, more: fmt::Arguments<'_>) {
        if self.lines.is_some() {
            let page = self.page(page);
            self.line(format_args!("{what} {page}{more}"));
        }
    }

    fn page(&self, page: PageId) -> String {
        let dims = self.dims.get(&page.texture()).copied().unwrap_or(Dims::D2);
        let pos = page.pos(dims);
        let deep = if dims == Dims::D3 { format!(",{}", pos.z) } else { String::new() };
        format!("{}:{}/{},{}{deep}", page.texture().number(), pos.level, pos.x, pos.y)
    }
}

/// The counts of a pool, under names that stay.
fn counts(stats: &Stats) -> [(&'static str, u64); 24] {
    [
        ("slots", stats.slots.into()),
        ("occupied", stats.occupied.into()),
        ("resident", stats.resident.into()),
        ("tails", stats.tails.into()),
        ("locked", stats.locked.into()),
        ("wanted", stats.wanted.into()),
        ("wanted-at-bias", stats.wanted_at_bias.into()),
        ("missing", stats.missing.into()),
        ("failed", stats.failed.into()),
        ("in-flight", stats.in_flight.into()),
        ("in-flight-bytes", stats.in_flight_bytes),
        ("requests", stats.requests),
        ("cancelled", stats.cancelled),
        ("failures", stats.failures),
        ("loaded", stats.loaded),
        ("uploaded-bytes", stats.uploaded_bytes),
        ("shared", stats.shared),
        ("evicted", stats.evicted),
        ("reloaded", stats.reloaded),
        ("wasted", stats.wasted),
        ("waited-frames", stats.waited_frames),
        ("pixels", stats.pixels),
        ("levels-short", stats.levels_short),
        ("refreshed", stats.refreshed),
    ]
}
