//! Which pages of a pool have the same content, and how each content stands.
//!
//! What [`PageContents`] numbers within a texture has here a number of the pool: constants of the same bytes
//! have one for all textures. Pages of one content need one load and one slot. The page that stands for the
//! others while its tile is asked for, loaded, failed or waits for the upload budget is the content's
//! *representative*; the others wait, and have its state for whoever asks. A page whose content has changed
//! leaves for good: it is like no other until its texture is added anew.
//!
//! A pool whose textures say nothing of contents has nothing here, and pays a look at an empty list.

use bytes::Bytes;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::table::pool::Slot;
use crate::texture::page::{Dims, PageId, TextureNumber};
use crate::texture::page_contents::PageContents;

/// A content of the pool.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct ContentId(u32);

impl ContentId {
    /// That of a page which is like no other.
    pub(crate) const NONE: ContentId = ContentId(u32::MAX);

    pub(crate) fn is_some(self) -> bool {
        self != ContentId::NONE
    }

    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// How a content stands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Content {
    /// Where its tile is.
    pub(super) slot: Option<Slot>,
    /// [`PageId::NONE`] where none is.
    pub(super) representative: PageId,
    /// The last round whose working set had a page of it.
    pub(super) wanted_round: u64,
    /// The last round whose order of loading had it.
    pub(super) listed_round: u64,
    /// The last plan of what comes after the view that loads it, and the last that has counted its slot.
    pub(super) planned: u64,
    pub(super) counted: u64,
    /// The frame in which its tile lost its slot.
    pub(super) evicted_at: Option<u64>,
}

impl Content {
    const NEW: Content = Content {
        slot: None,
        representative: PageId::NONE,
        wanted_round: 0,
        listed_round: 0,
        planned: 0,
        counted: 0,
        evicted_at: None,
    };
}

/// What is known of a texture that says which of its pages are the same.
#[derive(Debug)]
struct Shares {
    pages: Arc<PageContents>,
    dims: Dims,
    /// The number in the pool of each content.
    ids: Vec<ContentId>,
    left: Marks,
}

/// Pages that are like no other any more, by their places: a bit for each, in blocks of which there are those
/// that have one. The contents that the source has said stay as they are, in its memory.
#[derive(Debug, Default)]
struct Marks(FxHashMap<usize, [u64; Marks::WORDS]>);

impl Marks {
    const WORDS: usize = 8;
    const BITS: usize = 64;

    fn split(place: usize) -> (usize, usize, u32) {
        let word = place / Marks::BITS;
        (word / Marks::WORDS, word % Marks::WORDS, (place % Marks::BITS) as u32)
    }

    fn has(&self, place: usize) -> bool {
        let (block, word, bit) = Marks::split(place);
        self.0.get(&block).is_some_and(|words| words[word] >> bit & 1 == 1)
    }

    fn add(&mut self, place: usize) {
        let (block, word, bit) = Marks::split(place);
        self.0.entry(block).or_default()[word] |= 1 << bit;
    }
}

/// Which pages have the same content, and so may share a load and a slot.
#[derive(Debug, Default)]
pub(crate) struct Sharing {
    /// By the number of the texture.
    textures: Vec<Option<Shares>>,
    count: u32,
    contents: Vec<Content>,
    free: Vec<ContentId>,
    /// The content of each constant, and the textures that have it.
    constants: FxHashMap<Bytes, (ContentId, u32)>,
    /// Counts the plans of what comes after the view.
    pub(super) plan: u64,
    /// Pages to be let go of, kept for its memory.
    pub(super) trimmed: Vec<PageId>,
}

impl Sharing {
    /// Returns true if every page of every texture is like no other.
    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The content of a page of any texture.
    #[inline]
    pub(crate) fn of(&self, page: PageId) -> ContentId {
        match self.textures.get(usize::from(page.texture().number())) {
            Some(Some(shares)) => shares.of(page),
            _ => ContentId::NONE,
        }
    }

    pub(crate) fn get(&self, content: ContentId) -> Option<&Content> {
        self.contents.get(content.index())
    }

    pub(crate) fn get_mut(&mut self, content: ContentId) -> Option<&mut Content> {
        self.contents.get_mut(content.index())
    }

    /// The content of the page, where it has one that others may have too.
    pub(crate) fn content_of(&mut self, page: PageId) -> Option<&mut Content> {
        let content = self.of(page);
        self.get_mut(content)
    }

    /// The page that is loaded in the page's place, if that is another one.
    pub(crate) fn representative_of(&self, page: PageId) -> Option<PageId> {
        let representative = self.get(self.of(page))?.representative;
        (representative != page && representative != PageId::NONE).then_some(representative)
    }

    /// Adds a texture.
    pub(crate) fn add(&mut self, texture: TextureNumber, dims: Dims, pages: Arc<PageContents>) {
        let number = usize::from(texture.number());
        if self.textures.len() <= number {
            self.textures.resize_with(number + 1, || None);
        }
        let ids = (0..pages.count()).map(|content| self.id_of(pages.constant(content))).collect();
        self.textures[number] = Some(Shares { pages, dims, ids, left: Marks::default() });
        self.count += 1;
    }

    fn id_of(&mut self, constant: Option<&Bytes>) -> ContentId {
        if let Some((known, textures)) = constant.and_then(|texel| self.constants.get_mut(texel)) {
            *textures += 1;
            return *known;
        }
        let id = self.free.pop().unwrap_or(ContentId(self.contents.len() as u32));
        match self.contents.get_mut(id.index()) {
            Some(content) => *content = Content::NEW,
            None => self.contents.push(Content::NEW),
        }
        if let Some(texel) = constant {
            self.constants.insert(texel.clone(), (id, 1));
        }
        id
    }

    /// Forgets a texture, whose pages have given up their slots. What it was loading for others too is asked
    /// for anew.
    pub(crate) fn remove(&mut self, texture: TextureNumber) {
        let place = self.textures.get_mut(usize::from(texture.number()));
        let Some(Shares { pages, ids, .. }) = place.and_then(Option::take) else { return };
        self.count -= 1;
        for (number, id) in (0..).zip(ids) {
            let content = &mut self.contents[id.index()];
            if content.representative != PageId::NONE && content.representative.texture() == texture {
                content.representative = PageId::NONE;
            }
            let texel = pages.constant(number);
            let others = texel.and_then(|texel| self.constants.get_mut(texel)).map_or(0, |(_, textures)| {
                *textures -= 1;
                *textures
            });
            if others == 0 {
                texel.map(|texel| self.constants.remove(texel));
                self.free.push(id);
            }
        }
    }

    /// Returns true if the texture says which of its pages are the same.
    pub(crate) fn has(&self, texture: TextureNumber) -> bool {
        self.textures.get(usize::from(texture.number())).is_some_and(Option::is_some)
    }

    /// The page is like no other from now on.
    pub(crate) fn leave(&mut self, page: PageId) {
        self.release_representative(page);
        if let Some(Some(shares)) = self.textures.get_mut(usize::from(page.texture().number()))
            && let Some((place, _)) = shares.shared(page)
        {
            shares.left.add(place);
        }
    }

    /// The page represents its content no longer: the page of the content that comes first does so next.
    pub(crate) fn release_representative(&mut self, page: PageId) {
        if let Some(content) = self.content_of(page).filter(|content| content.representative == page) {
            content.representative = PageId::NONE;
        }
    }

    /// Every tile is gone.
    pub(crate) fn lose_tiles(&mut self) {
        self.contents.iter_mut().for_each(|content| content.slot = None);
    }

    /// All contents, those of no texture among them.
    #[cfg(feature = "checks")]
    pub(crate) fn iter(&self) -> impl Iterator<Item = (ContentId, &Content)> {
        (0..).map(ContentId).zip(&self.contents)
    }
}

impl Shares {
    #[inline]
    fn of(&self, page: PageId) -> ContentId {
        let content = self.shared(page).map(|(_, content)| content);
        content.map_or(ContentId::NONE, |content| self.ids[content as usize])
    }

    /// The place of a page that is like others, in the order of all, and the number of its content.
    #[inline]
    fn shared(&self, page: PageId) -> Option<(usize, u32)> {
        let pos = page.pos(self.dims);
        let (place, content) = (self.pages.place(pos)?, self.pages.of(pos)?);
        (!self.left.has(place)).then_some((place, content))
    }
}
