//! The same picture from one texture and from many: cut into pieces, and with several attributes in each
//! pixel.

use std::collections::HashSet;
use std::time::Instant;

use bytes::Bytes;
use vastex_core::shader_constants::{FEEDBACK_WANTED, JITTER_CYCLE};
use vastex_core::sim::{Path, View};
use vastex_core::{
    BiasRule, Budgets, Dims, Feedback, FeedbackCompactor, Geometry, GeometrySpec, GroupNumber, PageId,
    PagePos, Pager, TextureNumber, WantedPage,
};

use crate::micros;

const SIZE: [u32; 2] = [32_768, 16_384];
const PICTURE: [u32; 2] = [1280, 720];
const FRAMES: u64 = 600;
/// Of all attributes of a page together.
const TILE_BYTES: u64 = 64 << 10;
const TILES_PER_FRAME: u64 = 16;
const SLOTS: u32 = 1400;
const ATTRIBUTES: u64 = 4;
/// Frames of a still view in which it must become sharp.
const STILL_FRAMES: u64 = 200;

pub(crate) fn measure() {
    println!("\n## The same picture from many textures\n");
    println!(
        "An image of {}x{} texels, the five camera paths, {FRAMES} frames each, a pool of {SLOTS} tiles of {} KiB and {TILES_PER_FRAME} of them a frame,\n\
         each a frame after it was asked for. It is one texture, or cut into equal pieces that are a texture each; every pixel wants\n\
         the same texels. Sharp is a still view, seen for the first time, when nothing is missing for good. The coarsest levels of\n\
         every piece are its tail, which is always there.\n",
        SIZE[0],
        SIZE[1],
        TILE_BYTES >> 10
    );
    head("textures");
    for (columns, rows) in [(1, 1), (2, 1), (4, 2), (8, 4), (16, 8)] {
        row(&(columns * rows).to_string(), || Scene::cut(columns, rows));
    }
    println!(
        "\nThe same image with {ATTRIBUTES} attributes in each pixel, of the same size, in as many bytes: as layers of one texture, as a\n\
         group of textures that one feedback entry serves, and as textures whose entries take turns over pixels and frames.\n"
    );
    head("attributes");
    row("layers", || Scene::cut(1, 1));
    row("a group", Scene::group);
    row("by turns", Scene::by_turns);
}

fn head(what: &str) {
    println!(
        "| {what} | wanted at most | loads | MiB | reloads | levels short | frames until sharp | µs a decision |"
    );
    println!("|---|---|---|---|---|---|---|---|");
}

fn row(name: &str, scene: impl Fn() -> Scene) {
    let sharp = scene().frames_until_sharp();
    let runs: Vec<Run> = Path::ALL.into_iter().map(|path| scene().play(path)).collect();
    let sum = |of: fn(&Run) -> f64| runs.iter().map(of).sum::<f64>();
    println!(
        "| {name} | {} | {} | {:.0} | {} | {:.3} | {sharp} | {:.0} |",
        runs.iter().map(|run| run.wanted_most).max().unwrap_or(0),
        sum(|run| run.loads),
        sum(|run| run.mib),
        sum(|run| run.reloads),
        sum(|run| run.levels_short) / runs.len() as f64,
        sum(|run| run.micros) / runs.len() as f64,
    );
}

/// What a path came to.
struct Run {
    wanted_most: u32,
    loads: f64,
    mib: f64,
    reloads: f64,
    levels_short: f64,
    micros: f64,
}

/// How feedback names what a pixel of the image wants.
enum Names {
    /// The piece that has it: pieces along x and y.
    Pieces(u32, u32),
    Group(GroupNumber),
    Turns,
}

struct Scene {
    pager: Pager,
    image: Geometry,
    textures: Vec<TextureNumber>,
    names: Names,
    under_way: Vec<PageId>,
    loaded: HashSet<PageId>,
    reloads: u32,
}

impl Scene {
    /// The image in pieces, each with all attributes.
    fn cut(columns: u32, rows: u32) -> Scene {
        let piece = GeometrySpec::image(SIZE[0] / columns, SIZE[1] / rows);
        Scene::new(piece, columns * rows, TILE_BYTES, SLOTS, Names::Pieces(columns, rows))
    }

    fn attributes(names: Names) -> Scene {
        let (slots, spec) = (SLOTS * ATTRIBUTES as u32, GeometrySpec::image(SIZE[0], SIZE[1]));
        Scene::new(spec, ATTRIBUTES as u32, TILE_BYTES / ATTRIBUTES, slots, names)
    }

    fn group() -> Scene {
        let mut scene = Scene::attributes(Names::Turns);
        scene.names = Names::Group(scene.pager.add_group(&scene.textures).unwrap());
        scene
    }

    fn by_turns() -> Scene {
        let mut scene = Scene::attributes(Names::Turns);
        scene.pager.set_turns(ATTRIBUTES as u32);
        scene
    }

    fn new(spec: GeometrySpec, textures: u32, tile_bytes: u64, slots: u32, names: Names) -> Scene {
        let frame_bytes = TILES_PER_FRAME * TILE_BYTES;
        let mut pager =
            Pager::new(Budgets { upload_bytes_per_frame: frame_bytes, in_flight_bytes: 2 * frame_bytes });
        // Tails on top, so that the rest is the same for all.
        let pool = pager.add_pool(slots + textures, tile_bytes, Some(BiasRule::Solved)).unwrap();
        let geometry = Geometry::new(spec).unwrap();
        let textures =
            (0..textures).map(|_| pager.add_texture(pool, &geometry, None, None).unwrap().0).collect();
        let image = Geometry::new(GeometrySpec::image(SIZE[0], SIZE[1])).unwrap();
        let (under_way, loaded) = (Vec::new(), HashSet::new());
        Scene { pager, image, textures, names, under_way, loaded, reloads: 0 }
    }

    /// Feedback of a view of the image, by the names that the scene's textures have.
    fn feedback(&self, view: &View, frame: u64) -> Feedback {
        let whole = |number| view.feedback(number, &self.image, PICTURE, frame, false);
        match self.names {
            Names::Pieces(columns, rows) => {
                let mut seen = whole(self.textures[0]);
                for wanted in &mut seen.pages {
                    *wanted = self.of_piece(*wanted, [columns, rows]);
                }
                seen.pages.sort_unstable();
                seen.pages.dedup_by_key(|wanted| wanted.page); // only tails come twice
                seen
            }
            Names::Group(group) => whole(group.number()),
            Names::Turns => self.by_turn(view, frame),
        }
    }

    /// Pages of pieces end where those of the image do, as far as they are larger than a page.
    fn of_piece(&self, wanted: WantedPage, pieces: [u32; 2]) -> WantedPage {
        let pos = wanted.page.pos(Dims::D2);
        let spec = GeometrySpec::image(SIZE[0] / pieces[0], SIZE[1] / pieces[1]);
        let piece = Geometry::new(spec).unwrap();
        let pages = [0, 1].map(|axis| (spec.size[axis] / 128) >> pos.level);
        let (nth, own) = match piece.tail().first_level() <= pos.level || pages.contains(&0) {
            true => (0, piece.tail_pos()),
            false => {
                let nth = pos.y / pages[1] * pieces[0] + pos.x / pages[0];
                (nth, PagePos::new_2d(pos.level, pos.x % pages[0], pos.y % pages[1]))
            }
        };
        let page = PageId::new(self.textures[nth as usize], Dims::D2, own).unwrap();
        WantedPage { page, ..wanted }
    }

    /// As `vastex_turn` has it.
    fn by_turn(&self, view: &View, frame: u64) -> Feedback {
        let (n, cycle) = (frame % u64::from(JITTER_CYCLE), frame / u64::from(JITTER_CYCLE));
        let jitter = [n as u32 % 8, (n as u32 * 5 + n as u32 / 8) % 8];
        let target = PICTURE.map(|side| side / 8);
        let pixel = |at: u32| {
            let (x, y) = (at % target[0], at / target[0]);
            let turn = (u64::from(x + y) + n + cycle) % ATTRIBUTES;
            let pixel = [x * 8 + jitter[0], y * 8 + jitter[1]];
            match view.want(self.textures[turn as usize], &self.image, PICTURE, pixel) {
                Some((page, eighth)) => {
                    let bits = page.to_bits();
                    [bits as u32, (bits >> 32) as u32, u32::from(eighth), FEEDBACK_WANTED]
                }
                None => [0; 4],
            }
        };
        let pixels: Vec<[u32; 4]> = (0..target[0] * target[1]).map(pixel).collect();
        let mut feedback = Feedback::default();
        FeedbackCompactor::new().compact(frame, &pixels, &mut feedback);
        feedback
    }

    fn frame(&mut self, feedback: &Feedback) {
        let tile = Bytes::from_static(b"tile");
        self.pager.begin_frame(feedback.frame);
        self.pager.observe(feedback);
        for page in self.under_way.drain(..) {
            self.pager.tile_ready(page, tile.clone());
        }
        while let Some(page) = self.pager.poll_cancel() {
            self.pager.tile_cancelled(page);
        }
        let most = (TILES_PER_FRAME * TILE_BYTES / self.tile_bytes()) as usize;
        while self.under_way.len() < most
            && let Some(request) = self.pager.poll_request()
        {
            self.under_way.push(request.page);
        }
        while let Some((_, upload)) = self.pager.poll_upload() {
            self.reloads += u32::from(!self.loaded.insert(upload.page));
        }
        self.pager.take_table_changes(&mut Vec::new());
        while self.pager.poll_event().is_some() {}
    }

    fn tile_bytes(&self) -> u64 {
        if let Names::Pieces(..) = self.names { TILE_BYTES } else { TILE_BYTES / ATTRIBUTES }
    }

    fn frames_until_sharp(mut self) -> u64 {
        let view = Path::Still.view(0);
        let mut sharp = 0;
        for frame in 1..=STILL_FRAMES {
            let feedback = self.feedback(&view, frame);
            self.frame(&feedback);
            sharp = if self.pager.stats().missing > 0 { frame + 1 } else { sharp };
        }
        sharp
    }

    fn play(mut self, path: Path) -> Run {
        let (mut times, mut wanted_most, mut levels_short) = (Vec::new(), 0, 0.0);
        for frame in 0..FRAMES {
            let feedback = self.feedback(&path.view(frame), frame);
            let start = Instant::now();
            self.frame(&feedback);
            times.push(start.elapsed());
            let stats = self.pager.stats();
            levels_short += stats.mean_levels_short() / FRAMES as f64;
            wanted_most = wanted_most.max(stats.wanted);
        }
        times.sort_unstable();
        let stats = self.pager.stats();
        Run {
            wanted_most,
            loads: stats.loaded as f64,
            mib: stats.uploaded_bytes as f64 / (1 << 20) as f64,
            reloads: f64::from(self.reloads),
            levels_short,
            micros: micros(times[times.len() / 2]),
        }
    }
}
