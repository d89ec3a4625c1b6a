//! A picture in parts, each small enough to be drawn at once: which they are, and how they are drawn and put
//! together, row of parts by row of parts, so that no more than a row of them is ever in memory.

mod totals;

use std::ops::ControlFlow;

use anyhow::{Result, bail};
use vastex::{Event, Textures};
use vastex_scenes::{DisplayOptions, LayerOptions, Offscreen, Overlay, Picture, Pose, Until};
use vastex_tiles::srgb_from_linear;
use vastex_viewer::PicturePart;
use vastex_viewer::layers::{CompareMode, Panes};
use vastex_viewer::stage::LinearTarget;

pub(crate) use totals::Totals;

/// Pixels of a part along each side at most, so that little GPU memory is taken however large the whole is.
pub(crate) const MOST_SIDE: u32 = 4096;
/// Bytes of a row of parts at most, but for rows of very wide pictures, which have 64 pixels at least.
const MOST_BYTES: u64 = 128 << 20;
/// Pixels around a part that are drawn and left out of it: by what is seen there, what the edge of the part
/// takes from beside it is loaded as well, such as the heights of patches that cross the edge.
const MARGIN: u32 = 32;
/// And where clouds are seen, and throw shadows, beside where they are.
const MARGIN_OF_CLOUDS: u32 = 256;

/// A part of a picture. The last ones of a row and of a column may reach beyond it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    /// Its first pixel.
    pub(crate) at: [u32; 2],
    /// Its width and height, the same of all parts that are drawn.
    pub(crate) size: [u32; 2],
    /// The pane that it is of.
    pub(crate) pane: u32,
    /// What is drawn of the pane: the part and its margin.
    drawn: PicturePart,
}

/// How a picture is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Parts {
    /// Width and height of the whole.
    pub(crate) whole: [u32; 2],
    /// Panes side by side in it, the first column of the first one, and the width of each.
    panes: u32,
    left: u32,
    pane: u32,
    /// Parts along a pane, and rows of them.
    count: [u32; 2],
    size: [u32; 2],
    margin: u32,
}

impl Parts {
    /// The parts of a picture of so many panes, which share all of it, with at most so many pixels a side
    /// drawn at once. Where clouds are seen, margins are wider.
    pub(crate) fn new(whole: [u32; 2], panes: u32, most: u32, has_clouds: bool) -> Parts {
        let panes = panes.clamp(1, whole[0].max(1));
        Parts::of_panes(whole, Panes::sharing(panes, whole[0], [0.0, whole[0].into()]), most, has_clouds)
    }

    /// The same where panes lie in it as given.
    pub(crate) fn of_panes(whole: [u32; 2], panes: Panes, most: u32, has_clouds: bool) -> Parts {
        let Panes { count: panes, left, width: pane, .. } = panes;
        // A GPU takes slopes, and so levels, from squares of two by two pixels, which begin at even ones: in
        // a part that began at an odd one they would be others than in the whole.
        let margin = (if has_clouds { MARGIN_OF_CLOUDS } else { MARGIN }).min(most / 4) & !1;
        let most_kept = (most - 2 * margin).max(1);
        let rows = (MOST_BYTES / (4 * u64::from(whole[0]))).clamp(64, u64::from(u32::MAX)) as u32;
        let divided = |side: u32, most: u32| {
            if side <= most {
                return (1, side);
            }
            let count = side.div_ceil((most & !1).max(1));
            (count, side.div_ceil(count).next_multiple_of(2.min(most)))
        };
        let (columns, width) = divided(pane, most_kept);
        let (rows, height) = divided(whole[1], most_kept.min(rows));
        Parts { whole, panes, left, pane, count: [columns, rows], size: [width, height], margin }
    }

    /// Width and height of what is drawn of each.
    pub(crate) fn drawn_size(&self) -> [u32; 2] {
        self.size.map(|side| side + 2 * self.margin)
    }

    /// Width and height of a pane.
    pub(crate) fn pane_size(&self) -> [u32; 2] {
        [self.pane, self.whole[1]]
    }

    /// The parts, row by row.
    pub(crate) fn rows(&self) -> impl Iterator<Item = Vec<Part>> {
        let Parts { whole, panes, left, pane, count, size, margin } = *self;
        let part = move |at_pane: u32, column: u32, row: u32| {
            let within = [column * size[0], row * size[1]];
            let begins = left + at_pane * pane;
            // Panes share the squares of the picture, whichever column they begin at.
            let before = [margin + (begins % 2).min(margin), margin];
            Part {
                at: [begins + within[0], within[1]],
                size,
                pane: at_pane,
                drawn: PicturePart {
                    whole: [pane, whole[1]],
                    at: [0, 1].map(|axis| i64::from(within[axis]) - i64::from(before[axis])),
                    size: size.map(|side| side + 2 * margin),
                },
            }
        };
        (0..count[1]).map(move |row| {
            (0..panes)
                .flat_map(|at_pane| (0..count[0]).map(move |column| part(at_pane, column, row)))
                .collect()
        })
    }

    /// All columns of a row of parts, each in one part: what the parts have of their panes, and what lies
    /// beside panes, of which nothing is drawn.
    #[cfg(feature = "view")]
    pub(crate) fn covering(&self, of_row: &[Part]) -> Vec<Part> {
        let of_panes = of_row
            .iter()
            .map(|part| Part { size: [self.width_of(part) as u32, self.height_of(part)], ..*part });
        let end = self.left + self.panes * self.pane;
        let beside = of_row.first().into_iter().flat_map(|first| {
            [[0, self.left], [end, self.whole[0]]].into_iter().flat_map(move |[from, to]| {
                let starts = (from..to).step_by(self.size[0].max(1) as usize);
                starts.map(move |column| Part {
                    at: [column, first.at[1]],
                    size: [self.size[0].min(to - column), self.height_of(first)],
                    ..*first
                })
            })
        });
        of_panes.chain(beside).collect()
    }

    /// Rows of pixels of a row of parts, from its first one on.
    pub(crate) fn height_of(&self, part: &Part) -> u32 {
        self.size[1].min(self.whole[1] - part.at[1])
    }

    /// Columns of a part that are of its pane.
    fn width_of(&self, part: &Part) -> usize {
        (self.size[0].min(self.left + (part.pane + 1) * self.pane - part.at[0])) as usize
    }

    /// Puts the picture of a part without its margin into its row of parts.
    fn put(&self, part: &Part, picture: &Picture, row: &mut Picture) {
        let width = self.width_of(part);
        let within = i64::from(part.at[0] - self.left - part.pane * self.pane);
        let before = (within - part.drawn.at[0]) as usize;
        let lines = picture.rgba.chunks_exact(picture.size[0] as usize * 4).skip(self.margin as usize);
        let rows = row.rgba.chunks_exact_mut(self.whole[0] as usize * 4);
        for (line, pixels) in rows.zip(lines) {
            let start = part.at[0] as usize * 4;
            line[start..start + width * 4].copy_from_slice(&pixels[before * 4..(before + width) * 4]);
        }
    }
}

#[cfg(feature = "view")]
impl Part {
    /// All of a picture.
    pub(crate) fn all(size: [u32; 2]) -> Part {
        Part { at: [0; 2], size, pane: 0, drawn: PicturePart::all(size) }
    }

    /// Puts a picture of the part's size into its row of parts.
    pub(crate) fn put(&self, picture: &Picture, row: &mut Picture) {
        let (left, count) = self.columns_in(row);
        let lines = picture.rgba.chunks_exact(picture.size[0] as usize * 4);
        let rows = row.rgba.chunks_exact_mut(row.size[0] as usize * 4);
        for (line, pixels) in rows.zip(lines) {
            line[left * 4..(left + count) * 4].copy_from_slice(&pixels[..count * 4]);
        }
    }

    /// The part of its row of parts; beyond it nothing.
    pub(crate) fn of(&self, row: &Picture) -> Picture {
        let (left, count) = self.columns_in(row);
        let line = self.size[0] as usize * 4;
        let mut rgba = vec![0; line * self.size[1] as usize];
        let rows = row.rgba.chunks_exact(row.size[0] as usize * 4);
        for (pixels, line) in rgba.chunks_exact_mut(line).zip(rows) {
            pixels[..count * 4].copy_from_slice(&line[left * 4..(left + count) * 4]);
        }
        Picture { size: self.size, rgba }
    }

    fn columns_in(&self, row: &Picture) -> (usize, usize) {
        let (left, width) = (self.at[0] as usize, row.size[0] as usize);
        (left, (self.size[0] as usize).min(width.saturating_sub(left)))
    }
}

/// Panes of a picture of so many textures.
pub(crate) fn panes(shown: &DisplayOptions, textures: usize) -> u32 {
    let is_seen = |layer: &&LayerOptions| layer.is_visible && layer.opacity > 0.0;
    let seen = match shown.layers.is_empty() {
        true => (0..textures).filter(|n| !shown.is_of_planet(*n)).count(),
        false => shown.layers.iter().filter(is_seen).count(),
    };
    if shown.compare_mode == CompareMode::Beside { seen.max(1) as u32 } else { 1 }
}

/// Fails where an overlay is a plan, which has no parts.
pub(crate) fn check_overlay(overlay: Option<Overlay>) -> Result<()> {
    match overlay {
        Some(overlay @ (Overlay::Feedback | Overlay::Table | Overlay::Atlas)) => bail!(
            "the overlay {} is drawn at once, and this picture is in parts; choose a smaller --size",
            overlay.name()
        ),
        _ => Ok(()),
    }
}

/// Hears of the frames of the parts of a picture.
pub(crate) trait PartsWatch {
    /// A frame was drawn, and these events happened.
    fn note(&mut self, textures: &Textures, events: Vec<Event>);
    /// A part is drawn.
    fn end_part(&mut self, textures: &Textures);
}

/// Draws a picture in parts, each once everything in view of it is loaded, and gives each row of them to
/// `take` as a picture as wide as the whole, until it breaks. `offscreen` draws pictures of
/// [`Parts::drawn_size`]. Gives back how all of them came about.
pub(crate) fn draw(
    offscreen: &mut Offscreen,
    (pose, parts, overlay): (&Pose, &Parts, Option<Overlay>),
    watch: &mut impl PartsWatch,
    mut take: impl FnMut(&mut Offscreen, &[Part], Picture) -> Result<ControlFlow<()>>,
) -> Result<Totals> {
    // The camera is as far above the same ground in all parts, whichever they show.
    let ground = offscreen.keep_ground(pose, parts.pane_size())?;
    let mut totals = Totals::new(offscreen.textures().stats());
    for of_row in parts.rows() {
        let Some(first) = of_row.first() else { continue };
        let size = [parts.whole[0], parts.height_of(first)];
        // Beside panes, where nothing is drawn, is what is around a picture.
        let pixels = size[0] as usize * size[1] as usize;
        let mut row = Picture { size, rgba: beside_panes(offscreen).repeat(pixels) };
        let (mut shown, mut hidden) = (None, Vec::new());
        for part in &of_row {
            if parts.panes > 1 && shown != Some(part.pane) {
                offscreen.show_again(&hidden)?;
                hidden = offscreen.show_pane_alone(part.pane)?;
                shown = Some(part.pane);
            }
            offscreen.show_part(Some(part.drawn));
            let note = |textures: &Textures, events| watch.note(textures, events);
            let drawn = offscreen.run_along(1, |_| *pose, Until::Converged, note)?;
            watch.end_part(offscreen.textures());
            totals.add(drawn, offscreen.textures().inspect().failed_pages());
            let picture = match overlay {
                None => offscreen.picture(),
                Some(overlay) => offscreen.overlay(overlay)?,
            };
            parts.put(part, &picture, &mut row);
        }
        offscreen.show_again(&std::mem::take(&mut hidden))?;
        if take(offscreen, &of_row, row)?.is_break() {
            break;
        }
    }
    if let Some(ground) = &ground {
        offscreen.textures_mut().ahead().release(ground);
    }
    offscreen.show_part(None);
    Ok(totals)
}

/// A pixel around what is drawn, as pictures have it.
fn beside_panes(offscreen: &Offscreen) -> [u8; 4] {
    let renderer = offscreen.renderer();
    let format = renderer.format();
    let is_light = format.is_srgb() || format == LinearTarget::FORMAT;
    let value = |value: f64| if is_light { srgb_from_linear(value) } else { value };
    let [red, green, blue, alpha] = renderer.background().to_array().map(f64::from);
    [value(red), value(green), value(blue), alpha].map(|value| (value * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(size: [u32; 2]) -> Picture {
        let pixels = size[0] * size[1] * 4;
        Picture { size, rgba: (0..pixels).map(|n| (n % 251) as u8).collect() }
    }

    /// What is drawn of a part, of a whole that is drawn; beyond it nothing.
    fn drawn(whole: &Picture, part: &Part, pane: u32) -> Picture {
        let PicturePart { at, size, .. } = part.drawn;
        let mut rgba = Vec::new();
        for (y, x) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (y, x))) {
            let [x, y] = [i64::from(x) + at[0] + i64::from(part.pane * pane), i64::from(y) + at[1]];
            let is_within =
                (0..i64::from(whole.size[0])).contains(&x) && (0..i64::from(whole.size[1])).contains(&y);
            let pixel = || (y * i64::from(whole.size[0]) + x) as usize * 4;
            rgba.extend_from_slice(if is_within { &whole.rgba[pixel()..][..4] } else { &[0; 4] });
        }
        Picture { size, rgba }
    }

    #[test]
    fn parts_cover_a_picture_and_put_it_together() {
        for (size, panes, most) in [
            ([7, 5], 1, 8),
            ([100, 60], 1, 40),
            ([90, 50], 3, 24),
            ([122, 60], 2, 40),
            ([93, 7], 3, 8),
            ([1, 1], 1, 100),
            ([160, 3], 2, 33),
        ] {
            let parts = Parts::new(size, panes, most, false);
            assert!(parts.drawn_size().iter().all(|side| (1..=most).contains(side)), "{parts:?}");
            let begins = |part: &Part| i64::from(parts.left + part.pane * parts.pane);
            let starts = |part: Part| [begins(&part) + part.drawn.at[0], part.drawn.at[1]];
            assert!(parts.rows().flatten().flat_map(starts).all(|start| start % 2 == 0), "{parts:?}");
            let whole = numbered(size);
            let mut again = Vec::new();
            for of_row in parts.rows() {
                let height = parts.height_of(&of_row[0]);
                let rgba = vec![0; (size[0] * height * 4) as usize];
                let mut row = Picture { size: [size[0], height], rgba };
                for part in &of_row {
                    parts.put(part, &drawn(&whole, part, parts.pane), &mut row);
                }
                again.extend(row.rgba);
            }
            // What is left beside panes shows nothing.
            let covered = parts.pane * panes * 4;
            for (line, expected) in
                again.chunks(size[0] as usize * 4).zip(whole.rgba.chunks(size[0] as usize * 4))
            {
                assert_eq!(line[..covered as usize], expected[..covered as usize], "{parts:?}");
            }
            assert_eq!(again.len(), whole.rgba.len());
        }
        let wide = Parts::new([65_536, 65_536], 1, MOST_SIDE, false);
        assert!(u64::from(wide.size[1]) * 65_536 * 4 <= MOST_BYTES, "a row of parts is no larger");
    }

    #[cfg(feature = "view")]
    #[test]
    fn what_is_painted_over_a_row_of_parts_is_put_back() {
        let parts = Parts::new([100, 60], 1, 40, false);
        for of_row in parts.rows() {
            let before = numbered([100, parts.height_of(&of_row[0])]);
            let mut row = Picture { rgba: vec![0; before.rgba.len()], ..before.clone() };
            of_row.iter().for_each(|part| part.put(&part.of(&before), &mut row));
            assert_eq!(row, before);
        }
    }

    /// What is transparent would be darker where two parts had it.
    #[cfg(feature = "view")]
    #[test]
    fn every_column_is_painted_once_beside_panes_as_well() {
        for (width, count, free) in
            [(100, 1, [0.0, 100.0]), (348, 2, [101.0, 348.0]), (628, 3, [100.0, 600.0])]
        {
            let panes = Panes::sharing(count, width, free);
            let parts = Parts::of_panes([width, 60], panes, 40, false);
            for of_row in parts.rows() {
                let covering = parts.covering(&of_row);
                let mut columns: Vec<u32> =
                    covering.iter().flat_map(|part| part.at[0]..part.at[0] + part.size[0]).collect();
                columns.sort_unstable();
                assert!(columns.into_iter().eq(0..width), "{panes:?}");
                let is_of_row = |part: &Part| {
                    part.at[1] == of_row[0].at[1] && part.size[1] == parts.height_of(&of_row[0])
                };
                assert!(covering.iter().all(is_of_row), "{covering:?}");
            }
        }
    }
}
