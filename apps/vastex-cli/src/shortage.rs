//! What is said where GPU memory is short, and what could be done about it.

#[cfg(feature = "view")]
use vastex::diagnostics::PoolStats;
use vastex::{Event, PoolId, Textures};

use crate::report;

/// What an event of a pool that was too small says of a view that has come to rest since; `None` if the pool
/// has room for that.
#[cfg(feature = "view")]
pub(crate) fn at_rest(event: Event, pools: &[PoolStats]) -> Option<Event> {
    match event {
        Event::Oversubscribed { pool, slots, occupied, largest, .. } => {
            let now = pools.iter().find(|stats| stats.pool == pool)?;
            let (wanted, bias_eighths) = (now.pager.wanted, now.pager.bias_eighths);
            let is_short = bias_eighths > 0 && !now.fits();
            is_short.then_some(Event::Oversubscribed { pool, wanted, slots, occupied, bias_eighths, largest })
        }
        event => Some(event),
    }
}

/// What an event says of a pool that is too small; `None` if it says something else.
pub(crate) fn text(event: &Event, textures: &Textures) -> Option<String> {
    let pools = textures.stats().pools;
    let stats = |pool: PoolId| pools.iter().find(|stats| stats.pool == pool);
    let tiles = |pool: PoolId| stats(pool).map(|stats| stats.tiles.clone()).unwrap_or_default();
    match event {
        Event::Oversubscribed { pool, wanted, bias_eighths, largest, .. } => {
            // Of the working set that the event is of.
            let mut then = stats(*pool)?.clone();
            then.pager.wanted = *wanted;
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
                then.room(),
                then.bytes_wanted() >> 20,
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
    use vastex::diagnostics::Stats;

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
            [PoolStats { pool, tiles: "".into(), bytes: 513 * 136 * 136 * 4, pager }]
        };
        assert_eq!(at_rest(short.clone(), &stats(320, 0)), None, "it was short while it moved");
        assert_eq!(at_rest(short.clone(), &stats(320, 2)), None, "the bias is about to fall");
        let now = stats(480, 1);
        let Some(Event::Oversubscribed { wanted, bias_eighths, .. }) = at_rest(short, &now) else {
            unreachable!("it is short at rest, too")
        };
        assert_eq!((wanted, bias_eighths), (480, 1));
        assert_eq!((now[0].room(), now[0].bytes_wanted() >> 20), (461, 43));
        assert!(now[0].is_oversubscribed() && !stats(320, 2)[0].is_oversubscribed());
        assert!(stats(514, 0)[0].is_oversubscribed(), "where no bias may act");
    }
}
