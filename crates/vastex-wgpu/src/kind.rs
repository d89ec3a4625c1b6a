//! Kinds: all that changes the shader text of a layer of a pool, and those of a text together.
//!
//! What differs from texture to texture but changes no text stands in its record (`record`).

use vastex_core::{Dims, Geometry, Level};

use crate::error::GpuError;
use crate::feedback_mode::FeedbackMode;
use crate::filter::Filter;
use crate::names::check_names;

/// How a shader reads the atlas, which follows from the layer's format and from what the
/// device filters. Later versions may have more of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Atlas {
    /// The device's own filter.
    #[default]
    Float,
    /// Floats that the device does not filter, so the shader does.
    Unfiltered,
    /// One channel of 16-bit whole numbers, filtered in the shader.
    Uint16,
    /// Four channels of 16-bit whole numbers, filtered in the shader.
    Uint16Rgba,
    /// One channel of 16 bits as two of 8, each filtered by the device. Of volumes alone.
    HighLow,
    /// Whole numbers of 32 or 64 bits, labels, which stand for themselves and are never filtered. Of volumes
    /// alone.
    Whole,
}

impl Atlas {
    /// Every way to read the atlas of an image. Volumes have [`Atlas::HighLow`] and [`Atlas::Whole`]
    /// beside them.
    pub const ALL: [Atlas; 4] = [Atlas::Float, Atlas::Unfiltered, Atlas::Uint16, Atlas::Uint16Rgba];
}

/// How the page tables of a pool lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TableKind {
    /// An entry for each page.
    #[default]
    Direct,
    /// A hash table of the pages that are resident.
    Hashed,
}

/// Which kind of page table a texture gets. Pictures are the same with either.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TableChoice {
    /// A direct table up to 4 Mi entries, if its pool has room for it, else a hashed one.
    #[default]
    BySize,
    /// An entry for each page: one read for each lookup.
    Direct,
    /// A hash table of the pages that are resident: its memory is that of the pool's slots, whatever the
    /// texture's size; a lookup reads a few words where the wanted page is resident, and as many again for
    /// each level upward where it is not.
    Hashed,
}

/// The sides of pages, in texels of level 0, that a shader knows of. One that knows them to be powers of two
/// shifts where another divides, eight times for a trilinear sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PageSides {
    /// Whatever they are.
    #[default]
    Any,
    /// Powers of two, where there are pages beside the tail, and so are the scales of all levels.
    PowersOfTwo,
}

impl PageSides {
    /// The page sides of a texture.
    pub fn of(geometry: &Geometry) -> PageSides {
        // Of a volume shaders know that a brick at a time is looked up.
        if geometry.dims() == Dims::D3 {
            return PageSides::Any;
        }
        let is_paged = geometry.tail().first_level() > 0;
        let is_page_fit = !is_paged || geometry.page()[..2].iter().all(|side| side.is_power_of_two());
        // A record has no larger scale.
        let is_scale_fit = |scale: &u64| scale.is_power_of_two() && *scale <= 1 << 31;
        let is_fit = |level: &Level| level.scale[..2].iter().all(is_scale_fit);
        if is_page_fit && geometry.levels().iter().all(is_fit) {
            PageSides::PowersOfTwo
        } else {
            PageSides::Any
        }
    }
}

/// All that changes the text by which a layer of a pool's textures is sampled. Textures whose kinds are equal
/// share pipelines; if they lie in one pool, their bind group too. Later versions may have more fields: an
/// application takes kinds from its textures and compares them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Kind {
    /// What the textures of the pool are: images or volumes.
    pub dims: Dims,
    /// The page tables of the pool.
    pub tables: TableKind,
    /// What is known of the sides of pages.
    pub pages: PageSides,
    /// Which layer of the pool it is.
    pub layer: u8,
    /// How the layer's atlas is read.
    pub atlas: Atlas,
    /// Texels of the texture along one of the layer: 1, 2 or 4.
    pub scale: u32,
    /// How texels are blended: [`Filter::Nearest`] where values are not mixed.
    pub filter: Filter,
    /// True if values are mixed: with those beside them by the filter, and with those of a coarser tile while
    /// a tile fades in. Where they are not, each pixel shows one texel of the tile that is there.
    pub is_mixed: bool,
}

/// A member of a group: a layer of a texture, as shaders see it.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct KindMember {
    /// The member's name in the names of functions: lower-case letters, digits and underscores, a letter
    /// first.
    pub name: String,
    /// The pool of its texture, by any number that no other pool has.
    pub pool: usize,
    /// The member's kind.
    pub kind: Kind,
}

/// What a shader text is made for: one kind, or those of the members of a group. A key for pipelines: texts
/// and bind group layouts are equal where these are.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Kinds {
    mode: FeedbackMode,
    fade: bool,
    members: Vec<TextMember>,
    pools: Vec<TextPool>,
    layers: Vec<TextLayer>,
    reads: Vec<TextRead>,
}

/// A name by which the text samples.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct TextMember {
    /// `None` if there is one without a name.
    pub(crate) name: Option<String>,
    /// Which of the text's reads it is.
    pub(crate) read: usize,
}

/// A pool of the text.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct TextPool {
    pub(crate) dims: Dims,
    pub(crate) tables: TableKind,
    pub(crate) pages: PageSides,
    /// The first member that lies in it.
    pub(crate) member: usize,
}

/// A layer of one of its pools.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct TextLayer {
    pub(crate) pool: usize,
    pub(crate) index: u8,
    pub(crate) atlas: Atlas,
    pub(crate) scale: u32,
    /// The first member that samples it.
    pub(crate) member: usize,
}

/// A way to read one of its layers.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct TextRead {
    pub(crate) layer: usize,
    pub(crate) filter: Filter,
    pub(crate) is_mixed: bool,
}

impl Kind {
    /// This kind by another filter; where values are not mixed by [`Filter::Nearest`], whatever is named.
    #[must_use]
    pub fn filtered(self, filter: Filter) -> Kind {
        Kind { filter: if self.is_mixed { filter } else { Filter::Nearest }, ..self }
    }
}

impl Kinds {
    /// Of one layer, whose functions have no name in theirs. Tiles fade in where `fade` is true.
    pub fn of(kind: Kind, mode: FeedbackMode, fade: bool) -> Kinds {
        Kinds::gathered([(None, 0, kind)], mode, fade)
    }

    /// Of the members of a group.
    ///
    /// Fails where a name cannot stand in WGSL, or would make two functions of one name.
    pub fn of_group(members: Vec<KindMember>, mode: FeedbackMode, fade: bool) -> Result<Kinds, GpuError> {
        check_names(members.iter().map(|member| &*member.name))?;
        let members = members.into_iter().map(|KindMember { name, pool, kind }| (Some(name), pool, kind));
        Ok(Kinds::gathered(members, mode, fade))
    }

    fn gathered(
        of: impl IntoIterator<Item = (Option<String>, usize, Kind)>,
        mode: FeedbackMode,
        fade: bool,
    ) -> Kinds {
        let mut kinds = Kinds {
            mode,
            fade,
            members: Vec::new(),
            pools: Vec::new(),
            layers: Vec::new(),
            reads: Vec::new(),
        };
        let mut known_pools = Vec::new();
        for (member, (name, pool, kind)) in of.into_iter().enumerate() {
            let Kind { dims, tables, pages, layer: index, atlas, scale, filter, is_mixed } =
                kind.filtered(kind.filter);
            let pool = place_of(&mut known_pools, |known| *known == pool, || pool);
            if pool == kinds.pools.len() {
                kinds.pools.push(TextPool { dims, tables, pages, member });
            }
            let is_layer = |layer: &TextLayer| (layer.pool, layer.index) == (pool, index);
            let new_layer = || TextLayer { pool, index, atlas, scale, member };
            let layer = place_of(&mut kinds.layers, is_layer, new_layer);
            let read = TextRead { layer, filter, is_mixed };
            let read = place_of(&mut kinds.reads, |known| *known == read, || read.clone());
            kinds.members.push(TextMember { name, read });
        }
        kinds
    }

    /// These kinds with every member by another filter, but for members whose values are not mixed.
    #[must_use]
    pub fn filtered(&self, filter: Filter) -> Kinds {
        self.with_filters(&vec![Some(filter); self.members.len()])
    }

    /// These kinds with some members by filters of their own, in the order of the members; those without one,
    /// those beyond the end of the list, and those whose values are not mixed keep theirs.
    #[must_use]
    pub fn with_filters(&self, filters: &[Option<Filter>]) -> Kinds {
        let of = |(nth, member): (usize, &TextMember)| {
            let read = &self.reads[member.read];
            let TextLayer { pool, index, atlas, scale, .. } = self.layers[read.layer];
            let TextPool { dims, tables, pages, .. } = self.pools[pool];
            let filter = filters.get(nth).copied().flatten().unwrap_or(read.filter);
            let is_mixed = read.is_mixed;
            let kind = Kind { dims, tables, pages, layer: index, atlas, scale, filter, is_mixed };
            (member.name.clone(), pool, kind)
        };
        Kinds::gathered(self.members.iter().enumerate().map(of), self.mode, self.fade)
    }

    /// Returns true if the same bindings serve shaders of both: those of the same layers of as many pools.
    pub fn binds_like(&self, other: &Kinds) -> bool {
        let layers = |kinds: &Kinds| {
            let of_layer =
                |layer: &TextLayer| (layer.pool, layer.index, layer.atlas, kinds.pools[layer.pool].dims);
            kinds.layers.iter().map(of_layer).collect::<Vec<_>>()
        };
        (self.mode, self.fade, self.pools.len()) == (other.mode, other.fade, other.pools.len())
            && layers(self) == layers(other)
    }

    /// How feedback is gathered.
    pub fn mode(&self) -> FeedbackMode {
        self.mode
    }

    /// Returns true if tiles fade in.
    pub fn fade(&self) -> bool {
        self.fade
    }

    /// Returns true if members are of these dimensions.
    pub(crate) fn has(&self, dims: Dims) -> bool {
        self.pools.iter().any(|pool| pool.dims == dims)
    }

    /// Returns true if the kinds are those of a group.
    pub fn is_group(&self) -> bool {
        self.members.iter().any(|member| member.name.is_some())
    }

    /// For each pool of the text a member whose texture lies in it, in the order in which pools are bound.
    pub fn pools(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.pools.iter().map(|pool| pool.member)
    }

    /// For each member which of the text's pools its texture lies in.
    pub fn member_pools(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.members.iter().map(|member| self.layers[self.reads[member.read].layer].pool)
    }

    /// For each member by which lines of the text it is sampled: members of one number have the same layer of
    /// one pool's textures and the same filter, so that the function of any of them samples all, by their
    /// ids.
    pub fn member_reads(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.members.iter().map(|member| member.read)
    }

    pub(crate) fn members(&self) -> &[TextMember] {
        &self.members
    }

    pub(crate) fn text_pools(&self) -> &[TextPool] {
        &self.pools
    }

    pub(crate) fn layers(&self) -> &[TextLayer] {
        &self.layers
    }

    pub(crate) fn reads(&self) -> &[TextRead] {
        &self.reads
    }
}

/// Where it is in a list, to which it is added where it is not.
fn place_of<T>(list: &mut Vec<T>, is_it: impl FnMut(&T) -> bool, new: impl FnOnce() -> T) -> usize {
    list.iter().position(is_it).unwrap_or_else(|| {
        list.push(new());
        list.len() - 1
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex_core::GeometrySpec;

    #[test]
    fn pages_that_nobody_looks_up_may_have_any_side() {
        let of = |spec, factors: Option<&[[u32; 3]]>| {
            let geometry = match factors {
                Some(factors) => Geometry::with_factors(spec, factors),
                None => Geometry::new(spec),
            };
            PageSides::of(&geometry.unwrap())
        };
        let image = |page, width, height| GeometrySpec { page, ..GeometrySpec::image(width, height) };
        // A texture that is held whole has one page, as large as it needs to be.
        let is_whole = |page: &u32| {
            let geometry = Geometry::new(image(*page, 256, 256)).unwrap();
            geometry.tail().first_level() == 0 && !page.is_power_of_two()
        };
        let page = (256..1024).step_by(4).find(is_whole).unwrap();
        assert_eq!(of(image(page, 256, 256), None), PageSides::PowersOfTwo);
        assert_eq!(of(image(page, 2048, 256), None), PageSides::Any);
        assert_eq!(of(image(128, 2048, 300), None), PageSides::PowersOfTwo);
        // Scales that are no powers of two, or that a record does not have, in the tail too.
        assert_eq!(of(image(128, 9, 9), Some(&[[3, 3, 1], [3, 3, 1]])), PageSides::Any);
        assert_eq!(of(image(128, 9, 9), Some(&[[16, 16, 1]; 7])), PageSides::PowersOfTwo);
        assert_eq!(of(image(128, 9, 9), Some(&[[16, 16, 1]; 8])), PageSides::Any);
    }
}
