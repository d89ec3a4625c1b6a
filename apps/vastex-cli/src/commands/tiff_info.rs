//! `vastex info` of a TIFF pyramid: its levels, its other images, and what else it says of itself.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use serde::Serialize;
use vastex::Description;
use vastex_build::{
    InputFault, Notice, SourceError, TiffDirectories, TiffFacts, TiffLevel, image_in_file, means_first_image,
};

use super::about_info::{self, AboutSummary, Rows};
use crate::open::Looked;

/// What `--json` prints of a TIFF pyramid.
#[derive(Serialize)]
pub(super) struct TiffSummary {
    /// Always `tiff`.
    kind: &'static str,
    /// Width and height in texels.
    size: [u32; 2],
    /// How texels are shown.
    format: &'static str,
    /// Texels of payload per side of a page.
    page: u32,
    /// How many levels there are, those included that are made when it is opened or looked at.
    levels: usize,
    /// Those that the file stores.
    stored_levels: Vec<StoredLevel>,
    /// Images of the file that are no levels.
    other_images: Vec<Image>,
    /// What the file says of it besides.
    #[serde(flatten)]
    about: AboutSummary,
    /// The names of its bands, which are the samples of a texel; nothing for one that the file does not name.
    bands: Vec<Option<String>>,
    /// Those that are shown, counted from 1.
    shown_bands: Vec<u16>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) converted: Vec<String>,
    notices: Vec<String>,
    /// True if it is built before it is shown, and the build has other levels and pages than its tiles.
    #[serde(skip)]
    is_built_first: bool,
}

#[derive(Serialize)]
struct StoredLevel {
    level: u32,
    size: [u32; 2],
    /// Columns and rows of a tile, or of a strip.
    tile: [u32; 2],
    compression: String,
}

#[derive(Serialize)]
struct Image {
    role: &'static str,
    /// What stands after the file's path and a colon to open it.
    name: String,
    /// What the file calls it.
    #[serde(skip_serializing_if = "Option::is_none")]
    title: Option<String>,
    size: [u64; 2],
}

/// What there is to say of a TIFF file that was looked at; `None` if `path` is something else.
pub(super) fn of(path: &Path, looked: &Looked) -> Result<Option<(Arc<Description>, TiffSummary)>> {
    if !path.is_file() && image_in_file(path).is_none() {
        return Ok(None);
    }
    let facts = |read: &TiffDirectories| Ok::<_, SourceError>((read.facts()?, read.lacks_levels()));
    let anew = || TiffDirectories::read(path).and_then(|read| facts(&read));
    match looked.tiff(path).map_or_else(anew, facts) {
        Ok((found, lacks_levels)) => {
            let may_be_built = image_in_file(path).is_none_or(|(_, name)| means_first_image(name));
            let is_built_first = lacks_levels || found.is_too_large() && may_be_built;
            Ok(Some((found.description().clone(), TiffSummary::new(&found, is_built_first))))
        }
        Err(SourceError::Input { fault: InputFault::NoTiles, .. }) => Ok(None),
        Err(error) => truer(path, error).map_or(Ok(None), Err),
    }
}

/// What is said of a file that cannot be shown where it lies: what a build would say, if no build could read
/// it either, since nobody is to be advised to build it. `None` where one could: such a file is built before
/// it is shown, and told of as other images are.
fn truer(path: &Path, error: SourceError) -> Option<anyhow::Error> {
    let is_unsupported = |fault: &InputFault| matches!(fault, InputFault::Unsupported { .. });
    let is_advised = matches!(&error, SourceError::Input { fault, .. } if is_unsupported(fault));
    match vastex_build::open(path) {
        Ok(_) if is_advised => None,
        Err(fault) if is_advised && !is_unsupported(&fault) && image_in_file(path).is_none() => {
            Some(anyhow::Error::new(fault).context(path.display().to_string()))
        }
        _ => Some(error.into()),
    }
}

impl TiffSummary {
    fn new(facts: &TiffFacts, is_built_first: bool) -> TiffSummary {
        let (description, about) = (facts.description(), facts.about());
        let geometry = &description.geometry;
        let [width, height, _] = geometry.size();
        let stored = |level: &TiffLevel| {
            let TiffLevel { level, size, tile, compression, .. } = level.clone();
            StoredLevel { level, size, tile, compression }
        };
        // A build follows the profile, or says itself why it does not.
        let is_true = |notice: &&Notice| !is_built_first || !matches!(notice, Notice::ProfileIgnored { .. });
        TiffSummary {
            kind: "tiff",
            size: [width, height],
            format: description.layers[0].format.name(),
            page: geometry.page()[0],
            levels: geometry.levels().len(),
            stored_levels: facts.levels().iter().map(stored).collect(),
            other_images: facts
                .others()
                .iter()
                .map(|o| Image { role: o.role, name: o.name.clone(), title: o.title.clone(), size: o.size })
                .collect(),
            about: AboutSummary::new(about, facts.profile().map(str::to_owned)),
            bands: about.bands.clone(),
            shown_bands: facts.shown_bands().to_vec(),
            notices: facts.notices().iter().filter(is_true).map(ToString::to_string).collect(),
            converted: facts.conversions().to_vec(),
            is_built_first,
        }
    }

    pub(super) fn text(&self) -> String {
        about_info::text_of(&self.rows())
    }

    /// What there is to say, by names; one without a name goes on with the one before it.
    pub(super) fn rows(&self) -> Rows {
        let [width, height] = self.size;
        let (levels, format, page) = (self.levels, self.format, self.page);
        let stored = self.stored_levels.len();
        let mut rows = vec![("size", format!("{width} x {height} texels"))];
        rows.push(match self.is_built_first {
            true => (
                "built",
                format!("into the cache before it is shown, with all levels; the file stores {stored}"),
            ),
            false => ("levels", format!("{levels}, of which the file stores {stored}")),
        });
        rows.extend(self.stored_levels.iter().map(|stored| {
            let StoredLevel { level, size: [w, h], tile: [tile_w, tile_h], compression } = stored;
            ("", format!("level {level}: {w} x {h} texels, tiles of {tile_w} x {tile_h}, {compression}"))
        }));
        if !self.is_built_first {
            rows.push(("shown as", format!("{format}, in pages of {page} texels")));
        }
        let other = |Image { name, title, size: [w, h], .. }: &Image| match title {
            Some(title) => format!("{name} ({title:?}) {w} x {h}"),
            None => format!("{name} {w} x {h}"),
        };
        let others: Vec<_> = self.other_images.iter().map(other).collect();
        if !others.is_empty() {
            rows.push(("other images", format!("{}; FILE:NAME opens one", others.join(", "))));
        }
        let named = |(n, name): (usize, &Option<String>)| match name {
            Some(name) => format!("{n} {name}"),
            None => n.to_string(),
        };
        if self.bands.len() > 4 || self.bands.iter().any(Option::is_some) {
            let names: Vec<_> = (1..).zip(&self.bands).map(named).collect();
            rows.push(("bands", names.join(", ")));
            let shown: Vec<_> = self.shown_bands.iter().map(ToString::to_string).collect();
            rows.push(("", format!("{} shown; FILE:bands=3,2,1 shows others", shown.join(", "))));
        }
        let mut rows: Rows = rows.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        rows.extend(about_info::converted_rows(&self.converted));
        rows.extend(self.about.rows(self.size));
        rows.extend(self.notices.iter().map(|notice| ("note".to_owned(), notice.clone())));
        rows.extend(self.about.words());
        rows
    }
}
