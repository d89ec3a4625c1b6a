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

/// The wanted pages of one level of a texture.
#[derive(Clone, Debug, Default)]
struct Region {
    /// Of the last cycle, by time.
    cycle: [Option<Bounds>; CYCLE],
    /// Of this moment, while it is being gathered.
    gathered: Option<Bounds>,
    /// The last there was.
    bounds: Bounds,
    /// When that was.
    time: u64,
    /// Of its edges, in pages of level 0 per frame, positive towards higher coordinates; 0 where it is gone.
    speed: Bounds,
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
        let mut run: Option<((TextureId, u8), Bounds)> = None;
        for page in pages {
            let (key, Some(bounds)) = ((page.texture(), page.level()), bounds_of(page, textures)) else {
                continue;
            };
            run = Some(match run {
                Some((of, all)) if of == key => (key, union(all, bounds)),
                other => {
                    self.gather(other);
                    (key, bounds)
                }
            });
        }
        self.gather(run);
        self.fastest.values_mut().for_each(|fastest| *fastest = 0.0);
        for (&(texture, _), region) in &mut self.regions {
            let fastest = self.fastest.entry(texture).or_insert(0.0);
            *fastest = fastest.max(region.advance(self.time, self.known));
        }
        self.known = (self.known + 1).min(CYCLE);
    }

    fn gather(&mut self, run: Option<((TextureId, u8), Bounds)>) {
        if let Some((key, bounds)) = run {
            let region = self.regions.entry(key).or_default();
            region.gathered = Some(region.gathered.map_or(bounds, |all| union(all, bounds)));
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
        let fastest = self.fastest.get(&page.texture()).copied().unwrap_or(0.0);
        let turn = (fastest / TURN).max(LEAST_TURN);
        let back = (0..3).map(|axis| region.frames_along(axis, bounds[axis], turn, age as f64));
        // A level that is gone is thought to stay away twice as long as it has.
        let gone = 2.0 * (self.time - region.time) as f64;
        back.fold(0.0, f64::max) + gone + age as f64 * AGE_WEIGHT
    }
}

impl Region {
    /// Makes what was gathered the present; gives the speed of the fastest edge. `known` feedbacks of this view came before.
    fn advance(&mut self, time: u64, known: usize) -> f64 {
        let then = self.cycle[((time - known as u64) % CYCLE as u64) as usize].filter(|_| known > 0);
        let now = self.gathered.take();
        self.cycle[(time % CYCLE as u64) as usize] = now;
        self.speed = Bounds::default();
        let Some(now) = now else { return 0.0 };
        (self.bounds, self.time) = (now, time);
        let Some(then) = then else { return 0.0 };
        self.speed = std::array::from_fn(|a| [0, 1].map(|e| (now[a][e] - then[a][e]) / known as f64));
        self.speed.as_flattened().iter().fold(0.0, |fastest: f64, speed| fastest.max(speed.abs()))
    }

    /// Frames until the region may cover a page again along one axis, if it turns with an acceleration of `turn`.
    fn frames_along(&self, axis: usize, [low, high]: [f64; 2], turn: f64, age: f64) -> f64 {
        let [region_low, region_high] = self.bounds[axis];
        let (gap, approach) = if high <= region_low {
            (region_low - high, -self.speed[axis][0])
        } else if low >= region_high {
            (low - region_high, self.speed[axis][1])
        } else {
            return 0.0;
        };
        let frames = ((approach * approach + 2.0 * turn * gap).sqrt() - approach) / turn;
        // An edge that has not moved by a page since may not have left this one at all: samples missed it.
        let moved = approach.abs() * age / (high - low);
        if gap == 0.0 { frames * moved.min(1.0) } else { frames }
    }
}

fn union(a: Bounds, b: Bounds) -> Bounds {
    std::array::from_fn(|axis| [a[axis][0].min(b[axis][0]), a[axis][1].max(b[axis][1])])
}

fn bounds_of(page: PageId, textures: &Textures) -> Option<Bounds> {
    let (geometry, pos) = textures.pos(page)?;
    let (scale, coords) = (geometry.level(pos.level).scale, pos.coords());
    Some(std::array::from_fn(|axis| {
        let (scale, coord) = (scale[axis] as f64, f64::from(coords[axis]));
        [coord * scale, (coord + 1.0) * scale]
    }))
}
