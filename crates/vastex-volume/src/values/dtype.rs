//! Kinds of numbers, by the names that Zarr, NumPy and NIfTI give them.

/// What the values of a volume are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DType {
    /// A truth value of one byte.
    Bool,
    /// A whole number of 8 bits without a sign.
    U8,
    /// A whole number of 8 bits with a sign.
    I8,
    /// A whole number of 16 bits without a sign.
    U16,
    /// A whole number of 16 bits with a sign.
    I16,
    /// A whole number of 32 bits without a sign.
    U32,
    /// A whole number of 32 bits with a sign.
    I32,
    /// A whole number of 64 bits without a sign.
    U64,
    /// A whole number of 64 bits with a sign.
    I64,
    /// A float of 16 bits.
    F16,
    /// A float of 32 bits.
    F32,
    /// A float of 64 bits.
    F64,
}

impl DType {
    /// Every type.
    pub const ALL: [DType; 12] = [
        DType::Bool,
        DType::U8,
        DType::I8,
        DType::U16,
        DType::I16,
        DType::U32,
        DType::I32,
        DType::U64,
        DType::I64,
        DType::F16,
        DType::F32,
        DType::F64,
    ];

    /// Bytes of a value: 1, 2, 4 or 8.
    pub const fn bytes(self) -> usize {
        match self {
            DType::Bool | DType::U8 | DType::I8 => 1,
            DType::U16 | DType::I16 | DType::F16 => 2,
            DType::U32 | DType::I32 | DType::F32 => 4,
            DType::U64 | DType::I64 | DType::F64 => 8,
        }
    }

    /// The type's name in NumPy and in Zarr v3: `uint16`.
    pub const fn name(self) -> &'static str {
        match self {
            DType::Bool => "bool",
            DType::U8 => "uint8",
            DType::I8 => "int8",
            DType::U16 => "uint16",
            DType::I16 => "int16",
            DType::U32 => "uint32",
            DType::I32 => "int32",
            DType::U64 => "uint64",
            DType::I64 => "int64",
            DType::F16 => "float16",
            DType::F32 => "float32",
            DType::F64 => "float64",
        }
    }

    /// The type's short name in NumPy, without the byte order: `u2`.
    pub const fn short_name(self) -> &'static str {
        match self {
            DType::Bool => "b1",
            DType::U8 => "u1",
            DType::I8 => "i1",
            DType::U16 => "u2",
            DType::I16 => "i2",
            DType::U32 => "u4",
            DType::I32 => "i4",
            DType::U64 => "u8",
            DType::I64 => "i8",
            DType::F16 => "f2",
            DType::F32 => "f4",
            DType::F64 => "f8",
        }
    }

    /// Returns true if values are floats.
    pub const fn is_float(self) -> bool {
        matches!(self, DType::F16 | DType::F32 | DType::F64)
    }

    /// The least and the greatest value of a whole number; `None` for floats.
    pub const fn bounds(self) -> Option<(i128, i128)> {
        let bits = 8 * self.bytes() as u32;
        match self {
            DType::Bool => Some((0, 1)),
            DType::U8 | DType::U16 | DType::U32 | DType::U64 => Some((0, (1 << bits) - 1)),
            DType::I8 | DType::I16 | DType::I32 | DType::I64 => {
                Some((-(1 << (bits - 1)), (1 << (bits - 1)) - 1))
            }
            DType::F16 | DType::F32 | DType::F64 => None,
        }
    }

    /// Of its name in Zarr v3.
    pub(crate) fn named(name: &str) -> Option<DType> {
        DType::ALL.into_iter().find(|dtype| dtype.name() == name)
    }

    /// Of its name in Zarr v2, `<u2` for one, and whether its bytes are big-endian.
    pub(crate) fn of_v2(name: &str) -> Option<(DType, bool)> {
        let order = name.chars().next()?;
        let (is_big, short) = match order {
            '<' | '|' | '=' => (false, &name[1..]),
            '>' => (true, &name[1..]),
            _ => (false, name),
        };
        let dtype =
            DType::ALL.into_iter().find(|dtype| dtype.short_name() == short || dtype.name() == short)?;
        Some((dtype, is_big))
    }
}

/// Turns the bytes of each value round.
pub(crate) fn swap_bytes(bytes: &mut [u8], width: usize) {
    match width {
        2 => bytes.as_chunks_mut::<2>().0.iter_mut().for_each(|value| value.reverse()),
        4 => bytes.as_chunks_mut::<4>().0.iter_mut().for_each(|value| value.reverse()),
        8 => bytes.as_chunks_mut::<8>().0.iter_mut().for_each(|value| value.reverse()),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_zarr() {
        for dtype in DType::ALL {
            assert_eq!(DType::named(dtype.name()), Some(dtype));
            for (order, is_big) in [('<', false), ('>', true), ('|', false)] {
                assert_eq!(DType::of_v2(&format!("{order}{}", dtype.short_name())), Some((dtype, is_big)));
            }
        }
        for bad in ["", "<", "<c8", "|O", "<U3", "complex64", "µ"] {
            assert_eq!((DType::of_v2(bad), DType::named(bad)), (None, None), "{bad}");
        }
        assert_eq!(DType::U64.bounds(), Some((0, u64::MAX.into())));
        assert_eq!(DType::I8.bounds(), Some((-128, 127)));
    }

    #[test]
    fn bytes_are_turned_round() {
        let mut bytes = [1, 2, 3, 4, 5, 6, 7, 8];
        swap_bytes(&mut bytes, 2);
        assert_eq!(bytes, [2, 1, 4, 3, 6, 5, 8, 7]);
        swap_bytes(&mut bytes, 8);
        assert_eq!(bytes, [7, 8, 5, 6, 3, 4, 1, 2]);
    }
}
