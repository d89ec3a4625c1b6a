//! How much of the levels that are made lies in a directory already, told without making any.

use std::sync::Arc;

use pollster::block_on;

use super::{VolumeOptions, VolumeSourceError, identity, levels_of};
use crate::made::{MadeProgress, count_made, kept_in_files};
use crate::reduce::Reduction;
use crate::volume::Volume;

/// How many bricks of the finest made level lie in the directory of `options` for its channel and time, of
/// how many: what [`VolumeSource::make_levels`](super::VolumeSource::make_levels) need not make again. `None`
/// where no directory is named or no level is to be made. Bricks of which nothing is stored do not count.
/// Reads listings, and writes nothing.
pub fn made_levels_kept(
    volume: &Arc<Volume>,
    options: &VolumeOptions,
) -> Result<Option<MadeProgress>, VolumeSourceError> {
    let about = volume.about();
    let (geometry, levels) = levels_of(about, options.brick, options.border)?;
    let first_made = levels.stored();
    let coarsest = levels.levels()[first_made - 1].stored.map_or(0, usize::from);
    let (Some(cache), Some(finest)) = (&options.cache, geometry.levels().get(first_made)) else {
        return Ok(None);
    };
    let is_labels = options.labels.unwrap_or(about.is_label);
    let rule = options.reduction.unwrap_or(Reduction::usual(is_labels));
    let factors: Vec<[u32; 3]> = geometry.levels()[first_made..].iter().map(|level| level.factor).collect();
    let identity = identity(volume, options, coarsest, rule, &factors);
    let stored = block_on(volume.stored_chunks(coarsest));
    let (plane, size) = ((options.channel, options.time), about.levels[coarsest].size);
    let total = count_made(stored.as_deref(), plane, size, finest.factor.map(u64::from));
    Ok(Some(kept_in_files(cache, &identity, total)))
}
