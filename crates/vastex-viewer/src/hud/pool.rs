//! One pool: how full it is and was, what came and went, what would help where it is too small, and its size
//! and rule.

use egui::{Color32, ComboBox, DragValue, Frame, RichText, Ui};
use vastex::BiasRule;
use vastex::diagnostics::{Integrator, PoolRecord, Stats};

use super::graph::{Series, Style, graph, round_top};
use super::{HudChange, HudPool, bytes};

const OCCUPIED: Color32 = Color32::from_rgb(236, 94, 84);
const LOCKED: Color32 = Color32::from_rgb(240, 205, 80);
const BIAS: Color32 = Color32::from_rgb(92, 210, 124);
const UPLOADS: Color32 = Color32::from_rgb(92, 158, 250);
const EVICTIONS: Color32 = Color32::from_rgb(244, 150, 66);
const LOADS: Color32 = Color32::from_rgb(176, 130, 250);
const SHARP: Color32 = Color32::from_rgb(84, 206, 214);
/// What a warning is written on.
pub(super) const WARNING: Color32 = Color32::from_rgb(255, 186, 66);

/// Mebibytes that a person may give a pool.
const MIB: std::ops::RangeInclusive<f64> = 0.1..=65536.0;

pub(super) fn show(ui: &mut Ui, pool: &HudPool, changes: &mut Vec<HudChange>) {
    let stats = &pool.stats;
    ui.push_id(("pool", stats.pool), |ui| {
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new(format!("Pool {}", stats.pool.number())).strong());
            ui.label(RichText::new(&*stats.tiles).small().weak());
        });
        graphs(ui, pool);
        controls(ui, pool, changes);
        // Below what is pressed again and again, which stays where it is.
        warning(ui, pool, changes);
    });
}

/// What is said where a pool is too small, and what would help.
fn warning(ui: &mut Ui, pool: &HudPool, changes: &mut Vec<HudChange>) {
    let stats = &pool.stats;
    if !stats.is_oversubscribed() {
        return;
    }
    let Stats { wanted, bias_eighths, .. } = stats.pager;
    ui.add_space(4.0);
    let frame = Frame::new().fill(WARNING).corner_radius(4.0).inner_margin(6.0);
    frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        let dark = Color32::from_rgb(40, 26, 0);
        ui.visuals_mut().override_text_color = Some(dark);
        let outcome = match bias_eighths {
            0 => "so parts of it are shown by what is coarser".to_owned(),
            8 => "so it is drawn a level coarser".to_owned(),
            eighths => format!("so it is drawn {} levels coarser", f64::from(eighths) / 8.0),
        };
        let room = stats.room();
        ui.label(RichText::new("This pool is too small for the view").strong().color(dark));
        ui.label(format!("The view wants {wanted} tiles and there is room for {room}, {outcome}."));
        let enough = stats.bytes_wanted();
        let wanted_by = stats.pager.wanted;
        let label = format!("Make it {}", bytes(enough));
        let button = ui.add(
            egui::Button::new(RichText::new(label).color(Color32::WHITE)).fill(Color32::from_rgb(96, 60, 0)),
        );
        if button.on_hover_text(format!("room for {wanted_by} tiles without a mip bias")).clicked() {
            changes.push(HudChange::PoolBytes(stats.pool, Some(enough)));
        }
        ui.label(RichText::new("Or make the window smaller, or hide a layer.").small());
    });
}

fn graphs(ui: &mut Ui, pool: &HudPool) {
    let (records, frames) = (&pool.records, pool.frames);
    let of = |value: &dyn Fn(&PoolRecord) -> f32| records.iter().map(value).collect::<Vec<f32>>();
    let share = |of: u32, stats: &Stats| of as f32 / stats.slots.max(1) as f32;
    let occupied = of(&|record| share(record.pager.stats.occupied, &record.pager.stats));
    let locked = of(&|record| share(record.pager.stats.locked, &record.pager.stats));
    let bias = of(&|record| f32::from(record.pager.stats.bias_eighths) / 8.0);
    let percent = |value: f32| format!("{:.0} %", 100.0 * value);
    let levels = |value: f32| format!("{value}");
    let top = round_top(bias.iter().copied(), 2.0);
    graph(
        ui,
        "Residency",
        76.0,
        frames,
        &[
            Series {
                name: "occupied",
                color: OCCUPIED,
                style: Style::Area,
                values: occupied,
                top: 1.0,
                told: &percent,
            },
            Series {
                name: "locked",
                color: LOCKED,
                style: Style::Line,
                values: locked,
                top: 1.0,
                told: &percent,
            },
            Series { name: "mip bias", color: BIAS, style: Style::Line, values: bias, top, told: &levels },
        ],
    );
    let uploads = of(&|record| record.pager.stats.loaded as f32);
    let evictions = of(&|record| record.pager.stats.evicted as f32);
    let tile_bytes = pool.stats.tile_bytes();
    let tiles = |value: f32| format!("{value:.0} ({})", bytes((f64::from(value) * tile_bytes as f64) as u64));
    let count = |value: f32| format!("{value:.0}");
    // Both have room.
    let top = 2.0 * round_top(uploads.iter().chain(&evictions).copied(), 4.0);
    graph(
        ui,
        "Tiles a frame",
        46.0,
        frames,
        &[
            Series {
                name: "uploads a frame",
                color: UPLOADS,
                style: Style::Bars,
                values: uploads,
                top,
                told: &tiles,
            },
            Series {
                name: "evictions",
                color: EVICTIONS,
                style: Style::Hanging,
                values: evictions,
                top,
                told: &count,
            },
        ],
    );
    let loads = of(&|record| record.pager.stats.in_flight as f32);
    let sharp = |percentile: fn(&vastex::diagnostics::TimeToSharp) -> u32| {
        of(&move |record| {
            record.pager.time_to_sharp.as_ref().map_or(f32::NAN, |time| percentile(time) as f32)
        })
    };
    let (median, late) = (sharp(|time| time.p50), sharp(|time| time.p95));

    ui.columns(2, |columns| {
        let [left, right] = columns else { return };
        let top = round_top(loads.iter().copied(), 4.0);
        let loads = Series {
            name: "loads in flight",
            color: LOADS,
            style: Style::Area,
            values: loads,
            top,
            told: &count,
        };
        graph(left, "Loads", 40.0, frames, &[loads]);
        let top = round_top(late.iter().copied(), 4.0);
        let series =
            |name, color, values| Series { name, color, style: Style::Line, values, top, told: &count };
        graph(
            right,
            "Time to sharp",
            40.0,
            frames,
            &[series("frames to sharp", SHARP, median), series("95 %", SHARP.gamma_multiply(0.55), late)],
        );
    });
    let stats = &pool.stats.pager;
    ui.label(
        RichText::new(format!(
            "{} of {} slots of {}; wanted {}, missing {}, in flight {}",
            stats.occupied,
            stats.slots,
            bytes(tile_bytes),
            stats.wanted,
            stats.missing,
            bytes(stats.in_flight_bytes),
        ))
        .small()
        .weak(),
    );
}

fn controls(ui: &mut Ui, pool: &HudPool, changes: &mut Vec<HudChange>) {
    let (id, held) = (pool.stats.pool, pool.stats.bytes);
    let mut set = |bytes: Option<u64>| changes.push(HudChange::PoolBytes(id, bytes));
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let label = ui.label("Size");
        let mut mib = held as f64 / f64::from(1 << 20);
        let before = mib;
        let value = DragValue::new(&mut mib).range(MIB).speed(0.0).suffix(" MiB").max_decimals(1);
        let value = ui.add(value.update_while_editing(false)).labelled_by(label.id);
        if value.on_hover_text("of GPU memory; click to write another size").changed()
            && (mib - before).abs() > 0.05
        {
            set(Some((mib * f64::from(1 << 20)) as u64));
        }
        if ui.button("Halve").clicked() {
            set(Some(held / 2));
        }
        if ui.button("Double").clicked() {
            set(Some(held.saturating_mul(2)));
        }
        let automatic = ui.selectable_label(!pool.is_sized_by_hand, "Auto");
        if automatic
            .on_hover_text("as large as the picture needs, or as was asked for at the start")
            .clicked()
        {
            set(None);
        }
    });
    ui.horizontal(|ui| {
        let mut rule = RuleChoice::of(pool.rule);
        let before = rule;
        ComboBox::from_label("Mip bias").selected_text(rule.name()).show_ui(ui, |ui| {
            for choice in RuleChoice::ALL {
                ui.selectable_value(&mut rule, choice, choice.name()).on_hover_text(choice.meaning());
            }
        });
        if rule != before {
            changes.push(HudChange::Rule(id, rule.rule()));
        }
    });
}

/// The rules that are offered.
#[derive(Clone, Copy, PartialEq, Eq)]
enum RuleChoice {
    Solved,
    Integrating,
    Never,
}

impl RuleChoice {
    const ALL: [RuleChoice; 3] = [RuleChoice::Solved, RuleChoice::Integrating, RuleChoice::Never];

    fn of(rule: Option<BiasRule>) -> RuleChoice {
        match rule {
            None => RuleChoice::Never,
            Some(BiasRule::Solved) => RuleChoice::Solved,
            Some(BiasRule::Integrating(_)) => RuleChoice::Integrating,
        }
    }

    fn rule(self) -> Option<BiasRule> {
        match self {
            RuleChoice::Solved => Some(BiasRule::Solved),
            RuleChoice::Integrating => Some(BiasRule::Integrating(Integrator::default())),
            RuleChoice::Never => None,
        }
    }

    fn name(self) -> &'static str {
        match self {
            RuleChoice::Solved => "solved",
            RuleChoice::Integrating => "integrating",
            RuleChoice::Never => "never",
        }
    }

    fn meaning(self) -> &'static str {
        match self {
            RuleChoice::Solved => "at once the smallest with which the view fits",
            RuleChoice::Integrating => "a little more in each frame, as large engines do it",
            RuleChoice::Never => "what came first is sharp, the rest is shown by what is coarser",
        }
    }
}
