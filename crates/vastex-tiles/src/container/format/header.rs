//! The header: two copies, of which the newest whole one says where everything else lies.
//!
//! A new version of a file is appended first; then the copy by which the file was not opened, as a rule the
//! older, is overwritten with a higher sequence number. So a reader always finds one whole version.

use super::error::ContainerError;
use super::layout::{
    Fields, HEADER_BYTES, HEADER_COPY_BYTES, MAGIC, MAX_DESCRIPTION_BYTES, Section, VERSION,
};
use crate::ground::hash::checksum;

/// Bytes of a copy that its checksum covers; the checksum follows, then zeros.
const CHECKED_BYTES: usize = 88;

/// What one header copy says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Header {
    /// Counts the versions of this file, from 1 on.
    pub(crate) sequence: u64,
    /// Bytes of the file, this version's last byte included.
    pub(crate) file_len: u64,
    pub(crate) description: Section,
    pub(crate) index: Section,
    /// Where the coarse tiles begin, which reach to the index.
    pub(crate) coarse_offset: u64,
}

impl Header {
    pub(crate) fn encode(&self) -> [u8; HEADER_COPY_BYTES as usize] {
        let mut bytes = Vec::with_capacity(HEADER_COPY_BYTES as usize);
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(0u32.to_le_bytes());
        bytes.extend([self.sequence, self.file_len].map(u64::to_le_bytes).concat());
        for section in [self.description, self.index] {
            let Section { extent, checksum } = section;
            bytes.extend([extent.offset, extent.len, checksum].map(u64::to_le_bytes).concat());
        }
        // Coarse tiles and index are read together, so the one offset stands beside the other's section.
        bytes.extend(self.coarse_offset.to_le_bytes());
        debug_assert_eq!(bytes.len(), CHECKED_BYTES);
        bytes.extend(checksum(&bytes).to_le_bytes());
        let mut copy = [0; HEADER_COPY_BYTES as usize];
        copy[..bytes.len()].copy_from_slice(&bytes);
        copy
    }

    /// Reads one copy of [`HEADER_COPY_BYTES`] bytes, or returns what is wrong with it.
    pub(crate) fn decode(copy: &[u8]) -> Result<Header, CopyFault> {
        let damaged = CopyFault::Damaged;
        let mut fields = Fields::new(copy);
        if fields.bytes(MAGIC.len()).is_ok_and(|magic| magic != MAGIC) || copy.len() < MAGIC.len() {
            return Err(CopyFault::NoMagic);
        }
        let version = fields.u32().map_err(damaged)?;
        let zero = fields.u32().map_err(damaged)?;
        let header = Header::fields(&mut fields).map_err(damaged)?;
        let stated = fields.u64().map_err(damaged)?;
        if version != VERSION {
            return Err(CopyFault::Version(version));
        }
        if checksum(&copy[..CHECKED_BYTES]) != stated {
            return Err(damaged("the checksum does not match".into()));
        }
        if zero != 0 || copy[CHECKED_BYTES + 8..].iter().any(|&byte| byte != 0) {
            return Err(damaged("bytes that must be zero are not".into()));
        }
        header.check().map_err(damaged)?;
        Ok(header)
    }

    fn fields(fields: &mut Fields<'_>) -> Result<Header, String> {
        Ok(Header {
            sequence: fields.u64()?,
            file_len: fields.u64()?,
            description: fields.section()?,
            index: fields.section()?,
            coarse_offset: fields.u64()?,
        })
    }

    /// Fails unless everything lies in the file, in order.
    fn check(&self) -> Result<(), String> {
        let (description, index) = (self.description.extent, self.index.extent);
        let body = HEADER_BYTES..self.file_len;
        if !description.lies_within(body.clone()) || description.len > MAX_DESCRIPTION_BYTES {
            return Err(format!("the description cannot be at {description}"));
        }
        if !index.lies_within(body) {
            return Err(format!("the index cannot be at {index}"));
        }
        if !(HEADER_BYTES..=index.offset).contains(&self.coarse_offset) {
            return Err(format!("the coarse tiles cannot begin at {}", self.coarse_offset));
        }
        Ok(())
    }

    /// The newest copy that is whole and whose version of the file is all there.
    ///
    /// `bytes` are the first bytes of the file, [`HEADER_BYTES`] of them if it has so many.
    pub(crate) fn newest(name: &str, bytes: &[u8], file_len: u64) -> Result<Header, ContainerError> {
        let copies = copies(bytes).map(Header::decode);
        let whole = || copies.iter().filter_map(|copy| copy.as_ref().ok());
        let complete = whole().filter(|header| header.file_len <= file_len);
        if let Some(newest) = complete.max_by_key(|header| header.sequence) {
            return Ok(*newest);
        }
        if let Some(newest) = whole().max_by_key(|header| header.sequence) {
            return Err(ContainerError::truncated(name, file_len, newest.file_len));
        }
        if file_len < HEADER_BYTES && MAGIC.starts_with(&bytes[..bytes.len().min(MAGIC.len())]) {
            return Err(ContainerError::truncated(name, file_len, HEADER_BYTES));
        }
        match copies.map(|copy| copy.err()) {
            [Some(CopyFault::NoMagic), Some(CopyFault::NoMagic)] => Err(ContainerError::foreign(name, bytes)),
            [Some(CopyFault::Version(version)), _] | [_, Some(CopyFault::Version(version))] => {
                Err(ContainerError::Version { name: name.into(), version })
            }
            faults => {
                let fault = faults.iter().flatten().map(CopyFault::to_string).collect::<Vec<_>>().join("; ");
                Err(ContainerError::damaged(name, "both header copies", &fault))
            }
        }
    }
}

impl Header {
    /// The whole copy of the version before this one, or `None` if there is none; `bytes` are those of both
    /// copies.
    pub(crate) fn before(&self, bytes: &[u8]) -> Option<Header> {
        let whole = copies(bytes).map(Header::decode).into_iter().flatten();
        // Of a version that came before, everything lies before the end of this one.
        whole
            .filter(|header| header.sequence < self.sequence && header.file_len <= self.file_len)
            .max_by_key(|header| header.sequence)
    }
}

/// Both copies, each cut where the bytes end.
pub(crate) fn copies(bytes: &[u8]) -> [&[u8]; 2] {
    let size = HEADER_COPY_BYTES as usize;
    let (first, rest) = bytes.split_at(bytes.len().min(size));
    [first, &rest[..rest.len().min(size)]]
}

/// What is wrong with one header copy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum CopyFault {
    #[error("it does not begin as a Vastex container does")]
    NoMagic,
    #[error("it is of version {0}")]
    Version(u32),
    #[error("{0}")]
    Damaged(String),
}
