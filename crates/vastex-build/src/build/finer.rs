//! A texture with levels that are finer than its image: those are empty until insets are put into them.

use vastex_core::{Description, Geometry, GeometrySpec, PagePos};
use vastex_tiles::{EncodedTile, WriteError, Written};

use super::error::BuildError;
use super::pipeline::Sink;

/// The description of a texture with texels where blocks were.
pub(crate) fn without_blocks(description: &Description) -> Description {
    let mut plain = description.clone();
    plain.layers.iter_mut().for_each(|layer| layer.format = layer.format.decoded());
    plain
}

/// The description of a texture with so many levels more, all finer.
pub(crate) fn finer(description: &Description, levels: u8) -> Result<Description, BuildError> {
    let geometry = &description.geometry;
    let size = geometry.size();
    let larger = |texels: u32| u32::try_from(u64::from(texels) << levels.min(32)).ok();
    let (Some(width), Some(height)) = (larger(size[0]), larger(size[1])) else {
        return Err(BuildError::InsetTooFine { levels, size: [size[0], size[1]] });
    };
    let spec = GeometrySpec { size: [width, height, size[2]], ..*geometry.spec() };
    let finer = Description { geometry: Geometry::new(spec)?, ..description.clone() };
    // A texture so small that its tail has room for more levels has nothing to put into that room.
    match finer.geometry.tail().first_level() == geometry.tail().first_level() + levels {
        true => Ok(finer),
        false => Err(BuildError::InsetInTail { levels, size: [size[0], size[1]] }),
    }
}

/// Takes the tiles of a texture as those of one that has so many levels more.
pub(crate) struct Finer<S> {
    pub(crate) sink: S,
    pub(crate) levels: u8,
}

impl<S> Finer<S> {
    fn pos(&self, pos: PagePos) -> PagePos {
        PagePos { level: pos.level + self.levels, ..pos }
    }
}

impl<S: Sink> Sink for Finer<S> {
    fn append(&mut self, pos: PagePos, tile: EncodedTile) -> Result<(), WriteError> {
        self.sink.append(self.pos(pos), tile)
    }

    fn skip(&mut self, pos: PagePos) -> Result<(), WriteError> {
        self.sink.skip(self.pos(pos))
    }

    fn finish(self) -> Result<Written, WriteError> {
        self.sink.finish()
    }
}
