//! A preview whose rows are still coming, or came to an end too soon: nothing is drawn where there are none,
//! and values are those of the rows that are there.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use glam::DVec2;
use vastex::LayerFormat;
use vastex_viewer::{DisplayOptions, LayerOptions, Pose, Scene, ViewText};

use crate::surface_scene::Window;

/// Columns of the image of a window, and rows of it, half of which are there.
const COLUMNS: u32 = 640;
const ROWS: u32 = 480;
/// Pixels of the picture with rows that are there, and with rows that are not.
const THERE: [u32; 2] = [64, 10];
const MISSING: [u32; 2] = [64, 60];

/// Texels whose lower half is zero, as of rows that nobody has read.
fn half(texel: impl Fn(u32) -> Vec<u8>) -> Vec<u8> {
    let upper: Vec<u8> = (0..COLUMNS * ROWS / 2).flat_map(texel).collect();
    let lower = vec![0; upper.len()];
    [upper, lower].concat()
}

/// A window with a preview of which half of the rows are there and no more come.
fn window(options: DisplayOptions, format: LayerFormat, texels: Vec<u8>) -> Window {
    let mut window = Window::showing(options);
    let rows = Arc::new(AtomicU64::new(u64::from(ROWS / 2)));
    let preview = window.source_of((format, texels), Some(rows));
    window.scene.show_preview(1, "a.png", preview).unwrap();
    window.scene.end_opening().unwrap();
    window.settle();
    window
}

#[test]
fn rows_that_are_not_there_look_alike_whatever_the_format() {
    let over = LayerOptions { opacity: 0.5, ..LayerOptions::default() };
    for layers in [Vec::new(), vec![LayerOptions::default(), over]] {
        let with = |always_fixed| DisplayOptions {
            layers: layers.clone(),
            always_fixed,
            ..DisplayOptions::default()
        };
        let clear = half(|_| vec![10, 20, 30, 255]);
        let mut colour = window(with(false), LayerFormat::Rgba8, clear);
        let ground = colour.pixel_of_frame(MISSING);
        for format in [LayerFormat::R8, LayerFormat::R16] {
            for always_fixed in [false, true] {
                let words = half(|_| vec![200; format.texel_bytes()]);
                let mut grey = window(with(always_fixed), format, words);
                assert_eq!(grey.pixel_of_frame(THERE), Some([200, 200, 200, 255]), "{format:?}");
                assert_eq!(grey.pixel_of_frame(MISSING), ground, "{format:?} {always_fixed} {layers:?}");
            }
        }
    }
}

#[test]
fn values_are_those_of_the_rows_that_are_there() {
    let words = half(|n| (30_000 + 10_000 * (n / 8 % 2) as u16).to_le_bytes().to_vec());
    let mut window = window(DisplayOptions::default(), LayerFormat::R16, words);
    let pose = Pose::first(Scene::Image);
    let text = window.scene.view_text(pose).unwrap();
    let place = text.split(';').next().unwrap();
    let whole = ViewText::from_text(&format!("{place};layer=:range=0..1"), [COLUMNS, ROWS]).unwrap();
    assert!(window.scene.show_view(&whole));
    window.settle();
    window.scene.set_automatic_range(pose);
    let range = window.scene.settings().options.layers[0].range.unwrap();
    let words = range.map(|value| (value * 65535.0).round());
    assert_eq!(words, [30_000.0, 40_000.0]);
    let mut title = |[x, y]: [u32; 2]| {
        window.settle();
        window.scene.set_pointer(Some(DVec2::new(f64::from(x), f64::from(y))), pose).map(str::to_owned)
    };
    let there = title(THERE).unwrap();
    assert!(there.contains("320,50: 30000"), "{there}");
    let missing = title(MISSING).unwrap();
    assert!(!missing.contains("320,300"), "{missing}");
}
