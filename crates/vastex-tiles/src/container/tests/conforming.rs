//! A container filled from the generated source conforms and is that source, from memory and from a file.

use std::sync::Arc;

use pollster::block_on;
use proptest::prelude::*;
use vastex_core::{AddressMode, Description, Geometry, GeometrySpec, LayerFormat, PageContents, PagePos};

use crate::testing::textures::{container_bytes, image, open};
use crate::*;

/// The generated source as a container.
fn property_bytes(source: &PropertySource, compression: Compression) -> Vec<u8> {
    some_property_bytes(source, compression, |_| true)
}

/// The same with the tail and those pages alone for which `has_tile` says so.
fn some_property_bytes(
    source: &PropertySource,
    compression: Compression,
    has_tile: impl Fn(PagePos) -> bool,
) -> Vec<u8> {
    let description = Description::clone(source.description());
    let out = std::io::Cursor::new(Vec::new());
    let mut writer =
        ContainerWriter::new(out, "memory", description.clone(), WriterOptions::default()).unwrap();
    for pos in description.geometry.pages().filter(|&p| p == description.geometry.tail_pos() || has_tile(p)) {
        let texels = block_on(source.read(pos)).unwrap().bytes;
        writer.append(pos, EncodedTile::new(texels, &description, compression)).unwrap();
    }
    writer.complete().unwrap().0.into_inner()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn a_container_in_memory_conforms(
        size in prop::array::uniform3(1u32..150), page in 8u32..40, border in 1u32..5, volume: bool,
        address in prop::sample::select(vec![AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror]),
        compression in prop::sample::select(vec![Compression::None, Compression::Lz4, Compression::Zstd(1)]),
    ) {
        let address = [address; 3];
        let spec = match volume {
            true => GeometrySpec { page: 8, border: 2, address, ..GeometrySpec::volume(size.map(|n| n / 5 + 1)) },
            false => GeometrySpec { page, border, address, ..GeometrySpec::image(size[0], size[1]) },
        };
        let source = PropertySource::new(Geometry::new(spec).unwrap());
        let container = open(property_bytes(&source, compression));
        prop_assert_eq!(conformance(&container), Ok(()));
    }
}

#[test]
fn a_container_that_lacks_tiles_says_so() {
    let spec = GeometrySpec { page: 24, ..GeometrySpec::image(777, 500) };
    let source = PropertySource::new(Geometry::new(spec).unwrap());
    let geometry = &source.description().geometry;
    assert!(open(property_bytes(&source, Compression::Lz4)).present().is_none());
    // Level 0 has tiles in the west alone, and one whose parent has none, which so counts as missing, too.
    let orphan = PagePos::new_2d(0, 20, 3);
    let has_tile = |pos: PagePos| pos.level >= 2 || pos.x << pos.level < 8 || pos == orphan;
    let container = open(some_property_bytes(&source, Compression::Lz4, has_tile));
    assert_eq!(conformance(&container), Ok(()));
    let present = container.present().unwrap();
    for pos in geometry.pages() {
        assert_eq!(present.contains(pos), has_tile(pos) && pos != orphan, "{pos}");
        assert_eq!(block_on(container.read(pos)).is_ok(), present.contains(pos), "{pos}");
    }
}

#[test]
fn a_container_in_a_file_conforms_behind_a_cache_too() {
    let spec = GeometrySpec { page: 24, ..GeometrySpec::image(777, 500) };
    let source = PropertySource::new(Geometry::new(spec).unwrap());
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("property.vastex");
    std::fs::write(&path, property_bytes(&source, Compression::Lz4)).unwrap();
    let container = Arc::new(Container::open_file(&path).unwrap());
    assert_eq!(conformance(&container), Ok(()));
    for pos in source.description().geometry.pages() {
        let texels = block_on(container.read(pos)).unwrap().decode(container.description()).unwrap();
        assert_eq!(texels, block_on(source.read(pos)).unwrap().bytes, "{pos}");
    }
    assert_eq!(conformance(&RamCache::new(container, 100_000)), Ok(()));
}

#[test]
fn a_file_that_shrinks_while_open_fails_tile_by_tile() {
    let source = PropertySource::new(Geometry::new(GeometrySpec::image(3000, 3000)).unwrap());
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("property.vastex");
    std::fs::write(&path, property_bytes(&source, Compression::None)).unwrap();
    let container = Container::open_file(&path).unwrap();
    std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(2000).unwrap();
    let geometry = &container.description().geometry;
    assert!(block_on(container.read(geometry.tail_pos())).is_ok(), "coarse tiles are in memory");
    let fine = geometry.pages_of_level(0).last().unwrap();
    let error = block_on(container.read(fine)).unwrap_err().to_string();
    assert!(error.contains("property.vastex: bytes ") && error.contains("shorter"), "{error}");
}

#[test]
fn copies_have_one_identity_and_other_tiles_have_another() {
    let description = image(100, 50, 24, LayerFormat::R8);
    let bytes = |compression, seed| container_bytes(&description, compression, seed);
    let of = |bytes: Vec<u8>| open(bytes).identity().unwrap();
    let identity = of(bytes(Compression::None, 1));
    assert_eq!(of(bytes(Compression::None, 1)), identity);
    assert_eq!(RamCache::new(open(bytes(Compression::None, 1)), 0).identity(), Some(identity));
    for others in [bytes(Compression::None, 2), bytes(Compression::Lz4, 1)] {
        assert_ne!(of(others), identity);
    }
}

/// Tiles of a colour each, or of one that is written twice, or of one that is like no other.
#[test]
fn a_container_says_which_pages_have_the_same_record_or_color() {
    let description = image(600, 400, 24, LayerFormat::R8);
    let geometry = description.geometry.clone();
    let bytes = description.tile_bytes();
    let tile = |pos: PagePos| match (pos.x + 3 * pos.y) % 7 {
        0..4 => vec![u8::from(pos.x.is_multiple_of(2)); bytes],
        4 => (0..bytes).map(|n| n as u8).collect(),
        _ => (0..bytes).map(|n| (n as u32 + 7 * pos.x + 31 * pos.y + u32::from(pos.level)) as u8).collect(),
    };
    let mut writer = ContainerWriter::new(
        std::io::Cursor::new(Vec::new()),
        "memory",
        description.clone(),
        WriterOptions::default(),
    )
    .unwrap();
    for pos in geometry.pages() {
        writer.append(pos, EncodedTile::new(tile(pos).into(), &description, Compression::Lz4)).unwrap();
    }
    let container = Arc::new(open(writer.complete().unwrap().0.into_inner()));
    let contents = container.contents().unwrap();
    let mut pages_of = std::collections::BTreeMap::new();
    let finer = || geometry.pages().filter(|&pos| !geometry.is_tail(pos));
    finer().for_each(|pos| *pages_of.entry(tile(pos)).or_insert(0) += 1);
    for (a, b) in finer().zip(finer().skip(5)) {
        let is_shared = |pos| pages_of[&tile(pos)] > 1 || tile(pos).windows(2).all(|pair| pair[0] == pair[1]);
        assert_eq!(contents.of(a).is_some(), is_shared(a), "{a}");
        assert!(
            contents.of(a).is_none() || (contents.of(a) == contents.of(b)) == (tile(a) == tile(b)),
            "{a} {b}"
        );
        let color = contents.of(a).and_then(|content| contents.constant(content)).map(|texel| texel.to_vec());
        assert!(color.is_none_or(|texel| tile(a) == texel.repeat(bytes)), "{a}");
    }
    let constants = (0..contents.count()).filter(|&content| contents.constant(content).is_some());
    assert_eq!((constants.count(), contents.constant(2)), (2, None));
    // What a decorator passes on is what its tiles are; a source that lies is found out.
    let lies = {
        let constants = (0..2).filter_map(|n| contents.constant(n).cloned()).collect();
        PageContents::new(&geometry, constants, contents.count(), |_| Some(0))
    };
    // The borders of these tiles are not those of any image, which is found last.
    assert!(conformance(&container).unwrap_err().contains("texel"));
    let lying = Lying { source: container.clone(), contents: Arc::new(lies) };
    let found = conformance(&lying).unwrap_err();
    assert!(found.contains("is said to have content 0"), "{found}");
    assert_eq!(RamCache::new(container.clone(), 1000).contents(), container.contents());
}

struct Lying {
    source: Arc<Container>,
    contents: Arc<PageContents>,
}

impl TileSource for Lying {
    fn description(&self) -> &Arc<Description> {
        self.source.description()
    }

    fn contents(&self) -> Option<&Arc<PageContents>> {
        Some(&self.contents)
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        self.source.read(pos)
    }
}

#[test]
fn pages_that_differ_have_nothing_in_common() {
    let source = PropertySource::new(Geometry::new(GeometrySpec::image(777, 500)).unwrap());
    assert!(open(property_bytes(&source, Compression::Lz4)).contents().is_none());
}
