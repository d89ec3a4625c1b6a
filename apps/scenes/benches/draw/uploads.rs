//! What uploads cost the frame's thread: through the queue, and from a belt that other threads have filled.

use std::fmt::Write as _;
use std::time::Duration;

use anyhow::{Context, Result};
use vastex::{Description, Geometry, GeometrySpec, LayerFormat};
use vastex_core::{PoolLayout, Slot};
use vastex_wgpu::{Belt, BeltTile, Pool, limits};

use crate::world::{Bench, Part, Verdict, thread_time};

/// Bytes of tiles in a frame: the default budget.
const FRAME_BYTES: u64 = 2 << 20;
/// Frames of each measurement, and of what is not measured before.
const FRAMES: u32 = 60;
const WARM: u32 = 5;
const ROUNDS: u32 = 5;
/// Of the queue's time, the belt's at most: it is the default.
const ASKED: f64 = 1.0;

pub(crate) fn section(bench: &Bench) -> Result<Part> {
    let mut page = "## Uploads\n\nProcessor time of the frame's thread for each MiB of tiles (pages of 128 texels, borders of 4, 2 MiB a frame): through the \
         queue, which makes, fills and destroys a buffer for each tile, and from a belt, for which the loader's threads copy them. \
         Waiting for the adapter is not counted, nor is what it does. In real time tiles go by the belt, of which the frame asks for no more \
         time than of the queue.\n\n\
         | format | tile KiB | room KiB | queue us | belt us | belt / queue | copying, on the loader's threads us |\n\
         |---|---|---|---|---|---|---|\n"
        .to_owned();
    let mut verdicts = Vec::new();
    for format in
        [LayerFormat::Bc1, LayerFormat::R8, LayerFormat::Rg8, LayerFormat::Rgba8, LayerFormat::Rgba16Float]
    {
        let geometry = Geometry::new(GeometrySpec::image(10_000, 10_000))?;
        let description = Description::one_layer(geometry, format);
        let device = &bench.gpu.device;
        let tile_bytes = description.tile_bytes() as u64;
        let tiles = (FRAME_BYTES / tile_bytes) as u32;
        let layout = PoolLayout::fit(&description, 2 * FRAME_BYTES, limits(device))?;
        let pool = Pool::new(device, &bench.gpu.queue, &layout, &description.layers)?;
        let belt = Belt::new(device, 64 << 20);
        let mut world =
            World { bench, pool, belt, tiles, bytes: vec![77; tile_bytes as usize], copying: Duration::ZERO };
        let mib = f64::from(tiles) * tile_bytes as f64 * f64::from(FRAMES) / f64::from(1 << 20);
        let (mut queue, mut by_belt, mut copying) = (Duration::MAX, Duration::MAX, Duration::MAX);
        for _ in 0..ROUNDS {
            queue = queue.min(world.frames(World::by_queue)?);
            world.copying = Duration::ZERO;
            by_belt = by_belt.min(world.frames(World::by_belt)?);
            copying = copying.min(world.copying);
        }
        let [queue, by_belt, copying] = [queue, by_belt, copying].map(|time| time.as_secs_f64() * 1e6 / mib);
        writeln!(
            page,
            "| {} | {:.0} | {:.0} | {queue:.0} | {by_belt:.0} | {:.2} | {copying:.0} |",
            format.name(),
            tile_bytes as f64 / 1024.0,
            world.pool.belt_layout().bytes() as f64 / 1024.0,
            by_belt / queue,
        )?;
        let what =
            format!("a frame's time for tiles of {} by the belt, of that through the queue", format.name());
        verdicts.push(Verdict::at_most(ASKED, what, by_belt / queue));
    }
    Ok((page, verdicts))
}

struct World<'a> {
    bench: &'a Bench,
    pool: Pool,
    belt: Belt,
    tiles: u32,
    bytes: Vec<u8>,
    /// What it took to fill the belt.
    copying: Duration,
}

impl World<'_> {
    /// The time of some frames, each of which is over before the next begins.
    fn frames(&mut self, frame: impl Fn(&mut Self) -> Result<Duration>) -> Result<Duration> {
        for _ in 0..WARM {
            frame(self)?;
        }
        self.copying = Duration::ZERO;
        (0..FRAMES).map(|_| frame(self)).sum()
    }

    fn by_queue(&mut self) -> Result<Duration> {
        let start = thread_time();
        for slot in 0..self.tiles {
            self.pool.upload(&self.bench.gpu.queue, Slot::new(slot), &self.bytes)?;
        }
        self.bench.gpu.queue.submit([]);
        self.end()?;
        Ok(thread_time().saturating_sub(start))
    }

    fn by_belt(&mut self) -> Result<Duration> {
        let start = thread_time();
        let put = || self.belt.put(self.pool.belt_layout(), &self.bytes).context("no room on the belt");
        let tiles: Vec<BeltTile> = (0..self.tiles).map(|_| put()).collect::<Result<_>>()?;
        self.copying += thread_time().saturating_sub(start);
        let start = thread_time();
        let mut encoder = self.bench.gpu.device.create_command_encoder(&Default::default());
        for (slot, tile) in (0..).zip(&tiles) {
            self.pool.upload_from(&mut encoder, Slot::new(slot), tile)?;
        }
        self.bench.gpu.queue.submit([encoder.finish()]);
        drop(tiles);
        self.end()?;
        Ok(thread_time().saturating_sub(start))
    }

    /// Waits, and lets the device clear up.
    fn end(&self) -> Result<()> {
        self.bench.gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(())
    }
}
