//! The text of the shaders that draw volumes, and what it is told in.

use std::ops::RangeInclusive;

use vastex::{FeedbackMode, RAY_BRICKS};

use crate::layers::Palette;

/// Which labels a text draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LabelsInText {
    /// None.
    None,
    /// Over an image.
    Over,
    /// By themselves.
    Alone,
}

/// Samples of a ray at most, and voxels of labels that it is followed through: those of as many bricks of
/// 64 voxels as feedback asks for.
pub const RAY_SAMPLES: u32 = RAY_BRICKS * 64;
/// From one sample of a ray to the next, in sides of a voxel, as people may choose it.
pub const RAY_STEPS: RangeInclusive<f64> = 0.01..=100.0;

/// The text of the shaders that draw volumes. `vastex` is the text for the kind of one channel, which serves
/// all others, since they lie in the same textures; with labels for a group of the members `image`, that
/// channel, and `label`, or of `label` alone. A text with labels has what it is told in storage buffers where
/// there are any ([`FeedbackMode::Raw`] says that there are none).
pub fn volume_text(vastex: &str, labels: LabelsInText, mode: FeedbackMode) -> String {
    let volume = [
        include_str!("wgsl/volume.wgsl"),
        include_str!("wgsl/reduced.wgsl"),
        include_str!("wgsl/surface.wgsl"),
        include_str!("wgsl/maps.wgsl"),
        include_str!("wgsl/steps.wgsl"),
        include_str!("wgsl/want.wgsl"),
        include_str!("../stage/wgsl/display.wgsl"),
    ];
    let own = include_str!("wgsl/labels.wgsl");
    let of_labels: &[&str] = match labels {
        LabelsInText::None => &[include_str!("wgsl/labels_none.wgsl")],
        LabelsInText::Over => &[own, include_str!("wgsl/labels_over.wgsl")],
        LabelsInText::Alone => &[own, include_str!("wgsl/labels_alone.wgsl")],
    };
    let maps = Palette::wgsl();
    let samples = samples_text();
    let text = [&volume[..], of_labels, &[&samples, &maps, vastex]].concat().join("\n");
    match told_in(labels, mode) {
        wgpu::BufferUsages::STORAGE => text.replace("var<uniform> volume_", "var<storage, read> volume_"),
        _ => text,
    }
}

/// What shaders have of [`RAY_SAMPLES`].
fn samples_text() -> String {
    format!("const VOLUME_SAMPLES: u32 = {RAY_SAMPLES}u;")
}

/// The text of the shader that shows the mean of several pictures.
pub fn mean_text() -> String {
    [include_str!("wgsl/mean.wgsl"), include_str!("../stage/wgsl/display.wgsl")].join("\n")
}

/// What the buffers are from which shaders with these labels are told. Mesa's lavapipe (to 23.0 at least)
/// writes beyond an array where conditions hang on the fourth uniform buffer of a stage or a later one, and
/// two pools have three before those of the volume.
pub(super) fn told_in(labels: LabelsInText, mode: FeedbackMode) -> wgpu::BufferUsages {
    match (labels, mode) {
        (LabelsInText::None, _) | (_, FeedbackMode::Raw) => wgpu::BufferUsages::UNIFORM,
        _ => wgpu::BufferUsages::STORAGE,
    }
}
