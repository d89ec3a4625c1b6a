//! Bind groups: one for all textures of the same pools that are sampled through the same layers, whatever the view.

use std::collections::BTreeSet;

use vastex_core::{GroupId, PoolId, TextureId};
use vastex_wgpu::{Bound, Kinds, entries, layout_entries};

use super::Gpu;
use crate::sampled::{LayerId, Sampled};

/// The bind groups of each texture and group that there is: `groups[texture]`, `groups[group]`, or `groups[layer]` of a layer
/// that is not the first. Those of textures that share a pool are one and the same.
#[derive(Debug, Default)]
pub struct BindGroups {
    sets: Vec<BindSet>,
    /// By the number of a texture or a group: of each layer, or of the group, its place among the sets.
    places: Vec<Vec<usize>>,
    /// Bind groups made so far.
    made: u64,
}

/// What textures that share a bind group have in common, and that bind group.
#[derive(Debug)]
struct BindSet {
    /// The pools that are bound.
    pools: Vec<PoolId>,
    /// For some filters; bindings are the same for all.
    kinds: Kinds,
    /// Nothing while the memory of a pool is given back.
    group: Option<wgpu::BindGroup>,
    revision: u64,
}

impl BindGroups {
    fn set(&self, sampled: Sampled) -> Option<&BindSet> {
        let (number, nth) = match sampled {
            Sampled::Layer(layer) => (layer.texture(), layer.index()),
            Sampled::Group(group) => (group.number(), 0),
        };
        self.sets.get(*self.places.get(usize::from(number.number()))?.get(nth)?)
    }

    pub(crate) fn revision(&self, sampled: Sampled) -> u64 {
        self.set(sampled).map_or(0, |set| set.revision)
    }

    /// The place of a set, which is added where there is none.
    fn place(&mut self, pools: Vec<PoolId>, kinds: Kinds) -> usize {
        let is_it = |set: &BindSet| set.pools == pools && set.kinds.binds_like(&kinds);
        self.sets.iter().position(is_it).unwrap_or_else(|| {
            self.sets.push(BindSet { pools, kinds, group: None, revision: 0 });
            self.sets.len() - 1
        })
    }
}

impl Gpu {
    pub(crate) fn bind_groups(&self) -> &BindGroups {
        &self.bind_groups
    }

    /// Gives the layers of a texture, or a group, their bind groups: each the pools of its text, and its kinds.
    pub(super) fn bind(&mut self, number: TextureId, sampled: Vec<(Vec<PoolId>, Kinds)>) {
        let place_of = |(pools, kinds)| self.bind_groups.place(pools, kinds);
        let places: Vec<usize> = sampled.into_iter().map(place_of).collect();
        for &place in &places {
            if self.bind_groups.sets[place].group.is_none() {
                self.make_bind_group(place);
            }
        }
        let number = usize::from(number.number());
        if self.bind_groups.places.len() <= number {
            self.bind_groups.places.resize_with(number + 1, Vec::new);
        }
        self.bind_groups.places[number] = places;
    }

    /// There is no such texture or group any more.
    pub(super) fn unbind(&mut self, number: TextureId) {
        if let Some(places) = self.bind_groups.places.get_mut(usize::from(number.number())) {
            places.clear();
        }
    }

    /// Makes the bind groups anew that bind any of these pools.
    pub(super) fn bind_anew(&mut self, pools: &BTreeSet<PoolId>) {
        if pools.is_empty() {
            return;
        }
        for place in 0..self.bind_groups.sets.len() {
            if self.bind_groups.sets[place].pools.iter().any(|pool| pools.contains(pool)) {
                self.make_bind_group(place);
            }
        }
    }

    /// Makes every bind group anew.
    pub(crate) fn bind_all_anew(&mut self) {
        (0..self.bind_groups.sets.len()).for_each(|place| self.make_bind_group(place));
    }

    fn make_bind_group(&mut self, place: usize) {
        let BindSet { pools, kinds, .. } = &self.bind_groups.sets[place];
        let group = self.bound(pools).map(|bound| {
            let layout = self.bind_group_layout(kinds);
            self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("vastex"),
                layout: &layout,
                entries: &entries(kinds, self.binding.first, &bound),
            })
        });
        self.bind_groups.made += 1;
        let revision = self.bind_groups.made;
        let set = &mut self.bind_groups.sets[place];
        (set.group, set.revision) = (group, revision);
    }

    /// What is bound of these pools; nothing where the memory of one is given back.
    fn bound(&self, pools: &[PoolId]) -> Option<Bound<'_>> {
        let of_pool = |pool: &PoolId| {
            let pool = self.pools.get(usize::from(pool.number()))?;
            Some((pool.gpu()?, pool.tables()?.binding()))
        };
        let pools = pools.iter().map(of_pool).collect::<Option<Vec<_>>>()?;
        Some(Bound { params: self.params.binding(), views: &self.view_params, sampler: &self.sampler, pools })
    }

    /// The entries of a bind group for what is sampled; none while there is no such texture or group.
    pub(crate) fn entries(&self, sampled: Sampled) -> Vec<wgpu::BindGroupEntry<'_>> {
        let set = self.bind_groups.set(sampled);
        let bound = set.and_then(|set| Some((&set.kinds, self.bound(&set.pools)?)));
        bound.map_or_else(Vec::new, |(kinds, bound)| entries(kinds, self.binding.first, &bound))
    }

    pub(crate) fn layout_entries(&self, kinds: &Kinds) -> Vec<wgpu::BindGroupLayoutEntry> {
        layout_entries(kinds, self.binding.first)
    }

    pub(crate) fn bind_group_layout(&self, kinds: &Kinds) -> wgpu::BindGroupLayout {
        self.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("vastex"),
            entries: &self.layout_entries(kinds),
        })
    }
}

#[expect(
    clippy::expect_used,
    reason = "an id of what there is not is a mistake in the program, as an index beyond the end is"
)]
impl std::ops::Index<Sampled> for BindGroups {
    type Output = wgpu::BindGroup;

    fn index(&self, sampled: Sampled) -> &wgpu::BindGroup {
        self.set(sampled).and_then(|set| set.group.as_ref()).expect("a texture or group of this `Textures`")
    }
}

impl std::ops::Index<LayerId> for BindGroups {
    type Output = wgpu::BindGroup;

    fn index(&self, layer: LayerId) -> &wgpu::BindGroup {
        &self[Sampled::Layer(layer)]
    }
}

impl std::ops::Index<GroupId> for BindGroups {
    type Output = wgpu::BindGroup;

    fn index(&self, group: GroupId) -> &wgpu::BindGroup {
        &self[Sampled::Group(group)]
    }
}

impl std::ops::Index<TextureId> for BindGroups {
    type Output = wgpu::BindGroup;

    fn index(&self, texture: TextureId) -> &wgpu::BindGroup {
        &self[LayerId::from(texture)]
    }
}
