//! Where a command writes, beside what it reads: nothing is written over a file that is read, whatever its
//! name, nor into a directory that is, and no two things go into one file.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use vastex_tiles::{lies_in, same_file};

use crate::open;
use crate::pictures::NumberedName;

/// What is written that may be many files, if its name has a place for a number.
pub(crate) const PICTURE: &str = "picture";

/// What a command reads.
pub(crate) struct Inputs(Vec<Input>);

struct Input {
    /// As the command line has it.
    named: PathBuf,
    /// The file that is meant, and all that is read with it.
    files: Vec<PathBuf>,
}

/// Where one thing is to be written.
struct Place<'a> {
    what: &'a str,
    path: &'a Path,
    /// The names of many pictures.
    numbered: Option<NumberedName>,
}

impl Inputs {
    /// All files of the sources of a command, and whatever else it reads.
    pub(crate) fn of<'a>(named: impl IntoIterator<Item = &'a Path>) -> Inputs {
        let input = |named: &Path| Input { named: named.into(), files: open::files_of(named) };
        Inputs(named.into_iter().map(input).collect())
    }

    /// Fails where something would be written over what is read, or two things into one file. Each place has
    /// the name of what is written there; what goes to stdout (`-`) has none.
    pub(crate) fn check(&self, places: &[(&str, Option<&Path>)]) -> Result<()> {
        let mut checked: Vec<Place<'_>> = Vec::new();
        for &(what, path) in places {
            let Some(path) = path.filter(|path| path.as_os_str() != "-") else { continue };
            let numbered = if what == PICTURE { NumberedName::of(path)? } else { None };
            let place = Place { what, path, numbered };
            self.0.iter().try_for_each(|input| input.check(&place))?;
            if let Some(other) = checked.iter().find(|other| other.is_at(path)) {
                bail!(
                    "{}: the {} and the {what} would be one file; choose another name for one of them",
                    path.display(),
                    other.what
                );
            }
            checked.push(place);
        }
        Ok(())
    }
}

impl Input {
    fn check(&self, place: &Place<'_>) -> Result<()> {
        let (named, path) = (self.named.display(), place.path.display());
        for (nth, file) in self.files.iter().enumerate() {
            if place.is_at(file) {
                match nth {
                    0 => bail!(
                        "{named}: is the source as well as the output; choose another name for the output"
                    ),
                    _ => bail!(
                        "{path}: the {} would be written over {}, which is read with {named}; choose another name for the output",
                        place.what,
                        file.display()
                    ),
                }
            }
            if lies_in(place.path, file) {
                bail!(
                    "{path}: the {} would lie in {}, whose files are read; choose another place for the output",
                    place.what,
                    file.display()
                );
            }
        }
        Ok(())
    }
}

impl Place<'_> {
    /// Returns true if a file, which need not be there, is one that is to be written here.
    fn is_at(&self, file: &Path) -> bool {
        if let Some(name) = &self.numbered {
            return name.may_name(file) || file.canonicalize().is_ok_and(|file| name.may_name(&file));
        }
        let directory = |path: &Path| match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
            _ => PathBuf::from("."),
        };
        same_file(file, self.path)
            || (file.file_name() == self.path.file_name()
                && same_file(&directory(file), &directory(self.path)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_file_is_known_by_whatever_name() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        std::fs::create_dir(at("d")).unwrap();
        std::fs::write(at("image.png"), b"").unwrap();
        let image = at("image.png");
        let inputs = Inputs::of([&*image]);
        let said = |places: &[(&str, PathBuf)]| {
            let places: Vec<_> = places.iter().map(|(what, path)| (*what, Some(&**path))).collect();
            inputs.check(&places).err().map(|error| error.to_string()).unwrap_or_default()
        };
        assert_eq!(said(&[(PICTURE, at("a.png")), ("trace", at("b")), ("report", at("d/a.png"))]), "");
        assert!(said(&[("trace", at("d/../image.png"))]).contains("is the source as well as the output"));
        // Nothing is there yet.
        let both = said(&[(PICTURE, at("a.png")), ("trace", at("d/../a.png"))]);
        assert!(both.contains("the picture and the trace would be one file"), "{both}");
        let both = said(&[(PICTURE, at("a-%d.csv")), ("CSV file", at("a-17.csv"))]);
        assert!(both.contains("the picture and the CSV file would be one file"), "{both}");
        assert_eq!(said(&[(PICTURE, "-".into()), ("trace", "-".into())]), "");
    }

    #[test]
    #[cfg(unix)]
    fn numbers_find_links_too() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        std::fs::create_dir(at("d")).unwrap();
        std::fs::write(at("frame-3.png"), b"").unwrap();
        std::os::unix::fs::symlink(at("frame-3.png"), at("d/link.png")).unwrap();
        let link = at("d/link.png");
        let numbered = at("frame-%d.png");
        let refused = Inputs::of([&*link]).check(&[(PICTURE, Some(&numbered))]);
        assert!(refused.unwrap_err().to_string().contains("is the source as well as the output"));
    }
}
