//! Groups: several textures, or several layers, that one shader samples under names.

use std::sync::Arc;

use vastex_core::{Geometry, GroupId, PoolId, TextureId};
use vastex_wgpu::{KindMember, Kinds, check_bindings};

use super::Gpu;
use crate::error::Error;
use crate::sampled::{LayerId, Member};

/// A group on the GPU.
pub(super) struct GroupState {
    id: GroupId,
    /// By which shaders know it as a whole.
    shader_id: u32,
    /// That of its feedback entries.
    geometry: Arc<Geometry>,
    /// In the order of the members.
    layers: Vec<LayerId>,
    /// Feedback entries that answer for its members.
    turns: u32,
    kinds: Kinds,
}

impl Gpu {
    /// Makes a group that the pager has given its number and this shape.
    pub(crate) fn add_group(
        &mut self,
        id: GroupId,
        shape: &Arc<Geometry>,
        members: Vec<Member>,
    ) -> Result<(), Error> {
        let layers: Vec<LayerId> = members.iter().map(|member| member.layer).collect();
        let apart = members.iter().filter(|member| member.is_apart).count();
        let turns = (apart + usize::from(apart < members.len())) as u32;
        let member = |Member { name, layer, .. }: Member| {
            let pool = self.pool_of(layer.texture()).map_or(0, |pool| usize::from(pool.number()));
            KindMember { name, pool, kind: self.kind_of(layer) }
        };
        let (members, fade) = (members.into_iter().map(member).collect(), self.seen().fade);
        let kinds = Kinds::of_group(members, self.way, fade)?;
        check_bindings(&self.device.limits(), &kinds)?;
        let (shader_id, geometry) = (self.next_shader_id(id.number()), shape.clone());
        self.set_group_record(id.number(), &geometry, shader_id);
        let pools = self.pools_of_members(&kinds, &layers);
        self.bind(id.number(), vec![(pools, kinds.clone())]);
        self.groups.push(GroupState { id, shader_id, geometry, layers, turns, kinds });
        Ok(())
    }

    /// The pools of the text, in the order in which they are bound.
    fn pools_of_members(&self, kinds: &Kinds, layers: &[LayerId]) -> Vec<PoolId> {
        kinds.pools().filter_map(|member| self.pool_of(layers[member].texture())).collect()
    }

    pub(crate) fn remove_group(&mut self, group: GroupId) {
        self.groups.retain(|state| state.id != group);
        self.unbind(group.number());
        self.forget_record(group.number());
    }

    /// The feedback entries of the group that has most: those apart, and that of the others together.
    pub(crate) fn most_turns(&self) -> u32 {
        self.groups.iter().map(|state| state.turns).max().unwrap_or(1)
    }

    /// The groups that a texture is in.
    pub(crate) fn groups_of(&self, texture: TextureId) -> Vec<GroupId> {
        let of_texture = |state: &&GroupState| state.layers.iter().any(|layer| layer.texture() == texture);
        self.groups.iter().filter(of_texture).map(|state| state.id).collect()
    }

    /// The records of all groups, on another device.
    pub(super) fn restore_groups(&mut self) {
        let of_group = |group: &GroupState| (group.id.number(), group.geometry.clone(), group.shader_id);
        let records: Vec<_> = self.groups.iter().map(of_group).collect();
        for (number, geometry, id) in records {
            self.set_group_record(number, &geometry, id);
        }
    }

    /// The kinds of a group that there is, and its ids: of the whole, and of its members.
    #[expect(clippy::expect_used, reason = "an id of another `Textures` is a mistake in the program")]
    pub(super) fn group(&self, group: GroupId) -> (&Kinds, Vec<u32>) {
        let state = self.groups.iter().find(|state| state.id == group);
        let GroupState { shader_id, layers, kinds, .. } = state.expect("a group of this `Textures`");
        let of_members = layers.iter().map(|layer| self.shader_id(layer.texture()));
        (kinds, std::iter::once(*shader_id).chain(of_members).collect())
    }
}
