//! What is known of an image before its texels are read, and the trait by which its rows are read.

use std::path::PathBuf;
use std::sync::Arc;

use vastex_core::{Geometry, NodataValue, PageSet};

use super::ahead::Helpers;
use super::beginning::Beginning;
use super::color::Profile;
use super::fault::InputFault;
use super::notice::Notice;
use super::pixel::PixelFormat;
use super::stored_as::{Converted, ConvertedPieces};

/// What is known of an image from its header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageHeader {
    /// Texels per row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// What the texels are.
    pub format: PixelFormat,
    /// True if the file says that its colours are linear, not sRGB-encoded.
    pub linear: bool,
    /// The least and the greatest number that the file's samples can be, where they are signed whole numbers,
    /// which rows hold as floats. A layer of whole numbers holds this range as 0 to 1.
    pub range: Option<[i64; 2]>,
    /// What the file's samples are of which the rows hold something else.
    pub converted: Vec<Converted>,
    /// What samples of some pieces of a mosaic are, where those of others are not.
    pub converted_pieces: Vec<ConvertedPieces>,
    /// The number of samples of which nothing is known, as the rows hold samples, if the file says so: a
    /// texel whose colours all have it is without data. It may be no number (NaN), which is without data in
    /// images of floats in any case where there is such a number.
    pub nodata: Option<NodataValue>,
    /// The colour profile of the file, if it has one. The rows do not follow it; [`crate::in_srgb`] makes
    /// rows that do.
    pub profile: Option<Profile>,
    /// How the rows are stored, as EXIF numbers it; 1, upright, once they are given out by [`crate::open`].
    pub(crate) orientation: u16,
    /// True if the first column is the last one's neighbour, as on a planet.
    pub wraps: bool,
    /// Bytes that the reader holds while it reads, the buffers that its caller gives it to fill not counted.
    pub memory: u64,
    /// The directory in which its tiles lie, if it has any.
    pub tile_directory: Option<PathBuf>,
    /// What the reader leaves out, and what it costs.
    pub notices: Vec<Notice>,
}

impl ImageHeader {
    pub(crate) fn new(width: u64, height: u64, format: PixelFormat) -> Result<ImageHeader, InputFault> {
        let (Ok(w), Ok(h)) = (u32::try_from(width), u32::try_from(height)) else {
            return Err(InputFault::Unsupported {
                what: format!("{width}x{height} texels"),
                remedy: "an image has at most 2^31 texels per side",
            });
        };
        if w == 0 || h == 0 {
            return Err(InputFault::NoTexels { width, height });
        }
        Ok(ImageHeader {
            width: w,
            height: h,
            format,
            linear: false,
            range: None,
            converted: Vec::new(),
            converted_pieces: Vec::new(),
            nodata: None,
            profile: None,
            orientation: 1,
            wraps: false,
            memory: 0,
            tile_directory: None,
            notices: Vec::new(),
        })
    }

    /// Bytes of one row.
    pub fn row_bytes(&self) -> usize {
        self.width as usize * self.format.texel_bytes()
    }

    /// Bytes of all rows.
    pub fn image_bytes(&self) -> u64 {
        (self.row_bytes() as u64).saturating_mul(u64::from(self.height))
    }

    /// What was made something else of on the way from the file to the rows, each as in "from inks (CMYK)":
    /// samples, and colours that were converted to sRGB ([`crate::in_srgb`]). Of a mosaic, what some of its
    /// pieces alone are converted from is told as in "from inks (CMYK) in 2 of 3 pieces".
    pub fn conversions(&self) -> Vec<String> {
        let of_colors = |notice: &Notice| match notice {
            Notice::ConvertedToSrgb { from, .. } => Some(format!("from the colours of {from}")),
            _ => None,
        };
        let samples = self.converted.iter().map(|samples| format!("from {samples}"));
        let pieces = self.converted_pieces.iter().map(|pieces| format!("from {pieces}"));
        samples.chain(pieces).chain(self.notices.iter().filter_map(of_colors)).collect()
    }

    /// What there is to say before its texels are read, the profile included, where a layer that holds no
    /// colours does not follow it.
    pub(crate) fn notices_of_layer(&self) -> Vec<Notice> {
        let left = |profile: &Profile| profile.left(self.format, "the layer holds no colours");
        self.notices.iter().cloned().chain(self.profile.as_ref().and_then(left)).collect()
    }

    /// Counts `bytes` as held for the whole time, and says why.
    pub(super) fn hold_whole_image(&mut self, bytes: u64, why: &'static str) {
        self.memory = self.memory.saturating_add(bytes);
        self.notices.push(Notice::WholeImage { bytes, why });
    }

    /// Takes over what is new among the notices of the reader behind, of which `seen` were taken over
    /// already.
    pub(crate) fn add_notices_of(&mut self, inner: &ImageHeader, seen: &mut usize) {
        self.notices.extend(inner.notices.iter().skip(*seen).cloned());
        *seen = inner.notices.len();
    }
}

/// An image that is read once, from the top row to the bottom one.
pub trait RowReader: Send {
    /// What is known from the header.
    fn header(&self) -> &ImageHeader;

    /// The pages of a texture of that shape for which the image has texels of their own, or `None` if it has
    /// them for all. For other pages the rows repeat coarser texels.
    fn present(&self, geometry: &Geometry) -> Option<PageSet> {
        let _ = geometry;
        None
    }

    /// Lets the reader go on after damage where its decoder can, with a notice instead of an error. To be
    /// called before the first row.
    fn tolerate(&mut self) {}

    /// Bytes that the reader holds besides [`ImageHeader::memory`] when helpers decode `pieces` pieces of the
    /// image ahead of the rows.
    fn memory_ahead(&self, pieces: usize) -> u64 {
        let _ = pieces;
        0
    }

    /// Lets others help to decode, where the image can be decoded in pieces. Rows and faults are the same. To
    /// be called before the first row.
    fn take_help(&mut self, helpers: &Helpers) {
        let _ = helpers;
    }

    /// The work before the first row, if it takes long and can be watched; perhaps that before others as well
    /// ([`Beginning::is_of_all_rows`]).
    fn beginning(&self) -> Option<Arc<Beginning>> {
        None
    }

    /// Fills `rows` with the next rows, tightly packed. Its length is a whole number of rows and no more than
    /// are left. The last row is only given out when the file is whole. After an error the reader is of no
    /// further use.
    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault>;
}
