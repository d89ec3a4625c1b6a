//! Groups: textures that one material samples at the same coordinates, served by one feedback entry.
//!
//! A group has a number as textures have, under which feedback names pages of the group's *shape*: that of its member with the
//! most texels, without a clamp or bias and without a tail. Such an entry wants of every member the pages that `overlap` finds.
//! So a texture may be in several groups and be sampled alone as well, and each member keeps its own clamp and bias.
//!
//! Feedback is taken apart here before pools, traces or predictions see it; none of them knows of groups.

use std::sync::Arc;

use crate::feedback::{Feedback, WantedPage};
use crate::geometry::Geometry;
use crate::level_rule::LevelRule;
use crate::page::TextureId;
use crate::pagers::Pagers;
use crate::working_set::{WorkingSet, merge_same};

mod overlap;
#[cfg(test)]
mod tests;

use overlap::Overlap;

/// A group among those of all pools.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GroupId(TextureId);

impl GroupId {
    /// The number under which feedback names the group's pages; no texture has it while the group is there.
    pub const fn number(self) -> TextureId {
        self.0
    }
}

/// Why textures cannot be a group.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GroupError {
    /// It would be empty.
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
        TextureId::MAX as u32 + 1
    )]
    TooMany,
}

/// All groups, by number.
#[derive(Debug, Default)]
pub(crate) struct Groups {
    groups: Vec<Option<Group>>,
    count: u32,
    /// What a feedback with entries of groups comes to, kept for its memory.
    members_wanted: Feedback,
}

#[derive(Debug)]
struct Group {
    shape: Arc<Geometry>,
    /// Each once, in ascending order.
    members: Vec<TextureId>,
}

impl Groups {
    fn get(&self, number: TextureId) -> Option<&Group> {
        self.groups.get(usize::from(number.number()))?.as_ref()
    }

    fn add(&mut self, number: TextureId, group: Group) {
        let place = usize::from(number.number());
        if self.groups.len() <= place {
            self.groups.resize_with(place + 1, || None);
        }
        self.groups[place] = Some(group);
        self.count += 1;
    }

    fn remove(&mut self, number: TextureId) -> bool {
        let place = self.groups.get_mut(usize::from(number.number()));
        let was_there = place.and_then(Option::take).is_some();
        self.count -= u32::from(was_there);
        was_there
    }

    /// A texture that is gone is in no group any more.
    pub(crate) fn forget(&mut self, texture: TextureId) {
        self.groups.iter_mut().flatten().for_each(|group| group.members.retain(|member| *member != texture));
    }
}

impl Pagers {
    /// Makes a group of textures that there are, of any pools; naming one twice is the same as once.
    ///
    /// From the next feedback on an entry of the group wants of each member every page that overlaps the entry's page, at the
    /// level that the member's own size, clamp and bias imply. Costs in each feedback a visit of the group's entries for
    /// each member and of each page found, at most 64 for each feedback pixel.
    pub fn add_group(&mut self, members: &[TextureId]) -> Result<GroupId, GroupError> {
        let mut members = members.to_vec();
        members.sort_unstable();
        members.dedup();
        let shape_of = |texture: &TextureId| {
            self.geometry(*texture).cloned().ok_or(GroupError::NoTexture(texture.number()))
        };
        let shapes: Vec<Arc<Geometry>> = members.iter().map(shape_of).collect::<Result<_, _>>()?;
        let texels = |shape: &Geometry| shape.size().iter().map(|&side| u128::from(side)).product::<u128>();
        // Of equally large ones the first.
        let largest = shapes.iter().rev().max_by_key(|shape| texels(shape)).ok_or(GroupError::Empty)?;
        if shapes.iter().any(|shape| shape.dims() != largest.dims()) {
            return Err(GroupError::Mixed);
        }
        let number = self.numbers.first_free().ok_or(GroupError::TooMany)?;
        self.numbers.take_for_group(number);
        let shape = largest.clone();
        self.groups.add(number, Group { shape, members });
        Ok(GroupId(number))
    }

    /// Removes a group in the frame `frame`, the newest whose feedback may name it; its members stay. Says whether there was
    /// one. As with textures, its number is given again when no feedback can name it any more.
    pub fn remove_group(&mut self, group: GroupId, frame: u64) -> bool {
        let was_there = self.groups.remove(group.0);
        if was_there {
            self.numbers.leave(group.0, frame, 0);
        }
        was_there
    }

    /// The shape of a group that there is: feedback names pages of its levels, of which none is in a tail.
    pub fn group_shape(&self, group: GroupId) -> Option<&Arc<Geometry>> {
        Some(&self.groups.get(group.0)?.shape)
    }

    /// The textures that an entry of a group wants pages of, in ascending order; one that was removed is no member any more.
    pub fn group_members(&self, group: GroupId) -> &[TextureId] {
        self.groups.get(group.0).map_or(&[], |group| &group.members)
    }

    /// Sets how the levels of a texture are chosen where a group wants it; where feedback names the texture itself, that has
    /// been done. Says whether there is such a texture.
    pub fn set_levels(&mut self, texture: TextureId, rule: LevelRule) -> bool {
        let Some(pool) = self.pool_of(texture) else { return false };
        self.pager_mut(pool).is_some_and(|pager| pager.textures.set_rule(texture, rule))
    }

    /// How the levels of a texture are chosen, within the levels that it has.
    pub fn levels(&self, texture: TextureId) -> Option<LevelRule> {
        self.pager(self.pool_of(texture)?).textures.rule(texture)
    }

    /// Sets how many entries take turns in a feedback pixel at most, of textures that one material samples and that are no group; 1
    /// is where no material has several. So many jitter cycles it takes until every pixel has answered for each from all sample
    /// positions: as long a feedback counts, and as long a view is looked at before it has converged. 15 at most.
    pub fn set_turns(&mut self, turns: u32) {
        self.turns = turns;
        self.iter_mut().for_each(|pager| pager.set.set_turns(turns));
    }

    /// Feedbacks of a view after which it has been seen whole: a jitter cycle for each of the turns.
    pub fn feedback_cycle(&self) -> u32 {
        WorkingSet::cycle_of(self.turns)
    }

    fn geometry(&self, texture: TextureId) -> Option<&Arc<Geometry>> {
        self.pager(self.pool_of(texture)?).textures.geometry(texture)
    }

    /// What a feedback wants of textures alone: entries of groups are taken apart, each page stands once, in ascending order.
    pub fn of_members(&self, feedback: &Feedback) -> Feedback {
        let mut wanted = Feedback::default();
        self.take_apart(feedback, &mut wanted);
        wanted
    }

    /// Does `act` with what a feedback wants of textures alone. Without groups that is the feedback itself, and costs nothing.
    pub(crate) fn with_members<R>(
        &mut self,
        feedback: &Feedback,
        act: impl FnOnce(&mut Pagers, &Feedback) -> R,
    ) -> R {
        if self.groups.count == 0 {
            return act(self, feedback);
        }
        let mut wanted = std::mem::take(&mut self.groups.members_wanted);
        self.take_apart(feedback, &mut wanted);
        let result = act(self, &wanted);
        self.groups.members_wanted = wanted;
        result
    }

    fn take_apart(&self, feedback: &Feedback, wanted: &mut Feedback) {
        let Feedback { view, frame, pages, degenerate } = wanted;
        (*view, *frame, *degenerate) = (feedback.view, feedback.frame, feedback.degenerate);
        pages.clear();
        for run in feedback.pages.chunk_by(|a, b| a.page.texture() == b.page.texture()) {
            match self.groups.get(run[0].page.texture()) {
                Some(group) => group.members.iter().for_each(|&member| self.want(group, member, run, pages)),
                None => pages.extend_from_slice(run),
            }
        }
        // Mostly in order as they came: pages of members lie as those of the shape do.
        merge_same(pages);
    }

    /// Adds what entries of a group want of a member.
    fn want(&self, group: &Group, member: TextureId, entries: &[WantedPage], pages: &mut Vec<WantedPage>) {
        let Some(own) = self.geometry(member) else { return };
        let rule = self.levels(member).unwrap_or_default();
        let overlap = Overlap::new(&group.shape, member, own, rule);
        entries.iter().for_each(|entry| overlap.want(entry, pages));
    }
}
