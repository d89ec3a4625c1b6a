//! What the machine does, beside the picture (feature `egui`): how full each pool is and was, what would help
//! one that is too small, how long frames take, what lies where, and why a pixel shows what it shows. Rules,
//! budgets and sizes are changed here.
//!
//! All of it is drawn by one call from plain data ([`HudData`]), which [`HudData::of`] takes from the
//! textures and a host completes; what a person changes is given back as [`HudChange`]s for the host to carry
//! out, and [`Chosen`] keeps it. Nothing here knows a window or a clock, and nothing here moves by itself:
//! where no frame is drawn, none becomes due.

mod chosen;
mod chosen_pools;
mod data;
mod frame_times;
mod frames;
mod graph;
mod limits;
mod machine;
mod pool;
mod textures;

use egui::{CollapsingHeader, Color32, FontId, Frame, Margin, RichText, ScrollArea, TextStyle, Ui};
use vastex::{BiasRule, FeedbackMode, Filter, PoolId};

use crate::overlay::Overlay;
pub use chosen::{Chosen, NamedByHost};
pub use chosen_pools::{ChosenPools, PoolKind, pool_kinds};
pub use data::{HudData, HudPool, HudTexture, MachineThumbnail};
pub use frame_times::FrameTimes;
use textures::Order;

/// Points that the panel is wide.
const WIDTH: f32 = 348.0;
/// Points that small letters are high.
const SMALL: f32 = 11.0;

/// Something that a person changes in the panel.
#[derive(Clone, Debug, PartialEq)]
pub enum HudChange {
    /// A pool of so many bytes; without a number one that follows the picture.
    PoolBytes(PoolId, Option<u64>),
    /// How the mip bias of a pool is decided; `None` for no bias.
    Rule(PoolId, Option<BiasRule>),
    /// Bytes copied to the GPU per frame, and bytes of tiles on their way.
    Budgets {
        /// [`vastex::Settings::upload_bytes_per_frame`].
        uploads: u64,
        /// [`vastex::Settings::in_flight_bytes`].
        in_flight: u64,
    },
    /// How texels are blended; `None` for what suits the magnification.
    Filter(Option<Filter>),
    /// How views say what they want.
    Feedback(FeedbackMode),
    /// What is drawn in the place of the picture; `None` for the picture.
    Overlay(Option<Overlay>),
}

/// The panel. The same one goes on from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct Hud {
    /// By what the textures of each pool are in order.
    order: Order,
}

impl Hud {
    /// Points that the panel is wide, with its margins.
    pub const WIDTH: f32 = WIDTH;

    /// Shows the panel at the left of what is free in `ui`. Gives back what a person changed, in the order of
    /// the panel.
    pub fn show(&mut self, ui: &mut Ui, data: &HudData) -> Vec<HudChange> {
        let mut changes = Vec::new();
        let fill = ui.visuals().panel_fill.gamma_multiply(0.95);
        let frame = Frame::new().fill(fill).inner_margin(Margin::same(8));
        let panel = egui::Panel::left("hud").resizable(false).exact_size(WIDTH).frame(frame);
        panel.show(ui, |ui| {
            let fonts = &mut ui.style_mut().text_styles;
            fonts.insert(TextStyle::Small, FontId::proportional(SMALL));
            let visuals = ui.visuals_mut();
            let plain = Color32::from_gray(if visuals.dark_mode { 196 } else { 40 });
            visuals.widgets.noninteractive.fg_stroke.color = plain;
            visuals.weak_text_alpha = 0.8;
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                if data.pools.is_empty() {
                    ui.label("No textures yet.");
                }
                for pool in &data.pools {
                    pool::show(ui, pool, &mut changes);
                    ui.add_space(6.0);
                }
                section(ui, "Frames", true, |ui| frames::show(ui, data));
                if !data.is_of_volume {
                    section(ui, "Machine", true, |ui| machine::show(ui, data, &mut changes));
                    section(ui, "Under the pointer", true, |ui| machine::explain(ui, data));
                }
                section(ui, "Textures", true, |ui| textures::show(ui, &data.pools, &mut self.order));
                let limits = if data.is_of_volume { "Budgets" } else { "Budgets and sampling" };
                section(ui, limits, true, |ui| limits::show(ui, data, &mut changes));
            });
        });
        changes
    }
}

fn section(ui: &mut Ui, name: &str, is_open: bool, add: impl FnOnce(&mut Ui)) {
    ui.separator();
    CollapsingHeader::new(RichText::new(name).strong()).default_open(is_open).show_unindented(ui, add);
}

/// Bytes for people.
fn bytes(count: u64) -> String {
    crate::figures::bytes(count as f64)
}

#[cfg(test)]
mod tests;
