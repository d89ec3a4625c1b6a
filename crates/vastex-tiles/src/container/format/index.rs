//! The index: which record each page has, and where each record's bytes lie.
//!
//! A page costs 4 bytes and a distinct tile 24. A reader keeps the bytes as they are and looks up what it is
//! asked for, so that opening costs no work for each page. Bytes under a right checksum can still lie: no
//! number is trusted.

use bytes::Bytes;
use vastex_core::{Geometry, PageContents, PageNumbering};

use super::layout::{Extent, Fields, NO_RECORD, Section};
use crate::tile::Codec;

/// Bytes of the counts before the records.
const COUNTS_BYTES: u64 = 32;
/// Bytes of a record and of a superseded extent.
const RECORD_BYTES: u64 = 24;
const PAGE_BYTES: u64 = 4;

/// Where a distinct tile's bytes lie and how they are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Record {
    /// In the file; of a constant tile, in the index's list of constants.
    pub(crate) section: Section,
    pub(crate) codec: Codec,
}

impl Record {
    fn encode(&self) -> [u8; RECORD_BYTES as usize] {
        let Section { extent, checksum } = self.section;
        let mut bytes = [0; RECORD_BYTES as usize];
        bytes[..8].copy_from_slice(&extent.offset.to_le_bytes());
        bytes[8..16].copy_from_slice(&checksum.to_le_bytes());
        bytes[16..20].copy_from_slice(&(extent.len as u32).to_le_bytes());
        bytes[20] = self.codec.number();
        bytes
    }

    fn decode(bytes: &[u8]) -> Result<Record, String> {
        let mut fields = Fields::new(bytes);
        let (offset, checksum, len) = (fields.u64()?, fields.u64()?, fields.u32()?);
        let codec = Codec::from_number(fields.u8()?)?;
        if fields.bytes(3)? != [0; 3] {
            return Err("bytes that must be zero are not".into());
        }
        let section = Section { extent: Extent { offset, len: u64::from(len) }, checksum };
        Ok(Record { section, codec })
    }
}

/// The index as bytes.
pub(crate) fn encode(records: &[Record], superseded: &[Section], pages: &[u32], constants: &[u8]) -> Vec<u8> {
    let entries = (records.len() + superseded.len()) as u64;
    let len = COUNTS_BYTES + entries * RECORD_BYTES + pages.len() as u64 * PAGE_BYTES;
    let mut bytes = Vec::with_capacity(len as usize + constants.len());
    for count in [records.len(), superseded.len(), pages.len(), constants.len()] {
        bytes.extend((count as u64).to_le_bytes());
    }
    for record in records {
        bytes.extend(record.encode());
    }
    for Section { extent, checksum } in superseded {
        bytes.extend([extent.offset, extent.len, *checksum].map(u64::to_le_bytes).concat());
    }
    for page in pages {
        bytes.extend(page.to_le_bytes());
    }
    bytes.extend(constants);
    bytes
}

/// An index that was read. Its parts fit together; what they say is checked when asked for.
#[derive(Clone, Debug)]
pub(crate) struct Index {
    records: Bytes,
    superseded: Bytes,
    pages: Bytes,
    constants: Bytes,
}

impl Index {
    /// Bytes that the index of so many pages has at most, in a file with so many bytes before it: those of
    /// each page, of a record for each, of a constant for each, and of the superseded extents, which are
    /// themselves longer than what the index keeps of them.
    pub(crate) fn longest(pages: u64, bytes_before: u64) -> u64 {
        const CONSTANT_BYTES: u64 = 1024;
        let of_pages = pages.saturating_mul(PAGE_BYTES + RECORD_BYTES + CONSTANT_BYTES);
        COUNTS_BYTES.saturating_add(of_pages).saturating_add(bytes_before)
    }

    /// Takes the bytes apart; fails unless the counts fill them exactly.
    pub(crate) fn new(mut bytes: Bytes, pages_expected: u64) -> Result<Index, String> {
        let mut counts = Fields::new(&bytes);
        let (records, superseded) = (counts.u64()?, counts.u64()?);
        let (pages, constants) = (counts.u64()?, counts.u64()?);
        if pages != pages_expected {
            return Err(format!("it lists {pages} pages of a texture that has {pages_expected}"));
        }
        if records > u64::from(NO_RECORD) {
            return Err(format!("{records} records are more than a page can name"));
        }
        let lens = [(records, RECORD_BYTES), (superseded, RECORD_BYTES), (pages, PAGE_BYTES), (constants, 1)];
        let lens = lens.map(|(count, size)| count.checked_mul(size));
        let total = lens.iter().try_fold(COUNTS_BYTES, |sum, len| sum.checked_add((*len)?));
        if total != Some(bytes.len() as u64) {
            return Err(format!("its counts do not fill its {} bytes", bytes.len()));
        }
        drop(bytes.split_to(COUNTS_BYTES as usize));
        // Each length is at most that of the bytes, as the sum is.
        let [records, superseded, pages, constants] =
            lens.map(|len| bytes.split_to(len.unwrap_or(0) as usize));
        Ok(Index { records, superseded, pages, constants })
    }

    /// Distinct tiles.
    pub(crate) fn records(&self) -> u32 {
        (self.records.len() as u64 / RECORD_BYTES) as u32
    }

    /// A record; `number` is below [`Index::records`] or the answer an error.
    pub(crate) fn record(&self, number: u32) -> Result<Record, String> {
        let (records, _) = self.records.as_chunks::<{ RECORD_BYTES as usize }>();
        match records.get(number as usize) {
            Some(bytes) => Record::decode(bytes),
            None => Err(format!("record {number} of {} does not exist", self.records())),
        }
    }

    /// The number of a page's record, or `None` if the page has no tile.
    pub(crate) fn record_of_page(&self, page: u64) -> Option<u32> {
        let (pages, _) = self.pages.as_chunks::<{ PAGE_BYTES as usize }>();
        let bytes = pages.get(usize::try_from(page).ok()?)?;
        Some(u32::from_le_bytes(*bytes)).filter(|&number| number != NO_RECORD)
    }

    /// Returns true if a page has no tile.
    pub(crate) fn lacks_pages(&self) -> bool {
        self.page_records().any(|record| record.is_none())
    }

    /// The record number of each page, in the order of their numbers; `None` for a page without a tile.
    pub(crate) fn page_records(&self) -> impl Iterator<Item = Option<u32>> + '_ {
        let (pages, _) = self.pages.as_chunks::<{ PAGE_BYTES as usize }>();
        pages.iter().map(|bytes| Some(u32::from_le_bytes(*bytes)).filter(|&number| number != NO_RECORD))
    }

    /// The pages that have the same record, and those of one constant colour, or `None` if there are no such
    /// pages. Costs a visit of each page and record.
    pub(crate) fn contents(&self, geometry: &Geometry, numbering: &PageNumbering) -> Option<PageContents> {
        let mut uses = vec![0u8; self.records() as usize];
        for record in self.page_records().skip(1).flatten() {
            if let Some(uses) = uses.get_mut(record as usize) {
                *uses = uses.saturating_add(1);
            }
        }
        let mut numbers = vec![u32::MAX; uses.len()];
        let (mut constants, mut count) = (Vec::new(), 0);
        let used =
            |least| (0u32..).zip(&uses).filter(move |&(_, &uses)| uses >= least).map(|(record, _)| record);
        for record in used(1) {
            if let Some(texel) = self.constant_of(record) {
                numbers[record as usize] = count;
                constants.push(texel);
                count += 1;
            }
        }
        for record in used(2) {
            let number = &mut numbers[record as usize];
            if *number == u32::MAX {
                *number = count;
                count += 1;
            }
        }
        let number_of = |pos| {
            let record = self.record_of_page(numbering.number_of(pos)?)?;
            numbers.get(record as usize).copied()
        };
        (count > 0).then(|| PageContents::new(geometry, constants, count, number_of))
    }

    /// The texel of a record, or `None` if the record is not that of a constant tile.
    pub(crate) fn constant_of(&self, record: u32) -> Option<Bytes> {
        let record = self.record(record).ok().filter(|record| record.codec == Codec::Constant)?;
        self.constant(record.section.extent).ok()
    }

    /// The texel of a constant tile.
    pub(crate) fn constant(&self, extent: Extent) -> Result<Bytes, String> {
        if extent.lies_within(0..self.constants.len() as u64) {
            let first = extent.offset as usize;
            return Ok(self.constants.slice(first..first + extent.len as usize));
        }
        Err(format!("{extent} of {} bytes of constants", self.constants.len()))
    }

    /// Ranges of the file that belong to earlier versions of it.
    pub(crate) fn superseded(&self) -> Result<Vec<Section>, String> {
        let (extents, _) = self.superseded.as_chunks::<{ RECORD_BYTES as usize }>();
        extents.iter().map(|bytes| Fields::new(bytes).section()).collect()
    }
}

#[cfg(test)]
#[cfg(feature = "write")]
mod tests {
    use super::*;

    #[test]
    fn counts_that_lie_are_refused() {
        let bytes = encode(&[], &[], &[NO_RECORD; 3], &[]);
        assert!(Index::new(bytes.clone().into(), 3).is_ok());
        assert!(Index::new(bytes.clone().into(), 4).is_err());
        for count in 0..4 {
            for lie in [1u64, 1 << 20, 1 << 62, u64::MAX] {
                let mut bytes = bytes.clone();
                bytes[8 * count..][..8].copy_from_slice(&lie.to_le_bytes());
                assert!(Index::new(bytes.into(), 3).is_err(), "count {count} of {lie}");
            }
        }
        assert!(Index::new(bytes[..20].to_vec().into(), 3).is_err());
    }
}
