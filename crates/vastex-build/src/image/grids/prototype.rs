//! The pages of the prototype: `pages/{lod}_{x}_{y}.png`, 512 texels of payload within 2 of border on each
//! side.
//!
//! Pages are always full, and nothing of the layout tells where the image ends within the last of them. So a
//! file `size.txt` beside `pages/`, as in `1000x777`, may say it.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use super::tile::{Piece, in_tile};
use super::{Grid, Source, entries, number, shared_texels};
use crate::image::InputFault;

/// Texels of payload, and of border on each side.
pub(crate) const PAGE: u32 = 512;
pub(crate) const BORDER: u32 = 2;
/// Where the size of the image stands, beside the directory of pages.
pub(crate) const SIZE_FILE: &str = "size.txt";
/// Bytes of it that are read: more than two numbers take.
const SIZE_BYTES: u64 = 64;

struct Pages {
    size: [u32; 2],
    pages: PathBuf,
    levels: u32,
}

/// The directory with the pages: `directory`, or the one called `pages` in it.
pub(super) fn find(directory: &Path) -> Result<Option<PathBuf>, InputFault> {
    for candidate in [directory.join("pages"), directory.to_owned()] {
        if candidate.is_dir() && entries(&candidate)?.iter().any(|path| position(path).is_some()) {
            return Ok(Some(candidate));
        }
    }
    Ok(None)
}

/// Lists the pages. None of the finest level may be missing; coarser levels are used as far as there are any.
pub(super) fn open(pages: &Path) -> Result<Source, InputFault> {
    let (mut finest, mut coarser) = (HashMap::new(), HashSet::new());
    for path in entries(pages)? {
        match position(&path) {
            Some((0, x, y)) => {
                finest.insert([x, y], path);
            }
            Some((level, 0, 0)) => {
                coarser.insert(level);
            }
            _ => {}
        }
    }
    let beyond = |at: &[u32; 2]| at.iter().any(|&n| n >= (1 << 31) / PAGE);
    if let Some((_, path)) = finest.iter().find(|(at, _)| beyond(at)) {
        let why = "is named for texels beyond 2^31 of a side";
        return Err(in_tile(path, InputFault::layout(why, "rename or remove it")));
    }
    let counts = [0, 1].map(|axis| finest.keys().map(|at: &[u32; 2]| at[axis]).max());
    let [Some(columns), Some(rows)] = counts else {
        return Err(InputFault::Layout {
            why: "has no page of the finest level".into(),
            remedy: "add the pages 0_x_y.png",
        });
    };
    let (columns, rows) = (u64::from(columns) + 1, u64::from(rows) + 1);
    if finest.len() as u64 != columns.saturating_mul(rows) {
        let why = format!("has {} of the {columns}x{rows} pages of its finest level", finest.len());
        return Err(InputFault::layout(why, "copy the missing pages"));
    }
    let size = size(pages, [columns, rows])?;
    let sample: Vec<_> = finest.values().step_by(finest.len().div_ceil(16)).map(PathBuf::as_path).collect();
    let texels = shared_texels(sample)?;
    // Once one page holds a level, any that are coarser say nothing new.
    let last = columns.max(rows).next_power_of_two().trailing_zeros();
    let levels = 1 + (1..=last).take_while(|level| coarser.contains(level)).count() as u32;
    let grid = Box::new(Pages { size, pages: pages.into(), levels });
    let (directory, notices) = (pages.into(), Vec::new());
    Ok(Source { grid, directory, texels, wraps: false, notices })
}

/// Where the size of an image stands whose pages lie in a directory.
pub(super) fn size_file(pages: &Path) -> PathBuf {
    let parent = pages.parent().filter(|parent| !parent.as_os_str().is_empty());
    parent.unwrap_or(Path::new("..")).join(SIZE_FILE)
}

/// The size of the image: what the file beside the pages says, else all of the pages.
fn size(pages: &Path, counts: [u64; 2]) -> Result<[u32; 2], InputFault> {
    let path = size_file(pages);
    let full = counts.map(|n| n * u64::from(PAGE));
    let size = match std::fs::metadata(&path) {
        Err(_) => full,
        Ok(_) => {
            let text = super::read_text(&path, SIZE_BYTES).map_err(|fault| in_tile(&path, fault))?;
            let size =
                text.trim().split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
            let fits =
                |size: &[u64; 2]| (0..2).all(|a| size[a].div_ceil(PAGE.into()) == counts[a] && size[a] > 0);
            size.filter(fits).ok_or_else(|| {
                let why = format!(
                    "says '{}', but the pages are those of an image of up to {}x{}",
                    text.trim().escape_debug(),
                    full[0],
                    full[1]
                );
                in_tile(&path, InputFault::layout(why, "correct it, as in 1000x777, or remove it"))
            })?
        }
    };
    let limit = |n: u64| u32::try_from(n).ok().filter(|n| *n <= 1 << 31);
    match size.map(limit) {
        [Some(width), Some(height)] => Ok([width, height]),
        _ => Err(InputFault::Layout {
            why: format!("has {}x{} texels", size[0], size[1]),
            remedy: "an image has at most 2^31 texels per side",
        }),
    }
}

/// Level, column and row of a page's file.
pub(super) fn position(path: &Path) -> Option<(u32, u32, u32)> {
    let stem = path.file_name()?.to_str()?.strip_suffix(".png")?;
    let mut numbers = stem.split('_').map(number);
    let found = (numbers.next()??, numbers.next()??, numbers.next()??);
    numbers.next().is_none().then_some(found)
}

impl Grid for Pages {
    fn size(&self) -> [u64; 2] {
        self.size.map(u64::from)
    }

    fn cell(&self) -> u32 {
        PAGE
    }

    fn levels(&self) -> u32 {
        self.levels
    }

    fn piece(&self, level: u32, column: u32, row: u32) -> Piece {
        Piece {
            path: self.pages.join(format!("{level}_{column}_{row}.png")),
            size: [PAGE + 2 * BORDER; 2],
            first: [BORDER; 2],
            within: [0; 2],
            shift: 0,
        }
    }
}
