//! What a test says where GPU and twin differ: of how many inputs, by how much, and whose tiles show what the
//! GPU gave.

use vastex_core::Slot;
use vastex_wgpu::twins;

use crate::common::World;

/// Inputs that are reported one by one.
const MOST_REPORTED: usize = 20;

/// Inputs for which GPU and twin differ.
pub(crate) struct Unlike {
    of: String,
    inputs: usize,
    reported: Vec<String>,
}

impl Unlike {
    /// No inputs yet; `of` names what is tried, and begins the message.
    pub(crate) fn of(of: String) -> Unlike {
        Unlike { of, inputs: 0, reported: Vec::new() }
    }

    /// Counts an input for which they differ; the first few are reported, and `report` called for these
    /// alone.
    pub(crate) fn note(&mut self, report: impl FnOnce() -> String) {
        self.inputs += 1;
        if self.reported.len() < MOST_REPORTED {
            self.reported.push(report());
        }
    }

    /// Fails if GPU and twin differ for any of the `tried` inputs.
    pub(crate) fn check(self, tried: usize) {
        self.check_all_but(0, tried);
    }

    /// Fails if they differ for more than `few` of the `tried` inputs.
    pub(crate) fn check_all_but(self, few: usize, tried: usize) {
        let Unlike { of, inputs, reported } = self;
        assert!(inputs <= few, "{of}: {inputs} of {tried} inputs differ\n{}", reported.join("\n"));
    }
}

/// The most that a channel of two colours differs by, in steps of 1/255; more than any number where one is
/// no number.
pub(crate) fn apart(a: [f32; 4], b: [f32; 4]) -> f32 {
    let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs() * 255.0);
    differences.map(|apart| if apart.is_nan() { f32::INFINITY } else { apart }).fold(0.0, f32::max)
}

/// Where a slot lies in the pool, and whether a tile is in it.
fn lies(world: &World, slot: Slot) -> String {
    let layout = world.pool.layout();
    let [x, y, image] = layout.origin(slot);
    let (column, row) = (x / layout.tile[0], y / layout.tile[1]);
    let empty = if world.tiles.contains_key(&slot) { "" } else { ", empty" };
    format!("slot {} (column {column}, row {row}, image {image}{empty})", slot.index())
}

/// Where the twin finds the levels of a place, and which slots show a colour that `is_shown` knows if all
/// that is asked of the pool is answered from them.
pub(crate) fn whereabouts(
    world: &World,
    twin: &twins::Sampler<'_>,
    place: impl Fn(u8) -> twins::Place,
    is_shown: impl Fn(&twins::Sampler<'_>) -> bool,
) -> String {
    let mut expected: Vec<(Slot, String)> = Vec::new();
    for wanted in 0..=world.geometry.tail().first_level() {
        let place = place(wanted);
        if expected.last().is_none_or(|(slot, _)| *slot != place.slot) {
            let [x, y] = place.tile_texel;
            let found = format!("level {} at {x:.3} {y:.3} in {}", place.level, lies(world, place.slot));
            expected.push((place.slot, found));
        }
    }
    let empty = vec![0; world.tiles.values().map(Vec::len).max().unwrap_or(0)];
    let shows = |slot: Slot| {
        let bytes = world.tiles.get(&slot).unwrap_or(&empty).as_slice();
        let tile = |_: Slot| bytes;
        is_shown(&twins::Sampler { texture: twin.texture, format: twin.format, tile: &tile })
    };
    let shown: Vec<String> = (0..world.pool.layout().slots())
        .map(Slot::new)
        .filter(|slot| shows(*slot))
        .map(|slot| lies(world, slot))
        .collect();
    let expected: Vec<String> = expected.into_iter().map(|(_, found)| found).collect();
    format!("  the twin: {}\n  the GPU's colour is in: {}", expected.join("; "), shown.join("; "))
}
