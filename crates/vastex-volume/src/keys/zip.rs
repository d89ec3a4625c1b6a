//! A zip archive: a key is the name of an entry. Stored entries are read by ranges, deflated ones whole.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytes::Bytes;
use vastex_tiles::read_advice;

use super::positioned::read_exact_at;
use super::zip_directory::{
    END_BYTES, Entry, LARGE_END_BYTES, LOCAL_BYTES, LOCATOR_BYTES, MOST_COMMENT, Method, Place, begins,
    check, data_offset, find_end, read_end, read_entries, read_large_end, read_locator,
};
use super::{KeyFuture, KeyStore, Span, bounds, parts, shown};
use crate::fault::{VolumeError, VolumeFault, damaged};
use crate::spare::Spare;

/// Bytes that a deflated entry may have: it is inflated whole, and the last one is kept.
const MOST_DEFLATED: u64 = 64 << 20;
/// Bytes that a central directory may have: some ten million entries.
const MOST_DIRECTORY: u64 = 1 << 30;

/// Entries of an archive.
pub(crate) struct Zip {
    name: String,
    file: Bytewise,
    entries: BTreeMap<String, Entry>,
    /// The deflated entry of which a part was read last, by the place of its header, and all of its bytes:
    /// the chunks of a shard are read one after the other.
    inflated: Mutex<Option<(u64, Bytes)>>,
    spare: Arc<Spare>,
}

/// Returns true if a file begins as an archive does.
pub(crate) fn is_zip(path: &Path) -> bool {
    let mut start = [0; 4];
    File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok() && begins(&start)
}

impl Zip {
    /// Reads the central directory.
    pub(crate) fn open(path: &Path) -> Result<Zip, VolumeError> {
        let name = path.display().to_string();
        let at = |fault: VolumeFault| fault.at(&name);
        let refused = |error: io::Error| at(VolumeFault::Read(read_advice(&error)));
        let file = File::open(path).map_err(refused)?;
        let len = file.metadata().map_err(refused)?.len();
        let file = Bytewise { file, len };
        let place = find_directory(&file).map_err(at)?;
        // An entry has 46 bytes at least.
        if place.bytes > MOST_DIRECTORY || place.entries > place.bytes / 46 {
            return Err(at(damaged(format!(
                "its central directory is said to have {} entries in {} bytes; copy the archive anew",
                place.entries, place.bytes
            ))));
        }
        let span = Span::Range { offset: place.offset, len: place.bytes as usize };
        let bytes = bounds(span, len).and_then(|(offset, len)| file.read(offset, len)).map_err(at)?;
        let entries = read_entries(&bytes, place.entries).map_err(at)?;
        Ok(Zip { name, file, entries, inflated: Mutex::default(), spare: Arc::default() })
    }

    fn read_now(&self, key: &str, span: Span) -> Result<Option<Bytes>, VolumeError> {
        let Some(entry) = self.entry(key) else { return Ok(None) };
        let at = |fault: VolumeFault| fault.at(shown(self, key));
        let method = check(entry, MOST_DEFLATED).map_err(at)?;
        let (offset, len) = bounds(span, entry.size).map_err(at)?;
        if len == 0 {
            return Ok(Some(Bytes::new()));
        }
        if method == Method::Deflated
            && let Some((header, all)) = &*self.inflated()
            && *header == entry.header
        {
            return Ok(Some(Bytes::copy_from_slice(&all[offset as usize..offset as usize + len])));
        }
        let local = self.file.read(entry.header, LOCAL_BYTES).map_err(at)?;
        let begin = data_offset(entry.header, &local).ok_or_else(|| {
            at(damaged("has no header where the archive's directory says; copy the archive anew"))
        })?;
        Ok(Some(match method {
            Method::Stored => {
                let place =
                    begin.checked_add(offset).ok_or_else(|| at(damaged("lies beyond the archive")))?;
                self.spare.lend(self.file.read_into(place, len, self.spare.take(len)).map_err(at)?)
            }
            Method::Deflated => {
                let packed = self.file.read(begin, entry.packed as usize).map_err(at)?;
                let all = Bytes::from(inflate(&packed, entry.size).map_err(at)?);
                // Of a part a copy: who keeps a chunk is not to keep all of its shard.
                match len < all.len() {
                    true => {
                        let part = Bytes::copy_from_slice(&all[offset as usize..offset as usize + len]);
                        *self.inflated() = Some((entry.header, all));
                        part
                    }
                    false => all,
                }
            }
        }))
    }

    fn inflated(&self) -> MutexGuard<'_, Option<(u64, Bytes)>> {
        self.inflated.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn entry(&self, key: &str) -> Option<&Entry> {
        self.entries.get(key).or_else(|| self.entries.get(&parts(key)?.join("/")))
    }
}

/// An archive as bytes.
struct Bytewise {
    file: File,
    len: u64,
}

impl Bytewise {
    fn read(&self, offset: u64, len: usize) -> Result<Vec<u8>, VolumeFault> {
        self.read_into(offset, len, Vec::new())
    }

    /// Reads into memory that is there already, where it has so many bytes.
    fn read_into(&self, offset: u64, len: usize, memory: Vec<u8>) -> Result<Vec<u8>, VolumeFault> {
        let cut = || damaged("lies beyond the end of the archive; copy the archive anew");
        if offset.checked_add(len as u64).is_none_or(|last| last > self.len) {
            return Err(cut());
        }
        let mut bytes = if memory.len() == len { memory } else { vec![0; len] };
        match read_exact_at(&self.file, &mut bytes, offset) {
            Ok(()) => Ok(bytes),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Err(cut()),
            Err(error) => Err(VolumeFault::Read(error.to_string())),
        }
    }
}

fn inflate(packed: &[u8], size: u64) -> Result<Vec<u8>, VolumeFault> {
    let refused = |error: io::Error| damaged(format!("cannot be inflated: {error}; copy the archive anew"));
    let mut bytes = Vec::new();
    flate2::read::DeflateDecoder::new(packed).take(size + 1).read_to_end(&mut bytes).map_err(refused)?;
    match bytes.len() as u64 == size {
        true => Ok(bytes),
        false => Err(damaged("inflates to another size than the archive says; copy the archive anew")),
    }
}

fn find_directory(file: &Bytewise) -> Result<Place, VolumeFault> {
    let wrong = || damaged("the record at the end of a zip archive is missing: it is cut off; copy it anew");
    let tail_bytes = file.len.min((END_BYTES + MOST_COMMENT + LOCATOR_BYTES) as u64);
    let tail = file.read(file.len - tail_bytes, tail_bytes as usize)?;
    let end = find_end(&tail).ok_or_else(wrong)?;
    let (place, is_whole) = read_end(&tail[end..]).ok_or_else(wrong)?;
    if is_whole {
        return Ok(place);
    }
    let Some(locator) = end.checked_sub(LOCATOR_BYTES).and_then(|at| read_locator(&tail[at..])) else {
        return Ok(place);
    };
    read_large_end(&file.read(locator, LARGE_END_BYTES)?).ok_or_else(wrong)
}

impl KeyStore for Zip {
    fn name(&self) -> &str {
        &self.name
    }

    fn spare(&self) -> &Arc<Spare> {
        &self.spare
    }

    fn read<'a>(&'a self, key: &'a str, span: Span) -> KeyFuture<'a, Option<Bytes>> {
        Box::pin(async move { self.read_now(key, span) })
    }

    fn list<'a>(
        &'a self,
        prefix: &'a str,
        most: usize,
        found: &'a mut (dyn FnMut(&str) + Send),
    ) -> KeyFuture<'a, bool> {
        let before = below(prefix);
        let mut keys = self.keys_below(&before);
        keys.by_ref().take(most).for_each(found);
        let is_cut = keys.next().is_some();
        Box::pin(async move { Ok(is_cut) })
    }

    fn is_listed(&self) -> bool {
        true
    }

    fn bytes_for_part(&self, key: &str, len: u64) -> u64 {
        match self.entry(key).map(|entry| (check(entry, MOST_DEFLATED), entry.size)) {
            // Nothing is read of what is refused.
            Some((Err(_), _)) => 0,
            Some((Ok(Method::Deflated), size)) => size,
            Some((Ok(Method::Stored), _)) | None => len,
        }
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

#[cfg(test)]
mod tests {
    use pollster::block_on;

    use super::super::zip_written::{Packing, archive};
    use super::*;

    /// An archive with one stored entry whose sizes and places stand in the fields of large archives.
    fn large() -> Vec<u8> {
        let (name, content) = (b"a/b", b"content");
        let len = (content.len() as u32).to_le_bytes();
        let mut bytes = [
            b"PK\x03\x04\x2d\0\0\0\0\0\0\0\0\0\0\0\0\0",
            &len[..],
            &len,
            b"\x03\0\x02\0",
            name,
            b"xx",
            content,
        ]
        .concat();
        let directory = bytes.len() as u64;
        let unset = [0xff; 4];
        let extra =
            [&b"\x01\0\x18\0"[..], &7_u64.to_le_bytes(), &7_u64.to_le_bytes(), &0_u64.to_le_bytes()].concat();
        let middle = [0; 12];
        bytes.extend(
            [b"PK\x01\x02\x2d\0\x2d\0\0\0\0\0\0\0\0\0\0\0\0\0", &unset[..], &unset, b"\x03\0\x1c\0"].concat(),
        );
        bytes.extend([&middle[..10], &unset, name, &extra].concat());
        let directory_bytes = bytes.len() as u64 - directory;
        let end = bytes.len() as u64;
        bytes.extend([b"PK\x06\x06", &[0; 28][..]].concat());
        for number in [1, directory_bytes, directory] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend([b"PK\x06\x07\0\0\0\0", &end.to_le_bytes()[..], &[1, 0, 0, 0]].concat());
        bytes.extend([b"PK\x05\x06\0\0\0\0\xff\xff\xff\xff", &unset[..], &unset, b"\x02\0zz"].concat());
        bytes
    }

    fn opened(bytes: &[u8]) -> Result<Zip, VolumeError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        Zip::open(file.path())
    }

    #[test]
    fn large_archives_are_read_by_ranges() {
        let zip = opened(&large()).unwrap();
        let read = |span| block_on(zip.read("a/b", span)).unwrap().unwrap();
        assert_eq!(read(Span::Whole { most: 7 }), &b"content"[..]);
        assert_eq!(read(Span::Range { offset: 3, len: 2 }), &b"te"[..]);
        assert_eq!(read(Span::Last(3)), &b"ent"[..]);
        assert!(block_on(zip.read("a/b", Span::Range { offset: 6, len: 2 })).is_err());
        assert_eq!(block_on(zip.read("a", Span::Last(0))), Ok(None));
        let mut keys = Vec::new();
        assert!(!block_on(zip.list("a", 9, &mut |key| keys.push(key.to_owned()))).unwrap());
        assert_eq!(keys, ["b"]);
        assert!(block_on(zip.list("a", 0, &mut |_| panic!("none is asked for"))).unwrap());
        assert_eq!(block_on(zip.groups("", 9)).unwrap(), ["a"]);
    }

    #[test]
    fn no_byte_of_an_archive_makes_it_panic() {
        let sound = large();
        for at in 0..sound.len() {
            for change in [1 << (at % 8), 0xff] {
                let mut bytes = sound.clone();
                bytes[at] ^= change;
                if let Ok(zip) = opened(&bytes)
                    && let Ok(Some(found)) = block_on(zip.read("a/b", Span::Whole { most: 1 << 20 }))
                {
                    assert_eq!(found.len(), 7);
                }
            }
        }
    }

    #[test]
    fn entries_that_cannot_be_read_alone_are_refused() {
        let entry =
            Entry { method: Ok(Method::Deflated), is_encrypted: false, packed: 9, size: 1 << 40, header: 0 };
        for (entry, says) in [
            (entry, "zip -0"),
            (Entry { is_encrypted: true, ..entry }, "encrypted"),
            (Entry { method: Err(93), ..entry }, "method 93"),
            (Entry { method: Ok(Method::Stored), ..entry }, "two sizes"),
        ] {
            let error = check(&entry, MOST_DEFLATED).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
    }

    #[test]
    fn a_part_costs_what_is_inflated_for_it_and_nothing_where_it_is_refused() {
        let entry = |name, packing| (name, &[7; 900][..], packing);
        let most = MOST_DEFLATED as u32;
        let zip = opened(&archive(&[
            entry("stored", Packing::STORED),
            entry("deflated", Packing::DEFLATED),
            entry("largest", Packing::said_to_have(most)),
            entry("larger", Packing::said_to_have(most + 1)),
            entry("encrypted", Packing { is_encrypted: true, ..Packing::DEFLATED }),
            entry("wrong", Packing { said: Some(5), ..Packing::STORED }),
        ]))
        .unwrap();
        for (key, bytes) in [
            ("stored", 16),
            ("deflated", 900),
            ("largest", MOST_DEFLATED),
            ("larger", 0),
            ("encrypted", 0),
            ("wrong", 0),
            ("nothing", 16),
        ] {
            assert_eq!(zip.bytes_for_part(key, 16), bytes, "{key}");
            let is_read = block_on(zip.read(key, Span::Last(16))).is_ok();
            assert_eq!(is_read, ["stored", "deflated", "nothing"].contains(&key), "{key}");
        }
    }

    #[test]
    fn as_many_entries_as_a_short_number_counts_need_no_large_record() {
        let mut bytes = [&b"PK\x03\x04"[..], &[0; 26]].concat();
        let directory = bytes.len() as u32;
        for n in 0..u16::MAX {
            let name = format!("{n:05}");
            bytes.extend([&b"PK\x01\x02"[..], &[0; 24], b"\x05\0", &[0; 16], name.as_bytes()].concat());
        }
        let len = bytes.len() as u32 - directory;
        bytes.extend([&b"PK\x05\x06\0\0\0\0\xff\xff\xff\xff"[..], &len.to_le_bytes()].concat());
        bytes.extend([&directory.to_le_bytes()[..], &[0; 2]].concat());
        assert_eq!(opened(&bytes).unwrap().entries.len(), usize::from(u16::MAX));
    }

    #[test]
    fn a_deflated_entry_that_is_read_in_parts_is_inflated_once() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/deflated.zip");
        let zip = Zip::open(&path).unwrap();
        let is_deflated = |entry: &Entry| entry.method == Ok(Method::Deflated) && entry.size > 8;
        let (key, entry) = zip.entries.iter().find(|(_, entry)| is_deflated(entry)).unwrap();
        let whole = block_on(zip.read(key, Span::Whole { most: u64::MAX })).unwrap().unwrap();
        assert!(zip.inflated().is_none());
        for offset in [0, 3, 8] {
            let len = (entry.size - offset).min(5) as usize;
            let part = block_on(zip.read(key, Span::Range { offset, len })).unwrap().unwrap();
            assert_eq!(part, whole.slice(offset as usize..offset as usize + len));
            assert!(
                zip.inflated().as_ref().is_some_and(|(header, all)| *header == entry.header && *all == whole)
            );
        }
    }
}
