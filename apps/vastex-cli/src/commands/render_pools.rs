//! GPU memory for pictures of volumes: what the bricks of channels and of labels take.

use std::sync::Arc;

use anyhow::{Result, bail};
use vastex::{Description, LayerFormat, PoolTuning, TileSource, VolumeFilters, held_volume_format, wgpu};
use vastex_volume::{VolumeAbout, VolumeOptions, VolumeSource, levels_of};

use crate::args::RenderVolumeArgs;

/// Bricks of 64 voxels a side that a pool holds of each texture at least, where it holds not all of them.
const FEWEST_LARGE: u64 = 64;

/// The side of a brick in voxels: 64; and 32 where a pool of so many bytes holds fewer than 64 of these for
/// each of so many textures, and not all of them: of small ones less is loaded that nobody sees. `large` has
/// the bytes of a brick of 64, and how many of these a texture has. Where nobody says how large the pool is
/// to be it is large enough.
pub(crate) fn brick_side(pool: Option<u64>, large: (u64, u64), textures: u64) -> u32 {
    let (bytes, pages) = large;
    // One of each to work with.
    let few = FEWEST_LARGE.min(pages.saturating_add(1)).saturating_mul(bytes).saturating_mul(textures);
    if pool.is_some_and(|pool| pool < few) { 32 } else { VolumeOptions::default().brick }
}

/// The bytes of a brick of 64 voxels a side of a volume as a device that filters so holds it, and how many
/// there are of a channel at a time.
pub(super) fn large_bricks(about: &VolumeAbout, filters: VolumeFilters) -> Result<(u64, u64)> {
    let VolumeOptions { brick, border, .. } = VolumeOptions::default();
    let (geometry, _) = levels_of(about, brick, border)?;
    let format = match (about.is_label, about.dtype.bytes()) {
        (false, 1) => held_volume_format(LayerFormat::R8, filters),
        (false, 2) => held_volume_format(LayerFormat::R16, filters),
        (true, 8) => LayerFormat::Rg32Uint,
        _ => LayerFormat::R32Float,
    };
    let texels = u64::from(brick + 2 * border).pow(3);
    Ok((texels * format.texel_bytes() as u64, geometry.page_count()))
}

/// GPU memory for bricks.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoolBytes {
    pub(super) channels: u64,
    pub(super) labels: u64,
    /// True if nobody said how much, and all bricks of all levels would need more than is taken.
    pub(super) is_bounded: bool,
}

/// GPU memory for the bricks of channels and of labels: what is asked for, which must hold the tails, shared
/// as they would need it; else as much as shows all bricks of all levels at once, up to a gibibyte each.
pub(super) fn pool_bytes(
    args: &RenderVolumeArgs,
    on @ (_, filters): (&wgpu::Limits, VolumeFilters),
    sources: [&[Arc<VolumeSource>]; 2],
) -> Result<PoolBytes> {
    // What all levels take, and the least that does.
    let needs = sources.map(|sources| {
        let brick = sources.first().map_or(0, |source| brick_bytes(source, filters));
        (pages_of(sources).saturating_mul(brick), brick * (sources.len() as u64 + 1))
    });
    let Some(mib) = args.pool_mib else {
        let all = [0, 1].map(|nth| bytes_for_all(sources[nth], on).unwrap_or(needs[nth].0));
        let [channels, labels] = [0, 1].map(|nth| all[nth].min(MOST_BYTES).max(needs[nth].1));
        let is_bounded = all.into_iter().any(|bytes| bytes > MOST_BYTES);
        return Ok(PoolBytes { channels, labels, is_bounded });
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
    Ok(PoolBytes { channels: bytes - of_labels, labels: of_labels, is_bounded: false })
}

fn pages_of(sources: &[Arc<VolumeSource>]) -> u64 {
    let pages = sources.iter().map(|source| source.description().geometry.page_count());
    pages.fold(0, u64::saturating_add)
}

/// GPU memory that is taken for bricks of channels at most, and as much for those of labels, where nobody
/// says how much; and for ordinary textures that pictures are compared with.
pub(crate) const MOST_BYTES: u64 = 1 << 30;

/// GPU memory in which all bricks of sources of one shape are shown at once, on a device of such limits that
/// filters so; `None` where no pool of it has so many slots.
pub(super) fn bytes_for_all(
    sources: &[Arc<VolumeSource>],
    (limits, filters): (&wgpu::Limits, VolumeFilters),
) -> Option<u64> {
    let Some(first) = sources.first() else { return Some(0) };
    let description: &Description = first.description();
    let mut layers = description.layers.clone();
    layers.iter_mut().for_each(|layer| layer.format = held_volume_format(layer.format, filters));
    let held = Description { layers, ..description.clone() };
    PoolTuning::bytes_for(pages_of(sources), &held, limits)
}

/// Bytes of a brick as a device that filters so holds it.
pub(super) fn brick_bytes(source: &VolumeSource, filters: VolumeFilters) -> u64 {
    let description = source.description();
    let stored = description.layers[0].format;
    let held = held_volume_format(stored, filters);
    (description.tile_bytes() / stored.texel_bytes() * held.texel_bytes()) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_are_small_where_the_pool_is() {
        let large = (600 << 10, 1000);
        assert_eq!(brick_side(None, large, 16), 64);
        assert_eq!((brick_side(Some(64 << 20), large, 1), brick_side(Some(16 << 20), large, 1)), (64, 32));
        assert_eq!((brick_side(Some(64 << 20), large, 3), brick_side(Some(256 << 20), large, 3)), (32, 64));
        // All of a small volume fits in large ones.
        assert_eq!(
            (brick_side(Some(8 << 20), (600 << 10, 9), 1), brick_side(Some(2 << 20), (600 << 10, 9), 1)),
            (64, 32)
        );
        assert_eq!(brick_side(Some(u64::MAX), (u64::MAX, u64::MAX), 16), 64);
    }
}
