//! A camera that rests: whatever was there before and however small the pool is, no tile is uploaded twice
//! while it rests, and every ray has what it needs at the mip bias that this takes.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use vastex_core::shader_constants::JITTER_CYCLE;
use vastex_core::sim::Random;
use vastex_core::{
    BiasRule, Budgets, Dims, Feedback, Geometry, GeometrySpec, PageId, PagePos, PageState, Pager, PoolId,
    Region, TextureNumber, Urgency, ViewId, WantedPage,
};

const CYCLE: u64 = JITTER_CYCLE as u64;
/// Feedbacks that look at all pixels.
const PASSES: u32 = 8;
/// Pages of level 0 along a side, and rays of a picture.
const SIDE: u64 = 32;
const RAYS: u64 = 240;
/// Frames after which feedback is read.
const READ_AFTER: usize = 2;
const TILE: usize = 100;
/// Frames in which a camera that rests has all, without those in which something is on its way to it.
const MOST_FRAMES: u64 = 1000;
/// All frames in which it has all, whatever is on its way.
const MOST_OF_ALL: u64 = 10 * MOST_FRAMES;

/// What a ray needs: a page, and the part of a level from it on that is wanted, in eighths.
#[derive(Clone, Copy)]
struct Need {
    pos: PagePos,
    eighth: u8,
}

/// What the rays of a picture need, and in how many cycles feedback names all that those of its pixels do.
struct Picture {
    rays: Vec<Vec<Need>>,
    turns: u64,
}

impl Picture {
    /// Rays somewhere, each of some pages.
    fn new(random: &mut Random) -> Picture {
        let (at, spread) = Picture::place(random);
        Picture::of(random, at, spread)
    }

    /// Where rays may go, and how far apart.
    fn place(random: &mut Random) -> ([u64; 2], u64) {
        ([(); 2].map(|()| random.below(SIDE)), 1 + random.below(SIDE / 2))
    }

    fn of(random: &mut Random, at: [u64; 2], spread: u64) -> Picture {
        let most = 1 + random.below(12);
        let mut need = || {
            let [x, y] = at.map(|at| (at + random.below(spread)).min(SIDE - 1));
            let level = random.below(3).saturating_sub(1) as u8;
            let pos = PagePos::new_2d(level, (x >> level) as u32, (y >> level) as u32);
            Need { pos, eighth: random.below(8) as u8 }
        };
        let rays = (0..RAYS).map(|_| (0..most).map(|_| need()).collect()).collect();
        Picture { rays, turns: 1 + random.below(4) }
    }
}

struct World {
    pager: Pager,
    geometry: Geometry,
    pool: PoolId,
    number: TextureNumber,
    frame: u64,
    /// What is on its way, and in which frame it comes.
    coming: VecDeque<(u64, PageId)>,
    latency: u64,
    /// Feedback that was not read yet, of all views that were drawn in a frame.
    drawn: VecDeque<Vec<Feedback>>,
    /// How often the tile of each page was uploaded.
    uploads: BTreeMap<PageId, u32>,
}

impl World {
    fn new(random: &mut Random, slots: u32) -> World {
        let budgets = Budgets {
            upload_bytes_per_frame: TILE as u64 * (1 + random.below(8)),
            in_flight_bytes: TILE as u64 * (1 + random.below(32)),
        };
        let mut pager = Pager::new(budgets);
        let side = (SIDE * 128) as u32;
        let geometry = Geometry::new(GeometrySpec { page: 128, ..GeometrySpec::image(side, side) }).unwrap();
        let pool = pager.add_pool(slots, TILE as u64, Some(BiasRule::Solved)).unwrap();
        let (number, _) = pager.add_texture(pool, &geometry, None, None).unwrap();
        let (coming, drawn, uploads) = (VecDeque::new(), VecDeque::new(), BTreeMap::new());
        let (frame, latency) = (0, random.below(6));
        World { pager, geometry, pool, number, frame, coming, latency, drawn, uploads }
    }

    fn id(&self, pos: PagePos) -> PageId {
        PageId::new(self.number, Dims::D2, pos).unwrap()
    }

    /// Returns true if what a ray needs is not there at the level that the bias leaves of it.
    fn lacks(&self, need: &Need) -> bool {
        let eighths = u32::from(need.pos.level) * 8
            + u32::from(need.eighth)
            + u32::from(self.pager.stats().bias_eighths);
        let level = (eighths / 8).min(u32::from(self.geometry.tail().first_level())) as u8;
        let shown = self.geometry.ancestor(need.pos, level);
        level < self.geometry.tail().first_level()
            && !matches!(self.pager.state(self.id(shown)), PageState::Resident(_))
    }

    /// What a frame names: where gaps are looked for, of an eighth of the rays something that each lacks;
    /// else what a quarter of all rays needs in a cycle, and of each of them a part by turns.
    fn named(&self, picture: &Picture, seeks: bool) -> Vec<Need> {
        let rays = || (0..).zip(&picture.rays);
        let (frame, passes) = (self.frame, u64::from(PASSES));
        match seeks {
            true => {
                let over = frame / passes % u64::from(self.pager.gaps_by_turns(ViewId::MAIN));
                let lacked = |ray: &Vec<Need>| {
                    ray.iter().filter(|need| self.lacks(need)).take(over as usize + 1).last().copied()
                };
                let looked_at = rays().filter(|(n, _)| n % passes == frame % passes);
                looked_at.filter_map(|(_, ray)| lacked(ray)).collect()
            }
            false => {
                let looked_at = rays().filter(|(n, _)| n % (4 * CYCLE) == frame % CYCLE);
                let turn = (frame / CYCLE % picture.turns) as usize;
                let of_turn = |ray: &Vec<Need>| {
                    ray.iter().skip(turn).step_by(picture.turns as usize).copied().collect::<Vec<_>>()
                };
                looked_at.flat_map(|(_, ray)| of_turn(ray)).collect()
            }
        }
    }

    fn feedback(&mut self, view: ViewId, picture: &Picture) -> Feedback {
        let seeks = self.pager.looks_for_gaps(view);
        let mut pages: BTreeMap<PageId, (u32, u8)> = BTreeMap::new();
        for need in self.named(picture, seeks) {
            let (pixels, eighth) = pages.entry(self.id(need.pos)).or_insert((0, need.eighth));
            (*pixels, *eighth) = (*pixels + 1, need.eighth.min(*eighth));
        }
        let wanted = pages.into_iter().map(|(page, (pixels, eighth))| WantedPage { page, pixels, eighth });
        Feedback { view, gaps: seeks, ..Feedback::of_pages(self.frame, wanted.collect()) }
    }

    fn frame(&mut self, picture: &Picture) {
        self.frame_of(&[(ViewId::MAIN, picture)]);
    }

    /// A frame in which these views are drawn.
    fn frame_of(&mut self, drawn: &[(ViewId, &Picture)]) {
        self.frame += 1;
        self.pager.begin_frame(self.frame);
        let feedbacks = drawn.iter().map(|(view, picture)| self.feedback(*view, picture)).collect();
        self.drawn.push_back(feedbacks);
        if self.drawn.len() > READ_AFTER
            && let Some(read) = self.drawn.pop_front()
        {
            self.pager.observe_views(&read);
        }
        while self.coming.front().is_some_and(|(at, _)| *at <= self.frame)
            && let Some((_, page)) = self.coming.pop_front()
        {
            self.pager.tile_ready(page, vec![0; TILE].into());
        }
        while let Some(page) = self.pager.poll_cancel() {
            self.coming.retain(|(_, coming)| *coming != page);
            self.pager.tile_cancelled(page);
        }
        while self.pager.poll_rerank().is_some() {}
        while let Some(request) = self.pager.poll_request() {
            self.coming.push_back((self.frame + self.latency, request.page));
        }
        while let Some((_, upload)) = self.pager.poll_upload() {
            *self.uploads.entry(upload.page).or_default() += 1;
        }
    }

    /// Begins a frame in which nothing is drawn.
    fn begin_frame(&mut self) {
        self.frame += 1;
        self.pager.begin_frame(self.frame);
    }

    fn moves_to(&mut self, picture: &Picture, frames: u64) {
        self.pager.set_gap_passes(ViewId::MAIN, 0);
        self.pager.set_view_turns(ViewId::MAIN, picture.turns as u32);
        (0..frames).for_each(|_| self.frame(picture));
    }

    /// Gives the frames that it takes until all is there at rest, and the mip bias then.
    fn moves_and_rests(&mut self, random: &mut Random) -> Result<([u64; 2], Picture), String> {
        for _ in 0..1 + random.below(3) {
            let picture = Picture::new(random);
            self.moves_to(&picture, random.below(8 * CYCLE));
        }
        let picture = Picture::new(random);
        let frames = self.rests_at(&picture)?;
        Ok(([frames, u64::from(self.pager.stats().bias_eighths)], picture))
    }

    /// Comes to rest; gives how many frames it takes until all is there.
    fn rests_at(&mut self, picture: &Picture) -> Result<u64, String> {
        self.pager.set_view_turns(ViewId::MAIN, picture.turns as u32);
        self.pager.set_gap_passes(ViewId::MAIN, PASSES);
        // What was drawn of before is read by then.
        (0..READ_AFTER).for_each(|_| self.frame(picture));
        self.uploads.clear();
        let frames = self.converges(picture)?;
        let twice: Vec<_> = self.uploads.iter().filter(|(_, uploads)| **uploads > 1).collect();
        match twice.is_empty() {
            true => Ok(frames),
            false => Err(format!("of {} pages uploaded twice: {twice:?}", self.uploads.len())),
        }
    }

    /// Gives how many frames it takes until all is there, and stays so, for every ray.
    fn converges(&mut self, picture: &Picture) -> Result<u64, String> {
        let (mut frames, mut idle, mut converged_for) = (0, 0, 0);
        while converged_for < 4 * CYCLE {
            self.frame(picture);
            frames += 1;
            idle += u64::from(self.coming.is_empty());
            converged_for = if self.pager.is_view_converged(ViewId::MAIN) { converged_for + 1 } else { 0 };
            // A rest that is not settled by itself takes more.
            if idle > MOST_FRAMES || frames > MOST_OF_ALL {
                return Err(format!("does not converge: {:?}", self.pager.stats()));
            }
        }
        let lacking = picture.rays.iter().flatten().filter(|need| self.lacks(need)).count();
        if lacking > 0 {
            return Err(format!("{lacking} needs are lacking: {:?}", self.pager.stats()));
        }
        Ok(frames - converged_for)
    }
}

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
    for seed in 0..24 {
        let mut random = Random::new(seed);
        let slots = 30 + random.below(200) as u32;
        let mut world = World::new(&mut random, slots);
        let (_, picture) = world.moves_and_rests(&mut random).unwrap();
        let picture = Picture { rays: picture.rays.into_iter().take(20).collect(), ..picture };
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
    let mut coarser = 0;
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
    assert!(coarser > 12, "{coarser}");
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
    // Each of them has 64 pages and those above them: both have no room beside the picture.
    let regions = [1024, 2048].map(|column| Region::image(column..column + 1024, 2048..3072));
    for region in &regions {
        let ticket = world.pager.prefetch(world.number, region, Urgency::default()).unwrap();
        (0..4 * CYCLE).for_each(|_| world.frame(&picture));
        world.pager.release(ticket);
    }
    let of_first = (8..16).flat_map(|x| (16..24).map(move |y| need(x, y)));
    let gone = of_first.filter(|need| world.pager.state(world.id(need.pos)) == PageState::Absent);
    let gone: Vec<Need> = gone.collect();
    assert!(gone.len() > 8, "{} have made room", gone.len());
    // A pixel that was not looked at so far wants some of them.
    picture.rays.push(gone[..8].to_vec());
    world.converges(&picture).unwrap();
    assert_eq!(world.pager.stats().bias_eighths, 0);
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
            let asks = resting.filter(|nth| of == 1 || !has_all(&world, *nth));
            let asking: Vec<_> = asks.map(|nth| (views[nth], &pictures[nth])).collect();
            let moving = drawn.iter().map(|(view, picture)| (*view, picture));
            world.frame_of(&moving.chain(asking).collect::<Vec<_>>());
            let all_have = (0..of).all(|nth| !is_moving(nth) && has_all(&world, nth));
            converged_for = if all_have { converged_for + 1 } else { 0 };
            *frames += 1;
            idle += u64::from(world.coming.is_empty());
            if idle > MOST_FRAMES + moves_for[1] || *frames > MOST_OF_ALL {
                return Err(format!("does not converge: {:?}", world.pager.stats()));
            }
        }
        *frames -= converged_for;
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
