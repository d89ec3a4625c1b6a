//! A zip archive: a key is the name of an entry. Stored entries are read by ranges, deflated ones whole.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use bytes::Bytes;

use super::zip_directory::{
    END_BYTES, Entry, LARGE_END_BYTES, LOCAL_BYTES, LOCATOR_BYTES, MOST_COMMENT, Method, Place, begins,
    check, data_offset, find_end, read_end, read_entries, read_large_end, read_locator,
};
use super::{KeyFuture, KeyStore, Listing, Span, bounds, parts, shown};
use crate::fault::{VolumeError, VolumeFault, damaged};

/// Bytes that a deflated entry may have: it is inflated whole for each read.
const MOST_DEFLATED: u64 = 64 << 20;
/// Bytes that a central directory may have: some ten million entries.
const MOST_DIRECTORY: u64 = 1 << 30;

/// Entries of an archive.
pub(crate) struct Zip {
    name: String,
    /// One handle for all: a read moves it.
    file: Mutex<File>,
    entries: BTreeMap<String, Entry>,
}

/// Whether a file begins as an archive does.
pub(crate) fn is_zip(path: &Path) -> bool {
    let mut start = [0; 4];
    File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok() && begins(&start)
}

impl Zip {
    /// Reads the central directory.
    pub(crate) fn open(path: &Path) -> Result<Zip, VolumeError> {
        let name = path.display().to_string();
        let at = |fault: VolumeFault| fault.at(&name);
        let refused = |error: io::Error| at(VolumeFault::Read(error.to_string()));
        let mut file = File::open(path).map_err(refused)?;
        let len = file.metadata().map_err(refused)?.len();
        let place = find_directory(&mut file, len).map_err(at)?;
        // An entry has 46 bytes at least.
        if place.bytes > MOST_DIRECTORY || place.entries > place.bytes / 46 {
            return Err(at(damaged(format!(
                "its central directory is said to have {} entries in {} bytes; copy the archive anew",
                place.entries, place.bytes
            ))));
        }
        let span = Span::Range { offset: place.offset, len: place.bytes as usize };
        let bytes =
            bounds(span, len).and_then(|(offset, len)| read_at(&mut file, offset, len)).map_err(at)?;
        let entries = read_entries(&bytes, place.entries).map_err(at)?;
        Ok(Zip { name, file: Mutex::new(file), entries })
    }

    fn read_now(&self, key: &str, span: Span) -> Result<Option<Bytes>, VolumeError> {
        let Some(entry) = self.entry(key) else { return Ok(None) };
        let at = |fault: VolumeFault| fault.at(shown(self, key));
        let method = check(entry, MOST_DEFLATED).map_err(at)?;
        let (offset, len) = bounds(span, entry.size).map_err(at)?;
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let local = read_at(&mut file, entry.header, LOCAL_BYTES).map_err(at)?;
        let begin = data_offset(entry.header, &local).ok_or_else(|| {
            at(damaged("has no header where the archive's directory says; copy the archive anew"))
        })?;
        let bytes = match method {
            Method::Stored => {
                let place =
                    begin.checked_add(offset).ok_or_else(|| at(damaged("lies beyond the archive")))?;
                read_at(&mut file, place, len).map_err(at)?
            }
            Method::Deflated => {
                let packed = (&mut *file).take(entry.packed);
                let all = inflate(packed, begin, entry.size).map_err(at)?;
                all[offset as usize..][..len].to_vec()
            }
        };
        Ok(Some(bytes.into()))
    }

    fn entry(&self, key: &str) -> Option<&Entry> {
        self.entries.get(key).or_else(|| self.entries.get(&parts(key)?.join("/")))
    }
}

fn read_at(file: &mut File, offset: u64, len: usize) -> Result<Vec<u8>, VolumeFault> {
    let refused = |error: io::Error| match error.kind() {
        io::ErrorKind::UnexpectedEof => damaged("lies beyond the end of the archive; copy the archive anew"),
        _ => VolumeFault::Read(error.to_string()),
    };
    let end = file.seek(SeekFrom::End(0)).map_err(refused)?;
    if offset.checked_add(len as u64).is_none_or(|last| last > end) {
        return Err(damaged("lies beyond the end of the archive; copy the archive anew"));
    }
    file.seek(SeekFrom::Start(offset)).map_err(refused)?;
    let mut bytes = vec![0; len];
    file.read_exact(&mut bytes).map_err(refused)?;
    Ok(bytes)
}

fn inflate(mut packed: io::Take<&mut File>, begin: u64, size: u64) -> Result<Vec<u8>, VolumeFault> {
    let refused = |error: io::Error| damaged(format!("cannot be inflated: {error}; copy the archive anew"));
    packed.get_mut().seek(SeekFrom::Start(begin)).map_err(|error| VolumeFault::Read(error.to_string()))?;
    let mut bytes = Vec::new();
    flate2::read::DeflateDecoder::new(packed).take(size + 1).read_to_end(&mut bytes).map_err(refused)?;
    match bytes.len() as u64 == size {
        true => Ok(bytes),
        false => Err(damaged("inflates to another size than the archive says; copy the archive anew")),
    }
}

fn find_directory(file: &mut File, len: u64) -> Result<Place, VolumeFault> {
    let wrong = || damaged("the record at the end of a zip archive is missing: it is cut off; copy it anew");
    let tail_bytes = len.min((END_BYTES + MOST_COMMENT + LOCATOR_BYTES) as u64);
    let tail = read_at(file, len - tail_bytes, tail_bytes as usize)?;
    let end = find_end(&tail).ok_or_else(wrong)?;
    if let Some(place) = read_end(&tail[end..]) {
        return Ok(place);
    }
    let locator =
        end.checked_sub(LOCATOR_BYTES).and_then(|at| read_locator(&tail[at..])).ok_or_else(wrong)?;
    read_large_end(&read_at(file, locator, LARGE_END_BYTES)?).ok_or_else(wrong)
}

impl KeyStore for Zip {
    fn name(&self) -> &str {
        &self.name
    }

    fn read<'a>(&'a self, key: &'a str, span: Span) -> KeyFuture<'a, Option<Bytes>> {
        Box::pin(async move { self.read_now(key, span) })
    }

    fn list<'a>(&'a self, prefix: &'a str, most: usize) -> KeyFuture<'a, Listing> {
        let before = below(prefix);
        let mut keys: Vec<String> =
            self.keys_below(&before).take(most.saturating_add(1)).map(str::to_owned).collect();
        let is_cut = keys.len() > most;
        keys.truncate(most);
        Box::pin(async move { Ok(Listing { keys, is_cut }) })
    }

    fn groups<'a>(&'a self, prefix: &'a str, most: usize) -> KeyFuture<'a, Vec<String>> {
        let before = below(prefix);
        let names: BTreeSet<&str> =
            self.keys_below(&before).filter_map(|key| Some(key.split_once('/')?.0)).take(1 << 20).collect();
        let names = names.into_iter().take(most).map(str::to_owned).collect();
        Box::pin(async move { Ok(names) })
    }
}

impl Zip {
    fn keys_below<'a>(&'a self, before: &'a str) -> impl Iterator<Item = &'a str> {
        let from = self.entries.range(before.to_owned()..).map(|(key, _)| key.as_str());
        from.map_while(move |key| key.strip_prefix(before))
    }
}

/// What the names below a prefix begin with.
fn below(prefix: &str) -> String {
    match parts(prefix).unwrap_or_default().join("/") {
        prefix if prefix.is_empty() => prefix,
        prefix => prefix + "/",
    }
}
