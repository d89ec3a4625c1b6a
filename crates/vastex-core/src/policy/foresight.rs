//! When a page that is out of view may be wanted again, as the wanted regions move.
//!
//! Of each level of each texture the wanted pages have a bounding box. Its edges have a speed, measured over a jitter
//! cycle so that the sample positions are the same at both ends. A page beyond an edge is wanted again when the edge has
//! come back to it; the soonest that it can is when the view turns at once, with an acceleration that would stop its
//! fastest edge within [`TURN`] frames. So what the view approaches is back soonest, what lies beside its way later, and
//! what it has left behind last.

use rustc_hash::FxHashMap;

use crate::page::{PageId, TextureId};
use crate::shared::JITTER_CYCLE;
use crate::textures::Textures;

const CYCLE: usize = JITTER_CYCLE as usize;
/// Frames in which a view is thought able to stop.
const TURN: f64 = 30.0;
/// The least acceleration, in pages of level 0 per frame, per frame: that of a view that stands.
const LEAST_TURN: f64 = 1e-3;
/// Between equals the page out of view for longer is back later: so many frames count as one.
const AGE_WEIGHT: f64 = 1.0 / 64.0;

/// Low and high edge along each axis, in pages of level 0.
type Bounds = [[f64; 2]; 3];
/// The first and the last page along each axis, in pages of their level.
type Span = [[u32; 2]; 3];

/// The wanted pages of one level of a texture.
#[derive(Clone, Debug, Default)]
struct Region {
    /// Of the last cycle, by time.
    cycle: [Option<Bounds>; CYCLE],
    /// Of this moment, while it is being gathered.
    gathered: Option<Span>,
    /// The last there was.
    bounds: Bounds,
    /// When that was.
    time: u64,
    /// Of its edges, in pages of level 0 per frame, positive towards higher coordinates; 0 where it is gone.
    speed: Bounds,
    /// The acceleration with which it is thought able to turn, in pages of level 0 per frame, per frame.
    turn: f64,
    turn_inverse: f64,
}

/// See the head of the file.
#[derive(Clone, Debug, Default)]
pub(crate) struct Foresight {
    regions: FxHashMap<(TextureId, u8), Region>,
    /// Of the fastest edge of each texture.
    fastest: FxHashMap<TextureId, f64>,
    time: u64,
    /// Feedbacks of this view, at most a cycle.
    known: usize,
}

impl Foresight {
    /// Takes in the pages wanted now, ancestors included; `cut` where the view has jumped. Costs a visit of each.
    pub(crate) fn observe(&mut self, pages: impl Iterator<Item = PageId>, cut: bool, textures: &Textures) {
        self.time += 1;
        if cut {
            self.known = 0;
            self.regions.values_mut().for_each(|region| region.cycle = [None; CYCLE]);
        }
        // Neighbours in the list mostly share texture and level.
        let mut run: Option<((TextureId, u8), Span)> = None;
        for page in pages {
            let Some(dims) = textures.geometry(page.texture()).map(|geometry| geometry.dims()) else {
                continue;
            };
            let (key, span) =
                ((page.texture(), page.level()), page.pos(dims).coords().map(|coord| [coord; 2]));
            run = Some(match run {
                Some((of, all)) if of == key => (key, union(all, span)),
                other => {
                    self.gather(other);
                    (key, span)
                }
            });
        }
        self.gather(run);
        self.advance(textures);
        self.known = (self.known + 1).min(CYCLE);
    }

    fn gather(&mut self, run: Option<((TextureId, u8), Span)>) {
        if let Some((key, span)) = run {
            let region = self.regions.entry(key).or_default();
            region.gathered = Some(region.gathered.map_or(span, |all| union(all, span)));
        }
    }

    fn advance(&mut self, textures: &Textures) {
        self.fastest.values_mut().for_each(|fastest| *fastest = 0.0);
        for (&(texture, level), region) in &mut self.regions {
            let scale = textures.geometry(texture).map_or([1; 3], |geometry| geometry.level(level).scale);
            let fastest = self.fastest.entry(texture).or_insert(0.0);
            *fastest = fastest.max(region.advance(self.time, self.known, scale));
        }
        for ((texture, _), region) in &mut self.regions {
            let fastest = self.fastest.get(texture).copied().unwrap_or(0.0);
            region.turn = (fastest / TURN).max(LEAST_TURN);
            region.turn_inverse = region.turn.recip();
        }
    }

    /// Forgets a texture whose number may be given to another.
    pub(crate) fn forget(&mut self, texture: TextureId) {
        self.regions.retain(|&(of, _), _| of != texture);
        self.fastest.remove(&texture);
    }

    /// Whether the view stands as far as can be told: nothing of it has moved within a cycle, or it is younger than that.
    pub(crate) fn is_still(&self) -> bool {
        self.known < CYCLE || self.fastest.values().all(|&fastest| fastest == 0.0)
    }

    /// Frames until a page last wanted `age` frames ago may be wanted again.
    pub(crate) fn frames_until(&self, page: PageId, age: u64, textures: &Textures) -> f64 {
        let region = self.regions.get(&(page.texture(), page.level()));
        let (Some(region), Some(bounds)) = (region, bounds_of(page, textures)) else { return age as f64 };
        let back = (0..3).map(|axis| region.frames_along(axis, bounds[axis], age as f64));
        // A level that is gone is thought to stay away twice as long as it has.
        let gone = 2.0 * (self.time - region.time) as f64;
        back.fold(0.0, f64::max) + gone + age as f64 * AGE_WEIGHT
    }
}

impl Region {
    /// Makes what was gathered the present; gives the speed of the fastest edge. `known` feedbacks of this view came before.
    fn advance(&mut self, time: u64, known: usize, scale: [u64; 3]) -> f64 {
        let then = self.cycle[((time - known as u64) % CYCLE as u64) as usize].filter(|_| known > 0);
        let now = self.gathered.take().map(|span| edges(span, scale));
        self.cycle[(time % CYCLE as u64) as usize] = now;
        self.speed = Bounds::default();
        let Some(now) = now else { return 0.0 };
        (self.bounds, self.time) = (now, time);
        let Some(then) = then else { return 0.0 };
        self.speed = std::array::from_fn(|a| [0, 1].map(|e| (now[a][e] - then[a][e]) / known as f64));
        self.speed.as_flattened().iter().fold(0.0, |fastest: f64, speed| fastest.max(speed.abs()))
    }

    /// Frames until the region may cover a page again along one axis, if it turns as it is thought able to.
    ///
    /// Where a page lies is as good as random, so the common cases are one, without a branch.
    fn frames_along(&self, axis: usize, [low, high]: [f64; 2], age: f64) -> f64 {
        let ([region_low, region_high], [low_speed, high_speed]) = (self.bounds[axis], self.speed[axis]);
        let (below, above) = (region_low - high, low - region_high);
        let (gap, approach) = if below > above { (below, -low_speed) } else { (above, high_speed) };
        let frames =
            ((approach * approach + 2.0 * self.turn * gap.max(0.0)).sqrt() - approach) * self.turn_inverse;
        if gap == 0.0 {
            // An edge that has not moved by a page since may not have left this one at all: samples missed it.
            let moved = approach.abs() * age / (high - low);
            return frames * moved.min(1.0);
        }
        if gap > 0.0 { frames } else { 0.0 }
    }
}

fn union(a: Span, b: Span) -> Span {
    std::array::from_fn(|axis| [a[axis][0].min(b[axis][0]), a[axis][1].max(b[axis][1])])
}

fn edges(span: Span, scale: [u64; 3]) -> Bounds {
    std::array::from_fn(|axis| {
        let scale = scale[axis] as f64;
        [f64::from(span[axis][0]) * scale, (f64::from(span[axis][1]) + 1.0) * scale]
    })
}

fn bounds_of(page: PageId, textures: &Textures) -> Option<Bounds> {
    let (geometry, pos) = textures.pos(page)?;
    Some(edges(pos.coords().map(|coord| [coord; 2]), geometry.level(pos.level).scale))
}
