//! Why one pixel shows what it shows: asked in one frame, answered in a later one, never waited for.
//!
//! A question draws the feedback of one pixel, a window of 1x1, and brings back its 16 bytes. What is stored
//! below the pointer is answered at once ([`texel_at`]), as are the values that are in view ([`Histogram`])
//! and a small picture of all ([`Thumbnail`]).

mod first_range;
mod histogram;
mod texel;
mod thumbnail;

use vastex::diagnostics::ExplainedPixel;
use vastex::{Error, Textures};

use crate::gpu::Gpu;
use crate::stage::StageScene;
pub use first_range::first_range;
pub use histogram::Histogram;
#[cfg(feature = "egui")]
pub(crate) use texel::float_text;
pub use texel::{InspectedTexel, texel_at};
pub use thumbnail::Thumbnail;

/// Asks why a pixel of a scene shows what it shows, counted from the top left of a picture of so many pixels,
/// to a camera at this pose. Moves the camera there, between two frames.
pub fn ask<S: StageScene + ?Sized>(
    gpu: &Gpu,
    textures: &mut Textures,
    (scene, camera, pose): (&S, &S::Camera, &S::Pose),
    picture: [u32; 2],
    pixel: [u32; 2],
) -> Result<(), Error> {
    scene.place(camera, &gpu.queue, textures, pose, picture);
    let sampled = scene.sampled();
    textures.pixels().explain(picture, pixel, |pass, groups| {
        if let Some(group) = groups.get(sampled) {
            scene.draw_wanted(camera, pass, group);
        }
    })
}

/// The answers that have arrived since the last call, in the order of the questions; to be called once in
/// each frame.
pub fn answers(textures: &mut Textures) -> Result<Vec<ExplainedPixel>, Error> {
    let mut answers = Vec::new();
    while let Some(answer) = textures.pixels().poll()? {
        answers.push(answer);
    }
    Ok(answers)
}
