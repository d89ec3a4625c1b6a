//! The display panel under the hands of a person.

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use vastex::{Layer, LayerFormat};

use super::*;
use crate::layers::Palette;
use crate::panels::{keys_window, swipe_line};

/// What a test has of a texture.
struct Texture {
    panel: DisplayPanel,
    textures: Vec<PanelTexture>,
    compare_mode: CompareMode,
    /// Where there are images of unlike size.
    placement: Option<Placement>,
    shown: Vec<LayerOptions>,
    histogram: Option<Histogram>,
    changes: u32,
}

fn harness(layers: &[(&str, LayerFormat)], values: Option<Vec<f32>>) -> Harness<'static, Texture> {
    let texture = Texture {
        panel: DisplayPanel::default(),
        textures: vec![PanelTexture {
            name: "a.png".to_owned(),
            layers: layers.iter().map(|(name, format)| Layer::new(*name, *format)).collect(),
        }],
        compare_mode: CompareMode::Off,
        placement: None,
        shown: Vec::new(),
        histogram: values.map(|values| Histogram::of_values(vec![values])),
        changes: 0,
    };
    let show = |ui: &mut Ui, texture: &mut Texture| {
        let Texture { panel, textures, compare_mode, placement, shown, histogram, changes } = texture;
        let (histogram, placement) = (histogram.as_ref(), placement.as_mut());
        let mut told = ShownTextures { textures, shown, compare_mode, placement, histogram };
        let is_changed = panel.show(ui, &mut told);
        *changes += u32::from(is_changed);
    };
    Harness::builder().with_size([320.0, 480.0]).build_ui_state(show, texture)
}

fn click(harness: &mut Harness<'_, Texture>, label: &str) {
    harness.get_by_label(label).click();
    harness.run();
}

#[test]
fn nothing_changes_of_itself() {
    let mut harness = harness(&[("color", LayerFormat::R16)], Some(vec![0.25, 0.5]));
    harness.run();
    let Texture { shown, changes, .. } = harness.state();
    assert!(shown.is_empty() && *changes == 0, "{shown:?}");
    assert!(harness.query_by_label("Add a layer").is_none(), "there is one layer");
}

#[test]
fn black_and_white_go_by_what_is_in_view() {
    // A thousandth of the values is far from the others.
    let mut values: Vec<f32> = (0..=999).map(|n| (1000 + n) as f32 / 65535.0).collect();
    values.push(1.0);
    let mut harness = harness(&[("color", LayerFormat::R16)], Some(values));
    click(&mut harness, "Range from view");
    let [low, high] = harness.state().shown[0].range.unwrap().map(|value| (value * 65535.0).round());
    assert_eq!([low, high], [1005.0, 1995.0]);
    assert_eq!(harness.state().changes, 1);
    click(&mut harness, "Reset display");
    assert_eq!(harness.state().shown, [LayerOptions::default()]);
}

#[test]
fn values_that_are_all_alike_have_a_range_as_well() {
    for format in [LayerFormat::R8, LayerFormat::R32Float, LayerFormat::Rgba8Srgb] {
        let mut harness = harness(&[("color", format)], Some(vec![0.5; 10]));
        click(&mut harness, "Range from view");
        let [low, high] = harness.state().shown[0].range.unwrap();
        assert!(high > low, "{format:?}: {low} {high}");
    }
}

#[test]
fn a_handle_that_is_held_stays_where_it_is() {
    let values = (0..100).map(|n| n as f32 * 20.0 / 65535.0).collect();
    let mut harness = harness(&[("color", LayerFormat::R16)], Some(values));
    harness.run();
    let graph = harness.get_by_label("Range of values").rect();
    // White is at the right end, far from all values.
    let place = |share: f32| egui::pos2(graph.left() + share * graph.width(), graph.center().y - 10.0);
    harness.drag_at(place(0.96));
    harness.run();
    harness.hover_at(place(0.5));
    harness.run();
    let white = |harness: &Harness<'_, Texture>| harness.state().shown[0].range.unwrap()[1];
    let held = white(&harness);
    assert!((held - 0.5).abs() < 0.05, "{held}");
    (0..5).for_each(|_| harness.step());
    assert_eq!(white(&harness), held);
    harness.drop_at(place(0.5));
    harness.run();
    assert_eq!(white(&harness), held);
}

#[test]
fn curves_and_colour_maps_are_chosen() {
    let mut harness = harness(&[("color", LayerFormat::R32Float)], None);
    for curve in [Curve::Aces, Curve::Log] {
        harness.get_by_label("Curve").click();
        harness.run();
        click(&mut harness, curve.name());
        assert_eq!(harness.state().shown[0].curve, curve);
    }
    assert!(harness.query_all_by_label("Exposure").next().is_some());
    harness.get_by_label("Colour map").click();
    harness.run();
    click(&mut harness, "inferno");
    assert_eq!(harness.state().shown[0].palette, Palette::INFERNO);
    click(&mut harness, "Reversed");
    assert_eq!(harness.state().shown[0].palette, Palette::INFERNO.reversed());
    // Colours have none of another's.
    let harness = self::harness(&[("color", LayerFormat::Rgba8Srgb)], None);
    assert!(harness.query_by_label("Colour map").is_none());
}

#[test]
fn layers_are_added_raised_and_removed() {
    let mut harness = harness(&[("color", LayerFormat::Rgba8Srgb), ("height", LayerFormat::R16)], None);
    click(&mut harness, "Add a layer");
    assert_eq!((harness.state().shown.len(), harness.state().panel.layer()), (2, 1));
    assert_eq!(harness.state().shown[1].opacity, 0.5);
    click(&mut harness, "Move 1 up");
    assert_eq!(harness.state().shown[0].opacity, 0.5);
    harness.get_by_label("Remove 1").click();
    harness.run();
    assert_eq!(harness.state().shown.len(), 1);
}

#[test]
fn files_over_one_another_are_compared() {
    let mut harness = harness(&[("color", LayerFormat::Rgba8Srgb)], None);
    assert!(harness.query_by_label("Compare").is_none(), "one layer has nothing to be compared with");
    let of = |name: &str| vec![Layer::new(name, LayerFormat::R16)];
    harness.state_mut().textures.push(PanelTexture { name: "b.png".to_owned(), layers: of("color") });
    harness.run();
    let Texture { shown, changes, .. } = harness.state();
    assert!(shown.is_empty() && *changes == 0, "the first layer of each, as nobody has chosen others");
    // The lowest is selected; the other one is known by its file.
    click(&mut harness, "b.png");
    assert_eq!(harness.state().panel.layer(), 1);
    click(&mut harness, "swipe");
    assert_eq!(harness.state().compare_mode, CompareMode::Swipe(0.5));
    click(&mut harness, "difference");
    assert_eq!(harness.state().compare_mode, CompareMode::Difference(4.0));
    assert_eq!(harness.state().changes, 2);
    // Where they lie is asked if their sizes differ.
    assert!(harness.query_by_label("by-texel").is_none());
    harness.state_mut().placement = Some(Placement::Stretched);
    harness.run();
    click(&mut harness, "by-texel");
    assert_eq!((harness.state().placement, harness.state().changes), (Some(Placement::ByTexel), 3));
    harness.state_mut().placement = None;
    click(&mut harness, "Remove 2");
    let Texture { shown, .. } = harness.state();
    assert_eq!(*shown, [LayerOptions::default()]);
}

#[test]
fn the_line_between_compared_layers_is_dragged() {
    let show = |ui: &mut Ui, mode: &mut CompareMode| {
        let free = ui.available_rect_before_wrap();
        swipe_line(ui.ctx(), free, 800, mode);
    };
    let mut harness =
        Harness::builder().with_size([800.0, 200.0]).build_ui_state(show, CompareMode::Swipe(0.5));
    harness.run();
    harness.drag_at(egui::pos2(401.0, 50.0));
    harness.run();
    harness.hover_at(egui::pos2(200.0, 60.0));
    harness.run();
    harness.drop_at(egui::pos2(200.0, 60.0));
    harness.run();
    assert_eq!(*harness.state(), CompareMode::Swipe(0.25));
    // Beside it nothing is taken hold of.
    harness.drag_at(egui::pos2(600.0, 50.0));
    harness.run();
    harness.drop_at(egui::pos2(700.0, 50.0));
    harness.run();
    assert_eq!(*harness.state(), CompareMode::Swipe(0.25));
}

#[test]
fn the_list_of_keys_closes_itself() {
    let mut harness = Harness::new_ui_state(|ui, is_open| keys_window(ui.ctx(), is_open), true);
    harness.run();
    assert!(harness.query_by_label("full screen").is_some());
    harness.get_by_label("Close window").click();
    harness.run();
    assert!(!harness.state());
}

#[test]
fn a_gamma_beyond_the_slider_stays() {
    let mut harness = harness(&[("color", LayerFormat::R16)], None);
    let beyond = LayerOptions { gamma: 40.0, exposure: -20.0, ..LayerOptions::default() };
    harness.state_mut().shown = vec![beyond.clone()];
    harness.run();
    assert_eq!((&harness.state().shown[..], harness.state().changes), (&[beyond][..], 0));
}

#[test]
fn only_what_has_one_value_takes_a_colour_map() {
    // Grey with alpha, as an image without layers has it, and two values.
    for (name, takes) in [("color", true), ("normal", false)] {
        let harness = harness(&[(name, LayerFormat::Rg8)], None);
        assert_eq!(harness.query_by_label("Colour map").is_some(), takes, "{name}");
    }
}

#[test]
fn bands_and_no_data_are_chosen() {
    let mut harness = harness(&[("color", LayerFormat::Rgba8Srgb)], None);
    harness.run();
    assert!(harness.state().shown.is_empty());
    harness.get_by_label("Bands").click();
    harness.run();
    click(&mut harness, "3,2,1");
    assert_eq!(harness.state().shown[0].bands, Bands::Color([2, 1, 0]));
    click(&mut harness, "No data");
    assert_eq!(harness.state().shown[0].nodata, Nodata::Value(0.0));
    click(&mut harness, "Colour of no data");
    assert_eq!(harness.state().shown[0].nodata_color, Some([255, 0, 255]));
    click(&mut harness, "Colour of no data");
    assert_eq!(harness.state().shown[0].nodata_color, None, "it is not drawn");
    click(&mut harness, "Colour of no data");
    // Only floats may be no number.
    assert!(harness.query_by_label("is what is no number").is_none());
    click(&mut harness, "No data");
    assert_eq!(harness.state().shown[0].nodata, Nodata::OfLayer, "which has none");
    assert!(harness.query_by_label("Colour of no data").is_none(), "of nothing");
    click(&mut harness, "Reset display");
    assert_eq!(harness.state().shown, [LayerOptions::default()]);
}

#[test]
fn what_is_no_number_is_no_data_of_floats() {
    let mut harness = harness(&[("color", LayerFormat::R32Float)], None);
    click(&mut harness, "No data");
    click(&mut harness, "is what is no number");
    assert_eq!(harness.state().shown[0].nodata, Nodata::NotANumber);
    assert!(harness.query_by_label("Bands").is_none(), "it has one");
    let changes = harness.state().changes;
    harness.run();
    assert_eq!(harness.state().changes, changes, "nothing goes on changing");
}

#[test]
fn the_layers_own_value_is_no_data_until_it_is_switched_off() {
    let mut harness = harness(&[("color", LayerFormat::R32Float)], None);
    harness.state_mut().textures[0].layers[0].nodata = Some(vastex::NodataValue::new(-9999.0));
    harness.run();
    assert!(harness.query_by_label("as the file says").is_some());
    assert!(harness.state().shown.is_empty(), "nobody has changed it");
    click(&mut harness, "No data");
    assert_eq!(harness.state().shown[0].nodata, Nodata::None);
    assert!(harness.query_by_label("as the file says").is_none());
    click(&mut harness, "No data");
    assert_eq!(harness.state().shown[0].nodata, Nodata::OfLayer);
    assert!(harness.query_by_label("as the file says").is_some());
}

/// A slider brings a number into its range, so each has every number that a mode may have.
#[test]
fn a_panel_that_is_opened_changes_no_mode() {
    for text in ["swipe:0", "swipe:1", "flicker:0.05", "flicker:60", "difference:0.01", "difference:1000"] {
        let layers = [("a", LayerFormat::Rgba8Srgb), ("b", LayerFormat::R16)];
        let mut harness = harness(&layers, None);
        let mode: CompareMode = text.parse().unwrap();
        let shown = |name: &str| LayerOptions { name: Some(name.to_owned()), ..LayerOptions::default() };
        harness.state_mut().shown = vec![shown("a"), shown("b")];
        harness.state_mut().compare_mode = mode;
        let changes = harness.state().changes;
        harness.run();
        assert_eq!((harness.state().compare_mode, harness.state().changes), (mode, changes), "{text}");
    }
}
