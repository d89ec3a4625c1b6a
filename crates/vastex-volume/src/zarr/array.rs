//! An array where it lies: opened by its metadata, read chunk by chunk.

use std::sync::Arc;

use super::metadata::{ArrayMeta, ShardMeta};
use super::shards::{ShardIndices, checked};
use super::{v2, v3};
use crate::chunks::{Chunk, ChunkFuture, ChunkList, ChunkSource, LOOKS_FOR_A_KEY, Presence, PresenceFuture};
use crate::fault::{Oddities, VANISHED, VolumeError, VolumeFault};
use crate::json::{read_json, text};
use crate::keys::{KeyStore, Span, join, shown};
use crate::values::swap_bytes;

/// Names that are looked at to find out how keys are separated: what is not a chunk's is a handful.
const MOST_PROBED: usize = 256;
/// Keys that are listed in the time in which an index is read.
const KEYS_PER_INDEX: usize = 64;
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

    async fn find_present(&self, most: usize) -> Result<Presence, VolumeError> {
        let counts = self.counts();
        let axes = counts.len();
        let mut found = ChunkList::new(axes);
        let mut keep = |key: &str| {
            let coords = self.meta.keys.coords(key, axes);
            let is_within = |coords: &Vec<u64>| coords.iter().zip(&counts).all(|(at, count)| at < count);
            // Counts are of sides up to 2^31.
            found.coords.extend(coords.filter(is_within).iter().flatten().map(|at| *at as u32));
        };
        let keys = if self.keys.is_listed() { most.saturating_mul(LOOKS_FOR_A_KEY) } else { most };
        if self.keys.list(&self.prefix, keys, &mut keep).await? {
            return Ok(Presence::Unknown);
        }
        let Some(shard) = &self.meta.shard else { return Ok(Presence::These(found)) };
        // Every chunk of an index is looked at, whether it is stored or not.
        let shards = found.iter().count();
        let entries = (shards as u64).saturating_mul(shard.chunks());
        let key_of = |of: &[u32]| {
            let of: Vec<u64> = of.iter().map(|at| u64::from(*at)).collect();
            join(&self.prefix, &self.meta.keys.key(&of))
        };
        let bytes_of = |of| self.keys.bytes_for_part(&key_of(of), shard.index_bytes());
        if entries > most.saturating_mul(LOOKS_FOR_A_KEY) as u64
            || shards > most.div_ceil(KEYS_PER_INDEX)
            || found.iter().map(bytes_of).fold(0, u64::saturating_add)
                > (most as u64).saturating_mul(BYTES_PER_KEY)
        {
            return Ok(Presence::These(ChunkList { cell: shard.counts.clone(), ..found }));
        }
        let mut present = ChunkList::new(axes);
        // Chunks of a shard may lie beyond the array's edge.
        let sides = self.meta.shape.iter().zip(&self.meta.chunk);
        let chunks: Vec<u64> = sides.map(|(side, chunk)| side.div_ceil(*chunk)).collect();
        for of in found.iter() {
            let of: Vec<u64> = of.iter().map(|at| u64::from(*at)).collect();
            let key = join(&self.prefix, &self.meta.keys.key(&of));
            let stored: Vec<usize> = match self.shards.get(&*self.keys, &key, shard).await {
                Ok(None) => continue,
                Ok(Some(index)) => index.stored().collect(),
                // It tells nothing of its own chunks, which will say what is wrong where they are read.
                Err(_) => (0..shard.chunks() as usize).collect(),
            };
            for place in stored {
                let coords = joined(&of, place, shard);
                if coords.iter().zip(&chunks).all(|(at, count)| at < count) {
                    present.coords.extend(coords.iter().map(|at| *at as u32));
                }
            }
        }
        Ok(Presence::These(present))
    }

    /// Chunks, or shards, along each axis.
    fn counts(&self) -> Vec<u64> {
        let sides = self.meta.shape.iter().zip(&self.meta.chunk).enumerate();
        let per_key = |axis: usize| self.meta.shard.as_ref().map_or(1, |shard| shard.counts[axis]);
        sides.map(|(axis, (side, chunk))| side.div_ceil(chunk * per_key(axis))).collect()
    }
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
        Box::pin(self.find_present(most))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// An array of 2x2x2 values a chunk and 2x2x2 chunks a shard, with these shards along the first axis.
    /// Each lists the chunks at these places as stored, or is too short for a list.
    fn sharded(directory: &std::path::Path, shards: &[Option<&[usize]>]) -> ZarrArray {
        let meta = format!(
            "{{\"zarr_format\":3,\"node_type\":\"array\",\"shape\":[{},4,4],\"data_type\":\"uint8\",\"fill_value\":0,\
             \"chunk_grid\":{{\"name\":\"regular\",\"configuration\":{{\"chunk_shape\":[4,4,4]}}}},\
             \"chunk_key_encoding\":{{\"name\":\"default\"}},\
             \"codecs\":[{{\"name\":\"sharding_indexed\",\"configuration\":{{\"chunk_shape\":[2,2,2],\
             \"codecs\":[{{\"name\":\"bytes\"}}],\"index_location\":\"end\",\
             \"index_codecs\":[{{\"name\":\"bytes\",\"configuration\":{{\"endian\":\"little\"}}}}]}}}}]}}",
            4 * shards.len()
        );
        std::fs::write(directory.join("zarr.json"), meta).unwrap();
        for (nth, stored) in shards.iter().enumerate() {
            let entry = |place: usize| match stored.is_some_and(|stored| stored.contains(&place)) {
                true => [0, 8],
                false => [u64::MAX; 2],
            };
            let index: Vec<u8> = (0..8).flat_map(entry).flat_map(u64::to_le_bytes).collect();
            let shard = directory.join(format!("c/{nth}/0/0"));
            std::fs::create_dir_all(shard.parent().unwrap()).unwrap();
            std::fs::write(shard, if stored.is_some() { &index } else { &index[..2] }).unwrap();
        }
        let keys: Arc<dyn KeyStore> = Arc::new(crate::keys::Directory::new(directory));
        pollster::block_on(open_array(&keys, "")).unwrap().unwrap()
    }

    #[test]
    fn an_index_that_cannot_be_read_leaves_the_others() {
        let directory = tempfile::tempdir().unwrap();
        let array = sharded(directory.path(), &[Some(&[3]), None, Some(&[])]);
        let Presence::These(found) = pollster::block_on(array.find_present(1 << 16)).unwrap() else {
            panic!()
        };
        let mut found: Vec<&[u32]> = found.iter().collect();
        found.sort_unstable();
        let cut = [[2, 0, 0], [2, 0, 1], [2, 1, 0], [2, 1, 1], [3, 0, 0], [3, 0, 1], [3, 1, 0], [3, 1, 1]];
        let expected: Vec<&[u32]> =
            std::iter::once(&[0, 1, 1][..]).chain(cut.iter().map(|at| &at[..])).collect();
        assert_eq!(found, expected);
        let error = pollster::block_on(array.read_chunk(&[2, 0, 0])).err().unwrap().to_string();
        assert!(error.contains("c/1/0/0"), "{error}");
    }

    #[test]
    fn many_indices_and_those_that_are_inflated_are_not_read() {
        let directory = tempfile::tempdir().unwrap();
        let array = sharded(directory.path(), &[Some(&[3][..]); 9]);
        let of_chunks = |most| match pollster::block_on(array.find_present(most)).unwrap() {
            Presence::These(found) => found.is_of_chunks().then(|| found.iter().count()),
            other => panic!("{other:?}"),
        };
        assert_eq!([8 * KEYS_PER_INDEX, 8 * KEYS_PER_INDEX + 1].map(of_chunks), [None, Some(9)]);
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/deflated.zip");
        let zip = crate::keys::Zip::open(&path).unwrap();
        let mut keys = Vec::new();
        pollster::block_on(zip.list("", usize::MAX, &mut |key: &str| keys.push(key.to_owned()))).unwrap();
        assert!(keys.iter().any(|key| zip.bytes_for_part(key, 16) > 16));
        assert_eq!(zip.bytes_for_part("nothing", 16), 16);
    }

    #[test]
    fn chunks_in_indices_count_whether_they_are_stored_or_not() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/v05-shards.zip");
        let keys: Arc<dyn KeyStore> = Arc::new(crate::keys::Zip::open(&path).unwrap());
        let array = pollster::block_on(open_array(&keys, "0")).unwrap().unwrap();
        let found = |most| match pollster::block_on(array.find_present(most)).unwrap() {
            Presence::These(stored) => stored,
            other => panic!("{other:?}"),
        };
        let (all, shards) = (found(1 << 16), found(1));
        assert!(all.is_of_chunks() && !shards.is_of_chunks());
        let shard = array.meta.shard.as_ref().unwrap();
        let of_shards: std::collections::BTreeSet<Vec<u32>> = all
            .iter()
            .map(|at| at.iter().zip(&shard.counts).map(|(at, count)| at / *count as u32).collect())
            .collect();
        let listed = shards.iter().map(<[u32]>::to_vec).collect();
        assert!(of_shards.is_subset(&listed) && !of_shards.is_empty());
        assert_eq!(pollster::block_on(array.find_present(0)).unwrap(), Presence::Unknown);
    }
}
