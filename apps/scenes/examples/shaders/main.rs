//! Writes every shader text of the project into a directory: `cargo xtask shaders DIR` runs this. Texts that
//! browsers are to refuse are handed to no device; they go to a directory of their own, if one is named.

#![expect(clippy::print_stdout, reason = "it tells what it has written")]

mod list;

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::thread;

use anyhow::{Context, Result, bail};
use vastex_wgpu::only_needed;

/// Texts that are looked through by all processors before they are written.
const AT_ONCE: usize = 256;

fn main() -> Result<()> {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(directory), refused, None) = (arguments.next(), arguments.next(), arguments.next()) else {
        bail!(
            "name one directory to write shader texts into, and one for those to be refused if they are wanted"
        );
    };
    let directories = Directories { taken: directory.into(), refused: refused.map(PathBuf::from) };
    for directory in [Some(&directories.taken), directories.refused.as_ref()].into_iter().flatten() {
        fs::create_dir_all(directory).with_context(|| format!("cannot make {}", directory.display()))?;
    }
    let (mut texts, mut open, mut result) = (HashSet::new(), Vec::new(), Ok(()));
    list::each(&mut |name, text| {
        open.push((name.to_owned(), text));
        if result.is_ok() && open.len() == AT_ONCE {
            result = write(&mut open, &directories, &mut texts);
        }
    });
    result?;
    write(&mut open, &directories, &mut texts)?;
    println!("{} shader texts in {}", texts.len(), directories.taken.display());
    Ok(())
}

/// Where texts go.
struct Directories {
    /// Those that every compiler takes.
    taken: PathBuf,
    /// Those that browsers are to refuse.
    refused: Option<PathBuf>,
}

impl Directories {
    fn of(&self, name: &str) -> Option<&Path> {
        if name.starts_with(list::TO_BE_REFUSED) { self.refused.as_deref() } else { Some(&self.taken) }
    }
}

/// Writes what a device is handed of each text, in order, unless another was the same.
fn write(
    open: &mut Vec<(String, String)>,
    directories: &Directories,
    texts: &mut HashSet<String>,
) -> Result<()> {
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for part in open.chunks_mut(AT_ONCE.div_ceil(threads)) {
            scope.spawn(|| part.iter_mut().for_each(|(_, text)| *text = only_needed(text).into_owned()));
        }
    });
    for (name, text) in open.drain(..) {
        let Some(directory) = directories.of(&name) else { continue };
        if texts.insert(text.clone()) {
            let file = directory.join(format!("{name}.wgsl"));
            fs::write(&file, text).with_context(|| format!("cannot write {}", file.display()))?;
        }
    }
    Ok(())
}
