//! A person at the panel of a volume.

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use glam::DVec3;

use super::*;
use crate::panels::unnamed;
use crate::volume_scene::facts_for_tests;
use crate::volume_scene::{PointValue, VolumeLook};

struct Shown {
    facts: VolumeFacts,
    look: VolumeLook,
    panel: VolumePanel,
    asked: Vec<VolumeChange>,
    clicked: Option<PointAnswer>,
    cut: Option<RayCut>,
    values: Vec<Option<VolumeValues>>,
}

impl Shown {
    fn new(facts: VolumeFacts) -> Shown {
        let look = VolumeLook::first(&facts);
        Shown {
            facts,
            look,
            panel: VolumePanel::default(),
            asked: Vec::new(),
            clicked: None,
            cut: None,
            values: Vec::new(),
        }
    }

    fn show(ui: &mut Ui, shown: &mut Shown) {
        let told = VolumeStatus {
            facts: &shown.facts,
            seen_time: 0,
            is_playing: false,
            share: 0.876,
            missing: 3,
            bias: 0.0,
            cut: shown.cut,
            clicked: shown.clicked.as_ref(),
            values: &shown.values,
        };
        shown.asked.extend(shown.panel.show(ui, &mut shown.look, &told));
    }

    fn harness(self) -> Harness<'static, Shown> {
        Harness::builder().with_size([320.0, 900.0]).build_ui_state(Shown::show, self)
    }
}

#[test]
fn channels_are_hidden_and_shown_by_name() {
    let mut harness = Shown::new(facts_for_tests()).harness();
    harness.get_by_label("show membranes").click();
    harness.run();
    assert_eq!(harness.state().look.shown().collect::<Vec<_>>(), [0, 2]);
    harness.get_by_label("show membranes").click();
    harness.get_by_label("show channel 2").click();
    harness.run();
    assert_eq!(harness.state().look.shown().collect::<Vec<_>>(), [0, 1]);
}

#[test]
fn modes_pictures_and_steps_are_chosen() {
    let mut harness = Shown::new(facts_for_tests()).harness();
    assert!(harness.query_all_by_label("Density").next().is_none());
    harness.get_by_label("emission").click();
    harness.run();
    assert_eq!(harness.state().look.mode, VolumeMode::Emission);
    assert!(harness.query_all_by_label("Density").next().is_some());
    harness.get_by_label("1/3").click();
    harness.get_by_label("3-D").click();
    harness.run();
    let look = &harness.state().look;
    assert_eq!((look.step, look.layout), (1.0 / 3.0, VolumeLayout::One(VolumePane::Space)));
    harness.get_by_label("Show all").click();
    harness.run();
    assert_eq!(harness.state().asked, [VolumeChange::Fit]);
}

#[test]
fn the_chosen_channel_has_a_range_and_usual_values_can_be_asked_for() {
    let mut shown = Shown::new(facts_for_tests());
    shown.look.channels[1].range = Some([100.0, 900.0]);
    let mut harness = shown.harness();
    assert!(harness.query_by_label("is being read").is_some(), "the first channel's is not known yet");
    harness.get_by_label("membranes").click();
    harness.run();
    assert!(harness.query_by_label("is being read").is_none());
    harness.get_by_label("Usual").click();
    harness.run();
    assert_eq!(harness.state().asked, [VolumeChange::UsualRanges(vec![1])]);
}

#[test]
fn labels_are_shown_over_the_channels() {
    let mut harness = Shown::new(facts_for_tests()).harness();
    assert!(harness.query_by_label("Outlines in slices").is_none());
    harness.get_by_label("labels cells").click();
    harness.run();
    assert_eq!(harness.state().look.labels.shown, Some(0));
    harness.get_by_label("Outlines in slices").click();
    harness.run();
    assert!(harness.state().look.labels.outlines);
    harness.get_by_label("labels cells").click();
    harness.run();
    assert_eq!(harness.state().look.labels.shown, None);
    let harness = Shown::new(VolumeFacts { labels: Vec::new(), ..facts_for_tests() }).harness();
    assert!(harness.query_by_label("Labels").is_none());
}

#[test]
fn a_label_is_selected_by_its_number_and_let_go() {
    let mut shown = Shown::new(facts_for_tests());
    shown.look.labels.shown = Some(0);
    let mut harness = shown.harness();
    for (text, selected, wrong) in [
        ("cell", None, Some("write a whole number of up to 64 bits")),
        ("0", None, Some("0 is where there is no label; write another whole number")),
        ("-7", Some(-7), None),
        ("18446744073709551615", Some(i128::from(u64::MAX)), None),
        // Of 8 bits.
        ("44", Some(44), None),
        ("300", Some(44), Some("cells has no label 300: its values are 0 to 255")),
    ] {
        if text == "44" {
            harness.state_mut().facts.label_bounds = vec![[0, 255]];
        }
        harness.get_by_label("Selected").focus();
        harness.run();
        harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::A);
        harness.run();
        harness.get_by_label("Selected").type_text(text);
        harness.run();
        harness.get_by_label("Find").click();
        harness.run();
        assert_eq!(harness.state().look.labels.selected, selected, "{text}");
        assert!(wrong.is_none_or(|wrong| harness.query_by_label(wrong).is_some()), "{text}");
        let asked: Vec<_> = harness.state_mut().asked.drain(..).collect();
        let found: Vec<_> =
            selected.filter(|_| wrong.is_none()).map(VolumeChange::FindLabel).into_iter().collect();
        assert_eq!(asked, found, "{text}");
    }
    harness.get_by_label("hidden").click();
    harness.run();
    assert_eq!(harness.state().look.labels.others, OtherLabels::Hidden);
    harness.get_by_label("None").click();
    harness.run();
    assert_eq!(harness.state().look.labels.selected, None);
    assert!(harness.query_by_label("hidden").is_none());
}

#[test]
fn a_range_keeps_its_ends_apart_and_finite() {
    for (range, before) in [
        ([5.0, 5.0], [0.0, 5.0]),
        ([5.0, 5.0], [5.0, 9.0]),
        ([255.0, 255.0], [10.0, 255.0]),
        ([5.0, 5.0], [5.0, 0.0]),
        ([0.0, 0.0], [0.0, 1.0]),
        ([1e30, 1e30], [0.0, 1e30]),
        ([0.0, f64::INFINITY], [0.0, 1.0]),
        ([f64::NAN, 1.0], [0.0, 1.0]),
        ([-1e300, 1e300], [0.0, 1.0]),
    ] {
        let [low, high] = kept_apart(range, before);
        let is_turned = before[0] > before[1];
        assert!((high < low) == is_turned && (low as f32) != (high as f32), "{range:?}: {low} {high}");
        assert!(((high - low) as f32).is_finite(), "{range:?}: {low} {high}");
    }
    assert_eq!(kept_apart([3.0, 7.0], [3.0, 8.0]), [3.0, 7.0]);
    assert_eq!(kept_apart([5.0, 5.0], [5.0, 5.0]), [5.0, 5.0], "what nobody changes stays");
    // Within what values can be.
    let [low, high] = kept_apart([255.0, 255.0], [10.0, 255.0]);
    assert!(low < 255.0 && high == 255.0);
}

#[test]
fn the_range_is_dragged_beside_the_values_of_the_channel() {
    let mut shown = Shown::new(facts_for_tests());
    shown.look.channels[0].range = Some([20.0, 80.0]);
    shown.values = vec![VolumeValues::new((0..=256).map(|n| f64::from(n) / 2.56).collect())];
    let mut harness = shown.harness();
    harness.run();
    let graph = harness.get_by_label("Range of values").rect();
    // 0 to 100, and 3 % of room on both sides.
    let at = |value: f32| egui::pos2(graph.left() + graph.width() * (value + 3.0) / 106.0, graph.center().y);
    harness.drag_at(at(79.0));
    harness.run();
    harness.hover_at(at(60.0));
    harness.run();
    harness.drop_at(at(60.0));
    harness.run();
    let [low, high] = harness.state().look.channels[0].range.unwrap();
    assert!(low == 20.0 && (high - 60.0).abs() < 1.0, "{low} {high}");
}

#[test]
fn a_channel_has_its_colours_by_a_map() {
    let mut shown = Shown::new(facts_for_tests());
    shown.look.channels[0].range = Some([0.0, 10.0]);
    let mut harness = shown.harness();
    harness.get_by_label("Colours by a map").click();
    harness.run();
    assert_eq!(harness.state().look.channels[0].map, Some(Palette::VIRIDIS));
    harness.get_by_label("Reversed").click();
    harness.run();
    assert_eq!(harness.state().look.channels[0].map, Some(Palette::VIRIDIS.reversed()));
    assert_eq!(harness.state().look.channels[0].color_at(0.0), [253, 231, 37]);
    harness.get_by_label("Colours by a map").click();
    harness.run();
    assert_eq!(harness.state().look.channels[0].map, None);
}

#[test]
fn times_are_shown_where_there_are_any() {
    let mut harness = Shown::new(facts_for_tests()).harness();
    harness.get_by_label("Play").click();
    harness.run();
    assert_eq!(harness.state().asked, [VolumeChange::Play(true)]);
    let harness = Shown::new(VolumeFacts { times: 1, ..facts_for_tests() }).harness();
    assert!(harness.query_by_label("Play").is_none());
}

#[test]
fn a_slice_is_tilted_by_numbers_and_put_upright() {
    let mut shown = Shown::new(facts_for_tests());
    shown.look.tilt_by(VolumePane::Z, 20.0, -5.0);
    shown.look.cross = DVec3::new(1.3, 2.4, 3.3);
    let mut harness = shown.harness();
    harness.get_by_label("Tilted slices").click();
    harness.run();
    let shown = harness.get_by_label("tilt z yaw").value();
    assert!(shown.is_none_or(|value| value.contains("20")), "the number is told");
    harness.get_by_label("tilt y pitch").focus();
    harness.run();
    harness.key_press(egui::Key::ArrowUp);
    harness.run();
    assert!(harness.state().look.tilts[1].pitch > 0.0, "{:?}", harness.state().look.tilts);
    harness.get_by_label("Upright").click();
    harness.run();
    let look = &harness.state().look;
    let voxel = look.cross / harness.state().facts.of.voxel;
    assert!(look.is_upright() && (voxel - voxel.floor() - 0.5).length() < 1e-9, "{voxel}");
}

#[test]
fn what_is_cut_away_is_put_back() {
    let mut shown = Shown::new(facts_for_tests());
    shown.look.clip.shares[2] = [0.25, 0.5];
    let mut harness = shown.harness();
    harness.get_by_label("Cut away").click();
    harness.run();
    harness.run();
    harness.get_by_label("Plane").click();
    harness.run();
    assert!(harness.state().look.clip.has_plane);
    harness.get_by_label("Nothing").click();
    harness.run();
    assert_eq!(harness.state().look.clip, ClipLook::default());
}

#[test]
fn a_click_tells_values_with_their_level_and_place() {
    let mut shown = Shown::new(facts_for_tests());
    let values = vec![PointValue { channel: 0, value: "1234".into(), level: 1 }];
    let (place, label) = (Some(DVec3::new(1.0, 2.0, 3.0)), Some(4_294_967_301));
    shown.clicked = Some(PointAnswer { number: 1, place, voxel: [4, 8, 3], values, label });
    let harness = shown.harness();
    for said in ["1234  level 1", "4294967301", "102, 4, 2 µm", "4, 8, 3"] {
        assert!(harness.query_by_label(said).is_some(), "{said}");
    }
    assert!(harness.query_by_label("87 % at the wanted level, 3 bricks to come").is_some());
}

#[test]
fn rays_that_are_cut_are_told() {
    for (cut, is_told) in [(None, false), (Some(RayCut::Samples([3e5, 262_144.0], Some(1.2))), true)] {
        let harness = Shown { cut, ..Shown::new(facts_for_tests()) }.harness();
        assert_eq!(harness.query_by_label_contains("choose a longer step").is_some(), is_told);
    }
}

#[test]
fn every_control_has_a_name() {
    let mut shown = Shown::new(facts_for_tests());
    shown.look.channels[0].range = Some([0.0, 1.0]);
    shown.look.clip.has_plane = true;
    shown.look.mode = VolumeMode::Iso;
    shown.look.channels[0].map = Some(Palette::MAGMA);
    (shown.look.labels.shown, shown.look.labels.selected) = (Some(0), Some(3));
    let mut harness = shown.harness();
    harness.get_by_label("Cut away").click();
    harness.run();
    harness.run();
    assert_eq!(unnamed(&harness.root()), Vec::<String>::new());
}
