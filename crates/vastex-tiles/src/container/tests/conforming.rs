//! A container filled from the generated source conforms and is that source, from memory and from a file.

use std::sync::Arc;

use pollster::block_on;
use proptest::prelude::*;
use vastex_core::{AddressMode, Description, Geometry, GeometrySpec, LayerFormat, PagePos};

use crate::testing::{container_bytes, image, open};
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
