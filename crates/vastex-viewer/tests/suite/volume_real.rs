//! The real head and the real nuclei of `assets/volumes`, brick by brick as they are read, beside the
//! reference over their whole arrays: every mode from every face, on two levels, and in perspective.

use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use pollster::block_on;
use vastex::{TableChoice, TileSource, VoxelLevel};
use vastex_viewer::volume::{
    VolumeBox, VolumeCamera, VolumeChannel, VolumeDesc, VolumeFace, VolumeMode, VolumeView,
};
use vastex_volume::{Opened, SliceAxis, VolumeOptions, VolumeSource};

use super::volume_reference::{ArrayLevel, pictures};
use super::volume_world::{ArrayVolume, World, face_size, psnr, within};

/// Voxels along a side of a brick: several along each axis.
const BRICK: u32 = 32;

/// One of the real volumes, all channels of it.
pub(crate) fn real(name: &str) -> World {
    real_in_bricks(name, BRICK, 700)
}

/// The same in bricks of so many voxels along a side, in a pool of so many slots.
pub(crate) fn real_in_bricks(name: &str, brick: u32, slots: u64) -> World {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/volumes").join(name);
    let volume = match vastex_volume::open(&path).unwrap() {
        Opened::Volume(volume) => Arc::new(*volume),
        Opened::Images(list) => panic!("{list:?}"),
    };
    let open = |channel| {
        let options = VolumeOptions { channel, brick, ..VolumeOptions::default() };
        Arc::new(VolumeSource::open(volume.clone(), &options).unwrap())
    };
    let sources: Vec<Arc<VolumeSource>> = (0..volume.about().channels).map(open).collect();
    let array = |source: &Arc<VolumeSource>| {
        let (levels, voxels) = (arrays(source), Some(source.levels().clone()));
        Arc::new(ArrayVolume { description: source.description().clone(), levels, voxels })
    };
    let arrays = sources.iter().map(array).collect();
    let tiles = sources.into_iter().map(|source| source as Arc<dyn TileSource>).collect();
    let mut world = World::read_from(tiles, arrays, slots, TableChoice::BySize, None);
    let scale = DVec3::from_array(volume.about().levels[0].scale);
    world.of = VolumeBox { voxel: scale / scale.max_element(), ..world.of };
    world
}

/// All levels: the stored one, and means of it made here.
fn arrays(source: &VolumeSource) -> Vec<ArrayLevel> {
    let finest = source.levels().level(0);
    let [nx, ny, nz] = finest.size;
    let planes = (0..nz).map(|z| block_on(source.slice(0, SliceAxis::Z, z, [0, 0], [nx, ny])).unwrap());
    let stored = planes.collect::<Vec<_>>().concat();
    let bytes = source.volume().about().dtype.bytes();
    let mut codes: Vec<u64> = match bytes {
        1 => stored.into_iter().map(u64::from).collect(),
        _ => stored.as_chunks::<2>().0.iter().map(|code| u16::from_le_bytes(*code).into()).collect(),
    };
    let (most, mut size) = (((1_u64 << (8 * bytes)) - 1) as f64, finest.size);
    let level = |(nth, level): (usize, &VoxelLevel)| {
        if nth > 0 {
            codes = halved(&codes, size);
            size = size.map(|side| side.div_ceil(2));
        }
        assert_eq!(size, level.size);
        ArrayLevel {
            size,
            scale: std::array::from_fn(|a| level.scale[a] / finest.scale[a]),
            origin: std::array::from_fn(|a| (level.origin[a] - finest.origin[a]) / finest.scale[a]),
            values: codes.iter().map(|code| *code as f64 / most).collect(),
            formula: None,
        }
    };
    source.levels().levels().iter().enumerate().map(level).collect()
}

/// Means of 2x2x2 voxels, halves upwards; the last of an odd number stands for itself.
fn halved(codes: &[u64], size: [u32; 3]) -> Vec<u64> {
    let [nx, ny, nz] = size.map(|side| side as usize);
    let mut halves = Vec::new();
    for (z, y) in (0..nz.div_ceil(2)).flat_map(|z| (0..ny.div_ceil(2)).map(move |y| (z, y))) {
        for x in 0..nx.div_ceil(2) {
            let (mut sum, mut count) = (0, 0);
            for corner in 0..8 {
                let at = [2 * x + (corner & 1), 2 * y + (corner >> 1 & 1), 2 * z + (corner >> 2)];
                if at[0] < nx && at[1] < ny && at[2] < nz {
                    (sum, count) = (sum + codes[(at[2] * ny + at[1]) * nx + at[0]], count + 1);
                }
            }
            halves.push((2 * sum + count) / (2 * count));
        }
    }
    halves
}

/// The look of all channels by a mode: less light of each where there are several, so that none hides
/// another.
fn desc(world: &World, mode: VolumeMode) -> VolumeDesc {
    let colors = [Vec3::ONE, Vec3::new(1.0, 0.5, 0.0), Vec3::new(0.0, 0.5, 1.0)];
    let opacity = if world.ids.len() > 1 { 0.35 } else { 0.9 };
    let channel = |(id, color): (&_, Vec3)| VolumeChannel {
        color,
        range: if mode == VolumeMode::Minip { [0.0, 0.1] } else { [0.03, 0.7] },
        opacity,
        ..VolumeChannel::new(*id)
    };
    let channels = world.ids.iter().zip(colors).map(channel).collect();
    // Between two codes, so that no rounding says on which side a voxel is.
    let iso = 0.3 + 0.5 / 255.0;
    VolumeDesc { mode, iso, ..VolumeDesc::new(world.of, channels) }
}

#[test]
fn every_mode_of_the_real_volumes_is_the_reference() {
    for (nth_volume, name) in ["head.zip", "nuclei.zip"].into_iter().enumerate() {
        let mut world = real(name);
        let exact = VolumeDesc { is_exact: true, ..desc(&world, VolumeMode::Mip) };
        let mut renderers = [world.renderer(exact), world.renderer(desc(&world, VolumeMode::Mip))];
        world.load_all();
        for (nth, face) in VolumeFace::ALL.into_iter().enumerate() {
            // Voxels along a pixel: of level 0 and of level 1.
            let size = face_size(&world.of, face, [1.9, 2.7, 1.8][nth / 2]);
            let view = VolumeView::Face(face);
            // Of the two volumes one is seen so and the other from behind; but minima of the head, which has
            // air around it, are those of the air.
            let is_turn = |(mode, name): &(usize, VolumeMode)| match name {
                VolumeMode::Minip => nth_volume == 1,
                _ => (mode + nth + nth_volume).is_multiple_of(2),
            };
            let modes = VolumeMode::ALL.into_iter().enumerate().filter(is_turn);
            let descs: Vec<VolumeDesc> = modes.map(|(_, mode)| desc(&world, mode)).collect();
            let expected = pictures(&descs, &world.levels(), &view, size);
            for (renderer, (share, codes)) in renderers.iter_mut().zip([(0.999, 2.0), (0.99, 4.0)]) {
                for (desc, expected) in descs.iter().zip(&expected) {
                    let is_exact = renderer.desc().is_exact;
                    renderer.set(VolumeDesc { is_exact, ..desc.clone() });
                    let (is, most) = within(&world.shot(renderer, view, size), expected, codes);
                    let what = format!("{name} from {face}, {size:?}, {:?}, exact: {is_exact}", desc.mode);
                    assert!(is >= share, "{what}: {is} within {codes}, up to {most}");
                }
            }
        }
    }
}

/// A camera anywhere around a volume, as far away as sees all of it, or down to a twentieth as far, which is
/// within it; and the pixels of its picture.
fn camera_by_chance(of: &VolumeBox, nth: u64) -> (VolumeCamera, [u32; 2]) {
    let mut state = nth;
    let mut share = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    let [toward, down] = [(); 2].map(|()| [(); 3].map(|()| share() - 0.5));
    let camera = VolumeCamera::around(of, toward, down);
    let nearer = 0.05 + 0.95 * share();
    let eye = camera.target + (camera.eye - camera.target) * nearer;
    let size = [(); 2].map(|()| 40 + (70.0 * share()) as u32);
    (VolumeCamera { eye, ..camera }, size)
}

/// Rays of a picture that may graze a surface, which one more weight of 1/256 in a GPU's filter makes them
/// meet or miss.
const GRAZING: usize = 2;

/// Takes so many of the pixels that differ most to be as they are expected.
fn pass_over(drawn: &mut [[u8; 4]], expected: &[[f64; 3]], count: usize) {
    let apart = |n: usize| (0..3).map(|c| (f64::from(drawn[n][c]) - expected[n][c]).abs()).sum::<f64>();
    let mut places: Vec<(usize, f64)> = (0..drawn.len()).map(|n| (n, apart(n))).collect();
    places.sort_by(|a, b| b.1.total_cmp(&a.1));
    for (n, _) in places.into_iter().take(count) {
        (0..3).for_each(|c| drawn[n][c] = expected[n][c].round() as u8);
    }
}

/// Surfaces of the nuclei are rough: one sample of a ray that lies elsewhere, or is of another level,
/// often is another picture. Levels change along rays in all three pictures of them. `VASTEX_AROUND` says
/// how many more there are, by chance (`cargo xtask campaign`).
#[test]
fn every_mode_of_the_real_volumes_in_perspective_is_the_reference() {
    let more = std::env::var("VASTEX_AROUND").ok().and_then(|count| count.parse().ok()).unwrap_or(0);
    for (name, sizes) in [("head.zip", &[[64, 56]][..]), ("nuclei.zip", &[[48, 40], [64, 56], [96, 80]])] {
        let mut world = real(name);
        let usual = VolumeCamera::around(&world.of, [1.0, 0.7, 0.5], [0.0, 0.0, 1.0]);
        let descs = VolumeMode::ALL.map(|mode| desc(&world, mode));
        let of_filter = |is_exact| world.renderer(VolumeDesc { is_exact, ..descs[0].clone() });
        let mut renderers = [true, false].map(of_filter);
        world.load_all();
        let by_chance = (0..more).map(|nth| camera_by_chance(&world.of, nth));
        for (nth, (camera, size)) in sizes.iter().map(|size| (usual, *size)).chain(by_chance).enumerate() {
            let is_usual = nth < sizes.len();
            let view = VolumeView::Around(camera);
            let expected = pictures(&descs, &world.levels(), &view, size);
            for renderer in &mut renderers {
                for (desc, expected) in descs.iter().zip(&expected) {
                    let is_exact = renderer.desc().is_exact;
                    renderer.set(VolumeDesc { is_exact, ..desc.clone() });
                    let mut drawn = world.shot(renderer, view, size);
                    if desc.mode == VolumeMode::Iso && !is_exact && !world.gpu.is_processor() {
                        pass_over(&mut drawn, expected, GRAZING);
                    }
                    let db = psnr(&drawn, expected);
                    println!("{name}, {size:?}, {:?}, exact: {is_exact}: {db:.1} dB", desc.mode);
                    let what = format!("{name}, {view:?}, {size:?}, {:?}, exact: {is_exact}", desc.mode);
                    let least = if is_usual { 50.0 } else { 40.0 };
                    assert!(db >= least, "{what}: {db:.1} dB");
                }
            }
        }
    }
}
