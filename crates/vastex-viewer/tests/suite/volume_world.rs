//! A volume in main memory, drawn without a window: what tests of pictures of volumes have in common.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use vastex::source::{Codec, ReadError, ReadFuture, Tile};
use vastex::{
    Description, Geometry, GeometrySpec, LayerFormat, Pace, PagePos, PoolSettings, PoolTuning, Region,
    Settings, StoredLevel, TableChoice, TextureId, TextureSettings, Textures, TileSource, ViewId,
    VolumeFilters, VoxelLevels,
};
use vastex_viewer::Gpu;
use vastex_viewer::stage::{
    Canvas, Frame, Pictures, StageScene, StageView, TargetKind, TextureRead, draw_again,
};
use vastex_viewer::volume::{
    VolumeBox, VolumeChannel, VolumeDesc, VolumeFace, VolumeMode, VolumeRenderer, VolumeView,
};

use super::volume_reference::{ArrayChannel, ArrayLevel, picture};

pub(crate) const PICTURE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Frames after which a picture must have converged.
pub(crate) const PATIENCE: usize = 2000;

/// A volume of one channel in main memory, all levels, as the nearest values that the format holds.
pub(crate) struct ArrayVolume {
    pub(crate) description: Arc<Description>,
    pub(crate) levels: Vec<ArrayLevel>,
    /// Where its voxels lie, where they are not its texels.
    pub(crate) voxels: Option<Arc<VoxelLevels>>,
}

impl ArrayVolume {
    pub(crate) fn new(
        geometry: Geometry,
        format: LayerFormat,
        value: impl Fn([f64; 3]) -> f64,
    ) -> ArrayVolume {
        let levels = geometry.levels().iter().map(|level| {
            let scale = level.scale.map(|scale| scale as f64);
            array_level(format, level.size, (scale, [0.0; 3]), &value)
        });
        let levels = levels.collect();
        let description = Arc::new(Description::one_layer(geometry, format));
        ArrayVolume { description, levels, voxels: None }
    }

    /// With levels as others store them: of any ratio, beginning anywhere.
    pub(crate) fn stored(
        levels: &[StoredLevel],
        format: LayerFormat,
        value: impl Fn([f64; 3]) -> f64,
    ) -> ArrayVolume {
        let (geometry, voxels) = VoxelLevels::new(levels, 16, 1).unwrap();
        let finest = voxels.level(0).scale;
        let levels = voxels.levels().iter().map(|level| {
            let scale = std::array::from_fn(|a| level.scale[a] / finest[a]);
            let origin = std::array::from_fn(|a| level.origin[a] / finest[a]);
            array_level(format, level.size, (scale, origin), &value)
        });
        let levels = levels.collect();
        let description = Arc::new(Description::one_layer(geometry, format));
        ArrayVolume { description, levels, voxels: Some(Arc::new(voxels)) }
    }

    pub(crate) fn tile(&self, pos: PagePos) -> Option<Tile> {
        let geometry = &self.description.geometry;
        if !geometry.contains(pos) {
            return None;
        }
        let format = self.description.layers[0].format;
        let (bytes, [width, height, _]) = (format.texel_bytes(), geometry.tile().map(|n| n as usize));
        let mut tile = vec![0; self.description.tile_bytes()];
        for (level, level_box, offset) in geometry.tile_boxes(pos) {
            let [nx, ny, nz] = level_box.size;
            for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
                for x in 0..nx {
                    let coords = if geometry.is_tail(pos) { [0; 3] } else { [pos.x, pos.y, pos.z] };
                    let first = match &self.voxels {
                        Some(voxels) => voxels.level(level).first_voxel(coords),
                        None => level_box.origin,
                    };
                    let at: [i64; 3] = std::array::from_fn(|a| first[a] + i64::from([x, y, z][a]));
                    let value = self.levels[usize::from(level)].voxel(at);
                    let [tx, ty, tz] = [offset[0] + x, offset[1] + y, offset[2] + z].map(|n| n as usize);
                    let to = ((tz * height + ty) * width + tx) * bytes;
                    tile[to..to + bytes].copy_from_slice(&encoded(format, value));
                }
            }
        }
        Some(Tile { codec: Codec::Raw, bytes: tile.into() })
    }
}

impl TileSource for ArrayVolume {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move { self.tile(pos).ok_or(ReadError::NoSuchTile { pos }) })
    }
}

/// A level whose values are those of a field, as a format has them; the places are in voxels of level 0.
pub(crate) fn array_level(
    format: LayerFormat,
    size: [u32; 3],
    (scale, origin): ([f64; 3], [f64; 3]),
    value: &impl Fn([f64; 3]) -> f64,
) -> ArrayLevel {
    let [nx, ny, nz] = size;
    let mut values = Vec::new();
    for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
        for x in 0..nx {
            let middle = [x, y, z].map(|n| f64::from(n) + 0.5);
            let value = value(std::array::from_fn(|a| origin[a] + middle[a] * scale[a]));
            values.push(decoded(format, &encoded(format, value)));
        }
    }
    ArrayLevel { size, scale, origin, values, formula: None }
}

pub(crate) fn encoded(format: LayerFormat, value: f64) -> Vec<u8> {
    match format {
        LayerFormat::R8 => vec![(value * 255.0).round() as u8],
        LayerFormat::R16 => ((value * 65535.0).round() as u16).to_le_bytes().to_vec(),
        LayerFormat::R32Float => (value as f32).to_le_bytes().to_vec(),
        other => panic!("{other:?}"),
    }
}

pub(crate) fn decoded(format: LayerFormat, bytes: &[u8]) -> f64 {
    match format {
        LayerFormat::R8 => f64::from(bytes[0]) / 255.0,
        LayerFormat::R16 => f64::from(u16::from_le_bytes([bytes[0], bytes[1]])) / 65535.0,
        _ => f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
    }
}

/// Waves with detail at every level, 0 to 1.
pub(crate) fn waves(phase: f64) -> impl Fn([f64; 3]) -> f64 {
    move |[x, y, z]| {
        let wave = (x * 0.31 + phase).sin() * (y * 0.23).cos() + (z * 0.4 + x * 0.05 + phase).sin();
        let fine = (x * 1.7).sin() * (y * 2.1).sin() * (z * 1.3).cos();
        (0.5 + 0.2 * wave + 0.1 * fine).clamp(0.0, 1.0)
    }
}

/// What is drawn, and what from.
pub(crate) struct World {
    pub(crate) gpu: Gpu,
    pub(crate) textures: Textures,
    pub(crate) volumes: Vec<Arc<ArrayVolume>>,
    pub(crate) ids: Vec<TextureId>,
    pub(crate) of: VolumeBox,
}

/// The pixels of a picture, once what is recorded is done.
pub(crate) fn read(gpu: &Gpu, encoder: wgpu::CommandEncoder, canvas: &Canvas) -> Vec<[u8; 4]> {
    let read = TextureRead::submit(gpu, encoder, canvas.picture(), 4);
    let timeout = Some(std::time::Duration::from_secs(300));
    gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout }).unwrap();
    let bytes = read.take().unwrap().unwrap();
    bytes.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect()
}

pub(crate) fn geometry(size: [u32; 3], page: u32) -> Geometry {
    Geometry::new(GeometrySpec { page, border: 1, ..GeometrySpec::volume(size) }).unwrap()
}

impl World {
    pub(crate) fn new(
        geometry: &Geometry,
        format: LayerFormat,
        channels: usize,
        slots: u64,
        table: TableChoice,
    ) -> World {
        let volume = |nth: usize| Arc::new(ArrayVolume::new(geometry.clone(), format, waves(nth as f64)));
        World::of((0..channels).map(volume).collect(), slots, table)
    }

    pub(crate) fn of(volumes: Vec<Arc<ArrayVolume>>, slots: u64, table: TableChoice) -> World {
        World::filtered(volumes, slots, table, None)
    }

    /// On a device that is taken to filter so.
    pub(crate) fn filtered(
        volumes: Vec<Arc<ArrayVolume>>,
        slots: u64,
        table: TableChoice,
        volume_filters: Option<VolumeFilters>,
    ) -> World {
        let tiles = volumes.iter().map(|volume| volume.clone() as Arc<dyn TileSource>).collect();
        World::read_from(tiles, volumes, slots, table, volume_filters)
    }

    /// Whose bricks come from other sources than the arrays.
    pub(crate) fn read_from(
        tiles: Vec<Arc<dyn TileSource>>,
        volumes: Vec<Arc<ArrayVolume>>,
        slots: u64,
        table: TableChoice,
        volume_filters: Option<VolumeFilters>,
    ) -> World {
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        let size = volumes[0].description.geometry.size();
        let bytes = Some(slots * volumes[0].description.tile_bytes() as u64);
        let pools = PoolSettings {
            default_pool: PoolTuning { bytes, ..PoolTuning::default() },
            ..PoolSettings::default()
        };
        let pace = Pace::LockStep { latency_frames: 1 };
        let settings = Settings { pools, pace, whole_bytes: 0, volume_filters, ..Settings::default() };
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings).unwrap();
        let mut add = |(volume, tiles): (&Arc<ArrayVolume>, Arc<dyn TileSource>)| {
            let voxels = volume.voxels.clone();
            let own = TextureSettings { page_table: table, voxels, ..TextureSettings::default() };
            let prepared = textures.preparer().read_blocking(tiles, own).unwrap();
            textures.add(prepared).unwrap()
        };
        let ids = volumes.iter().zip(tiles).map(&mut add).collect();
        let of = VolumeBox { size, voxel: DVec3::new(1.0, 1.0, 1.5) };
        World { gpu, textures, volumes, ids, of }
    }

    pub(crate) fn desc(&self, mode: VolumeMode) -> VolumeDesc {
        let colors = [Vec3::ONE, Vec3::new(1.0, 0.3, 0.1), Vec3::new(0.2, 0.5, 1.0)];
        let is_one = self.ids.len() == 1;
        let channel = |(nth, id): (usize, &TextureId)| VolumeChannel {
            color: colors[if is_one { 0 } else { nth % 3 }],
            range: [0.1, 0.9],
            opacity: if mode == VolumeMode::Emission { 0.3 } else { 1.0 },
            ..VolumeChannel::new(*id)
        };
        let channels = self.ids.iter().enumerate().map(channel).collect();
        VolumeDesc { mode, iso: 0.62, ..VolumeDesc::new(self.of, channels) }
    }

    /// The converged picture, and the frames that it took.
    pub(crate) fn drawn(
        &mut self,
        desc: VolumeDesc,
        view: VolumeView,
        size: [u32; 2],
    ) -> (Vec<[u8; 4]>, usize) {
        let renderer = VolumeRenderer::new(&self.gpu, &mut self.textures, desc, PICTURE).unwrap();
        let canvas = Canvas::new(&self.gpu, size, PICTURE, TargetKind::Direct);
        // Of what was drawn before nothing is to be waited for.
        self.textures.view_mut(ViewId::MAIN).unwrap().cut();
        let mut frames = 0;
        loop {
            let is_last = self.textures.stats().converged;
            assert!(frames < PATIENCE, "not converged: {:?}", self.textures.stats());
            let views = [StageView { view: ViewId::MAIN, camera: renderer.camera(), pose: view }];
            let pictures = if is_last { Pictures::Always } else { Pictures::ForFeedback };
            let frame = Frame { views: &views, expected: None, picture: size, has_feedback: true, pictures };
            let (gpu, target) = (&self.gpu, canvas.target());
            let encoder = frame.record(gpu, &mut self.textures, &renderer, &target, |_, _| Ok(())).unwrap();
            frames += 1;
            if !is_last {
                gpu.queue.submit([encoder.finish()]);
                continue;
            }
            return (read(gpu, encoder, &canvas), frames);
        }
    }

    /// Loads every brick of every level, whatever is seen, for pictures of which none is to wait.
    pub(crate) fn load_all(&mut self) {
        let whole = Region::whole();
        let tickets: Vec<_> =
            self.ids.iter().map(|id| self.textures.ahead().pin(*id, &whole).unwrap()).collect();
        for _ in 0..PATIENCE {
            self.textures.update().unwrap();
            if tickets.iter().all(|ticket| ticket.progress().resident == ticket.progress().pages) {
                return;
            }
        }
        panic!("not loaded: {:?}", tickets.iter().map(|ticket| ticket.progress()).collect::<Vec<_>>());
    }

    /// What draws pictures one after the other by one set of shaders.
    pub(crate) fn renderer(&mut self, desc: VolumeDesc) -> VolumeRenderer {
        VolumeRenderer::new(&self.gpu, &mut self.textures, desc, PICTURE).unwrap()
    }

    /// A picture of the bricks that are there; nothing is loaded for it.
    pub(crate) fn shot(&self, renderer: &VolumeRenderer, view: VolumeView, size: [u32; 2]) -> Vec<[u8; 4]> {
        renderer.place(renderer.camera(), &self.gpu.queue, &self.textures, &view, size);
        let canvas = Canvas::new(&self.gpu, size, PICTURE, TargetKind::Direct);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        draw_again(&mut encoder, &self.textures, renderer, renderer.camera(), &canvas.target());
        read(&self.gpu, encoder, &canvas)
    }

    /// The levels of all channels.
    pub(crate) fn levels(&self) -> Vec<&[ArrayLevel]> {
        self.volumes.iter().map(|volume| &*volume.levels).collect()
    }

    pub(crate) fn arrays(&self, desc: &VolumeDesc) -> Vec<ArrayChannel<'_>> {
        desc.channels.iter().zip(&self.volumes).map(|(channel, volume)| (*channel, &*volume.levels)).collect()
    }

    /// The share of pixels within so many codes of the reference, and the largest difference.
    pub(crate) fn compare(
        &mut self,
        desc: &VolumeDesc,
        view: VolumeView,
        size: [u32; 2],
        most: f64,
    ) -> (f64, f64) {
        let (drawn, _) = self.drawn(desc.clone(), view, size);
        let expected = picture(desc, &self.arrays(desc), &view, size);
        assert!(expected.iter().any(|p| p[0] > 60.0), "there is something to be seen");
        within(&drawn, &expected, most)
    }
}

/// The share of pixels within so many codes of what they must be, and the largest difference.
pub(crate) fn within(drawn: &[[u8; 4]], expected: &[[f64; 3]], most: f64) -> (f64, f64) {
    let difference = |(drawn, expected): (&[u8; 4], &[f64; 3])| {
        (0..3).map(|c| (f64::from(drawn[c]) - expected[c]).abs()).fold(0.0, f64::max)
    };
    let differences: Vec<f64> = drawn.iter().zip(expected).map(difference).collect();
    let within = differences.iter().filter(|d| **d <= most).count() as f64 / drawn.len() as f64;
    (within, differences.iter().copied().fold(0.0, f64::max))
}

/// How near a picture is to what it must be, in dB.
pub(crate) fn psnr(drawn: &[[u8; 4]], expected: &[[f64; 3]]) -> f64 {
    let squares: f64 = drawn
        .iter()
        .zip(expected)
        .flat_map(|(d, e)| (0..3).map(move |c| (f64::from(d[c]) - e[c]).powi(2)))
        .sum();
    10.0 * (255.0f64.powi(2) / (squares / (3 * drawn.len()) as f64).max(1e-9)).log10()
}

/// The pixels of a face, or of a slice seen as it is, of so many voxels each.
pub(crate) fn face_size(of: &VolumeBox, face: VolumeFace, voxels: f64) -> [u32; 2] {
    let [right, down, _] = face.axes();
    let size = glam::UVec3::from_array(of.size).as_dvec3();
    [right, down].map(|axis| (axis.dot(size).abs() / voxels).round() as u32)
}
