//! A camera that rests: whatever was there before and however small the pool is, no tile is uploaded twice
//! while it rests, and every ray has what it needs at the mip bias that this takes.

mod world;

use std::collections::BTreeSet;

use vastex_core::sim::Random;
use vastex_core::{Geometry, GeometrySpec, PageId, PagePos, PageState, Region, Urgency, ViewId};

use world::{CYCLE, MOST_FRAMES, MOST_OF_ALL, Need, PASSES, Picture, READ_AFTER, SIDE, World};

/// A camera moves and comes to rest twice, in a pool that may be too small for where it was or where it is.
/// Gives the frames that it takes each time, and the mip bias then. At last the pool is large enough.
fn play(seed: u64) -> Result<[[u64; 2]; 2], String> {
    let mut random = Random::new(seed);
    let slots = 4 + random.below(120) as u32;
    let mut world = World::new(&mut random, slots);
    let (first, _) = world.moves_and_rests(&mut random)?;
    let (second, picture) = world.moves_and_rests(&mut random)?;
    world.pager.resize_pool(world.pool, 2048, &mut Vec::new()).map_err(|why| why.to_string())?;
    world.converges(&picture)?;
    match world.pager.stats().bias_eighths {
        0 => Ok([first, second]),
        bias => Err(format!("a mip bias of {bias} eighths is left")),
    }
}

/// `VASTEX_WORLDS` says how many random worlds are played, and `VASTEX_FIRST_WORLD` from which one on.
#[test]
fn a_camera_that_rests_uploads_nothing_twice() {
    let of = |name: &str, else_: u64| std::env::var(name).ok().and_then(|n| n.parse().ok()).unwrap_or(else_);
    let (first, worlds) = (of("VASTEX_FIRST_WORLD", 0), of("VASTEX_WORLDS", 60));
    let played: Vec<_> = (first..first + worlds)
        .map(|seed| play(seed).map_err(|why| format!("world {seed}: {why}")))
        .collect();
    let failed: Vec<&String> = played.iter().filter_map(|world| world.as_ref().err()).collect();
    assert!(failed.is_empty(), "{} of {worlds}:\n{:#?}", failed.len(), &failed[..failed.len().min(8)]);
    let rests: Vec<[u64; 2]> = played.into_iter().flatten().flatten().collect();
    let [frames, bias] = [0, 1].map(|what| rests.iter().map(|rest| rest[what]).sum::<u64>());
    println!("{} rests take {frames} frames, at {bias} eighths of a level of mip bias", rests.len());
}

/// Whoever draws asks no more once the view has converged: by then nothing is coarser than it must be.
#[test]
fn a_view_that_has_converged_becomes_no_sharper() {
    let mut coarser = 0;
    for seed in 0..24 {
        let mut random = Random::new(seed);
        let slots = 30 + random.below(200) as u32;
        let mut world = World::new(&mut random, slots);
        let (_, picture) = world.moves_and_rests(&mut random).unwrap();
        let picture = Picture { rays: picture.rays.into_iter().take(20).collect(), ..picture };
        coarser += u32::from(world.pager.stats().bias_eighths > 0);
        world.moves_to(&picture, 4);
        world.pager.set_gap_passes(ViewId::MAIN, PASSES);
        (0..READ_AFTER).for_each(|_| world.frame(&picture));
        while !world.pager.is_view_converged(ViewId::MAIN) {
            world.frame(&picture);
            assert!(world.frame < 100 * CYCLE, "world {seed} does not converge: {:?}", world.pager.stats());
        }
        let bias = world.pager.stats().bias_eighths;
        (0..6 * CYCLE).for_each(|_| world.frame(&picture));
        assert_eq!(world.pager.stats().bias_eighths, bias, "world {seed}");
    }
    assert!(coarser > 5, "{coarser}");
}

/// A texture of 16 pages on its finest level.
fn small() -> Geometry {
    Geometry::new(GeometrySpec { page: 128, ..GeometrySpec::image(512, 512) }).unwrap()
}

/// Pages of a picture, and those above them.
fn pages_of(world: &World, picture: &Picture) -> u64 {
    let needs = picture.rays.iter().flatten();
    let mut pages = BTreeSet::new();
    for need in needs {
        let up = std::iter::successors(Some(need.pos), |pos| world.geometry.parent(*pos));
        pages.extend(up.map(|pos| world.id(pos)));
    }
    pages.len() as u64
}

#[test]
fn what_was_given_up_comes_again_where_less_is_wanted() {
    let (mut coarser, mut missed) = (0, 0);
    for seed in 0..24 {
        let mut random = Random::new(seed);
        let mut world = World::new(&mut random, 64);
        let side = (SIDE * 128) as u32;
        let other = Geometry::new(GeometrySpec { page: 128, ..GeometrySpec::image(side, side) }).unwrap();
        let (other, _) = world.pager.add_texture(world.pool, &other, None, None).unwrap();
        // A picture that fits alone, and not beside what is pinned.
        let picture = Picture::new(&mut random);
        let slots = pages_of(&world, &picture) * 5 / 4 + 8;
        world.pager.resize_pool(world.pool, slots as u32, &mut Vec::new()).unwrap();
        let square = |side: u32| Region::image(0..side * 128, 0..side * 128);
        let mut pins = (1..=SIDE as u32).rev().filter_map(|side| world.pager.pin(other, &square(side)).ok());
        let pinned = pins.next().unwrap();
        world.rests_at(&picture).unwrap();
        let bias = world.pager.stats().bias_eighths;
        coarser += u32::from(bias > 0);
        let given_up = |need: &Need| {
            let page = world.id(need.pos);
            world.uploads.contains_key(&page) && !matches!(world.pager.state(page), PageState::Resident(_))
        };
        missed += u32::from(bias > 0 && picture.rays.iter().flatten().any(given_up));
        match seed % 2 {
            0 => assert!(world.pager.release(pinned)),
            _ => assert!(world.pager.remove_texture(other, world.frame)),
        }
        // Whoever draws only until a view has converged draws on.
        world.begin_frame();
        assert!(bias == 0 || !world.pager.is_view_converged(ViewId::MAIN), "world {seed}: {bias}");
        while !world.pager.is_view_converged(ViewId::MAIN) {
            world.frame(&picture);
            assert!(world.frame < 4 * MOST_FRAMES, "world {seed}: {:?}", world.pager.stats());
        }
        assert_eq!(world.pager.stats().bias_eighths, 0, "world {seed}: before that {bias}");
    }
    assert!(coarser > 12 && missed > 3, "{coarser}, {missed}");
}

#[test]
fn a_texture_that_comes_while_views_rest_finds_a_slot() {
    for seed in 0..60 {
        let mut random = Random::new(seed);
        let slots = 8 + random.below(16) as u32;
        let mut world = World::new(&mut random, slots);
        let picture = Picture::new(&mut random);
        world.pager.set_gap_passes(ViewId::MAIN, PASSES);
        (0..random.below(2 * CYCLE)).for_each(|_| world.frame(&picture));
        let added = world.pager.add_texture(world.pool, &small(), None, None);
        assert!(added.is_ok(), "world {seed}, frame {}: {added:?}", world.frame);
        world.converges(&picture).unwrap();
    }
}

#[test]
fn what_no_view_has_wanted_is_not_given_up() {
    let mut random = Random::new(1);
    let mut world = World::new(&mut random, 220);
    let need = |x: u32, y: u32| Need { pos: PagePos::new_2d(0, x, y), eighth: 0 };
    let mut picture = Picture { rays: (0..64).map(|n| vec![need(n % 8, n / 8)]).collect(), turns: 1 };
    world.rests_at(&picture).unwrap();
    assert_eq!(world.pager.stats().bias_eighths, 0);
    let region = Region::image(1024..2048, 2048..3072);
    let ticket = world.pager.prefetch(world.number, &region, Urgency::default()).unwrap();
    (0..4 * CYCLE).for_each(|_| world.frame(&picture));
    world.pager.release(ticket);
    // Pixels that were not looked at so far want as many pages, for which there is no room beside both.
    picture.rays.extend((0..64).map(|n| vec![need(24 + n % 8, 24 + n / 8)]));
    world.converges(&picture).unwrap();
    let of_first = (8..16).flat_map(|x| (16..24).map(move |y| need(x, y)));
    let gone = of_first.filter(|need| world.pager.state(world.id(need.pos)) == PageState::Absent);
    let gone: Vec<Need> = gone.collect();
    assert!(gone.len() > 8, "{} have made room", gone.len());
    // Another one wants some of them.
    picture.rays.push(gone[..8].to_vec());
    world.converges(&picture).unwrap();
    assert_eq!(world.pager.stats().bias_eighths, 0);
}

/// Pages that were wanted as the view came to rest, and came in the rest, make room for a prefetch: the
/// picture does not become coarser for what nobody sees.
#[test]
fn what_makes_room_for_a_prefetch_comes_again() {
    let square = |left: u32, top: u32| (0..64).map(move |n| PagePos::new_2d(0, left + n % 8, top + n / 8));
    let need = |pos| Need { pos, eighth: 0 };
    let pages: Vec<PagePos> = square(24, 0).collect();
    let mut played = 0;
    for seed in 0..16 {
        let mut world = World::new(&mut Random::new(seed), 220);
        world.latency = CYCLE / 2;
        // As many frames as it moves, as many rays are looked at, with four pages each.
        let passing = pages.chunks(4).map(|pages| pages.iter().copied().map(need).collect()).collect();
        world.moves_to(&Picture { rays: passing, turns: 1 }, CYCLE / 2);
        let mut picture = Picture { rays: square(0, 0).map(|pos| vec![need(pos)]).collect(), turns: 1 };
        world.rests_at(&picture).unwrap();
        assert_eq!(world.pager.stats().bias_eighths, 0);
        let came = world.uploads.clone();
        // All that the view leaves room for.
        let region = Region::image(0..1280, 2048..3328);
        let ticket = world.pager.prefetch(world.number, &region, Urgency::default()).unwrap();
        (0..16 * CYCLE).for_each(|_| world.frame(&picture));
        world.pager.release(ticket);
        let has_gone =
            |page: &PageId| came.contains_key(page) && world.pager.state(*page) == PageState::Absent;
        let gone: Vec<Need> =
            pages.iter().copied().filter(|pos| has_gone(&world.id(*pos))).map(need).collect();
        if gone.len() >= 8 {
            picture.rays.push(gone[..8].to_vec());
            world.converges(&picture).unwrap();
            assert_eq!(world.pager.stats().bias_eighths, 0, "world {seed}");
            played += 1;
        }
    }
    assert!(played >= 4, "{played}");
}

/// A prefetch is asked for before it is known what the views want at rest, and nothing is drawn from then on.
#[test]
fn pages_of_a_prefetch_do_not_push_one_another_out() {
    for seed in 0..60 {
        let mut random = Random::new(seed);
        let slots = 12 + random.below(100) as u32;
        let mut world = World::new(&mut random, slots);
        for frames in [random.below(8 * CYCLE), random.below(6)] {
            let picture = Picture::new(&mut random);
            world.moves_to(&picture, frames);
        }
        let picture = Picture::new(&mut random);
        world.pager.set_gap_passes(ViewId::MAIN, PASSES);
        (0..3 + random.below(CYCLE - 3)).for_each(|_| world.frame(&picture));
        for _ in 0..3 {
            let [x, y] = [(); 2].map(|()| random.below(SIDE - 4) as u32 * 128);
            let region = Region::image(x..x + 384, y..y + 384);
            // A pool may be too small for it.
            let _ = world.pager.prefetch(world.number, &region, Urgency::default());
        }
        (0..20 * CYCLE).for_each(|_| world.frame_of(&[]));
        world.uploads.clear();
        (0..4 * CYCLE).for_each(|_| world.frame_of(&[]));
        assert!(world.uploads.is_empty(), "world {seed}: {:?}", world.uploads);
    }
}

#[test]
fn where_a_view_goes_the_other_becomes_sharper() {
    let mut coarser = 0;
    for seed in 0..24 {
        let mut random = Random::new(seed);
        let mut world = World::new(&mut random, 64);
        let other = world.pager.add_view(1.0).unwrap();
        // Two pictures that each fit alone, and not beside one another.
        let pictures = [(); 2].map(|()| Picture::new(&mut random));
        let slots = pictures.iter().map(|picture| pages_of(&world, picture)).max().unwrap() * 5 / 4 + 8;
        world.pager.resize_pool(world.pool, slots as u32, &mut Vec::new()).unwrap();
        let views = [ViewId::MAIN, other];
        for (view, picture) in views.iter().zip(&pictures) {
            world.pager.set_view_turns(*view, picture.turns as u32);
            world.pager.set_gap_passes(*view, PASSES);
        }
        let both: Vec<_> = views.iter().copied().zip(&pictures).collect();
        let has_both = |world: &World| views.iter().all(|view| world.pager.is_view_converged(*view));
        while !has_both(&world) {
            world.frame_of(&both);
            assert!(world.frame < 4 * MOST_FRAMES, "world {seed}: {:?}", world.pager.stats());
        }
        let bias = world.pager.stats().bias_eighths;
        coarser += u32::from(bias > 0);
        assert!(world.pager.remove_view(other));
        world.begin_frame();
        assert!(bias == 0 || !world.pager.is_view_converged(ViewId::MAIN), "world {seed}: {bias}");
        while !world.pager.is_view_converged(ViewId::MAIN) {
            world.frame(&pictures[0]);
            assert!(world.frame < 8 * MOST_FRAMES, "world {seed}: {:?}", world.pager.stats());
        }
        assert_eq!(world.pager.stats().bias_eighths, 0, "world {seed}: before that {bias}");
    }
    assert!(coarser > 8, "{coarser}");
}

/// A view that is said to move and is hidden is not waited for, for ever: what it had found makes room for a
/// prefetch, and the other view, which shows it as well, looks again.
#[test]
fn a_view_that_is_hidden_keeps_no_other_from_looking_again() {
    let mut random = Random::new(3);
    let mut world = World::new(&mut random, 64);
    let hidden = world.pager.add_view(1.0).unwrap();
    let picture = Picture::new(&mut random);
    let slots = pages_of(&world, &picture) * 5 / 4 + 100;
    world.pager.resize_pool(world.pool, slots as u32, &mut Vec::new()).unwrap();
    for view in [hidden, ViewId::MAIN] {
        world.pager.set_view_turns(view, picture.turns as u32);
        world.pager.set_gap_passes(view, PASSES);
        while !world.pager.is_view_converged(view) {
            world.frame_of(&[(view, &picture)]);
            assert!(world.frame < MOST_FRAMES, "{:?}", world.pager.stats());
        }
    }
    world.pager.set_gap_passes(hidden, 0);
    world.frame_of(&[(ViewId::MAIN, &picture)]);
    let is_lacking = |world: &World| picture.rays.iter().flatten().any(|need| world.lacks(need));
    for nth in 0..16 {
        let column = nth % 4 * 1024;
        let region = Region::image(column..column + 1024, nth / 4 * 1024..nth / 4 * 1024 + 1024);
        let ticket = world.pager.prefetch(world.number, &region, Urgency::default()).unwrap();
        (0..2 * CYCLE).for_each(|_| world.frame_of(&[]));
        world.pager.release(ticket);
    }
    assert!(is_lacking(&world), "nothing has made room");
    assert!(!world.pager.is_view_converged(ViewId::MAIN));
    world.converges(&picture).unwrap();
}

/// Two cameras over one pool: after both were at one place the first rests there, and the other moves on and
/// rests elsewhere; each is drawn only while it has not all, as in the viewer. Then the other is gone. Gives
/// how many frames it takes each time until all is there for every ray.
fn play_two(seed: u64) -> Result<[u64; 2], String> {
    let mut random = Random::new(seed);
    let slots = 20 + random.below(100) as u32;
    let mut world = World::new(&mut random, slots);
    let views = [ViewId::MAIN, world.pager.add_view(1.0).map_err(|why| why.to_string())?];
    let (at, spread) = Picture::place(&mut random);
    for _ in 0..2 * CYCLE {
        let [first, second] = [(); 2].map(|()| Picture::of(&mut random, at, spread));
        world.frame_of(&[(views[0], &first), (views[1], &second)]);
    }
    let pictures = [Picture::of(&mut random, at, spread), Picture::new(&mut random)];
    let moves_for = [0, random.below(6 * CYCLE)];
    for (view, picture) in views.iter().zip(&pictures) {
        world.pager.set_view_turns(*view, picture.turns as u32);
    }
    let mut frames = [0; 2];
    for (of, frames) in [2, 1].into_iter().zip(&mut frames) {
        if of == 1 {
            world.pager.remove_view(views[1]);
        }
        let (mut idle, mut converged_for) = (0, 0);
        while converged_for < 4 * CYCLE {
            let has_all = |world: &World, nth: usize| world.pager.is_view_converged(views[nth]);
            let is_moving = |nth: usize| of == 2 && *frames < moves_for[nth];
            let mut drawn = Vec::new();
            for (nth, view) in views.iter().enumerate().take(of) {
                world.pager.set_gap_passes(*view, if is_moving(nth) { 0 } else { PASSES });
                if is_moving(nth) {
                    drawn.push((*view, Picture::new(&mut random)));
                }
            }
            let resting = (0..of).filter(|nth| !is_moving(*nth));
            let asks = resting.filter(|nth| !has_all(&world, *nth));
            let asking: Vec<_> = asks.map(|nth| (views[nth], &pictures[nth])).collect();
            let moving = drawn.iter().map(|(view, picture)| (*view, picture));
            world.frame_of(&moving.chain(asking).collect::<Vec<_>>());
            let all_have = (0..of).all(|nth| !is_moving(nth) && has_all(&world, nth));
            converged_for = if all_have { converged_for + 1 } else { 0 };
            *frames += 1;
            if *frames == moves_for[1] * u64::from(of == 2) + READ_AFTER as u64 {
                world.uploads.clear();
            }
            idle += u64::from(world.coming.is_empty());
            if idle > MOST_FRAMES + moves_for[1] || *frames > MOST_OF_ALL {
                return Err(format!("does not converge: {:?}", world.pager.stats()));
            }
        }
        *frames -= converged_for;
        let twice = world.uploads.values().filter(|uploads| **uploads > 1).count();
        if twice > 0 {
            return Err(format!("{twice} of {} pages uploaded twice, with {of}", world.uploads.len()));
        }
        for (nth, picture) in pictures.iter().enumerate().take(of) {
            let lacking = picture.rays.iter().flatten().filter(|need| world.lacks(need)).count();
            if lacking > 0 {
                return Err(format!("{lacking} needs of {nth} of {of} lack: {:?}", world.pager.stats()));
            }
        }
    }
    Ok([frames[0] - moves_for[1], frames[1]])
}

/// `VASTEX_WORLDS` says how many random worlds are played.
#[test]
fn two_cameras_that_rest_have_all_that_their_rays_need() {
    let worlds = std::env::var("VASTEX_WORLDS").ok().and_then(|n| n.parse().ok()).unwrap_or(60);
    let played: Vec<_> =
        (0..worlds).map(|seed| play_two(seed).map_err(|why| format!("world {seed}: {why}"))).collect();
    let failed: Vec<&String> = played.iter().filter_map(|world| world.as_ref().err()).collect();
    assert!(failed.is_empty(), "{} of {worlds}:\n{:#?}", failed.len(), &failed[..failed.len().min(8)]);
    let frames = [0, 1].map(|nth| played.iter().flatten().map(|frames| frames[nth]).sum::<u64>());
    println!("{worlds} worlds take {frames:?} frames");
}
