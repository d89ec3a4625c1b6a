//! What a TIFF file has to show, by its directories alone: no texel is read for it, nor any list of tiles.

use std::path::Path;
use std::sync::Arc;

use vastex_core::Description;

use super::super::SourceError;
use super::super::pages::{Shape, described};
use super::{Levels, check_image};
use crate::image::tiff::file::TiffImage;
use crate::image::tiff::file::pyramid::{TiffOther, TiffPyramid};
use crate::image::{ImageHeader, InputFault, Notice, Profile, TiffAbout};
use crate::texels::missing::Missing;

/// What a TIFF file has to show where it lies, and what it says of that.
pub struct TiffFacts {
    description: Arc<Description>,
    levels: Vec<TiffLevel>,
    others: Vec<TiffOther>,
    about: TiffAbout,
    profile: Option<String>,
    notices: Vec<Notice>,
    conversions: Vec<String>,
    shown_bands: Vec<u16>,
    is_too_large: bool,
}

/// A level as a TIFF file stores it.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct TiffLevel {
    /// By how many times level 0 was halved, about: the number of the level in Vastex.
    pub level: u32,
    /// The level's columns and rows.
    pub size: [u32; 2],
    /// Columns and rows of the level's tiles; strips are as wide as the level.
    pub tile: [u32; 2],
    /// The name of its compression.
    pub compression: String,
}

impl TiffLevel {
    fn new(level: u32, image: &TiffImage) -> TiffLevel {
        let compression = image.compression_name();
        TiffLevel { level, size: image.size, tile: image.chunk, compression }
    }
}

impl TiffFacts {
    /// What pages of a shape would have of images that were found in the file at a path, and the levels that
    /// they would be put together from.
    pub(in crate::source) fn of(
        found: TiffPyramid,
        path: &Path,
        shape: &Shape,
    ) -> Result<(Levels, ImageHeader, TiffFacts), SourceError> {
        let at_path = |fault| SourceError::Input { path: path.into(), fault };
        let TiffPyramid { levels, others, about, .. } = found;
        let Some(Some(first)) = levels.first() else { return Err(at_path(InputFault::NoTiles)) };
        let header = first.header().map_err(at_path)?;
        check_image(first).map_err(at_path)?;
        let profile = first.profile.clone().map(|profile| Profile::icc(profile).name());
        let mut notices = header.notices.clone();
        let left = |profile: &Profile| profile.left(header.format, "tiles are shown as they are stored");
        notices.extend(header.profile.as_ref().and_then(left));
        let format = header.format;
        let shown_bands = first.shown_bands().unwrap_or_else(|| (1..=u16::from(format.channels())).collect());
        let is_usable = |image: &TiffImage| check_image(image).is_ok();
        let missing = header.nodata.map(|value| Missing::of_image(format, value));
        let levels = levels.into_iter().map(|level| level.filter(is_usable)).collect();
        let levels = Levels::new(levels, format, missing);
        let description = described(&levels, &header, false, shape)?;
        let stored = (0..).zip(&levels.levels);
        let stored = stored.filter_map(|(n, image)| image.as_ref().map(|image| TiffLevel::new(n, image)));
        let levels_of_file = stored.collect();
        let facts = TiffFacts {
            description,
            levels: levels_of_file,
            others,
            about,
            profile,
            notices,
            conversions: header.conversions(),
            shown_bands,
            is_too_large: levels.check_coarsest().is_err(),
        };
        Ok((levels, header, facts))
    }

    /// The pages that tiles of the file become, and their layer.
    pub fn description(&self) -> &Arc<Description> {
        &self.description
    }

    /// The levels that the file stores, the finest first.
    pub fn levels(&self) -> &[TiffLevel] {
        &self.levels
    }

    /// Returns true if the coarsest level is so large that the tiles cannot be opened where they lie: a build
    /// is needed.
    pub fn is_too_large(&self) -> bool {
        self.is_too_large
    }

    /// Images of the file that are no levels: thumbnails, labels, masks, further pages.
    pub fn others(&self) -> &[TiffOther] {
        &self.others
    }

    /// The bands that are shown, counted from 1: one, or those that are red, green and blue, and perhaps
    /// alpha.
    pub fn shown_bands(&self) -> &[u16] {
        &self.shown_bands
    }

    /// The name of the colour profile of the image, if it has one. Tiles do not follow it.
    pub fn profile(&self) -> Option<&str> {
        self.profile.as_deref()
    }

    /// What the file says of the size and place of its texels.
    pub fn about(&self) -> &TiffAbout {
        &self.about
    }

    /// What is shown as something else than it is stored, each as in "from inks (CMYK)".
    pub fn conversions(&self) -> &[String] {
        &self.conversions
    }

    /// What is worth knowing of the file.
    pub fn notices(&self) -> &[Notice] {
        &self.notices
    }
}
