//! Rays through a volume in bricks, in each mode, beside the same volume as one ordinary 3-D texture; and
//! what the feedback of rays adds.

use std::fmt::Write as _;
use std::sync::Arc;

use anyhow::{Result, bail};
use glam::DVec3;
use vastex::source::{Codec, ReadError, ReadFuture, Tile};
use vastex::{
    BindGroups, Description, Geometry, GeometrySpec, LayerFormat, Pace, PagePos, PoolSettings, Region,
    Settings, TextureId, TextureSettings, Textures, TileSource, ViewId,
};
use vastex_viewer::stage::{Canvas, StageScene, TargetKind, draw_again};
use vastex_viewer::volume::{
    VolumeBox, VolumeCamera, VolumeChannel, VolumeDesc, VolumeMode, VolumeRenderer, VolumeView,
};

use crate::world::{Bench, Part};

/// Draws of each kind, in turns.
const ROUNDS: usize = 9;
/// Sides of bricks: those of large pools and of small ones.
const BRICKS: [u32; 2] = [64, 32];
/// Frames within which all of it is in the pool.
const PATIENCE_FRAMES: usize = 2000;
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// What is shown, and of how many channels.
const SHOWN: [(VolumeMode, usize); 6] = [
    (VolumeMode::Mip, 1),
    (VolumeMode::Minip, 1),
    (VolumeMode::Average, 1),
    (VolumeMode::Emission, 1),
    (VolumeMode::Emission, 3),
    (VolumeMode::Iso, 1),
];

pub(crate) fn section(bench: &Bench) -> Result<Part> {
    let (side, size) = if bench.gpu.is_processor() { (128, [96, 54]) } else { (256, [1920, 1080]) };
    let [large, small] = BRICKS;
    let mut page = format!(
        "## Volumes\n\nA picture of {}x{} of a volume of {side} voxels a side, seen whole in perspective: as one brick, which is an ordinary 3-D texture\n\
         with nothing to look up, and times that in bricks of {large} and of {small} voxels a side. Every brick is resident. The last two columns are what the\n\
         feedback of rays adds to the picture in bricks of {small}. {ROUNDS} draws of each, in turns: times are medians, a ratio is the median of those within a turn,\n\
         and the last column is a ratio of medians.\n\n\
         | mode, of how many channels | one brick ms | bricks of {large} | bricks of {small} | feedback ms | of the picture |\n|---|---|---|---|---|---|\n",
        size[0], size[1],
    );
    let mut volumes = Vec::new();
    for brick in [side, large, small] {
        volumes.push(Resident::new(bench, side, brick.min(side))?);
    }
    for (mode, channels) in SHOWN {
        let mut shown = Vec::new();
        for volume in &mut volumes {
            shown.push(volume.renderer(bench, mode, channels, size)?);
        }
        let canvas = Canvas::new(&bench.gpu, size, FORMAT, TargetKind::Direct);
        let draws: Vec<_> =
            volumes.iter().zip(&shown).map(|(volume, shown)| volume.draw(shown, &canvas)).collect();
        let recorded: Vec<&dyn Fn(&mut wgpu::CommandEncoder)> = draws.iter().map(|draw| draw as _).collect();
        let times = bench.clock.in_turns(&bench.gpu, &recorded, ROUNDS);
        drop(recorded);
        drop(draws);
        let ms = |nth: usize| times[nth].iter().map(|time| 1e3 * time.as_secs_f64());
        let ratio = |nth: usize| median(ms(nth).zip(ms(0)).map(|(bricks, whole)| bricks / whole).collect());
        let picture = median(ms(2).collect());
        let feedback = volumes[2].feedback(bench, &shown[2], size)?;
        writeln!(
            page,
            "| {}, {channels} | {:.2} | {:.2} | {:.2} | {feedback:.2} | {:.2} |",
            mode.name(),
            median(ms(0).collect()),
            ratio(1),
            ratio(2),
            feedback / picture,
        )?;
    }
    Ok((page, Vec::new()))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// A volume of which every brick is in the pool.
struct Resident {
    textures: Textures,
    id: TextureId,
    of: VolumeBox,
}

impl Resident {
    fn new(bench: &Bench, side: u32, brick: u32) -> Result<Resident> {
        let source = Arc::new(Waves::new(side, brick)?);
        let settings = Settings {
            pools: PoolSettings::of_bytes(128 << 20),
            upload_bytes_per_frame: 32 << 20,
            pace: Pace::LockStep { latency_frames: 1 },
            whole_bytes: 0,
            ..Settings::default()
        };
        let mut textures = Textures::new(&bench.gpu.device, &bench.gpu.queue, settings)?;
        let prepared = textures.preparer().read_blocking(source, TextureSettings::default())?;
        let id = textures.add(prepared)?;
        let ticket = textures.ahead().pin(id, &Region::whole())?;
        for _ in 0..PATIENCE_FRAMES {
            textures.update()?;
            if ticket.progress().resident == ticket.progress().pages {
                let of = VolumeBox { size: [side; 3], voxel: DVec3::ONE };
                return Ok(Resident { textures, id, of });
            }
        }
        bail!("a volume is not in its pool after {PATIENCE_FRAMES} frames: {:?}", ticket.progress())
    }

    /// What draws it, with a camera that sees all of it.
    fn renderer(
        &mut self,
        bench: &Bench,
        mode: VolumeMode,
        channels: usize,
        size: [u32; 2],
    ) -> Result<VolumeRenderer> {
        let is_emission = mode == VolumeMode::Emission;
        let channel = VolumeChannel {
            range: [0.3, 0.9],
            opacity: if is_emission { 0.3 } else { 1.0 },
            ..VolumeChannel::new(self.id)
        };
        let desc = VolumeDesc { mode, iso: 0.62, ..VolumeDesc::new(self.of, vec![channel; channels]) };
        let renderer = VolumeRenderer::new(&bench.gpu, &mut self.textures, desc, FORMAT)?;
        let camera = VolumeCamera::around(&self.of, [0.5, 0.8, 0.35], [0.0, 0.0, 1.0]);
        let (queue, view) = (&bench.gpu.queue, VolumeView::Around(camera));
        renderer.place(renderer.camera(), queue, &self.textures, &view, size);
        let bricks = renderer.bricks_of_a_ray(renderer.camera());
        self.textures.view_mut(ViewId::MAIN)?.set_bricks_of_a_ray(bricks);
        Ok(renderer)
    }

    /// Records its picture.
    fn draw(&self, shown: &VolumeRenderer, canvas: &Canvas) -> impl Fn(&mut wgpu::CommandEncoder) {
        |encoder| draw_again(encoder, &self.textures, shown, shown.camera(), &canvas.target())
    }

    /// What its feedback takes in a frame, in milliseconds: the median of several frames.
    fn feedback(&mut self, bench: &Bench, shown: &VolumeRenderer, size: [u32; 2]) -> Result<f64> {
        let mut times = Vec::with_capacity(ROUNDS);
        for _ in 0..ROUNDS {
            self.textures.update()?;
            let mut result = Ok(());
            let wanted = |pass: &mut wgpu::RenderPass<'_>, groups: &BindGroups| {
                if let Some(group) = groups.get(shown.sampled()) {
                    shown.draw_wanted(shown.camera(), pass, group);
                }
            };
            let taken = bench
                .clock
                .time(&bench.gpu, |encoder| result = self.textures.feedback(encoder, size, wanted));
            result?;
            times.push(1e3 * taken.as_secs_f64());
        }
        Ok(median(times))
    }
}

/// A volume of 8 bits of waves with detail at every level, made when it is read.
struct Waves(Arc<Description>);

impl Waves {
    fn new(side: u32, brick: u32) -> Result<Waves> {
        let spec = GeometrySpec { page: brick, border: 1, ..GeometrySpec::volume([side; 3]) };
        Ok(Waves(Arc::new(Description::one_layer(Geometry::new(spec)?, LayerFormat::R8))))
    }

    /// The value of a voxel of a level.
    fn value(&self, level: u8, voxel: [i64; 3]) -> u8 {
        let [x, y, z] = voxel.map(|at| (at as f64 + 0.5) * f64::from(1u32 << level));
        let wave = (x * 0.031).sin() * (y * 0.023).cos() + (z * 0.04 + x * 0.005).sin();
        let fine = (x * 0.17).sin() * (y * 0.21).sin() * (z * 0.13).cos();
        (255.0 * (0.5 + 0.2 * wave + 0.1 * fine)).clamp(0.0, 255.0) as u8
    }
}

impl TileSource for Waves {
    fn description(&self) -> &Arc<Description> {
        &self.0
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            let geometry = &self.0.geometry;
            if !geometry.contains(pos) {
                return Err(ReadError::NoSuchTile { pos });
            }
            let [width, height, _] = geometry.tile().map(|n| n as usize);
            let mut tile = vec![0; self.0.tile_bytes()];
            for (level, held, offset) in geometry.tile_boxes(pos) {
                let [columns, rows, slices] = held.size;
                for (z, y, x) in (0..slices)
                    .flat_map(|z| (0..rows).flat_map(move |y| (0..columns).map(move |x| (z, y, x))))
                {
                    let [tx, ty, tz] = [offset[0] + x, offset[1] + y, offset[2] + z].map(|n| n as usize);
                    let voxel = std::array::from_fn(|a| held.origin[a] + i64::from([x, y, z][a]));
                    tile[(tz * height + ty) * width + tx] = self.value(level, voxel);
                }
            }
            Ok(Tile { codec: Codec::Raw, bytes: tile.into() })
        })
    }
}
