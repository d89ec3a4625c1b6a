//! The structs that Rust writes and WGSL reads, laid out alike.
//!
//! A test parses the shaders and compares every size and offset with these. What the fields mean stands with
//! the WGSL structs of the same names, in params.wgsl, reports.wgsl and compact.wgsl. What textures are told
//! by is packed (`record`); here are the sizes and codes of it that WGSL has as constants.

use bytemuck::{Pod, Zeroable};
use vastex_core::{AddressMode, PoolLayout, shader_constants};

/// Views that shaders can be told of.
pub(crate) const VIEWS: u32 = vastex_core::MAX_VIEWS as u32;

/// `VASTEXI_RECORD_HEAD`: words of 16 bytes of a record before its levels.
pub(crate) const RECORD_HEAD: usize = 3;
/// `VASTEXI_RECORD_LEVEL`: words of 16 bytes of a level of a record.
pub(crate) const RECORD_LEVEL: usize = 4;
/// `VASTEXI_RECORD_VOLUME_LEVEL`: the same of a volume whose voxels are not its texels.
pub(crate) const RECORD_VOLUME_LEVEL: usize = 7;

/// `VASTEXI_ADDRESS_*`: how an address mode is written in a record. Those that repeat have the bit of the one
/// that wraps.
pub(crate) const fn address_code(mode: AddressMode) -> u32 {
    match mode {
        AddressMode::Clamp => 0,
        AddressMode::Wrap => 1,
        AddressMode::Mirror => 3,
        AddressMode::Border => 2,
    }
}

/// `VastexiPool`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct PoolParams {
    pub(crate) tile: [u32; 2],
    pub(crate) slots: [u32; 2],
    pub(crate) inverse_slots: [f32; 2],
    pub(crate) texel: [f32; 2],
    pub(crate) unknown: [f32; 4],
    pub(crate) bias: f32,
    pub(crate) depth: u32,
    pub(crate) texel_z: f32,
    pub(crate) last_image: u32,
    pub(crate) tile_side: [f32; 2],
    pub(crate) slots_side: [f32; 2],
}

impl PoolParams {
    /// `bias` is in eighths of a level.
    pub(crate) fn new(layout: &PoolLayout, bias: u16, unknown: [f32; 4]) -> PoolParams {
        let ([width, height, depth], [columns, rows, images]) = (layout.tile, layout.grid);
        let [texel_x, texel_y, texel_z] = layout.size().map(|side| 1.0 / side as f32);
        PoolParams {
            tile: [width, height],
            slots: [columns, rows],
            inverse_slots: [columns, rows].map(|slots| 1.0 / slots as f32),
            texel: [texel_x, texel_y],
            unknown,
            bias: f32::from(bias) / shader_constants::STEPS_PER_LEVEL as f32,
            depth,
            texel_z,
            last_image: if layout.is_solid() { 0 } else { images.saturating_sub(1) },
            tile_side: [width as f32, height as f32],
            slots_side: [columns as f32, rows as f32],
        }
    }
}

/// `VastexiView`.
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
    pub(crate) first_cell: u32,
    pub(crate) rows: u32,
    pub(crate) answers: u32,
    pub(crate) block: u32,
    pub(crate) gaps: u32,
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

/// Records that a `VastexiCell` has room for: of so many surfaces behind one another the nearest is heard for
/// certain.
pub(crate) const RECORDS: u32 = 8;

/// Bytes of a `VastexiCell`, which only the GPU writes.
pub(crate) const CELL_BYTES: u64 = 16 + RECORDS as u64 * 16;

/// Bytes of a `VastexHashBucket`, which only the GPU writes.
pub(crate) const HASH_BUCKET_BYTES: u64 = 12;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bind::BindingPlace;
    use crate::feedback_mode::FeedbackMode;
    use crate::filter::Filter;
    use crate::kind::{Atlas, Kind, Kinds, PageSides, TableKind};
    use crate::shader;
    use crate::shader::tests::module;
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

    impl<T: Numbers, const N: usize> Numbers for [T; N] {
        const KIND: Option<ScalarKind> = T::KIND;
    }

    fn kind<M, F: Numbers>(_: fn(&M) -> &F) -> Option<ScalarKind> {
        F::KIND
    }

    /// What the numbers of a WGSL type are; `None` of a struct.
    fn kind_of(module: &naga::Module, ty: naga::Handle<naga::Type>) -> Option<ScalarKind> {
        match module.types[ty].inner {
            TypeInner::Scalar(scalar) | TypeInner::Vector { scalar, .. } | TypeInner::Atomic(scalar) => {
                Some(scalar.kind)
            }
            TypeInner::Array { base, .. } => kind_of(module, base),
            _ => None,
        }
    }

    /// Compares one WGSL struct with its mirror: the size of the whole (or, for a head, where the rest
    /// begins) and the offset of each member, in order, and whether it is of whole numbers or of floats.
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

    /// The arithmetic of `vastexi_cell`, beside that of whole numbers: at the ends of every row and image.
    #[test]
    fn single_precision_finds_the_place_of_every_slot() {
        let quotient = |number: u32, inverse: f32| ((number as f32 + 0.5) * inverse).floor() as u32;
        let rest = |number: u32, row: u32, by: u32| (number as f32 - row as f32 * by as f32) as u32;
        for by in (1..=2048).chain([4095, 4096, 65_535, 1 << 20, shader_constants::POOL_SLOTS]) {
            let inverse = 1.0 / by as f32;
            let few = shader_constants::POOL_SLOTS / by;
            for multiple in (0..few.min(300)).chain(few.saturating_sub(300)..=few) {
                let at = multiple * by;
                for number in [at.saturating_sub(1), at, at + 1] {
                    assert_eq!(quotient(number, inverse), number / by, "{number} / {by}");
                    assert_eq!(rest(number, number / by, by), number % by, "{number} % {by}");
                }
            }
        }
    }

    /// `vastexi_whole`, of all numbers that it is for.
    #[test]
    fn whole_numbers_are_found_in_the_bits_of_a_sum() {
        let whole = |number: f32| (number + 8_388_608.0).to_bits() & 0x7f_ffff;
        for number in 0..1 << 23 {
            assert_eq!(whole(number as f32), number);
        }
    }

    fn text(mode: FeedbackMode) -> String {
        let kind = Kind {
            dims: vastex_core::Dims::D2,
            tables: TableKind::Direct,
            pages: PageSides::Any,
            layer: 0,
            atlas: Atlas::Float,
            scale: 1,
            filter: Filter::Trilinear,
            is_mixed: true,
        };
        shader::wgsl(&Kinds::of(kind, mode, false), BindingPlace::default())
    }

    #[test]
    fn pools_and_views_are_laid_out_alike() {
        let text = text(FeedbackMode::Separate);
        let pool: &[Field] = offsets!(PoolParams: tile, slots, inverse_slots, texel, unknown, bias, depth, texel_z, last_image, tile_side, slots_side);
        check(&text, "VastexiPool", size_of::<PoolParams>(), pool);
        let view: &[Field] = offsets!(ViewParams: clip_scale, clip_offset, level_offset, frame, jitter, columns, cell, reversed_depth, first_cell, rows, answers, block, gaps);
        check(&text, "VastexiView", size_of::<ViewParams>(), view);
    }

    #[test]
    fn what_the_main_pass_reports_is_laid_out_alike() {
        for text in [text(FeedbackMode::Inline), shader::inline_wgsl()] {
            let head = [("count", 0), ("unused_0", 4), ("unused_1", 8), ("unused_2", 12)]
                .map(|(name, offset)| (name, offset, Some(ScalarKind::Uint)));
            let cell = [&head[..], &[("reports", 16, None)]].concat();
            check(&text, "VastexiCell", CELL_BYTES as usize, &cell);
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
            "VastexHashBucket",
            HASH_BUCKET_BYTES as usize,
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
