//! Which pages of a member an entry of its group wants.
//!
//! The entry says which page of the group's shape pixels fall on, and how sharp the sharpest of them is. Of
//! the member they fall on the pages that overlap that page's rectangle in uv. Their level follows from the
//! sizes: a texture with half the texels along an axis is sampled a level finer. Where the sides of two
//! textures differ by different factors, a pixel's level lies between what the axes say, and the finest is
//! wanted; every coarser page that is sampled is an ancestor of a page wanted.
//!
//! Coordinates beyond 0 to 1 have been folded by the shape's address modes. Where a member's differ along an
//! axis, the coordinates are taken to lie within 0 to 1.

use std::ops::Range;

use super::LevelRule;
use crate::shader_constants::{FEEDBACK_SCALE, STEPS_PER_LEVEL};
use crate::texture::geometry::page_id;
use crate::texture::geometry::{Geometry, Level};
use crate::texture::page::{PagePos, TextureNumber};
use crate::wanted::feedback::{Need, WantedPage};

/// Pixels of the picture for which a feedback pixel stands, and so pages that it can want at most.
const PICTURE_PIXELS: u64 = (FEEDBACK_SCALE * FEEDBACK_SCALE) as u64;

/// How a member lies beside its group's shape.
pub(super) struct Overlap<'a> {
    shape: &'a Geometry,
    member: TextureNumber,
    own: &'a Geometry,
    rule: LevelRule,
    /// Added to a need of the shape, to make it one of the member; in eighths of a level.
    shift: f64,
}

impl<'a> Overlap<'a> {
    pub(super) fn new(
        shape: &'a Geometry,
        member: TextureNumber,
        own: &'a Geometry,
        rule: LevelRule,
    ) -> Overlap<'a> {
        let levels = |axis: usize| (f64::from(own.size()[axis]) / f64::from(shape.size()[axis])).log2();
        let axes = 0..if shape.size()[2] == 1 { 2 } else { 3 };
        let finest = axes.map(levels).fold(f64::INFINITY, f64::min);
        let shift = (finest + f64::from(rule.bias)) * f64::from(STEPS_PER_LEVEL);
        Overlap { shape, member, own, rule, shift }
    }

    /// Adds what an entry of the group wants; the same page may come several times. An entry that names no
    /// page of the shape wants nothing.
    pub(super) fn want(&self, entry: &WantedPage, pages: &mut Vec<WantedPage>) {
        let pos = entry.page.pos(self.shape.dims());
        let Some(at) = self.shape.levels().get(usize::from(pos.level)) else { return };
        if (0..3).any(|axis| pos.coords()[axis] >= at.pages[axis]) {
            return;
        }
        let steps = self.steps(Need::new(pos.level, entry.eighth));
        let tail = self.own.tail().first_level();
        let level = ((steps / STEPS_PER_LEVEL) as u8).min(tail);
        let eighth = (steps - u32::from(level) * STEPS_PER_LEVEL).min(STEPS_PER_LEVEL - 1) as u8;
        // Each pixel of the picture wants one page, so more than there are pixels are too fine for all of
        // them.
        let most = u64::from(entry.pixels).max(1) * PICTURE_PIXELS;
        let found = (level..tail).map(|level| (level, self.pages(at, pos, level)));
        match found.into_iter().find(|(_, ranges)| count(ranges) <= most) {
            None => self.add(self.own.tail_pos(), entry.pixels, eighth, pages),
            Some((found, ranges)) => {
                let eighth = if found == level { eighth } else { 0 };
                let pixels = u64::from(entry.pixels).div_ceil(count(&ranges)) as u32;
                let [columns, rows, slices] = ranges;
                for (z, y) in slices.flat_map(|z| rows.clone().map(move |y| (z, y))) {
                    for x in columns.clone() {
                        self.add(PagePos { level: found, x, y, z }, pixels, eighth, pages);
                    }
                }
            }
        }
    }

    /// The member's level in eighths. A need of 0 may stand for any magnification, so a bias must not make it
    /// coarser.
    fn steps(&self, need: Need) -> u32 {
        let (finest, coarsest) = (f64::from(self.rule.finest), f64::from(self.rule.coarsest));
        let steps = f64::from(need.eighths()) + self.shift;
        let is_exact = need.eighths() > 0;
        let wanted = if is_exact { steps.floor() } else { steps.floor().min(0.0) };
        let per_level = f64::from(STEPS_PER_LEVEL);
        wanted.max(finest * per_level).min(coarsest * per_level) as u32
    }

    /// The pages of one of the member's levels, finer than its tail, that overlap a page of the shape.
    fn pages(&self, at: &Level, pos: PagePos, level: u8) -> [Range<u32>; 3] {
        let own = self.own.level(level);
        std::array::from_fn(|axis| {
            let side = at.scale[axis].saturating_mul(u64::from(self.shape.page()[axis]));
            let (size, own_size) = (u64::from(self.shape.size()[axis]), u64::from(self.own.size()[axis]));
            let first = u64::from(pos.coords()[axis]).saturating_mul(side).min(size - 1);
            let end = first.saturating_add(side).min(size);
            // Texels of the member's level 0; sizes have 31 bits.
            let (first, last) = (first * own_size / size, (end * own_size).div_ceil(size) - 1);
            let page = |texel: u64| {
                let page = texel / own.scale[axis] / u64::from(self.own.page()[axis]);
                page.min(u64::from(own.pages[axis]) - 1) as u32
            };
            page(first)..page(last) + 1
        })
    }

    fn add(&self, pos: PagePos, pixels: u32, eighth: u8, pages: &mut Vec<WantedPage>) {
        let Some(page) = page_id(self.member, self.own, pos) else { return };
        match pages.last_mut().filter(|last| last.page == page) {
            // Small pages of the shape lie side by side on one of the member's.
            Some(last) => {
                last.pixels = last.pixels.saturating_add(pixels);
                last.eighth = last.eighth.min(eighth);
            }
            None => pages.push(WantedPage { page, pixels, eighth }),
        }
    }
}

fn count(ranges: &[Range<u32>; 3]) -> u64 {
    // A geometry's levels have fewer than 2^48 pages.
    ranges.iter().map(|range| u64::from(range.end - range.start)).product()
}
