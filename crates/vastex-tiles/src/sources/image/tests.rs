//! Pixels in memory are a source like any other, and make each level of the next finer one, whatever is asked
//! for first.

use pollster::block_on;
use proptest::prelude::*;

use super::*;
use crate::testing::conformance;

const ADDRESSES: [AddressMode; 4] =
    [AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border];

fn formats() -> impl Iterator<Item = LayerFormat> {
    LayerFormat::ALL.into_iter().filter(|format| !format.is_compressed())
}

/// Bytes that say little of where they are.
fn noise(bytes: usize) -> Vec<u8> {
    let mut state = 7u32;
    let next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    std::iter::repeat_with(next).take(bytes).collect()
}

fn source(format: LayerFormat, [width, height]: [u32; 2], options: &ImageOptions) -> ImageSource {
    let row = options.row_bytes.unwrap_or(width as usize * format.texel_bytes());
    ImageSource::new(format, [width, height], noise(row * height as usize), options).unwrap()
}

fn bytes_of(source: &ImageSource, pos: PagePos) -> Vec<u8> {
    block_on(source.read(pos)).unwrap().bytes.to_vec()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn pixels_are_a_source(
        size in prop::array::uniform2(1u32..300), gap in 0usize..9, page in 8u32..140, border in 1u32..5,
        format in prop::sample::select(formats().collect::<Vec<_>>()),
        address in prop::array::uniform2(prop::sample::select(ADDRESSES.to_vec())),
    ) {
        let row_bytes = Some(size[0] as usize * format.texel_bytes() + gap);
        let options = ImageOptions { row_bytes, page, border, address, ..ImageOptions::default() };
        prop_assert_eq!(conformance(&source(format, size, &options)), Ok(()));
    }
}

#[test]
fn a_texel_a_row_and_a_column_of_more_than_65536_are_images() {
    for (size, format) in [
        ([1, 1], LayerFormat::Rgba16Float),
        ([70_001, 1], LayerFormat::Rgba8Srgb),
        ([1, 70_001], LayerFormat::R16),
        ([66_000, 3], LayerFormat::R32Float),
    ] {
        let source = source(format, size, &ImageOptions::default());
        assert_eq!(conformance(&source), Ok(()), "{size:?} {format:?}");
    }
}

#[test]
fn tiles_are_the_same_whatever_was_read_before_and_however_little_is_kept() {
    // Level 1 has 4 MB, so that its cells come and go.
    let options = ImageOptions { cache_bytes: Some(0), ..ImageOptions::default() };
    let (size, format) = ([2001, 1001], LayerFormat::Rgba16);
    let (scarce, ample) = (source(format, size, &options), source(format, size, &ImageOptions::default()));
    let geometry = &ample.description.geometry;
    let pages: Vec<PagePos> = geometry.pages().collect();
    for n in (0..pages.len()).step_by(7) {
        // From the finest level to the tail in one, from the tail in the other.
        let (fine, coarse) = (pages[pages.len() - 1 - n], pages[n]);
        assert_eq!(bytes_of(&scarce, fine), bytes_of(&ample, fine), "{fine}");
        assert_eq!(bytes_of(&ample, coarse), bytes_of(&scarce, coarse), "{coarse}");
        assert!(scarce.cached_bytes() <= LEAST_CACHE, "{}", scarce.cached_bytes());
    }
    assert!(ample.cached_bytes() <= USUAL_CACHE);
    assert!(scarce.cached_bytes() > LEAST_CACHE / 2, "it keeps what it may: {}", scarce.cached_bytes());
}

#[test]
fn nothing_is_made_before_it_is_asked_for() {
    let source = source(LayerFormat::Rgba8Srgb, [2000, 1000], &ImageOptions::default());
    let finest = PagePos::new_2d(0, 3, 2);
    assert_eq!(source.at_hand(finest).unwrap().bytes, block_on(source.read(finest)).unwrap().bytes);
    assert_eq!(source.cached_bytes(), 0, "level 0 is the pixels");
    let coarser = PagePos::new_2d(2, 1, 0);
    assert!(source.at_hand(coarser).is_none(), "it would have to be made");
    let tile = block_on(source.read(coarser)).unwrap();
    assert_eq!(source.at_hand(coarser).unwrap().bytes, tile.bytes);
}

#[test]
fn pixels_are_not_copied() {
    let pixels: Arc<[u8]> = noise(640 * 480 * 4).into();
    let source = ImageSource::rgba8(640, 480, pixels.clone()).unwrap();
    assert_eq!(source.pixels.as_ptr(), pixels.as_ptr());
    assert_eq!(conformance(&source), Ok(()));
    drop(source);
    assert_eq!(Arc::strong_count(&pixels), 1);
}

#[test]
fn numbers_are_taken_as_they_are() {
    let first = |source: &ImageSource, bytes: usize| {
        let tile = bytes_of(source, source.description.geometry.tail_pos());
        let border = source.description.geometry.border()[0] as usize;
        let at = (border * source.description.geometry.tile()[0] as usize + border) * bytes;
        tile[at..at + bytes].to_vec()
    };
    let heights = ImageSource::r32f(3, 1, vec![-12.5, 1.0, 2.0]).unwrap();
    assert_eq!(first(&heights, 4), (-12.5f32).to_le_bytes());
    let grey = ImageSource::r16(1, 2, vec![4660, 1]).unwrap();
    assert_eq!(first(&grey, 2), [0x34, 0x12]);
}

#[test]
fn labels_are_picked_and_not_blended() {
    let options = ImageOptions { reduction: Some(Reduction::Labels), ..ImageOptions::default() };
    let labels = vec![3, 7, 7, 9];
    let source = ImageSource::new(LayerFormat::R8, [2, 2], labels, &options).unwrap();
    assert!(!source.description.layers[0].is_mixable);
    let mut coarsest = [0; 1];
    let up = Box3 { origin: [0; 3], size: [1; 3] };
    source.copy(1, up, (&mut coarsest, 1), &mut LookedAt::default(), Make::Yes).unwrap();
    assert_eq!(coarsest, [7]);
}

#[test]
fn pixels_that_are_no_image_are_refused_by_what_is_wrong() {
    let of = |format, size, bytes: usize, options: &ImageOptions| {
        ImageSource::new(format, size, vec![0; bytes], options).err().map(|error| error.to_string())
    };
    let usual = ImageOptions::default();
    let said = of(LayerFormat::Bc7Srgb, [4, 4], 16, &usual).unwrap();
    assert!(said.contains("bc7-srgb") && said.contains("blocks"), "{said}");
    let said = of(LayerFormat::Rgba8, [10, 10], 399, &usual).unwrap();
    assert_eq!(said, "399 bytes of pixels: an image of 10x10 texels of rgba8 has 400");
    let narrow = ImageOptions { row_bytes: Some(39), ..usual.clone() };
    let said = of(LayerFormat::Rgba8, [10, 10], 400, &narrow).unwrap();
    assert_eq!(said, "rows 39 bytes apart: one row of 10 texels of rgba8 has 40 bytes");
    assert!(of(LayerFormat::R8, [0, 10], 0, &usual).unwrap().contains("2^31"));
    let far = ImageOptions { row_bytes: Some(usize::MAX), ..usual.clone() };
    assert!(of(LayerFormat::R8, [10, 10], 100, &far).unwrap().contains("bytes of pixels"));
    let large = ImageOptions { page: 5000, ..usual };
    assert!(of(LayerFormat::R8, [10, 10], 100, &large).unwrap().contains("page"));
    // The last row needs no gap behind it.
    let gap = ImageOptions { row_bytes: Some(64), ..ImageOptions::default() };
    assert_eq!(of(LayerFormat::Rgba8, [10, 3], 2 * 64 + 40, &gap), None);
}
