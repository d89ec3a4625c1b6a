//! The pages of a trace, numbered, with their ancestors; and each frame's set.

use rustc_hash::FxHashMap;

use crate::record::trace::Trace;
use crate::texture::page::PageId;
use crate::texture::textures::Textures;

/// Every page that any frame wants, its ancestors included, tails left out: those are pinned.
#[derive(Debug)]
pub(crate) struct Pages {
    textures: Textures,
    ids: Vec<PageId>,
    /// The parent of each page, but where that is the tail.
    parents: Vec<Option<u32>>,
    /// The frames' sets, one after the other, each from coarse to fine.
    sets: Vec<u32>,
    /// Where each set ends.
    set_ends: Vec<usize>,
    /// The pages that feedback named, with their pixels; tails left out.
    named: Vec<(u32, u32)>,
    named_ends: Vec<usize>,
}

impl Pages {
    pub(crate) fn of(trace: &Trace) -> Pages {
        let mut pages = Pages {
            textures: trace.textures(),
            ids: Vec::new(),
            parents: Vec::new(),
            sets: Vec::new(),
            set_ends: Vec::new(),
            named: Vec::new(),
            named_ends: Vec::new(),
        };
        let mut numbers = FxHashMap::default();
        // The frame, counted from 1, whose set a page was last put into.
        let mut put_into: Vec<usize> = Vec::new();
        for (frame, wanted) in (1..).zip(trace.frames()) {
            let start = pages.sets.len();
            for wanted in wanted {
                if pages.textures.is_tail(wanted.page) {
                    continue;
                }
                let number = pages.number(wanted.page, &mut numbers);
                pages.named.push((number, wanted.pixels));
                put_into.resize(pages.ids.len(), 0);
                let mut next = Some(number);
                while let Some(page) = next.filter(|&page| put_into[page as usize] != frame) {
                    put_into[page as usize] = frame;
                    pages.sets.push(page);
                    next = pages.parents[page as usize];
                }
            }
            let ids = &pages.ids;
            pages.sets[start..].sort_unstable_by_key(|&page| {
                let id = ids[page as usize];
                (std::cmp::Reverse(id.level()), id)
            });
            pages.set_ends.push(pages.sets.len());
            pages.named_ends.push(pages.named.len());
        }
        pages
    }

    /// The number of a page that is no tail; it and its ancestors get one where they have none.
    fn number(&mut self, page: PageId, numbers: &mut FxHashMap<PageId, u32>) -> u32 {
        if let Some(&number) = numbers.get(&page) {
            return number;
        }
        let parent = self.textures.parent(page).filter(|&parent| !self.textures.is_tail(parent));
        let parent = parent.map(|parent| self.number(parent, numbers)); // at most as deep as there are levels
        let number = self.ids.len() as u32;
        self.ids.push(page);
        self.parents.push(parent);
        numbers.insert(page, number);
        number
    }

    pub(crate) fn len(&self) -> usize {
        self.ids.len()
    }

    pub(crate) fn textures(&self) -> &Textures {
        &self.textures
    }

    /// Tails.
    pub(crate) fn pins(&self) -> u64 {
        u64::from(self.textures.count())
    }

    pub(crate) fn id(&self, page: u32) -> PageId {
        self.ids[page as usize]
    }

    pub(crate) fn level(&self, page: u32) -> u8 {
        self.id(page).level()
    }

    /// Nearest first; tails left out.
    pub(crate) fn ancestors(&self, page: u32) -> impl Iterator<Item = u32> + '_ {
        std::iter::successors(self.parents[page as usize], |&page| self.parents[page as usize])
    }

    /// Each frame's set, from coarse to fine.
    pub(crate) fn sets(&self) -> impl DoubleEndedIterator<Item = &[u32]> + ExactSizeIterator {
        (0..self.set_ends.len()).map(|frame| self.set(frame))
    }

    /// A frame's set, from coarse to fine.
    pub(crate) fn set(&self, frame: usize) -> &[u32] {
        slice(&self.sets, &self.set_ends, frame)
    }

    /// What a frame's feedback named, with pixels.
    pub(crate) fn named(&self, frame: usize) -> &[(u32, u32)] {
        slice(&self.named, &self.named_ends, frame)
    }

    /// Pages of the largest frame's set, tails included.
    pub(crate) fn working_set_max(&self) -> u64 {
        self.pins() + self.sets().map(<[u32]>::len).max().unwrap_or(0) as u64
    }
}

fn slice<'a, T>(all: &'a [T], ends: &[usize], index: usize) -> &'a [T] {
    let start = if index == 0 { 0 } else { ends[index - 1] };
    &all[start..ends[index]]
}
