//! The rooms of each crate: which folder may import from which, and that files import each other in no
//! circle.
//!
//! A room is a folder or a file at the top of a crate's `src`, or an inner folder that a table names. A table
//! lists each room with the rooms that it imports from. `imports` reads the sources; the tables are here, one
//! file a crate.

mod browser;
mod build;
mod core;
mod fuzz;
mod imports;
mod program;
mod scenes;
mod tiles;
mod vastex;
mod viewer;
mod volume;
mod wgpu;
mod xtask;

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, ensure};

use crate::sources::root;
use imports::{Crate, circles, parent_and_child};

/// A room, and the rooms that it imports from. Names have slashes: `pager/inspect`.
pub(crate) type Room = (&'static str, &'static [&'static str]);

/// The rooms of every crate.
const CRATES: &[(&str, &[Room])] = &[
    ("crates/vastex-core", core::ROOMS),
    ("crates/vastex-tiles", tiles::ROOMS),
    ("crates/vastex-build", build::ROOMS),
    ("crates/vastex-volume", volume::ROOMS),
    ("crates/vastex-fuzz", fuzz::ROOMS),
    ("crates/vastex-wgpu", wgpu::ROOMS),
    ("crates/vastex", vastex::ROOMS),
    ("crates/vastex-viewer", viewer::ROOMS),
    ("apps/browser", browser::ROOMS),
    ("apps/scenes", scenes::ROOMS),
    ("apps/vastex-cli", program::ROOMS),
    ("xtask", xtask::ROOMS),
];

#[test]
fn every_arrow_between_rooms_is_written_down() -> Result<()> {
    let mut wrong = Vec::new();
    for (directory, rooms) in CRATES {
        wrong.extend(
            faults(&Crate::read(directory)?, rooms).into_iter().map(|fault| format!("{directory}: {fault}")),
        );
    }
    ensure!(wrong.is_empty(), "{}", wrong.join("\n"));
    Ok(())
}

#[test]
fn every_crate_has_a_table() -> Result<()> {
    let members = member_folders()?;
    let tables: BTreeSet<String> = CRATES.iter().map(|(directory, _)| (*directory).to_owned()).collect();
    ensure!(
        tables == members,
        "tables are of {tables:?}, and the crates of the workspace lie in {members:?}"
    );
    Ok(())
}

/// The folders of the workspace's members, as `Cargo.toml` names them: one each, or all in a folder (`/*`).
fn member_folders() -> Result<BTreeSet<String>> {
    let manifest = std::fs::read_to_string(root().join("Cargo.toml"))?;
    let line = manifest.lines().find(|line| line.starts_with("members = ["));
    let mut folders = BTreeSet::new();
    for pattern in line.context("Cargo.toml has no line of members")?.split('"').skip(1).step_by(2) {
        let Some(parent) = pattern.strip_suffix("/*") else {
            folders.insert(pattern.to_owned());
            continue;
        };
        for entry in std::fs::read_dir(root().join(parent))? {
            let folder = format!("{parent}/{}", entry?.file_name().to_string_lossy());
            if root().join(&folder).join("Cargo.toml").is_file() {
                folders.insert(folder);
            }
        }
    }
    Ok(folders)
}

#[test]
fn no_files_import_each_other_in_a_circle() -> Result<()> {
    for (directory, _) in CRATES {
        let found = circles(&Crate::read(directory)?.arrows());
        ensure!(found.is_empty(), "{directory}: circles of files, parents and children left out: {found:#?}");
    }
    Ok(())
}

/// A `use` against an arrow of the table, added to the crate's own sources, is found.
#[test]
fn a_use_that_is_not_allowed_is_found_in_every_crate() -> Result<()> {
    for (directory, rooms) in CRATES {
        let is_module = |room: &str| !["lib", "main"].contains(&room);
        let arrows = rooms.iter().flat_map(|(from, to)| to.iter().map(move |to| (*from, *to)));
        let back = arrows.clone().find(|(from, to)| is_module(from) && !parent_and_child(from, to));
        let Some((from, to)) = back else { anyhow::bail!("{directory}: a table without arrows") };
        let mut texts = Crate::texts(directory)?;
        let Some(text) = texts.get_mut(to) else { anyhow::bail!("{directory}: no file {to}") };
        text.push_str(&format!("\nuse crate::{};\n", from.replace('/', "::")));
        let source = Crate::of(texts);
        let expected = format!("{to} imports from {from}");
        let found = faults(&source, rooms);
        ensure!(found.iter().any(|fault| fault.starts_with(&expected)), "{directory}: {found:#?}");
    }
    Ok(())
}

/// What a crate does that its table does not say, and what the table says that the crate does not do.
fn faults(source: &Crate, rooms: &[Room]) -> Vec<String> {
    let mut faults = Vec::new();
    let table: BTreeMap<&str, &[&str]> = rooms.iter().copied().collect();
    let room_of = |file: &str| {
        let within = |room: &&&str| {
            file == **room || file.strip_prefix(**room).is_some_and(|rest| rest.starts_with('/'))
        };
        table.keys().filter(within).max_by_key(|room| room.len()).copied()
    };
    let mut used = BTreeSet::new();
    let mut inhabited = BTreeSet::new();
    for file in source.files() {
        match room_of(file) {
            Some(room) => drop(inhabited.insert(room)),
            None => faults.push(format!("{file} is in no room of the table")),
        }
    }
    for (from, to) in source.arrows() {
        let (Some(from_room), Some(to_room)) = (room_of(&from), room_of(&to)) else { continue };
        if from_room == to_room {
            continue;
        }
        if table[from_room].contains(&to_room) {
            used.insert((from_room, to_room));
        } else {
            faults.push(format!(
                "{from} imports from {to}, but {from_room} -> {to_room} is no arrow of the table"
            ));
        }
    }
    for (room, arrows) in rooms {
        if !inhabited.contains(room) {
            faults.push(format!("the room {room} of the table has no file"));
        }
        let unused = arrows.iter().filter(|to| !used.contains(&(*room, **to)));
        faults.extend(
            unused.map(|to| format!("no file uses the arrow {room} -> {to}: take it out of the table")),
        );
    }
    let arrows = rooms.iter().flat_map(|(from, to)| to.iter().map(|to| (from.to_string(), (*to).to_owned())));
    for circle in circles(&arrows.collect()) {
        faults.push(format!("rooms in a circle: {}", circle.join(" <-> ")));
    }
    faults
}

#[test]
fn a_table_that_differs_from_the_code_is_found() {
    let code = [
        ("lib", "mod a; mod b; pub use a::A;"),
        ("a", "pub(crate) mod inner; pub struct A;"),
        ("a/inner", "use super::A; use crate::b::B;"),
        ("b", "pub struct B;"),
    ];
    let source = Crate::of(code.map(|(file, text)| (file.to_owned(), text.to_owned())));
    let whole: &[Room] = &[("lib", &["a"]), ("a", &["b"]), ("b", &[])];
    assert_eq!(faults(&source, whole), Vec::<String>::new());
    let found = |rooms: &[Room]| faults(&source, rooms).join("\n");
    assert!(found(&[("lib", &["a"]), ("a", &[]), ("b", &[])]).contains("a/inner imports from b"));
    assert!(
        found(&[("lib", &["a", "b"]), ("a", &["b"]), ("b", &[])]).contains("no file uses the arrow lib -> b")
    );
    assert!(found(&[("lib", &["a"]), ("a", &["b"])]).contains("b is in no room"));
    assert!(
        found(&[("lib", &["a"]), ("a", &["b"]), ("b", &[]), ("c", &[])])
            .contains("c of the table has no file")
    );
    assert!(found(&[("lib", &["a"]), ("a", &["b"]), ("b", &["a"])]).contains("rooms in a circle: a <-> b"));
}

#[test]
fn parents_and_children_may_know_each_other() {
    assert!(parent_and_child("pager", "pager/pool"));
    assert!(parent_and_child("pager/pool", "pager"));
    assert!(parent_and_child("lib", "pager/pool"));
    assert!(!parent_and_child("pager/pool", "pager/bias"));
    assert!(!parent_and_child("page", "pager"));
}
