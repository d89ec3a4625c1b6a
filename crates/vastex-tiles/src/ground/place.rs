//! Where paths lead: whether two mean one file, and whether one lies below a directory. What writes asks
//! here, so that nothing that is read is written over.

use std::path::Path;

/// Returns true if two paths lead to one file or directory that is there. Links are followed; on Unix names
/// of one file that are not links of one another, hard links, are found by the file's number, too.
pub fn same_file(one: &Path, other: &Path) -> bool {
    let (one, other) = (named(one), named(other));
    matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
        || have_one_number(one, other)
}

/// Returns true if a file at `place`, which need not be there yet, lies below a directory or is that
/// directory. Links are followed; false where `directory` is none.
pub fn lies_in(place: &Path, directory: &Path) -> bool {
    let found = |path: &Path| named(path).canonicalize().ok();
    let Some(directory) = named(directory).canonicalize().ok().filter(|found| found.is_dir()) else {
        return false;
    };
    // Directories that are yet to be made lie where the nearest does that is there.
    place.ancestors().find_map(found).is_some_and(|nearest| nearest.starts_with(directory))
}

/// A path as the system takes it: the directory that one is in has an empty path as that above a bare name.
fn named(path: &Path) -> &Path {
    if path.as_os_str().is_empty() { Path::new(".") } else { path }
}

#[cfg(unix)]
fn have_one_number(one: &Path, other: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;

    let number = |path: &Path| std::fs::metadata(path).ok().map(|found| (found.dev(), found.ino()));
    number(one).is_some_and(|one| number(other) == Some(one))
}

#[cfg(not(unix))]
fn have_one_number(_: &Path, _: &Path) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_file_is_found_under_each_of_its_names() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        std::fs::write(at("a"), b"1").unwrap();
        std::fs::write(at("b"), b"1").unwrap();
        std::fs::create_dir(at("d")).unwrap();
        assert!(same_file(&at("a"), &at("d/../a")) && same_file(&at("d"), &at("d")));
        assert!(!same_file(&at("a"), &at("b")), "of equal bytes");
        assert!(!same_file(&at("x"), &at("x")), "nothing is there");
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(at("a"), at("link")).unwrap();
            std::fs::hard_link(at("a"), at("d/hard")).unwrap();
            assert!(same_file(&at("link"), &at("a")) && same_file(&at("d/hard"), &at("link")));
            assert!(!same_file(&at("link"), &at("b")));
        }
    }

    #[test]
    fn what_is_yet_to_be_made_lies_where_it_will() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        std::fs::create_dir_all(at("d/e")).unwrap();
        std::fs::write(at("f"), b"1").unwrap();
        for place in ["d", "d/new", "d/e/new", "d/new/deep/x", "d/e/../new"] {
            assert!(lies_in(&at(place), &at("d")), "{place}");
        }
        for place in ["", "f", "new", "new/deep/x", "d/e/../../new", "dd/x"] {
            assert!(!lies_in(&at(place), &at("d")), "{place}");
        }
        assert!(!lies_in(&at("f"), &at("f")), "a file is no directory");
        assert!(lies_in(Path::new("new"), Path::new(".")) && !lies_in(Path::new("new"), &at("d")));
        assert!(lies_in(Path::new("new"), Path::new("")) && same_file(Path::new(""), Path::new(".")));
    }
}
