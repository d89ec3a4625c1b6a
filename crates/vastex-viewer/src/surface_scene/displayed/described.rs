//! What is drawn of textures: the layers that are asked to be shown, and the scene that has them.

use vastex::{Filter, TextureId, Textures};

use super::DisplaySettings;
use crate::layers::{ImageSizes, ShownLayer};
use crate::surface::{DescribeError, DisplayOptions, Relief, SceneDesc};

/// How texels of textures are shown.
#[derive(Clone, Copy, Default)]
pub(super) struct Texels {
    /// As they are, blended with nothing.
    pub(super) is_crisp: bool,
    /// In fixed point, since one of the sources is a generated planet.
    pub(super) is_generated: bool,
}

/// Columns and rows of a texture.
pub(super) fn texels_of(textures: &Textures, texture: TextureId) -> Result<[u32; 2], vastex::Error> {
    let [width, height, _] = textures.texture(texture)?.description().geometry.size();
    Ok([width, height])
}

/// The layers that are asked to be shown of textures.
pub(super) fn shown_layers(
    options: &DisplayOptions,
    is_crisp: bool,
    textures: &Textures,
    shown: &[TextureId],
) -> Result<Vec<ShownLayer>, DescribeError> {
    let mut layers = options.layers_of(textures, shown)?;
    for layer in layers.iter_mut().filter(|layer| is_crisp && layer.filter.is_none()) {
        layer.filter = Some(Filter::Nearest);
    }
    Ok(layers)
}

/// A scene with what is asked to be shown of textures, which are of images of these sizes. Its heights, if
/// the scene has any, are looked for once.
pub(super) fn described(
    DisplaySettings { scene, options, .. }: &DisplaySettings,
    Texels { is_crisp, is_generated }: Texels,
    textures: &mut Textures,
    (shown, images): (&[TextureId], &ImageSizes),
    known: &mut Option<Relief>,
) -> Result<SceneDesc, DescribeError> {
    let layers = shown_layers(options, is_crisp, textures, shown)?;
    // Those of a file of their own may have come since, and what is shown where there are none may be another
    // layer.
    let of_file = options.heights.texture.and_then(|texture| shown.get(texture));
    let is_known = |relief: &Relief| match of_file {
        Some(texture) => *texture == relief.layer().texture(),
        None => !relief.is_level(),
    };
    let relief = known.clone().filter(is_known);
    let mut described = options.describe(*scene, textures, (shown, images), layers, relief)?;
    described.always_fixed |= is_generated;
    if described.relief.is_some() {
        known.clone_from(&described.relief);
    }
    Ok(described)
}
