//! Volumes: rays through them, in five modes, slices, and labels over both.
//!
//! What a picture of a volume is stands in docs/volumes.md; the shader and the f64 reference of the tests
//! both follow that page. Where the bricks lie is the business of the crate `vastex`: a scene of volumes is
//! an application of its frame loop like any other ([`crate::stage::StageScene`]).

mod camera;
mod channel;
mod desc;
mod labels;
mod ray_bounds;
mod renderer;
mod text;

pub use camera::{VolumeBox, VolumeCamera, VolumeClip, VolumeFace, VolumePlane, VolumeRays, VolumeView};
pub use channel::{
    FIRST_CHANNELS, MOST_CHANNELS, VolumeChannel, drawable_range, usual_channel_color, volume_tables,
};
#[cfg(feature = "egui")]
pub(crate) use channel::{MOST_END, least_apart};
pub use desc::{QUIET_FRAMES, VolumeDesc, VolumeMode};
pub use labels::{
    LabelColors, LabelTurns, MOST_LABEL_COLORS, OtherLabels, VolumeLabels, parse_label, usual_color,
};
pub use ray_bounds::{RayBounds, RayCut, RayVoxels};
pub use renderer::{StillStep, VolumeCameraBinding, VolumeError, VolumeRenderer, VolumeStill};
pub use text::{LabelsInText, RAY_SAMPLES, RAY_STEPS, mean_text, volume_text};
