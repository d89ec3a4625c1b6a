//! Containers that are read directly from the disk: as any other, wherever their tiles begin.

use std::sync::Arc;

use pollster::block_on;
use vastex_core::{Dims, Geometry, GeometrySpec, LayerFormat, PageId, TextureNumber};

use crate::testing::textures::{aligned_bytes, image};
use crate::*;

#[test]
fn a_container_conforms_however_it_is_read() {
    let spec = GeometrySpec { page: 24, ..GeometrySpec::image(777, 500) };
    let source = PropertySource::new(Geometry::new(spec).unwrap());
    let description = source.description();
    let dir = tempfile::tempdir().unwrap();
    for align in [1, 4096, 1 << 16] {
        let path = dir.path().join(format!("{align}.vastex"));
        let options = WriterOptions { align, ..WriterOptions::default() };
        let mut writer = ContainerWriter::create(&path, (**description).clone(), options).unwrap();
        for pos in description.geometry.pages() {
            let texels = block_on(source.read(pos)).unwrap().bytes;
            writer.append(pos, EncodedTile::new(texels, description, Compression::Lz4)).unwrap();
        }
        writer.finish().unwrap();
        let store = DirectStore::open(&path, 3).unwrap();
        let able = store.block_bytes().is_some_and(|block| block.get() <= align);
        let container = Container::open_file_direct(&path, 3).unwrap();
        assert_eq!(container.is_direct(), able, "aligned to {align}");
        assert_eq!(conformance(&container), Ok(()));
        // Ranges are widened to blocks, so that a store reads tiles directly wherever they begin.
        assert_eq!(conformance(&block_on(Container::open(Arc::new(store))).unwrap()), Ok(()));
        assert!(!Container::open_file(&path).unwrap().is_direct());
    }
}

#[test]
fn a_loader_with_several_reads_in_flight_gets_every_tile() {
    let dir = tempfile::tempdir().unwrap();
    let description = image(900, 700, 64, LayerFormat::Rgba8);
    let path = dir.path().join("a.vastex");
    std::fs::write(&path, aligned_bytes(&description, Compression::Lz4, 5, 4096)).unwrap();
    let container = Arc::new(Container::open_file_direct(&path, DirectStore::DEFAULT_DEPTH).unwrap());
    let limit = container.read_limit().map(|limit| (limit.reads(), limit.is_blocking()));
    assert_eq!(limit, container.is_direct().then_some((DirectStore::DEFAULT_DEPTH, true)));
    let limited = LimitedSource::new(container.clone(), ReadLimit::new(2));
    assert_eq!([container.blocks(), limited.blocks()], [container.is_direct(); 2]);
    let mut loader = Loader::new(1).unwrap();
    let texture = TextureNumber::new(0).unwrap();
    loader.add_source(texture, container.clone());
    let pages: Vec<_> = description.geometry.pages().collect();
    for (rank, &pos) in (0..).zip(&pages) {
        loader.request(PageId::new(texture, Dims::D2, pos).unwrap(), rank);
    }
    let mut loaded = 0;
    while let Some(Loaded { page, result }) = loader.wait() {
        let tile = block_on(container.read(page.pos(Dims::D2))).unwrap();
        assert_eq!(result.unwrap(), tile.decode(&description).unwrap());
        loaded += 1;
    }
    assert_eq!(loaded, pages.len());
}

/// The tiles are read by ranges that were checked when the file was opened; then the file is cut off.
#[test]
fn a_file_that_shrinks_fails_tile_by_tile() {
    let dir = tempfile::tempdir().unwrap();
    let description = image(900, 700, 64, LayerFormat::Rgba8);
    let path = dir.path().join("a.vastex");
    std::fs::write(&path, aligned_bytes(&description, Compression::None, 5, 4096)).unwrap();
    let container = Container::open_file_direct(&path, 4).unwrap();
    std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(5000).unwrap();
    let geometry = &description.geometry;
    assert!(block_on(container.read(geometry.tail_pos())).is_ok(), "coarse tiles are in memory");
    let errors = geometry.pages_of_level(0).filter_map(|pos| block_on(container.read(pos)).err());
    let errors: Vec<_> = errors.map(|error| error.to_string()).collect();
    assert!(errors.len() > 10 && errors.iter().all(|error| error.contains("shorter")), "{errors:?}");
}
