//! Groups: several textures, or several layers, that one shader samples under names.

use std::sync::Arc;

use vastex_core::{Geometry, GroupError, GroupNumber, PoolId, TextureNumber};
use vastex_wgpu::{KindMember, Kinds, check_bindings};

use super::Gpu;
use crate::error::Error;
use crate::ids::{GroupId, Member};

/// A group on the GPU.
pub(super) struct GroupState {
    id: GroupNumber,
    /// By which shaders know it as a whole.
    shader_id: u32,
    /// That of its feedback entries.
    geometry: Arc<Geometry>,
    members: Vec<Member>,
    /// Feedback entries that answer for its members.
    turns: u32,
    kinds: Kinds,
}

impl Gpu {
    /// Makes a group that the pager has given its number and this shape.
    pub(crate) fn add_group(
        &mut self,
        id: GroupNumber,
        shape: &Arc<Geometry>,
        members: Vec<Member>,
    ) -> Result<(), Error> {
        let apart = members.iter().filter(|member| member.is_apart).count();
        let turns = (apart + usize::from(apart < members.len())) as u32;
        let kinds = self.kinds_of_members(&members)?;
        let (shader_id, geometry) = (self.next_shader_id(id.number()), shape.clone());
        self.set_group_record(id.number(), &geometry, shader_id);
        let pools = self.pools_of_members(&kinds, &members);
        self.bind(id.number(), vec![(pools, kinds.clone())]);
        self.groups.push(GroupState { id, shader_id, geometry, members, turns, kinds });
        Ok(())
    }

    /// What the text is made for that samples these. Fails where one is not there, and where they are more
    /// than the device can bind.
    fn kinds_of_members(&self, members: &[Member]) -> Result<Kinds, Error> {
        let member = |Member { name, layer, .. }: &Member| {
            let pool = self.pool_of(layer.number()).map_or(0, |pool| usize::from(pool.number()));
            let kind = self.kind_of(*layer).ok_or(GroupError::NoTexture(layer.number().number()))?;
            Ok(KindMember { name: name.clone(), pool, kind })
        };
        let members = members.iter().map(member).collect::<Result<Vec<_>, GroupError>>()?;
        let kinds = Kinds::of_group(members, self.mode, self.seen().fade)?;
        check_bindings(&self.device.limits(), &kinds, self.binding)?;
        Ok(kinds)
    }

    /// The pools of the text, in the order in which they are bound.
    fn pools_of_members(&self, kinds: &Kinds, members: &[Member]) -> Vec<PoolId> {
        kinds.pools().filter_map(|member| self.pool_of(members[member].layer.number())).collect()
    }

    pub(crate) fn remove_group(&mut self, group: GroupNumber) {
        self.groups.retain(|state| state.id != group);
        self.unbind(group.number());
        self.forget_record(group.number());
    }

    /// The feedback entries of the group that has most: those apart, and that of the others together.
    pub(crate) fn most_turns(&self) -> u32 {
        self.groups.iter().map(|state| state.turns).max().unwrap_or(1)
    }

    /// The groups that a texture is in.
    pub(crate) fn groups_of(&self, texture: TextureNumber) -> Vec<GroupNumber> {
        let of_texture =
            |state: &&GroupState| state.members.iter().any(|member| member.layer.number() == texture);
        self.groups.iter().filter(of_texture).map(|state| state.id).collect()
    }

    /// The records and bind groups of all groups, on another device.
    pub(super) fn restore_groups(&mut self) -> Result<(), Error> {
        for nth in 0..self.groups.len() {
            let GroupState { id, shader_id, geometry, members, .. } = &self.groups[nth];
            let (number, shader_id, geometry) = (id.number(), *shader_id, geometry.clone());
            let kinds = self.kinds_of_members(members)?;
            let pools = self.pools_of_members(&kinds, members);
            self.set_group_record(number, &geometry, shader_id);
            self.bind(number, vec![(pools, kinds.clone())]);
            self.groups[nth].kinds = kinds;
        }
        Ok(())
    }

    /// Returns true if there is a group.
    pub(crate) fn has_group(&self, group: GroupId) -> bool {
        self.group(group).is_some()
    }

    fn group(&self, group: GroupId) -> Option<&GroupState> {
        let is_it = |state: &&GroupState| state.id == group.number();
        self.groups
            .iter()
            .find(is_it)
            .filter(|_| self.generation(group.number().number()) == group.generation())
    }

    /// The kinds of a group.
    pub(super) fn kinds_of_group(&self, group: GroupId) -> Option<&Kinds> {
        Some(&self.group(group)?.kinds)
    }

    /// The ids by which shaders know a group: that of the whole, then those of its members.
    pub(super) fn ids_of_group(&self, group: GroupId) -> Option<Vec<u32>> {
        let GroupState { shader_id, members, .. } = self.group(group)?;
        let of_members = members.iter().map(|member| self.id_in_shaders(member.layer.number()));
        Some(std::iter::once(*shader_id).chain(of_members).collect())
    }
}
