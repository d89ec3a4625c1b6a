//! Why a scene without a window has no picture.

use vastex_viewer::{DescribeError, HeightsError, LayerOptionsError, LayersError};

use crate::reference::ReferenceError;

/// Texels along an axis that a uv of 32 bits tells to 1/256 of one, which no colour shows.
pub(crate) const MOST_FIXED_TEXELS: u32 = 1 << 17;

/// Why a picture could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum OffscreenError {
    /// The library said so.
    #[error(transparent)]
    Vastex(vastex::Error),
    /// A layer cannot be shown as it is asked for.
    #[error(transparent)]
    Layer(#[from] LayerOptionsError),
    /// The layers cannot be shown together.
    #[error(transparent)]
    Layers(#[from] LayersError),
    /// There is no picture to compare one of several layers with.
    #[error("a picture of several layers is compared with nothing; show one opaque layer")]
    SeveralLayers,
    /// Where pixels are on a large texture is more than a uv can say, which is what the CPU samples by.
    #[error(
        "the CPU makes pictures of up to {} texels along an axis where they are drawn in fixed point; zoom out, or take a \
         smaller texture",
        MOST_FIXED_TEXELS
    )]
    TooLargeForCpu,
    /// The texture has more pages than the CPU lists to sample them, and no ordinary texture is so large.
    #[error(
        "a texture of {pages} pages is compared with nothing: an ordinary texture is not so large, and the CPU makes pictures of \
         {most} pages at most; take a smaller texture, or do without the comparison"
    )]
    TooManyPages {
        /// Its pages.
        pages: u64,
        /// How many there may be.
        most: u64,
    },
    /// The heights are not there.
    #[error(transparent)]
    Heights(#[from] HeightsError),
    /// The picture is larger than the device's textures.
    #[error("a picture of {width}x{height} pixels: this adapter draws 1 to {max} pixels per side")]
    PictureSize {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Pixels per side that the device allows.
        max: u32,
    },
    /// The prefetch sets were learnt of something else.
    #[error(
        "the prefetch sets were learnt of a texture of another shape; learn them from traces of this one"
    )]
    OtherTexture,
    /// The picture from an ordinary texture could not be had.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
}

impl From<vastex::Error> for OffscreenError {
    fn from(error: vastex::Error) -> OffscreenError {
        match error {
            vastex::Error::TooManyPages { pages, most } => OffscreenError::TooManyPages { pages, most },
            error => OffscreenError::Vastex(error),
        }
    }
}

impl From<DescribeError> for OffscreenError {
    fn from(error: DescribeError) -> OffscreenError {
        match error {
            DescribeError::Options(error) => error.into(),
            DescribeError::Layers(error) => error.into(),
            DescribeError::Heights(error) => error.into(),
        }
    }
}
