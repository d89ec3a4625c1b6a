//! A volume as a source of tiles: one channel at one time, in bricks with borders.
//!
//! A tile is put together of stored chunks ([`crate::Volume`] shares them), or of chunks of levels that are
//! made. Where a level's voxels lie among its pages is [`VoxelLevels`]' business, what its texels mean
//! [`ValueCodes`]'.

mod absent;
mod codes;
mod early;
mod groups;
#[cfg(test)]
mod huge;
mod kept;
mod key;
mod options;
mod sample;
mod stats;
mod wanted;
mod window;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use bytes::Bytes;
use pollster::block_on;
use vastex_core::{
    Description, Geometry, Layer, PageContents, PagePos, Region, StoredLevel, VoxelLevel, VoxelLevels,
};
use vastex_tiles::{Codec, ReadError, ReadFuture, SourceKey, Tiers, Tile, TileSource};

use crate::chunks::ChunkSource;
use crate::fault::{SourceFault, VolumeError, VolumeFault};
use crate::made::{Base, Made, MadeChunks, is_small};
use crate::reduce::Reduction;
use crate::volume::{BoxValues, Plane, Shared, Telling, Volume, VolumeAbout, VoxelBox, filled, paste};
pub use codes::{ValueCodes, VoxelValue};
pub use kept::made_levels_kept;
pub use options::{LevelState, VolumeOptions, VolumeSourceError};
pub use sample::{PointValue, SliceAxis, VolumePlane};
pub use stats::{BINS, BrickStats};

/// One channel of a volume at one time, as a source of tiles with three axes.
///
/// Tiles hold the voxels that [`VoxelLevels`] says, exactly as they are stored or, where the format of the
/// layer has fewer bits, as [`ValueCodes`] says. Levels below the coarsest stored one are made: at opening
/// where that one has up to 64 MiB, else by whoever calls [`VolumeSource::make_levels`], and until then they
/// are a preview.
///
/// Several sources of one volume (its channels, its times) share its decoded chunks.
pub struct VolumeSource {
    volume: Arc<Volume>,
    options: VolumeOptions,
    description: Arc<Description>,
    levels: Arc<VoxelLevels>,
    codes: ValueCodes,
    is_labels: bool,
    contents: Option<Arc<PageContents>>,
    made: Made,
    wanted: wanted::Wanted,
    early: early::Early,
    /// The level of the geometry from which on levels are made.
    first_made: u8,
    /// How many bricks of each level are read at once.
    groups: Vec<groups::Group>,
    stats: stats::Kept,
    /// What it tells of reads.
    telling: Telling,
}

impl VolumeSource {
    /// A source of a channel and a time. Lists which chunks are stored, of directories where that takes no
    /// more than 262,144 keys a level, and reads the coarsest stored level where it has up to 64 MiB.
    pub fn open(volume: Arc<Volume>, options: &VolumeOptions) -> Result<VolumeSource, VolumeSourceError> {
        let about = volume.about().clone();
        volume.check_plane(options.channel, options.time)?;
        let is_labels = options.labels.unwrap_or(about.is_label);
        let codes = match is_labels {
            false => ValueCodes::of_values(about.dtype),
            true => ValueCodes::of_labels(about.dtype).ok_or_else(|| {
                let why = format!("labels are whole numbers, and these are {}", about.dtype.name());
                VolumeFault::Unsupported(why).at(&about.path)
            })?,
        };
        let (geometry, levels) = levels_of(&about, options.brick, options.border)?;
        let name = if is_labels { "labels" } else { "values" };
        let layer = Layer { is_mixable: !is_labels, ..Layer::new(name, codes.format) };
        let description = Description::new(geometry, vec![layer]);
        description.check().map_err(|error| VolumeSourceError::Layer { path: about.path.clone(), error })?;
        let first_made = levels.stored();
        let coarsest = levels.levels()[first_made - 1].stored.map_or(0, usize::from);
        let geometry = &description.geometry;
        let factors: Vec<[u32; 3]> =
            geometry.levels()[first_made..].iter().map(|level| level.factor).collect();
        let rule = options.reduction.unwrap_or(Reduction::usual(is_labels));
        let identity = options.cache.is_some().then(|| identity(&volume, options, coarsest, rule, &factors));
        let directory = options.cache.as_deref().zip(identity.as_deref());
        let base =
            Base { volume: volume.clone(), level: coarsest, channel: options.channel, time: options.time };
        let made = block_on(Made::new(base, rule, &factors, directory, options.makes_all))?;
        let fill = volume.shared(0).fill()[..about.dtype.bytes()].to_vec();
        let constant = Bytes::from(codes.encode(fill));
        let asked: Vec<absent::Asked<'_>> = (0..levels.levels().len())
            .filter_map(|n| {
                let level = levels.level(n as u8);
                let (stored, scale) = match level.stored {
                    Some(stored) => (usize::from(stored), [1; 3]),
                    None => (coarsest, made.scale(n - first_made)),
                };
                // Another fill value is another content.
                let is_same = volume.shared(stored).fill() == volume.shared(0).fill();
                is_same.then_some(absent::Asked { number: n as u8, level, stored, scale })
            })
            .collect();
        let plane = (options.channel, options.time);
        let contents = block_on(absent::contents(&volume, geometry, &asked, plane, constant));
        let groups = (0..levels.levels().len() as u8).map(|n| {
            let stored = levels.level(n).stored.map(|stored| &about.levels[usize::from(stored)]);
            stored.map_or(groups::ALONE, |of| {
                groups::plan(geometry, n, of.chunk, of.size, about.dtype.bytes() as u64)
            })
        });
        Ok(VolumeSource {
            groups: groups.collect(),
            options: options.clone(),
            description: Arc::new(description),
            levels: Arc::new(levels),
            codes,
            is_labels,
            contents: contents.map(Arc::new),
            made,
            wanted: wanted::Wanted::default(),
            early: early::Early::default(),
            first_made: first_made as u8,
            stats: stats::Kept::default(),
            telling: Telling::new(volume.clone()),
            volume,
        })
    }

    /// The volume.
    pub fn volume(&self) -> &Arc<Volume> {
        &self.volume
    }

    /// Where the voxels of each level lie, in the world and in tiles.
    pub fn levels(&self) -> &Arc<VoxelLevels> {
        &self.levels
    }

    /// What texels mean.
    pub fn codes(&self) -> &ValueCodes {
        &self.codes
    }

    /// How levels are made that are not stored; `None` where all are stored.
    pub fn made_by(&self) -> Option<Reduction> {
        let has_made = usize::from(self.first_made) < self.levels.levels().len();
        has_made.then(|| self.options.reduction.unwrap_or(Reduction::usual(self.is_labels)))
    }

    /// Returns true if values are labels.
    pub fn is_labels(&self) -> bool {
        self.is_labels
    }

    /// What is told of each level, the finest first.
    pub fn level_states(&self) -> Vec<LevelState> {
        let state = |level: &VoxelLevel| LevelState {
            size: level.size,
            scale: level.scale,
            origin: level.origin,
            is_made: level.stored.is_none(),
            made: level.stored.is_none().then(|| self.made.progress()),
        };
        self.levels.levels().iter().map(state).collect()
    }

    /// What is known of the values of a page's brick, of its finest level if the page is the tail: `None`
    /// until the brick was read, of labels, and of bricks whose figures made room for those of 65,536 others.
    pub fn brick_stats(&self, pos: PagePos) -> Option<BrickStats> {
        self.stats.get(pos)
    }

    /// Returns true if a page is known to hold the fill value alone, so that nothing of it need be read.
    pub fn is_absent(&self, pos: PagePos) -> bool {
        self.contents.as_ref().is_some_and(|contents| contents.of(pos).is_some())
    }

    /// Returns true if levels that are made wait for [`VolumeSource::make_levels`], or are being made by it.
    pub fn has_levels_to_make(&self) -> bool {
        self.made.has_work()
    }

    /// Makes what was asked for of the levels that are not stored, on this thread, until nothing is left or
    /// `stop` is set: bricks that were read as a preview first, the finest before coarser ones, then all that
    /// the coarsest level is made of. May take as long as reading the whole of the coarsest stored level.
    /// Returns at once while another thread is in it.
    pub fn make_levels(&self, stop: &AtomicBool) {
        self.made.work(stop);
    }

    /// The regions whose tiles were a preview and are not any more, or had repeated borders
    /// ([`VolumeOptions::borders_later`]), since this was last asked. Who keeps tiles lets them be read again
    /// ([`TileSource::changed`]).
    pub fn take_changes(&self) -> Vec<Region> {
        let changed = self.made.take_changed().into_iter();
        let made = changed.map(|(level, at)| self.region_of(self.first_made + level as u8, at));
        made.chain(self.take_early()).collect()
    }

    /// What went wrong while levels were made, the coarsest ones were read, or values were counted for a
    /// window, up to a number: where chunks could not be read, voxels of a finer stored level, or of the
    /// next coarser one, stand for them, else the fill value; windows are without them. Below the next finer
    /// level, 256 chunks that cannot be read are the most that something is looked for.
    pub fn faults(&self) -> Vec<SourceFault> {
        self.made.faults()
    }

    /// The texels of level 0 that a chunk of 64 voxels a side of a made level covers.
    fn region_of(&self, level: u8, at: [u64; 3]) -> Region {
        let (of, finest) = (self.levels.level(level), self.levels.level(0));
        let corner = |n: u64| {
            let voxel = at.map(|at| ((at + n) * 64) as f64);
            finest.voxel_from_world(of.world_from_voxel(voxel))
        };
        let (begin, end) = (corner(0), corner(1));
        // A texel more, for what rounding may have taken.
        let texels = std::array::from_fn(|axis| {
            (begin[axis].floor() - 1.0).max(0.0) as u32..(end[axis].ceil() + 1.0).max(0.0) as u32
        });
        Region { texels, levels: level..=level }
    }

    /// `asks` has chunks made that are not yet.
    fn chunks(&self, level: u8, asks: bool) -> LevelChunks<'_> {
        match self.levels.level(level).stored {
            Some(stored) => LevelChunks::Stored(self.volume.shared_for_bricks(stored.into())),
            None => LevelChunks::Made(self.made.chunks((level - self.first_made).into(), asks), &self.made),
        }
    }

    /// The values of a box of a level, wherever it lies.
    async fn read_box(&self, level: u8, of: &VoxelBox) -> Result<BoxValues, VolumeError> {
        self.read_box_of(level, of, true).await
    }

    /// The same; `asks` has levels made that are not yet.
    async fn read_box_of(&self, level: u8, of: &VoxelBox, asks: bool) -> Result<BoxValues, VolumeError> {
        let chunks = self.chunks(level, asks);
        let plane = chunks.plane(self.options.channel, self.options.time);
        Plane { spare: Some(self.volume.spare()), ..plane }.read(of).await
    }

    /// The values of a level in the tail, without which nothing is shown: what stands for a chunk that cannot
    /// be read is told of by `faults`.
    async fn read_of_tail(&self, level: u8, of: &VoxelBox, asks: bool) -> Result<BoxValues, VolumeError> {
        let Some(stored) = self.levels.level(level).stored.map(usize::from) else {
            return self.read_box_of(level, of, asks).await;
        };
        let lenient = self.made.lenient(self.volume.shared_for_bricks(stored), stored);
        Plane { spare: Some(self.volume.spare()), ..lenient.plane() }.read(of).await
    }

    /// The values of a page's tile, by way of a box that bricks beside it are in, too.
    async fn read_of_group(&self, pos: PagePos, group: groups::Group) -> Result<BoxValues, VolumeError> {
        let geometry = &self.description.geometry;
        let (of, place) = groups::box_of(geometry, self.levels.level(pos.level), pos, group);
        let plane = (self.options.channel, self.options.time);
        let read = self.read_box(pos.level, &of);
        let found = self.volume.shared_box(pos.level.into(), plane, &of, read).await?;
        let sides = |size: [u32; 3]| size.map(|side| side as usize);
        let width = self.volume.about().dtype.bytes();
        match found {
            None => Ok(BoxValues { values: self.empty_tile(width)?, is_absent: true }),
            Some(values) => {
                let tile = sides(geometry.tile());
                let values = groups::cut(&values, sides(of.size), place, tile, width);
                Ok(BoxValues { values, is_absent: false })
            }
        }
    }

    /// The tile of a page that exists.
    async fn tile(&self, pos: PagePos) -> Result<Tile, VolumeError> {
        let geometry = &self.description.geometry;
        let width = self.volume.about().dtype.bytes();
        let size = geometry.tile();
        let asks = self.options.makes_all || self.wanted.has(pos);
        let mut tile = None;
        let mut is_absent = true;
        for (level, level_box, place) in geometry.tile_boxes(pos) {
            let coords = if geometry.is_tail(pos) { [0; 3] } else { pos.coords() };
            let of = VoxelBox { first: self.levels.level(level).first_voxel(coords), size: level_box.size };
            let found = match self.groups[usize::from(level)] {
                group if group != groups::ALONE && !geometry.is_tail(pos) => {
                    self.read_of_group(pos, group).await?
                }
                _ if geometry.is_tail(pos) => self.read_of_tail(level, &of, asks).await?,
                _ => match self.read_early(pos, &of).await? {
                    Some(early) => early,
                    None => {
                        let whole = self.read_box_of(level, &of, asks).await?;
                        self.settle_early(pos);
                        whole
                    }
                },
            };
            is_absent &= found.is_absent;
            if level == pos.level {
                self.keep_stats(pos, &of, &found.values);
            }
            if of.size == size {
                tile = Some(found.values);
                continue;
            }
            let tile = match &mut tile {
                Some(tile) => tile,
                empty => empty.insert(self.empty_tile(width)?),
            };
            let sides = |size: [u32; 3]| size.map(|side| side as usize);
            paste(&found.values, sides(of.size), tile, sides(size), sides(place), width);
        }
        let values = tile.map_or_else(|| self.empty_tile(width), Ok)?;
        let texels = self.volume.spare().lend(self.codes.encode(values));
        let texel = self.codes.format.texel_bytes();
        // All texels are as the one before them, if so all are the same.
        if is_absent || texels[texel..] == texels[..texels.len() - texel] {
            return Ok(Tile { codec: Codec::Constant, bytes: Bytes::copy_from_slice(&texels[..texel]) });
        }
        Ok(Tile { codec: Codec::Raw, bytes: texels })
    }

    fn empty_tile(&self, width: usize) -> Result<Vec<u8>, VolumeError> {
        let fill = self.volume.shared(0).fill();
        filled(&fill[..width], self.description.geometry.tile_texels() as usize).ok_or_else(|| {
            VolumeFault::TooLarge("there is no memory for a brick".into()).at(&self.volume.about().path)
        })
    }

    /// Keeps what the payload of a box holds.
    fn keep_stats(&self, pos: PagePos, of: &VoxelBox, values: &[u8]) {
        if self.is_labels {
            return;
        }
        let dtype = self.volume.about().dtype;
        let (border, size) = (self.description.geometry.border(), self.levels.level(pos.level).size);
        let inner = [0, 1, 2].map(|axis| {
            // What lies within the border, and within the level.
            let begin = i64::from(border[axis]).max(-of.first[axis]);
            let end = i64::from(of.size[axis] - border[axis]).min(i64::from(size[axis]) - of.first[axis]);
            begin.max(0) as usize..end.max(0) as usize
        });
        let [across, down, _] = of.size.map(|side| side as usize);
        let width = dtype.bytes();
        let [columns, rows, layers] = inner;
        let columns = columns.start.min(columns.end) * width..columns.end * width;
        let rows = stats::Rows { values, across: across * width, down, columns, rows, layers };
        self.stats.put(pos, stats::of_rows(dtype, &rows));
    }
}

/// The chunks of a level, stored or made.
enum LevelChunks<'a> {
    Stored(Shared<'a>),
    Made(MadeChunks<'a>, &'a Made),
}

impl LevelChunks<'_> {
    fn plane(&self, channel: u64, time: u64) -> Plane<'_> {
        match self {
            LevelChunks::Stored(shared) => shared.plane(channel, time),
            LevelChunks::Made(chunks, made) => made.plane(chunks),
        }
    }
}

impl TileSource for VolumeSource {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    /// Pages that are known to hold the fill value alone have content 0.
    fn contents(&self) -> Option<&Arc<PageContents>> {
        self.contents.as_ref()
    }

    /// Of what lies in one file, and of which no level is made in the background.
    fn identity(&self) -> Option<SourceKey> {
        key::key(self)
    }

    /// Adds what was read of the volume: sources that share one add each read once between them, whichever of
    /// them it was for.
    fn add_tiers(&self, tiers: &mut Tiers) {
        self.telling.add_to(tiers);
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            let geometry: &Geometry = &self.description.geometry;
            if !geometry.contains(pos) {
                return Err(ReadError::NoSuchTile { pos });
            }
            self.tile(pos).await.map_err(|error| {
                let place = error.path;
                match error.fault {
                    VolumeFault::Read(error) => ReadError::Store { pos, place, error },
                    fault => ReadError::Damaged { pos, place, fault: fault.to_string() },
                }
            })
        })
    }
}

/// The levels of a source of a volume: those that are stored and are shown, and those that are made below
/// them; and how they are cut into bricks. Reads nothing.
pub fn levels_of(
    about: &VolumeAbout,
    brick: u32,
    border: u32,
) -> Result<(Geometry, VoxelLevels), VolumeSourceError> {
    let stored = about.levels.iter();
    let stored: Vec<StoredLevel> = stored
        .map(|level| StoredLevel { size: level.size, scale: level.scale, origin: level.origin })
        .collect();
    VoxelLevels::new(&stored, brick, border)
        .map_err(|error| VolumeSourceError::Levels { path: about.path.clone(), error })
}

/// Returns true if the levels of a source that are not stored are made when it is opened, since the coarsest
/// stored one is small, and not in the background.
pub fn makes_levels_at_opening(about: &VolumeAbout, levels: &VoxelLevels) -> bool {
    let coarsest = levels.levels().iter().rev().find_map(|level| level.stored);
    is_small(about, coarsest.map_or(0, usize::from), None)
}

/// What a volume is, for levels of it that are kept: other values give another text, as far as times of files
/// tell, and so do other levels. `factors` are those of the levels that are made.
fn identity(
    volume: &Volume,
    options: &VolumeOptions,
    coarsest: usize,
    rule: Reduction,
    factors: &[[u32; 3]],
) -> String {
    let about = volume.about();
    let path = std::path::Path::new(&about.path);
    let whole = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let level = &about.levels[coarsest];
    // Of an archive, the archive; of a directory, the level's, in which files come and go.
    let seen = [path.to_owned(), path.join(&level.path)].map(|path| {
        let archive = path.ancestors().find(|path| path.exists()).map(std::fs::metadata);
        archive.and_then(Result::ok).map(|found| (found.len(), found.modified().ok()))
    });
    format!(
        "{}\n{:?} {} {:?}\nchannel {} time {}\n{} 2 {factors:?}\n{seen:?}\n",
        whole.display(),
        level.path,
        about.dtype.name(),
        level.size,
        options.channel,
        options.time,
        rule.name()
    )
}
