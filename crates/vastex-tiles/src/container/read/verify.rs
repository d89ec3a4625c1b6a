//! Reads and checks everything in a container, and reports every fault.
//!
//! Every byte of the file is in a header copy, the description, a tile, the index or a superseded range, each
//! under a checksum, or lies between these and must be zero. Bytes after the end that the newest version
//! states belong to no version.

#[cfg(not(target_family = "wasm"))]
use std::path::Path;
use std::sync::Arc;

use super::Container;
use crate::container::format::error::ContainerError;
use crate::container::format::header::{self, Header};
use crate::container::format::layout::{Extent, HEADER_BYTES, HEADER_COPY_BYTES};
use crate::ground::hash::Checksum;
use crate::sources::TileSource;
#[cfg(not(target_family = "wasm"))]
use crate::stores::FileStore;
use crate::stores::{Store, StoreError};
use crate::tile::{Codec, Tile};

/// Bytes between sections that are read at a time.
const GAP_BYTES: u64 = 1 << 20;

/// One thing that is wrong with a container.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {fault}")]
pub struct Fault {
    /// Where in the file.
    pub place: String,
    /// What is wrong there.
    pub fault: String,
}

/// What the verification of a container found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Verification {
    /// Everything that is wrong, in the order in which it was found. Empty for a sound file.
    pub faults: Vec<Fault>,
    /// Distinct tiles that were read.
    pub records: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Bytes after the end of the newest version, appended by a change that was interrupted or is under way.
    /// They do no harm, and the next change cuts them off.
    pub leftover_bytes: u64,
    /// True if another program was changing the file: then the version before was checked, and the header
    /// copy that is being overwritten was not. Only [`verify_file`] can tell.
    pub being_changed: bool,
}

impl Verification {
    fn add(&mut self, place: impl Into<String>, fault: impl Into<String>) {
        self.faults.push(Fault { place: place.into(), fault: fault.into() });
    }
}

/// Reads and checks every byte of a container. Costs one read and one decoding of every distinct tile.
///
/// `progress` gets the number of records that have been read, and of all records. If header, description or
/// index cannot be used at all, what depends on them cannot be checked, and the faults say so. The bytes must
/// not change meanwhile; [`verify_file`] sees to that for a file.
pub async fn verify(store: Arc<dyn Store>, progress: impl FnMut(u64, u64)) -> Verification {
    verify_version(store, false, progress).await
}

/// Reads and checks a local file as [`verify`] does, and keeps other programs from changing it meanwhile if
/// the system can. If a program is changing it already, the version before is checked.
///
/// Fails if the file cannot be opened, or is no container.
#[cfg(not(target_family = "wasm"))]
pub fn verify_file(
    path: impl AsRef<Path>,
    progress: impl FnMut(u64, u64),
) -> Result<Verification, ContainerError> {
    let path = path.as_ref();
    // Opened as a store first: that never waits for a pipe.
    let name = FileStore::open(path)?.name().to_string();
    let lock =
        std::fs::File::open(path).map_err(|error| StoreError::Open { name, error: error.to_string() })?;
    // On other systems a lock keeps writers of any kind out. A file system without locks has none to ask for.
    let being_changed =
        cfg!(unix) && matches!(lock.try_lock_shared(), Err(std::fs::TryLockError::WouldBlock));
    // Only now is the length known that nobody else changes.
    let store: Arc<dyn Store> = Arc::new(FileStore::open(path)?);
    match pollster::block_on(Container::open(store.clone())) {
        Err(error @ (ContainerError::Foreign { .. } | ContainerError::Part { .. })) => Err(error),
        _ => Ok(pollster::block_on(verify_version(store, being_changed, progress))),
    }
}

async fn verify_version(
    store: Arc<dyn Store>,
    being_changed: bool,
    mut progress: impl FnMut(u64, u64),
) -> Verification {
    let mut found = Verification { bytes: store.len(), being_changed, ..Verification::default() };
    match Container::open(store.clone()).await {
        Ok(container) => {
            if !being_changed {
                check_header_copies(&*store, &container.header, &mut found).await;
            }
            found.leftover_bytes = store.len() - container.header.file_len;
            check_pages(&container, &mut found);
            let extents = check_records(&container, &mut found, &mut progress).await;
            check_rest(&container, extents, &mut found).await;
        }
        Err(ContainerError::Damaged { place, fault, .. }) => found.add(place, fault),
        Err(error) => found.add("the file", error.to_string()),
    }
    found
}

async fn check_header_copies(store: &dyn Store, newest: &Header, found: &mut Verification) {
    let bytes = match store.read(0, HEADER_BYTES as usize).await {
        Ok(bytes) => bytes,
        Err(error) => return found.add("the header", error.to_string()),
    };
    for (n, copy) in header::copies(&bytes).into_iter().enumerate() {
        let place = format!("header copy {} at {}", ["A", "B"][n], n as u64 * HEADER_COPY_BYTES);
        match Header::decode(copy) {
            Ok(header) if header.sequence > newest.sequence && header.file_len > store.len() => {
                found.add(place, format!("the file has {} bytes of {}", store.len(), header.file_len));
            }
            Ok(header) if header.sequence > newest.sequence => {
                let fault = "its version cannot be opened, so the one before it is read and was checked";
                found.add(place, fault);
            }
            Ok(header) if header.sequence == newest.sequence && header != *newest => {
                found.add(place, "it differs from the other copy of the same number");
            }
            Ok(_) => {}
            Err(fault) => found.add(place, fault.to_string()),
        }
    }
}

/// Checks that every page names a record or none, every record is named, and the tail is there.
fn check_pages(container: &Container, found: &mut Verification) {
    let mut named = vec![false; container.index.records() as usize];
    let geometry = &container.description().geometry;
    let pages = (0..container.textures()).flat_map(|_| geometry.pages());
    for (pos, number) in pages.zip(container.index.page_records()) {
        match number.map(|number| named.get_mut(number as usize)) {
            Some(Some(named)) => *named = true,
            Some(None) => found.add("the index", format!("{pos} names a record that does not exist")),
            None if geometry.is_tail(pos) => found.add("the index", "the tail has no tile"),
            None => {}
        }
    }
    for (number, _) in named.iter().enumerate().filter(|(_, named)| !**named) {
        found.add("the index", format!("record {number} belongs to no page"));
    }
}

/// Reads and decodes every record; returns where they lie.
async fn check_records(
    container: &Container,
    found: &mut Verification,
    progress: &mut impl FnMut(u64, u64),
) -> Vec<Extent> {
    let mut extents = Vec::new();
    let count = container.index.records();
    for number in 0..count {
        match check_record(container, number).await {
            Ok(extent) => extents.extend(extent),
            Err((extent, fault)) => {
                let place = extent.map_or("the index".into(), |extent| extent.to_string());
                found.add(place, format!("record {number}: {fault}"));
                extents.extend(extent);
            }
        }
        found.records += 1;
        progress(found.records, u64::from(count));
    }
    extents
}

/// Where a record lies in the file, or `None` for a constant; with a fault, as far as the range is known.
async fn check_record(
    container: &Container,
    number: u32,
) -> Result<Option<Extent>, (Option<Extent>, String)> {
    let record = container.index.record(number).map_err(|fault| (None, fault))?;
    container.check_record(&record).map_err(|fault| (None, fault))?;
    let extent = (record.codec != Codec::Constant).then_some(record.section.extent);
    let at = |fault: String| (extent, fault);
    if extent.is_some_and(|extent| !extent.offset.is_multiple_of(u64::from(container.align()))) {
        return Err(at(format!("it does not begin at a multiple of {} bytes, as stated", container.align())));
    }
    let bytes = container.bytes_of(&record).await.map_err(|error| at(error.to_string()))?;
    record.section.check(&bytes).map_err(at)?;
    let tile = Tile { codec: record.codec, bytes };
    tile.decode(container.description()).map_err(|error| at(error.to_string()))?;
    Ok(extent)
}

/// Checks superseded ranges, that nothing overlaps, and that the bytes between are zero.
async fn check_rest(container: &Container, mut extents: Vec<Extent>, found: &mut Verification) {
    let Container { store, header, .. } = container;
    extents.extend([Extent { offset: 0, len: HEADER_BYTES }, header.description.extent, header.index.extent]);
    match container.index.superseded() {
        Ok(sections) => {
            for section in sections {
                match read_in_pieces(&**store, section.extent, header.file_len).await {
                    Ok(checksum) if checksum == section.checksum => {}
                    Ok(_) => found.add(section.extent.to_string(), "superseded: the checksum does not match"),
                    Err(fault) => found.add(section.extent.to_string(), format!("superseded: {fault}")),
                }
                extents.push(section.extent);
            }
        }
        Err(fault) => found.add("the index", fault),
    }
    extents.sort_unstable();
    let mut covered = 0;
    for extent in extents {
        if extent.offset < covered {
            found.add(extent.to_string(), "overlaps what lies before it");
        }
        check_gap(&**store, covered, extent.offset, found).await;
        covered = covered.max(extent.end().unwrap_or(u64::MAX));
    }
    check_gap(&**store, covered, header.file_len, found).await;
}

/// The checksum of a range of any length.
async fn read_in_pieces(store: &dyn Store, extent: Extent, file_len: u64) -> Result<u64, String> {
    if !extent.lies_within(HEADER_BYTES..file_len) {
        return Err("it lies outside the file".into());
    }
    let mut hash = Checksum::default();
    let mut offset = extent.offset;
    while offset < extent.offset + extent.len {
        let piece = read_piece(store, offset, extent.offset + extent.len).await.map_err(|e| e.to_string())?;
        hash.update(&piece);
        offset += piece.len() as u64;
    }
    Ok(hash.finish())
}

async fn check_gap(store: &dyn Store, mut offset: u64, end: u64, found: &mut Verification) {
    while offset < end {
        match read_piece(store, offset, end).await {
            Ok(piece) => {
                if let Some(n) = piece.iter().position(|&byte| byte != 0) {
                    found.add(format!("byte {}", offset + n as u64), "it belongs to nothing and is not zero");
                }
                offset += piece.len() as u64;
            }
            Err(error) => {
                return found.add(Extent { offset, len: end - offset }.to_string(), error.to_string());
            }
        }
    }
}

async fn read_piece(store: &dyn Store, offset: u64, end: u64) -> Result<bytes::Bytes, StoreError> {
    store.read(offset, (end - offset).min(GAP_BYTES) as usize).await
}
