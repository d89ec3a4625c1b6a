//! Traces as bytes: they come back, and damage is refused.

use proptest::prelude::*;

use super::*;
use crate::record::file::{FileError, WORD, crc32};
use crate::texture::geometry::{AddressMode, Geometry, GeometrySpec};
use crate::texture::page::{PageId, PagePos};
use crate::wanted::feedback::WantedPage;

fn sample() -> Trace {
    let mut trace = Trace::new();
    let image =
        Geometry::new(GeometrySpec { address: [AddressMode::Wrap; 3], ..GeometrySpec::image(4096, 2000) });
    let volume = Geometry::with_factors(GeometrySpec::volume([300, 200, 100]), &[[3, 3, 3], [100, 67, 34]]);
    for geometry in [image.unwrap(), volume.unwrap()] {
        trace.add_texture(geometry).unwrap();
    }
    let wanted = |texture: u16, pos: PagePos, pixels, eighth| {
        let geometry = &trace.geometries()[usize::from(texture)];
        let page = PageId::new(TextureNumber::new(texture).unwrap(), geometry.dims(), pos).unwrap();
        WantedPage { page, pixels, eighth }
    };
    let frame = vec![
        wanted(0, PagePos::new_2d(0, 31, 15), 1, 7),
        wanted(0, PagePos::new_2d(1, 3, 2), u32::MAX, 0),
        wanted(1, PagePos::at(0, [2, 1, 0]), 300, 3),
    ];
    trace.add_frame_at(frame, [1.5, -0.25, 3e7]).unwrap();
    trace.add_frame([]).unwrap();
    trace
}

#[test]
fn a_trace_comes_back_as_it_was() {
    let trace = sample();
    assert_eq!(Trace::from_bytes(&trace.to_bytes()), Ok(trace));
    assert_eq!(Trace::from_bytes(&Trace::new().to_bytes()), Ok(Trace::new()));
}

#[test]
fn the_checksum_is_the_usual_one() {
    assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
}

#[test]
fn what_is_cut_off_or_changed_is_refused() {
    let bytes = sample().to_bytes();
    for end in 0..bytes.len() {
        assert!(Trace::from_bytes(&bytes[..end]).is_err(), "cut at {end}");
    }
    for bit in 0..bytes.len() * 8 {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let error = Trace::from_bytes(&damaged).expect_err("a damaged trace").to_string();
        assert!(error.contains("record"), "bit {bit}: {error}");
    }
}

#[test]
fn messages_say_what_it_is() {
    let message = |bytes: &[u8]| Trace::from_bytes(bytes).unwrap_err().to_string();
    assert!(message(b"").starts_with("not a trace"), "{}", message(b""));
    assert!(message(b"VASTEX..").starts_with("not a trace"));
    assert!(message(b"VXTRA").contains("cut off"));
    assert!(message(b"VXTRACE\0\x09\0\0\0\0\0\0\0").contains("version 9"));
    assert!(message(&sample().to_bytes()[..60]).contains("checksum"));
}

/// The bytes with a checksum that fits them.
fn sealed(body: &[u8]) -> Vec<u8> {
    [body, &crc32(body).to_le_bytes()].concat()
}

#[test]
fn a_count_without_anything_to_count_is_refused_without_memory_for_it() {
    let mut body = Vec::from(MAGIC);
    body.extend(VERSION.to_le_bytes());
    put(&mut body, 0);
    put(&mut body, u64::MAX);
    let error = Trace::from_bytes(&sealed(&body)).unwrap_err();
    assert!(matches!(error, TraceError::Damaged(FileError::Truncated { .. })), "{error}");
}

/// Files of [`sample`] as earlier versions of this program wrote them.
const OLD_FILES: [(u32, &[u8]); 2] = [
    (WITHOUT_PLACES, include_bytes!("tests/version_1.vxtrace")),
    (OLD_SHAPES, include_bytes!("tests/version_2.vxtrace")),
];

#[test]
fn traces_of_earlier_versions_are_read() {
    let trace = sample();
    for (version, bytes) in OLD_FILES {
        assert_eq!(bytes[MAGIC.len()..][..WORD], version.to_le_bytes());
        let read = Trace::from_bytes(bytes).unwrap();
        assert_eq!((read.frames(), read.geometries()), (trace.frames(), trace.geometries()));
        let places = if version == WITHOUT_PLACES { &[None, None][..] } else { trace.camera_positions() };
        assert_eq!(read.camera_positions(), places);
        assert_eq!(Trace::from_bytes(&read.to_bytes()), Ok(read), "written anew it is of this version");
        for end in 0..bytes.len() {
            assert!(Trace::from_bytes(&bytes[..end]).is_err(), "version {version} cut at {end}");
        }
    }
}

#[test]
fn a_shape_that_is_none_is_refused_with_the_byte_at_which_it_stands() {
    let mut body = sample().to_bytes();
    body.truncate(body.len() - WORD);
    let shape = MAGIC.len() + WORD + 3; // behind the number of textures and the two bytes of its length
    body[shape] = 7;
    let error = Trace::from_bytes(&sealed(&body)).unwrap_err().to_string();
    assert!(error.contains("texture 0, at byte 15: a texture of 7 dimensions"), "{error}");
}

#[test]
fn a_place_is_made_of_numbers() {
    let mut trace = sample();
    trace.add_frame_at([], [0.0, f32::NAN, 0.0]).unwrap();
    assert_eq!(trace.camera_positions()[2], None);
    let mut body = Trace::new().to_bytes();
    body.truncate(body.len() - WORD - 1);
    body.extend([1, 0, 1]); // a frame without pages, with a place
    [1.0, f32::INFINITY, 0.0].into_iter().for_each(|coordinate| put_float(&mut body, coordinate));
    let error = Trace::from_bytes(&sealed(&body)).unwrap_err().to_string();
    assert!(error.contains("coordinate"), "{error}");
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(start in 0usize..400, junk in prop::collection::vec(any::<u8>(), 0..60)) {
        let whole = sample().to_bytes();
        let mut body = whole[..start.min(whole.len() - WORD)].to_vec();
        body.extend(junk);
        if let Ok(trace) = Trace::from_bytes(&sealed(&body)) {
            prop_assert_eq!(Trace::from_bytes(&trace.to_bytes()), Ok(trace));
        }
    }
}
