//! When a page that is out of view may be wanted again, as the wanted regions move.
//!
//! Of each level of each texture the wanted pages have a bounding box. Its edges have a speed, measured over
//! a jitter cycle so that the sample positions are the same at both ends. A page beyond an edge is wanted
//! again when the edge has come back to it; the soonest that it can is when the view turns at once, with an
//! acceleration that would stop its fastest edge within [`TURN`] frames. So what the view approaches is back
//! soonest, what lies beside its way later, and what it has left behind last.

use std::collections::VecDeque;

use crate::shader_constants::{JITTER_CYCLE, MAX_LEVELS};
use crate::texture::page::{PageId, TextureNumber};
use crate::texture::textures::Textures;

const CYCLE: usize = JITTER_CYCLE as usize;
/// Frames in which a view is thought able to stop.
const TURN: f64 = 30.0;
/// The least acceleration, in pages of level 0 per frame, per frame: that of a view that stands.
const LEAST_TURN: f64 = 1e-3;
/// Between equals the page out of view for longer is back later: so many frames count as one.
const AGE_WEIGHT: f64 = 1.0 / 64.0;
/// Frames after which a region is forgotten that was not seen since.
const FORGOTTEN_AFTER: u64 = 2048;
/// A level that is gone is thought to stay away so many times as long as it has.
const GONE_WEIGHT: f64 = 2.0;
/// Instead of a region's index: there is none.
const NOWHERE: u32 = u32::MAX;

/// Low and high edge along each axis, in pages of level 0.
type Bounds = [[f64; 2]; 3];
/// The first and the last page along each axis, in pages of their level.
type Span = [[u32; 2]; 3];

/// The wanted pages of one level of a texture.
#[derive(Clone, Debug)]
struct Region {
    texture: TextureNumber,
    level: u8,
    /// True if the region was seen within the last cycle.
    is_active: bool,
    /// Pages of level 0 along each axis of one of its pages.
    scale: [f64; 3],
    /// Of the last cycle, by time; a bit for each time at which there was any.
    cycle: [Span; CYCLE],
    seen: u16,
    /// Of this moment, while it is being gathered.
    gathered: Option<Span>,
    /// The last there was.
    bounds: Bounds,
    /// When that was.
    time: u64,
    /// Of its edges, in pages of level 0 per frame, positive towards higher coordinates; 0 where it is gone.
    speed: Bounds,
}

/// How the regions of a texture move.
#[derive(Clone, Copy, Debug)]
struct Movement {
    /// Of its fastest edge.
    fastest: f64,
    /// The acceleration with which it is thought able to turn, in pages of level 0 per frame, per frame.
    turn: f64,
    turn_inverse: f64,
}

impl Movement {
    fn new(fastest: f64) -> Movement {
        let turn = (fastest / TURN).max(LEAST_TURN);
        Movement { fastest, turn, turn_inverse: turn.recip() }
    }
}

/// When a page that is out of view may be wanted again, as the wanted regions move.
///
/// Only the regions that were seen within a cycle cost anything in a frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Foresight {
    regions: Vec<Region>,
    free: Vec<u32>,
    /// Of each texture, by number, the region of each level.
    places: Vec<[u32; MAX_LEVELS as usize]>,
    movements: Vec<Movement>,
    /// Regions that were seen within the last cycle.
    active: Vec<u32>,
    /// The others, with the time at which each was seen last, the oldest first; those that were seen since
    /// are here in vain.
    idle: VecDeque<(u64, u32)>,
    is_moving: bool,
    time: u64,
    /// Feedbacks of this view, at most a cycle.
    known: usize,
}

impl Foresight {
    /// Takes in the pages wanted now, ancestors included; `cut` where the view has jumped. Costs a visit of
    /// each, and of each level of a texture that was seen within a jitter cycle.
    pub(crate) fn observe(&mut self, pages: impl Iterator<Item = PageId>, cut: bool, textures: &Textures) {
        self.time += 1;
        if cut {
            self.known = 0;
            for &at in &self.active {
                self.regions[at as usize].seen = 0;
            }
        }
        // Neighbours in the list mostly share texture and level.
        let mut run: Option<((TextureNumber, u8), Span)> = None;
        for page in pages {
            let key = (page.texture(), page.level());
            let dims = match textures.geometry(page.texture()) {
                Some(geometry) => geometry.dims(),
                None => continue,
            };
            let span = page.pos(dims).coords().map(|coord| [coord; 2]);
            run = Some(match run {
                Some((of, all)) if of == key => (key, union(all, span)),
                other => {
                    self.gather(other, textures);
                    (key, span)
                }
            });
        }
        self.gather(run, textures);
        self.advance();
        self.forget_the_idle();
        self.known = (self.known + 1).min(CYCLE);
    }

    fn gather(&mut self, run: Option<((TextureNumber, u8), Span)>, textures: &Textures) {
        let Some(((texture, level), span)) = run else { return };
        let at = self.region_of(texture, level).unwrap_or_else(|| self.add(texture, level, textures));
        let region = &mut self.regions[at as usize];
        region.gathered = Some(region.gathered.map_or(span, |all| union(all, span)));
        if !std::mem::replace(&mut region.is_active, true) {
            region.seen = 0;
            self.active.push(at);
        }
    }

    fn region_of(&self, texture: TextureNumber, level: u8) -> Option<u32> {
        let places = self.places.get(usize::from(texture.number()))?;
        places.get(usize::from(level)).copied().filter(|&at| at != NOWHERE)
    }

    fn add(&mut self, texture: TextureNumber, level: u8, textures: &Textures) -> u32 {
        let number = usize::from(texture.number());
        if self.places.len() <= number {
            self.places.resize(number + 1, [NOWHERE; MAX_LEVELS as usize]);
            self.movements.resize(number + 1, Movement::new(0.0));
        }
        let scale = textures.geometry(texture).map_or([1; 3], |geometry| geometry.level(level).scale);
        let region = Region {
            texture,
            level,
            is_active: false,
            scale: scale.map(|scale| scale as f64),
            cycle: [Span::default(); CYCLE],
            seen: 0,
            gathered: None,
            bounds: Bounds::default(),
            time: 0,
            speed: Bounds::default(),
        };
        let at = self.free.pop().unwrap_or(self.regions.len() as u32);
        match self.regions.get_mut(at as usize) {
            Some(place) => *place = region,
            None => self.regions.push(region),
        }
        self.places[number][usize::from(level)] = at;
        at
    }

    fn advance(&mut self) {
        let Foresight { regions, movements, active, idle, time, known, .. } = self;
        for &at in active.iter() {
            movements[usize::from(regions[at as usize].texture.number())].fastest = 0.0;
        }
        active.retain(|&at| {
            let region = &mut regions[at as usize];
            let movement = &mut movements[usize::from(region.texture.number())];
            movement.fastest = movement.fastest.max(region.advance(*time, *known));
            region.is_active = region.time + CYCLE as u64 > *time;
            if !region.is_active {
                idle.push_back((region.time, at));
            }
            region.is_active
        });
        self.turn();
    }

    fn turn(&mut self) {
        self.is_moving = false;
        for &at in &self.active {
            let movement = &mut self.movements[usize::from(self.regions[at as usize].texture.number())];
            *movement = Movement::new(movement.fastest);
            self.is_moving |= movement.fastest > 0.0;
        }
    }

    fn forget_the_idle(&mut self) {
        while let Some((seen, at)) = self.idle.pop_front_if(|(seen, _)| *seen + FORGOTTEN_AFTER < self.time) {
            let region = &self.regions[at as usize];
            if !region.is_active && region.time == seen {
                self.remove(at);
            }
        }
    }

    fn remove(&mut self, at: u32) {
        let region = &mut self.regions[at as usize];
        let place = &mut self.places[usize::from(region.texture.number())][usize::from(region.level)];
        if *place == at {
            *place = NOWHERE;
            region.time = u64::MAX;
            self.free.push(at);
        }
    }

    /// Forgets a texture whose number may be given to another.
    pub(crate) fn forget(&mut self, texture: TextureNumber) {
        let Foresight { regions, active, idle, .. } = self;
        active.retain(|&at| regions[at as usize].texture != texture);
        idle.retain(|&(_, at)| regions[at as usize].texture != texture);
        for level in 0..MAX_LEVELS as u8 {
            if let Some(at) = self.region_of(texture, level) {
                self.remove(at);
            }
        }
        if let Some(movement) = self.movements.get_mut(usize::from(texture.number())) {
            *movement = Movement::new(0.0);
        }
        self.turn();
    }

    /// Returns true if the view stands as far as can be told: nothing of it has moved within a cycle, or it
    /// is younger than that.
    pub(crate) fn is_still(&self) -> bool {
        self.known < CYCLE || !self.is_moving
    }

    /// Frames until a page last wanted `age` rounds ago may be wanted again; a round counts as a frame.
    pub(crate) fn frames_until(&self, page: PageId, age: u64, textures: &Textures) -> f64 {
        let frames = age as f64;
        let Some(at) = self.region_of(page.texture(), page.level()) else {
            // Of a region that was forgotten the way back is not known, only that it is gone.
            return if age > FORGOTTEN_AFTER { frames * (GONE_WEIGHT + AGE_WEIGHT) } else { frames };
        };
        let Some(dims) = textures.geometry(page.texture()).map(|geometry| geometry.dims()) else {
            return frames;
        };
        let region = &self.regions[at as usize];
        let movement = &self.movements[usize::from(page.texture().number())];
        let bounds = edges(page.pos(dims).coords().map(|coord| [coord; 2]), region.scale);
        let back = (0..3).map(|axis| region.frames_along(axis, bounds[axis], frames, movement));
        let gone = GONE_WEIGHT * (self.time - region.time) as f64;
        back.fold(0.0, f64::max) + gone + frames * AGE_WEIGHT
    }
}

impl Region {
    /// Makes what was gathered the present; gives the speed of the fastest edge. `known` feedbacks of this
    /// view came before.
    fn advance(&mut self, time: u64, known: usize) -> f64 {
        let place = |time: u64| (time % CYCLE as u64) as usize;
        let before = place(time - known as u64);
        let then = (known > 0 && self.seen >> before & 1 == 1).then(|| self.cycle[before]);
        let (now, bit) = (place(time), 1 << place(time));
        let gathered = self.gathered.take();
        self.seen = if gathered.is_some() { self.seen | bit } else { self.seen & !bit };
        self.speed = Bounds::default();
        let Some(span) = gathered else { return 0.0 };
        self.cycle[now] = span;
        let now = edges(span, self.scale);
        (self.bounds, self.time) = (now, time);
        let Some(then) = then.map(|span| edges(span, self.scale)) else { return 0.0 };
        self.speed = std::array::from_fn(|a| [0, 1].map(|e| (now[a][e] - then[a][e]) / known as f64));
        self.speed.as_flattened().iter().fold(0.0, |fastest: f64, speed| fastest.max(speed.abs()))
    }

    /// Frames until the region may cover a page again along one axis, if it turns as it is thought able to.
    ///
    /// Where a page lies is as good as random, so the common cases are one, without a branch.
    fn frames_along(&self, axis: usize, [low, high]: [f64; 2], age: f64, movement: &Movement) -> f64 {
        let ([region_low, region_high], [low_speed, high_speed]) = (self.bounds[axis], self.speed[axis]);
        let (below, above) = (region_low - high, low - region_high);
        let (gap, approach) = if below > above { (below, -low_speed) } else { (above, high_speed) };
        let frames = ((approach * approach + 2.0 * movement.turn * gap.max(0.0)).sqrt() - approach)
            * movement.turn_inverse;
        if gap == 0.0 {
            // An edge that has not moved by a page since may not have left this one at all: samples missed
            // it.
            let moved = approach.abs() * age / (high - low);
            return frames * moved.min(1.0);
        }
        if gap > 0.0 { frames } else { 0.0 }
    }
}

fn union(a: Span, b: Span) -> Span {
    std::array::from_fn(|axis| [a[axis][0].min(b[axis][0]), a[axis][1].max(b[axis][1])])
}

fn edges(span: Span, scale: [f64; 3]) -> Bounds {
    std::array::from_fn(|axis| {
        let scale = scale[axis];
        [f64::from(span[axis][0]) * scale, (f64::from(span[axis][1]) + 1.0) * scale]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::geometry::{Geometry, GeometrySpec};
    use crate::texture::page::{Dims, PagePos};
    use std::sync::Arc;

    fn texture(number: u16) -> TextureNumber {
        TextureNumber::new(number).unwrap()
    }

    fn page(number: u16, x: u32) -> PageId {
        PageId::new(texture(number), Dims::D2, PagePos::new_2d(0, x, 0)).unwrap()
    }

    fn many() -> Textures {
        let mut textures = Textures::default();
        let geometry = Arc::new(Geometry::new(GeometrySpec::image(4096, 4096)).unwrap());
        (0..2000).for_each(|number| assert!(textures.add(texture(number), geometry.clone(), None)));
        textures
    }

    #[test]
    fn what_was_not_seen_for_long_costs_nothing_and_is_forgotten() {
        let (textures, mut foresight) = (many(), Foresight::default());
        // All textures in turn, each for a moment, and the first one all the time.
        for frame in 0..10_000u64 {
            let others = (frame % 2000) as u16;
            foresight.observe([page(0, 3), page(others, 1)].into_iter(), false, &textures);
            assert!(foresight.active.len() <= CYCLE + 1, "{}", foresight.active.len());
        }
        assert!(foresight.regions.len() <= 2001 && foresight.idle.len() <= 2 * FORGOTTEN_AFTER as usize);
        for _ in 0..FORGOTTEN_AFTER + 2 * CYCLE as u64 {
            foresight.observe([page(0, 3)].into_iter(), false, &textures);
        }
        assert_eq!((foresight.active.len(), foresight.idle.len()), (1, 0));
        assert_eq!(foresight.regions.len() - foresight.free.len(), 1);
        let late = |number| foresight.frames_until(page(number, 1), 3000, &textures);
        assert!(late(7) > 6000.0, "gone for long, it stays away for long: {}", late(7));
    }

    #[test]
    fn a_texture_that_comes_back_begins_anew() {
        let (textures, mut foresight) = (many(), Foresight::default());
        (0..20).for_each(|x| foresight.observe([page(5, x)].into_iter(), x == 0, &textures));
        assert!(!foresight.is_still());
        foresight.forget(texture(5));
        assert!(foresight.is_still() && foresight.regions.len() == foresight.free.len());
        (0..20).for_each(|_| foresight.observe([page(5, 3)].into_iter(), false, &textures));
        assert!(foresight.is_still(), "nothing is left of how it moved");
    }
}
