//! Groups among the textures of all pools: which there are, and what feedback that names them wants of their
//! members.

use std::sync::Arc;

use crate::pager::Pager;
use crate::texture::geometry::Geometry;
use crate::texture::level_rule::LevelRule;
use crate::texture::page::TextureNumber;
use crate::wanted::feedback::Feedback;
use crate::wanted::groups::{GroupError, GroupNumber, Groups};

impl Pager {
    /// Makes a group of textures that there are, of any pools; naming one twice is the same as once.
    ///
    /// From the next feedback on an entry of the group wants of each member every page that overlaps the
    /// entry's page, at the level that the member's own size, clamp and bias imply. Costs in each feedback a
    /// visit of the group's entries for each member and of each page found, at most 64 for each feedback
    /// pixel.
    pub fn add_group(&mut self, members: &[TextureNumber]) -> Result<GroupNumber, GroupError> {
        let mut members = members.to_vec();
        members.sort_unstable();
        members.dedup();
        let shape_of = |texture: &TextureNumber| {
            self.geometry(*texture).cloned().ok_or(GroupError::NoTexture(texture.number()))
        };
        let shapes: Vec<Arc<Geometry>> = members.iter().map(shape_of).collect::<Result<_, _>>()?;
        let shape = Groups::shape_among(&shapes)?.clone();
        let number = self.ids.first_free().ok_or(GroupError::TooMany)?;
        self.ids.take_for_group(number);
        Ok(self.groups.add(number, shape, members))
    }

    /// Removes a group in the frame `frame`, the newest whose feedback may name it; its members stay. Returns
    /// true if there was one. As with textures, its number is reused when no feedback can name it any more.
    pub fn remove_group(&mut self, group: GroupNumber, frame: u64) -> bool {
        let was_there = self.groups.remove(group);
        if was_there {
            self.ids.leave(group.number(), frame, 0);
        }
        was_there
    }

    /// The shape of a group that there is: feedback names pages of its levels, of which none is in a tail.
    pub fn group_shape(&self, group: GroupNumber) -> Option<&Arc<Geometry>> {
        self.groups.shape(group)
    }

    /// The textures that an entry of a group wants pages of, in ascending order; one that was removed is no
    /// member any more.
    pub fn group_members(&self, group: GroupNumber) -> &[TextureNumber] {
        self.groups.members(group)
    }

    /// Sets how the levels of a texture are chosen where a group wants it; where feedback names the texture
    /// itself, that has been done. Returns true if there is such a texture.
    pub fn set_levels(&mut self, texture: TextureNumber, rule: LevelRule) -> bool {
        let Some(pool) = self.pool_of(texture) else { return false };
        self.pool_mut(pool).is_some_and(|pool| pool.textures.set_rule(texture, rule))
    }

    /// How the levels of a texture are chosen, within the levels that it has.
    pub fn levels(&self, texture: TextureNumber) -> Option<LevelRule> {
        self.pool(self.pool_of(texture)?).textures.rule(texture)
    }

    fn geometry(&self, texture: TextureNumber) -> Option<&Arc<Geometry>> {
        self.pool(self.pool_of(texture)?).textures.geometry(texture)
    }

    /// What a feedback wants of textures alone: entries of groups are taken apart, each page stands once, in
    /// ascending order.
    pub fn of_members(&self, feedback: &Feedback) -> Feedback {
        let mut wanted = Feedback::default();
        self.take_apart(feedback, &mut wanted);
        wanted
    }

    /// Does `act` with what a feedback wants of textures alone. Without groups that is the feedback itself,
    /// and costs nothing.
    pub(crate) fn with_members<R>(
        &mut self,
        feedback: &Feedback,
        act: impl FnOnce(&mut Pager, &Feedback) -> R,
    ) -> R {
        if self.groups.is_empty() {
            return act(self, feedback);
        }
        let mut wanted = std::mem::take(&mut self.members_wanted);
        self.take_apart(feedback, &mut wanted);
        let result = act(self, &wanted);
        self.members_wanted = wanted;
        result
    }

    fn take_apart(&self, feedback: &Feedback, wanted: &mut Feedback) {
        self.groups.take_apart(feedback, wanted, |member| {
            let textures = &self.pool(self.pool_of(member)?).textures;
            Some((&**textures.geometry(member)?, textures.rule(member)?))
        });
    }
}
