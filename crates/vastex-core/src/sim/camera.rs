//! What the simulated camera sees: a part of the texture, finer below and coarser above, as on a tilted
//! plane.

use rustc_hash::FxHashMap;

use crate::record::trace::CameraPosition;
use crate::shader_constants::{FEEDBACK_SCALE, JITTER_CYCLE, STEPS_PER_LEVEL};
use crate::sim::Random;
use crate::texture::geometry::Geometry;
use crate::texture::page::{PageId, PagePos, TextureNumber};
use crate::wanted::feedback::{Feedback, WantedPage};
use crate::wanted::motion::Motion;

/// What is seen at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The point of the texture at the bottom centre of the picture, in uv.
    pub centre: [f64; 2],
    /// How much of the texture's width the bottom row spans, in uv.
    pub width: f64,
    /// How much wider the top row is than the bottom row.
    pub tilt: f64,
}

/// How the camera moves. A pure function of the frame index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// Not at all.
    Still,
    /// Along the texture at an even pace.
    Fly,
    /// On a circle, so that every view comes back.
    Spin,
    /// From all of the texture down to its texels, and back.
    Zoom,
    /// To another place every 40 frames.
    Teleport,
}

impl Path {
    /// Every path.
    pub const ALL: [Path; 5] = [Path::Still, Path::Fly, Path::Spin, Path::Zoom, Path::Teleport];

    /// What is seen in a frame.
    pub fn view(self, frame: u64) -> View {
        let t = frame as f64;
        let base = View { centre: [0.4, 0.4], width: 0.05, tilt: 3.0 };
        match self {
            Path::Still => base,
            Path::Fly => View { centre: [(0.1 + t * 0.0015) % 1.0, 0.4], ..base },
            Path::Spin => {
                View { centre: [0.5 + 0.2 * (t / 30.0).cos(), 0.5 + 0.2 * (t / 30.0).sin()], ..base }
            }
            Path::Zoom => View { width: 0.003f64.powf(0.5 - 0.5 * (t / 60.0).cos()), ..base },
            Path::Teleport => {
                let place = (frame / 40) as f64;
                View { centre: [(place * 0.618) % 1.0, (place * 0.414) % 1.0], ..base }
            }
        }
    }
}

impl View {
    /// What a camera sees that follows the path of this one as another hand would: up to a quarter of the
    /// view's width beside it, and a fifth of a level nearer or farther. 0 keeps to the path; another seed
    /// strays in another way.
    pub fn strayed(self, seed: u64, frame: u64) -> View {
        if seed == 0 {
            return self;
        }
        let mut random = Random::new(seed);
        let mut sway = |frames: f64| {
            let phase = random.below(1000) as f64 / 1000.0;
            (std::f64::consts::TAU * (frame as f64 / frames + phase)).sin()
        };
        let aside = [sway(97.0) + sway(41.0), sway(83.0) + sway(53.0)].map(|sway| sway * self.width / 8.0);
        let width = self.width * (0.2 * sway(120.0)).exp2();
        View { centre: [self.centre[0] + aside[0], self.centre[1] + aside[1]], width, ..self }
    }

    /// Where the camera is, as traces say it: the middle of the view, and its width in levels.
    pub fn place(&self) -> CameraPosition {
        [self.centre[0] as f32, self.centre[1] as f32, self.width.log2() as f32]
    }

    /// What is expected to be seen in so many frames, by a camera whose last two poses were `before`, the
    /// older one first, and which goes on at the same speed, turn rate and rate of approach.
    pub fn expected(&self, before: &[View; 2], frames: u64) -> View {
        let place = |view: &View| [view.centre[0], view.centre[1], 0.0];
        let motion = Motion::through([place(&before[0]), place(&before[1]), place(self)]);
        let [x, y, _] = motion.position_after(frames as f64);
        let centre = [x, y];
        let width = self.width * (self.width / before[1].width).powf(frames as f64);
        View { centre, width: width.clamp(self.width / 16.0, self.width * 16.0), tilt: self.tilt }
    }

    /// The feedback of this view on a screen of `width` by `height` pixels: at 1/8 per axis at the position
    /// that the frame has in the jitter cycle or, where `complete`, of every pixel.
    pub fn feedback(
        &self,
        texture: TextureNumber,
        geometry: &Geometry,
        screen: [u32; 2],
        frame: u64,
        complete: bool,
    ) -> Feedback {
        let step = if complete { 1 } else { FEEDBACK_SCALE };
        // Both coordinates visit all of 0..8 twice in a cycle.
        let n = (frame % u64::from(JITTER_CYCLE)) as u32;
        let jitter = if complete { [0, 0] } else { [n % step, (n * 5 + n / step) % step] };
        let mut found: FxHashMap<PageId, (u32, u8)> = FxHashMap::default();
        for y in (jitter[1]..screen[1]).step_by(step as usize) {
            let Some(row) = self.row(geometry, screen, y) else { continue };
            // Neighbours mostly want the same page.
            let mut run: Option<(u32, u32)> = None;
            let mut note = |run: Option<(u32, u32)>| {
                let Some((page, pixels)) = run.and_then(|(x, n)| Some((row.page(texture, geometry, x)?, n)))
                else {
                    return;
                };
                let entry = found.entry(page).or_insert((0, row.eighth));
                *entry = (entry.0 + pixels, entry.1.min(row.eighth));
            };
            for x in (jitter[0]..screen[0]).step_by(step as usize) {
                let Some(page_x) = row.page_x(x) else { continue };
                run = match run {
                    Some((of, pixels)) if of == page_x => Some((of, pixels + 1)),
                    other => {
                        note(other);
                        Some((page_x, 1))
                    }
                };
            }
            note(run);
        }
        let mut pages: Vec<WantedPage> =
            found.into_iter().map(|(page, (pixels, eighth))| WantedPage { page, pixels, eighth }).collect();
        pages.sort_unstable();
        Feedback { frame, pages, ..Feedback::default() }
    }

    /// The page, and the eighth of its level, that one pixel wants; `None` beside the texture.
    pub fn want(
        &self,
        texture: TextureNumber,
        geometry: &Geometry,
        screen: [u32; 2],
        pixel: [u32; 2],
    ) -> Option<(PageId, u8)> {
        let row = self.row(geometry, screen, pixel[1])?;
        row.page(texture, geometry, row.page_x(pixel[0])?).map(|page| (page, row.eighth))
    }

    /// What a row of pixels has in common; `None` if it lies beside the texture.
    fn row(&self, geometry: &Geometry, screen: [u32; 2], y: u32) -> Option<Row> {
        let down = (f64::from(y) + 0.5) / f64::from(screen[1]);
        let width = self.width * (1.0 + self.tilt * (1.0 - down));
        let v = self.centre[1] - (1.0 - down) * width * 0.5;
        if !(0.0..1.0).contains(&v) {
            return None;
        }
        let size = geometry.size().map(f64::from);
        let lambda =
            (width * size[0] / f64::from(screen[0])).log2().clamp(0.0, f64::from(geometry.coarsest()));
        let (level, eighth) = (lambda as u8, (lambda.fract() * f64::from(STEPS_PER_LEVEL)) as u8);
        // Of a volume, the slice in the middle.
        let middle = geometry.size()[2] / 2;
        let (scale, side) = (geometry.level(level).scale, geometry.page());
        let texels: [u64; 3] = std::array::from_fn(|axis| scale[axis] * u64::from(side[axis]));
        Some(Row {
            centre: self.centre[0],
            width,
            pixels: f64::from(screen[0]),
            texels: size[0],
            page_texels: texels[0],
            eighth,
            page: PagePos {
                level,
                x: 0,
                y: ((v * size[1]) as u64 / texels[1]) as u32,
                z: (u64::from(middle) / texels[2]) as u32,
            },
        })
    }
}

/// A row of pixels, all of which want the same level.
struct Row {
    /// In uv: its middle and how much it spans.
    centre: f64,
    width: f64,
    /// Pixels along it, and texels of level 0 along the whole texture and along a page.
    pixels: f64,
    texels: f64,
    page_texels: u64,
    eighth: u8,
    /// The first page that lies along it.
    page: PagePos,
}

impl Row {
    /// The column of the page that a pixel wants; `None` beside the texture.
    fn page_x(&self, x: u32) -> Option<u32> {
        let u = self.centre + ((f64::from(x) + 0.5) / self.pixels - 0.5) * self.width;
        (0.0..1.0).contains(&u).then(|| ((u * self.texels) as u64 / self.page_texels) as u32)
    }

    fn page(&self, texture: TextureNumber, geometry: &Geometry, x: u32) -> Option<PageId> {
        let pos = PagePos { x, ..self.page };
        let pos = if geometry.is_tail(pos) { geometry.tail_pos() } else { pos };
        crate::texture::geometry::page_id(texture, geometry, pos)
    }
}
