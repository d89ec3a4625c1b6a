//! `vastex info` of an image that nobody built: what its header says.

use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;
use vastex_build::Profile;

use super::about_info::{AboutSummary, Rows, converted_rows, text_of};
use crate::open::Looked;
use crate::open::image::is_no_image;
use crate::{open, report};

/// What `--json` prints of an image.
#[derive(Serialize)]
pub(super) struct ImageSummary {
    /// Always `image`.
    kind: &'static str,
    /// Width and height in texels.
    size: [u32; 2],
    /// What its texels are, such as `8-bit RGB`.
    texels: String,
    /// True if the file says that its colours are linear, not sRGB-encoded.
    is_linear: bool,
    /// Bytes of memory that reading it takes.
    memory: u64,
    /// What the file says of it besides.
    #[serde(flatten)]
    about: AboutSummary,
    /// What is shown as something else than it is stored.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) converted: Vec<String>,
    /// What is left out, and what reading it costs.
    notices: Vec<String>,
}

/// Of an image that was looked at; `None` if the file is something else.
pub(super) fn of(path: &Path, looked: &Looked) -> Result<Option<ImageSummary>> {
    let is_file = path.is_file() || vastex_build::image_in_file(path).is_some();
    if !is_file || open::is_directory_of_tiles(path) {
        return Ok(None);
    }
    match vastex_build::open(path) {
        Ok(reader) => {
            let header = reader.header();
            let profile = header.profile.as_ref().map(Profile::name);
            let about = match looked.tiff(path) {
                Some(tiff) => AboutSummary::new(tiff.about(), profile),
                None => AboutSummary::of_profile(profile),
            };
            Ok(Some(ImageSummary {
                kind: "image",
                size: [header.width, header.height],
                texels: header.format.to_string(),
                is_linear: header.linear,
                memory: header.memory,
                about,
                notices: header.notices.iter().map(ToString::to_string).collect(),
                converted: vastex_build::in_srgb(reader).header().conversions(),
            }))
        }
        Err(fault) if is_no_image(&fault) => Ok(None),
        Err(fault) => Err(fault).with_context(|| path.display().to_string()),
    }
}

impl ImageSummary {
    /// What there is to say, by names.
    #[cfg(feature = "view")]
    pub(super) fn rows(&self) -> Rows {
        let ImageSummary { size, texels, is_linear, memory, about, converted, notices, .. } = self;
        let [width, height] = size;
        let linear = if *is_linear { ", linear" } else { "" };
        let rows = [
            ("size", format!("{width} x {height} texels")),
            ("texels", format!("{texels}{linear}")),
            ("reading", format!("takes {} of memory", report::bytes(*memory))),
        ];
        let mut rows: Rows = rows.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        rows.extend(converted_rows(converted));
        rows.extend(about.rows(*size));
        rows.extend(notices.iter().map(|notice| ("note".to_owned(), notice.clone())));
        rows.extend(about.words());
        rows
    }

    pub(super) fn text(&self) -> String {
        let ImageSummary { size, texels, is_linear, memory, about, converted, notices, .. } = self;
        let [width, height] = size;
        let linear = if *is_linear { ", linear" } else { "" };
        let mut text = format!(
            "{width}x{height} texels of {texels}{linear}\n\
             reading it takes {} of memory\n\
             no container: `vastex view` and `render` build it into their cache when it is shown for the first time\n",
            report::bytes(*memory)
        );
        notices.iter().for_each(|notice| text.push_str(&format!("note: {notice}\n")));
        let mut rows: Rows = converted_rows(converted).collect();
        rows.extend(about.rows(*size));
        rows.extend(about.words());
        text.push_str(&text_of(&rows));
        text
    }
}
