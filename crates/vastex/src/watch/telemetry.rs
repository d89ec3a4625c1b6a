//! Telemetry: every pool after each of the last frames, with the tiers behind it, and the columns under which
//! it is written down.
//!
//! What the pager counts is `vastex_core`'s, what the tiers count `vastex_tiles`'; here both are put side by
//! side, frame by frame. Programs and people read the columns by their names: see docs/telemetry.md.

use std::fmt;

use serde::{Serialize, Serializer};
use vastex_core::{History, Pager, PoolFrame, PoolId, Stats, TimeToSharp};
use vastex_tiles::{Tiers, TileSource};

/// A pool after a frame, and what happened in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PoolRecord {
    /// Figures of the pool's pager.
    pub pager: PoolFrame,
    /// What the caches and files behind the pool's textures did since the record before, and what they hold.
    /// A source that several textures share counts for each of them.
    pub tiers: Tiers,
}

/// The records of the last frames, and what the next ones are counted from.
#[derive(Debug)]
pub(super) struct Telemetry {
    history: History<PoolRecord>,
    /// By pool, as the newest record found it.
    earlier: Vec<(Stats, Tiers)>,
    /// By pool, what the tiers of textures had done that are gone.
    gone: Vec<Tiers>,
    /// Reused between frames to avoid allocating.
    now: Vec<Tiers>,
}

impl Telemetry {
    pub(super) fn new(frames: u64) -> Telemetry {
        Telemetry { history: History::new(frames), earlier: Vec::new(), gone: Vec::new(), now: Vec::new() }
    }

    /// A texture of the pool is removed, whose tiers are these.
    pub(super) fn note_gone(&mut self, pool: PoolId, tiers: Tiers) {
        let number = usize::from(pool.number());
        self.gone.resize((number + 1).max(self.gone.len()), Tiers::default());
        self.gone[number] += tiers.done();
    }
}

impl Telemetry {
    /// Each pool after each of the last frames, oldest first.
    pub(super) fn history(&self) -> &History<PoolRecord> {
        &self.history
    }

    /// Adds a frame that has just been played. `sources` are those of all textures, with their pools.
    pub(super) fn record<'a>(
        &mut self,
        frame: u64,
        pager: &Pager,
        sources: impl Iterator<Item = (PoolId, &'a dyn TileSource)>,
    ) {
        let Telemetry { history, earlier, gone, now } = self;
        if history.frames() == 0 {
            return;
        }
        let pools = pager.pools().count();
        earlier.resize(pools, Default::default());
        gone.resize(pools, Tiers::default());
        now.clear();
        now.extend_from_slice(gone);
        for (pool, source) in sources {
            source.add_tiers(&mut now[usize::from(pool.number())]);
        }
        for ((pager, &tiers), (stats_before, tiers_before)) in pager.pools().zip(&*now).zip(earlier) {
            let record =
                PoolRecord { pager: pager.frame_since(stats_before), tiers: tiers.since(tiers_before) };
            history.push(frame, record);
            (*stats_before, *tiers_before) = (pager.stats(), tiers);
        }
    }
}

/// A value of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell {
    /// A whole number.
    Count(u64),
    /// Any number.
    Real(f64),
    /// Nothing to say yet: nothing in CSV, `null` in JSON.
    Empty,
}

impl Cell {
    fn of(count: Option<impl Into<u64>>) -> Cell {
        count.map_or(Cell::Empty, |count| Cell::Count(count.into()))
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cell::Count(count) => count.fmt(f),
            Cell::Real(number) => number.fmt(f),
            Cell::Empty => Ok(()),
        }
    }
}

impl Serialize for Cell {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Cell::Count(count) => serializer.serialize_u64(*count),
            Cell::Real(number) => serializer.serialize_f64(*number),
            Cell::Empty => serializer.serialize_none(),
        }
    }
}

type Column = (&'static str, fn(&PoolRecord) -> Cell);

/// In the order of the file. Scripts rely on these names.
const COLUMNS: [Column; 46] = [
    ("frame", |record| Cell::Count(record.pager.frame)),
    ("pool", |record| Cell::Count(record.pager.pool.number().into())),
    ("slots", |record| Cell::Count(record.pager.stats.slots.into())),
    ("occupied", |record| Cell::Count(record.pager.stats.occupied.into())),
    ("locked", |record| Cell::Count(record.pager.stats.locked.into())),
    ("wanted", |record| Cell::Count(record.pager.stats.wanted.into())),
    ("bias", |record| Cell::Real(f64::from(record.pager.stats.bias_eighths) / 8.0)),
    ("uploads", |record| Cell::Count(record.pager.stats.loaded)),
    ("evictions", |record| Cell::Count(record.pager.stats.evicted)),
    ("reloads", |record| Cell::Count(record.pager.stats.reloaded)),
    ("failures", |record| Cell::Count(record.pager.stats.failures)),
    ("wanted_at_bias", |record| Cell::Count(record.pager.stats.wanted_at_bias.into())),
    ("missing", |record| Cell::Count(record.pager.stats.missing.into())),
    ("failed", |record| Cell::Count(record.pager.stats.failed.into())),
    ("requests", |record| Cell::Count(record.pager.stats.requests)),
    ("cancelled", |record| Cell::Count(record.pager.stats.cancelled)),
    ("wasted", |record| Cell::Count(record.pager.stats.wasted)),
    ("refreshes", |record| Cell::Count(record.pager.stats.refreshed)),
    ("in_flight", |record| Cell::Count(record.pager.stats.in_flight.into())),
    ("in_flight_bytes", |record| Cell::Count(record.pager.stats.in_flight_bytes)),
    ("upload_bytes", |record| Cell::Count(record.pager.stats.uploaded_bytes)),
    ("share_at_wanted", |record| of_pixels(record, Stats::share_at_wanted)),
    ("levels_short", |record| of_pixels(record, Stats::mean_levels_short)),
    ("feedback_age", |record| Cell::of(record.pager.feedback_age)),
    ("sharp_p50", |record| Cell::of(sharp(record, |time| time.p50))),
    ("sharp_p95", |record| Cell::of(sharp(record, |time| time.p95))),
    ("ram_hits", |record| Cell::Count(record.tiers.ram.hits)),
    ("ram_misses", |record| Cell::Count(record.tiers.ram.misses)),
    ("ram_evictions", |record| Cell::Count(record.tiers.ram.evictions)),
    ("ram_bytes", |record| Cell::Count(record.tiers.ram.bytes)),
    ("ram_bytes_read", |record| Cell::Count(record.tiers.ram.bytes_read)),
    ("disk_hits", |record| Cell::Count(record.tiers.disk.hits)),
    ("disk_misses", |record| Cell::Count(record.tiers.disk.misses)),
    ("disk_evictions", |record| Cell::Count(record.tiers.disk.evictions)),
    ("disk_failures", |record| Cell::Count(record.tiers.disk.failures)),
    ("disk_bytes", |record| Cell::Count(record.tiers.disk.bytes)),
    ("disk_bytes_read", |record| Cell::Count(record.tiers.disk.bytes_read)),
    ("disk_bytes_written", |record| Cell::Count(record.tiers.disk.bytes_written)),
    ("store_reads", |record| Cell::Count(record.tiers.store.reads)),
    ("store_bytes", |record| Cell::Count(record.tiers.store.bytes)),
    ("resident", |record| Cell::Count(record.pager.stats.resident.into())),
    ("shared", |record| Cell::Count(record.pager.stats.shared)),
    ("chunks_decoded", |record| Cell::Count(record.tiers.chunks.decoded)),
    ("chunk_bytes_decoded", |record| Cell::Count(record.tiers.chunks.bytes_decoded)),
    ("chunks_shared", |record| Cell::Count(record.tiers.chunks.shared)),
    ("chunk_bytes", |record| Cell::Count(record.tiers.chunks.bytes)),
];

fn of_pixels(record: &PoolRecord, part: fn(&Stats) -> f64) -> Cell {
    let stats = &record.pager.stats;
    if stats.pixels == 0 { Cell::Empty } else { Cell::Real(part(stats)) }
}

fn sharp(record: &PoolRecord, part: fn(TimeToSharp) -> u32) -> Option<u32> {
    record.pager.time_to_sharp.map(part)
}

impl PoolRecord {
    /// The names of the columns and what stands in them, in their order.
    pub fn columns(&self) -> impl Iterator<Item = (&'static str, Cell)> + '_ {
        COLUMNS.iter().map(|(name, cell)| (*name, cell(self)))
    }

    /// The names of the columns as a line of CSV, its end included.
    pub fn csv_header() -> String {
        COLUMNS.map(|(name, _)| name).join(",") + "\n"
    }

    /// Adds the record to `csv` as a line, its end included.
    pub fn write_csv(&self, csv: &mut String) {
        for (nth, (_, cell)) in self.columns().enumerate() {
            let separator = if nth == 0 { "" } else { "," };
            *csv += &format!("{separator}{cell}");
        }
        csv.push('\n');
    }
}

/// An object with the columns' names.
impl Serialize for PoolRecord {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.columns())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex_tiles::TierStats;

    #[test]
    fn the_columns_that_scripts_rely_on_come_first_and_no_name_comes_twice() {
        let first = "frame,pool,slots,occupied,locked,wanted,bias,uploads,evictions,reloads,failures,";
        assert!(PoolRecord::csv_header().starts_with(first));
        let mut names = COLUMNS.map(|(name, _)| name);
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
    }

    #[test]
    fn a_line_has_a_cell_for_each_name() {
        let stats = Stats { bias_eighths: 9, pixels: 4, pixels_at_wanted: 3, ..Stats::default() };
        let pager = PoolFrame { frame: 7, stats, feedback_age: Some(2), ..PoolFrame::default() };
        let mut line = String::new();
        PoolRecord { pager, ..PoolRecord::default() }.write_csv(&mut line);
        let header = PoolRecord::csv_header();
        let cell = |name: &str| {
            let at = header.trim_end().split(',').position(|column| column == name).unwrap();
            line.trim_end().split(',').nth(at).unwrap().to_owned()
        };
        assert_eq!(line.matches(',').count(), header.matches(',').count());
        let cells = ["frame", "bias", "share_at_wanted", "feedback_age", "sharp_p50", "ram_hits"].map(cell);
        assert_eq!(cells, ["7", "1.125", "0.75", "2", "", "0"]);
    }

    #[test]
    fn what_textures_did_that_are_gone_stays_counted() {
        let mut telemetry = Telemetry::new(1);
        let ram = TierStats { hits: 3, bytes: 50, ..TierStats::default() };
        (0..2).for_each(|_| telemetry.note_gone(PoolId::new(1), Tiers { ram, ..Tiers::default() }));
        let done = TierStats { hits: 6, ..TierStats::default() };
        assert_eq!((telemetry.gone[0], telemetry.gone[1].ram), (Tiers::default(), done));
    }
}
