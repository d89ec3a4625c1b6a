//! Which values are shown from dark to bright where nobody says so: the window that the file names, or one by
//! percentiles of a coarse level.

use super::{VolumeSource, VoxelValue};
use crate::fault::{SourceFault, VolumeError, VolumeFault};
use crate::volume::{VolumeAbout, VolumeChannel, VoxelBox};

/// Voxels of the level whose values are looked at, where there is one of so few.
const MOST_VOXELS: u64 = 1 << 21;
/// Shares that are looked for one by one.
const FEW_SHARES: usize = 8;
/// The shares of values below the darkest and the brightest one.
const SHARES: [f64; 2] = [0.005, 0.998];

impl VolumeSource {
    /// The stored values below which such shares of the values lie, each from 0 to 1, in the order in which
    /// they are named: of the finest level with up to 2 Mi voxels (of one that is still a preview, of that).
    /// What is not finite counts for nothing, nor do chunks that cannot be read, which
    /// [`faults`](VolumeSource::faults) tells of; where a level has no others, the next coarser stored one is
    /// taken. 0 where nothing is finite. Reads that level, and takes 8 bytes for each of its voxels.
    pub async fn percentiles(&self, shares: &[f64]) -> Result<Vec<f64>, VolumeError> {
        Ok(self.sound_percentiles(shares).await?.unwrap_or_else(|| vec![0.0; shares.len()]))
    }

    /// The same; `None` where nothing could be read.
    async fn sound_percentiles(&self, shares: &[f64]) -> Result<Option<Vec<f64>>, VolumeError> {
        let voxels = |size: [u32; 3]| size.iter().map(|side| u64::from(*side)).product::<u64>();
        let levels = self.levels.levels();
        let level = levels.iter().position(|level| voxels(level.size) <= MOST_VOXELS);
        let mut level = level.unwrap_or(levels.len() - 1);
        let mut bytes = self.sound_values(level as u8).await?;
        while bytes.is_empty() && levels.get(level + 1).is_some_and(|level| level.stored.is_some()) {
            level += 1;
            bytes = self.sound_values(level as u8).await?;
        }
        if bytes.is_empty() {
            return Ok(None);
        }
        let dtype = self.volume.about().dtype;
        let mut values = Vec::new();
        values
            .try_reserve_exact(bytes.len() / dtype.bytes())
            .map_err(|error| VolumeFault::TooLarge(error.to_string()).at(&self.volume.about().path))?;
        let stored = bytes.chunks_exact(dtype.bytes()).filter_map(|value| VoxelValue::of(dtype, value));
        values.extend(stored.map(VoxelValue::to_f64).filter(|value| value.is_finite()));
        // Few are found without putting all in order.
        let is_sorted = shares.len() > FEW_SHARES;
        if is_sorted {
            values.sort_unstable_by(f64::total_cmp);
        }
        let of_share = |share: &f64| match values.len().checked_sub(1) {
            None => 0.0,
            Some(last) => {
                let rank = (share.clamp(0.0, 1.0) * last as f64).round() as usize;
                if is_sorted { values[rank] } else { *values.select_nth_unstable_by(rank, f64::total_cmp).1 }
            }
        };
        Ok(Some(shares.iter().map(of_share).collect()))
    }

    /// The values of a level; where a chunk of it cannot be read, those of the others, in any order.
    async fn sound_values(&self, level: u8) -> Result<Vec<u8>, VolumeError> {
        let of = self.levels.level(level);
        // Who shows what has come is shown the values that a preview has.
        let asks = !self.options.borders_later;
        let whole = self.read_box_of(level, &VoxelBox { first: [0; 3], size: of.size }, asks).await;
        let (Some(stored), Err(error)) = (of.stored, &whole) else { return Ok(whole?.values) };
        if matches!(error.fault, VolumeFault::TooLarge(_)) {
            return Ok(whole?.values);
        }
        let side = self.volume.grid(stored.into()).chunk_size();
        let cuts = |axis: usize| {
            let step = usize::try_from(side[axis]).unwrap_or(usize::MAX);
            (0..of.size[axis]).step_by(step).map(move |first| (first, of.size[axis] - first))
        };
        let mut values = Vec::new();
        for (z, depth) in cuts(2) {
            for (y, height) in cuts(1) {
                for (x, width) in cuts(0) {
                    let rest = [width, height, depth];
                    let size = std::array::from_fn(|axis| u64::from(rest[axis]).min(side[axis]) as u32);
                    let chunk = VoxelBox { first: [x, y, z].map(i64::from), size };
                    match self.read_box_of(level, &chunk, asks).await {
                        Ok(found) => values.extend(found.values),
                        Err(error) => self.made.fault(SourceFault::Voxels(error)),
                    }
                }
            }
        }
        Ok(values)
    }

    /// The stored values that are shown as dark and as bright: those that the file names of the channel,
    /// within what its values can be; where it names none, or all that its values can be, those between the
    /// lowest 0.5 % and the highest 0.2 % of a coarse level; where nothing of that can be read, all that its
    /// values can be, of floats 0 to 1. The first is below the second. Of colours, red, green and blue, all
    /// that their values can be is what is meant.
    pub async fn usual_window(&self) -> Result<[f64; 2], VolumeError> {
        let about = self.volume.about();
        let channel = usize::try_from(self.options.channel).ok();
        let named = channel.and_then(|channel| about.channel_info.get(channel)?.window);
        let bounds = about.dtype.bounds().map(|(least, most)| [least as f64, most as f64]);
        let named = named.map(|window| match bounds {
            Some([least, most]) => window.map(|value| value.clamp(least, most)),
            None => window,
        });
        // Writers that know nothing of the values name all that they can be; of colours that is what is
        // meant.
        let says_nothing = !are_colors(about);
        let is_all = |window: &[f64; 2]| says_nothing && bounds.is_some_and(|bounds| *window == bounds);
        if let Some(window) = named.filter(|window| window[0] < window[1] && !is_all(window)) {
            return Ok(window);
        }
        let Some(found) = self.sound_percentiles(&SHARES).await? else {
            return Ok(bounds.unwrap_or([0.0, 1.0]));
        };
        let [dark, bright] = [found[0], found[1]];
        Ok(if dark < bright { [dark, bright] } else { [dark, dark + above(dark)] })
    }
}

/// Returns true if channels are the colours of pictures: those of a TIFF file, and of others the three of 8
/// bits that are red, green and blue, as pictures come that were converted. A fourth is how opaque they are
/// if it has no colour or is not shown; in a colour of its own it is a channel, and so are the others.
fn are_colors(about: &VolumeAbout) -> bool {
    // Stacks of TIFF name windows of colours alone.
    if about.kind == "tiff-stack" {
        return true;
    }
    let is = |(channel, color): (&VolumeChannel, [u8; 3])| channel.color == Some(color);
    let three = [[255, 0, 0], [0, 255, 0], [0, 0, 255]];
    about.dtype.bytes() == 1
        && matches!(about.channels, 3 | 4)
        && about.channel_info.len() >= 3
        && about
            .channel_info
            .get(3)
            .is_none_or(|fourth| fourth.color.is_none() || fourth.is_active == Some(false))
        && about.channel_info.iter().zip(three).all(is)
}

/// What is added to a value to have one above it: 1, or more where floats of 64 bits lie further apart.
fn above(value: f64) -> f64 {
    1.0_f64.max(value.abs() * f64::from(f32::EPSILON))
}
