//! What every source must keep, as a function that tests any source.

use std::collections::HashMap;
use std::pin::pin;
use std::task::{Context, Waker};

use bytes::Bytes;
use pollster::block_on;
use vastex_core::{Box3, Geometry, PagePos};

use crate::sources::{ReadError, TileSource};
use crate::tile::{Codec, Tile};

/// Pages that are checked one by one at most; of larger textures a fixed sample is.
const SAMPLE: u64 = 256;
/// Limits on the check of contents: pages that are asked for their contents, contents that are looked at, and
/// pages of each content that are read.
const LOOKED_AT: usize = 1 << 16;
const CONTENTS: u32 = 64;
const PAGES_OF_A_CONTENT: u32 = 3;
/// Decoded tiles that are kept for comparing borders.
const KEPT_TILES: usize = 32;

/// Tests that a source keeps the promises of [`TileSource`]. Every page (of a large texture the tail, each
/// level's corners and a fixed sample) reads, decodes, and reads the same again. Borders, those in the tail
/// included, hold the texels that the address modes say. Reading a page that does not exist fails with
/// [`ReadError::NoSuchTile`]. Pages that are said to have the same content do. Dropping a read harms nothing.
///
/// A source may lack only the tiles that are not in its [`TileSource::present`], which has the tail, and with
/// each page its ancestors. Returns the first fault found; never panics unless the source does.
pub fn conformance(source: &dyn TileSource) -> Result<(), String> {
    let mut check = Check { source, geometry: &source.description().geometry, tiles: HashMap::new() };
    check.descriptions()?;
    check.missing_pages()?;
    check.contents()?;
    for pos in sample(check.geometry) {
        check.reads(pos)?;
        check.borders(pos)?;
    }
    Ok(())
}

/// The pages to check, tail first.
fn sample(geometry: &Geometry) -> Vec<PagePos> {
    if geometry.page_count() <= SAMPLE {
        return geometry.pages().collect();
    }
    let mut pages = vec![geometry.tail_pos()];
    let levels = geometry.tail().first_level();
    for level in 0..levels {
        let last = geometry.level(level).pages.map(|n| n - 1);
        pages.extend([PagePos::at(level, [0; 3]), PagePos::at(level, last)]);
    }
    let mut state = 0x9e37_79b9_7f4a_7c15u64;
    let mut below = |n: u32| {
        // SplitMix64.
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (state ^ state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((mixed >> 32) % u64::from(n)) as u32
    };
    while (pages.len() as u64) < SAMPLE {
        let level = below(u32::from(levels)) as u8;
        pages.push(PagePos::at(level, geometry.level(level).pages.map(&mut below)));
    }
    pages
}

struct Check<'a> {
    source: &'a dyn TileSource,
    geometry: &'a Geometry,
    tiles: HashMap<PagePos, Option<Bytes>>,
}

impl Check<'_> {
    fn descriptions(&self) -> Result<(), String> {
        let first = self.source.description();
        if first.layers.is_empty() {
            return Err("the texture has no layers".into());
        }
        if first != self.source.description() {
            return Err("the description changes".into());
        }
        if self.source.identity() != self.source.identity() {
            return Err("the identity changes".into());
        }
        let orphan = self.geometry.pages().take(SAMPLE as usize).find(|&pos| {
            self.is_present(pos) && self.geometry.parent(pos).is_some_and(|parent| !self.is_present(parent))
        });
        match orphan {
            Some(pos) => Err(format!("{pos} is said to have a tile, but not its parent")),
            None => Ok(()),
        }
    }

    fn is_present(&self, pos: PagePos) -> bool {
        self.source.present().is_none_or(|present| present.contains(pos))
    }

    fn missing_pages(&self) -> Result<(), String> {
        let tail = self.geometry.tail_pos();
        let beyond = (0..tail.level).flat_map(|level| {
            let pages = self.geometry.level(level).pages;
            (0..3).map(move |a| {
                let mut coords = [0; 3];
                coords[a] = pages[a];
                PagePos::at(level, coords)
            })
        });
        let odd = [
            PagePos { x: 1, ..tail },
            PagePos { level: tail.level + 1, ..tail },
            PagePos::at(u8::MAX, [0; 3]),
            PagePos::at(0, [u32::MAX; 3]),
        ];
        for pos in beyond.chain(odd) {
            match block_on(self.source.read(pos)) {
                Err(ReadError::NoSuchTile { pos: named }) if named == pos => {}
                other => return Err(format!("{pos} does not exist, but reading it gives {other:?}")),
            }
        }
        Ok(())
    }

    /// Checks that the first pages of the first contents have the same texels, and those of constant contents
    /// the constant.
    fn contents(&mut self) -> Result<(), String> {
        let Some(contents) = self.source.contents().cloned() else { return Ok(()) };
        let description = self.source.description().clone();
        let mut pages: HashMap<u32, (u32, Option<Bytes>)> = HashMap::new();
        for pos in self.geometry.pages().take(LOOKED_AT).filter(|&pos| self.is_present(pos)) {
            let Some(content) = contents.of(pos).filter(|&content| content < CONTENTS) else { continue };
            let (seen, first) = pages.entry(content).or_insert_with(|| {
                let constant = contents.constant(content).cloned();
                let tile = constant.map(|bytes| Tile { codec: Codec::Constant, bytes });
                (0, tile.and_then(|tile| tile.decode(&description).ok()))
            });
            *seen += 1;
            if *seen > PAGES_OF_A_CONTENT {
                continue;
            }
            let texels = self.read(pos)?;
            if *first.get_or_insert_with(|| texels.clone().unwrap_or_default()) != texels.unwrap_or_default()
            {
                return Err(format!("{pos} is said to have content {content}, and has another"));
            }
        }
        Ok(())
    }

    /// The texels of a page, or `None` if the source lacks it.
    fn tile(&mut self, pos: PagePos) -> Result<Option<Bytes>, String> {
        if let Some(tile) = self.tiles.get(&pos) {
            return Ok(tile.clone());
        }
        let texels = self.read(pos)?;
        if self.tiles.len() >= KEPT_TILES {
            self.tiles.clear();
        }
        self.tiles.insert(pos, texels.clone());
        Ok(texels)
    }

    fn read(&self, pos: PagePos) -> Result<Option<Bytes>, String> {
        match block_on(self.source.read(pos)) {
            Ok(_) if !self.is_present(pos) => Err(format!("{pos} has a tile, but is said to have none")),
            Ok(tile) => {
                let texels = tile.decode(self.source.description()).map_err(|e| format!("{pos}: {e}"))?;
                Ok(Some(texels))
            }
            Err(ReadError::NoSuchTile { .. }) if !self.is_present(pos) => Ok(None),
            Err(error) => Err(format!("{pos} cannot be read: {error}")),
        }
    }

    /// A page reads the same again, also after reads of it were dropped.
    fn reads(&mut self, pos: PagePos) -> Result<(), String> {
        let first = self.tile(pos)?;
        drop(self.source.read(pos));
        let mut begun = self.source.read(pos);
        let _ = pin!(&mut begun).poll(&mut Context::from_waker(Waker::noop()));
        drop(begun);
        if self.read(pos)? == first {
            Ok(())
        } else {
            Err(format!("{pos} reads differently the second time"))
        }
    }

    fn borders(&mut self, pos: PagePos) -> Result<(), String> {
        let Some(tile) = self.tile(pos)? else { return Ok(()) };
        let mut boxes = self.geometry.tile_boxes(pos);
        boxes.try_for_each(|(level, level_box, offset)| self.border(pos, level, &tile, level_box, offset))
    }

    /// Checks that every texel of a box in the tile is the one that it stands for, in the tile that has that
    /// texel in its payload.
    fn border(
        &mut self,
        pos: PagePos,
        level: u8,
        tile: &Bytes,
        level_box: Box3,
        offset: [u32; 3],
    ) -> Result<(), String> {
        let (size, border) = (self.geometry.level(level).size, self.geometry.border());
        let [nx, ny, nz] = level_box.size;
        for (z, y, x) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x)))) {
            let at: [u32; 3] = [x, y, z];
            let level_texel: [i64; 3] = std::array::from_fn(|a| level_box.origin[a] + i64::from(at[a]));
            // Beyond the border of the level's last texel a tile may hold anything.
            if (0..3).any(|a| level_texel[a] >= i64::from(size[a]) + i64::from(border[a])) {
                continue;
            }
            // Nor is there a texel where the border colour lies.
            if self.geometry.is_border_color(level, level_texel) {
                continue;
            }
            let inside = self.geometry.fold_texel(level, level_texel);
            let (owner, owner_texel) = self.owner(pos, level, inside);
            let tile_texel = std::array::from_fn(|a| offset[a] + at[a]);
            if (owner, owner_texel) == (pos, tile_texel) {
                continue;
            }
            let Some(owner_tile) = self.tile(owner)? else { continue };
            if self.texel(tile, tile_texel) != self.texel(&owner_tile, owner_texel) {
                return Err(format!(
                    "{pos}: texel {tile_texel:?} of the tile is not texel {inside:?} of level {level}, as {owner} has it"
                ));
            }
        }
        Ok(())
    }

    /// The page that has a texel of a level in its payload, and the position of the texel in that page's
    /// tile.
    fn owner(&self, pos: PagePos, level: u8, inside: [u32; 3]) -> (PagePos, [u32; 3]) {
        if self.geometry.is_tail(pos) {
            return (pos, self.geometry.tile_texel_from_tail_texel(level, inside));
        }
        let page = self.geometry.page();
        let page_texel = std::array::from_fn(|a| inside[a] % page[a]);
        let owner = PagePos::at(level, std::array::from_fn(|a| inside[a] / page[a]));
        (owner, self.geometry.tile_texel_from_page_texel(page_texel))
    }

    /// One texel of every layer that has the full resolution and is not compressed. In other layers, the
    /// border of a tile is not made texel by texel of what its neighbour's payload is made of.
    fn texel(&self, tile: &Bytes, tile_texel: [u32; 3]) -> Vec<u8> {
        let [width, height, _] = self.geometry.tile().map(|n| n as usize);
        let [x, y, z] = tile_texel.map(|n| n as usize);
        let texel = (z * height + y) * width + x;
        let (mut layer_first, mut bytes) = (0, Vec::new());
        let description = self.source.description();
        for layer in &description.layers {
            let len = layer.format.texel_bytes();
            if layer.scale == 1 && !layer.format.is_compressed() {
                bytes.extend_from_slice(&tile[layer_first + texel * len..][..len]);
            }
            layer_first += description.layer_bytes(layer);
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sources::PropertySource;
    use crate::testing::{Faults, Injection};
    use crate::tile::{Codec, Tile};
    use proptest::prelude::*;
    use vastex_core::{AddressMode, GeometrySpec};

    fn property(width: u32, height: u32) -> PropertySource {
        PropertySource::new(
            Geometry::new(GeometrySpec { page: 20, ..GeometrySpec::image(width, height) }).unwrap(),
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn the_generated_source_conforms(
            size in prop::array::uniform3(1u32..150), page in 8u32..40, border in 1u32..5, volume: bool,
            address in prop::array::uniform3(prop::sample::select(vec![AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror])),
        ) {
            let spec = match volume {
                true => GeometrySpec { page: 8 + page / 8, border, address, ..GeometrySpec::volume(size.map(|n| n / 5 + 1)) },
                false => GeometrySpec { page, border, address, ..GeometrySpec::image(size[0], size[1]) },
            };
            let source = PropertySource::new(Geometry::new(spec).unwrap());
            prop_assert_eq!(conformance(&source), Ok(()));
        }
    }

    #[test]
    fn large_textures_are_sampled() {
        assert_eq!(conformance(&property(4000, 3000)), Ok(()));
    }

    /// What the suite says of a source that goes wrong in one way.
    fn failure(plan: impl Fn(PagePos, u32) -> Option<Injection> + Send + Sync) -> String {
        conformance(&Faults::new(property(100, 70), plan)).unwrap_err()
    }

    #[test]
    fn sources_that_go_wrong_are_found() {
        let broken = PagePos::new_2d(0, 2, 1);
        let at = |pos: PagePos, injection| (pos == broken).then_some(injection);
        assert!(failure(move |pos, _| at(pos, Injection::Fail)).contains("cannot be read"));
        assert!(failure(move |pos, _| at(pos, Injection::Corrupt)).contains("does not decode"));
        let black = || Injection::Replace(Tile { codec: Codec::Constant, bytes: vec![0; 4].into() });
        assert!(failure(move |pos, _| at(pos, black())).contains("of the tile is not"));
        assert!(
            failure(move |pos, n| at(pos, black()).filter(|_| n > 1)).contains("differently the second time")
        );
        let source = property(100, 70);
        let tail = source.description().geometry.tail_pos();
        let missing = move |pos, _| (pos == tail).then_some(Injection::NoSuchTile);
        assert!(conformance(&Faults::new(source, missing)).unwrap_err().contains("cannot be read"));
    }

    #[test]
    fn a_broken_border_texel_is_found() {
        let source = property(100, 70);
        let broken = PagePos::new_2d(0, 1, 1);
        let mut texels = block_on(source.read(broken)).unwrap().bytes.to_vec();
        texels[4 * (5 * 28 + 3)] ^= 1;
        let tile = Tile { codec: Codec::Raw, bytes: texels.into() };
        let plan = move |pos, _| (pos == broken).then(|| Injection::Replace(tile.clone()));
        let failure = conformance(&Faults::new(source, plan)).unwrap_err();
        assert!(failure.starts_with("level 0 page 1,1: texel [3, 5, 0] of the tile"), "{failure}");
    }
}
