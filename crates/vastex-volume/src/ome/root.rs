//! What lies under a key: an image, an array, or something that lists images.

use std::collections::BTreeSet;
use std::sync::Arc;

use serde_json::Value;

use crate::fault::{Oddities, VolumeError};
use crate::json::{list, read_json, text};
use crate::keys::{KeyStore, Span, join, parts};
use crate::zarr::shortened;

/// Images of a plate, or of a file with several, that are listed at most.
const MOST_IMAGES: usize = 100_000;
/// Bytes that the path of an image may have.
const MOST_PATH: usize = 1024;

/// What lies under a key.
pub(crate) enum Root {
    /// An image: the metadata that have `multiscales`.
    Image(ImageRoot),
    /// An array without metadata of an image.
    Array,
    /// Images below the key.
    Images {
        /// What lists them.
        what: &'static str,
        /// The images' paths below the key.
        paths: Vec<String>,
        oddities: Vec<String>,
    },
    /// A group of Zarr in which nothing is known.
    Group,
    /// No Zarr at all.
    Nothing,
}

/// The metadata of an image.
pub(crate) struct ImageRoot {
    pub(super) attributes: Value,
    pub(super) version: Option<String>,
    pub(super) oddities: Oddities,
}

/// Finds out what lies under a key.
pub(crate) async fn open_root(keys: &Arc<dyn KeyStore>, prefix: &str) -> Result<Root, VolumeError> {
    let mut oddities = Oddities::default();
    let mut node = read_json(&**keys, &join(prefix, "zarr.json"), &mut oddities).await?;
    let old = read_json(&**keys, &join(prefix, ".zattrs"), &mut oddities).await?;
    let is_array = match &node {
        Some(node) => text(node, "node_type") == Some("array"),
        None => has(keys, &join(prefix, ".zarray")).await?,
    };
    let mut new = node.as_mut().and_then(|node| node.get_mut("attributes")).map(Value::take);
    // Version 0.5 has all of it below `ome`; drafts of it, and 0.4, have it at the top.
    let ome = new.as_mut().and_then(|new| new.get_mut("ome")).map(Value::take);
    let candidates = [ome, new, old];
    let mut candidates: Vec<Value> = candidates.into_iter().flatten().collect();
    let known = ["multiscales", "plate", "well", "bioformats2raw.layout", "labels", "series"];
    let place = candidates.iter().position(|found| known.iter().any(|key| found.get(key).is_some()));
    let Some(place) = place else {
        if is_array {
            return Ok(Root::Array);
        }
        let is_group = node.is_some() || has(keys, &join(prefix, ".zgroup")).await? || !candidates.is_empty();
        return Ok(if is_group { Root::Group } else { Root::Nothing });
    };
    if place == 1 && node.is_some() && candidates.len() > 1 && candidates[0].get("version").is_some() {
        oddities.push(
            "the metadata stand beside 'ome', where version 0.5 has them within; they are taken".into(),
        );
    }
    let found = candidates.swap_remove(place);
    if !list(&found, "multiscales").is_empty() {
        let version = version_of(&found);
        return Ok(Root::Image(ImageRoot { attributes: found, version, oddities }));
    }
    list_images(keys, prefix, &found, oddities).await
}

async fn has(keys: &Arc<dyn KeyStore>, key: &str) -> Result<bool, VolumeError> {
    Ok(keys.read(key, Span::Range { offset: 0, len: 0 }).await?.is_some())
}

fn version_of(found: &Value) -> Option<String> {
    let own = list(found, "multiscales").first().and_then(|first| first.get("version"));
    let version = found.get("version").or(own)?;
    Some(version.as_str().map_or_else(|| version.to_string(), str::to_owned))
}

async fn list_images(
    keys: &Arc<dyn KeyStore>,
    prefix: &str,
    found: &Value,
    mut oddities: Oddities,
) -> Result<Root, VolumeError> {
    let (what, paths) = if let Some(plate) = found.get("plate") {
        let wells = list(plate, "wells").iter().filter_map(|well| text(well, "path"));
        let (mut paths, mut read) = (Vec::new(), BTreeSet::new());
        for well in wells.take(MOST_IMAGES) {
            if paths.len() > MOST_IMAGES {
                break;
            }
            if parts(well).is_none() {
                oddities
                    .push(format!("the well '{}' is not below the plate; it is left out", shortened(well)));
                continue;
            }
            if well.len() > MOST_PATH || !read.insert(parts(well)) {
                oddities.push(format!(
                    "the well '{}' is listed twice, or has too long a path; it is left out",
                    shortened(well)
                ));
                continue;
            }
            match images_of_well(keys, prefix, well, &mut oddities).await {
                Ok(of_well) => paths.extend(of_well),
                // The others are what they are.
                Err(error) => {
                    oddities.push(format!("the well '{}' is left out: {error}", shortened(well)));
                }
            }
        }
        ("a plate", paths)
    } else if let Some(well) = found.get("well") {
        ("a well", paths_in(well, ""))
    } else if found.get("labels").is_some() {
        let names = list(found, "labels").iter().filter_map(Value::as_str).map(str::to_owned);
        ("a group of labels", names.collect())
    } else {
        ("a file of several images", series(keys, prefix, found, &mut oddities).await?)
    };
    let mut paths = paths;
    // Who opens one of them opens what lies there.
    paths.retain(|path| {
        let lies_below = parts(path).is_some_and(|parts| !parts.is_empty());
        if !lies_below {
            oddities
                .push(format!("the image '{}' is not below what lists it; it is left out", shortened(path)));
        }
        // Names are written to terminals, which do what such characters say.
        let is_plain = !path.contains(char::is_control);
        if lies_below && !is_plain {
            oddities.push(format!("the image '{}' has control characters; it is left out", shortened(path)));
        }
        lies_below && is_plain
    });
    if paths.len() > MOST_IMAGES {
        oddities.push(format!("more than {MOST_IMAGES} images are listed; the first of them are taken"));
        paths.truncate(MOST_IMAGES);
    }
    Ok(Root::Images { what, paths, oddities: oddities.into_vec() })
}

/// The images of a well, by its own metadata; where it has none, its first field is named.
async fn images_of_well(
    keys: &Arc<dyn KeyStore>,
    prefix: &str,
    well: &str,
    oddities: &mut Oddities,
) -> Result<Vec<String>, VolumeError> {
    let key = join(prefix, well);
    let node = read_json(&**keys, &join(&key, "zarr.json"), oddities).await?;
    let old = read_json(&**keys, &join(&key, ".zattrs"), oddities).await?;
    let new = node.as_ref().and_then(|node| node.get("attributes"));
    let found = [new.and_then(|new| new.get("ome")), new, old.as_ref()];
    let found = found.into_iter().flatten().find_map(|found| found.get("well"));
    match found {
        Some(found) => Ok(paths_in(found, well)),
        None => {
            oddities.push(format!(
                "the well '{}' is listed and is not there, or says nothing; it is left out",
                shortened(well)
            ));
            Ok(Vec::new())
        }
    }
}

fn paths_in(well: &Value, below: &str) -> Vec<String> {
    let images = list(well, "images").iter().filter_map(|image| text(image, "path"));
    let short = images.filter(|image| below.len() + image.len() < MOST_PATH);
    short.take(MOST_IMAGES + 1).map(|image| join(below, image)).collect()
}

/// The images of a file that bioformats2raw made: those that the group `OME` names, else 0, 1, 2 and so on.
async fn series(
    keys: &Arc<dyn KeyStore>,
    prefix: &str,
    found: &Value,
    oddities: &mut Oddities,
) -> Result<Vec<String>, VolumeError> {
    let own = list(found, "series");
    let named = |list: &[Value]| -> Vec<String> {
        list.iter().filter_map(Value::as_str).map(str::to_owned).collect()
    };
    if !own.is_empty() {
        return Ok(named(own));
    }
    let node = read_json(&**keys, &join(prefix, "OME/zarr.json"), oddities).await?;
    let old = read_json(&**keys, &join(prefix, "OME/.zattrs"), oddities).await?;
    let new = node.as_ref().and_then(|node| node.get("attributes"));
    let of_group = [new.and_then(|new| new.get("ome")), new, old.as_ref()];
    let listed = of_group.into_iter().flatten().find(|found| !list(found, "series").is_empty());
    if let Some(listed) = listed {
        return Ok(named(list(listed, "series")));
    }
    let mut numbers: Vec<u64> =
        keys.groups(prefix, MOST_IMAGES).await?.iter().filter_map(|name| name.parse().ok()).collect();
    numbers.sort_unstable();
    Ok(numbers.iter().map(u64::to_string).collect())
}
