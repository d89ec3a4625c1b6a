//! Which image goes into which layer of a container, and whether they are of one region.

use std::path::PathBuf;

use vastex_core::{Description, Layer, LayerFormat};

use super::error::ReplaceError;
use super::region::{Placed, Strip};
use super::rules::OpenImage;
use crate::texels::{LayerFilter, LayerInput};

/// An image, and the layer of a container into which it goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerImage {
    /// The layer's name; `None` if there is only one layer.
    pub layer: Option<String>,
    /// The image, or a tile directory.
    pub path: PathBuf,
    /// The format that the layer is expected to have; the image is refused if it has another one.
    pub format: Option<LayerFormat>,
    /// The filter by which the layer's levels are expected to be made; the image is refused if it was another
    /// one.
    pub filter: Option<LayerFilter>,
}

/// For the only layer.
impl<P: AsRef<std::path::Path>> From<P> for LayerImage {
    fn from(path: P) -> LayerImage {
        LayerImage { layer: None, path: path.as_ref().into(), format: None, filter: None }
    }
}

/// For the layer of that name.
impl From<LayerInput> for LayerImage {
    fn from(LayerInput { name, path, format, filter }: LayerInput) -> LayerImage {
        LayerImage { layer: Some(name), path, format, filter }
    }
}

/// The image and its layer's number, as it lies in the texture's level 0 from column and row `at` on.
pub(super) fn place<'a>(
    image: &'a LayerImage,
    at: [u32; 2],
    description: &Description,
    name: &str,
) -> Result<Placed<'a>, ReplaceError> {
    let number = layer_of(image, description, name)?;
    let layer = &description.layers[number];
    if let Some(format) = image.format.filter(|&format| format != layer.format) {
        return Err(ReplaceError::Differs {
            name: name.into(),
            layer: layer.name.clone(),
            is: layer.format.name().into(),
            not: format.name().into(),
        });
    }
    let scale = layer.scale;
    match at.iter().all(|n| n.is_multiple_of(scale)) {
        true => Ok(Placed { image: &image.path, layer: number, level: 0, at: at.map(|n| n / scale) }),
        false => Err(ReplaceError::BetweenTexels {
            path: image.path.clone(),
            layer: layer.name.clone(),
            scale,
            at,
            before: at.map(|n| n / scale * scale),
        }),
    }
}

/// The number of the layer into which an image goes; `name` is the container's.
fn layer_of(image: &LayerImage, description: &Description, name: &str) -> Result<usize, ReplaceError> {
    let layers = || list(&description.layers);
    match (&image.layer, description.layers.as_slice()) {
        (None, [_]) => Ok(0),
        (None, _) => {
            Err(ReplaceError::WhichLayer { name: name.into(), path: image.path.clone(), layers: layers() })
        }
        (Some(wanted), all) => all.iter().position(|layer| layer.name == *wanted).ok_or_else(|| {
            ReplaceError::NoSuchLayer { name: name.into(), layer: wanted.clone(), layers: layers() }
        }),
    }
}

/// The layers by name, for messages.
pub(crate) fn list(layers: &[Layer]) -> String {
    layers.iter().map(|layer| layer.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// Checks that images of different layers are of one region: as large as each other, measured in the texture.
pub(super) fn check_sizes(images: &[OpenImage<'_>]) -> Result<(), ReplaceError> {
    let scale = |image: &OpenImage<'_>| image.rules.shape.layer.scale;
    let Some(finest) = images.iter().min_by_key(|image| scale(image)) else { return Ok(()) };
    for image in images {
        let ratio = scale(image) / scale(finest);
        let expected = [0, 1].map(|axis| texels_at(&finest.strips[axis], ratio));
        let size = [image.header().width, image.header().height];
        if size != expected {
            return Err(ReplaceError::Size {
                path: image.placed.image.into(),
                size,
                expected,
                of: finest.placed.image.into(),
                region: [finest.header().width, finest.header().height],
            });
        }
    }
    Ok(())
}

/// Texels of a layer that cover those of a finer one, of which it has one along `ratio`.
fn texels_at(strips: &[Strip], ratio: u32) -> u32 {
    strips.iter().map(|strip| strip.to.end.div_ceil(ratio) - strip.to.start / ratio).sum()
}

/// Checks that every layer has one image, and those are filtered as their images are expected to be.
pub(super) fn check_layers(
    images: &[LayerImage],
    open: &[OpenImage<'_>],
    name: &str,
) -> Result<(), ReplaceError> {
    for (n, (image, found)) in images.iter().zip(open).enumerate() {
        let (layer, rules) = (&found.rules.shape.layer, &found.rules);
        if open[..n].iter().any(|other| other.rules.number == rules.number) {
            return Err(ReplaceError::Twice { path: image.path.clone(), layer: layer.name.clone() });
        }
        if let Some(filter) = image.filter.filter(|filter| filter.for_format(layer.format) != Ok(rules.named))
        {
            return Err(ReplaceError::Differs {
                name: name.into(),
                layer: layer.name.clone(),
                is: rules.named.to_string(),
                not: filter.to_string(),
            });
        }
    }
    Ok(())
}
