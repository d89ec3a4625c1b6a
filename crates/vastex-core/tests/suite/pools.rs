//! Several pools in the simulated world: what must hold of all of them together.
//!
//! `Crowd::step` itself checks the joint budgets, the evictions and every page table at every frame.
//! `VASTEX_WORLDS` says how many random worlds are played, `VASTEX_FIRST_WORLD` with which it begins.

use vastex_core::sim::{Crowd, Path, Random, Watch, contents_of_chance};
use vastex_core::{
    BiasRule, Budgets, Event, Geometry, GeometrySpec, GroupError, GroupNumber, LevelRule, MAX_VIEWS, Pager,
    PoolError, PoolId, Region, TextureNumber, TicketState, Urgency, ViewId,
};

const BUDGETS: Budgets = Budgets { upload_bytes_per_frame: 2000, in_flight_bytes: 20_000 };

fn image(page: u32) -> GeometrySpec {
    GeometrySpec { page, ..GeometrySpec::image(16384, 8192) }
}

/// Pools of small, middling and large tiles, with a texture in the first and two in the others.
fn three_pools(slots: [u32; 3], budgets: Budgets) -> Crowd {
    let mut crowd = Crowd::new(budgets, [320, 180], 1);
    for (slots, (page, tile_bytes)) in slots.into_iter().zip([(64, 100), (128, 400), (256, 1600)]) {
        let pool = crowd.add_pool(slots, tile_bytes, Some(BiasRule::Solved)).unwrap();
        crowd.add(pool, image(page), Path::Still).unwrap();
        if page > 64 {
            crowd.add(pool, image(page), Path::Spin).unwrap();
        }
    }
    crowd
}

fn run_until_converged(crowd: &mut Crowd, limit: u64) -> u64 {
    for frames in 1..=limit {
        crowd.step().unwrap();
        if crowd.pager.is_converged() {
            return frames;
        }
    }
    panic!("not converged after {limit} frames: {:?}", crowd.pager.stats());
}

#[test]
fn every_pool_converges_and_it_is_said_once() {
    let mut crowd = three_pools([400, 400, 400], BUDGETS);
    crowd.hold();
    run_until_converged(&mut crowd, 400);
    (0..50).for_each(|_| crowd.step().unwrap());
    let converged = crowd.events.iter().filter(|(_, event)| matches!(event, Event::Converged { .. }));
    assert_eq!(converged.count(), 1);
    let stats = crowd.pager.stats();
    assert_eq!((stats.missing, stats.in_flight, stats.tails), (0, 0, 5), "{stats:?}");
    let numbers: Vec<u16> = crowd.textures().map(|texture| texture.number()).collect();
    assert_eq!(numbers, [0, 1, 2, 3, 4], "unique over all pools");
}

#[test]
fn only_the_pool_that_is_too_small_becomes_coarser_and_is_named() {
    let mut crowd = three_pools([400, 12, 400], BUDGETS);
    crowd.hold();
    run_until_converged(&mut crowd, 400);
    let biases: Vec<bool> = crowd.pager.pools().map(|pager| pager.bias_eighths() > 0).collect();
    assert_eq!(biases, [false, true, false]);
    let named = crowd.events.iter().filter_map(|(_, event)| match event {
        Event::Oversubscribed { pool, slots, .. } => Some((pool.number(), *slots)),
        _ => None,
    });
    assert!(named.clone().count() > 0 && named.clone().all(|named| named == (1, 12)));
}

#[test]
fn pools_that_have_something_to_upload_get_the_same_bytes() {
    // Every pool misses more bytes than may be uploaded in these frames.
    let mut crowd = three_pools([2000, 2000, 2000], Budgets { upload_bytes_per_frame: 900, ..BUDGETS });
    crowd.loads.tiles_per_frame = usize::MAX;
    (0..20).for_each(|_| crowd.step().unwrap());
    let uploaded: Vec<u64> = crowd.pager.pools().map(|pager| pager.stats().uploaded_bytes).collect();
    let (least, most) = (uploaded.iter().min().unwrap(), uploaded.iter().max().unwrap());
    assert!(*least > 3000 && most - least <= 2 * 1600, "{uploaded:?}");
}

#[test]
fn budgets_below_one_tile_still_get_there() {
    let mut crowd = three_pools([300, 300, 300], Budgets { upload_bytes_per_frame: 300, in_flight_bytes: 1 });
    crowd.hold();
    run_until_converged(&mut crowd, 4000);
}

#[test]
fn a_pool_whose_bias_may_not_act_does_not_hold_up_the_others() {
    let mut crowd = Crowd::new(Budgets { in_flight_bytes: 3200, ..BUDGETS }, [320, 180], 1);
    let stuck = crowd.add_pool(6, 1600, None).unwrap();
    let ample = crowd.add_pool(400, 400, Some(BiasRule::Solved)).unwrap();
    crowd.add(stuck, image(128), Path::Spin).unwrap();
    crowd.add(ample, image(128), Path::Spin).unwrap();
    (0..100).for_each(|_| crowd.step().unwrap());
    crowd.hold();
    (0..100).for_each(|_| crowd.step().unwrap());
    let [full, done] = [stuck, ample].map(|pool| crowd.pager.pool(pool));
    assert!(full.stats().missing > 0 && full.stats().in_flight == 0, "{:?}", full.stats());
    assert!(done.is_converged() && done.bias_eighths() == 0, "{:?}", done.stats());
    assert!(!crowd.pager.is_converged());
}

#[test]
fn numbers_run_out_over_all_pools() {
    let mut pager = Pager::new(BUDGETS);
    let pools: Vec<PoolId> =
        (0..2).map(|_| pager.add_pool(2000, 1, Some(BiasRule::Solved)).unwrap()).collect();
    let tiny = Geometry::new(GeometrySpec::image(1, 1)).unwrap();
    for nth in 0..2047 {
        let (texture, _) = pager.add_texture(pools[nth % 2], &tiny, None, None).unwrap();
        assert_eq!(pager.pool_of(texture), Some(pools[nth % 2]));
    }
    assert!(!pager.has_free_number());
    assert_eq!(pager.add_texture(pools[0], &tiny, None, None), Err(PoolError::TooManyTextures));
    assert_eq!(pager.stats().occupied, 2047);
}

#[test]
fn a_removed_texture_leaves_its_pool_and_its_number_rests() {
    let mut crowd = three_pools([400, 400, 400], BUDGETS);
    (0..30).for_each(|_| crowd.step().unwrap());
    crowd.loads.latency_frames = 10;
    let gone = crowd.textures().nth(1).unwrap();
    let pool = crowd.pager.pool_of(gone).unwrap();
    let before = crowd.pager.pool(pool).stats();
    crowd.remove(gone).unwrap();
    let after = crowd.pager.pool(pool).stats();
    assert!(after.occupied < before.occupied && after.tails == before.tails - 1, "{before:?} {after:?}");
    assert!(crowd.pager.pool(pool).resident().all(|(page, _)| page.texture() != gone));
    assert_eq!(crowd.pager.pool_of(gone), None);
    // Feedback of the frames before is under way: the next texture has another number.
    let next = crowd.add(pool, image(128), Path::Still).unwrap();
    assert_eq!(next.number(), 5);
    crowd.hold();
    run_until_converged(&mut crowd, 400);
    assert_eq!(crowd.add(pool, image(128), Path::Fly).unwrap(), gone, "nothing names the old one any more");
    crowd.loads.latency_frames = 1;
    run_until_converged(&mut crowd, 400);
}

#[test]
fn a_pool_that_was_full_has_room_after_a_removal() {
    let mut crowd = three_pools([400, 12, 400], BUDGETS);
    crowd.hold();
    run_until_converged(&mut crowd, 400);
    let coarse = crowd.pager.pool(PoolId::new(1)).bias_eighths();
    let second = crowd.textures().nth(2).unwrap();
    crowd.remove(second).unwrap();
    (0..100).for_each(|_| crowd.step().unwrap());
    let pager = crowd.pager.pool(PoolId::new(1));
    assert!(pager.bias_eighths() < coarse && crowd.pager.is_converged(), "{:?}", pager.stats());
}

#[test]
fn a_pool_grows_and_shrinks_and_keeps_what_is_in_view() {
    let mut crowd = three_pools([400, 400, 400], BUDGETS);
    let pool = PoolId::new(1);
    crowd.hold();
    run_until_converged(&mut crowd, 400);
    let before = crowd.pager.pool(pool).stats();
    assert!(before.occupied < 300 && before.bias_eighths == 0, "{before:?}");
    // To a little more than it needs, then to a lot: nothing is loaded for it.
    for slots in [before.occupied * 5 / 4, 1000] {
        assert!(crowd.resize(pool, slots).unwrap());
        (0..40).for_each(|_| crowd.step().unwrap());
        let after = crowd.pager.pool(pool).stats();
        assert_eq!((after.slots, after.bias_eighths, after.loaded), (slots, 0, before.loaded), "{after:?}");
    }
    // To a fifth: coarser at once, and sharp again once there is room.
    assert!(crowd.resize(pool, before.occupied / 5).unwrap());
    let small = crowd.pager.pool(pool).stats();
    assert!(small.bias_eighths > 0 && small.occupied <= before.occupied / 5, "{small:?}");
    run_until_converged(&mut crowd, 100);
    assert!(crowd.resize(pool, 400).unwrap());
    (0..100).for_each(|_| crowd.step().unwrap());
    let again = crowd.pager.pool(pool).stats();
    assert_eq!((again.bias_eighths, again.occupied, again.missing), (0, before.occupied, 0), "{again:?}");
}

#[test]
fn a_pool_does_not_shrink_below_its_pins() {
    let mut crowd = three_pools([400, 400, 400], BUDGETS);
    let (pool, texture) = (PoolId::new(1), crowd.textures().nth(1).unwrap());
    assert!(!crowd.resize(pool, 2).unwrap(), "two tails, and nothing to work with");
    assert!(crowd.resize(pool, 3).unwrap());
    assert!(crowd.resize(pool, 400).unwrap());
    let region = Region::image(0..16384, 0..8192).on_levels(3..=3);
    let ticket = crowd.ask(texture, &region, None).unwrap();
    (0..100).for_each(|_| crowd.step().unwrap());
    // With the two tails, four fifths of 215 slots.
    let pinned = 16 * 8 + 8 * 4 + 4 * 2 + 2;
    assert_eq!(crowd.pager.progress(ticket).unwrap().pages, pinned);
    for (slots, is_enough) in [(150, false), (214, false), (215, true), (260, true)] {
        assert_eq!(crowd.resize(pool, slots).unwrap(), is_enough, "{slots}");
        (0..20).for_each(|_| crowd.step().unwrap());
    }
    let error = crowd.pager.resize_pool(pool, 150, &mut Vec::new()).unwrap_err();
    assert!(matches!(error, PoolError::TooSmall { slots: 150, .. }), "{error}");
}

/// A world of several pools in which everything is left to chance. Gives how the tickets ended, and how many
/// tiles were refreshed.
fn random_crowd(seed: u64) -> Result<(Vec<TicketState>, u64), String> {
    let mut random = Random::new(seed);
    let budgets =
        Budgets { upload_bytes_per_frame: 20 + random.below(3000), in_flight_bytes: random.below(20_000) };
    let screen = [80 + random.below(200) as u32, 40 + random.below(100) as u32];
    let mut crowd = Crowd::new(budgets, screen, seed);
    crowd.loads.latency_frames = random.below(10);
    crowd.loads.tiles_per_frame = 1 + random.below(40) as usize;
    // Not of the same chance, so that the rest of each crowd is as it would be.
    let mut lanes = Random::new(seed ^ 0x1a4e5);
    crowd.loads.lanes =
        [1 + lanes.below(4), 4 + lanes.below(30), 64, u64::MAX][lanes.below(4) as usize] as usize;
    (crowd.loads.failing, crowd.loads.slow) = if random.chance(0.5) { (0.2, 0.2) } else { (0.0, 0.0) };
    let pools = 1 + random.below(5);
    let mut pages = Vec::new();
    for _ in 0..pools {
        let [tile_bits, slot_bits] = [random.below(12), 2 + random.below(7)];
        let (tile_bytes, slots) = (1 + random.below(1 << tile_bits), 2 + random.below(1 << slot_bits) as u32);
        let pool =
            crowd.add_pool(slots, tile_bytes, Some(BiasRule::Solved)).map_err(|error| error.to_string())?;
        let page = 16 + random.below(200) as u32;
        pages.push(page);
        for _ in 0..1 + random.below(4) {
            add_at_random(&mut crowd, &mut random, seed, pool, page)?;
        }
    }
    // Of its own, so that the worlds without groups are as they would be.
    let mut groups = (seed % 3 == 1).then(|| Random::new(!seed));
    // Likewise the worlds without views beside the main one.
    let mut views = Random::new(seed.rotate_left(32));
    let mut sizes = (seed % 5 == 2).then(|| Random::new(!seed));
    for _ in 0..80 {
        crowd.step()?;
        if let Some(random) = &mut groups
            && random.chance(0.1)
        {
            group_at_random(&mut crowd, random)?;
        }
        if seed % 2 == 1 && random.chance(0.15) {
            let pool = PoolId::new(random.below(pools) as u16);
            change_at_random(&mut crowd, &mut random, seed, pool, &pages)?;
        }
        if seed % 4 > 1 && random.chance(0.3) {
            ask_at_random(&mut crowd, &mut random)?;
        }
        if seed % 8 == 7 && random.chance(0.03) {
            crowd.lose_device();
        }
        if seed % 3 != 2 && views.chance(0.1) {
            change_views_at_random(&mut crowd, &mut views);
        }
        if let Some(random) = &mut sizes
            && random.chance(0.08)
        {
            let (pool, bits) = (PoolId::new(random.below(pools) as u16), random.below(9));
            crowd.resize(pool, random.below(1 << bits) as u32)?;
        }
    }
    // Whatever has gone wrong before, views that are held and a loader that is well again come to rest.
    crowd.hold();
    (crowd.loads.failing, crowd.loads.slow) = (0.0, 0.0);
    for _ in 0..40_000 {
        crowd.step()?;
        let stats = crowd.pager.stats();
        let at_rest = stats.in_flight == 0 && stats.missing + stats.failed == 0;
        if at_rest && crowd.loads_under_way() == 0 && crowd.pager.is_converged() && crowd.is_up_to_date() {
            let open: Vec<_> = crowd.tickets.iter().copied().collect();
            open.into_iter().try_for_each(|ticket| crowd.release(ticket))?;
            let ended = crowd.ended.iter().map(|(_, progress)| progress.state).collect();
            let all = crowd.tickets.is_empty();
            return if all { Ok((ended, stats.refreshed)) } else { Err("a ticket has not ended".into()) };
        }
    }
    Err(format!("not at rest: {:?}", crowd.pager.stats()))
}

/// Adds a view beside the main one, removes one, or lets one pause or look elsewhere, which it may declare.
fn change_views_at_random(crowd: &mut Crowd, random: &mut Random) {
    let watch = Watch { ahead: random.below(200), every: random.below(6) };
    let views: Vec<ViewId> = crowd.views_beside().collect();
    match views.get(random.below(1 + views.len() as u64) as usize) {
        None => {
            let weight = 2f32.powi(random.below(20) as i32 - 10);
            assert_eq!(crowd.add_view(weight, watch).is_err(), views.len() + 1 == MAX_VIEWS);
        }
        Some(&view) if random.chance(0.3) => crowd.remove_view(view),
        Some(&view) => crowd.change_view(view, watch, random.chance(0.5)),
    }
}

/// Removes a texture, or adds one to a pool.
fn change_at_random(
    crowd: &mut Crowd,
    random: &mut Random,
    seed: u64,
    pool: PoolId,
    pages: &[u32],
) -> Result<(), String> {
    let textures: Vec<TextureNumber> = crowd.textures().collect();
    if textures.is_empty() || random.chance(0.5) {
        return add_at_random(crowd, random, seed, pool, pages[usize::from(pool.number())]);
    }
    crowd.remove(textures[random.below(textures.len() as u64) as usize])
}

/// Makes a group of textures of any pools, which have a clamp and bias of chance, or takes one apart.
fn group_at_random(crowd: &mut Crowd, random: &mut Random) -> Result<(), String> {
    let groups: Vec<GroupNumber> = crowd.groups().collect();
    if let Some(&group) = groups.get(random.below(2 * groups.len() as u64 + 1) as usize) {
        return crowd.ungroup(group);
    }
    let members: Vec<TextureNumber> = crowd.textures().filter(|_| random.chance(0.4)).collect();
    for &member in &members {
        if random.chance(0.7) {
            continue;
        }
        let bias = random.below(33) as f32 / 8.0 - 2.0;
        let (finest, coarsest) = (random.below(4) as u8, random.below(12) as u8);
        crowd.pager.set_levels(member, LevelRule { bias, finest, coarsest });
    }
    match crowd.group(&members, Path::ALL[random.below(5) as usize]) {
        Ok(_) | Err(GroupError::Empty) => Ok(()),
        Err(error) => Err(error.to_string()),
    }
}

/// Prefetches, pins, lets go of a ticket, expects a view, or changes the content of a texture.
fn ask_at_random(crowd: &mut Crowd, random: &mut Random) -> Result<(), String> {
    let textures: Vec<TextureNumber> = crowd.textures().collect();
    let Some(&texture) = textures.get(random.below(1 + textures.len() as u64) as usize) else {
        return Ok(());
    };
    let mut side = || 1 + random.below(1 << 4) as u32 * random.below(1 << 10) as u32;
    let (x, y, width, height) = (side() / 2, side() / 2, side(), side());
    let levels = random.below(6) as u8;
    let region =
        Region::image(x..x + width, y..y + height).on_levels(levels..=levels + random.below(4) as u8);
    match random.below(5) {
        4 => crowd.expect(texture, crowd.frame + random.below(50)),
        0 => {
            let _may_be_refused = crowd.ask(texture, &region, None);
        }
        1 => crowd.change(texture, &region),
        2 => {
            let open: Vec<_> = crowd.tickets.iter().copied().collect();
            let Some(&ticket) = open.get(random.below(1 + open.len() as u64) as usize) else { return Ok(()) };
            return crowd.release(ticket);
        }
        _ => {
            let deadline = random.chance(0.5).then(|| crowd.frame + random.below(60));
            let urgency = Urgency { priority: random.below(3) as i32 - 1, deadline };
            let _may_be_refused = crowd.ask(texture, &region, Some(urgency));
        }
    }
    Ok(())
}

/// A texture of chance; a pool that is too small for it says so and is left as it was. In some crowds pages
/// of a texture, and of several in a pool, have the same content.
fn add_at_random(
    crowd: &mut Crowd,
    random: &mut Random,
    seed: u64,
    pool: PoolId,
    page: u32,
) -> Result<(), String> {
    let mut side = || 1 + random.below(1 << 4) as u32 * random.below(1 << 10) as u32;
    let (width, height) = (side(), side());
    let path = Path::ALL[random.below(5) as usize];
    let spec = GeometrySpec { page, ..GeometrySpec::image(width, height) };
    let share = [0.9, 0.0, 0.0, 0.4, 0.0][(seed % 5) as usize];
    let place = seed ^ u64::from(width) << 32 ^ u64::from(height);
    let contents = |geometry: &Geometry| (share > 0.0).then(|| contents_of_chance(geometry, place, share));
    match crowd.add_with(pool, spec, path, contents) {
        Ok(_) | Err(PoolError::TooSmall { .. } | PoolError::AllInView { .. }) => Ok(()),
        Err(error) => Err(error.to_string()),
    }
}

/// Crowds that are played where nothing says how many. Faults were found by crowds 554 to 5870 of campaigns,
/// each of which is a test of its own below; the first hundreds are there for what is broken anew.
const CROWDS: u64 = 200;

/// Where a search for a crowd that does not hold goes on.
fn first_world() -> u64 {
    std::env::var("VASTEX_FIRST_WORLD").ok().and_then(|n| n.parse().ok()).unwrap_or(0)
}

/// Plays the crowds of these seeds, and says what their tickets ended as and how many tiles were refreshed.
fn play_crowds(seeds: impl Iterator<Item = u64>) -> (Vec<TicketState>, u64) {
    let (mut ended, mut refreshed) = (Vec::new(), 0);
    for seed in seeds {
        let played = std::panic::catch_unwind(|| random_crowd(seed));
        let played = played.unwrap_or_else(|_| Err("it panicked, as told above".into()));
        let (states, tiles) = played.unwrap_or_else(|why| panic!("crowd {seed}: {why}"));
        ended.extend(states);
        refreshed += tiles;
    }
    (ended, refreshed)
}

#[test]
fn random_crowds_hold_together() {
    let worlds = std::env::var("VASTEX_WORLDS").ok().and_then(|n| n.parse().ok()).unwrap_or(CROWDS);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let played: Vec<_> = std::thread::scope(|scope| {
        let seeds = |first: usize| (first_world()..worlds).skip(first).step_by(threads);
        let play = |first| scope.spawn(move || play_crowds(seeds(first)));
        let playing: Vec<_> = (0..threads).map(play).collect();
        playing.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(played.iter().any(|(_, refreshed)| *refreshed > 0));
    for state in [TicketState::Done, TicketState::Late, TicketState::Released] {
        let is_among = played.iter().any(|(ended, _)| ended.contains(&state));
        assert!(is_among, "nothing ended as {state:?}, so nothing was tried");
    }
}

/// New tiles for every page out of view had come when the view needed a slot, and waited for their turn after
/// it.
#[test]
fn a_view_gets_its_slot_where_all_others_are_being_refreshed() {
    random_crowd(554).unwrap();
}

/// A tile that came ahead of the view had lost its slot in the frame in which it got it.
#[test]
fn what_was_loaded_in_a_frame_is_not_evicted_in_it() {
    random_crowd(1706).unwrap();
}

/// Pins that shared a few slots, as many as might be pinned, got content of their own and had no room.
#[test]
fn pins_fit_when_their_contents_change() {
    random_crowd(4370).unwrap();
}

/// A pool had no slot for a page of a prefetch whose content had changed, and which stayed for pages below it
/// that were held, too.
#[test]
fn a_prefetch_gives_up_what_has_changed_and_has_no_room() {
    random_crowd(5870).unwrap();
}

/// All that shared a slot with a page whose content had changed were evicted for a slot of its own, and the
/// old one was lost.
#[test]
fn a_slot_is_free_when_the_last_has_moved_out_of_it() {
    random_crowd(1798).unwrap();
}
