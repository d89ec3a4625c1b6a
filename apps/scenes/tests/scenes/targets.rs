//! Pictures drawn straight into 8 bits and by way of linear light are the same, and show display values as
//! they are.

use std::sync::Arc;

use vastex::{Filter, TileSource};
use vastex_scenes::{Comparison, DisplayOptions, LayerOptions, Offscreen, Overlay, Path, Scene, Until};
use vastex_viewer::stage::TargetKind;

use crate::common::{Image, gpu, is_processor, settings};

const SIZE: [u32; 2] = [160, 90];

/// A view of a scene that has converged, drawn into this kind of target.
fn drawn(
    source: Arc<dyn TileSource>,
    scene: Scene,
    target: TargetKind,
    range: Option<[f32; 2]>,
) -> Offscreen {
    let layers = vec![LayerOptions { range, ..LayerOptions::default() }];
    let shown = DisplayOptions { target: Some(target), layers, ..DisplayOptions::default() };
    let settings = settings(16, Filter::Trilinear);
    let mut offscreen = Offscreen::showing(&shown, gpu(), source, scene, SIZE, settings).unwrap();
    assert!(offscreen.run(Path::Still, Until::Converged, |_, _| ()).unwrap().converged);
    offscreen
}

/// Asserts that two pictures of the same view are alike: by a software driver no pixel differs by more than a
/// step of 1/255. By a GPU some do, by a step of a filter's weights (docs/draw-checks.md, "What a GPU may
/// differ by"), which a range magnifies `gain` times: 1 pixel in 100 may differ by more than a step, and 1 in
/// 1,000 by more than three, each times `gain`; and their mean square differs by no more than 0.65 (50 dB),
/// 0.8 of a step.
fn assert_same(compared: &Comparison, gain: f32, what: &str) {
    let gain = f64::from(gain);
    let is_same = match is_processor() {
        true => compared.max_error <= 1,
        false => {
            compared.share_within_1_255 >= 1.0 - 0.01 * gain
                && compared.share_beyond_3_255 <= 0.001 * gain
                && compared.psnr_db > 50.0
        }
    };
    assert!(is_same, "{what}: {compared:?}");
}

#[test]
fn light_and_display_values_give_the_same_picture() {
    for (channels, sixteen_bit, range) in [
        (png::ColorType::Rgb, false, None),
        (png::ColorType::Rgba, false, Some([0.1, 0.6])),
        (png::ColorType::Grayscale, false, None),
        (png::ColorType::Grayscale, true, Some([0.2, 0.5])),
        (png::ColorType::GrayscaleAlpha, false, None),
        (png::ColorType::Rgb, true, None),
    ] {
        let gain = range.map_or(1.0, |[black, white]| 1.0 / (white - black));
        let image = Image { channels, sixteen_bit, ..Image::new(300, 200, 64) };
        let (_directory, path) = image.build();
        // What is drawn into a target depends on the texels; a globe differs from an image by its edge.
        let scenes =
            if channels == png::ColorType::Rgb { &[Scene::Image, Scene::Globe][..] } else { &[Scene::Image] };
        for &scene in scenes {
            let what = format!("{channels:?} of 16 bits {sixteen_bit} on {}", scene.name());
            let picture = |target| {
                let mut offscreen = drawn(vastex::open(&path).unwrap(), scene, target, range);
                let picture = offscreen.picture();
                let (compared, _) = offscreen.compare().unwrap();
                assert_same(&compared, gain, &format!("{what}, {target:?}, from the reference"));
                let by_cpu = Comparison::of(&picture, &offscreen.cpu_picture().unwrap());
                assert!(by_cpu.share_beyond_3_255 < 0.01, "{what}, {target:?}: {by_cpu:?} from the CPU's");
                let levels = offscreen.overlay(Overlay::Levels).unwrap();
                assert!(offscreen.explain([80, 45]).unwrap().len() == 1);
                (picture, levels)
            };
            let ((direct, _), (linear, _)) = (picture(TargetKind::Direct), picture(TargetKind::Linear));
            assert_same(&Comparison::of(&direct, &linear), gain, &what);
            let shades = direct.rgba.chunks_exact(4).filter(|pixel| pixel[3] == 255 && pixel[0] > 40).count();
            assert!(shades > 1000, "{what}: {shades} pixels with anything on them");
        }
    }
}

/// A ramp of every value of a byte, each some pixels wide and seen at whole pixels, comes out as it went in.
#[test]
fn a_single_channel_is_shown_as_it_is() {
    let directory = tempfile::tempdir().unwrap();
    let (input, output) = (directory.path().join("ramp.png"), directory.path().join("ramp.vastex"));
    let mut encoder = png::Encoder::new(std::fs::File::create(&input).unwrap(), 256, 4);
    encoder.set_color(png::ColorType::Grayscale);
    let ramp: Vec<u8> = (0..4).flat_map(|_| 0..=255).collect();
    encoder.write_header().unwrap().write_image_data(&ramp).unwrap();
    let options = vastex_build::BuildOptions {
        compression: vastex_build::Compression::None,
        threads: 1,
        ..Default::default()
    };
    vastex_build::build(&[input], &output, &options, &()).unwrap();
    for target in [TargetKind::Direct, TargetKind::Linear] {
        let shown = DisplayOptions { target: Some(target), ..DisplayOptions::default() };
        let (source, settings) = (vastex::open(&output).unwrap(), settings(16, Filter::Nearest));
        let mut offscreen =
            Offscreen::showing(&shown, gpu(), source, Scene::Image, [256, 4], settings).unwrap();
        assert!(offscreen.run(Path::Still, Until::Converged, |_, _| ()).unwrap().converged);
        let picture = offscreen.picture();
        for (x, pixel) in picture.rgba.chunks_exact(4).take(256).enumerate() {
            assert!(
                pixel[0].abs_diff(x as u8) <= u8::from(target == TargetKind::Linear),
                "{target:?}: {x} as {pixel:?}"
            );
        }
    }
}
