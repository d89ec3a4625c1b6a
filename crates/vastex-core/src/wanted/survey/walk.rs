//! From the levels that parts of a texture need to the pages that they want: a walk down the quadtree of its
//! pages.
//!
//! It begins with the tail and goes down where something finer is needed, level by level, so that where there
//! is an end to how many pages may be wanted, what is finest is missing.

use super::look::Footprint;
use super::surface::UvBox;
use crate::shader_constants::STEPS_PER_LEVEL;
use crate::texture::geometry::Geometry;
use crate::texture::geometry::page_id;
use crate::texture::page::{PagePos, TextureNumber};
use crate::wanted::feedback::WantedPage;

/// A page that something of is wanted at its level or finer.
#[derive(Clone, Copy, Debug)]
struct Node {
    pos: PagePos,
    look: Footprint,
}

/// Pages that a walk has found.
#[derive(Clone, Debug, Default)]
pub(super) struct Found {
    pub(super) seen: Vec<WantedPage>,
    pub(super) unseen: Vec<WantedPage>,
}

impl Found {
    pub(super) fn add(&mut self, texture: TextureNumber, geometry: &Geometry, pos: PagePos, look: Footprint) {
        let Some(page) = page_id(texture, geometry, pos) else { return };
        let steps = f64::from(STEPS_PER_LEVEL);
        let eighth = ((look.lambda - f64::from(pos.level)) * steps).clamp(0.0, steps - 1.0) as u8;
        let pages = if look.is_seen { &mut self.seen } else { &mut self.unseen };
        pages.push(WantedPage { page, pixels: (look.pixels as u32).max(1), eighth });
    }
}

/// Walks down from the tail of an image. `look` says what a rectangle of the texture needs, its rule of
/// levels included, and `None` if it is not wanted. At most `max_pages` are found.
pub(super) fn walk(
    texture: TextureNumber,
    geometry: &Geometry,
    max_pages: usize,
    found: &mut Found,
    look: impl Fn(UvBox) -> Option<Footprint>,
) {
    let Some(whole) = look([[0.0; 2], [1.0; 2]]) else { return };
    let (mut nodes, mut finer, mut count) =
        (vec![Node { pos: geometry.tail_pos(), look: whole }], Vec::new(), 0);
    while !nodes.is_empty() {
        // Where not all can be followed down, those that cover most are.
        nodes.sort_by(|a, b| b.look.pixels.total_cmp(&a.look.pixels).then(a.pos.cmp(&b.pos)));
        let all = nodes.len();
        for (nth, node) in nodes.drain(..).enumerate() {
            let level = node.pos.level;
            let has_finer = level > 0 && node.look.lambda < f64::from(level);
            let (first, end) = geometry.descendants(node.pos, level.saturating_sub(1));
            let children = (end[0] - first[0]) as usize * (end[1] - first[1]) as usize;
            // It may leave rests at its own level beside its children.
            if !has_finer || count + finer.len() + (all - nth) + children + 1 > max_pages {
                found.add(texture, geometry, node.pos, node.look);
                count += 1;
                continue;
            }
            // What is wanted of the page itself: where it is seen, and where it is not.
            let mut rests: [Option<Footprint>; 2] = [None; 2];
            for (y, x) in (first[1]..end[1]).flat_map(|y| (first[0]..end[0]).map(move |x| (y, x))) {
                let pos = PagePos::new_2d(level - 1, x, y);
                let Some(look) = look(uv_from_page(geometry, pos)) else { continue };
                let look = Footprint { is_seen: look.is_seen && node.look.is_seen, ..look };
                match look.lambda < f64::from(level) {
                    true => finer.push(Node { pos, look }),
                    false => {
                        let rest = &mut rests[usize::from(look.is_seen)];
                        *rest = Some(rest.map_or(look, |rest| rest.with(look)));
                    }
                }
            }
            for rest in rests.into_iter().flatten() {
                found.add(texture, geometry, node.pos, rest);
                count += 1;
            }
        }
        std::mem::swap(&mut nodes, &mut finer);
    }
}

/// The rectangle of the texture that a page finer than the tail shows.
fn uv_from_page(geometry: &Geometry, pos: PagePos) -> UvBox {
    let (scale, coords) = (geometry.level(pos.level).scale, pos.coords());
    let edge = |axis: usize, page: u32| {
        let texels = f64::from(page) * f64::from(geometry.page()[axis]) * scale[axis] as f64;
        (texels / f64::from(geometry.size()[axis])).min(1.0)
    };
    [[0, 1].map(|axis| edge(axis, coords[axis])), [0, 1].map(|axis| edge(axis, coords[axis] + 1))]
}
