//! What is known of a volume without reading its values.

use std::path::PathBuf;

use crate::fault::{VolumeError, VolumeFault};
use crate::units;
use crate::values::DType;

/// What a volume says of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeAbout {
    /// The path that was opened, as it is told: where it is no text, with signs in the place of some bytes.
    pub path: String,
    /// Where the volume lies: the path that was opened, or below it that of the only image there.
    pub root: PathBuf,
    /// `ome-zarr`, `zarr`, `nifti`, `tiff-stack`, `raw` or `vastex`.
    pub kind: &'static str,
    /// The version of its format, where it names one.
    pub version: Option<String>,
    /// What the volume calls itself.
    pub name: Option<String>,
    /// The type of the volume's values.
    pub dtype: DType,
    /// The volume's stored levels, the finest first, at least one.
    pub levels: Vec<VolumeLevel>,
    /// Levels that the file names and that cannot be read, in the order of their numbers.
    pub left_out: Vec<LevelLeftOut>,
    /// How many channels there are, at least 1.
    pub channels: u64,
    /// What is said of channels, for as many of the first ones as something is said of.
    pub channel_info: Vec<VolumeChannel>,
    /// How many times there are, at least 1.
    pub times: u64,
    /// How far apart times are, where the file says so.
    pub time_step: Option<f64>,
    /// The unit of that.
    pub time_unit: Option<String>,
    /// The unit of scales and origins.
    pub unit: Option<String>,
    /// How the file places its levels beside each other.
    pub convention: Convention,
    /// Images of labels that lie beside it; each is opened at `labels/NAME` below where it lies
    /// ([`VolumeAbout::labels_at`]).
    pub labels: Vec<String>,
    /// True if the volume's values are labels: numbers of things, which are never mixed.
    pub is_label: bool,
    /// Colours that the file gives to some labels, as they stand in tiles: red, green, blue, and how opaque
    /// they are; in the order of the file, where a label may come twice.
    pub label_colors: Vec<(u64, [u8; 4])>,
    /// What makes meant values of stored ones: `slope * value + intercept`. Nothing here applies it.
    pub value_scale: Option<[f64; 2]>,
    /// How coarser levels were made of finer ones, as the file calls it: `mean`, `gaussian`.
    pub downsample: Option<String>,
    /// What was wrong with the metadata, and how it was read; one sentence each.
    pub oddities: Vec<String>,
}

impl VolumeAbout {
    /// Voxels along x, y and z of the finest level.
    pub fn size(&self) -> [u64; 3] {
        self.levels[0].size
    }

    /// Where labels that lie beside the volume are opened, by their name ([`VolumeAbout::labels`]).
    pub fn labels_at(&self, name: &str) -> PathBuf {
        self.root.join("labels").join(name)
    }

    /// The finest level that the file names, where that is left out, so that level 0 is a coarser one.
    pub fn finest_left_out(&self) -> Option<&LevelLeftOut> {
        self.left_out.first().filter(|left| left.number == 0)
    }

    /// The place among `levels` of the level with a number in the file, where those that are left out have
    /// theirs, too; the fault of one that is left out.
    pub fn level_numbered(&self, number: usize) -> Result<usize, VolumeError> {
        if let Some(left) = self.left_out.iter().find(|left| left.number == number) {
            return Err(left.error.clone());
        }
        let place = number - self.left_out.iter().filter(|left| left.number < number).count();
        match place < self.levels.len() || self.left_out.is_empty() {
            true => Ok(place),
            false => {
                let last = self.levels.len() + self.left_out.len() - 1;
                let why = format!("there is no level {number}; the file names levels 0 to {last}");
                Err(VolumeFault::Request(why).at(&self.path))
            }
        }
    }

    /// How many units of another volume's scales and origins one of this volume's is: 1 where one of the two
    /// names none, which may be any; `None` where their units cannot be compared.
    pub fn unit_in(&self, other: &VolumeAbout) -> Option<f64> {
        match (&self.unit, &other.unit) {
            (Some(own), Some(other)) => units::in_other(own, other),
            _ => Some(1.0),
        }
    }
}

/// A stored level. Voxel `i` of it fills `origin + i * scale` to `origin + (i + 1) * scale` of the world,
/// along each axis.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeLevel {
    /// The level's path below the volume's; empty if it is the volume's only array.
    pub path: String,
    /// Voxels along x, y and z, at least 1 each.
    pub size: [u64; 3],
    /// Sides of a voxel along x, y and z, above 0 and finite.
    pub scale: [f64; 3],
    /// The corner of its first voxel.
    pub origin: [f64; 3],
    /// Voxels of what is decoded at once, along x, y and z.
    pub chunk: [u64; 3],
}

/// A level that the file names and that cannot be read, so that the others are taken without it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LevelLeftOut {
    /// The level's number among all that the file names, from 0, the finest, on.
    pub number: usize,
    /// The level's path below the volume's.
    pub path: String,
    /// Why it is left out.
    pub error: VolumeError,
}

/// What is said of a channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VolumeChannel {
    /// The channel's name.
    pub name: Option<String>,
    /// Red, green and blue.
    pub color: Option<[u8; 3]>,
    /// The stored values that are shown as dark and as bright; the first is below the second.
    pub window: Option<[f64; 2]>,
    /// `Some(true)` if the channel is shown at first, `Some(false)` if hidden; `None` if nothing is said.
    pub is_active: Option<bool>,
    /// True if dark and bright are exchanged.
    pub is_inverted: bool,
}

/// What translations of levels are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Convention {
    /// Of the corner of the first voxel, as files have them that name none.
    Corner,
    /// Of the middle of the first voxel.
    Center,
}

impl Convention {
    /// How far the place that a translation is of lies from the corner, in sides of a voxel.
    pub(crate) fn inward(self) -> f64 {
        match self {
            Convention::Corner => 0.0,
            Convention::Center => 0.5,
        }
    }

    /// The convention's name.
    pub const fn name(self) -> &'static str {
        match self {
            Convention::Corner => "corner",
            Convention::Center => "center",
        }
    }
}
