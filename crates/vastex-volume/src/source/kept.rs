//! How much of the levels that are made lies in a directory already, told without making any.

use std::sync::Arc;

use super::{VolumeOptions, VolumeSourceError, identity, levels_of};
use crate::made::{MadeProgress, kept_in_files};
use crate::reduce::Reduction;
use crate::volume::Volume;

/// How many bricks of the finest made level lie in the directory of `options` for its channel and time, of
/// how many: what [`VolumeSource::make_levels`](super::VolumeSource::make_levels) need not make again. `None`
/// where no directory is named or no level is to be made. Reads a listing, and writes nothing.
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
    let usual = if is_labels { Reduction::Majority } else { Reduction::Mean };
    let identity = identity(volume, options, coarsest, options.reduction.unwrap_or(usual));
    let size: [u64; 3] =
        std::array::from_fn(|axis| about.levels[coarsest].size[axis].div_ceil(finest.factor[axis].into()));
    Ok(Some(kept_in_files(cache, &identity, size)))
}
