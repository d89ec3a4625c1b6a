//! Volumes in the project's own container: bricks with borders, and the coarsest levels together in one tile.

mod about;

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use about::{About, dtype_of, level_of};
use bytes::Bytes;
use vastex_core::PagePos;
use vastex_tiles::{Container, ContainerVolume, ReadError, TileSource};

use crate::chunks::{
    AxisMap, Chunk, ChunkFuture, ChunkList, ChunkSource, Grid, LOOKS_FOR_A_KEY, MOST_LISTED, Presence,
    PresenceFuture,
};
use crate::fault::{VolumeError, VolumeFault, damaged};
use crate::values::DType;
use crate::volume::{LevelArray, Volume, VolumeAbout};

pub use about::container_volume;

/// The first bytes of a container.
const BEGIN: [u8; 4] = *b"\x89VTX";

/// Returns true if a file is a container that holds a volume.
pub(crate) fn is_container(path: &Path) -> bool {
    let mut begin = [0; 4];
    let is_one = File::open(path).is_ok_and(|mut file| file.read_exact(&mut begin).is_ok());
    is_one && begin == BEGIN && Container::holds_volume(path)
}

/// Opens a container that holds a volume.
pub(crate) fn open_container(path: &Path) -> Result<Volume, VolumeError> {
    let at = |fault: VolumeFault| fault.at(path.display().to_string());
    let container = Container::open_file(path).map_err(|error| at(VolumeFault::Read(error.to_string())))?;
    let found = container.volume().cloned();
    let volume = found.ok_or_else(|| at(VolumeFault::NoVolume("is a container of an image".into())))?;
    let dtype = dtype_of(volume.values).ok_or_else(|| at(damaged("has values of an unknown kind")))?;
    let container = Arc::new(container);
    let geometry = container.description().geometry.clone();
    let mut oddities = Vec::new();
    let said = About::read(&volume.about, &mut oddities);
    let mut levels = Vec::new();
    let mut arrays = Vec::new();
    for number in 0..=geometry.coarsest() {
        let source = TiledLevel::new(&container, &volume, number, dtype);
        let grid = source.grid.clone();
        levels.push(level_of(&said, geometry.level(number), number, grid.chunk_size()));
        arrays.push(LevelArray { dtype, grid, source: Arc::new(source) });
    }
    let about = VolumeAbout {
        path: path.display().to_string(),
        kind: "vastex",
        version: Some("1".into()),
        dtype,
        levels,
        channels: volume.channels.into(),
        times: volume.times.into(),
        labels: Vec::new(),
        name: said.name,
        channel_info: said.channels,
        unit: said.unit,
        convention: said.convention,
        root: PathBuf::new(),
        is_label: said.is_label,
        label_colors: Vec::new(),
        value_scale: said.value_scale,
        downsample: said.downsample,
        left_out: Vec::new(),
        time_step: said.time_step,
        time_unit: said.time_unit,
        oddities,
    };
    Ok(Volume::new(about, arrays))
}

/// A level: its chunks are the payloads of its bricks; in the tail it is one chunk.
struct TiledLevel {
    container: Arc<Container>,
    level: u8,
    is_tail: bool,
    fill: [u8; 8],
    width: usize,
    channels: u64,
    grid: Grid,
    strides: Arc<[usize]>,
    /// Bytes before the first voxel of a chunk in its tile.
    offset: usize,
}

impl TiledLevel {
    fn new(container: &Arc<Container>, volume: &ContainerVolume, level: u8, dtype: DType) -> TiledLevel {
        let geometry = &container.description().geometry;
        let size = geometry.level(level).size.map(u64::from);
        let is_tail = level >= geometry.tail().first_level();
        let (page, border) = (geometry.page(), geometry.border());
        let (first, chunk) = match is_tail {
            true => (geometry.tail().offset(level), size),
            false => ([0; 3], page.map(u64::from)),
        };
        let [tile_width, tile_height, _] = geometry.tile().map(|side| side as usize);
        let width = dtype.bytes();
        let strides = [0, 0, tile_height * tile_width * width, tile_width * width, width];
        let before = |axis: usize| (first[axis] + border[axis]) as usize;
        let (channels, times) = (u64::from(volume.channels), u64::from(volume.times));
        TiledLevel {
            container: container.clone(),
            level,
            is_tail,
            fill: volume.fill,
            width,
            channels,
            grid: Grid {
                shape: vec![times, channels, size[2], size[1], size[0]],
                chunk: vec![1, 1, chunk[2], chunk[1], chunk[0]],
                axes: AxisMap { x: 4, y: 3, z: Some(2), channel: Some(1), time: Some(0) },
            },
            strides: strides.into(),
            offset: before(2) * strides[2] + before(1) * strides[3] + before(0) * width,
        }
    }

    /// The texture and the page of a chunk.
    fn place(&self, coords: &[u64]) -> (u64, PagePos) {
        let texture = coords[0] * self.channels + coords[1];
        let pos = match self.is_tail {
            true => self.container.description().geometry.tail_pos(),
            // A texture has at most 2^31 pages.
            false => PagePos::at(self.level, [coords[4], coords[3], coords[2]].map(|at| at as u32)),
        };
        (texture, pos)
    }

    fn is_absent(&self, texture: u64, pos: PagePos) -> bool {
        self.container.constant_of(texture, pos).is_some_and(|texel| texel[..] == self.fill[..self.width])
    }

    async fn read_chunk(&self, coords: &[u64]) -> Result<Option<Chunk>, VolumeError> {
        let (texture, pos) = self.place(coords);
        if self.is_absent(texture, pos) {
            return Ok(None);
        }
        let at = |fault: VolumeFault| fault.at(self.container.name());
        let tile = self.container.read_of(texture, pos).await.map_err(|error| {
            at(match &error {
                ReadError::Damaged { .. } => damaged(error.to_string()),
                _ => VolumeFault::Read(error.to_string()),
            })
        })?;
        let stored = tile.bytes.len();
        let decoded = tile.decode(self.container.description());
        let values: Bytes = decoded.map_err(|error| at(damaged(format!("{pos}: {error}"))))?;
        Ok(Some(Chunk::new(values.slice(self.offset..), self.strides.clone(), stored)))
    }

    fn find_present(&self, most: usize) -> Presence {
        let sides = self.grid.shape.iter().zip(&self.grid.chunk);
        let counts: Vec<u64> = sides.map(|(side, chunk)| side.div_ceil(*chunk)).collect();
        let count = counts.iter().fold(1, |product: u64, count| product.saturating_mul(*count));
        // All is in memory.
        if count > most.saturating_mul(LOOKS_FOR_A_KEY) as u64 {
            return Presence::Unknown;
        }
        let mut present = ChunkList::new(counts.len());
        let mut coords = vec![0; counts.len()];
        for number in 0..count {
            let mut rest = number;
            for axis in (0..counts.len()).rev() {
                coords[axis] = rest % counts[axis];
                rest /= counts[axis];
            }
            let (texture, pos) = self.place(&coords);
            if !self.is_absent(texture, pos) && !present.add(&coords, MOST_LISTED) {
                return Presence::Unknown;
            }
        }
        Presence::These(present)
    }
}

impl ChunkSource for TiledLevel {
    fn read<'a>(&'a self, coords: &'a [u64]) -> ChunkFuture<'a> {
        Box::pin(self.read_chunk(coords))
    }

    fn fill(&self) -> [u8; 8] {
        self.fill
    }

    fn presence(&self, most: usize) -> PresenceFuture<'_> {
        Box::pin(async move { Ok(self.find_present(most)) })
    }
}
