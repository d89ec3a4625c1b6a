//! Groups: several textures, or several layers, that one shader samples, through one bind group.

use std::sync::Arc;

use vastex_core::{Event, GroupError, GroupNumber, TextureNumber};

use super::Textures;
use crate::error::Error;
use crate::ids::{GroupId, LayerId, Member};

impl Textures {
    /// Makes a group of textures, or of layers of them, of any sizes, formats and pools, for a shader that
    /// samples all of them through one bind group.
    ///
    /// One feedback entry, `vastex_feedback(ids.all, view, uv)`, serves all members that are sampled at the
    /// same coordinates: it names pages of the largest member, and of each other member the pages beneath
    /// them are loaded, at the level that its size, clamp and bias imply. Members
    /// [apart](crate::Member::apart) have entries of their own; since a feedback pixel gives one answer,
    /// several of them take turns with `vastex_turn`, and wants last, and convergence waits, for as many
    /// jitter cycles. An entry asks for the level of the member whose filter needs the finest: beside an
    /// anisotropic member, one that is sampled nearest gets pages up to three levels finer than it shows,
    /// where the view is at a slant; if it is of another texture, and that is too much, make it a member
    /// apart. [`wgsl()`](crate::wgsl()) lists the functions that a shader calls.
    ///
    /// ```no_run
    /// # const MY_SHADER: &str = "";
    /// # fn app(textures: &mut vastex::Textures, [earth, lights, clouds]: [vastex::TextureId; 3]) -> Result<(), vastex::Error> {
    /// let planet = textures.add_group([("color", earth), ("night", lights), ("clouds", clouds)])?;
    /// let shader = MY_SHADER.to_owned() + &textures.wgsl(&textures.kinds(planet)?); // calls vastex_sample_color(ids.color, uv), ...
    /// let ids = textures.bindings().ids(planet)?; // `VastexIds` of WGSL, for a material or an instance
    /// // and each frame: groups.get(planet), textures.bind_group(planet)
    /// # let _ = (shader, ids);
    /// # Ok(()) }
    /// ```
    ///
    /// Fails if a name cannot stand in WGSL, if there is no such texture, or if there are more pools or
    /// layers than a shader of the device can read. Bind groups may be replaced, as [`Textures::bind_group`]
    /// says. Costs 2 KB of GPU memory.
    pub fn add_group<M: Into<Member>>(
        &mut self,
        members: impl IntoIterator<Item = M>,
    ) -> Result<GroupId, Error> {
        self.catch_up()?;
        let members: Vec<Member> = members.into_iter().map(Into::into).collect();
        for layer in members.iter().map(|member| member.layer) {
            self.number(layer.texture()).ok_or(GroupError::NoTexture(layer.number().number()))?;
        }
        let served = members.iter().filter(|member| !member.is_apart).map(|member| member.layer);
        let mut answered = distinct_textures(served);
        if answered.is_empty() {
            // Those that nothing answers for together have a number all the same, which no pixel names.
            answered = distinct_textures(members.iter().map(|member| member.layer));
        }
        let id = self.paging.add_group(&answered)?;
        let shape = self.paging.pager().group_shape(id).map(Arc::clone);
        let added = shape.ok_or(GroupError::Empty.into());
        if let Err(error) = added.and_then(|shape| self.gpu.add_group(id, &shape, members)) {
            self.paging.remove_group(id);
            return Err(error);
        }
        self.paging.set_turns(self.gpu.most_turns());
        if let Err(error) = self.catch_up() {
            self.remove_group(id);
            return Err(error);
        }
        Ok(GroupId::new(id, self.gpu.generation(id.number())))
    }

    /// Removes a group; its members stay. Returns true if there was one.
    pub(super) fn remove_group(&mut self, group: GroupNumber) -> bool {
        let was_there = self.paging.remove_group(group);
        if was_there {
            self.gpu.remove_group(group);
            self.paging.set_turns(self.gpu.most_turns());
        }
        was_there
    }

    /// Groups that have lost a texture cannot be drawn any more.
    pub(super) fn remove_groups_of(&mut self, texture: TextureNumber) {
        for group in self.gpu.groups_of(texture) {
            if self.remove_group(group) {
                self.paging.report(Event::GroupRemoved { group });
            }
        }
    }
}

fn distinct_textures(layers: impl Iterator<Item = LayerId>) -> Vec<TextureNumber> {
    let mut textures: Vec<TextureNumber> = layers.map(LayerId::number).collect();
    textures.sort_unstable();
    textures.dedup();
    textures
}
