//! A volume of 10^15 voxels and four channels, whose values follow from a formula with detail at every level:
//! marches from the whole box to a voxel, beside the reference; and that a small volume takes no less memory
//! of the device. That of the process is in `huge_memory`.
//!
//! `VASTEX_MARCHES` says how many marches there are, and `VASTEX_SLICES` how many slices: the first are those
//! of the suite, the others lie by chance. `cargo xtask campaign` takes more of them. `100..200` instead of a
//! number takes the second hundred, so that several processes share them.

use std::cell::RefCell;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use glam::{DVec3, Vec3};
use vastex::source::{Codec, ReadError, ReadFuture, Tile};
use vastex::{
    Description, Geometry, LayerFormat, Pace, PagePos, PoolSettings, Settings, StoredLevel, TableChoice,
    TextureSettings, Textures, TileSource, ViewId, VoxelLevels,
};
use vastex_viewer::Gpu;
use vastex_viewer::stage::{Canvas, Frame, Pictures, StageView, TargetKind};
use vastex_viewer::volume::{
    VolumeBox, VolumeCamera, VolumeChannel, VolumeDesc, VolumeFace, VolumeMode, VolumePlane, VolumeRenderer,
    VolumeView,
};

use super::volume_reference::{ArrayChannel, ArrayLevel, coarser_picture};
use super::volume_world::{PICTURE, read, within};

/// Voxels along each side: 10^15 in all.
pub(super) const HUGE: u32 = 100_000;
/// 10^9.
pub(super) const SMALL: u32 = 1000;
const CHANNELS: u64 = 4;
/// Voxels of a brick along each side, and bytes of GPU memory for all of them.
const BRICK: u32 = 32;
const POOL: u64 = 256 << 20;
const SIZE: [u32; 2] = [40, 40];
/// Frames after which a picture must have converged.
const PATIENCE: usize = 4000;

/// Noise on cells of 4, 8, 16 and 32 voxels of the level: the next level has three of the four, and one that
/// is coarser.
fn code(level: u8, channel: u64, at: [i64; 3]) -> u16 {
    let octave = |n: u32| {
        let cell = at.map(|at| (at as u64) >> (n + 2));
        let mixed = [u64::from(level) + u64::from(n), channel, cell[0], cell[1], cell[2]].iter().fold(
            0x9e37_79b9_7f4a_7c15_u64,
            |state, number| {
                let mixed = (state ^ number).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                mixed ^ mixed >> 29
            },
        );
        mixed >> 50
    };
    (0..4).map(octave).sum::<u64>() as u16
}

/// Voxels along each side of the smallest of these cells, in which all have one value.
const CELL: i64 = 4;

/// Cells whose values a thread still knows.
const KNOWN: usize = 1 << 11;

type Cell = (u8, u64, [i64; 3]);

thread_local! {
    /// Values of the cells that were asked for last, each where its numbers say.
    static LAST: RefCell<Vec<Option<(Cell, u16)>>> = RefCell::new(vec![None; KNOWN]);
}

/// The same, for the reference, which looks at the same cells again and again.
fn code_again(level: u8, channel: u64, at: [i64; 3]) -> u16 {
    let cell = (level, channel, at.map(|at| at / CELL));
    let place = cell.2.iter().fold(channel as usize % 4, |place, n| place << 3 | (*n as usize & 7));
    LAST.with_borrow_mut(|last| match last[place] {
        Some((known, value)) if known == cell => value,
        _ => {
            let value = code(level, channel, at);
            last[place] = Some((cell, value));
            value
        }
    })
}

struct Formula {
    description: Arc<Description>,
    voxels: Arc<VoxelLevels>,
    channel: u64,
}

impl Formula {
    fn new(side: u32, channel: u64) -> Formula {
        let level = StoredLevel { size: [side.into(); 3], scale: [1.0; 3], origin: [0.0; 3] };
        let (geometry, voxels) = VoxelLevels::new(&[level], BRICK, 1).unwrap();
        let description = Arc::new(Description::one_layer(geometry, LayerFormat::R16));
        Formula { description, voxels: Arc::new(voxels), channel }
    }

    fn tile(&self, pos: PagePos) -> Tile {
        let geometry: &Geometry = &self.description.geometry;
        let [width, height, _] = geometry.tile().map(|n| n as usize);
        let mut tile = vec![0; self.description.tile_bytes()];
        for (level, level_box, offset) in geometry.tile_boxes(pos) {
            let coords = if geometry.is_tail(pos) { [0; 3] } else { [pos.x, pos.y, pos.z] };
            let first = self.voxels.level(level).first_voxel(coords);
            let size = self.voxels.level(level).size;
            let at = |a: usize, n: u32| (first[a] + i64::from(n)).clamp(0, i64::from(size[a]) - 1);
            let [nx, ny, nz] = level_box.size;
            // Rows that run through the same cells are the same.
            let (mut cells, mut values) = (None, Vec::new());
            for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
                let own = [at(1, y) / CELL, at(2, z) / CELL];
                if cells != Some(own) {
                    cells = Some(own);
                    let value = |x| code_again(level, self.channel, [at(0, x), at(1, y), at(2, z)]);
                    values = (0..nx).flat_map(|x| value(x).to_le_bytes()).collect();
                }
                let row = (offset[2] + z) as usize * height + (offset[1] + y) as usize;
                let row = (row * width + offset[0] as usize) * 2;
                tile[row..row + values.len()].copy_from_slice(&values);
            }
        }
        Tile { codec: Codec::Raw, bytes: tile.into() }
    }

    /// The levels, for the reference.
    fn levels(&self) -> Vec<ArrayLevel> {
        let channel = self.channel;
        let level = |(n, level): (usize, &vastex::VoxelLevel)| ArrayLevel {
            size: level.size,
            scale: level.scale,
            origin: level.origin,
            values: Vec::new(),
            formula: Some(Box::new(move |at| f64::from(code_again(n as u8, channel, at)) / 65535.0)),
        };
        self.voxels.levels().iter().enumerate().map(level).collect()
    }
}

impl TileSource for Formula {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            match self.description.geometry.contains(pos) {
                true => Ok(self.tile(pos)),
                false => Err(ReadError::NoSuchTile { pos }),
            }
        })
    }
}

pub(super) struct World {
    gpu: Gpu,
    pub(super) textures: Textures,
    formulas: Vec<Arc<Formula>>,
    desc: VolumeDesc,
    /// Pixels of its pictures.
    pub(super) size: [u32; 2],
}

impl World {
    pub(super) fn new(side: u32) -> World {
        World::with_uploads(side, 64 << 20, Settings::default().in_flight_bytes)
    }

    /// The same with so many bytes uploaded in a frame, and so many on their way: memory for these is
    /// held, too.
    pub(super) fn with_uploads(side: u32, upload_bytes_per_frame: u64, in_flight_bytes: u64) -> World {
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        let pace = Pace::LockStep { latency_frames: 1 };
        let pools = PoolSettings::of_bytes(POOL);
        let settings = Settings {
            pools,
            pace,
            whole_bytes: 0,
            upload_bytes_per_frame,
            in_flight_bytes,
            ..Settings::default()
        };
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings).unwrap();
        let formulas: Vec<Arc<Formula>> = (0..CHANNELS).map(|n| Arc::new(Formula::new(side, n))).collect();
        let colors = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::splat(0.4)];
        let mut channels = Vec::new();
        for (formula, color) in formulas.iter().zip(colors) {
            let voxels = Some(formula.voxels.clone());
            let own =
                TextureSettings { page_table: TableChoice::Hashed, voxels, ..TextureSettings::default() };
            let prepared = textures.preparer().read_blocking(formula.clone(), own).unwrap();
            let id = textures.add(prepared).unwrap();
            channels.push(VolumeChannel { color, opacity: 0.6, range: [0.2, 0.8], ..VolumeChannel::new(id) });
        }
        let of = VolumeBox { size: [side; 3], voxel: DVec3::ONE };
        let desc = VolumeDesc { is_exact: true, ..VolumeDesc::new(of, channels) };
        World { gpu, textures, formulas, desc, size: SIZE }
    }

    /// The converged picture of a march.
    pub(super) fn drawn(&mut self, mode: VolumeMode, density: f64, view: VolumeView) -> Vec<[u8; 4]> {
        let (renderer, canvas) = self.renderer(mode, density);
        match self.looked(&renderer, &canvas, view, u64::MAX) {
            Some(encoder) => read(&self.gpu, encoder, &canvas),
            None => unreachable!("no volume has as many bricks"),
        }
    }

    /// Looks from one place after the other, until so many bricks have been loaded; whether that came about.
    pub(super) fn explored(
        &mut self,
        (mode, density): (VolumeMode, f64),
        views: impl Iterator<Item = VolumeView>,
        bricks: u64,
    ) -> bool {
        let (renderer, canvas) = self.renderer(mode, density);
        for view in views {
            match self.looked(&renderer, &canvas, view, bricks) {
                Some(encoder) => drop(read(&self.gpu, encoder, &canvas)),
                None => return true,
            }
        }
        false
    }

    fn renderer(&mut self, mode: VolumeMode, density: f64) -> (VolumeRenderer, Canvas) {
        (self.desc.mode, self.desc.density) = (mode, density);
        let renderer =
            VolumeRenderer::new(&self.gpu, &mut self.textures, self.desc.clone(), PICTURE).unwrap();
        (renderer, Canvas::new(&self.gpu, self.size, PICTURE, TargetKind::Direct))
    }

    /// Looks from a place until that has converged, and gives the commands that draw it; or until so many
    /// bricks have been loaded.
    fn looked(
        &mut self,
        renderer: &VolumeRenderer,
        canvas: &Canvas,
        view: VolumeView,
        bricks: u64,
    ) -> Option<wgpu::CommandEncoder> {
        // Of what was drawn before nothing is to be waited for.
        self.textures.view_mut(ViewId::MAIN).unwrap().cut();
        for _ in 0..PATIENCE {
            let stats = self.textures.stats();
            if stats.pager.loaded >= bricks {
                return None;
            }
            let views = [StageView { view: ViewId::MAIN, camera: renderer.camera(), pose: view }];
            let pictures = if stats.converged { Pictures::Always } else { Pictures::ForFeedback };
            let frame =
                Frame { views: &views, expected: None, picture: self.size, has_feedback: true, pictures };
            let target = canvas.target();
            let encoder =
                frame.record(&self.gpu, &mut self.textures, renderer, &target, |_, _| Ok(())).unwrap();
            if stats.converged {
                return Some(encoder);
            }
            self.gpu.queue.submit([encoder.finish()]);
        }
        panic!("not converged: {:?}", self.textures.stats());
    }

    /// The mip bias of the last picture, in levels.
    fn mip_bias(&self) -> f64 {
        f64::from(self.textures.stats().pager.bias_eighths) / 8.0
    }

    /// What the last picture must be, at its mip bias: where rays meet more bricks than the pool holds, all
    /// is as much coarser.
    fn expected(&self, view: VolumeView) -> Vec<[f64; 3]> {
        let levels: Vec<Vec<ArrayLevel>> = self.formulas.iter().map(|formula| formula.levels()).collect();
        let channels: Vec<ArrayChannel<'_>> =
            self.desc.channels.iter().zip(&levels).map(|(channel, levels)| (*channel, &levels[..])).collect();
        coarser_picture(&self.desc, &channels, &view, self.size, self.mip_bias())
    }
}

/// The marches: the whole box, a voxel in the midst of it, and then by chance from anywhere to anywhere; each
/// with the density at which what glows hides what is twice as far away as the target.
fn march(nth: u64) -> (VolumeMode, f64, VolumeView) {
    let mut state = nth;
    let mut share = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    let side = f64::from(HUGE);
    let camera = |target: DVec3, away: DVec3| {
        VolumeView::Around(VolumeCamera { target, eye: target - away, down: DVec3::Z, half_height: 0.35 })
    };
    match nth {
        0 => (VolumeMode::Average, 1.0, VolumeView::Face(VolumeFace::PlusZ)),
        // Some twelve voxels away from one.
        1 => {
            let target = DVec3::new(61_234.5, 20_202.5, 81_111.5);
            (VolumeMode::Emission, 100.0, camera(target, DVec3::new(9.0, 7.0, -4.0)))
        }
        _ => {
            let target = DVec3::new(share(), share(), share()) * side;
            let toward = DVec3::new(share() - 0.5, share() - 0.5, 0.8 * (share() - 0.5));
            let away = 10.0_f64.powf(0.7 + 4.8 * share());
            let mode = [VolumeMode::Average, VolumeMode::Emission][(nth % 2) as usize];
            (mode, (1000.0 / away).max(1.0), camera(target, toward.normalize_or(DVec3::X) * away))
        }
    }
}

/// Which of the views a variable names: the first so many, or from one to another; `usual` where it says
/// nothing.
fn named(variable: &str, usual: u64) -> Range<u64> {
    let Ok(said) = std::env::var(variable) else { return 0..usual };
    let (first, end) = said.split_once("..").unwrap_or(("0", &said));
    let number = |digits: &str| digits.parse::<u64>().unwrap_or_else(|_| panic!("{variable}={said}"));
    number(first)..number(end)
}

#[test]
fn marches_from_the_whole_box_to_a_voxel_are_the_formula() {
    let mut world = World::new(HUGE);
    for nth in named("VASTEX_MARCHES", 2) {
        let (mode, density, view) = march(nth);
        let start = Instant::now();
        let drawn = world.drawn(mode, density, view);
        let until_drawn = start.elapsed().as_secs_f64();
        let expected = world.expected(view);
        let until_known = start.elapsed().as_secs_f64();
        let away = |(d, e): (&[u8; 4], &[f64; 3])| {
            (0..3).map(|c| (f64::from(d[c]) - e[c]).abs()).fold(0.0, f64::max)
        };
        let differences: Vec<f64> = drawn.iter().zip(&expected).map(away).collect();
        let seen = expected.iter().filter(|pixel| pixel.iter().any(|code| *code > 20.0)).count();
        assert!(seen > 200 || nth > 1, "march {nth}: only {seen} pixels are seen");
        assert!(world.mip_bias() == 0.0 || nth > 1, "march {nth} does not fit the pool");
        if let VolumeView::Face(_) = view {
            let within = differences.iter().filter(|d| **d <= 2.0).count() as f64 / drawn.len() as f64;
            assert!(within >= 0.999, "march {nth}: {within} within 2");
        }
        let squares: f64 = drawn
            .iter()
            .zip(&expected)
            .flat_map(|(d, e)| (0..3).map(move |c| (f64::from(d[c]) - e[c]).powi(2)))
            .sum();
        let psnr = 10.0 * (255.0_f64.powi(2) / (squares / (3 * drawn.len()) as f64).max(1e-9)).log10();
        println!(
            "march {nth}, {mode:?}: {psnr:.1} dB at mip bias {}, {seen} pixels seen; drawn in {until_drawn:.1} s, its reference in {:.1} s",
            world.mip_bias(),
            until_known - until_drawn
        );
        // A few rays that end too early cost a mean less than what is asked for, but more than rounding.
        let least = if matches!(mode, VolumeMode::Average) { 55.0 } else { 40.0 };
        assert!(psnr >= least, "march {nth}, {mode:?} of {view:?}: {psnr} dB");
    }
    let stats = world.textures.stats();
    assert!(stats.pool_bytes <= POOL, "{stats:?}");
}

/// A slice by chance: any place, upright on an axis or not, a pixel from a fifth of a voxel to a hundredth of
/// the box.
fn slice(nth: u64) -> VolumeView {
    let mut state = nth.wrapping_add(77);
    let mut share = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    let middle = (DVec3::new(share(), share(), share()) * f64::from(HUGE)).floor() + 0.5;
    let pixel = 10.0_f64.powf(-0.7 + 3.7 * share());
    let (right, down) = match nth % 4 {
        0 => (DVec3::X, DVec3::Y),
        1 => (DVec3::X, DVec3::Z),
        2 => (DVec3::Y, DVec3::Z),
        _ => {
            let right = DVec3::new(share() - 0.5, share() - 0.5, share() - 0.5).normalize_or(DVec3::X);
            (right, right.any_orthonormal_vector())
        }
    };
    VolumeView::Plane(VolumePlane { middle, right, down, pixel })
}

#[test]
fn slices_anywhere_are_the_formula() {
    let mut world = World::new(HUGE);
    for nth in named("VASTEX_SLICES", 4) {
        let view = slice(nth);
        let drawn = world.drawn(VolumeMode::Mip, 1.0, view);
        let (share, most) = within(&drawn, &world.expected(view), 2.0);
        println!("slice {nth}: {share} within 2, up to {most}");
        assert!(share >= 1.0, "slice {nth}, {view:?}: {share} within 2, up to {most}");
        let lit = drawn.iter().filter(|pixel| pixel[..3].iter().any(|code| *code > 20)).count();
        assert!(lit > 300 || nth > 3, "slice {nth}: only {lit} pixels are seen");
    }
}

#[test]
fn memory_of_the_device_does_not_grow_with_the_volume() {
    let [small, huge] = [SMALL, HUGE].map(|side| {
        let mut world = World::new(side);
        world.drawn(VolumeMode::Average, 1.0, VolumeView::Face(VolumeFace::PlusX));
        let stats = world.textures.stats();
        (stats.pool_bytes + stats.table_bytes) as f64
    });
    assert!(small > 0.9 * POOL as f64, "{small}");
    assert!((huge / small - 1.0).abs() < 0.05, "{huge} of {small} bytes");
}
