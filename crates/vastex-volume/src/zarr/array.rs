//! An array where it lies: opened by its metadata, read chunk by chunk.

use std::sync::Arc;

use super::metadata::{ArrayMeta, ShardMeta};
use super::shards::{ShardIndices, checked};
use super::{v2, v3};
use crate::chunks::{
    Chunk, ChunkFuture, ChunkList, ChunkSource, LOOKS_FOR_A_KEY, MOST_LISTED, Presence, PresenceFuture,
};
use crate::fault::{Oddities, VANISHED, VolumeError, VolumeFault};
use crate::json::{read_json, text};
use crate::keys::{KeyStore, Span, join, shown};
use crate::values::swap_bytes;

/// Names that are looked at to find out how keys are separated: what is not a chunk's is a handful.
const MOST_PROBED: usize = 256;
/// Keys that are listed in the time in which an index is read.
const KEYS_PER_INDEX: u64 = 64;
/// Bytes that are read or inflated for indices for each key that may be listed.
const BYTES_PER_KEY: u64 = 512;

/// An array.
pub(crate) struct ZarrArray {
    keys: Arc<dyn KeyStore>,
    prefix: String,
    /// Where its metadata lie.
    meta_key: String,
    meta: ArrayMeta,
    strides: Arc<[usize]>,
    shards: ShardIndices,
}

/// Opens the array under a key; `None` if there is none.
pub(crate) async fn open_array(
    keys: &Arc<dyn KeyStore>,
    prefix: &str,
) -> Result<Option<ZarrArray>, VolumeError> {
    let mut oddities = Oddities::default();
    let v3_key = join(prefix, "zarr.json");
    let found = read_json(&**keys, &v3_key, &mut oddities).await?;
    let (meta_key, meta) = match found.filter(|value| text(value, "node_type") == Some("array")) {
        Some(value) => {
            let meta = v3::read(&value).map_err(|fault| fault.at(shown(&**keys, &v3_key)))?;
            (v3_key, meta)
        }
        None => {
            let v2_key = join(prefix, ".zarray");
            let Some(value) = read_json(&**keys, &v2_key, &mut oddities).await? else { return Ok(None) };
            let probed = match value.get("dimension_separator") {
                None => probed_separator(&**keys, prefix).await?,
                Some(_) => None,
            };
            let meta = v2::read(&value, probed).map_err(|fault| fault.at(shown(&**keys, &v2_key)))?;
            (v2_key, meta)
        }
    };
    let mut meta = meta;
    meta.oddities.extend(oddities.into_vec());
    let strides = meta.strides().into();
    Ok(Some(ZarrArray {
        keys: keys.clone(),
        prefix: prefix.into(),
        meta_key,
        meta,
        strides,
        shards: ShardIndices::default(),
    }))
}

/// The separator that an array's keys are seen to have: directories with numbers for names are of `/`.
async fn probed_separator(keys: &dyn KeyStore, prefix: &str) -> Result<Option<char>, VolumeError> {
    let groups = keys.groups(prefix, MOST_PROBED).await?;
    let is_number = |name: &String| !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_digit());
    Ok(groups.iter().any(is_number).then_some('/'))
}

impl ZarrArray {
    pub(crate) fn meta(&self) -> &ArrayMeta {
        &self.meta
    }

    async fn read_chunk(&self, coords: &[u64]) -> Result<Option<Chunk>, VolumeError> {
        let bytes = self.meta.chunk_bytes();
        let most = self.meta.chain.most_stored(bytes);
        let (key, stored) = match &self.meta.shard {
            None => {
                let key = join(&self.prefix, &self.meta.keys.key(coords));
                let stored = self.keys.read(&key, Span::Whole { most }).await?;
                (key, stored)
            }
            Some(shard) => {
                let (of, within) = split(coords, shard);
                let key = join(&self.prefix, &self.meta.keys.key(&of));
                let index = self.shards.get(&*self.keys, &key, shard).await?;
                let entry = index.and_then(|index| index.entry(shard.entry(&within)));
                let Some(entry) = entry else { return self.absent().await };
                let (offset, len) =
                    checked(entry, most).map_err(|fault| fault.at(shown(&*self.keys, &key)))?;
                let stored = self.keys.read(&key, Span::Range { offset, len }).await?;
                (key, stored)
            }
        };
        let Some(stored) = stored else { return self.absent().await };
        let (read, spare) = (stored.len(), self.keys.spare());
        let decoded = self.meta.chain.decode(stored, bytes, spare);
        let decoded = decoded.map_err(|fault| fault.at(shown(&*self.keys, &key)))?;
        let values = match self.meta.is_big_endian {
            false => decoded.share(spare),
            true => {
                let mut values = decoded.into_vec();
                swap_bytes(&mut values, self.meta.dtype.bytes());
                spare.lend(values)
            }
        };
        Ok(Some(Chunk::new(values, self.strides.clone(), read)))
    }

    /// What a chunk is that is not there: absent, unless the whole array has gone, as where a disk is taken
    /// away: then the fill value would pass for what was stored.
    async fn absent(&self) -> Result<Option<Chunk>, VolumeError> {
        match self.keys.read(&self.meta_key, Span::Range { offset: 0, len: 0 }).await? {
            Some(_) => Ok(None),
            None => Err(VolumeFault::Read(VANISHED.into()).at(shown(&*self.keys, &self.meta_key))),
        }
    }

    /// Which chunks are stored, in a list of at most `listed` bytes; see [`ChunkSource::presence`].
    async fn find_present(&self, most: usize, listed: usize) -> Result<Presence, VolumeError> {
        let counts = self.counts();
        let axes = counts.len();
        let (mut found, mut has_room) = (ChunkList::new(axes), true);
        let mut keep = |key: &str| {
            let coords = self.meta.keys.coords(key, axes);
            let is_within = |coords: &Vec<u64>| coords.iter().zip(&counts).all(|(at, count)| at < count);
            // Counts are of sides up to 2^31.
            if let Some(coords) = coords.filter(is_within) {
                has_room = has_room && found.add(&coords, listed);
            }
        };
        let keys = if self.keys.is_listed() { most.saturating_mul(LOOKS_FOR_A_KEY) } else { most };
        if self.keys.list(&self.prefix, keys, &mut keep).await? || !has_room {
            return Ok(Presence::Unknown);
        }
        let Some(shard) = &self.meta.shard else { return Ok(Presence::These(found)) };
        let shards = found.iter().count() as u64;
        let bytes_of = |of: &[u32]| {
            let (_, key) = self.shard_key(of);
            self.keys.bytes_for_part(&key, shard.index_bytes())
        };
        let bytes = || found.iter().map(bytes_of).fold(0, u64::saturating_add);
        let entries = shards.saturating_mul(shard.chunks());
        let present = match are_read(shards, entries, bytes, most as u64) {
            true => self.stored_in(&found, shard, listed).await,
            false => None,
        };
        Ok(Presence::These(present.unwrap_or(ChunkList { cell: shard.counts.clone(), ..found })))
    }

    /// The chunks that are stored in shards, by their indices; `None` if a list of them were larger than
    /// `listed` bytes.
    async fn stored_in(&self, shards: &ChunkList, shard: &ShardMeta, listed: usize) -> Option<ChunkList> {
        let mut present = ChunkList::new(self.meta.shape.len());
        // Chunks of a shard may lie beyond the array's edge.
        let sides = self.meta.shape.iter().zip(&self.meta.chunk);
        let chunks: Vec<u64> = sides.map(|(side, chunk)| side.div_ceil(*chunk)).collect();
        for of in shards.iter() {
            let (of, key) = self.shard_key(of);
            let stored: Vec<usize> = match self.shards.get(&*self.keys, &key, shard).await {
                Ok(None) => continue,
                Ok(Some(index)) => index.stored().collect(),
                // It tells nothing of its own chunks, which will say what is wrong where they are read.
                Err(_) => (0..shard.chunks() as usize).collect(),
            };
            for place in stored {
                let coords = joined(&of, place, shard);
                let is_within = coords.iter().zip(&chunks).all(|(at, count)| at < count);
                if is_within && !present.add(&coords, listed) {
                    return None;
                }
            }
        }
        Some(present)
    }

    /// The coordinates of a shard of a list, and its key.
    fn shard_key(&self, of: &[u32]) -> (Vec<u64>, String) {
        let of: Vec<u64> = of.iter().map(|at| u64::from(*at)).collect();
        let key = join(&self.prefix, &self.meta.keys.key(&of));
        (of, key)
    }

    /// Chunks, or shards, along each axis.
    fn counts(&self) -> Vec<u64> {
        let sides = self.meta.shape.iter().zip(&self.meta.chunk).enumerate();
        let per_key = |axis: usize| self.meta.shard.as_ref().map_or(1, |shard| shard.counts[axis]);
        sides.map(|(axis, (side, chunk))| side.div_ceil(chunk * per_key(axis))).collect()
    }
}

/// Whether the indices of so many shards are read where up to `most` keys may be listed: they have so many
/// entries together, each of which is looked at, whether its chunk is stored or not, and so many bytes are
/// read or inflated for them, which is asked for last.
fn are_read(shards: u64, entries: u64, bytes: impl FnOnce() -> u64, most: u64) -> bool {
    shards <= most.div_ceil(KEYS_PER_INDEX)
        && entries <= most.saturating_mul(LOOKS_FOR_A_KEY as u64)
        && bytes() <= most.saturating_mul(BYTES_PER_KEY)
}

/// The shard that a chunk lies in, and its place there.
fn split(coords: &[u64], shard: &ShardMeta) -> (Vec<u64>, Vec<u64>) {
    let pairs = coords.iter().zip(&shard.counts);
    (pairs.clone().map(|(at, count)| at / count).collect(), pairs.map(|(at, count)| at % count).collect())
}

/// The chunk at a place in the index of a shard.
fn joined(of: &[u64], place: usize, shard: &ShardMeta) -> Vec<u64> {
    let mut coords: Vec<u64> = of.iter().zip(&shard.counts).map(|(of, count)| of * count).collect();
    let mut rest = place as u64;
    for axis in shard.order.iter().rev() {
        coords[*axis] += rest % shard.counts[*axis];
        rest /= shard.counts[*axis];
    }
    coords
}

impl ChunkSource for ZarrArray {
    fn read<'a>(&'a self, coords: &'a [u64]) -> ChunkFuture<'a> {
        Box::pin(self.read_chunk(coords))
    }

    fn fill(&self) -> [u8; 8] {
        self.meta.fill
    }

    fn presence(&self, most: usize) -> PresenceFuture<'_> {
        Box::pin(self.find_present(most, MOST_LISTED))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys::{Packing, archive};

    #[test]
    fn a_place_in_a_shard_leads_back() {
        let shard = ShardMeta {
            counts: vec![2, 3, 4],
            order: vec![2, 0, 1],
            is_big_endian: false,
            has_checksum: true,
            is_index_first: true,
        };
        for coords in [[0, 0, 0], [5, 7, 9], [3, 2, 11]] {
            let (of, within) = split(&coords, &shard);
            assert_eq!(joined(&of, shard.entry(&within), &shard), coords);
        }
    }

    /// An array of 2x2x2 values a chunk and so many times 2x2 chunks a shard, by the keys of its files, with
    /// these shards along the first axis, of so many bytes. Each lists the chunks at these places as stored,
    /// or is too short for a list.
    fn files(deep: usize, shards: &[Option<&[usize]>], bytes: usize) -> Vec<(String, Vec<u8>)> {
        let meta = format!(
            "{{\"zarr_format\":3,\"node_type\":\"array\",\"shape\":[{},4,4],\"data_type\":\"uint8\",\"fill_value\":0,\
             \"chunk_grid\":{{\"name\":\"regular\",\"configuration\":{{\"chunk_shape\":[{},4,4]}}}},\
             \"chunk_key_encoding\":{{\"name\":\"default\"}},\
             \"codecs\":[{{\"name\":\"sharding_indexed\",\"configuration\":{{\"chunk_shape\":[2,2,2],\
             \"codecs\":[{{\"name\":\"bytes\"}}],\"index_location\":\"end\",\
             \"index_codecs\":[{{\"name\":\"bytes\",\"configuration\":{{\"endian\":\"little\"}}}}]}}}}]}}",
            2 * deep * shards.len(),
            2 * deep
        );
        let shard = |(nth, stored): (usize, &Option<&[usize]>)| {
            let entry = |place: usize| match stored.is_some_and(|stored| stored.contains(&place)) {
                true => [0, 8],
                false => [u64::MAX; 2],
            };
            let index: Vec<u8> = (0..4 * deep).flat_map(entry).flat_map(u64::to_le_bytes).collect();
            let content = match stored {
                Some(_) => [vec![0; bytes - index.len()], index].concat(),
                None => index[..2].to_vec(),
            };
            (format!("c/{nth}/0/0"), content)
        };
        let meta = ("zarr.json".to_owned(), meta.into_bytes());
        std::iter::once(meta).chain(shards.iter().enumerate().map(shard)).collect()
    }

    fn array_in(keys: impl KeyStore + 'static) -> ZarrArray {
        let keys: Arc<dyn KeyStore> = Arc::new(keys);
        pollster::block_on(open_array(&keys, "")).unwrap().unwrap()
    }

    /// Such files in a directory, 2x2x2 chunks a shard.
    fn sharded(directory: &std::path::Path, shards: &[Option<&[usize]>]) -> ZarrArray {
        for (key, content) in files(2, shards, 128) {
            let file = directory.join(key);
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            std::fs::write(file, content).unwrap();
        }
        array_in(crate::keys::Directory::new(directory))
    }

    /// Such files in an archive.
    fn archived(files: &[(String, Vec<u8>)], packing: impl Fn(&str) -> Packing) -> ZarrArray {
        let entries: Vec<(&str, &[u8], Packing)> =
            files.iter().map(|(key, content)| (&**key, &**content, packing(key))).collect();
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), archive(&entries)).unwrap();
        array_in(crate::keys::Zip::open(file.path()).unwrap())
    }

    /// The list of an array, and whether it is of chunks and not of shards.
    fn listed(array: &ZarrArray, most: usize, bytes: usize) -> (Vec<Vec<u32>>, bool) {
        let found = match pollster::block_on(array.find_present(most, bytes)).unwrap() {
            Presence::These(found) => found,
            other => panic!("{other:?}"),
        };
        let mut list: Vec<Vec<u32>> = found.iter().map(<[u32]>::to_vec).collect();
        list.sort_unstable();
        (list, found.is_of_chunks())
    }

    /// The chunks at the 8 places of a shard.
    fn all_of(shard: u32) -> Vec<Vec<u32>> {
        (0..8).map(|n| vec![2 * shard + n / 4, n / 2 % 2, n % 2]).collect()
    }

    #[test]
    fn an_index_that_cannot_be_read_leaves_the_others() {
        let directory = tempfile::tempdir().unwrap();
        let array = sharded(directory.path(), &[Some(&[3]), None, Some(&[])]);
        let expected = [vec![vec![0, 1, 1]], all_of(1)].concat();
        assert_eq!(listed(&array, 1 << 16, MOST_LISTED), (expected, true));
        let error = pollster::block_on(array.read_chunk(&[2, 0, 0])).err().unwrap().to_string();
        assert!(error.contains("c/1/0/0"), "{error}");
    }

    #[test]
    fn a_shard_that_is_too_large_to_inflate_or_encrypted_leaves_the_others() {
        let files = files(2, &[Some(&[3]), Some(&[0]), Some(&[]), Some(&[0])], 200);
        let array = archived(&files, |key| match key {
            "c/1/0/0" => Packing::said_to_have(70 << 20),
            "c/3/0/0" => Packing { is_encrypted: true, ..Packing::said_to_have(70 << 20) },
            _ => Packing::DEFLATED,
        });
        let expected = [vec![vec![0, 1, 1]], all_of(1), all_of(3)].concat();
        assert_eq!(listed(&array, 1 << 18, MOST_LISTED), (expected, true));
        for (at, says) in [([2, 0, 0], "zip -0"), ([6, 0, 0], "encrypted")] {
            let error = pollster::block_on(array.read_chunk(&at)).err().unwrap().to_string();
            assert!(error.contains(says), "{error}");
        }
    }

    #[test]
    fn indices_are_read_up_to_each_of_three_bounds() {
        let most = 10 * KEYS_PER_INDEX;
        for (what, edge) in [
            ("shards", [10, 0, 0]),
            ("entries", [0, most * LOOKS_FOR_A_KEY as u64, 0]),
            ("bytes", [0, 0, most * BYTES_PER_KEY]),
        ] {
            let read = |more: u64| {
                let [shards, entries, bytes] = edge.map(|n| if n > 0 { n + more } else { 0 });
                are_read(shards, entries, || bytes, most)
            };
            assert_eq!([read(0), read(1)], [true, false], "{what}");
        }
        assert!(are_read(1, 16, || 512, 1) && are_read(u64::MAX / 64, u64::MAX, || u64::MAX, u64::MAX));
    }

    /// Of each bound the edge, where the two others are far away.
    #[test]
    fn many_indices_long_ones_and_those_that_are_inflated_are_not_read() {
        let is_of_chunks = |array: &ZarrArray, most: usize| listed(array, most, MOST_LISTED).1;
        let directory = tempfile::tempdir().unwrap();
        let many = sharded(directory.path(), &[Some(&[3][..]); 9]);
        let most = 8 * KEYS_PER_INDEX as usize;
        assert_eq!([most, most + 1].map(|most| is_of_chunks(&many, most)), [false, true]);
        // 20 entries in 320 bytes.
        let long = archived(&files(5, &[Some(&[3])], 320), |_| Packing::STORED);
        assert_eq!([1, 2].map(|most| is_of_chunks(&long, most)), [false, true]);
        // 100,000 bytes are inflated, of which 512 are indices.
        let files = files(2, &[Some(&[3][..]); 4], 25_000);
        let [deflated, stored] =
            [Packing::DEFLATED, Packing::STORED].map(|packing| archived(&files, |_| packing));
        assert_eq!([195, 196].map(|most| is_of_chunks(&deflated, most)), [false, true]);
        assert!(is_of_chunks(&stored, 195));
        assert_eq!(listed(&deflated, 196, MOST_LISTED), listed(&stored, 196, MOST_LISTED));
    }

    #[test]
    fn a_list_takes_so_many_bytes_and_no_more() {
        let directory = tempfile::tempdir().unwrap();
        let array = sharded(directory.path(), &[Some(&[3, 5, 6]), Some(&[0, 1])]);
        // Five chunks of three axes; else the two shards, if there is room for these.
        assert_eq!([60, 59, 24].map(|bytes| listed(&array, 1 << 16, bytes).1), [true, false, false]);
        assert_eq!(listed(&array, 1 << 16, 24).0, [[0, 0, 0], [1, 0, 0]]);
        assert_eq!(pollster::block_on(array.find_present(1 << 16, 23)).unwrap(), Presence::Unknown);
    }

    #[test]
    fn shards_that_are_listed_hold_the_chunks_of_their_indices() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/v05-shards.zip");
        let keys: Arc<dyn KeyStore> = Arc::new(crate::keys::Zip::open(&path).unwrap());
        let array = pollster::block_on(open_array(&keys, "0")).unwrap().unwrap();
        let [(chunks, true), (shards, false)] = [1 << 16, 1].map(|most| listed(&array, most, MOST_LISTED))
        else {
            panic!("chunks, and shards")
        };
        let counts = &array.meta.shard.as_ref().unwrap().counts;
        let shard_of = |at: &Vec<u32>| -> Vec<u32> {
            at.iter().zip(counts).map(|(at, count)| at / *count as u32).collect()
        };
        assert!(!chunks.is_empty() && chunks.iter().all(|at| shards.contains(&shard_of(at))));
        assert_eq!(pollster::block_on(array.find_present(0, MOST_LISTED)).unwrap(), Presence::Unknown);
    }
}
