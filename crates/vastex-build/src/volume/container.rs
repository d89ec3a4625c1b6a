//! A container as the output: a texture for each channel and time, bricks with borders, the coarsest levels
//! together in one tile.

use std::path::Path;

use vastex_core::{Description, Geometry, GeometrySpec, Layer, LayerFormat, PagePos};
use vastex_tiles::{
    Compression, ContainerVolume, ContainerWriter, EncodedTile, TempFile, WriterOptions, Written,
};
use vastex_volume::{DType, Reduction, Volume};

use super::block::{Beyond, Block};
use super::error::VolumeBuildError;
use super::levels::Level;
use super::sink::{Counts, Place, Sink, Stop};
use crate::threads;

/// Tiles that are encoded before they are appended.
const AT_ONCE: usize = 256;

/// How a container is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ContainerOptions {
    /// Voxels of payload per side of a brick, 8 to 256.
    pub page: u32,
    /// Voxels of border on each side of a brick, from 1 on.
    pub border: u32,
    /// How tiles are compressed.
    pub compression: Compression,
    /// Every tile begins at a multiple of so many bytes; 1 for no alignment.
    pub align: u32,
    /// True if the end waits until the disk has everything.
    pub durable: bool,
}

impl Default for ContainerOptions {
    fn default() -> ContainerOptions {
        ContainerOptions { page: 64, border: 1, compression: Compression::Lz4, align: 1, durable: false }
    }
}

/// Writes a container.
pub(super) struct ContainerSink {
    writer: ContainerWriter<TempFile>,
    description: Description,
    compression: Compression,
    dtype: DType,
    rule: Reduction,
    levels: Vec<Level>,
    channels: u64,
    counts: Counts,
}

/// A format that holds values of a kind, as far as their bytes go.
fn format_of(dtype: DType) -> LayerFormat {
    match dtype {
        DType::F16 => LayerFormat::R16Float,
        DType::F32 => LayerFormat::R32Float,
        _ => match dtype.bytes() {
            1 => LayerFormat::R8,
            2 => LayerFormat::R16,
            4 => LayerFormat::R32Uint,
            _ => LayerFormat::Rg32Uint,
        },
    }
}

impl ContainerSink {
    /// Begins a container of a volume with these levels, which end at one voxel.
    pub(super) fn create(
        output: &Path,
        volume: &Volume,
        levels: &[Level],
        rule: Reduction,
        options: &ContainerOptions,
    ) -> Result<ContainerSink, VolumeBuildError> {
        let about = volume.about();
        let refuse = |why: String| VolumeBuildError::Options(format!("{}: {why}", about.path));
        let side = |side: u64| {
            u32::try_from(side).map_err(|_| refuse(format!("a side of {side} voxels is longer than 2^31")))
        };
        let [x, y, z] = levels[0].size;
        let spec = GeometrySpec {
            page: options.page,
            border: options.border,
            ..GeometrySpec::volume([side(x)?, side(y)?, side(z)?])
        };
        // Factors are 1 or 2.
        let factors: Vec<[u32; 3]> =
            levels[1..].iter().map(|level| level.factor.map(|factor| factor as u32)).collect();
        let geometry = Geometry::with_factors(spec, &factors).map_err(|error| refuse(error.to_string()))?;
        let format = format_of(about.dtype);
        let layer = Layer {
            is_mixable: !format.is_whole_number() && rule != Reduction::Majority && !about.is_label,
            ..Layer::new("values", format)
        };
        let description = Description::new(geometry, vec![layer]);
        let held: Option<ContainerVolume> = vastex_volume::container_volume(volume, rule, &volume.fill());
        let held = held.ok_or_else(|| {
            refuse(format!(
                "{} channels and {} times are more than a container can have",
                about.channels, about.times
            ))
        })?;
        let writer_options = WriterOptions {
            compression: options.compression,
            durable: options.durable,
            align: options.align,
            volume: Some(held),
            ..WriterOptions::default()
        };
        Ok(ContainerSink {
            writer: ContainerWriter::claim(output, description.clone(), writer_options, false)?,
            description,
            compression: options.compression,
            dtype: about.dtype,
            rule,
            levels: levels.to_vec(),
            channels: about.channels,
            counts: Counts::default(),
        })
    }

    /// Puts the container in its place.
    pub(super) fn finish(self) -> Result<Written, VolumeBuildError> {
        Ok(self.writer.finish()?)
    }

    fn append(&mut self, place: Place, pos: PagePos, tile: EncodedTile) -> Result<(), VolumeBuildError> {
        let bytes = tile.tile().bytes.len() as u64;
        match tile.tile().codec {
            vastex_tiles::Codec::Constant => self.counts.empty += 1,
            _ => self.counts.pieces += 1,
        }
        self.counts.bytes += bytes;
        Ok(self.writer.append_to(place.time * self.channels + place.channel, pos, tile)?)
    }

    fn encode(&self, texels: Vec<u8>) -> EncodedTile {
        EncodedTile::new(texels.into(), &self.description, self.compression)
    }
}

impl Sink for ContainerSink {
    fn quantum(&self, _: usize) -> [u64; 3] {
        self.description.geometry.page().map(u64::from)
    }

    fn border(&self) -> u64 {
        self.description.geometry.border()[0].into()
    }

    fn by_block(&self) -> usize {
        self.description.geometry.tail().first_level().into()
    }

    fn write(&mut self, place: Place, block: &Block, stop: &Stop) -> Result<(), VolumeBuildError> {
        let geometry = &self.description.geometry;
        let (page, border) = (geometry.page(), geometry.border());
        let outer = geometry.tile().map(|side| side as usize);
        let width = self.dtype.bytes();
        let range = |axis: usize| {
            let page = u64::from(page[axis]);
            block.inner[0][axis] / page..block.inner[1][axis].div_ceil(page)
        };
        let mut pages = Vec::new();
        for z in range(2) {
            for y in range(1) {
                // A texture has at most 2^31 pages, and 32 levels.
                pages
                    .extend(range(0).map(|x| PagePos::at(place.level as u8, [x as u32, y as u32, z as u32])));
            }
        }
        for pages in pages.chunks(AT_ONCE) {
            stop.check()?;
            let encoded = threads::map(pages, 1, |pos| {
                let at = pos.coords();
                let first = std::array::from_fn(|axis| {
                    i64::from(at[axis]) * i64::from(page[axis]) - i64::from(border[axis])
                });
                self.encode(block.cut(first, outer, width, Beyond::Nearest))
            });
            for (pos, tile) in pages.iter().zip(encoded) {
                self.append(place, *pos, tile)?;
            }
        }
        Ok(())
    }

    /// Makes the tile of the coarsest levels.
    fn write_rest(&mut self, place: Place, mut block: Block) -> Result<(), VolumeBuildError> {
        let geometry = self.description.geometry.clone();
        let [tile_width, tile_height, _] = geometry.tile().map(|side| side as usize);
        let border = geometry.border();
        let width = self.dtype.bytes();
        let mut texels = vec![0; self.description.tile_bytes()];
        for level in geometry.tail().first_level()..=geometry.coarsest() {
            let to = geometry.tail().offset(level).map(|at| at as usize);
            let size: [usize; 3] = std::array::from_fn(|axis| block.size[axis] + 2 * border[axis] as usize);
            let bordered = block.cut(border.map(|border| -i64::from(border)), size, width, Beyond::Nearest);
            for (n, row) in bordered.chunks_exact(size[0] * width).enumerate() {
                let (y, z) = (to[1] + n % size[1], to[2] + n / size[1]);
                let at = ((z * tile_height + y) * tile_width + to[0]) * width;
                texels[at..at + row.len()].copy_from_slice(row);
            }
            if let Some(coarser) = self.levels.get(usize::from(level) + 1) {
                block = block.halved(self.dtype, self.rule, coarser.factor);
            }
        }
        let tile = self.encode(texels);
        self.append(place, geometry.tail_pos(), tile)
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}
