//! Descriptions as bytes: what is written is read again, and what is damaged or lies is refused.

use super::*;
use proptest::prelude::*;
use vastex_core::{Dims, Geometry, GeometrySpec, NodataValue};

fn description() -> Description {
    Description::one_layer(Geometry::new(GeometrySpec::image(1000, 777)).unwrap(), LayerFormat::R16)
}

fn contents(filters: &[&str]) -> Contents {
    let filters = filters.iter().map(ToString::to_string).collect();
    Contents { description: description(), filters, align: 1, volume: None, about: String::new() }
}

fn bytes(filters: &[&str]) -> Vec<u8> {
    let Contents { description, filters, align, volume, about } = contents(filters);
    encode(&description, &filters, align, volume.as_ref(), &about)
}

#[test]
fn a_description_reads_as_it_was_written() {
    assert_eq!(decode(&bytes(&[])), Ok(contents(&[])));
    assert_eq!(decode(&bytes(&["box"])), Ok(contents(&["box"])));
    assert!(matches!(decode(&bytes(&["box", "box"])), Err(DescriptionFault::Damaged(_))));
}

#[test]
fn what_is_unusual_is_read_as_it_was_written() {
    let spec = GeometrySpec { tail_align: 8, ..GeometrySpec::image(1000, 777) };
    let layers = vec![
        Layer::new("color", LayerFormat::Bc7Srgb),
        Layer { scale: 2, ..Layer::new("height", LayerFormat::R16) },
    ];
    let description =
        Description { border_color: [1, 2, 3, 4], ..Description::new(Geometry::new(spec).unwrap(), layers) };
    assert_eq!(decode(&encode(&description, &[], 1, None, "")).map(|c| c.description), Ok(description));
    let spec = GeometrySpec { positions: TexelPositions::Kept, ..GeometrySpec::image(1000, 777) };
    let description = Description::one_layer(Geometry::new(spec).unwrap(), LayerFormat::R8);
    assert_eq!(decode(&encode(&description, &[], 1, None, "")).map(|c| c.description), Ok(description));
}

#[test]
fn unknown_sections_are_passed_over_only_if_they_say_so() {
    let mut bytes = bytes(&["box"]);
    bytes.extend([9, 0, 0, 0x80, 2, 0, 0, 0, 1, 2]);
    assert_eq!(decode(&bytes), Ok(contents(&["box"])));
    // The same section without the bit stands before the filters, since sections ascend.
    let mut bytes = encode(&description(), &[], 1, None, "");
    bytes.extend([9, 0, 0, 0, 2, 0, 0, 0, 1, 2]);
    let fault = decode(&bytes).unwrap_err();
    assert_eq!(fault, DescriptionFault::Unsupported("section 9 of the description is not known".into()));
}

#[test]
fn what_is_known_of_texels_is_kept_as_it_is_said() {
    let about = "texel 0.5 0.5 µm\nmagnification 20";
    let bytes = encode(&description(), &[], 1, None, about);
    assert_eq!(decode(&bytes), Ok(Contents { about: about.into(), ..contents(&[]) }));
    // A reader that does not know the section passes over it.
    let number = ABOUT.to_le_bytes();
    let at = bytes.windows(4).position(|bytes| bytes == number).unwrap();
    assert!(number[3] == 0x80 && at + 8 + about.len() == bytes.len());
    let mut damaged = bytes.clone();
    damaged[at + 8] = 0xff;
    assert!(matches!(decode(&damaged), Err(DescriptionFault::Damaged(_))));
    let long = "x".repeat(MAX_ABOUT_BYTES + 1);
    assert!(matches!(
        decode(&encode(&description(), &[], 1, None, &long)),
        Err(DescriptionFault::Damaged(_))
    ));
}

#[test]
fn a_value_that_stands_for_no_data_is_known_by_the_filter_or_by_a_section() {
    let geometry = Geometry::new(GeometrySpec::image(1000, 777)).unwrap();
    let layers = |values: [Option<f32>; 2]| {
        let layer = |(n, value): (usize, Option<f32>)| {
            let layer = Layer::new(format!("{n}"), LayerFormat::R32Float);
            Layer { nodata: value.map(NodataValue::new), ..layer }
        };
        Description::new(geometry.clone(), values.into_iter().enumerate().map(layer).collect())
    };
    let read = |bytes: &[u8]| decode(bytes).map(|c| c.description);
    let named = filter_without("box", Some(NodataValue::new(-9999.0)));
    assert_eq!(named, "box/nodata=-9999");
    assert_eq!(nodata_of_filter(&named), ("box", Some(NodataValue::new(-9999.0))));
    assert_eq!(nodata_of_filter("box/nodata=x"), ("box/nodata=x", None));
    let filters = [named, "nearest/nodata=nan".to_owned()];
    let expected = layers([Some(-9999.0), Some(f32::NAN)]);
    let expected = Description {
        layers: expected
            .layers
            .into_iter()
            .enumerate()
            .map(|(n, l)| Layer { is_mixable: n == 0, ..l })
            .collect(),
        ..expected
    };
    assert_eq!(read(&encode(&expected, &filters, 1, None, "")), Ok(expected.clone()));
    // What the filters say takes no byte more.
    assert!(!encode(&expected, &filters, 1, None, "").windows(4).any(|bytes| *bytes == NODATA.to_le_bytes()));
    for values in [[None, None], [Some(0.0), None], [None, Some(f32::INFINITY)]] {
        for filters in [&filters[..], &[]] {
            let layers = layers(values);
            assert_eq!(read(&encode(&layers, filters, 1, None, "")), Ok(layers), "{filters:?}");
        }
    }
    let mut bytes = encode(&layers([None, Some(1.0)]), &[], 1, None, "");
    let flag = bytes.len() - 5;
    bytes[flag] = 2;
    assert!(matches!(decode(&bytes), Err(DescriptionFault::Damaged(_))));
    bytes[flag] = 0;
    assert!(matches!(decode(&bytes), Err(DescriptionFault::Damaged(_))));
}

#[test]
fn a_layer_that_may_not_be_mixed_is_known_by_its_filter_or_by_a_section() {
    let geometry = Geometry::new(GeometrySpec::image(1000, 777)).unwrap();
    let layers = |mixable: [bool; 3]| {
        let layer = |(n, is_mixable)| Layer { is_mixable, ..Layer::new(format!("{n}"), LayerFormat::R8) };
        Description::new(geometry.clone(), (0..3).zip(mixable).map(layer).collect())
    };
    let read = |bytes: &[u8]| decode(bytes).map(|c| c.description);
    let filters = ["majority", "box", "nearest"].map(String::from);
    // What the filters say takes no byte, and files from before say it.
    let by_filters = encode(&layers([false, true, false]), &filters, 1, None, "");
    let before = encode(&layers([true; 3]), &[], 1, None, "");
    assert_eq!(by_filters.len() - before.len(), 8 + 3 * 4 + "majorityboxnearest".len());
    assert_eq!(read(&by_filters), Ok(layers([false, true, false])));
    // Whatever else is said is read as it was written.
    for mixable in [[true; 3], [false; 3], [true, false, true]] {
        for filters in [&filters[..], &[]] {
            assert_eq!(
                read(&encode(&layers(mixable), filters, 4096, None, "")),
                Ok(layers(mixable)),
                "{filters:?}"
            );
        }
    }
    let mut bytes = encode(&layers([false; 3]), &[], 1, None, "");
    *bytes.last_mut().unwrap() = 2;
    assert!(matches!(decode(&bytes), Err(DescriptionFault::Damaged(_))));
    let mut short = encode(&layers([true; 3]), &[], 1, None, "");
    short.extend([5, 0, 0, 0x80, 2, 0, 0, 0, 1, 1]);
    assert!(matches!(decode(&short), Err(DescriptionFault::Damaged(_))));
}

#[test]
fn only_alignments_that_disks_ask_for_are_stated() {
    for align in [4096, 1 << 16] {
        let bytes = encode(&description(), &[], align, None, "");
        assert_eq!(decode(&bytes), Ok(Contents { align, ..contents(&[]) }));
    }
    for align in [0, 2, 2048, 5000, 1 << 17, u32::MAX] {
        assert!(check_align(align).is_err());
        assert!(matches!(
            decode(&encode(&description(), &[], align, None, "")),
            Err(DescriptionFault::Damaged(_))
        ));
    }
}

#[test]
fn every_truncation_is_refused() {
    let (bytes, required) = (bytes(&["box"]), encode(&description(), &[], 1, None, "").len());
    for len in (0..bytes.len()).filter(|&len| len != required) {
        assert!(decode(&bytes[..len]).is_err(), "{len}");
    }
}

#[test]
fn textures_too_large_for_a_container_are_refused_with_the_remedy() {
    let refused =
        |spec| check(&Description::one_layer(Geometry::new(spec).unwrap(), LayerFormat::Rgba8)).unwrap_err();
    let volume = GeometrySpec { dims: Dims::D3, size: [9000; 3], page: 4096, ..GeometrySpec::image(1, 1) };
    assert!(refused(volume).ends_with("use smaller pages"));
    assert!(refused(GeometrySpec::image(1 << 31, 1 << 31)).ends_with("use larger pages"));
}

proptest! {
    #[test]
    fn altered_bytes_never_panic(at: prop::sample::Index, value: u8, tail in prop::collection::vec(any::<u8>(), 0..20)) {
        let mut bytes = bytes(&["box"]);
        let at = at.index(bytes.len());
        bytes[at] = value;
        bytes.extend(tail);
        let _ = decode(&bytes);
    }
}
