//! What says that the files of a directory, or one file, are those that another run read: names, sizes and
//! times.
//!
//! No file is opened. A file that is overwritten with as many bytes within one tick of the file system's
//! clock stays unnoticed, as it does to every program that goes by times.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::Path;
use std::time::UNIX_EPOCH;

use vastex_tiles::SourceKey;

use crate::image::tiff::file::pyramid::{image_in_file, without_first};

/// Directories within one another, at most: the layouts have two or three.
const DEPTH: u32 = 8;

/// Of all files below a directory, and of this version of Vastex, which makes the tiles of them.
pub(super) fn identity(directory: &Path) -> io::Result<SourceKey> {
    let place = fs::canonicalize(directory)?;
    let mut bytes = env!("CARGO_PKG_VERSION").as_bytes().to_vec();
    add_name(&mut bytes, place.as_os_str().as_encoded_bytes());
    add_directory(&mut bytes, &place, DEPTH)?;
    Ok(SourceKey::of(bytes))
}

/// Of one file or, where a path means one, of another image of a file; and of this version of Vastex.
pub(super) fn identity_of_file(path: &Path) -> io::Result<SourceKey> {
    let path = without_first(path);
    let (file, image) = image_in_file(path).map_or((path, None), |(file, name)| (file, Some(name)));
    let place = fs::canonicalize(file)?;
    let mut bytes = env!("CARGO_PKG_VERSION").as_bytes().to_vec();
    add_name(&mut bytes, place.as_os_str().as_encoded_bytes());
    add_file(&mut bytes, &fs::metadata(&place)?)?;
    if let Some(name) = image {
        add_name(&mut bytes, name.as_bytes());
    }
    Ok(SourceKey::of(bytes))
}

fn add_file(bytes: &mut Vec<u8>, found: &fs::Metadata) -> io::Result<()> {
    let modified = found.modified()?;
    let since = modified.duration_since(UNIX_EPOCH).unwrap_or_else(|before| before.duration());
    bytes.extend(found.len().to_le_bytes());
    bytes.extend(since.as_nanos().to_le_bytes());
    Ok(())
}

fn add_directory(bytes: &mut Vec<u8>, directory: &Path, depth: u32) -> io::Result<()> {
    let names = fs::read_dir(directory)?.map(|entry| Ok(entry?.file_name()));
    let mut names = names.collect::<io::Result<Vec<OsString>>>()?;
    names.sort_unstable();
    bytes.extend((names.len() as u64).to_le_bytes());
    for name in names {
        let path = directory.join(&name);
        let found = fs::metadata(&path)?;
        add_name(bytes, name.as_encoded_bytes());
        if found.is_dir() && depth > 0 {
            add_directory(bytes, &path, depth - 1)?;
            continue;
        }
        add_file(bytes, &found)?;
    }
    Ok(())
}

/// With its length, so that no two lists of names are the same bytes.
fn add_name(bytes: &mut Vec<u8>, name: &[u8]) {
    bytes.extend((name.len() as u64).to_le_bytes());
    bytes.extend(name);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;
    use std::time::Duration;

    #[test]
    fn whatever_changes_a_file_changes_the_identity() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("level0/tile.png");
        fs::create_dir(directory.path().join("level0")).unwrap();
        fs::write(&file, [1; 100]).unwrap();
        let now = || identity(directory.path()).unwrap();
        let mut seen = vec![now()];
        assert_eq!(now(), seen[0]);
        let mut check = |what: &str| {
            assert!(!seen.contains(&now()), "{what}");
            seen.push(now());
        };
        let time = File::open(&file).unwrap().metadata().unwrap().modified().unwrap();
        let set_time = |time| File::options().write(true).open(&file).unwrap().set_modified(time).unwrap();
        set_time(time + Duration::from_secs(1));
        check("a later time");
        fs::write(&file, [1; 101]).unwrap();
        set_time(time);
        check("more bytes");
        fs::rename(&file, directory.path().join("tile.png")).unwrap();
        check("another place");
        fs::write(directory.path().join("level0/other.png"), [1]).unwrap();
        check("a file more");
        let copy = directory.path().join("level0");
        assert_ne!(identity(&copy).unwrap(), now());
    }

    #[test]
    fn images_of_a_file_have_identities_of_their_own() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("a.svs");
        fs::write(&file, [1; 100]).unwrap();
        let of = |words: &str| identity_of_file(&directory.path().join(words)).unwrap();
        let all = [of("a.svs"), of("a.svs:label"), of("a.svs:macro")];
        assert_eq!(all[1], of("a.svs:label"));
        assert!(all[0] != all[1] && all[0] != all[2] && all[1] != all[2]);
    }
}
