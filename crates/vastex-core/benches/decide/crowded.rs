//! A decision with two thousand textures, beside one with few: as many pages in view, as many pages that
//! could not be had.

use std::time::Instant;

use bytes::Bytes;
use vastex_core::{
    BiasRule, Budgets, Dims, Feedback, Geometry, GeometrySpec, PageId, PagePos, Pager, TextureNumber,
    WantedPage,
};

use crate::{micros, says};

/// What a decision may take, and how many times what one with few textures takes.
const MOST_MICROS: f64 = 1000.0;
const MOST_TIMES: f64 = 1.5;
/// Median of so many decisions.
const DECISIONS: usize = 100;
/// Whole jitter cycles, after which pools are full and every frame evicts.
const WARM_UP: u64 = 160;
const FAILED: usize = 10_000;
/// Often enough for their back-off to outlast the measurement.
const FAILURES: u64 = 4;
/// Slots beside the tails: what is in view, and what has just left it.
const SLOTS: u32 = 2700;
/// Texels along the sides of a texture, which is cut into pages of 128.
const SIDE: u32 = 4096;

pub(crate) fn measure() {
    println!("\n## Many textures, many failures\n");
    println!(
        "{FAILED} pages that could not be had, some 2,000 pages wanted, {} of them new in each frame; textures of\n\
         {SIDE}x{SIDE} texels in a pool of {SLOTS} tiles beside the tails. The two take turns; medians of {DECISIONS} decisions.\n",
        Crowded::few().new_pages()
    );
    println!(
        "| textures | wanted | failures remembered | evictions a frame | µs a decision | of that with few |"
    );
    println!("|---|---|---|---|---|---|");
    let mut scenes = [Crowded::few(), Crowded::many()];
    scenes.iter_mut().for_each(Crowded::prepare);
    let before = [0, 1].map(|n| scenes[n].pager.stats().evicted);
    let mut times = [const { Vec::new() }; 2];
    for _ in 0..DECISIONS {
        for (scene, times) in scenes.iter_mut().zip(&mut times) {
            times.push(scene.decide());
        }
    }
    let medians = times.map(|mut times| {
        times.sort_unstable_by(f64::total_cmp);
        times[DECISIONS / 2]
    });
    scenes.iter().for_each(|scene| assert_eq!(scene.failed(), FAILED, "all are remembered to the end"));
    for ((scene, median), before) in scenes.iter().zip(medians).zip(before) {
        let stats = scene.pager.stats();
        println!(
            "| {} | {} | {} | {:.0} | {median:.0} | {:.2} |",
            scene.textures.len(),
            stats.wanted - stats.tails,
            scene.failed(),
            (stats.evicted - before) as f64 / DECISIONS as f64,
            median / medians[0],
        );
    }
    let ratio = medians[1] / medians[0];
    println!(
        "\n- A decision with {} textures in at most {MOST_MICROS} µs: {} ({:.0} µs).",
        scenes[1].textures.len(),
        says(medians[1] <= MOST_MICROS),
        medians[1],
    );
    println!(
        "- At most {MOST_TIMES} times one with {}: {} ({ratio:.2} times).",
        scenes[0].textures.len(),
        says(ratio <= MOST_TIMES),
    );
}

struct Crowded {
    pager: Pager,
    textures: Vec<TextureNumber>,
    /// Textures in view, and how many others come into it in each frame.
    in_view: usize,
    step: usize,
    /// Pages of each, along its sides, of this level.
    pages: [u32; 2],
    level: u8,
    frame: u64,
    failed_pages: Vec<PageId>,
}

impl Crowded {
    /// All in view at once, each with a part of it that moves.
    fn few() -> Crowded {
        Crowded::new(128, 96, 0, [4, 3], 2)
    }

    /// Many beside those in view, which take turns.
    fn many() -> Crowded {
        Crowded::new(2000, 900, 6, [1, 1], 4)
    }

    fn new(textures: u32, in_view: usize, step: usize, pages: [u32; 2], level: u8) -> Crowded {
        let mut pager =
            Pager::new(Budgets { upload_bytes_per_frame: 1000, in_flight_bytes: 2 * FAILED as u64 });
        let pool = pager.add_pool(textures + SLOTS, 1, Some(BiasRule::Solved)).unwrap();
        let geometry = Geometry::new(GeometrySpec::image(SIDE, SIDE)).unwrap();
        let textures: Vec<_> =
            (0..textures).map(|_| pager.add_texture(pool, &geometry, None, None).unwrap().0).collect();
        Crowded { pager, textures, in_view, step, pages, level, frame: 0, failed_pages: Vec::new() }
    }

    fn new_pages(&self) -> u64 {
        // In one frame of 32 each of the textures in view sees another column of pages.
        self.in_view as u64 * u64::from(self.pages[1]) / 32
    }

    fn page(&self, texture: usize, level: u8, x: u32, y: u32) -> PageId {
        PageId::new(self.textures[texture], Dims::D2, PagePos::new_2d(level, x, y)).unwrap()
    }

    fn feedback(&self) -> Feedback {
        let side = (SIDE / 128) >> self.level;
        let mut pages = Vec::new();
        for nth in 0..self.in_view {
            let first = self.step * self.frame as usize;
            let texture = (first + nth) % self.textures.len();
            // Each moves on at a time of its own.
            let moved = if self.step == 0 { (self.frame as u32 + nth as u32) / 32 } else { 0 };
            for (x, y) in (0..self.pages[1]).flat_map(|y| (0..self.pages[0]).map(move |x| (x, y))) {
                let page = self.page(texture, self.level, (x + moved) % side, y % side);
                pages.push(WantedPage { page, pixels: 10, eighth: 0 });
            }
        }
        Feedback::of_pages(self.frame, pages)
    }

    fn play(&mut self, feedback: &Feedback) {
        let (tile, pager) = (Bytes::from_static(b"tile"), &mut self.pager);
        pager.begin_frame(feedback.frame);
        pager.observe(feedback);
        while let Some(page) = pager.poll_cancel() {
            pager.tile_cancelled(page);
        }
        while pager.poll_rerank().is_some() {}
        while let Some(request) = pager.poll_request() {
            match request.pos.level {
                0 => pager.tile_failed(request.page, "none"),
                _ => pager.tile_ready(request.page, tile.clone()),
            }
        }
        while pager.poll_upload().is_some() {}
        pager.take_table_changes(&mut Vec::new());
        while pager.poll_event().is_some() {}
    }

    fn prepare(&mut self) {
        // Pages of level 0, as many in a frame as fit with their ancestors, each as often as it takes for the
        // pager to remember them for long.
        let count = self.textures.len();
        let nth =
            |nth: usize| self.page(nth % count, 0, (nth / count) as u32 % 32, (nth / count) as u32 / 32);
        self.failed_pages = (0..FAILED).map(nth).collect();
        for failure in 0..FAILURES {
            let begun = self.frame.max(1);
            for pages in self.failed_pages.clone().chunks(300) {
                self.frame += 1;
                let pages = pages.iter().map(|&page| WantedPage { page, pixels: 1, eighth: 0 }).collect();
                self.pager.view_cut(vastex_core::ViewId::MAIN, self.frame);
                self.play(&Feedback::of_pages(self.frame, pages));
            }
            // Until they may be tried again, a moment later; after the last time they are remembered for
            // twice as long as that, which outlasts the measurement.
            if failure + 1 < FAILURES {
                self.frame = begun + (32 << failure) + 2;
            }
        }
        for _ in 0..WARM_UP {
            self.decide();
        }
    }

    /// The pages that could not be had and of which the pager knows.
    fn failed(&self) -> usize {
        let is_known =
            |page: &&PageId| matches!(self.pager.state(**page), vastex_core::PageState::Failed { .. });
        self.failed_pages.iter().filter(is_known).count()
    }

    /// Microseconds that a frame takes.
    fn decide(&mut self) -> f64 {
        self.frame += 1;
        let feedback = self.feedback();
        let start = Instant::now();
        self.play(&feedback);
        micros(start.elapsed())
    }
}
