//! Whether a directory looks like one of tiles, by a few names in it: for lists of what can be opened.

use std::path::{Path, PathBuf};

use super::quadtree::level_number;
use super::{gaia_sky, prototype};

/// Entries of a directory that count: tiles and what describes them are most of what such a directory holds.
const MOST: usize = 256;

/// Returns true if a directory may be one of tiles. Opens no file, and reads no more of lists than their
/// beginning: a directory may be none all the same, and one that holds much else may be passed over.
pub(crate) fn may_be_tiles(directory: &Path) -> bool {
    let (mut manifests, mut contexts) = (0, 0);
    for path in first(directory) {
        let is_level = || path.file_name().and_then(|name| level_number(name.to_str()?)).is_some();
        let is_of_gaia_sky = || is_level() && first(&path).any(|tile| gaia_sky::position(&tile).is_some());
        if prototype::position(&path).is_some() || is_of_gaia_sky() {
            return true;
        }
        let Some(ending) = path.extension() else { continue };
        manifests += usize::from(ending.eq_ignore_ascii_case("dzi"));
        contexts += usize::from(ending == "ctx");
    }
    // Of several a person names one.
    let has_pages = || first(&directory.join("pages")).any(|page| prototype::position(&page).is_some());
    manifests == 1 || contexts == 1 || has_pages()
}

/// The first entries of a directory; none of what is no directory.
fn first(directory: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = std::fs::read_dir(directory).into_iter().flatten();
    entries.filter_map(Result::ok).take(MOST).map(|entry| entry.path())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_directory_is_told_by_names_in_it_without_opening_a_file() {
        let sandbox = tempfile::tempdir().unwrap();
        // Nothing is in these files.
        let may_be = |name: &str, files: &[&str]| {
            for file in files {
                let path = sandbox.path().join(name).join(file);
                std::fs::create_dir_all(path.parent().unwrap()).unwrap();
                std::fs::write(path, "").unwrap();
            }
            may_be_tiles(&sandbox.path().join(name))
        };
        assert!(may_be("gaia", &["level0/tx_0_0.jpg", "level0/tx_1_0.jpg"]));
        assert!(may_be("prototype", &["0_0_0.png"]) && may_be("with-pages", &["pages/0_0_0.png"]));
        assert!(may_be("deep-zoom", &["a.dzi", "a_files/0/0_0.png"]) && may_be("celestia", &["a.ctx"]));
        for other in [&["a.dzi", "b.dzi"][..], &["a.ctx", "b.ctx"], &["level0/other.jpg"], &["photo.jpg"]] {
            assert!(!may_be(&other.concat().replace('/', "-"), other), "{other:?}");
        }
        assert!(!may_be("nothing", &[]), "there is no such directory");
        // However much a directory holds, a part of it is looked at.
        let many: Vec<String> = (0..MOST).map(|n| format!("photos/{n}.jpg")).collect();
        assert!(!may_be("full", &many.iter().map(String::as_str).collect::<Vec<_>>()));
        assert_eq!(first(&sandbox.path().join("full/photos")).count(), MOST);
        assert!(may_be("full", &["photos/more.jpg", "a.dzi"]));
        assert_eq!(first(&sandbox.path().join("full/photos")).count(), MOST);
    }
}
