//! Images to build from, the same each time: raw files made here, and the small sound files of vastex-fuzz,
//! of every kind that is read.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, SystemTime};

use anyhow::Result;

use crate::limited::within;

use super::{LIMIT, write};

/// Kinds of texels that raw files here have: their names in descriptions, channels.
pub(super) const KINDS: [(&str, u32); 8] =
    [("u8", 1), ("u8", 2), ("u8", 3), ("u8", 4), ("u16", 1), ("u16", 3), ("f32", 1), ("f32", 3)];

/// The name of the raw file of a kind.
pub(super) fn name(sample: &str, channels: u32) -> String {
    format!("{sample}-{channels}.raw")
}

/// Writes the raw files that steps and scenes name.
pub(super) fn make(directory: &Path) -> Result<()> {
    for (sample, channels) in KINDS {
        raw(directory, &name(sample, channels), [600, 440], sample, channels)?;
    }
    raw(directory, "half.raw", [300, 220], "u16", 1)?;
    raw(directory, "mask.raw", [150, 110], "u8", 1)?;
    raw(directory, "patch.raw", [130, 90], "u8", 3)?;
    raw(directory, "patch4.raw", [130, 90], "u8", 4)?;
    raw(directory, "patch16.raw", [65, 45], "u16", 1)?;
    raw(directory, "tiles.raw", [384, 256], "u8", 3)?;
    raw(directory, "globe.raw", [1536, 768], "u8", 3)?;
    raw(directory, "heights.raw", [768, 384], "u16", 1)?;
    super::volumes::make(directory)?;
    touch(directory)
}

/// Gives every file the same time, which journals keep.
pub(super) fn touch(directory: &Path) -> Result<()> {
    for name in super::files_under(directory)? {
        let file = fs::File::options().write(true).open(directory.join(name))?;
        file.set_modified(SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000_000))?;
    }
    Ok(())
}

/// A raw file and what describes it: smooth in places, noise in others, runs of one value, some of it
/// transparent.
fn raw(directory: &Path, name: &str, [width, height]: [u32; 2], sample: &str, channels: u32) -> Result<()> {
    let mut state = 1u32;
    let mut value = |x: u32, y: u32, channel: u32| {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        // Whole numbers only, so that every machine makes the same.
        let smooth = (x * (channel + 1) * 40 + y * 90) % 65_536;
        match (x / 100 + y / 80) % 3 {
            0 => smooth,
            1 => (smooth + (state >> 16)) / 2,
            _ => (x / 64 + y / 32) % 5 * 16_383,
        }
    };
    let mut bytes = Vec::new();
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        for channel in 0..channels {
            let value = value(x, y, channel);
            match sample {
                "u8" => bytes.push((value >> 8) as u8),
                "u16" => bytes.extend((value as u16).to_le_bytes()),
                _ => bytes.extend((value as f32 / 16_384.0 - 1.0).to_le_bytes()),
            }
        }
    }
    write(&directory.join(name), bytes)?;
    let text = format!("width = {width}\nheight = {height}\nchannels = {channels}\nsample = \"{sample}\"\n");
    write(&directory.join(format!("{name}.toml")), text)
}

/// A kind of small sound inputs, and what of its files is to be built: those with this ending; the directory
/// where there is none.
pub(super) const SEEDS: [(&str, &str); 8] = [
    ("image", "."),
    ("profile", "."),
    ("raw", ".raw"),
    ("mosaic", ".txt"),
    ("deep_zoom", ""),
    ("gaia_sky", ""),
    ("celestia", ""),
    ("prototype", ""),
];

/// Writes them, each into a directory `KIND-NUMBER`, and says what to build: names under `directory`.
pub(super) fn seeds(fuzzer: &Path, directory: &Path) -> Result<Vec<String>> {
    let mut inputs = Vec::new();
    for (kind, ending) in SEEDS {
        let packed = super::make(&directory.join("packed"))?;
        let done = within(Command::new(fuzzer).args([kind, "--seeds"]).arg(&packed), LIMIT)?;
        anyhow::ensure!(done.status.success(), "no sound inputs of {kind}: {}", super::said(&done));
        for number in 0.. {
            let Ok(bytes) = fs::read(packed.join(format!("seed-{number}"))) else { break };
            let name = format!("{kind}-{number}");
            let files = if ending == "." { vec![("image".to_owned(), bytes)] } else { unpacked(&bytes) };
            for (file, content) in &files {
                let path = directory.join(&name).join(file);
                path.parent().map_or(Ok(()), fs::create_dir_all)?;
                write(&path, content)?;
            }
            let built = files.iter().find(|(file, _)| ending == "." || file.ends_with(ending));
            let built = built.filter(|_| !ending.is_empty());
            inputs.push(built.map_or(name.clone(), |(file, _)| format!("{name}/{file}")));
        }
        fs::remove_dir_all(packed)?;
    }
    touch(directory)?;
    Ok(inputs)
}

/// The files of a tree, as vastex-fuzz packs them: lengths of name and content, name, content.
fn unpacked(mut bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    while let Some((&[n0, n1, c0, c1, c2, c3], rest)) = bytes.split_first_chunk::<6>() {
        let (name, rest) = rest.split_at(usize::from(u16::from_le_bytes([n0, n1])).min(rest.len()));
        let length = u32::from_le_bytes([c0, c1, c2, c3]) as usize;
        let (content, rest) = rest.split_at(length.min(rest.len()));
        files.push((String::from_utf8_lossy(name).into_owned(), content.to_vec()));
        bytes = rest;
    }
    files
}
