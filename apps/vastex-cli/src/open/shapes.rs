//! Shapes of a GeoJSON file, in the texels of the image that they lie over.
//!
//! Positions are texels where the image has no place on the Earth. Of a GeoTIFF they are coordinates: by the
//! standard degrees (EPSG:4326), or of the system that a member `crs` names, as older files have it. Nothing
//! is reprojected.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use glam::DAffine2;
use vastex_viewer::panels::{GeoJson, Shapes};

/// Bytes of a file that are read, at most: it is held some times over while it is read.
const MOST_BYTES: u64 = 256 << 20;
/// The number of degrees of longitude and latitude in EPSG's list.
const DEGREES: u16 = 4326;

/// Reads the shapes of a file that lie over an image, as long as `goes_on` says so. Fails where it cannot be
/// read, is no GeoJSON, has another coordinate system than the image, or shall not go on.
pub(crate) fn shapes_over(image: &Path, path: &Path, goes_on: impl Fn() -> bool) -> Result<Shapes> {
    read(image, path, goes_on).with_context(|| path.display().to_string())
}

/// Refuses what is no file of shapes before it is opened: a pipe is waited for, and a device has no end.
pub(crate) fn check_shapes(path: &Path) -> Result<()> {
    let found = std::fs::metadata(path).context("cannot be read; check the path")?;
    if !found.is_file() {
        bail!("is no file; name a file of GeoJSON");
    }
    if found.len() > MOST_BYTES {
        bail!("has {} bytes; shapes of up to {MOST_BYTES} can be shown, so split the file", found.len());
    }
    Ok(())
}

fn read(image: &Path, path: &Path, goes_on: impl Fn() -> bool) -> Result<Shapes> {
    check_shapes(path)?;
    let mut text = String::new();
    // What it says of its length may have changed.
    let file = File::open(path).context("cannot be read; check the path")?;
    let bytes = file.take(MOST_BYTES + 1).read_to_string(&mut text).context("cannot be read as text")?;
    if bytes as u64 > MOST_BYTES {
        bail!("grows while it is read; wait until it is whole");
    }
    let found = GeoJson::read(&text, goes_on)?;
    drop(text);
    let texels = match place_of(image) {
        None => DAffine2::IDENTITY,
        Some(place) => {
            let (of_image, of_shapes) = (place.1, number_of(found.system().unwrap_or_default()));
            if of_image.is_some_and(|number| number != of_shapes) {
                let number = of_image.unwrap_or_default();
                return Err(anyhow!(
                    "its coordinates are of EPSG:{of_shapes}, those of the image of EPSG:{number}; \
                     `ogr2ogr -t_srs EPSG:{number} OUT.geojson FILE` makes them the same"
                ));
            }
            place.0.inverse()
        }
    };
    if !texels.is_finite() {
        return Err(anyhow!("the image says nothing of where its texels lie; remove its place or mend it"));
    }
    Ok(found.shapes(|position| texels.transform_point2(position))?)
}

/// From texels to coordinates, and the number of their system.
#[cfg(feature = "build")]
fn place_of(image: &Path) -> Option<(DAffine2, Option<u16>)> {
    let place = super::about::tiff_about(image)?.place?;
    let [a, b, c, d, e, f] = place.from_texels;
    let matrix = glam::DMat2::from_cols_array(&[a, d, b, e]);
    Some((DAffine2::from_mat2_translation(matrix, [c, f].into()), place.epsg))
}

/// Without the readers of `vastex build` no file has a place.
#[cfg(not(feature = "build"))]
fn place_of(_: &Path) -> Option<(DAffine2, Option<u16>)> {
    None
}

/// The number of the coordinate system that a text calls so.
fn number_of(name: &str) -> u16 {
    let number = name.contains("EPSG").then(|| name.rsplit(':').next()?.parse().ok()).flatten();
    number.unwrap_or(DEGREES)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn systems_are_those_of_the_text() {
        assert_eq!(["urn:ogc:def:crs:EPSG::32633", "EPSG:3857"].map(number_of), [32633, 3857]);
        assert_eq!(["urn:ogc:def:crs:OGC:1.3:CRS84", "", "EPSG:x"].map(number_of), [DEGREES; 3]);
    }

    /// Neither is opened: a pipe would be waited for, and a device has no end.
    #[cfg(unix)]
    #[test]
    fn what_is_no_file_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let pipe = directory.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for path in [Path::new("/dev/zero"), &pipe, directory.path()] {
            let error = format!("{:#}", shapes_over(Path::new("a.png"), path, || true).unwrap_err());
            assert!(error.contains("is no file") && error.contains(&*path.to_string_lossy()), "{error}");
        }
    }

    /// The place of a GeoTIFF in metres, and a picture without one.
    #[cfg(feature = "build")]
    #[test]
    fn positions_are_texels_or_coordinates_of_the_image() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.geojson");
        let assets = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets");
        let cog = format!("{assets}/tiff/cog-deflate-u16.tif");
        let plain = format!("{assets}/earth-elevation-1080x540-u16.png");
        let over = |image: &str, text: &str| {
            std::fs::write(&path, text).unwrap();
            shapes_over(Path::new(image), &path, || true)
        };
        let point = r#"{"type": "Point", "coordinates": [500020, 4599970]"#;
        let metres = format!(r#"{point}, "crs": {{"properties": {{"name": "EPSG:32633"}}}}}}"#);
        let texel = r#"{"type": "Point", "coordinates": [2, 3]}"#;
        assert_eq!(over(&cog, &metres).unwrap(), over(&plain, texel).unwrap());
        let error = format!("{:#}", over(&cog, texel).unwrap_err());
        assert!(error.contains("EPSG:4326, those of the image of EPSG:32633"), "{error}");
        // The same texels where bands of the file are shown, and where a container was built of it.
        let bands = format!("{cog}:bands=1");
        assert_eq!(over(&bands, &metres).unwrap(), over(&plain, texel).unwrap());
        let built = directory.path().join("a.vastex");
        let options = vastex_build::BuildOptions::default();
        vastex_build::build(&[Path::new(&cog)], &built, &options, &()).unwrap();
        assert_eq!(over(built.to_str().unwrap(), &metres).unwrap(), over(&plain, texel).unwrap());
        let error = format!("{:#}", over(&plain, "{").unwrap_err());
        assert!(error.contains("a.geojson") && error.contains("line 1"), "{error}");
    }
}
