//! The panel under the hands of a person, with made-up pools.

use std::time::Duration;

use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use vastex::diagnostics::{ExplainedPixel, PoolFrame, PoolRecord, PoolStats, Stats, TimeToSharp};

use super::*;
use crate::stage::PartTime;

/// A pool of 100 slots in which a view wants so many tiles.
pub(super) fn pool(number: u16, wanted: u32) -> HudPool {
    let pool = PoolId::new(number);
    let bias_eighths = if wanted > 90 { 6 } else { 0 };
    let at = |frame: u64| {
        let share = frame.min(100) as u32;
        let stats = Stats {
            slots: 100,
            occupied: share.min(wanted),
            locked: 4,
            wanted,
            bias_eighths: if share > 80 { bias_eighths } else { 0 },
            loaded: if frame < 100 { 1 + frame % 4 } else { 0 },
            evicted: if frame > 80 && frame < 120 { frame % 3 } else { 0 },
            in_flight: if frame < 100 { 12 - (frame % 9) as u32 } else { 0 },
            ..Stats::default()
        };
        let time_to_sharp = (frame > 3).then_some(TimeToSharp { p50: 6, p95: 14 });
        let pager = PoolFrame { frame, pool, stats, feedback_age: Some(2), time_to_sharp };
        PoolRecord { pager, ..PoolRecord::default() }
    };
    let records: Vec<PoolRecord> = (0..180).map(at).collect();
    let texture = |name: &str, pages: u32| HudTexture {
        name: name.to_owned(),
        pages,
        slots: pages,
        bytes: u64::from(pages) * 73984,
        levels: [2, 7],
    };
    let pager = records.last().map(|record| record.pager.stats).unwrap_or_default();
    HudPool {
        stats: PoolStats { pool, tiles: "136x136 texels of rgba8-srgb".into(), bytes: 100 * 73984, pager },
        records,
        frames: 256,
        rule: Some(BiasRule::Solved),
        is_sized_by_hand: false,
        textures: vec![texture("earth.vastex", 60), texture("moon.vastex", 31)],
    }
}

pub(super) fn data(wanted: u32) -> HudData {
    let mut frames = FrameTimes::default();
    (0..200u64).for_each(|n| frames.push(Duration::from_millis(9 + (n * 7) % 13)));
    let part = |part: &str, ms| PartTime { part: part.to_owned(), ms };
    HudData {
        pools: vec![pool(0, wanted)],
        upload_bytes_per_frame: 2 << 20,
        in_flight_bytes: 16 << 20,
        frames,
        gpu_times: Some(vec![part("feedback", 0.4), part("picture", 5.1), part("panels", 1.3)]),
        explained: Some(ExplainedPixel { pixel: [3, 4], explanations: Vec::new() }),
        ..HudData::default()
    }
}

struct Shown {
    hud: Hud,
    data: HudData,
    changes: Vec<HudChange>,
}

fn shown(data: HudData) -> Harness<'static, Shown> {
    let show = |ui: &mut Ui, shown: &mut Shown| {
        let changes = shown.hud.show(ui, &shown.data);
        shown.changes.extend(changes);
    };
    let shown = Shown { hud: Hud::default(), data, changes: Vec::new() };
    Harness::builder().with_size([900.0, 1400.0]).build_ui_state(show, shown)
}

fn click(harness: &mut Harness<'_, Shown>, label: &str) {
    harness.get_by_label(label).click();
    harness.run();
}

#[test]
fn a_pool_that_is_too_small_says_what_would_help_and_gets_it() {
    let mut harness = shown(data(70));
    assert!(harness.query_by_label_contains("too small").is_none(), "70 of 100 slots are enough");
    let mut harness_short = shown(data(130));
    assert!(harness_short.query_by_label_contains("wants 130 tiles and there is room for 90").is_some());
    assert!(harness_short.query_by_label_contains("0.75 levels coarser").is_some());
    // 130 tiles of 73,984 bytes take 80 % of 12,022,400 bytes, which are 11.5 MiB.
    click(&mut harness_short, "Make it 12 MiB");
    let pool = PoolId::new(0);
    assert_eq!(harness_short.state().changes, [HudChange::PoolBytes(pool, Some(12 << 20))]);
    for (label, change) in [
        ("Halve", HudChange::PoolBytes(pool, Some(50 * 73984))),
        ("Double", HudChange::PoolBytes(pool, Some(200 * 73984))),
        ("Auto", HudChange::PoolBytes(pool, None)),
        ("atlas", HudChange::Overlay(Some(Overlay::Atlas))),
    ] {
        click(&mut harness, label);
        assert_eq!(harness.state().changes.last(), Some(&change));
    }
    let mut unbiased = data(130);
    unbiased.pools[0].stats.pager.bias_eighths = 0;
    let harness = shown(unbiased);
    assert!(harness.query_by_label_contains("shown by what is coarser").is_some());
}

#[test]
fn rules_filters_and_feedback_are_chosen_from_lists() {
    let mut harness = shown(data(70));
    for (list, choice, change) in [
        ("Mip bias", "never", HudChange::Rule(PoolId::new(0), None)),
        ("Filter", "bicubic", HudChange::Filter(Some(Filter::Bicubic))),
        ("Feedback", "inline", HudChange::Feedback(FeedbackMode::Inline)),
    ] {
        harness.get_all_by_label(list).next().unwrap().click();
        harness.run();
        click(&mut harness, choice);
        assert_eq!(harness.state().changes.last(), Some(&change), "{list}");
    }
}

#[test]
fn numbers_are_written() {
    let mut harness = shown(data(70));
    for (label, text, change) in [
        ("Size", "64", HudChange::PoolBytes(PoolId::new(0), Some(64 << 20))),
        ("Uploads a frame", "512", HudChange::Budgets { uploads: 512 << 10, in_flight: 16 << 20 }),
        ("Loads in flight", "4096", HudChange::Budgets { uploads: 2 << 20, in_flight: 4 << 20 }),
    ] {
        let field = |harness: &Harness<'_, Shown>| {
            let is_field = |node: &egui_kittest::Node<'_>| {
                let role = node.accesskit_node().role();
                matches!(role, egui::accesskit::Role::SpinButton | egui::accesskit::Role::TextInput)
            };
            harness.get_all_by_label(label).find(is_field).unwrap().click();
        };
        field(&harness);
        harness.run();
        harness.event(egui::Event::Text(text.to_owned()));
        harness.key_press(egui::Key::Enter);
        harness.run();
        assert_eq!(harness.state().changes.last(), Some(&change), "{label}");
    }
}

#[test]
fn textures_are_put_in_order() {
    let mut harness = shown(data(70));
    let top = |harness: &Harness<'_, Shown>, name: &str| harness.get_by_label(name).rect().top();
    assert!(top(&harness, "earth.vastex") < top(&harness, "moon.vastex"), "the one with the most pages");
    click(&mut harness, "Slots");
    click(&mut harness, "Slots");
    assert!(top(&harness, "earth.vastex") > top(&harness, "moon.vastex"));
}

#[test]
fn graphs_and_controls_have_names() {
    let harness = shown(data(130));
    for graph in ["Residency: occupied 100 %, locked 4 %, mip bias 0.75", "Frame times: frame"] {
        assert!(harness.query_by_label_contains(graph).is_some(), "{graph}");
    }
    assert!(harness.query_by_label_contains("picture 5.10 ms").is_some());
    assert_eq!(crate::panels::unnamed(&harness.root()), Vec::<String>::new());
}

#[test]
fn it_moves_by_nothing() {
    let mut harness = shown(data(130));
    harness.run();
    harness.step();
    let output = harness.output().viewport_output.values().next().unwrap();
    assert_eq!(output.repaint_delay, Duration::MAX, "no frame becomes due by itself");
}

#[test]
fn before_anything_is_measured_nothing_is_said_of_what_a_device_can() {
    let show = |ui: &mut Ui, data: &mut HudData| drop(Hud::default().show(ui, data));
    for (gpu_times, label) in
        [(None, "This device tells no GPU times."), (Some(Vec::new()), "No GPU time is measured yet.")]
    {
        let told = HudData { gpu_times, ..data(60) };
        let mut harness = Harness::builder().with_size([800.0, 2400.0]).build_ui_state(show, told);
        harness.run();
        assert!(harness.query_by_label(label).is_some(), "{label}");
    }
}

/// Volumes have no overlays, are sampled in one way and explain no pixel.
#[test]
fn of_a_volume_nothing_is_offered_that_does_not_act() {
    let show = |ui: &mut Ui, data: &mut HudData| drop(Hud::default().show(ui, data));
    let told = HudData { gpu_times: None, explained: None, ..data(60) };
    for is_of_volume in [false, true] {
        let told = HudData { is_of_volume, ..told.clone() };
        let mut harness = Harness::builder().with_size([800.0, 2400.0]).build_ui_state(show, told);
        harness.run();
        for label in [
            "Machine",
            "levels",
            "Under the pointer",
            "Filter",
            "Feedback",
            "This device tells no GPU times.",
            "Budgets and sampling",
        ] {
            assert_eq!(harness.query_by_label(label).is_none(), is_of_volume, "{label}");
        }
        for label in ["Budgets", "GPU times are not measured for volumes."] {
            assert_eq!(harness.query_by_label(label).is_some(), is_of_volume, "{label}");
        }
        for label in ["Frames", "Textures", "Uploads a frame"] {
            assert!(harness.query_all_by_label(label).next().is_some(), "{label}");
        }
    }
}
