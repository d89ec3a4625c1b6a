//! The mip bias in the simulated world: the solution beside the controller that it is measured against.

use vastex_core::sim::{Crowd, Knobs, Path, World};
use vastex_core::{BiasRule, Budgets, GeometrySpec, Integrator};

const BASELINE: BiasRule =
    BiasRule::Integrating(Integrator { lower: 0.95, upper: 0.95, rate: 0.2, locked: 0.65, max_levels: 4.0 });

/// A view that needs several times the slots, seen whole in each feedback.
fn knobs(bias_rule: BiasRule) -> Knobs {
    Knobs { slots: 20, complete_feedback: true, bias_rule, ..Knobs::new(Path::Still, 1) }
}

/// Frames until the bias is at least so many eighths, counted from the one whose feedback first acts.
fn frames_until(world: &mut World, eighths: u16) -> u64 {
    while world.pager.stats().wanted <= 1 {
        world.step().unwrap();
    }
    let first = world.frame;
    while world.pool().bias_eighths() < eighths {
        assert!(world.frame < first + 1000, "{:?}", world.pager.stats());
        world.step().unwrap();
    }
    world.frame - first
}

#[test]
fn a_bias_is_in_force_with_the_feedback_that_shows_the_need() {
    let mut solved = World::new(knobs(BiasRule::Solved)).unwrap();
    let mut settled = World::new(knobs(BiasRule::Solved)).unwrap();
    settled.run_until_converged(200).unwrap();
    let needed = settled.pool().bias_eighths();
    assert!(needed >= 8, "a level at least, or the comparison says nothing: {needed} eighths");
    assert_eq!(frames_until(&mut solved, needed), 0, "at once, and all of it");
    let mut hunted = World::new(knobs(BASELINE)).unwrap();
    let frames = frames_until(&mut hunted, 8);
    assert!((90..=110).contains(&frames), "{frames} frames for a level");
    assert_eq!(BiasRule::Integrating(Integrator::default()), BASELINE);
}

/// Whatever the rule, what `World::step` checks holds.
#[test]
fn the_baseline_shows_what_came_first_until_its_bias_is_large_enough() {
    for path in Path::ALL {
        for slots in [8, 60] {
            let knobs =
                Knobs { slots, path, complete_feedback: false, screen: [320, 180], ..knobs(BASELINE) };
            let mut world = World::new(knobs).unwrap();
            for _ in 0..150 {
                world.step().unwrap();
                assert!(world.pool().bias_eighths() <= 32);
            }
        }
    }
}

/// A turn is a frame in which the bias changes the other way than it did last.
fn quick_turns(path: Path, slots: u32) -> usize {
    let mut world = World::new(Knobs { slots, ..Knobs::new(path, 1) }).unwrap();
    let (mut turns, mut last, mut direction) = (Vec::new(), 0, 0);
    for _ in 0..300 {
        world.step().unwrap();
        let bias = i32::from(world.pool().bias_eighths());
        let change = (bias - last).signum();
        if change != 0 && change != direction {
            turns.push(world.frame);
            direction = change;
        }
        last = bias;
    }
    turns.windows(2).filter(|pair| pair[1] - pair[0] < 8).count()
}

#[test]
fn the_solution_does_not_oscillate_on_any_path() {
    for path in Path::ALL {
        for slots in [20, 60, 150] {
            // A bias that has fallen needs a calm cycle to fall again, so a turn downwards and one upwards
            // take over 16 frames. Each of the teleports is a new working set of its own.
            let views = if path == Path::Teleport { 8 } else { 1 };
            let quick = quick_turns(path, slots);
            assert!(quick <= 2 * views, "{path:?}, {slots} slots: {quick} turns within 8 frames");
        }
    }
}

#[test]
fn the_largest_bias_of_the_pools_that_hunt_acts_on_all_of_them() {
    let budgets = Budgets { upload_bytes_per_frame: 4000, in_flight_bytes: 20_000 };
    let mut crowd = Crowd::new(budgets, [640, 360], 1);
    let rules = [Some(BASELINE), Some(BASELINE), Some(BiasRule::Solved), None];
    let pools = [20, 400, 400, 400].into_iter().zip(rules);
    for (slots, rule) in pools {
        let pool = crowd.add_pool(slots, 100, rule).unwrap();
        crowd.add(pool, GeometrySpec::image(16_384, 8192), Path::Still).unwrap();
    }
    for _ in 0..150 {
        crowd.step().unwrap();
        let biases: Vec<u16> = crowd.pager.pools().map(|pager| pager.bias_eighths()).collect();
        assert!(biases[1].abs_diff(biases[0]) <= 1, "one feedback behind at most: {biases:?}");
        assert_eq!(biases[2..], [0, 0]);
    }
    assert!(crowd.pager.pools().next().unwrap().bias_eighths() >= 8);
    let named = crowd.events.iter().filter_map(|(_, event)| match event {
        vastex_core::Event::Oversubscribed { pool, .. } => Some(pool.number()),
        _ => None,
    });
    assert!(named.clone().count() > 0 && named.clone().all(|pool| pool == 0), "only the one that needs it");
}
