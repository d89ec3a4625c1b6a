//! Archives as tests need them: entries that are stored or deflated, and what is said of them besides.

use std::io::Write;

use flate2::Compression;
use flate2::write::DeflateEncoder;

/// How an entry lies in an archive.
#[derive(Clone, Copy)]
pub(crate) struct Packing {
    pub(crate) is_deflated: bool,
    pub(crate) is_encrypted: bool,
    /// Bytes that it is said to have; else as many as it has.
    pub(crate) said: Option<u32>,
}

impl Packing {
    pub(crate) const STORED: Packing = Packing { is_deflated: false, is_encrypted: false, said: None };
    pub(crate) const DEFLATED: Packing = Packing { is_deflated: true, ..Packing::STORED };

    /// Deflated, and said to have so many bytes.
    pub(crate) fn said_to_have(bytes: u32) -> Packing {
        Packing { said: Some(bytes), ..Packing::DEFLATED }
    }
}

/// An archive of entries by their names.
pub(crate) fn archive(entries: &[(&str, &[u8], Packing)]) -> Vec<u8> {
    let (mut bytes, mut directory) = (Vec::new(), Vec::new());
    for (name, content, packing) in entries {
        let mut deflated = DeflateEncoder::new(Vec::new(), Compression::fast());
        deflated.write_all(content).unwrap();
        let packed = if packing.is_deflated { deflated.finish().unwrap() } else { content.to_vec() };
        let size = packing.said.unwrap_or(content.len() as u32);
        // Version, flags, method, time, date; no check sum, which nobody reads.
        let [flags, method] =
            [u16::from(packing.is_encrypted), if packing.is_deflated { 8 } else { 0 }].map(u16::to_le_bytes);
        let both = [
            &[20, 0][..],
            &flags,
            &method,
            &[0; 8],
            &(packed.len() as u32).to_le_bytes(),
            &size.to_le_bytes(),
            &(name.len() as u16).to_le_bytes(),
            &[0; 2],
        ]
        .concat();
        let header = (bytes.len() as u32).to_le_bytes();
        directory.extend([&b"PK\x01\x02\x14\0"[..], &both, &[0; 10], &header, name.as_bytes()].concat());
        bytes.extend([&b"PK\x03\x04"[..], &both, name.as_bytes(), &packed].concat());
    }
    let count = (entries.len() as u16).to_le_bytes();
    let [begin, len] = [bytes.len(), directory.len()].map(|n| (n as u32).to_le_bytes());
    bytes.extend(directory);
    bytes.extend([&b"PK\x05\x06\0\0\0\0"[..], &count, &count, &len, &begin, &[0; 2]].concat());
    bytes
}
