//! Which pages get a tile: all of them, unless a mask or transparency says that nobody will look at some.
//!
//! A page of level 0 is left out where the mask marks nothing of it, or where its tile, border included, is
//! transparent; a coarser one where all that it covers is. So the pages that are left form a tree, and
//! whoever asks for a page without a tile is shown its nearest ancestor. What an image file means as a mask
//! stands here, reading it in `image`.

use std::ops::ControlFlow;

use vastex_core::{Geometry, PagePos, PageSet};

use super::layers::OpenLayer;
use super::{BuildError, BuildOptions};
use crate::image::{InputFault, PixelFormat, RowReader, open_while};
use crate::progress::{Progress, read_watched, rows_at_once};
use crate::pyramid::stack::{LayerBands, LayerPlan};
use crate::threads;

/// What the options and the inputs say of the pages of a texture.
pub(crate) fn select(
    layers: &[OpenLayer],
    plans: &[LayerPlan],
    geometry: &Geometry,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<Selection, BuildError> {
    if options.drop_transparent && !plans.iter().any(LayerPlan::has_alpha) {
        return Err(BuildError::NoAlpha);
    }
    // A layer that has all its texels needs all pages.
    let of_layers: Option<Vec<PageSet>> = layers.iter().map(|layer| layer.reader.present(geometry)).collect();
    let mut allowed =
        of_layers.map(|sets| PageSet::from_pages(geometry, |pos| sets.iter().any(|set| set.contains(pos))));
    if let Some(path) = &options.mask {
        let at_mask = |fault| BuildError::Input { path: path.clone(), fault };
        let opened = open_while(path, &|| progress.opening());
        let mut mask = opened.map_err(|fault| BuildError::input(path, fault))?;
        let (needed, limit) = (mask.header().memory, options.memory_limit);
        if needed > limit {
            let remedy = "make the mask smaller: any size of the same shape will do";
            return Err(BuildError::Memory { path: path.clone(), needed, limit, remedy });
        }
        let rows = u64::from(geometry.size()[1]);
        let tell = |share: Option<f64>| match share {
            Some(share) => progress.beginning(share),
            None => progress.advance(0, rows, 0),
        };
        let marked = pages_from_mask(&mut *mask, geometry, &tell).map_err(at_mask)?;
        let marked = marked.ok_or(BuildError::Cancelled)?;
        allowed = Some(match allowed {
            Some(set) => PageSet::from_pages(geometry, |pos| set.contains(pos) && marked.contains(pos)),
            None => marked,
        });
    }
    Ok(Selection::new(geometry, allowed, options.drop_transparent))
}

/// Decides page by page, children before their parents.
pub(crate) struct Selection {
    /// The pages that may have tiles; `None` if all may.
    allowed: Option<PageSet>,
    /// The pages that have a descendant with a tile; `None` if transparency does not matter.
    needed: Option<PageSet>,
}

impl Selection {
    /// The pages in `allowed` (all where there is nothing), less the transparent ones if so wished.
    pub(crate) fn new(geometry: &Geometry, allowed: Option<PageSet>, drop_transparent: bool) -> Selection {
        Selection { allowed, needed: drop_transparent.then(|| PageSet::new(geometry)) }
    }

    /// Which pages of a row of them get a tile. Rows come in the order in which they are cut, so children
    /// before parents.
    pub(crate) fn kept(&mut self, bands: &LayerBands<'_>) -> Vec<bool> {
        let columns = 0..bands.pages();
        let transparent = match self.needed {
            Some(_) => threads::map(columns.clone(), 1, |x| bands.is_transparent(x)),
            None => Vec::new(),
        };
        let geometry = bands.geometry();
        columns.map(|x| self.keeps(geometry, bands.pos(x), || transparent[x as usize])).collect()
    }

    /// Returns true if a page gets a tile. Every page that has children must be asked for after them;
    /// `is_transparent` is called where nothing else decides.
    fn keeps(&mut self, geometry: &Geometry, pos: PagePos, is_transparent: impl FnOnce() -> bool) -> bool {
        if self.allowed.as_ref().is_some_and(|allowed| !allowed.contains(pos)) {
            return false;
        }
        let Some(needed) = &mut self.needed else { return true };
        if needed.contains(pos) {
            return true;
        }
        // What is coarser than its children rounds: where they are all transparent, so is it.
        let has_children = pos.level > 0 && {
            let (lo, hi) = geometry.descendants(pos, pos.level - 1);
            let child = |x, y| PagePos::new_2d(pos.level - 1, x, y);
            let mut children = (lo[1]..hi[1]).flat_map(|y| (lo[0]..hi[0]).map(move |x| child(x, y)));
            children.any(|child| self.allowed.as_ref().is_none_or(|allowed| allowed.contains(child)))
        };
        let keeps = !has_children && !is_transparent();
        if keeps {
            needed.insert(geometry, pos);
        }
        keeps
    }
}

/// The pages of which the mask marks anything, with their ancestors. Takes one pass over the mask, and a bit
/// for each page. `tell` is called before rows are read, and about ten times a second where they take long,
/// with the share that is done of the work before the first one, where that is known; the set is `None` where
/// it says that nobody waits any more.
///
/// A texel of the mask marks what it covers where it is not black and not transparent. The mask has the
/// texture's size, or any other of the same shape.
pub(crate) fn pages_from_mask(
    mask: &mut dyn RowReader,
    geometry: &Geometry,
    tell: &dyn Fn(Option<f64>) -> ControlFlow<()>,
) -> Result<Option<PageSet>, InputFault> {
    let (format, size) = (mask.header().format, [mask.header().width, mask.header().height]);
    let [width, height, _] = geometry.size();
    check_shape(size, [width, height])?;
    let [page_x, page_y, _] = geometry.page();
    let columns: Vec<_> = (0..size[0]).map(|x| pages_along(x, size[0], width, page_x)).collect();
    let mut set = PageSet::new(geometry);
    if geometry.tail().first_level() == 0 {
        return Ok(Some(set));
    }
    let (row_bytes, together) = (mask.header().row_bytes(), rows_at_once(mask));
    let mut rows = vec![0; together * row_bytes];
    for first in (0..size[1]).step_by(together) {
        if tell(None).is_break() {
            return Ok(None);
        }
        let rows = &mut rows[..together.min((size[1] - first) as usize) * row_bytes];
        match read_watched(mask, rows, first == 0, tell) {
            Some(read) => read?,
            None => return Ok(None),
        }
        for (y, row) in (first..).zip(rows.chunks_exact(row_bytes)) {
            let rows = pages_along(y, size[1], height, page_y);
            let mut last = None;
            for (texel, columns) in row.chunks_exact(format.texel_bytes()).zip(&columns) {
                // Of the texels that lie in one page alone, the first that marks it is enough.
                if last.as_ref() != Some(columns) && is_marked(texel, format) {
                    for page_y in rows.clone() {
                        columns.clone().for_each(|x| set.insert(geometry, PagePos::new_2d(0, x, page_y)));
                    }
                    last = Some(columns.clone());
                }
            }
        }
    }
    Ok(Some(set))
}

/// The pages of level 0 along one axis that texel `i` of `size` shows a part of.
fn pages_along(i: u32, size: u32, texels: u32, page: u32) -> std::ops::Range<u32> {
    let [i, size, texels, page] = [i, size, texels, page].map(u64::from);
    let (first, end) = (i * texels / size, ((i + 1) * texels).div_ceil(size));
    (first / page) as u32..end.div_ceil(page) as u32
}

fn is_marked(texel: &[u8], format: PixelFormat) -> bool {
    let sample = format.sample().bytes();
    let (color, alpha) = texel.split_at(texel.len() - if format.has_alpha() { sample } else { 0 });
    color.iter().any(|&byte| byte != 0) && (alpha.is_empty() || alpha.iter().any(|&byte| byte != 0))
}

/// A mask may be smaller or larger than the texture, but not of another shape.
fn check_shape(mask: [u32; 2], texture: [u32; 2]) -> Result<(), InputFault> {
    let [w, h, width, height] = [mask[0], mask[1], texture[0], texture[1]].map(u64::from);
    // The height that goes with its width, rounded either way.
    let (low, high) = (w * height / width, (w * height).div_ceil(width));
    if (low.saturating_sub(1)..=high + 1).contains(&h) {
        return Ok(());
    }
    Err(InputFault::Layout {
        why: format!("has {w}x{h} texels, a texture of {width}x{height} needs a mask of the same shape"),
        remedy: "cut or stretch it to the size of the texture, or to a fraction of that",
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex_core::GeometrySpec;

    fn geometry(width: u32, height: u32) -> Geometry {
        Geometry::new(GeometrySpec { page: 16, border: 2, ..GeometrySpec::image(width, height) }).unwrap()
    }

    #[test]
    fn a_texel_of_a_small_mask_marks_all_that_it_covers() {
        assert_eq!(pages_along(0, 2, 100, 16), 0..4);
        assert_eq!(pages_along(1, 2, 100, 16), 3..7);
        assert_eq!(pages_along(99, 200, 100, 16), 3..4);
        assert_eq!(pages_along(2, 3, 100, 16), 4..7);
    }

    #[test]
    fn marks_are_neither_black_nor_transparent() {
        let marked = |texel: &[u8], format| is_marked(texel, format);
        assert!(marked(&[1], PixelFormat::GREY8) && !marked(&[0], PixelFormat::GREY8));
        assert!(
            !marked(&[9, 0], PixelFormat::GREY_ALPHA8) && marked(&[0, 1, 0, 1], PixelFormat::GREY_ALPHA16)
        );
        assert!(marked(&[0, 0, 3], PixelFormat::RGB8) && !marked(&[0, 0, 0, 255], PixelFormat::RGBA8));
    }

    #[test]
    fn a_parent_is_kept_for_its_children_only() {
        let geometry = geometry(64, 64);
        let mut selection = Selection::new(&geometry, None, true);
        assert!(selection.keeps(&geometry, PagePos::new_2d(0, 3, 0), || false));
        assert!(!selection.keeps(&geometry, PagePos::new_2d(0, 0, 0), || true));
        assert!(selection.keeps(&geometry, PagePos::new_2d(1, 1, 0), || true));
        // Rounding may leave a trace of what the level below it leaves out.
        assert!(!selection.keeps(&geometry, PagePos::new_2d(1, 0, 0), || false));
    }

    #[test]
    fn where_finer_pages_are_not_allowed_the_coarser_decides_for_itself() {
        let geometry = geometry(64, 64);
        let mut allowed = PageSet::new(&geometry);
        allowed.insert(&geometry, PagePos::new_2d(0, 0, 0));
        allowed.insert(&geometry, PagePos::new_2d(1, 1, 1));
        let mut selection = Selection::new(&geometry, Some(allowed), true);
        assert!(!selection.keeps(&geometry, PagePos::new_2d(0, 3, 3), || false));
        assert!(selection.keeps(&geometry, PagePos::new_2d(1, 1, 1), || false));
        assert!(!selection.keeps(&geometry, PagePos::new_2d(1, 0, 1), || false));
    }

    #[test]
    fn masks_of_another_shape_are_refused() {
        assert!(check_shape([4096, 2048], [8192, 4096]).is_ok());
        assert!(check_shape([100, 77], [1000, 777]).is_ok() && check_shape([100, 78], [1000, 777]).is_ok());
        assert!(check_shape([100, 100], [200, 100]).is_err());
    }
}
