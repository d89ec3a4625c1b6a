//! A decorator that copies each decoded tile to memory from which a GPU uploads, on the thread that loads the
//! tile.
//!
//! Whose memory that is, and how rows lie in it, is the business of [`Staging`]. A tile still goes on as
//! bytes, so that whoever passes it on, keeps or drops it need not know of staging. [`Staged`] finds the room
//! of a tile by these bytes; when the last clone of the bytes is dropped, the room is free again.

use std::any::Any;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use bytes::Bytes;
use vastex_core::{Description, PagePos};

use super::{ReadFuture, TileSource};
use crate::ground::sync::lock;
use crate::tile::{Codec, Tile};

/// Memory that tiles are put into before they are uploaded.
pub trait Staging: Send + Sync {
    /// Copies the bytes of a decoded tile and returns their room, or `None` if there is no room at the
    /// moment: the tile is then uploaded from its own bytes. Never waits for room.
    fn stage(&self, tile: &[u8]) -> Option<Room>;
}

/// Memory that holds a staged tile; free again when the last clone is dropped.
pub type Room = Arc<dyn Any + Send + Sync>;

/// All tiles that are staged at the moment, shared by the [`StagedSource`]s that stage into the same memory.
#[derive(Clone, Default)]
pub struct Staged(Arc<Mutex<Rooms>>);

/// Rooms by the address of a tile's bytes, each with a number: several tiles may have the same bytes in
/// memory.
#[derive(Default)]
struct Rooms {
    by_address: HashMap<usize, Vec<(u64, Room)>>,
    made: u64,
}

impl Staged {
    /// The room of a staged tile, or `None` if the tile is not staged. `tile` are the bytes that a
    /// [`StagedSource`] gave, or a clone of them.
    pub fn room_of(&self, tile: &Bytes) -> Option<Room> {
        let rooms = lock(&self.0);
        let (_, room) = rooms.by_address.get(&address(tile))?.last()?;
        Some(room.clone())
    }

    /// The number of tiles that are staged.
    pub fn tiles(&self) -> usize {
        lock(&self.0).by_address.values().map(Vec::len).sum()
    }

    /// These bytes, in the room; [`Staged::room_of`] finds the room until they are dropped.
    fn holding(&self, tile: Bytes, room: Room) -> Bytes {
        let mut rooms = lock(&self.0);
        let number = rooms.made;
        rooms.made += 1;
        rooms.by_address.entry(address(&tile)).or_default().push((number, room));
        drop(rooms);
        Bytes::from_owner(Held { tile, number, staged: self.clone() })
    }
}

impl std::fmt::Debug for Staged {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Staged").field("tiles", &self.tiles()).finish()
    }
}

fn address(tile: &[u8]) -> usize {
    tile.as_ptr().addr()
}

/// The owner of a staged tile's bytes.
struct Held {
    tile: Bytes,
    number: u64,
    staged: Staged,
}

impl AsRef<[u8]> for Held {
    fn as_ref(&self) -> &[u8] {
        &self.tile
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        let (mut rooms, address) = (lock(&self.staged.0), address(&self.tile));
        let Some(here) = rooms.by_address.get_mut(&address) else { return };
        let place = here.iter().position(|(number, _)| *number == self.number);
        let room = place.map(|place| here.swap_remove(place));
        if here.is_empty() {
            rooms.by_address.remove(&address);
        }
        // Outside the lock: what goes with a room is the staging's business.
        drop(rooms);
        drop(room);
    }
}

/// A decorator that decodes and stages the tiles of a source as they are read.
pub struct StagedSource<S> {
    source: S,
    staging: Arc<dyn Staging>,
    staged: Staged,
}

impl<S: TileSource> StagedSource<S> {
    /// Puts staging before `source`. `staging` takes tiles of the size that the source's description says;
    /// `staged` finds them again.
    pub fn new(source: S, staging: Arc<dyn Staging>, staged: Staged) -> StagedSource<S> {
        StagedSource { source, staging, staged }
    }

    /// Decodes and stages a tile. A tile that does not decode goes on as it is, so that the error comes from
    /// whoever decodes it.
    fn staged(&self, tile: Tile) -> Tile {
        let Ok(bytes) = tile.decode(self.description()) else { return tile };
        let bytes = match self.staging.stage(&bytes) {
            Some(room) => self.staged.holding(bytes, room),
            None => bytes,
        };
        Tile { codec: Codec::Raw, bytes }
    }
}

impl<S: TileSource> TileSource for StagedSource<S> {
    fn behind(&self) -> Option<&dyn TileSource> {
        Some(&self.source)
    }

    fn description(&self) -> &Arc<Description> {
        self.source.description()
    }

    /// The tail is uploaded once, when the texture is added, and is not staged.
    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        if self.description().geometry.is_tail(pos) {
            return self.source.read(pos);
        }
        Box::pin(async move { Ok(self.staged(self.source.read(pos).await?)) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loader::Loader;
    use crate::sources::LimitedSource;
    use crate::sources::PropertySource;
    use crate::stores::ReadLimit;
    use vastex_core::{Dims, Geometry, GeometrySpec, PageId, TextureNumber};

    /// Room for so many tiles, each a copy.
    struct Shelf {
        rooms: usize,
        taken: Arc<()>,
    }

    struct Copy {
        bytes: Vec<u8>,
        _taken: Arc<()>,
    }

    impl Shelf {
        fn taken(&self) -> usize {
            Arc::strong_count(&self.taken) - 1
        }
    }

    impl Staging for Shelf {
        fn stage(&self, tile: &[u8]) -> Option<Room> {
            let copy = || Copy { bytes: tile.to_vec(), _taken: self.taken.clone() };
            (self.taken() < self.rooms).then(|| Arc::new(copy()) as Room)
        }
    }

    fn world(rooms: usize) -> (Arc<Shelf>, Staged, StagedSource<Arc<PropertySource>>) {
        let geometry = Geometry::new(GeometrySpec::image(1000, 700)).unwrap();
        let (shelf, staged) = (Arc::new(Shelf { rooms, taken: Arc::default() }), Staged::default());
        let source =
            StagedSource::new(Arc::new(PropertySource::new(geometry)), shelf.clone(), staged.clone());
        (shelf, staged, source)
    }

    fn read(source: &dyn TileSource, x: u32) -> Bytes {
        let tile = pollster::block_on(source.read(PagePos::new_2d(0, x, 1))).unwrap();
        tile.decode(source.description()).unwrap()
    }

    #[test]
    fn a_tile_is_found_as_long_as_its_bytes_are_there() {
        let (shelf, staged, source) = world(9);
        let (first, second) = (read(&source, 0), read(&source, 1));
        for tile in [&first, &second] {
            let room = staged.room_of(tile).unwrap().downcast::<Copy>().unwrap();
            assert_eq!(room.bytes, **tile);
        }
        assert_eq!((staged.tiles(), shelf.taken()), (2, 2));
        let clone = first.clone();
        drop(first);
        assert!(staged.room_of(&clone).is_some());
        drop(clone);
        assert_eq!((staged.tiles(), shelf.taken()), (1, 1));
        // A room that somebody has is theirs until they drop it.
        let room = staged.room_of(&second);
        drop(second);
        assert_eq!((staged.tiles(), shelf.taken()), (0, 1));
        drop(room);
        assert_eq!(shelf.taken(), 0);
    }

    #[test]
    fn the_limit_of_a_source_is_that_of_the_staged_one() {
        let (shelf, staged, source) = world(9);
        assert!(source.read_limit().is_none());
        let limit = ReadLimit::new(3);
        let limited = Arc::new(LimitedSource::new(source, limit.clone()));
        let source = StagedSource::new(limited, shelf, staged);
        assert!(source.read_limit().is_some_and(|found| Arc::ptr_eq(found, &limit)));
    }

    #[test]
    fn bytes_that_several_tiles_share_have_a_room_for_each() {
        let (shelf, staged, _) = world(9);
        let tile = Bytes::from(vec![7; 100]);
        let hold = || staged.holding(tile.clone(), shelf.stage(&tile).unwrap());
        let (first, second) = (hold(), hold());
        assert_eq!((staged.tiles(), shelf.taken()), (2, 2));
        drop(first);
        assert!(staged.room_of(&second).is_some());
        drop(second);
        assert_eq!((staged.tiles(), shelf.taken()), (0, 0));
    }

    #[test]
    fn without_room_tiles_come_as_they_are() {
        let (shelf, staged, source) = world(1);
        let (first, second) = (read(&source, 0), read(&source, 1));
        assert!(staged.room_of(&first).is_some() && staged.room_of(&second).is_none());
        assert_eq!(second.len(), source.description().tile_bytes());
        assert_eq!(shelf.taken(), 1);
        // The tail is not staged.
        let tail = pollster::block_on(source.read(source.description().geometry.tail_pos())).unwrap();
        assert!(staged.room_of(&tail.bytes).is_none());
    }

    #[test]
    fn what_is_called_off_or_dropped_leaves_nothing_behind() {
        let (shelf, staged, source) = world(99);
        let texture = TextureNumber::new(0).unwrap();
        let mut loader = Loader::new(2).unwrap();
        loader.add_source(texture, Arc::new(source));
        let page = |x| PageId::new(texture, Dims::D2, PagePos::new_2d(0, x, 0)).unwrap();
        (0..7).for_each(|x| loader.request(page(x), 0));
        (0..7).step_by(2).for_each(|x| loader.cancel(page(x)));
        let ended: Vec<_> = std::iter::from_fn(|| loader.wait()).collect();
        assert_eq!(ended.len(), 7);
        let loaded = ended.iter().filter(|loaded| loaded.result.is_ok()).count();
        assert_eq!((staged.tiles(), shelf.taken()), (loaded, loaded));
        drop(ended);
        assert_eq!((staged.tiles(), shelf.taken()), (0, 0));
    }
}
