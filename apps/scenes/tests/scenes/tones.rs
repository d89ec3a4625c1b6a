//! Exposure and curves of layers of every kind of value: the picture is what the CPU makes of the same
//! values, alone and in a list.

use std::sync::Arc;

use glam::DVec2;
use vastex::{Filter, ImageOptions, ImageSource, LayerFormat};
use vastex_scenes::{DisplayOptions, LayerOptions, Offscreen, Picture, Pose, Scene};
use vastex_viewer::layers::Curve;

use crate::common::{gpu, settings, settle};

const SIZE: [u32; 2] = [64, 16];
const POSE: Pose = Pose::image(DVec2::new(0.5, 0.5), 1.0);

/// Light from a sixty-fourth of white to sixty-four times as much, to the right; rows have other colours.
fn light(x: u32, y: u32, channel: u32) -> f32 {
    (x as f32 * 12.0 / SIZE[0] as f32 - 6.0).exp2() * (1.0 - (channel * y) as f32 / 40.0)
}

/// An image of such light, as far as numbers of a format go.
fn image(format: LayerFormat) -> Arc<ImageSource> {
    let mut bytes = Vec::new();
    for (y, x) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (y, x))) {
        for channel in 0..format.channels() as u32 {
            let value = if channel == 3 { 1.0 } else { light(x, y, channel) };
            // Of whole numbers half of the row is black and white.
            let part = value.min(1.0);
            match format {
                LayerFormat::R32Float => bytes.extend(value.to_le_bytes()),
                LayerFormat::Rgba16Float => bytes.extend(half::f16::from_f32(value).to_le_bytes()),
                LayerFormat::R16 => bytes.extend(((part * 65535.0) as u16).to_le_bytes()),
                _ => bytes.push((part * 255.0) as u8),
            }
        }
    }
    Arc::new(ImageSource::new(format, SIZE, bytes, &ImageOptions::default()).unwrap())
}

fn drawn(format: LayerFormat, layers: Vec<LayerOptions>) -> Offscreen {
    let options = DisplayOptions { layers, ..DisplayOptions::default() };
    let settings = settings(4, Filter::Nearest);
    let mut offscreen =
        Offscreen::showing(&options, gpu(), image(format), Scene::Image, SIZE, settings).unwrap();
    settle(&mut offscreen, POSE);
    offscreen
}

/// The largest difference of two pictures, and in which pixel.
fn apart(a: &Picture, b: &Picture) -> (u8, usize) {
    let bytes = a.rgba.iter().zip(&b.rgba).enumerate().filter(|(n, _)| n % 4 != 3);
    let apart = bytes.map(|(n, (a, b))| (a.abs_diff(*b), n / 4));
    apart.max().unwrap_or_default()
}

#[test]
fn exposure_and_curves_are_drawn_as_the_cpu_has_them() {
    use LayerFormat::{R16, R32Float, Rgba8Srgb, Rgba16Float};
    let curves = |curves: &[Curve]| curves.to_vec();
    let of_light = curves(&[Curve::Light, Curve::Reinhard, Curve::Aces]);
    for (format, curves) in [
        (R32Float, Curve::ALL.to_vec()),
        (Rgba16Float, of_light.clone()),
        (Rgba8Srgb, curves(&[Curve::Linear, Curve::Aces])),
        (R16, curves(&[Curve::Reinhard])),
    ] {
        for curve in curves {
            let exposure = if curve == Curve::Log { 0.0 } else { 1.5 };
            let gamma = if curve == Curve::Reinhard { 1.3 } else { 1.0 };
            let layer = LayerOptions { exposure, curve, gamma, ..LayerOptions::default() };
            let alone = drawn(format, vec![layer.clone()]);
            let picture = alone.picture();
            let (most, pixel) = apart(&picture, &alone.cpu_picture().unwrap());
            assert!(most <= 1, "{format:?} {curve:?}: pixel {pixel} differs by {most}");
            // The lower layer has neither, and is not seen.
            let below = LayerOptions { is_visible: false, ..LayerOptions::default() };
            let listed = drawn(format, vec![below, layer]).picture();
            let (most, pixel) = apart(&picture, &listed);
            assert!(most <= 2, "{format:?} {curve:?}: pixel {pixel} in a list differs by {most}");
        }
    }
}

/// What is far brighter than white is white without a curve, and told apart with one.
#[test]
fn light_beyond_white_is_told_apart_by_curves_that_roll_off() {
    let shades = |curve| {
        let layer = LayerOptions { curve, exposure: -2.0, ..LayerOptions::default() };
        let rgba = drawn(LayerFormat::R32Float, vec![layer]).picture().rgba;
        let mut row: Vec<u8> = rgba.chunks(4).take(SIZE[0] as usize).map(|pixel| pixel[0]).collect();
        assert!(row.is_sorted(), "{curve:?}: {row:?}");
        // From white on, which is a quarter as light now, to eight times as much.
        row.drain(..43);
        row.truncate(16);
        row.dedup();
        row.len()
    };
    assert_eq!(shades(Curve::Light), 1);
    let [reinhard, aces] = [Curve::Reinhard, Curve::Aces].map(shades);
    assert!(reinhard > 12 && aces > 6, "{reinhard} {aces}");
}
