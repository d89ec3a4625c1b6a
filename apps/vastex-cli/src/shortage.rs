//! What is said where GPU memory is short, and what could be done about it.

#[cfg(feature = "view")]
use vastex::diagnostics::{PoolStats, Stats};
use vastex::{Event, PoolId, Textures};

use crate::report;

/// Whether a pool has room for all that is wanted now, so that a mip bias that is still in force falls.
#[cfg(feature = "view")]
pub(crate) fn fits(pager: &Stats) -> bool {
    u64::from(pager.wanted) * 5 <= u64::from(pager.slots) * 4
}

/// What an event of a pool that was too small says of a view that has come to rest since; nothing where the pool has room for that.
#[cfg(feature = "view")]
pub(crate) fn at_rest(event: Event, pools: &[PoolStats]) -> Option<Event> {
    match event {
        Event::Oversubscribed { pool, slots, occupied, largest, .. } => {
            let now = &pools.iter().find(|stats| stats.pool == pool)?.pager;
            let (wanted, bias_eighths) = (now.wanted, now.bias_eighths);
            let is_short = bias_eighths > 0 && !fits(now);
            is_short.then_some(Event::Oversubscribed { pool, wanted, slots, occupied, bias_eighths, largest })
        }
        event => Some(event),
    }
}

/// Of so many slots a view may take 90 %, so that what comes into view finds room.
fn room(slots: u32) -> u64 {
    u64::from(slots) * 9 / 10
}

/// The size of a pool in which so many tiles are shown without a mip bias: they take 80 % of it, at which a bias falls again.
fn mib_for(wanted: u32, tile_bytes: u64) -> u64 {
    (u64::from(wanted) * tile_bytes * 5).div_ceil(4).div_ceil(1 << 20)
}

/// What an event says of a pool that is too small; nothing where it says something else.
pub(crate) fn text(event: &Event, textures: &Textures) -> Option<String> {
    let tiles = |pool: PoolId| {
        let pools = textures.stats().pools;
        let tiles = pools.iter().find(|stats| stats.pool == pool).map(|stats| stats.tiles.clone());
        tiles.unwrap_or_default()
    };
    let tile_bytes = |pool: PoolId| {
        let pools = textures.stats().pools;
        let stats = pools.iter().find(|stats| stats.pool == pool);
        stats.map_or(0, |stats| stats.bytes / u64::from(stats.pager.slots.max(1)))
    };
    match event {
        Event::Oversubscribed { pool, wanted, slots, bias_eighths, largest, .. } => {
            let name = |number| {
                let texture = textures.inspect().id_of(number).and_then(|id| textures.texture(id).ok());
                texture.and_then(|texture| texture.name()).unwrap_or("a texture").to_owned()
            };
            let shares: Vec<String> =
                largest.iter().map(|share| format!("{} {}", name(share.texture), share.wanted)).collect();
            let most =
                if shares.len() > 1 { format!(", most by {}", shares.join(", ")) } else { String::new() };
            let levels = f64::from(*bias_eighths) / 8.0;
            Some(format!(
                "GPU memory for tiles is short: the view needs {wanted} tiles of {}{most}, and has room for {}, so it is drawn \
                 {levels} levels coarser; use --pool-mib {} or more, or a smaller picture",
                tiles(*pool),
                room(*slots),
                mib_for(*wanted, tile_bytes(*pool)),
            ))
        }
        Event::PoolReduced { pool, asked, bytes } => Some(format!(
            "the device has no memory for {} of tiles of {}, so they have {}; a view that needs more is drawn coarser",
            report::bytes(*asked),
            tiles(*pool),
            report::bytes(*bytes)
        )),
        _ => None,
    }
}

#[cfg(all(test, feature = "view"))]
mod tests {
    use super::*;

    #[test]
    fn a_view_at_rest_speaks_of_its_own_needs_alone() {
        let pool = PoolId::new(0);
        let short = Event::Oversubscribed {
            pool,
            wanted: 501,
            slots: 513,
            occupied: 500,
            bias_eighths: 2,
            largest: Vec::new(),
        };
        let stats = |wanted, bias_eighths| {
            let pager = Stats { wanted, slots: 513, bias_eighths, ..Stats::default() };
            [PoolStats { pool, tiles: "".into(), bytes: 0, pager }]
        };
        assert_eq!(at_rest(short.clone(), &stats(320, 0)), None, "it was short while it moved");
        assert_eq!(at_rest(short.clone(), &stats(320, 2)), None, "the bias is about to fall");
        let Some(Event::Oversubscribed { wanted, bias_eighths, .. }) = at_rest(short, &stats(480, 1)) else {
            unreachable!("it is short at rest, too")
        };
        assert_eq!((wanted, bias_eighths), (480, 1));
        assert_eq!((room(513), mib_for(480, 136 * 136 * 4)), (461, 43));
    }
}
