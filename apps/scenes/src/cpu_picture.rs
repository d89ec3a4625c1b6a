//! A picture whose texture is sampled on the CPU; only where each pixel is on the surface comes from the GPU.
//!
//! It is what pictures are compared with where an ordinary texture is beyond the device.

use vastex::{CpuTexture, Textures};
use vastex_viewer::{Gpu, Picture, Pose, SceneRenderer};

use crate::error::{MOST_FIXED_TEXELS, OffscreenError};
use crate::places::places;

/// The picture of a scene of one opaque layer at a pose, for which its camera has been placed.
pub(crate) fn cpu_picture(
    shown: (&Gpu, &Textures, &SceneRenderer),
    pose: &Pose,
    texture: &CpuTexture,
    size: [u32; 2],
) -> Result<Picture, OffscreenError> {
    let (_, textures, renderer) = shown;
    let [width, height, _] = textures.texture(renderer.layer().texture())?.description().geometry.size();
    let is_fixed = renderer.anchor(textures, pose, size).is_some();
    if is_fixed && width.max(height) > MOST_FIXED_TEXELS {
        return Err(OffscreenError::TooLargeForCpu);
    }
    let texels = glam::DVec2::new(width.into(), height.into());
    let color_map = renderer.color_map();
    let mut rgba = Vec::with_capacity(size[0] as usize * size[1] as usize * 4);
    for place in places(shown, pose, size) {
        let pixel = match place {
            None => [0; 4],
            Some(place) => {
                let [ddx, ddy] = place.along.map(|along| along.to_array());
                let uv = (place.texels / texels).as_vec2().to_array();
                color_map.pixel_from_value(texture.sample_grad(uv, ddx, ddy)?, place.light)
            }
        };
        rgba.extend(pixel);
    }
    Ok(Picture { size, rgba })
}
