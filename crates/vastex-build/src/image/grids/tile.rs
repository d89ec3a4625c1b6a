//! One tile of a directory: found, checked and decoded to the format that all tiles of the directory share.
//!
//! Programs write each tile as suits it, so one directory may hold grey, colour and transparent tiles. All
//! are brought to one [`common`] format; what would lose something is refused.

use std::path::{Path, PathBuf};

use crate::image::picture::open_image;
use crate::image::{ImageHeader, InputFault, PixelFormat, Sample};

/// Where the texels of one cell of a level come from.
///
/// Texel `[x, y]` of the cell is texel `first + ((within + [x, y]) >> shift)` of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    pub(crate) path: PathBuf,
    /// Size that the file must have, in texels.
    pub(crate) size: [u32; 2],
    /// First texel of the payload in the file.
    pub(crate) first: [u32; 2],
    /// Where the cell begins in the payload, in texels of the cell's level.
    pub(crate) within: [u64; 2],
    /// Levels by which the file is coarser than the cell.
    pub(crate) shift: u32,
}

/// A decoded tile; the newest is kept, since many cells may come from one coarse tile.
#[derive(Default)]
pub(crate) struct Decoded {
    path: PathBuf,
    size: [u32; 2],
    texels: Vec<u8>,
    /// True if the file may be damaged.
    tolerates: bool,
}

/// The header of a tile's file.
pub(crate) fn header_of(path: &Path) -> Result<ImageHeader, InputFault> {
    let header = open_image(path).map(|image| image.header().clone());
    header.map_err(|fault| in_tile(path, fault))
}

/// The format that holds the texels of both, or `None` if their samples are stored differently.
pub(crate) fn common(a: PixelFormat, b: PixelFormat) -> Option<PixelFormat> {
    if a.sample() != b.sample() {
        return None;
    }
    let channels = match a.channels().max(b.channels()) {
        // Grey and alpha of one tile and the colours of another both go into four channels; and so does all
        // colour, since any further tile may have alpha.
        3 | 4 => 4,
        n => n,
    };
    PixelFormat::new(channels, a.sample())
}

impl Decoded {
    /// The file of a piece, which is taken for what can be made of it where that `tolerates` damage.
    pub(crate) fn of(piece: &Piece, format: PixelFormat, tolerates: bool) -> Result<Decoded, InputFault> {
        let mut decoded = Decoded { tolerates, ..Decoded::default() };
        decoded.load(piece, format)?;
        Ok(decoded)
    }

    /// Returns true if it is the file of a piece.
    pub(crate) fn is_of(&self, piece: &Piece) -> bool {
        self.path == piece.path && !self.texels.is_empty()
    }

    /// Decodes the file of a piece, unless it was the last one asked for.
    pub(crate) fn load(&mut self, piece: &Piece, format: PixelFormat) -> Result<(), InputFault> {
        if self.is_of(piece) {
            return Ok(());
        }
        self.path.clone_from(&piece.path);
        self.size = piece.size;
        let loaded = self.decode(piece, format);
        if loaded.is_err() {
            self.texels.clear();
        }
        loaded.map_err(|fault| in_tile(&piece.path, fault))
    }

    fn decode(&mut self, piece: &Piece, format: PixelFormat) -> Result<(), InputFault> {
        let mut image = open_image(&piece.path)?;
        let header = image.header();
        let (found, own) = ([header.width, header.height], header.format);
        if found != piece.size {
            let ([w, h], [x, y]) = (found, piece.size);
            return Err(InputFault::layout(
                format!("has {w}x{h} texels where {x}x{y} are expected"),
                "make the tiles anew, all of one size",
            ));
        }
        if common(own, format) != Some(format) && own != format {
            return Err(InputFault::layout(
                format!("holds {own} texels while other tiles hold {format}"),
                "convert all tiles to one kind",
            ));
        }
        if self.tolerates {
            image.tolerate();
        }
        let header = image.header();
        let mut stored = vec![0; header.row_bytes() * header.height as usize];
        image.read_rows(&mut stored)?;
        if own == format {
            self.texels = stored;
            return Ok(());
        }
        let texels = found[0] as usize * found[1] as usize;
        self.texels.resize(texels * format.texel_bytes(), 0);
        let pairs =
            self.texels.chunks_exact_mut(format.texel_bytes()).zip(stored.chunks_exact(own.texel_bytes()));
        pairs.for_each(|(to, from)| widen(to, from, own.sample()));
        Ok(())
    }

    /// Copies the rectangle of a piece, `size` texels, into `target`, whose rows are `stride` bytes apart.
    pub(crate) fn copy(
        &self,
        target: &mut [u8],
        stride: usize,
        size: [u32; 2],
        piece: &Piece,
        texel_bytes: usize,
    ) {
        let in_file = |axis: usize, n: u32| {
            u64::from(piece.first[axis]) + ((piece.within[axis] + u64::from(n)) >> piece.shift)
        };
        for y in 0..size[1] {
            let row = in_file(1, y) as usize * self.size[0] as usize;
            let to = &mut target[y as usize * stride..][..size[0] as usize * texel_bytes];
            if piece.shift == 0 {
                let start = (row + in_file(0, 0) as usize) * texel_bytes;
                to.copy_from_slice(&self.texels[start..start + to.len()]);
                continue;
            }
            for (x, texel) in (0..size[0]).zip(to.chunks_exact_mut(texel_bytes)) {
                let start = (row + in_file(0, x) as usize) * texel_bytes;
                texel.copy_from_slice(&self.texels[start..start + texel_bytes]);
            }
        }
    }

    /// One texel of the file, for looking at seams.
    pub(crate) fn texel(&self, x: u32, y: u32, texel_bytes: usize) -> &[u8] {
        let start = (y as usize * self.size[0] as usize + x as usize) * texel_bytes;
        &self.texels[start..start + texel_bytes]
    }
}

/// A texel with more channels: grey goes into all colours, alpha that is missing is opaque.
pub(crate) fn widen(to: &mut [u8], from: &[u8], sample: Sample) {
    let bytes = sample.bytes();
    let (wide, narrow) = (to.len() / bytes, from.len() / bytes);
    let channel = |n: usize| &from[n * bytes..(n + 1) * bytes];
    for (n, to) in to.chunks_exact_mut(bytes).enumerate() {
        let is_alpha = n + 1 == wide && wide.is_multiple_of(2);
        to.copy_from_slice(match (is_alpha, narrow) {
            (true, 2 | 4) => channel(narrow - 1),
            (true, _) => sample.one(),
            (false, 1 | 2) => channel(0),
            (false, _) => channel(n),
        });
    }
}

/// A fault with the tile in which it is.
pub(crate) fn in_tile(path: &Path, fault: InputFault) -> InputFault {
    InputFault::Tile { path: path.into(), fault: Box::new(fault) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_tile_goes_into_the_common_one() {
        type P = PixelFormat;
        assert_eq!(common(P::GREY8, P::GREY8), Some(P::GREY8));
        assert_eq!(common(P::GREY8, P::GREY_ALPHA8), Some(P::GREY_ALPHA8));
        assert_eq!(common(P::RGB8, P::RGB8), Some(P::RGBA8));
        assert_eq!(common(P::GREY_ALPHA8, P::RGB8), Some(P::RGBA8));
        assert_eq!(common(P::GREY8, P::GREY16), None);
        for (from, expected) in [
            (&[7][..], [7, 7, 7, 255]),
            (&[7, 9], [7, 7, 7, 9]),
            (&[1, 2, 3], [1, 2, 3, 255]),
            (&[1, 2, 3, 4], [1, 2, 3, 4]),
        ] {
            let mut to = [0; 4];
            widen(&mut to, from, Sample::U8);
            assert_eq!(to, expected);
        }
        let mut to = [0; 8];
        widen(&mut to, &[1, 2], Sample::U16);
        assert_eq!(to, [1, 2, 1, 2, 1, 2, 255, 255]);
    }
}
