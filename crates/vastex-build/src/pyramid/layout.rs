//! Rows with what lies beyond their ends: as they are stored, so that a tile's row is one copy, and as
//! filters want them.

use std::ops::Range;

use vastex_core::{AddressMode, Geometry, LayerFormat, fold, is_border_color};

/// Bytes of a row of a level as it is stored: as far as its tiles reach.
pub(crate) fn row_bytes(geometry: &Geometry, format: LayerFormat, level: u8) -> usize {
    let texels = if level >= geometry.tail().first_level() {
        u64::from(geometry.level_box_of_tail(level).size[0])
    } else {
        u64::from(geometry.level(level).pages[0]) * u64::from(geometry.page()[0])
            + 2 * u64::from(geometry.border()[0])
    };
    texels as usize * format.texel_bytes()
}

/// Where the texels of a level lie in a stored row, and what lies around them.
pub(crate) struct RowLayout {
    /// Texels of the level.
    pub(crate) width: usize,
    /// Bytes of a texel.
    pub(crate) texel: usize,
    /// Texels before the first one of the level.
    left: usize,
    /// For each padding texel, left ones first, the texel of the stored row that it repeats, or the border
    /// colour.
    sources: Vec<Option<u32>>,
    /// A texel of the border colour.
    color: Vec<u8>,
}

impl RowLayout {
    /// `color` is a texel of the border colour.
    pub(crate) fn new(geometry: &Geometry, format: LayerFormat, level: u8, color: &[u8]) -> RowLayout {
        let (mode, width, left) =
            (geometry.address()[0], geometry.level(level).size[0], geometry.border()[0]);
        let texel = format.texel_bytes();
        let texels = (row_bytes(geometry, format, level) / texel) as i64;
        let (first, last) = (-i64::from(left), texels - i64::from(left));
        let padding = (first..0).chain(i64::from(width)..last);
        let source = |i| (!is_border_color(mode, i, width)).then(|| fold(mode, i, width) + left);
        let sources = padding.map(source).collect();
        RowLayout { width: width as usize, texel, left: left as usize, sources, color: color.to_vec() }
    }

    /// The texels of the level.
    pub(crate) fn payload<'r>(&self, row: &'r [u8]) -> &'r [u8] {
        &row[self.left * self.texel..][..self.width * self.texel]
    }

    /// As [`RowLayout::payload`], to be filled.
    pub(crate) fn payload_mut<'r>(&self, row: &'r mut [u8]) -> &'r mut [u8] {
        &mut row[self.left * self.texel..][..self.width * self.texel]
    }

    /// Twice as many texels as the next level has, the padding included that its odd edge needs.
    pub(crate) fn pairs<'r>(&self, row: &'r [u8], coarse_width: usize) -> &'r [u8] {
        &row[self.left * self.texel..][..2 * coarse_width * self.texel]
    }

    /// Fills what lies left and right of the payload.
    pub(crate) fn pad(&self, row: &mut [u8]) {
        match self.texel {
            1 => self.pad_texels::<1>(row),
            2 => self.pad_texels::<2>(row),
            4 => self.pad_texels::<4>(row),
            _ => self.pad_texels::<8>(row),
        }
    }

    fn pad_texels<const TEXEL: usize>(&self, row: &mut [u8]) {
        let texels = row.as_chunks_mut::<TEXEL>().0;
        let color = self.color.first_chunk().copied().unwrap_or([0; TEXEL]);
        let targets = (0..self.left).chain(self.left + self.width..texels.len());
        for (target, &source) in targets.zip(&self.sources) {
            texels[target] = source.map_or(color, |source| texels[source as usize]);
        }
    }
}

/// The texels `range` of a row of `width`, some of which lie beyond its ends. Covers the whole row.
pub(crate) struct Reached {
    before: Vec<Option<u32>>,
    after: Vec<Option<u32>>,
}

impl Reached {
    pub(crate) fn new(mode: AddressMode, width: u32, range: &Range<i64>) -> Reached {
        let source = |i| (!is_border_color(mode, i, width)).then(|| fold(mode, i, width));
        Reached {
            before: (range.start..0).map(source).collect(),
            after: (i64::from(width)..range.end).map(source).collect(),
        }
    }

    /// These texels; `payload` are those of the level and `color` is one of the border colour.
    pub(crate) fn texels(&self, payload: &[u8], color: &[u8]) -> Vec<u8> {
        let beyond = self.before.len() + self.after.len();
        let mut texels = Vec::with_capacity(payload.len() + beyond * color.len());
        let texel = |source: &Option<u32>| match *source {
            Some(i) => &payload[i as usize * color.len()..][..color.len()],
            None => color,
        };
        self.before.iter().for_each(|source| texels.extend_from_slice(texel(source)));
        texels.extend_from_slice(payload);
        self.after.iter().for_each(|source| texels.extend_from_slice(texel(source)));
        texels
    }
}
