//! The structs that Rust writes and WGSL reads, laid out alike.
//!
//! A test parses the shaders and compares every size and offset with these. What the fields mean stands with the WGSL
//! structs of the same names, in params.wgsl and table.wgsl.

use bytemuck::{Pod, Zeroable};
use vastex_core::{
    AddressMode, Geometry, LevelRule, PageNumbering, PoolLayout, Slot, TextureId, shader_constants,
};

/// `VASTEX_ADDRESS_*`: how an address mode is written.
pub(crate) const fn address_code(mode: AddressMode) -> u32 {
    match mode {
        AddressMode::Clamp => 0,
        AddressMode::Wrap => 1,
        AddressMode::Mirror => 2,
        AddressMode::Border => 3,
    }
}

/// `VastexLevel`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct LevelParams {
    pub(crate) scale: [u32; 3],
    pub(crate) first_entry: u32,
    pub(crate) pages: [u32; 3],
    pub(crate) unused_0: u32,
    pub(crate) page_texels: [u32; 2],
    pub(crate) page_shift: [u32; 2],
    pub(crate) size: [u32; 2],
    pub(crate) origin: [f32; 2],
    pub(crate) inverse_scale: [f32; 2],
    pub(crate) sample_offset: [f32; 2],
}

impl LevelParams {
    /// Of a texture whose tail begins at level `tail`; `first_entry` is the page table's business.
    fn new(geometry: &Geometry, index: u8, tail: u8) -> LevelParams {
        let (level, page, border) = (geometry.level(index), geometry.page(), geometry.border());
        let scale = level.scale.map(|scale| u32::try_from(scale).unwrap_or(u32::MAX));
        // No texel is beyond 2^31.
        let (mut page_texels, mut origin) = ([u32::MAX; 2], border);
        if index < tail {
            page_texels = [0, 1].map(|a| scale[a].saturating_mul(page[a]));
        } else if index >= geometry.tail().first_level() {
            origin = geometry.tile_texel_from_tail_texel(index, [0; 3]);
        }
        LevelParams {
            scale,
            first_entry: 0,
            pages: level.pages,
            unused_0: 0,
            page_texels,
            page_shift: page_texels.map(|texels| texels.ilog2()),
            size: [level.size[0], level.size[1]],
            origin: [0, 1].map(|a| origin[a] as f32),
            inverse_scale: [0, 1].map(|a| 1.0 / scale[a] as f32),
            sample_offset: [0, 1].map(|a| geometry.sample_offset(index)[a] as f32),
        }
    }
}

/// `VastexTexture`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct TextureParams {
    pub(crate) size: [u32; 3],
    pub(crate) level_count: u32,
    pub(crate) page: [u32; 3],
    pub(crate) tail_level: u32,
    pub(crate) border: [u32; 3],
    pub(crate) tail_slot: u32,
    pub(crate) address: [u32; 3],
    pub(crate) number: u32,
    pub(crate) bias: f32,
    pub(crate) finest: f32,
    pub(crate) coarsest: f32,
    pub(crate) table_level: u32,
    pub(crate) table_places: u32,
    pub(crate) table_seed: u32,
    pub(crate) unused: [u32; 2],
    pub(crate) levels: [LevelParams; shader_constants::MAX_LEVELS as usize],
}

impl TextureParams {
    /// `rule` keeps to the levels of the texture.
    pub(crate) fn new(
        geometry: &Geometry,
        texture: TextureId,
        tail_slot: Slot,
        rule: &LevelRule,
        table: TableParams,
    ) -> TextureParams {
        let (layout, tail) = (PageNumbering::new(geometry), geometry.tail());
        let (table_level, begin, [table_places, table_seed]) = match table {
            TableParams::Direct { finest, begin } => (finest, begin, [0; 2]),
            TableParams::Hashed { places, seed } => (0, 0, [places, seed]),
        };
        let mut levels = [LevelParams::default(); shader_constants::MAX_LEVELS as usize];
        for (index, params) in (0..=geometry.coarsest()).zip(&mut levels) {
            *params = LevelParams::new(geometry, index, tail.first_level());
            if (table_level..tail.first_level()).contains(&index) && table_places == 0 {
                // A direct table that fits a GPU buffer has fewer than 2^32 entries.
                params.first_entry = (layout.first_entry(index) - layout.first_entry(begin)) as u32;
            }
        }
        TextureParams {
            size: geometry.size(),
            level_count: geometry.levels().len() as u32,
            page: geometry.page(),
            tail_level: u32::from(tail.first_level()),
            border: geometry.border(),
            tail_slot: tail_slot.index(),
            address: geometry.address().map(address_code),
            number: u32::from(texture.number()),
            bias: rule.bias,
            finest: f32::from(rule.finest),
            coarsest: f32::from(rule.coarsest),
            table_level: u32::from(table_level),
            table_places,
            table_seed,
            unused: [0; 2],
            levels,
        }
    }

    /// Of a group, whose feedback names pages of all levels of a shape.
    pub(crate) fn of_group(geometry: &Geometry, number: TextureId) -> TextureParams {
        let rule = LevelRule::default().within(geometry);
        let nobodys = TableParams::Hashed { places: 1, seed: 0 };
        let mut params = TextureParams::new(geometry, number, Slot::new(0), &rule, nobodys);
        params.tail_level = u32::from(geometry.coarsest());
        for (index, params) in (0..=geometry.coarsest()).zip(&mut params.levels) {
            *params = LevelParams::new(geometry, index, geometry.coarsest());
        }
        params
    }
}

/// How a page table lies in its buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TableParams {
    /// With entries from a level on.
    Direct {
        /// The finest level that is filled.
        finest: u8,
        /// The finest that there is room for.
        begin: u8,
    },
    /// As places of a hash table.
    Hashed {
        /// How many.
        places: u32,
        /// What hashes begin with.
        seed: u32,
    },
}

/// `VastexPool`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct PoolParams {
    pub(crate) tile: [u32; 2],
    pub(crate) slots: [u32; 2],
    pub(crate) inverse_slots: [f32; 2],
    pub(crate) texel: [f32; 2],
    pub(crate) bias: f32,
    pub(crate) layer_scale: u32,
    pub(crate) layer_share: f32,
    pub(crate) unused: u32,
}

impl PoolParams {
    /// Of a layer with one texel along `layer_scale` of the texture's; `bias` is in eighths of a level.
    pub(crate) fn new(layout: &PoolLayout, layer_scale: u32, bias: u16) -> PoolParams {
        PoolParams {
            tile: layout.tile.map(|side| side / layer_scale),
            slots: [layout.columns, layout.rows],
            inverse_slots: [layout.columns, layout.rows].map(|slots| 1.0 / slots as f32),
            texel: layout.image_size().map(|side| layer_scale as f32 / side as f32),
            bias: f32::from(bias) / shader_constants::STEPS_PER_LEVEL as f32,
            layer_scale,
            layer_share: 1.0 / layer_scale as f32,
            unused: 0,
        }
    }
}

/// `VastexView`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct ViewParams {
    pub(crate) clip_scale: [f32; 2],
    pub(crate) clip_offset: [f32; 2],
    pub(crate) level_offset: f32,
    pub(crate) frame: u32,
    pub(crate) jitter: [u32; 2],
    pub(crate) columns: u32,
    pub(crate) cell: u32,
    pub(crate) reversed_depth: u32,
    pub(crate) unused: u32,
}

/// `VastexChange`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Change {
    pub(crate) x: u32,
    pub(crate) y: u32,
    pub(crate) z: u32,
    pub(crate) old: u32,
    pub(crate) entry: u32,
    pub(crate) first_chunk: u32,
}

/// The head of `VastexChanges`, before the changes themselves.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct ChangesHead {
    pub(crate) evictions: u32,
    pub(crate) loads: u32,
    pub(crate) eviction_chunks: u32,
    pub(crate) load_chunks: u32,
}

/// `VastexWritten`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Written {
    pub(crate) place: u32,
    pub(crate) page_low: u32,
    pub(crate) page_high: u32,
    pub(crate) entry: u32,
}

/// The head of `VastexWrittenPlaces`, before the places themselves.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct WrittenHead {
    pub(crate) count: u32,
    pub(crate) unused: [u32; 3],
}

/// `VastexWanted`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Wanted {
    pub(crate) page_low: u32,
    pub(crate) page_high: u32,
    pub(crate) pixels_and_eighth: u32,
}

/// The head of `VastexList`, before the wanted pages.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct ListHead {
    pub(crate) pages: u32,
    pub(crate) degenerate: u32,
    pub(crate) unused: [u32; 2],
}

/// Records that a `VastexCell` has room for: of so many surfaces behind one another the nearest is heard for certain.
pub(crate) const RECORDS: u32 = 8;

/// Bytes of a `VastexCell`, which only the GPU writes.
pub(crate) const CELL_BYTES: u64 = 16 + RECORDS as u64 * 16;

/// Bytes of a `VastexHashSlot`, which only the GPU writes.
pub(crate) const HASH_SLOT_BYTES: u64 = 12;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader;
    use crate::shader::tests::module;
    use crate::way::FeedbackWay;
    use naga::{ScalarKind, TypeInner};
    use std::mem::offset_of;

    /// A field of a mirror: its name, its offset, and what its numbers are, where it has any.
    type Field = (&'static str, usize, Option<ScalarKind>);

    /// What the numbers of a type are.
    trait Numbers {
        const KIND: Option<ScalarKind>;
    }

    impl Numbers for u32 {
        const KIND: Option<ScalarKind> = Some(ScalarKind::Uint);
    }

    impl Numbers for f32 {
        const KIND: Option<ScalarKind> = Some(ScalarKind::Float);
    }

    impl Numbers for LevelParams {
        const KIND: Option<ScalarKind> = None;
    }

    impl<T: Numbers, const N: usize> Numbers for [T; N] {
        const KIND: Option<ScalarKind> = T::KIND;
    }

    fn kind<M, F: Numbers>(_: fn(&M) -> &F) -> Option<ScalarKind> {
        F::KIND
    }

    /// What the numbers of a WGSL type are; nothing of a struct.
    fn kind_of(module: &naga::Module, ty: naga::Handle<naga::Type>) -> Option<ScalarKind> {
        match module.types[ty].inner {
            TypeInner::Scalar(scalar) | TypeInner::Vector { scalar, .. } | TypeInner::Atomic(scalar) => {
                Some(scalar.kind)
            }
            TypeInner::Array { base, .. } => kind_of(module, base),
            _ => None,
        }
    }

    /// Compares one WGSL struct with its mirror: the size of the whole (or, for a head, where the rest begins) and
    /// the offset of each member, in order, and whether it is of whole numbers or of floats.
    fn check(text: &str, name: &str, size: usize, offsets: &[Field]) {
        let module = module(text);
        let mut types = module.types.iter().filter(|(_, ty)| ty.name.as_deref() == Some(name));
        let Some((_, naga::Type { inner: TypeInner::Struct { members, span }, .. })) = types.next() else {
            panic!("{name} is no struct of the shader");
        };
        for (member, (field, offset, kind)) in members.iter().zip(offsets) {
            let member_name = member.name.as_deref().unwrap();
            assert!(member_name.starts_with(field), "{name}: {member_name} stands where Rust has {field}");
            assert_eq!(member.offset as usize, *offset, "{name}.{field}");
            if kind.is_some() {
                assert_eq!(kind_of(&module, member.ty), *kind, "the numbers of {name}.{field}");
            }
        }
        match members.get(offsets.len()) {
            None => assert_eq!(*span as usize, size, "size of {name}"),
            Some(rest) if rest.name.as_deref().unwrap().starts_with("unused") => {
                assert_eq!(*span as usize, size, "size of {name}");
            }
            Some(rest) => assert_eq!(rest.offset as usize, size, "head of {name}"),
        }
    }

    macro_rules! offsets {
        ($mirror:ty: $($field:ident),+) => { &[$((
            stringify!($field),
            offset_of!($mirror, $field),
            kind(|mirror: &$mirror| &mirror.$field),
        )),+] };
    }

    /// The arithmetic of `vastex_place_in_slot`, beside that of whole numbers: at the ends of every row and image.
    #[test]
    fn single_precision_finds_the_place_of_every_slot() {
        let quotient = |number: u32, inverse: f32| ((number as f32 + 0.5) * inverse) as u32;
        for by in (1..=2048).chain([4095, 4096, 65_535, 1 << 20, shader_constants::POOL_SLOTS]) {
            let inverse = 1.0 / by as f32;
            let few = shader_constants::POOL_SLOTS / by;
            for multiple in (0..few.min(300)).chain(few.saturating_sub(300)..=few) {
                let at = multiple * by;
                for number in [at.saturating_sub(1), at, at + 1] {
                    assert_eq!(quotient(number, inverse), number / by, "{number} / {by}");
                }
            }
        }
    }

    #[test]
    fn textures_are_laid_out_alike() {
        let text = shader::wgsl(&Default::default());
        let level = offsets!(LevelParams: scale, first_entry, pages, unused_0, page_texels, page_shift, size, origin, inverse_scale, sample_offset);
        check(&text, "VastexLevel", size_of::<LevelParams>(), level);
        let pool =
            offsets!(PoolParams: tile, slots, inverse_slots, texel, bias, layer_scale, layer_share, unused);
        check(&text, "VastexPool", size_of::<PoolParams>(), pool);
        let view = offsets!(ViewParams: clip_scale, clip_offset, level_offset, frame, jitter, columns, cell, reversed_depth, unused);
        check(&text, "VastexView", size_of::<ViewParams>(), view);
        let texture: &[Field] = offsets!(TextureParams: size, level_count, page, tail_level, border, tail_slot, address, number, bias, finest, coarsest, table_level, table_places, table_seed);
        let unused = [
            ("unused", offset_of!(TextureParams, unused), None),
            ("unused", offset_of!(TextureParams, unused) + 4, None),
        ];
        let levels: &[Field] = offsets!(TextureParams: levels);
        check(&text, "VastexTexture", size_of::<TextureParams>(), &[texture, &unused, levels].concat());
    }

    #[test]
    fn changes_are_laid_out_alike() {
        let text = shader::table_wgsl();
        let change = offsets!(Change: x, y, z, old, entry, first_chunk);
        check(&text, "VastexChange", size_of::<Change>(), change);
        let head = offsets!(ChangesHead: evictions, loads, eviction_chunks, load_chunks);
        check(&text, "VastexChanges", size_of::<ChangesHead>(), head);
        let written = offsets!(Written: place, page_low, page_high, entry);
        check(&text, "VastexWritten", size_of::<Written>(), written);
        let unused = |n: usize| ("unused", offset_of!(WrittenHead, unused) + 4 * n, None);
        let head = [("count", 0, Some(ScalarKind::Uint)), unused(0), unused(1), unused(2)];
        check(&text, "VastexWrittenPlaces", size_of::<WrittenHead>(), &head);
    }

    #[test]
    fn what_the_main_pass_tells_is_laid_out_alike() {
        let options = shader::ShaderOptions { feedback: FeedbackWay::Inline, ..Default::default() };
        for text in [shader::wgsl(&options), shader::inline_wgsl()] {
            let head = [("count", 0), ("unused_0", 4), ("unused_1", 8), ("unused_2", 12)]
                .map(|(name, offset)| (name, offset, Some(ScalarKind::Uint)));
            let cell = [&head[..], &[("told", 16, None)]].concat();
            check(&text, "VastexCell", CELL_BYTES as usize, &cell);
        }
    }

    #[test]
    fn lists_are_laid_out_alike() {
        let text = shader::compact_wgsl();
        let wanted = offsets!(Wanted: page_low, page_high, pixels_and_eighth);
        check(&text, "VastexWanted", size_of::<Wanted>(), wanted);
        let unused = [0, 4].map(|at| ("unused", offset_of!(ListHead, unused) + at, None));
        let head: &[Field] = offsets!(ListHead: pages, degenerate);
        check(&text, "VastexList", size_of::<ListHead>(), &[head, &unused].concat());
        check(
            &text,
            "VastexHashSlot",
            HASH_SLOT_BYTES as usize,
            &[("owner", 0), ("pixels", 4), ("sharpness", 8)]
                .map(|(name, offset)| (name, offset, Some(ScalarKind::Uint))),
        );
    }

    #[test]
    #[should_panic(expected = "the numbers of Swapped.second")]
    fn a_float_in_the_place_of_a_whole_number_is_found() {
        struct Swapped {
            first: f32,
            second: f32,
        }
        let text = "struct Swapped { first: f32, second: u32 }
            @group(0) @binding(0) var<uniform> swapped: Swapped;";
        check(text, "Swapped", 8, offsets!(Swapped: first, second));
    }
}
