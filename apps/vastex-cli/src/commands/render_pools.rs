//! GPU memory for pictures of volumes: what the bricks of channels and of labels take.

use std::sync::Arc;

use anyhow::{Result, bail};
use vastex::{TileSource, VolumeFilters, held_volume_format};
use vastex_volume::VolumeSource;

use crate::args::RenderVolumeArgs;

/// GPU memory that is taken for bricks at most where nobody says how much.
const MOST_BYTES: u64 = 1 << 30;

/// GPU memory for the bricks of channels and of labels: what is asked for, which must hold the tails, shared
/// as they would need it; else as much as all levels take, up to a gibibyte each.
pub(super) fn pool_bytes(
    args: &RenderVolumeArgs,
    filters: VolumeFilters,
    sources: [&[Arc<VolumeSource>]; 2],
) -> Result<[u64; 2]> {
    // What all levels take, and the least that does.
    let needs = sources.map(|sources| {
        let brick = sources.first().map_or(0, |source| brick_bytes(source, filters));
        let pages = sources.iter().map(|source| source.description().geometry.page_count());
        let pages = pages.fold(0u64, u64::saturating_add);
        (pages.saturating_mul(brick), brick * (sources.len() as u64 + 1), brick)
    });
    let Some(mib) = args.pool_mib else {
        return Ok(needs.map(|(needed, least, brick)| {
            // A tenth more, for grids of slots that are no cubes.
            let more = needed.saturating_add(needed / 10).saturating_add(2 * brick);
            more.min(MOST_BYTES).max(least)
        }));
    };
    let (bytes, least) = (mib << 20, needs[0].1 + needs[1].1);
    if bytes < least {
        let channels = sources[0].len();
        let mib_needed = least.div_ceil(1 << 20);
        let labels = if sources[1].is_empty() { "" } else { " and labels" };
        bail!(
            "--pool-mib {mib}: {channels} channels{labels} need {mib_needed} MiB at least, a brick each and one to work with"
        );
    }
    // What is left beyond the least, by what each would take.
    let all = (needs[0].0 as f64 + needs[1].0 as f64).max(1.0);
    let of_labels = needs[1].1 + ((bytes - least) as f64 * (needs[1].0 as f64 / all)) as u64;
    Ok([bytes - of_labels, of_labels])
}

/// Bytes of a brick as a device that filters so holds it.
pub(super) fn brick_bytes(source: &VolumeSource, filters: VolumeFilters) -> u64 {
    let description = source.description();
    let stored = description.layers[0].format;
    let held = held_volume_format(stored, filters);
    (description.tile_bytes() / stored.texel_bytes() * held.texel_bytes()) as u64
}
