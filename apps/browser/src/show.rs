//! The pictures: what is seen in each, and the frames until all bricks of it are there.

use std::sync::Arc;

use glam::DVec3;
use vastex::source::{Container, ContainerError, MemoryStore};
use vastex::{
    Error, Event, PoolSettings, PoolTuning, Settings, TextureId, TextureSettings, Textures, TileSource,
    ViewId,
};
use vastex_viewer::stage::{Canvas, Frame, Pictures, ReadBackError, StageView, TargetKind, TextureRead};
use vastex_viewer::volume::{
    VolumeBox, VolumeChannel, VolumeDesc, VolumeError, VolumeFace, VolumeMode, VolumePlane, VolumeRenderer,
    VolumeView, volume_tables,
};
use vastex_viewer::{Gpu, GpuSetupError};

use crate::source::ContainerTexture;

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// GPU memory for bricks.
const POOL_BYTES: u64 = 48 << 20;
/// Frames after which a picture must have converged, and then have come back.
const PATIENCE: u32 = 30_000;
/// The colours of the channels, in turn.
const COLORS: [[u8; 3]; 3] = [[255, 255, 255], [255, 90, 30], [40, 130, 255]];
/// How much light each adds, so that all together are seldom more than a picture can show.
const OPACITY: f32 = 0.3;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum ShowError {
    /// There is no device.
    #[error(transparent)]
    Gpu(#[from] GpuSetupError),
    /// The bytes are no container.
    #[error(transparent)]
    Container(#[from] ContainerError),
    /// They are one of an image.
    #[error("{0} is a container of an image; build one of a volume")]
    Image(String),
    /// The textures fail.
    #[error(transparent)]
    Textures(#[from] Error),
    /// They refuse a channel.
    #[error(transparent)]
    Add(#[from] vastex::AddError),
    /// The channels cannot be drawn together.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// A brick could not be read.
    #[error("a brick is missing: {0}")]
    Brick(String),
    /// What was drawn is not to be had.
    #[error(transparent)]
    ReadBack(#[from] ReadBackError),
    /// It takes too long.
    #[error("the picture '{name}' has not come in {frames} frames; {missing} bricks are missing")]
    Late {
        /// Which picture.
        name: &'static str,
        /// After how many frames.
        frames: u32,
        /// Bricks that are wanted and not there.
        missing: u32,
    },
}

/// A picture: codes of sRGB, red, green, blue and alpha, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Drawn {
    /// What it is called.
    pub name: &'static str,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Four bytes a pixel.
    pub pixels: Vec<u8>,
    /// Frames that it took.
    pub frames: u32,
    /// Bricks that are in GPU memory by then, those of the pictures before it included.
    pub bricks: u32,
}

/// What one picture shows.
struct Sight {
    name: &'static str,
    mode: VolumeMode,
    view: VolumeView,
    size: [u32; 2],
}

/// A picture under way.
struct Drawing {
    sight: Sight,
    renderer: VolumeRenderer,
    canvas: Canvas,
    frames: u32,
    /// What is on its way back, once everything was there.
    read: Option<TextureRead>,
}

/// The pictures of a volume, one after the other.
pub struct Show {
    gpu: Gpu,
    textures: Textures,
    of: VolumeBox,
    channels: Vec<VolumeChannel>,
    /// The last one comes next.
    left: Vec<Sight>,
    drawing: Option<Drawing>,
}

impl Show {
    /// Opens the bytes of a container with a device of its own. Errors call the container `name`.
    pub async fn open(name: &str, container: Vec<u8>) -> Result<Show, ShowError> {
        let container = Container::open(Arc::new(MemoryStore::new(name, container))).await?;
        if container.volume().is_none() {
            return Err(ShowError::Image(name.to_owned()));
        }
        let gpu = Gpu::headless().await?;
        let default_pool = PoolTuning { bytes: Some(POOL_BYTES), ..PoolTuning::default() };
        let settings = Settings {
            pools: PoolSettings { default_pool, ..PoolSettings::default() },
            upload_bytes_per_frame: 16 << 20,
            whole_bytes: 0,
            ..Settings::default()
        };
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings)?;
        let geometry = container.description().geometry.clone();
        let sources: Vec<Arc<dyn TileSource>> = ContainerTexture::all(container)
            .take(COLORS.len())
            .map(|source| Arc::new(source) as Arc<dyn TileSource>)
            .collect();
        let page_table = volume_tables(geometry.page_count(), sources.len());
        let mut ids: Vec<TextureId> = Vec::new();
        for source in sources {
            let own = TextureSettings { page_table, ..TextureSettings::default() };
            let prepared = textures.preparer().read_with(source, own).await?;
            ids.push(textures.add(prepared)?);
        }
        let of = VolumeBox::new(geometry.size(), [1.0; 3]);
        let in_color = |(id, color): (TextureId, [u8; 3])| VolumeChannel {
            range: [0.05, 0.8],
            opacity: OPACITY,
            ..VolumeChannel::new(id).in_color(color)
        };
        let channels = ids.into_iter().zip(COLORS).map(in_color).collect();
        let mut left = sights(&of);
        left.reverse();
        Ok(Show { gpu, textures, of, channels, left, drawing: None })
    }

    /// What draws.
    pub fn adapter(&self) -> String {
        self.gpu.adapter_name()
    }

    /// Returns true if every picture has been drawn.
    pub fn is_done(&self) -> bool {
        self.left.is_empty() && self.drawing.is_none()
    }

    /// The next frame of the picture under way: asks for what is missing or, where nothing is, draws it.
    /// Gives the picture when it has come back, and nothing until then. Never waits: between two frames the
    /// host lets the device and the loader get on.
    pub fn frame(&mut self) -> Result<Option<Drawn>, ShowError> {
        if self.drawing.is_none() {
            let Some(sight) = self.left.pop() else { return Ok(None) };
            self.drawing = Some(self.begin(sight)?);
        }
        let Some(drawing) = &mut self.drawing else { return Ok(None) };
        let stats = self.textures.stats();
        if drawing.frames >= PATIENCE {
            let (name, frames) = (drawing.sight.name, drawing.frames);
            return Err(ShowError::Late { name, frames, missing: stats.pager.missing });
        }
        drawing.frames += 1;
        if let Some(read) = &drawing.read {
            // Natively what is done is heard of here; a browser says so by itself. A lost device shows below.
            let _ = self.gpu.device.poll(wgpu::PollType::Poll);
            let Some(pixels) = read.take().transpose()? else { return Ok(None) };
            let (Sight { name, size, .. }, frames) = (&drawing.sight, drawing.frames);
            let drawn = Drawn { name, size: *size, pixels, frames, bricks: stats.pager.resident };
            if let Some(drawing) = self.drawing.take() {
                drawing.renderer.forget(&mut self.textures);
            }
            return Ok(Some(drawn));
        }
        // What the view before it knew is gone with the cut.
        let is_there = drawing.frames > 1 && stats.converged;
        let pictures = if is_there { Pictures::Always } else { Pictures::ForFeedback };
        let Drawing { sight, renderer, canvas, .. } = drawing;
        let views = [StageView { view: ViewId::MAIN, camera: renderer.camera(), pose: sight.view }];
        let frame =
            Frame { views: &views, expected: None, picture: sight.size, has_feedback: true, pictures };
        let target = canvas.target();
        let encoder = frame.record(&self.gpu, &mut self.textures, renderer, &target, |_, _| Ok(()))?;
        if is_there {
            drawing.read = Some(TextureRead::submit(&self.gpu, encoder, canvas.picture(), 4));
        } else {
            self.gpu.queue.submit([encoder.finish()]);
        }
        while let Some(event) = self.textures.poll_event() {
            if let Event::Failed { why, .. } = event {
                return Err(ShowError::Brick(why.to_string()));
            }
        }
        Ok(None)
    }

    fn begin(&mut self, sight: Sight) -> Result<Drawing, ShowError> {
        let desc = VolumeDesc { mode: sight.mode, ..VolumeDesc::new(self.of, self.channels.clone()) };
        let renderer = VolumeRenderer::new(&self.gpu, &mut self.textures, desc, FORMAT)?;
        let canvas = Canvas::new(&self.gpu, sight.size, FORMAT, TargetKind::Direct);
        // What the picture before it wanted is not waited for.
        self.textures.view_mut(ViewId::MAIN)?.cut();
        Ok(Drawing { sight, renderer, canvas, frames: 0, read: None })
    }
}

/// What is seen of a volume: a plane of its voxels, an oblique one, and rays through all of it.
fn sights(of: &VolumeBox) -> Vec<Sight> {
    let [width, height, depth] = of.size;
    let middle = of.extent() / 2.0;
    let oblique = VolumePlane {
        middle,
        right: DVec3::new(0.8, 0.6, 0.0),
        down: DVec3::new(-0.36, 0.48, 0.8),
        pixel: 1.25,
    };
    let sight = |name, mode, view, size| Sight { name, mode, view, size };
    vec![
        sight("slice", VolumeMode::Mip, VolumeView::Slice { axis: 2, voxel: depth / 2 }, [width, height]),
        sight("oblique", VolumeMode::Mip, VolumeView::Plane(oblique), [96, 96]),
        sight("mip", VolumeMode::Mip, VolumeView::Face(VolumeFace::PlusX), [height, depth]),
    ]
}
