//! Writes every shader text of the project into a directory: `cargo xtask shaders DIR` runs this.

#![expect(clippy::print_stdout, reason = "it tells what it has written")]

mod list;

use std::collections::HashSet;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};

fn main() -> Result<()> {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(directory), None) = (arguments.next(), arguments.next()) else {
        bail!("name one directory to write shader texts into");
    };
    let directory = PathBuf::from(directory);
    fs::create_dir_all(&directory).with_context(|| format!("cannot make {}", directory.display()))?;
    let (mut texts, mut result) = (HashSet::new(), Ok(()));
    list::each(&mut |name, text| {
        let text = vastex_wgpu::only_needed(&text).into_owned();
        if result.is_ok() && !texts.contains(&text) {
            let file = directory.join(format!("{name}.wgsl"));
            result = fs::write(&file, &text).with_context(|| format!("cannot write {}", file.display()));
            texts.insert(text);
        }
    });
    result?;
    println!("{} shader texts in {}", texts.len(), directory.display());
    Ok(())
}
