//! A small tree of files as one run of bytes, so that a directory can be damaged like a file.
//!
//! Each file: the length of its name (2 bytes), that of its content (4 bytes, little-endian both), name,
//! content.

use std::fs;
use std::io;
use std::path::{Component, Path};

/// Files that a tree may have.
const MAX_FILES: usize = 64;
/// Bytes that a name may have.
const MAX_NAME_BYTES: usize = 200;

/// Files by their relative names, in the order in which they are written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tree {
    /// Names, parted by `/`, and contents.
    pub files: Vec<(String, Vec<u8>)>,
}

impl Tree {
    /// Takes any bytes for a tree; what makes no sense is left out.
    pub fn decode(mut bytes: &[u8]) -> Tree {
        let mut files = Vec::new();
        while let Some((head, rest)) = bytes.split_first_chunk::<6>()
            && files.len() < MAX_FILES
        {
            let name_len = usize::from(u16::from_le_bytes([head[0], head[1]])).min(MAX_NAME_BYTES);
            let len = u32::from_le_bytes([head[2], head[3], head[4], head[5]]) as usize;
            let (name, rest) = rest.split_at(name_len.min(rest.len()));
            let (content, rest) = rest.split_at(len.min(rest.len()));
            files.push((String::from_utf8_lossy(name).into_owned(), content.to_vec()));
            bytes = rest;
        }
        Tree { files }
    }

    /// The tree as bytes.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (name, content) in &self.files {
            let name = &name.as_bytes()[..name.len().min(MAX_NAME_BYTES)];
            bytes.extend((name.len() as u16).to_le_bytes());
            bytes.extend((content.len() as u32).to_le_bytes());
            bytes.extend(name);
            bytes.extend(content);
        }
        bytes
    }

    /// The files under `root`.
    pub fn read(root: &Path) -> io::Result<Tree> {
        let mut tree = Tree::default();
        tree.read_under(root, "")?;
        tree.files.sort();
        Ok(tree)
    }

    fn read_under(&mut self, directory: &Path, prefix: &str) -> io::Result<()> {
        for entry in fs::read_dir(directory)? {
            let entry = entry?;
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            if entry.file_type()?.is_dir() {
                self.read_under(&entry.path(), &format!("{name}/"))?;
            } else {
                self.files.push((name, fs::read(entry.path())?));
            }
        }
        Ok(())
    }

    /// Writes the files under `root`. A name that leads out of it, or that the system does not take, is
    /// passed over.
    pub fn write(&self, root: &Path) {
        for (name, content) in &self.files {
            let relative = Path::new(name);
            let inside = relative.components().all(|part| matches!(part, Component::Normal(_)));
            let path = root.join(relative);
            if !inside || name.is_empty() || name.ends_with('/') {
                continue;
            }
            if path.parent().is_some_and(|parent| fs::create_dir_all(parent).is_ok()) {
                // A file may stand where a directory is wanted: then the tree lacks one of them.
                let _ = fs::write(&path, content);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_reads_as_it_was_written() {
        let files = vec![("a".to_owned(), vec![1, 2]), ("b/c".to_owned(), Vec::new())];
        let tree = Tree { files };
        assert_eq!(Tree::decode(&tree.encode()), tree);
        let directory = tempfile::tempdir().unwrap();
        tree.write(directory.path());
        assert_eq!(Tree::read(directory.path()).unwrap(), tree);
    }

    #[test]
    fn names_never_lead_out_of_the_tree() {
        let outer = tempfile::tempdir().unwrap();
        let root = outer.path().join("root");
        fs::create_dir(&root).unwrap();
        let absolute = outer.path().join("absolute").display().to_string();
        let names = ["../up".to_owned(), "a/../../up".to_owned(), absolute, String::new(), "a/".to_owned()];
        Tree { files: names.map(|name| (name, vec![1])).to_vec() }.write(&root);
        assert_eq!(Tree::read(outer.path()).unwrap(), Tree::default());
    }
}
