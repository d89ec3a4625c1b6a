//! Groups: textures that one material samples at the same coordinates, served by one feedback entry.
//!
//! A group has a number as textures have, under which feedback names pages of the group's *shape*: that of
//! its member with the most texels, without a clamp or bias and without a tail. Such an entry wants of every
//! member the pages that `overlap` finds. So a texture may be in several groups and be sampled alone as well,
//! and each member keeps its own clamp and bias.
//!
//! Feedback is taken apart here before pools, traces or predictions see it; none of them knows of groups.

use std::sync::Arc;

use crate::texture::geometry::Geometry;
use crate::texture::level_rule::LevelRule;
use crate::texture::page::TextureNumber;
use crate::wanted::feedback::{Feedback, merge_same};

mod overlap;
#[cfg(test)]
mod tests;

use overlap::Overlap;

/// A group among those of all pools.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GroupNumber(TextureNumber);

impl GroupNumber {
    /// The number under which feedback names the group's pages; no texture has it while the group is there.
    pub const fn number(self) -> TextureNumber {
        self.0
    }
}

/// Why textures cannot be a group.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GroupError {
    /// The group would be empty.
    #[error("a group of no textures; name one at least")]
    Empty,
    /// There is no such texture.
    #[error("there is no texture numbered {0}; it may have been removed")]
    NoTexture(u16),
    /// Images and volumes have no coordinates in common.
    #[error("images and volumes in one group; make a group of each")]
    Mixed,
    /// There is no number left.
    #[error(
        "there are {} textures and groups already, and page ids tell no more apart; remove one first",
        TextureNumber::MAX as u32 + 1
    )]
    TooMany,
}

/// All groups, by number.
#[derive(Debug, Default)]
pub(crate) struct Groups {
    groups: Vec<Option<Group>>,
    count: u32,
}

#[derive(Debug)]
struct Group {
    shape: Arc<Geometry>,
    /// Each once, in ascending order.
    members: Vec<TextureNumber>,
}

impl Groups {
    fn get(&self, number: TextureNumber) -> Option<&Group> {
        self.groups.get(usize::from(number.number()))?.as_ref()
    }

    /// Returns true if there is none.
    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Makes a group of these textures, each once, in ascending order, under a number that is free.
    pub(crate) fn add(
        &mut self,
        number: TextureNumber,
        shape: Arc<Geometry>,
        members: Vec<TextureNumber>,
    ) -> GroupNumber {
        let index = usize::from(number.number());
        if self.groups.len() <= index {
            self.groups.resize_with(index + 1, || None);
        }
        self.groups[index] = Some(Group { shape, members });
        self.count += 1;
        GroupNumber(number)
    }

    /// The shape that a group of textures of these shapes has.
    pub(crate) fn shape_among(shapes: &[Arc<Geometry>]) -> Result<&Arc<Geometry>, GroupError> {
        let texels = |shape: &Geometry| shape.size().iter().map(|&side| u128::from(side)).product::<u128>();
        // Of equally large ones the first.
        let largest = shapes.iter().rev().max_by_key(|shape| texels(shape)).ok_or(GroupError::Empty)?;
        if shapes.iter().any(|shape| shape.dims() != largest.dims()) {
            return Err(GroupError::Mixed);
        }
        Ok(largest)
    }

    /// The shape of a group that there is.
    pub(crate) fn shape(&self, group: GroupNumber) -> Option<&Arc<Geometry>> {
        Some(&self.get(group.0)?.shape)
    }

    /// The members of a group, in ascending order; none of one that there is not.
    pub(crate) fn members(&self, group: GroupNumber) -> &[TextureNumber] {
        self.get(group.0).map_or(&[], |group| &group.members)
    }

    /// Returns true if there was such a group.
    pub(crate) fn remove(&mut self, GroupNumber(number): GroupNumber) -> bool {
        let group = self.groups.get_mut(usize::from(number.number()));
        let was_there = group.and_then(Option::take).is_some();
        self.count -= u32::from(was_there);
        was_there
    }

    /// A texture that is gone is in no group any more.
    pub(crate) fn forget(&mut self, texture: TextureNumber) {
        self.groups.iter_mut().flatten().for_each(|group| group.members.retain(|member| *member != texture));
    }

    /// Puts what a feedback wants of textures alone into `wanted`: entries of groups are taken apart, each
    /// page stands once, in ascending order. `look_up` gives the shape and the level rule of a texture that
    /// there is.
    pub(crate) fn take_apart<'a>(
        &self,
        feedback: &Feedback,
        wanted: &mut Feedback,
        look_up: impl Fn(TextureNumber) -> Option<(&'a Geometry, LevelRule)>,
    ) {
        let Feedback { view, frame, pages, degenerate, gaps } = wanted;
        (*view, *frame) = (feedback.view, feedback.frame);
        (*degenerate, *gaps) = (feedback.degenerate, feedback.gaps);
        pages.clear();
        for run in feedback.pages.chunk_by(|a, b| a.page.texture() == b.page.texture()) {
            let Some(group) = self.get(run[0].page.texture()) else {
                pages.extend_from_slice(run);
                continue;
            };
            for &member in &group.members {
                let Some((own, rule)) = look_up(member) else { continue };
                let overlap = Overlap::new(&group.shape, member, own, rule);
                run.iter().for_each(|entry| overlap.want(entry, pages));
            }
        }
        // Mostly in order as they came: pages of members lie as those of the shape do.
        merge_same(pages);
    }
}
