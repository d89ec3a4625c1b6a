//! `vastex info` of a TIFF pyramid: its levels, its other images, and what it says of the size and place of
//! its texels.

use std::path::Path;

use anyhow::Result;
use serde::Serialize;
use vastex::TileSource;
use vastex_build::{GeoPlace, InputFault, PixelSize, SourceError, TiffLevel, TiffSource, image_in_file};

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
    #[serde(skip_serializing_if = "Option::is_none")]
    pixel_size: Option<Pixel>,
    #[serde(skip_serializing_if = "Option::is_none")]
    place: Option<Place>,
    #[serde(skip_serializing_if = "Option::is_none")]
    magnification: Option<f64>,
    /// The names of its bands, which are the samples of a texel; nothing for one that the file does not name.
    bands: Vec<Option<String>>,
    /// Those that are shown, counted from 1.
    shown_bands: Vec<u16>,
    /// As text, which tells what is no number, too.
    #[serde(skip_serializing_if = "Option::is_none")]
    nodata: Option<String>,
    notices: Vec<String>,
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
    size: [u64; 2],
}

/// Width and height of a texel of level 0.
#[derive(Serialize)]
struct Pixel {
    size: [f64; 2],
    unit: String,
}

/// Where the image lies on the Earth.
#[derive(Serialize)]
struct Place {
    /// x = m0 column + m1 row + m2, y = m3 column + m4 row + m5, from corner to corner.
    from_texels: [f64; 6],
    #[serde(skip_serializing_if = "Option::is_none")]
    epsg: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
}

/// What there is to say of a TIFF file; `None` if `path` is something else.
pub(super) fn of(path: &Path) -> Result<Option<(TiffSource, TiffSummary)>> {
    if !path.is_file() && image_in_file(path).is_none() {
        return Ok(None);
    }
    match TiffSource::open(path) {
        Ok(source) => {
            let summary = TiffSummary::new(&source);
            Ok(Some((source, summary)))
        }
        Err(SourceError::Input { fault: InputFault::NoTiles, .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

impl TiffSummary {
    fn new(source: &TiffSource) -> TiffSummary {
        let (description, about) = (source.description(), source.about());
        let geometry = &description.geometry;
        let [width, height, _] = geometry.size();
        let stored = |level: TiffLevel| {
            let TiffLevel { level, size, tile, compression, .. } = level;
            StoredLevel { level, size, tile, compression }
        };
        let pixel = |PixelSize { size, unit, .. }: &PixelSize| Pixel { size: *size, unit: unit.clone() };
        let place = |GeoPlace { from_texels, epsg, name, .. }: &GeoPlace| Place {
            from_texels: *from_texels,
            epsg: *epsg,
            name: name.clone(),
        };
        TiffSummary {
            kind: "tiff",
            size: [width, height],
            format: description.layers[0].format.name(),
            page: geometry.page()[0],
            levels: geometry.levels().len(),
            stored_levels: source.levels().into_iter().map(stored).collect(),
            other_images: source
                .others()
                .iter()
                .map(|o| Image { role: o.role, name: o.name.clone(), size: o.size })
                .collect(),
            pixel_size: about.pixel_size.as_ref().map(pixel),
            place: about.place.as_ref().map(place),
            magnification: about.magnification,
            bands: about.bands.clone(),
            shown_bands: source.shown_bands(),
            nodata: about.nodata.map(|value| value.to_string().to_lowercase()),
            notices: source.notices().iter().map(ToString::to_string).collect(),
        }
    }

    pub(super) fn text(&self) -> String {
        let rows = self.rows().into_iter();
        rows.map(|(name, value)| format!("  {name:<14}{value}")).collect::<Vec<_>>().join("\n")
    }

    /// What there is to say, by names; one without a name goes on with the one before it.
    pub(super) fn rows(&self) -> Vec<(&'static str, String)> {
        let [width, height] = self.size;
        let (levels, format, page) = (self.levels, self.format, self.page);
        let mut rows = vec![
            ("size", format!("{width} x {height} texels")),
            ("levels", format!("{levels}, of which the file stores {}", self.stored_levels.len())),
        ];
        rows.extend(self.stored_levels.iter().map(|stored| {
            let StoredLevel { level, size: [w, h], tile: [tile_w, tile_h], compression } = stored;
            ("", format!("level {level}: {w} x {h} texels, tiles of {tile_w} x {tile_h}, {compression}"))
        }));
        rows.push(("shown as", format!("{format}, in pages of {page} texels")));
        let others =
            self.other_images.iter().map(|Image { name, size: [w, h], .. }| format!("{name} {w} x {h}"));
        let others: Vec<_> = others.collect();
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
        if let Some(Pixel { size: [w, h], unit }) = &self.pixel_size {
            let size = if w == h { format!("{w} {unit}") } else { format!("{w} x {h} {unit}") };
            rows.push(("texel", size));
        }
        if let Some(times) = self.magnification {
            rows.push(("magnified", format!("{times} times")));
        }
        if let Some(value) = &self.nodata {
            rows.push((
                "no data",
                format!("{value}: left out where it is shown, unless by --layer :nodata=off"),
            ));
        }
        if let Some(Place { from_texels: [a, b, east, d, e, north], epsg, name }) = &self.place {
            let system = [epsg.map(|code| format!("EPSG:{code}")), name.clone()];
            let system: Vec<_> = system.into_iter().flatten().collect();
            let system = if system.is_empty() { "a system of its own".into() } else { system.join(", ") };
            rows.push(("system", system));
            let (w, h) = (f64::from(width), f64::from(height));
            let far = [a * w + b * h + east, d * w + e * h + north];
            rows.push(("place", format!("from {east}, {north} to {}, {}", far[0], far[1])));
        }
        rows.extend(self.notices.iter().map(|notice| ("note", notice.clone())));
        rows
    }
}
