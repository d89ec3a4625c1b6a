//! A frame's whole decision: feedback taken in, the order of loading, requests, uploads, evictions and table
//! changes.

use bytes::Bytes;
use vastex_core::sim::Path;
use vastex_core::{BiasRule, Budgets, Feedback, Geometry, GeometrySpec, Pager, TextureNumber};

use crate::{micros, says};

const SLOTS: u32 = 10_000;
const TILE_BYTES: u64 = 64 << 10;
const FRAMES: u64 = 3000;
/// What a decision may take with so many wanted pages.
const MOST_MICROS: f64 = 500.0;
const WANTED: u64 = 2000;
/// Frames in which the pool fills.
const WARM_UP: u64 = 1500;

pub(crate) fn measure() {
    println!("\n## A frame's whole decision\n");
    println!(
        "A pool of {SLOTS} slots, full; a texture of 262144x131072 texels; medians over {} frames. The slowest frames of a machine\n\
         that has other work are those that waited for a processor.\n",
        FRAMES - WARM_UP
    );
    println!("| view | wanted pages | loaded a frame | µs a frame | slowest, µs |\n|---|---|---|---|---|");
    let mut most_wanted = (0, 0.0);
    for path in [Path::Still, Path::Fly, Path::Spin] {
        let (mut times, mut wanted) = (Vec::new(), Vec::new());
        let mut world = World::new();
        let mut loaded = 0;
        for frame in 0..FRAMES {
            let feedback = world.feedback(path, frame);
            let before = world.pager.stats().loaded;
            let start = std::time::Instant::now();
            world.decide(frame, &feedback);
            let took = start.elapsed();
            if frame >= WARM_UP {
                times.push(took);
                wanted.push(world.pager.stats().wanted);
                loaded += world.pager.stats().loaded - before;
            }
        }
        times.sort_unstable();
        wanted.sort_unstable();
        let half = times.len() / 2;
        if wanted[half] >= most_wanted.0 {
            most_wanted = (wanted[half], micros(times[half]));
        }
        println!(
            "| {path:?} | {} | {:.1} | {:.0} | {:.0} |",
            wanted[half],
            loaded as f64 / times.len() as f64,
            micros(times[half]),
            micros(times[times.len() - 1]),
        );
    }
    let (wanted, took) = most_wanted;
    println!(
        "\n- With {WANTED} wanted pages or more a decision in at most {MOST_MICROS} µs: {} ({wanted} pages, {took:.0} µs).",
        says(u64::from(wanted) >= WANTED && took <= MOST_MICROS),
    );
}

struct World {
    pager: Pager,
    geometry: Geometry,
    texture: TextureNumber,
    changes: Vec<vastex_core::TableChange>,
    tile: Bytes,
}

impl World {
    fn new() -> World {
        let mut pager =
            Pager::new(Budgets { upload_bytes_per_frame: 32 * TILE_BYTES, in_flight_bytes: 64 * TILE_BYTES });
        let pool = pager.add_pool(SLOTS, TILE_BYTES, Some(BiasRule::Solved)).unwrap();
        let geometry = Geometry::new(GeometrySpec::image(262_144, 131_072)).unwrap();
        let texture = TextureNumber::new(0).unwrap();
        pager.add_texture(pool, &geometry, None, None).unwrap();
        World { pager, geometry, texture, changes: Vec::new(), tile: Bytes::from(vec![0; 16]) }
    }

    fn feedback(&self, path: Path, frame: u64) -> Feedback {
        let mut view = path.view(frame);
        view.width = 0.03;
        view.feedback(self.texture, &self.geometry, [2560, 1440], frame, false)
    }

    fn decide(&mut self, frame: u64, feedback: &Feedback) {
        self.pager.begin_frame(frame);
        self.pager.observe(feedback);
        while let Some(page) = self.pager.poll_cancel() {
            self.pager.tile_cancelled(page);
        }
        while let Some(request) = self.pager.poll_request() {
            self.pager.tile_ready(request.page, self.tile.clone());
        }
        while self.pager.poll_upload().is_some() {}
        self.pager.take_table_changes(&mut self.changes);
        while self.pager.poll_event().is_some() {}
    }
}
