//! Tiles that fade in: from exactly what was on screen before, to exactly what is there without fading, in
//! every filter.

use std::time::Duration;

use vastex_core::{
    AddressMode, Description, Geometry, GeometrySpec, Layer, LayerFormat, Slot, SlotMove, TableChange,
};
use vastex_wgpu::{FeedbackMode, Filter, Kind, Pool, TableKind};

use crate::common::{GPU, Random, World, tables_of};
use crate::sampling::{Harness, Output, inputs, shapes};
use crate::unlike::{Unlike, apart};

const SECOND: Duration = Duration::from_secs(1);

fn with_fades(world: World) -> World {
    World { pool: world.pool.with_fades(&GPU.device), ..world }
}

/// The same world with tiles that have come at different times: some just now, some long ago, most in
/// between.
pub(crate) fn faded(world: World, seed: u64) -> World {
    let mut world = with_fades(world);
    let slots: Vec<Slot> = world.changes.iter().map(|change| change.entry.slot()).collect();
    let mut random = Random(seed | 1);
    let fades = world.pool.fades_mut().unwrap();
    let mut just_now = Vec::new();
    for slot in slots {
        match random.below(5) {
            0 => {}
            1 => just_now.push(slot),
            _ => fades.begin(slot, SECOND.mul_f32(random.between(1.0, 6.0))),
        }
    }
    fades.pass(SECOND);
    just_now.into_iter().for_each(|slot| fades.begin(slot, SECOND));
    assert_eq!(fades.send(&GPU.queue) > 0, fades.fading() > 0);
    world
}

fn colors(outputs: &[Output]) -> Vec<[u32; 4]> {
    outputs.iter().map(|output| output.color.map(f32::to_bits)).collect()
}

fn feedback(outputs: &[Output]) -> Vec<[u32; 4]> {
    outputs.iter().map(|output| output.feedback).collect()
}

#[test]
fn every_filter_agrees_with_its_twin_while_tiles_fade() {
    for (n, geometry) in shapes().iter().enumerate().step_by(2).take(4) {
        let seed = n as u64 + 41;
        let mut world =
            faded(World::new(&GPU, geometry, LayerFormat::Rgba8, [0.4, 0.8][n / 2 % 2], seed), seed);
        for filter in Filter::KINDS {
            let harness = Harness::with_fade(&GPU, filter, &world, 0, true);
            harness.check(&mut world, [0, 11, 3][n % 3], seed);
        }
    }
}

#[test]
fn layers_of_fractions_and_of_data_fade_as_their_twins() {
    let layers = [
        Layer::new("color", LayerFormat::Rgba8Srgb),
        Layer { scale: 2, ..Layer::new("height", LayerFormat::R16) },
        Layer { scale: 4, ..Layer::new("depth", LayerFormat::R32Float) },
    ];
    let spec = GeometrySpec {
        page: 64,
        border: 16,
        tail_align: Description::tail_align(&layers),
        ..GeometrySpec::image(500, 300)
    };
    let description = Description::new(Geometry::new(spec).unwrap(), layers.to_vec());
    for (index, _) in layers.iter().enumerate() {
        let mut world = faded(World::of(&GPU, &description, index, 0.6, index as u64), 3);
        for filter in [Filter::Trilinear, Filter::Bicubic] {
            Harness::with_fade(&GPU, filter, &world, index, true).check(&mut world, 5, 9);
        }
    }
}

/// A texture with a seam, so that taps reach round it.
fn wrapped(seed: u64) -> World {
    let address = [AddressMode::Wrap, AddressMode::Mirror, AddressMode::Clamp];
    let spec = GeometrySpec { page: 40, border: 2, address, ..GeometrySpec::image(700, 500) };
    World::new(&GPU, &Geometry::new(spec).unwrap(), LayerFormat::Rgba8, 0.7, seed)
}

#[test]
fn what_is_all_there_is_shown_as_without_fading() {
    for seed in [6, 7] {
        let world = wrapped(seed);
        let inputs = inputs(&world.geometry, seed);
        let filters = Filter::KINDS;
        let sharp = filters.map(|filter| Harness::new(&GPU, filter, &world, 0).run(&world, &inputs));
        let mut world = faded(world, seed);
        let harnesses = filters.map(|filter| Harness::with_fade(&GPU, filter, &world, 0, true));
        for (harness, sharp) in harnesses.iter().zip(&sharp) {
            let fading = harness.run(&world, &inputs);
            assert_ne!(colors(&fading), colors(sharp));
            assert_eq!(feedback(&fading), feedback(sharp), "feedback does not depend on fading");
        }
        let fades = world.pool.fades_mut().unwrap();
        fades.pass(10 * SECOND);
        assert_eq!(fades.fading(), 0);
        fades.send(&GPU.queue);
        for ((filter, harness), sharp) in filters.iter().zip(&harnesses).zip(&sharp) {
            let shown = harness.run(&world, &inputs);
            // Two programs: docs/draw-checks.md, "What a GPU may differ by". `rounding` is in steps of 1/255;
            // `across` counts inputs that lie on an edge and may fall to either side of it. One in 12 inputs
            // is made to lie on edges; a sixteenth of those is let go.
            let (rounding, across) = match (filter, GPU.is_processor()) {
                (Filter::Anisotropic(_), true) => (0.5, 0),
                (_, true) => (0.0, 0),
                (Filter::Nearest, false) => (0.0, inputs.len() / 200),
                (_, false) => (2.0, inputs.len() / 200),
            };
            let mut unlike = Unlike::of(format!("{filter}, seed {seed}"));
            for (input, (shown, sharp)) in inputs.iter().zip(shown.iter().zip(sharp)) {
                let off = apart(shown.color, sharp.color);
                if off > rounding {
                    unlike.note(|| format!("{input:?} gives {shown:?}, not {sharp:?}: {off:.3} steps off"));
                }
            }
            unlike.check_all_but(across, inputs.len());
            // Whichever side such an input falls to, it shows what lies there: the twin knows both.
            harness.check(&mut world, 0, seed);
        }
    }
}

#[test]
fn where_values_are_not_mixed_tiles_are_there_at_once_and_every_filter_is_nearest() {
    for seed in [6, 7] {
        let world = wrapped(seed);
        let inputs = inputs(&world.geometry, seed);
        let nearest = Harness::new(&GPU, Filter::Nearest, &world, 0).run(&world, &inputs);
        let world = faded(world, seed);
        for filter in Filter::KINDS {
            let kind = Kind { is_mixed: false, ..world.kind(0, filter) };
            let unmixed = Harness::of(&GPU, kind, world.id, true).run(&world, &inputs);
            assert_eq!(colors(&unmixed), colors(&nearest), "{filter}");
            assert_eq!(feedback(&unmixed), feedback(&nearest), "{filter}");
        }
    }
}

#[test]
fn a_tile_that_has_just_come_leaves_the_picture_as_it_was_to_the_bit() {
    for seed in [10, 11] {
        let mut world = with_fades(wrapped(seed));
        let mut random = Random(seed);
        let (new, old): (Vec<TableChange>, Vec<TableChange>) =
            world.changes.iter().partition(|_| random.unit() < 0.4);
        let kind = [TableKind::Direct, TableKind::Hashed][seed as usize % 2];
        let (tail, mode) = (world.tail_slot(), FeedbackMode::Separate);
        let before = tables_of(&GPU, &world.geometry, world.number, tail, kind, mode, &old);
        let inputs = inputs(&world.geometry, seed);
        for filter in Filter::KINDS {
            let harness = Harness::with_fade(&GPU, filter, &world, 0, true);
            world.pool.fades_mut().unwrap().pass(SECOND);
            world.pool.fades_mut().unwrap().send(&GPU.queue);
            let was = harness.run_through(&before, &world, &inputs);
            let sharp = harness.run(&world, &inputs);
            let fades = world.pool.fades_mut().unwrap();
            new.iter().for_each(|change| fades.begin(change.entry.slot(), SECOND));
            fades.send(&GPU.queue);
            let is = harness.run(&world, &inputs);
            assert_eq!(colors(&is), colors(&was), "{filter}");
            assert_ne!(colors(&is), colors(&sharp), "{filter}");
        }
    }
}

#[test]
fn a_pool_that_takes_the_place_of_another_goes_on_where_that_was() {
    let mut world = faded(wrapped(3), 9);
    let slots: Vec<Slot> = world.changes.iter().map(|change| change.entry.slot()).collect();
    let layers = [Layer::new("only", LayerFormat::Rgba8)];
    let other = Pool::new(&GPU.device, &GPU.queue, world.pool.layout(), &layers).unwrap();
    let mut other = other.with_fades(&GPU.device);
    let last = other.layout().slots() - 1;
    // Each to the slot that lies opposite.
    let opposite = |from: Slot| SlotMove { from, to: Slot::new(last - from.index()) };
    let moves: Vec<SlotMove> = slots.into_iter().map(opposite).collect();
    let mut encoder = GPU.device.create_command_encoder(&Default::default());
    other.copy_from(&mut encoder, &world.pool, &moves);
    GPU.queue.submit([encoder.finish()]);
    assert!(other.fades().unwrap().fading() > 0);
    for _ in 0..2 {
        let (is, was) = (other.fades().unwrap(), world.pool.fades().unwrap());
        assert_eq!(is.fading(), was.fading());
        for SlotMove { from, to } in &moves {
            assert_eq!(is.shares()[to.index() as usize], was.shares()[from.index() as usize]);
        }
        world.pool.fades_mut().unwrap().pass(SECOND);
        other.fades_mut().unwrap().pass(SECOND);
    }
}
