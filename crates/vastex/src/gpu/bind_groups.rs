//! Bind groups: one for all textures of the same pools that are sampled through the same layers, whatever the
//! view.

use std::collections::BTreeSet;

use vastex_core::{PoolId, TextureNumber};
use vastex_wgpu::{Bound, Kinds, entries, layout_entries};

use super::Gpu;
use crate::ids::Sampled;

/// The bind groups of each texture and group that there is, as [`BindGroups::get`] gives them. Those of
/// textures that share a pool are one and the same.
#[derive(Debug, Default)]
pub struct BindGroups {
    sets: Vec<BindSet>,
    /// By the number of a texture or a group.
    owners: Vec<Owner>,
    /// Bind groups made so far.
    made: u64,
    /// Pools whose bind groups were made anew since somebody asked.
    changed: BTreeSet<PoolId>,
    /// Pools of sets that were forgotten, of which somebody may still keep bind groups.
    forgotten: BTreeSet<PoolId>,
}

/// Who has a number: a texture, or a group.
#[derive(Clone, Debug, Default)]
struct Owner {
    generation: u32,
    /// Of each layer, or of the group, its index among the sets.
    sets: Vec<usize>,
}

/// What textures that share a bind group have in common, and that bind group.
#[derive(Debug)]
struct BindSet {
    /// The pools that are bound.
    pools: Vec<PoolId>,
    /// For some filters; bindings are the same for all.
    kinds: Kinds,
    /// Nothing while the memory of a pool is given back, and where nobody has the set.
    group: Option<wgpu::BindGroup>,
    /// Layers of textures, and groups, that have it. A set that nobody has is taken by the next that is like
    /// no other.
    owners: u32,
    revision: u64,
}

impl BindGroups {
    /// The bind group of a texture's first layer, of a layer, or of a group; `None` if it was removed. As
    /// with [`Textures::bind_group`](crate::Textures::bind_group), it may be another in the next frame, which
    /// is then told.
    pub fn get(&self, sampled: impl Into<Sampled>) -> Option<&wgpu::BindGroup> {
        self.set(sampled.into())?.group.as_ref()
    }

    fn set(&self, sampled: Sampled) -> Option<&BindSet> {
        let (number, generation, nth) = match sampled {
            Sampled::Layer(layer) => (layer.number(), layer.texture().generation(), layer.index()),
            Sampled::Group(group) => (group.number().number(), group.generation(), 0),
        };
        let owner = self.owners.get(usize::from(number.number()))?;
        self.sets.get(*owner.sets.get(nth).filter(|_| owner.generation == generation)?)
    }

    pub(crate) fn revision(&self, sampled: Sampled) -> Option<u64> {
        Some(self.set(sampled)?.revision)
    }

    /// The place of a set, which is added where there is none.
    fn place(&mut self, pools: Vec<PoolId>, kinds: Kinds) -> usize {
        // One that nobody has may still be kept by the application, which is told of the next there as of any
        // other.
        let is_it = |set: &BindSet| set.pools == pools && set.kinds.binds_like(&kinds);
        let found = self.sets.iter().position(is_it);
        let place = found.unwrap_or_else(|| {
            let set = BindSet { pools, kinds, group: None, owners: 0, revision: 0 };
            let free = self.sets.iter().position(|set| set.owners == 0);
            let place = free.unwrap_or(self.sets.len());
            if free.is_some() {
                let before = std::mem::replace(&mut self.sets[place], set);
                self.forgotten.extend(before.pools);
            } else {
                self.sets.push(set);
            }
            place
        });
        self.sets[place].owners += 1;
        place
    }
}

impl Gpu {
    pub(crate) fn bind_groups(&self) -> &BindGroups {
        &self.bind_groups
    }

    /// Gives the layers of a texture, or a group, their bind groups: each the pools of its text, and its
    /// kinds.
    pub(super) fn bind(&mut self, number: TextureNumber, sampled: Vec<(Vec<PoolId>, Kinds)>) {
        let place_of = |(pools, kinds)| self.bind_groups.place(pools, kinds);
        let places: Vec<usize> = sampled.into_iter().map(place_of).collect();
        for &place in &places {
            if self.bind_groups.sets[place].group.is_none() {
                self.make_bind_group(place);
            }
        }
        let (generation, number) = (self.generation(number), usize::from(number.number()));
        if self.bind_groups.owners.len() <= number {
            self.bind_groups.owners.resize_with(number + 1, Owner::default);
        }
        self.bind_groups.owners[number] = Owner { generation, sets: places };
    }

    /// There is no such texture or group any more.
    pub(super) fn unbind(&mut self, number: TextureNumber) {
        let BindGroups { owners, sets, .. } = &mut self.bind_groups;
        let owner = owners.get_mut(usize::from(number.number()));
        for place in owner.map(|owner| std::mem::take(&mut owner.sets)).into_iter().flatten() {
            sets[place].owners -= 1;
            if sets[place].owners == 0 {
                sets[place].group = None;
            }
        }
    }

    /// Forgets all bind groups, to be bound anew.
    pub(super) fn forget_bind_groups(&mut self) {
        let forgotten = self.bind_groups.sets.drain(..).flat_map(|set| set.pools);
        self.bind_groups.forgotten.extend(forgotten);
        self.bind_groups.owners.clear();
    }

    /// Makes the bind groups anew that bind any of these pools.
    pub(super) fn bind_anew(&mut self, pools: &BTreeSet<PoolId>) {
        if pools.is_empty() {
            return;
        }
        for place in 0..self.bind_groups.sets.len() {
            let set = &self.bind_groups.sets[place];
            if set.owners > 0 && set.pools.iter().any(|pool| pools.contains(pool)) {
                self.make_bind_group(place);
            }
        }
    }

    /// Makes every bind group anew.
    pub(crate) fn bind_all_anew(&mut self) {
        for place in 0..self.bind_groups.sets.len() {
            if self.bind_groups.sets[place].owners > 0 {
                self.make_bind_group(place);
            }
        }
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
        let BindGroups { made, changed, forgotten, sets, .. } = &mut self.bind_groups;
        *made += 1;
        let set = &mut sets[place];
        if set.revision != 0 {
            changed.extend(&set.pools);
        } else {
            changed.extend(set.pools.iter().filter(|pool| forgotten.contains(pool)));
        }
        (set.group, set.revision) = (group, *made);
    }

    /// The pools whose bind groups were made anew since this was last asked.
    pub(crate) fn take_rebound(&mut self) -> BTreeSet<PoolId> {
        std::mem::take(&mut self.bind_groups.changed)
    }

    /// What is bound of these pools; `None` if the memory of one is given back.
    fn bound(&self, pools: &[PoolId]) -> Option<Bound<'_>> {
        let of_pool = |pool: &PoolId| {
            let pool = self.pools.get(usize::from(pool.number()))?;
            Some((pool.gpu()?, pool.tables()?.binding()))
        };
        let pools = pools.iter().map(of_pool).collect::<Option<Vec<_>>>()?;
        Some(Bound { params: self.params.binding(), views: &self.view_params, sampler: &self.sampler, pools })
    }

    /// The entries of a bind group for what is sampled; `None` if there is no such texture or group.
    pub(crate) fn entries(&self, sampled: Sampled) -> Option<Vec<wgpu::BindGroupEntry<'_>>> {
        let set = self.bind_groups.set(sampled)?;
        Some(entries(&set.kinds, self.binding.first, &self.bound(&set.pools)?))
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
