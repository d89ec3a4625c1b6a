//! Whether the documentation of crate `vastex` can be read alone: every type in a public signature has a page
//! there, and no sentence leads to a crate that `vastex` does not show.
//!
//! Rustdoc links each name to the page that the crate has of it, or else to the page of the crate that
//! defines it; so a link out of the crate into another one of the workspace is a name that applications
//! cannot write.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

/// Pages that there are at least: fewer mean that this is not the documentation of the whole crate.
const LEAST_PAGES: usize = 100;

/// Fails with each page under `documentation`, that of the crate, that leads into another crate of the
/// workspace, or names an item by its path from an inner crate.
pub(crate) fn check(documentation: &Path) -> Result<()> {
    let pages = pages(documentation)?;
    ensure!(
        pages.len() >= LEAST_PAGES,
        "{} has only {} pages; run `cargo doc`",
        documentation.display(),
        pages.len()
    );
    let mut faults = Vec::new();
    for page in pages {
        let text = fs::read_to_string(&page).with_context(|| format!("cannot read {}", page.display()))?;
        let name = page.strip_prefix(documentation).unwrap_or(&page).display().to_string();
        faults.extend(faults_of(&text).into_iter().map(|fault| format!("{name}: {fault}")));
    }
    faults.sort();
    faults.dedup();
    match faults.len() {
        0 => Ok(()),
        count => bail!(
            "{count} places in the documentation of crate vastex lead out of it; re-export what is linked, or say it without the \
             link:\n{}",
            faults.join("\n")
        ),
    }
}

/// Every page under a directory.
fn pages(directory: &Path) -> Result<Vec<PathBuf>> {
    let mut pages = Vec::new();
    let mut directories = vec![directory.to_owned()];
    while let Some(directory) = directories.pop() {
        let entries =
            fs::read_dir(&directory).with_context(|| format!("cannot read {}", directory.display()))?;
        for entry in entries {
            let path = entry?.path();
            match path.extension() {
                _ if path.is_dir() => directories.push(path),
                Some(ending) if ending == "html" => pages.push(path),
                _ => {}
            }
        }
    }
    Ok(pages)
}

/// Where a page leads out of the crate, and what it names by a path that is none of the crate's.
fn faults_of(page: &str) -> Vec<String> {
    // Rustdoc lists whoever implements a trait, of all crates.
    let own = page.split("id=\"implementors\"").next().unwrap_or_default();
    let mut faults = Vec::new();
    for link in own.split("href=\"").skip(1).filter_map(|rest| rest.split('"').next()) {
        let path = link.trim_start_matches("../");
        if path.len() < link.len() && path.starts_with("vastex_") {
            faults.push(format!("a link to {path}"));
        }
    }
    for code in own.split("<code>crate::").skip(1).filter_map(|rest| rest.split("</code>").next()) {
        faults.push(format!("crate::{code} as a text; write [`{code}`](crate::{code})"));
    }
    faults
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_leads_out_of_the_crate_is_found() {
        let page = "<a href=\"struct.Textures.html\">Textures</a> <a href=\"../src/vastex_core/lib.rs.html\">source</a>\
                    <a href=\"../static.files/x.css\">x</a> <code>Textures</code>";
        assert_eq!(faults_of(page), Vec::<String>::new());
        let others = "<a href=\"../../vastex_core/pager/struct.Pager.html\"><code>crate::Pager</code></a>";
        let found = faults_of(&format!("{page}{others}"));
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].ends_with("vastex_core/pager/struct.Pager.html"), "{found:?}");
        assert!(found[1].starts_with("crate::Pager"), "{found:?}");
        // Whoever implements a trait is listed by rustdoc itself.
        let implementors = format!("{page}<h2 id=\"implementors\">{others}");
        assert_eq!(faults_of(&implementors), Vec::<String>::new());
    }

    #[test]
    fn a_documentation_that_is_not_there_is_a_fault() {
        let directory = std::env::temp_dir().join(format!("xtask-facade-{}", std::process::id()));
        assert!(check(&directory).is_err());
        fs::create_dir_all(directory.join("source")).unwrap();
        fs::write(directory.join("source/index.html"), "").unwrap();
        let few = check(&directory).unwrap_err().to_string();
        for n in 0..LEAST_PAGES {
            fs::write(directory.join(format!("source/{n}.html")), "").unwrap();
        }
        let all = check(&directory);
        fs::write(directory.join("bad.html"), "<a href=\"../vastex_core/a.html\">").unwrap();
        let bad = check(&directory).unwrap_err().to_string();
        fs::remove_dir_all(&directory).unwrap();
        assert!(few.contains("only 1 pages"), "{few}");
        assert!(all.is_ok(), "{all:?}");
        assert!(bad.contains("bad.html: a link to vastex_core/a.html"), "{bad}");
    }
}
