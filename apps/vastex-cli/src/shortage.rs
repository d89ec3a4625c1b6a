//! What is said where GPU memory is short, and what could be done about it.

use vastex::{Event, PoolId, Textures};

use crate::report;

/// What an event says of a pool that is too small; nothing where it says something else.
pub(crate) fn text(event: &Event, textures: &Textures) -> Option<String> {
    let tiles = |pool: PoolId| {
        let pools = textures.stats().pools;
        let tiles = pools.iter().find(|stats| stats.pool == pool).map(|stats| stats.tiles.clone());
        tiles.unwrap_or_default()
    };
    match event {
        Event::Oversubscribed { pool, wanted, slots, bias_eighths, largest, .. } => {
            let name = |texture| textures.name(texture).unwrap_or("a texture").to_owned();
            let shares: Vec<String> =
                largest.iter().map(|share| format!("{} {}", name(share.texture), share.wanted)).collect();
            Some(format!(
                "the view wants {wanted} tiles of {}, and the pool holds {slots}, so it is shown {:.3} levels coarser; most are wanted \
                 by {}; a larger pool (--pool-mib) or a smaller picture would show it sharply",
                tiles(*pool),
                f64::from(*bias_eighths) / 8.0,
                shares.join(", ")
            ))
        }
        Event::PoolReduced { pool, asked, bytes } => Some(format!(
            "the device has no memory for {} of tiles of {}, so the pool has {}; a view that needs more is shown coarser",
            report::bytes(*asked),
            tiles(*pool),
            report::bytes(*bytes)
        )),
        Event::Converged { .. } | Event::Failed { .. } | Event::Recovered { .. } | Event::Lost { .. } => None,
    }
}
