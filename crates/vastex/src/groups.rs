//! Groups: several textures, or several layers, that one shader samples, through one bind group.

use vastex_core::{GroupError, GroupId, Pager, TextureId};
use vastex_wgpu::{GroupLayout, GroupMember, GroupParams, GroupShape, Pool, TableBuffers};

use crate::error::Error;
use crate::layer::LayerId;
use crate::pools::PoolState;
use crate::settings::Sampling;
use crate::textures::{TextureState, Textures};

/// A member of a group: a layer, and the name that shaders know it by.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    name: String,
    layer: LayerId,
    is_apart: bool,
}

impl Member {
    /// A layer that is sampled at the coordinates at which the others are. Pairs of a name and a layer are that, too.
    pub fn new(name: impl Into<String>, layer: impl Into<LayerId>) -> Member {
        Member { name: name.into(), layer: layer.into(), is_apart: false }
    }

    /// A layer that is sampled at coordinates of its own, such as a detail that repeats: `vastex_feedback` does not answer for
    /// it, `vastex_feedback_NAME` does.
    pub fn apart(name: impl Into<String>, layer: impl Into<LayerId>) -> Member {
        Member { is_apart: true, ..Member::new(name, layer) }
    }
}

impl<S: Into<String>, L: Into<LayerId>> From<(S, L)> for Member {
    fn from((name, layer): (S, L)) -> Member {
        Member::new(name, layer)
    }
}

/// What a pipeline samples: one layer, or a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sampled {
    /// One layer of a texture.
    Layer(LayerId),
    /// A group.
    Group(GroupId),
}

impl From<LayerId> for Sampled {
    fn from(layer: LayerId) -> Sampled {
        Sampled::Layer(layer)
    }
}

impl From<TextureId> for Sampled {
    fn from(texture: TextureId) -> Sampled {
        Sampled::Layer(texture.into())
    }
}

impl From<GroupId> for Sampled {
    fn from(group: GroupId) -> Sampled {
        Sampled::Group(group)
    }
}

/// A group on the GPU.
pub(crate) struct GroupState {
    pub(crate) id: GroupId,
    /// In the order of the shape's members.
    layers: Vec<LayerId>,
    /// The textures that they are layers of, each once.
    textures: Vec<TextureId>,
    /// Feedback entries that answer for its members.
    turns: u32,
    layout: GroupLayout,
    params: GroupParams,
}

impl Textures {
    /// Makes a group of textures that there are, or of layers of them: of any sizes, formats and pools, for a shader that samples
    /// all of them through one bind group.
    ///
    /// Members that are sampled at the same coordinates are served by one feedback entry, `vastex_feedback(uv)`: it is written for
    /// the largest of them, and of the others the pages are loaded that lie beneath, at the level that each one's size, clamp and
    /// bias imply. Members [apart](Member::apart) have entries of their own; since a feedback pixel gives one answer, those of
    /// several take turns with `vastex_turn`, and what is seen counts, and convergence waits, for as many jitter cycles. What one entry asks
    /// for is what the filter needs that needs the finest: beside an anisotropic member one that is sampled nearest has pages up to three levels finer
    /// than it shows, where the view is at a slant; if it is of another texture, and that is too much, it is to be a member apart. Which
    /// functions a shader calls is told at [`vastex_wgpu::group_wgsl`].
    ///
    /// ```no_run
    /// # const MY_SHADER: &str = "";
    /// # fn app(textures: &mut vastex::Textures, [earth, lights, clouds]: [vastex::TextureId; 3]) -> Result<(), vastex::Error> {
    /// let planet = textures.add_group([("color", earth), ("night", lights), ("clouds", clouds)])?;
    /// let shader = MY_SHADER.to_owned() + &textures.wgsl(planet);  // calls vastex_sample_color(uv), vastex_sample_night(uv), ...
    /// let layout = textures.bind_group_layout(planet);     // and each frame: groups[planet], textures.bind_group(planet)
    /// # let _ = (shader, layout);
    /// # Ok(()) }
    /// ```
    ///
    /// Fails where a name cannot stand in WGSL, where a texture is not there, or where there are more textures or layers than a
    /// shader of the device can read. Costs 2.6 KB of GPU memory for each texture.
    pub fn add_group<M: Into<Member>>(
        &mut self,
        members: impl IntoIterator<Item = M>,
    ) -> Result<GroupId, Error> {
        self.catch_up()?;
        let members: Vec<Member> = members.into_iter().map(Into::into).collect();
        let layers: Vec<LayerId> = members.iter().map(|member| member.layer).collect();
        for layer in &layers {
            self.pool_of(layer.texture()).ok_or(GroupError::NoTexture(layer.texture().number()))?;
        }
        let textures = distinct_textures(&layers);
        let served = members.iter().filter(|member| !member.is_apart).map(|member| member.layer.texture());
        let served: Vec<TextureId> = served.collect();
        // Those that nothing answers for together have a number all the same, which no pixel names.
        let id = self.pager.add_group(if served.is_empty() { &textures } else { &served })?;
        match self.new_group(id, members, layers, textures) {
            Ok(state) => self.groups.push(state),
            Err(error) => {
                self.pager.remove_group(id, self.frame);
                return Err(error);
            }
        }
        self.bind_groups_anew();
        self.count_turns();
        Ok(id)
    }

    fn new_group(
        &self,
        id: GroupId,
        members: Vec<Member>,
        layers: Vec<LayerId>,
        textures: Vec<TextureId>,
    ) -> Result<GroupState, Error> {
        let apart = members.iter().filter(|member| member.is_apart).count();
        let has_feedback = apart < members.len();
        let member = |Member { name, layer, .. }: Member| {
            let texture = textures.iter().position(|&texture| texture == layer.texture()).unwrap_or(0);
            let (tables, pages) = self.kinds_of(layer.texture());
            let Sampling { filter, fades } = self.sampling_of(layer);
            let atlas = self.layout_of(layer).atlas();
            GroupMember { name, texture, atlas, tables, pages, filter: Some(filter), fades }
        };
        let shape = GroupShape::new(members.into_iter().map(member).collect(), has_feedback)?;
        let shape = shape.with_fade(self.seen().fade);
        let layout = GroupLayout::new(&self.device, shape, self.way)?;
        let bound = Bound { textures: &self.textures, pools: &self.pools, pager: &self.pager };
        let params = bound.params(&self.device, &self.queue, id, &layers, &textures)?;
        let turns = (apart + usize::from(has_feedback)) as u32;
        Ok(GroupState { id, layers, textures, turns, layout, params })
    }

    /// Removes a group; its members stay. Says whether there was one. Nothing may be drawn with its bind group any more.
    pub fn remove_group(&mut self, group: GroupId) -> bool {
        let was_there = self.pager.remove_group(group, self.frame);
        if was_there {
            self.groups.retain(|state| state.id != group);
            self.count_turns();
            self.views.iter_mut().for_each(|view| view.groups.set(group.number(), Vec::new()));
        }
        was_there
    }

    /// As many entries may take turns as the group of most has: those apart, and that of the others together.
    fn count_turns(&mut self) {
        let turns = self.groups.iter().map(|state| state.turns).max().unwrap_or(1);
        self.pager.set_turns(turns);
    }

    /// Groups that have lost a texture cannot be drawn any more.
    pub(crate) fn remove_groups_of(&mut self, texture: TextureId) {
        let of_texture = |state: &&GroupState| state.textures.contains(&texture);
        let gone: Vec<GroupId> = self.groups.iter().filter(of_texture).map(|state| state.id).collect();
        for group in gone {
            self.remove_group(group);
        }
    }

    /// Tells shaders what levels and mip biases have become.
    pub(crate) fn update_groups(&mut self) {
        let bound = Bound { textures: &self.textures, pools: &self.pools, pager: &self.pager };
        for GroupState { layers, textures, params, .. } in &mut self.groups {
            params.update(&self.queue, bound.tables(textures), bound.members(layers));
        }
    }

    /// Gives the groups that these textures are in parameters of their own, beside those that recorded commands read: their page tables, or
    /// pools, are others now.
    pub(crate) fn renew_groups_of(&mut self, moved: &[TextureId]) -> Result<(), Error> {
        let bound = Bound { textures: &self.textures, pools: &self.pools, pager: &self.pager };
        for GroupState { id, layers, textures, params, .. } in &mut self.groups {
            if textures.iter().any(|texture| moved.contains(texture)) {
                *params = bound.params(&self.device, &self.queue, *id, layers, textures)?;
            }
        }
        Ok(())
    }

    /// On another device.
    pub(crate) fn restore_groups(&mut self) -> Result<(), Error> {
        let bound = Bound { textures: &self.textures, pools: &self.pools, pager: &self.pager };
        for GroupState { id, layers, textures, layout, params, .. } in &mut self.groups {
            *layout = GroupLayout::new(&self.device, layout.shape().clone(), self.way)?;
            *params = bound.params(&self.device, &self.queue, *id, layers, textures)?;
        }
        self.bind_groups_anew();
        Ok(())
    }

    /// Makes the bind groups of all groups, for every view.
    pub(crate) fn bind_groups_anew(&mut self) {
        self.bind_groups_where(|_| true);
    }

    /// Makes the bind groups of the groups that these textures are in.
    pub(crate) fn bind_groups_of(&mut self, moved: &[TextureId]) {
        self.bind_groups_where(|state| state.textures.iter().any(|texture| moved.contains(texture)));
    }

    fn bind_groups_where(&mut self, is_to_be_made: impl Fn(&GroupState) -> bool) {
        let bound = Bound { textures: &self.textures, pools: &self.pools, pager: &self.pager };
        for state in self.groups.iter().filter(|state| is_to_be_made(state)) {
            let GroupState { id, layers, textures, layout, params, .. } = state;
            for view in &mut self.views {
                let (tables, members) = (bound.tables(textures), bound.members(layers));
                let group = layout.bind_group(&self.device, params, tables, members, &view.params);
                view.groups.set(id.number(), vec![group]);
            }
        }
    }

    /// A group that there is.
    #[expect(clippy::expect_used, reason = "an id of another `Textures` is a mistake in the program")]
    pub(crate) fn group(&self, group: GroupId) -> &GroupLayout {
        let state = self.groups.iter().find(|state| state.id == group);
        &state.expect("a group of this `Textures`").layout
    }
}

/// Where what a group binds is found.
#[derive(Clone, Copy)]
struct Bound<'a> {
    textures: &'a [Option<TextureState>],
    pools: &'a [PoolState],
    pager: &'a Pager,
}

impl<'a> Bound<'a> {
    fn tables(self, textures: &[TextureId]) -> impl Iterator<Item = &'a TableBuffers> {
        let state = move |texture: &TextureId| self.textures.get(usize::from(texture.number()))?.as_ref();
        textures.iter().filter_map(state).map(|state| &state.table)
    }

    fn members(self, layers: &[LayerId]) -> impl Iterator<Item = (&'a Pool, usize)> {
        layers.iter().filter_map(move |layer| {
            let pool = self.pager.pool_of(layer.texture())?;
            Some((self.pools[usize::from(pool.number())].gpu()?, layer.index()))
        })
    }

    fn params(
        self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        id: GroupId,
        layers: &[LayerId],
        textures: &[TextureId],
    ) -> Result<GroupParams, Error> {
        let shape = self.pager.group_shape(id).ok_or(GroupError::Empty)?;
        let (tables, members) = (self.tables(textures), self.members(layers));
        Ok(GroupParams::new(device, queue, shape, id.number(), tables, members))
    }
}

fn distinct_textures(layers: &[LayerId]) -> Vec<TextureId> {
    let mut textures: Vec<TextureId> = layers.iter().map(|layer| layer.texture()).collect();
    textures.sort_unstable();
    textures.dedup();
    textures
}
