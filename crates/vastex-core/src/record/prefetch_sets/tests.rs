//! Prefetch sets: what is learnt, that it comes back from bytes, and that damage is refused.

use proptest::prelude::*;

use super::*;
use crate::record::file::{WORD, crc32, put};
use crate::record::trace::Trace;
use crate::texture::geometry::GeometrySpec;
use crate::texture::page::PagePos;

fn wanted(x: u32, pixels: u32) -> WantedPage {
    let dims = crate::texture::page::Dims::D2;
    let page = PageId::new(TextureNumber::new(0).unwrap(), dims, PagePos::new_2d(0, x, 0)).unwrap();
    WantedPage { page, pixels, eighth: (x % 8) as u8 }
}

/// The camera goes along x from -4 to 4, a quarter a frame, and wants the page below it and the next.
fn walk() -> Trace {
    let mut trace = Trace::new();
    trace.add_texture(Geometry::new(GeometrySpec::image(8192, 1024)).unwrap()).unwrap();
    for frame in 0..32 {
        trace
            .add_frame_at([wanted(frame, 10), wanted(frame + 1, 2)], [frame as f32 / 4.0 - 4.0, 7.0, 0.0])
            .unwrap();
    }
    trace
}

fn learnt(settings: LearnSettings) -> PrefetchSets {
    PrefetchSets::learn(&[walk()], &settings).unwrap()
}

fn pages(feedback: &Feedback) -> Vec<u32> {
    feedback.pages.iter().map(|wanted| wanted.page.pos(crate::texture::page::Dims::D2).x).collect()
}

const NUMBERS: [Option<TextureNumber>; 1] = [TextureNumber::new(9)];

#[test]
fn a_cell_has_what_was_wanted_in_it_and_shortly_after() {
    let sets = learnt(LearnSettings { sides: Some([1.0, 0.0, 0.0]), ahead_frames: 2, max_pages: 100 });
    assert_eq!(sets.cells(), 8);
    let numbers = NUMBERS.map(Option::unwrap);
    // Frames 8 to 11 are in the cell, 12 and 13 after.
    let here = sets.expected([-1.5, 99.0, -5.0], [0.0; 3], &numbers);
    assert_eq!(pages(&here), (8..15).collect::<Vec<_>>());
    assert!(here.pages.iter().all(|wanted| wanted.page.texture() == numbers[0]));
    // Page 9 is below in one of the six frames and beside in another: 12 pixels in 6 frames.
    assert_eq!((here.pages[1].pixels, here.pages[1].eighth), (2, 1));
    // Two frames on, the camera is in the next cell.
    let on_the_move = sets.expected([-1.25, 0.0, 0.0], [0.25, 0.0, 0.0], &numbers);
    assert_eq!(pages(&on_the_move), (8..19).collect::<Vec<_>>());
    assert!(sets.expected([50.0, 0.0, 0.0], [0.0; 3], &numbers).pages.is_empty());
    assert!(sets.expected([f32::NAN; 3], [f32::INFINITY; 3], &numbers).pages.len() < 100);
    assert!(sets.expected([-1.5, 0.0, 0.0], [0.0; 3], &[]).pages.is_empty());
}

#[test]
fn cells_are_as_large_as_the_camera_is_fast_and_lists_end() {
    let sets = learnt(LearnSettings { max_pages: 3, ..LearnSettings::default() });
    assert_eq!(sets.sides(), [2.0, 0.0, 0.0], "8 frames of a quarter; the other axes stand still");
    assert_eq!((sets.cells(), sets.pages()), (4, 12));
}

#[test]
fn what_cannot_be_learnt_from_is_refused() {
    let learn = |traces: &[Trace], sides| {
        PrefetchSets::learn(traces, &LearnSettings { sides, ..LearnSettings::default() }).unwrap_err()
    };
    assert_eq!(learn(&[], None), LearnError::NoPlaces);
    let mut other = Trace::new();
    other.add_frame([]).unwrap();
    assert_eq!(learn(std::slice::from_ref(&other), None), LearnError::NoPlaces);
    assert_eq!(learn(&[walk(), other], None), LearnError::OtherTextures { trace: 2 });
    assert_eq!(learn(&[walk()], Some([1.0, -1.0, 0.0])), LearnError::Side(-1.0));
    assert!(learn(&[walk()], Some([f32::NAN; 3])).to_string().contains("NaN"));
}

#[test]
fn sets_come_back_as_they_were() {
    let sets = learnt(LearnSettings::default());
    assert_eq!(PrefetchSets::from_bytes(&sets.to_bytes()), Ok(sets));
}

#[test]
fn sets_of_the_first_version_are_read() {
    let bytes = include_bytes!("tests/version_1.vxsets");
    assert_eq!(bytes[8..][..WORD], 1u32.to_le_bytes());
    assert_eq!(PrefetchSets::from_bytes(bytes), Ok(learnt(LearnSettings::default())));
}

#[test]
fn what_is_cut_off_or_changed_is_refused() {
    let bytes = learnt(LearnSettings { max_pages: 2, ..LearnSettings::default() }).to_bytes();
    for end in 0..bytes.len() {
        assert!(PrefetchSets::from_bytes(&bytes[..end]).is_err(), "cut at {end}");
    }
    for bit in 0..bytes.len() * 8 {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let error = PrefetchSets::from_bytes(&damaged).expect_err("damaged sets").to_string();
        assert!(error.contains("learn"), "bit {bit}: {error}");
    }
}

/// The bytes with a checksum that fits them.
fn sealed(body: &[u8]) -> Vec<u8> {
    [body, &crc32(body).to_le_bytes()].concat()
}

#[test]
fn cells_ascend_and_their_pages_exist() {
    let sets = learnt(LearnSettings { sides: Some([100.0, 0.0, 0.0]), ..LearnSettings::default() });
    assert_eq!(sets.cells(), 2);
    let whole = sets.to_bytes();
    let error = |change: &dyn Fn(&mut PrefetchSets)| {
        let mut sets = sets.clone();
        change(&mut sets);
        PrefetchSets::from_bytes(&sets.to_bytes()).unwrap_err().to_string()
    };
    assert!(error(&|sets| sets.geometries.clear()).contains("none of the textures"));
    assert!(error(&|sets| sets.sides[1] = -1.0).contains("below 0"));
    assert!(error(&|sets| sets.sides[2] = f32::NAN).contains("side of a cell"));
    let mut body = whole[..whole.len() - WORD].to_vec();
    body.push(0);
    assert!(PrefetchSets::from_bytes(&sealed(&body)).is_err(), "a byte too many");
    let mut endless = codec_head();
    put(&mut endless, u64::MAX);
    assert!(PrefetchSets::from_bytes(&sealed(&endless)).unwrap_err().to_string().contains("cut off"));
}

/// The bytes of sets of no textures up to the number of cells.
fn codec_head() -> Vec<u8> {
    let none =
        PrefetchSets { geometries: Vec::new(), sides: [0.0; 3], ahead_frames: 0, cells: BTreeMap::new() };
    let bytes = none.to_bytes();
    bytes[..bytes.len() - WORD - 1].to_vec()
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(start in 0usize..400, junk in prop::collection::vec(any::<u8>(), 0..60)) {
        let whole = learnt(LearnSettings { max_pages: 2, ..LearnSettings::default() }).to_bytes();
        let mut body = whole[..start.min(whole.len() - WORD)].to_vec();
        body.extend(junk);
        if let Ok(sets) = PrefetchSets::from_bytes(&sealed(&body)) {
            prop_assert_eq!(PrefetchSets::from_bytes(&sets.to_bytes()), Ok(sets));
        }
    }

    #[test]
    fn cells_of_either_sign_come_back(x in any::<i32>(), y in any::<i32>(), z in any::<i32>()) {
        let mut sets = learnt(LearnSettings::default());
        sets.cells = BTreeMap::from([([x, y, z], vec![wanted(3, 5)])]);
        prop_assert_eq!(PrefetchSets::from_bytes(&sets.to_bytes()), Ok(sets));
    }
}
