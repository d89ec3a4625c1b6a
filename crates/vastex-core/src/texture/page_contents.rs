//! Which pages of a texture have the same content.
//!
//! Ocean, sky, paper and the inside of a mask are the same tile over and over again. Where a source knows so,
//! such pages share one load and one slot ([`Pager`](crate::Pager)); of pages that it says nothing of, each
//! has a content of its own. What the bytes are is the source's business; here only which are the same.

use std::fmt;
use std::sync::Arc;

use bytes::Bytes;

use crate::texture::geometry::Geometry;
use crate::texture::numbering::PageNumbering;
use crate::texture::page::PagePos;

/// The content of each page finer than the tail, as a number: 1, 2 or 4 bytes a page, as the contents need,
/// or a rule that is asked about each ([`PageContents::of_rule`]).
///
/// Contents are numbered from 0, those of one constant colour first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageContents {
    numbering: PageNumbering,
    numbers: Numbers,
    constants: Vec<Bytes>,
    count: u32,
}

/// The number of each page's content plus 1, and 0 where it is like no other, by the page's entry.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Numbers {
    One(Vec<u8>),
    Two(Vec<u16>),
    Four(Vec<u32>),
    Rule(Rule),
}

/// Says the number of a page's content.
type NumberOf = dyn Fn(PagePos) -> Option<u32> + Send + Sync;

/// Says which content a page has. Two are the same if they are one.
#[derive(Clone)]
struct Rule(Arc<NumberOf>);

impl fmt::Debug for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Rule")
    }
}

impl PartialEq for Rule {
    fn eq(&self, other: &Rule) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Eq for Rule {}

impl Numbers {
    fn new(pages: usize, count: u32) -> Numbers {
        match count {
            0..=0xff => Numbers::One(vec![0; pages]),
            0x100..=0xffff => Numbers::Two(vec![0; pages]),
            _ => Numbers::Four(vec![0; pages]),
        }
    }

    fn get(&self, at: usize, pos: PagePos) -> Option<u32> {
        let number = match self {
            Numbers::Rule(rule) => return (rule.0)(pos),
            Numbers::One(numbers) => numbers.get(at).copied().map(u32::from),
            Numbers::Two(numbers) => numbers.get(at).copied().map(u32::from),
            Numbers::Four(numbers) => numbers.get(at).copied(),
        };
        number?.checked_sub(1)
    }

    fn set(&mut self, at: usize, number: Option<u32>) {
        let stored = number.map_or(0, |number| number + 1);
        match self {
            Numbers::One(numbers) => numbers[at] = stored as u8,
            Numbers::Two(numbers) => numbers[at] = stored as u16,
            Numbers::Four(numbers) => numbers[at] = stored,
            // Made of a rule alone, which says it.
            Numbers::Rule(_) => {}
        }
    }
}

impl PageContents {
    /// The contents that `number_of` names, for each page finer than the tail: below `count`, or `None` if
    /// the page is like no other. The first of them are constant colours, whose texels `constants` has as
    /// they are stored, all layers.
    ///
    /// Two textures in one pool whose constants have the same bytes share them, so what is stored otherwise
    /// than the pool holds it has to be left out ([`PageContents::without_constants`]). A number that is not
    /// below `count` counts as none.
    pub fn new(
        geometry: &Geometry,
        constants: Vec<Bytes>,
        count: u32,
        number_of: impl Fn(PagePos) -> Option<u32>,
    ) -> PageContents {
        let numbering = PageNumbering::new(geometry);
        let mut numbers = Numbers::new(numbering.entries() as usize, count);
        for pos in geometry.pages().filter(|&pos| !geometry.is_tail(pos)) {
            let number = number_of(pos).filter(|&number| number < count);
            numbers.set(numbering.entry_of(pos) as usize, number);
        }
        PageContents { numbering, numbers, constants, count }
    }

    /// The contents of pages that are too many to list: `number_of` is asked about a page whenever its
    /// content is looked up, several times a frame for each page in view, and always answers the same.
    pub fn of_rule(
        geometry: &Geometry,
        constants: Vec<Bytes>,
        count: u32,
        number_of: Arc<dyn Fn(PagePos) -> Option<u32> + Send + Sync>,
    ) -> PageContents {
        let of_count = move |pos| number_of(pos).filter(|&number| number < count);
        let numbers = Numbers::Rule(Rule(Arc::new(of_count)));
        PageContents { numbering: PageNumbering::new(geometry), numbers, constants, count }
    }

    /// These contents without constants: pages of one colour are told from others of the same texture alone.
    pub fn without_constants(&self) -> PageContents {
        PageContents { constants: Vec::new(), ..self.clone() }
    }

    /// The content of a page that exists, finer than the tail or the tail; `None` if it is like no other.
    pub fn of(&self, pos: PagePos) -> Option<u32> {
        self.numbers.get(self.place(pos)?, pos)
    }

    /// Contents.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The stored texel of a content of one constant colour.
    pub fn constant(&self, content: u32) -> Option<&Bytes> {
        self.constants.get(content as usize)
    }

    /// Pages that have one of the contents. Looks at each page.
    pub fn pages(&self) -> u64 {
        let finer = (0..self.numbering.pages()).filter_map(|number| self.numbering.pos_of(number));
        finer.filter(|&pos| self.of(pos).is_some()).count() as u64
    }

    /// The place of a page that exists in the order of all; `None` for the tail.
    pub(crate) fn place(&self, pos: PagePos) -> Option<usize> {
        self.numbering.entry_if_finer(pos).map(|entry| entry as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::geometry::GeometrySpec;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_page_has_the_content_that_was_said(
            width in 1u32..900, height in 1u32..900, volume: bool, count in prop::sample::select(vec![0u32, 3, 255, 256, 65_535, 65_536]),
        ) {
            let spec = match volume {
                true => GeometrySpec { page: 20, border: 2, ..GeometrySpec::volume([width / 8 + 1, height / 8 + 1, 50]) },
                false => GeometrySpec { page: 40, ..GeometrySpec::image(width, height) },
            };
            let geometry = Geometry::new(spec).unwrap();
            // Some pages are like no other, and some numbers are too large.
            let said = move |pos: PagePos| {
                let place = pos.coords().iter().fold(u32::from(pos.level), |n, &c| n.wrapping_mul(31).wrapping_add(c * 7));
                (place % 3 > 0).then_some(place.wrapping_mul(40_503) % (count + 2))
            };
            let kept = |pos: PagePos| said(pos).filter(|&number| number < count && !geometry.is_tail(pos));
            let contents = PageContents::new(&geometry, vec![Bytes::from_static(b"red")], count, said);
            for pos in geometry.pages() {
                prop_assert_eq!(contents.of(pos), kept(pos), "{}", pos);
            }
            prop_assert_eq!(contents.pages(), geometry.pages().filter(|&pos| kept(pos).is_some()).count() as u64);
            prop_assert!(contents.constant(0).is_some() && contents.constant(1).is_none());
            prop_assert!(contents.without_constants().constant(0).is_none());
            let rule = PageContents::of_rule(&geometry, vec![Bytes::from_static(b"red")], count, Arc::new(said));
            for pos in geometry.pages() {
                prop_assert_eq!(rule.of(pos), kept(pos), "{}", pos);
            }
            prop_assert_eq!(rule.pages(), contents.pages());
            prop_assert!(rule == rule.clone() && rule != contents);
        }
    }
}
