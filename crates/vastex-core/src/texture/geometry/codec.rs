//! A geometry as bytes, both ways: the one form that a geometry has in files, containers and traces alike.
//!
//! There are two pieces, since containers keep them apart. The *shape* has dimensions, address modes, size,
//! page, border and the factor of each level but the finest; the *placement* has two bytes, where texels lie
//! and how the tail is aligned. A file that has no placement has the usual one. Where the pieces stand in a
//! file is the file's business.

use super::{AddressMode, Geometry, GeometryError, GeometrySpec, MAX_LEVELS, TexelPositions};
use crate::texture::page::Dims;

/// The address modes, each at the number that stands for it.
const ADDRESS_MODES: [AddressMode; 4] =
    [AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border];
/// The positions of texels, each at the number that stands for it.
const POSITIONS: [TexelPositions; 2] = [TexelPositions::Centered, TexelPositions::Kept];

/// Why bytes are no shape or placement of a geometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GeometryBytesError {
    /// The shape ends too early.
    #[error("it ends too early")]
    Short,
    /// Bytes follow after the shape.
    #[error("the geometry is too long")]
    Long,
    /// There are more levels than a texture can have.
    #[error("{0} levels below the finest")]
    Levels(u32),
    /// The number of dimensions is neither 2 nor 3.
    #[error("a texture of {0} dimensions is not known")]
    Dims(u8),
    /// No address mode has this number.
    #[error("address mode {0} is not known")]
    AddressMode(u8),
    /// No positions of texels have this number.
    #[error("positions of texels {0} are not known")]
    Positions(u8),
}

impl GeometryBytesError {
    /// Returns true if a later program may be able to read the bytes.
    pub fn is_unknown(&self) -> bool {
        use GeometryBytesError::{AddressMode, Dims, Positions};
        matches!(self, Dims(_) | AddressMode(_) | Positions(_))
    }
}

/// What bytes say of a geometry, before it is checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GeometryParts {
    spec: GeometrySpec,
    factors: Vec<[u32; 3]>,
}

impl GeometryParts {
    /// Reads a shape, of which all bytes are used. The placement is the usual one until it is set.
    pub fn from_shape(bytes: &[u8]) -> Result<GeometryParts, GeometryBytesError> {
        let mut rest = bytes;
        let dims = match take(&mut rest).map(|[dims]: [u8; 1]| dims)? {
            2 => Dims::D2,
            3 => Dims::D3,
            other => return Err(GeometryBytesError::Dims(other)),
        };
        let mut address = [AddressMode::Clamp; 3];
        for (mode, number) in address.iter_mut().zip(take::<3>(&mut rest)?) {
            let known = ADDRESS_MODES.get(usize::from(number)).copied();
            *mode = known.ok_or(GeometryBytesError::AddressMode(number))?;
        }
        let (size, page, border) = (take_size(&mut rest)?, take_u32(&mut rest)?, take_u32(&mut rest)?);
        let count = take_u32(&mut rest)?;
        if count as usize >= MAX_LEVELS {
            return Err(GeometryBytesError::Levels(count));
        }
        let factors = (0..count).map(|_| take_size(&mut rest)).collect::<Result<_, _>>()?;
        if !rest.is_empty() {
            return Err(GeometryBytesError::Long);
        }
        let spec = GeometrySpec { dims, size, page, border, address, ..GeometrySpec::image(1, 1) };
        Ok(GeometryParts { spec, factors })
    }

    /// Reads a placement in place of the usual one.
    pub fn set_placement(&mut self, [positions, tail_align]: [u8; 2]) -> Result<(), GeometryBytesError> {
        let known = POSITIONS.get(usize::from(positions)).copied();
        self.spec.positions = known.ok_or(GeometryBytesError::Positions(positions))?;
        self.spec.tail_align = u32::from(tail_align);
        Ok(())
    }

    /// The geometry, if its parts fit together.
    pub fn geometry(&self) -> Result<Geometry, GeometryError> {
        Geometry::with_factors(self.spec, &self.factors)
    }
}

impl Geometry {
    /// The shape as bytes, numbers little-endian: dimensions (one byte), the address mode of each axis (one
    /// byte each), then four bytes each for width, height, depth, page, border, the number of levels after
    /// the finest, and for each of these the texels of the next finer level along x, y and z.
    pub fn shape_bytes(&self) -> Vec<u8> {
        let spec = self.spec();
        let mut bytes = vec![match spec.dims {
            Dims::D2 => 2,
            Dims::D3 => 3,
        }];
        bytes.extend(spec.address.map(|mode| number_of(&ADDRESS_MODES, mode)));
        let factors = &self.levels()[1..];
        let numbers = spec.size.into_iter().chain([spec.page, spec.border, factors.len() as u32]);
        for number in numbers.chain(factors.iter().flat_map(|level| level.factor)) {
            bytes.extend(number.to_le_bytes());
        }
        bytes
    }

    /// The placement as bytes: the positions of texels (0 centred, 1 kept), and the alignment of the tail.
    pub fn placement_bytes(&self) -> [u8; 2] {
        [number_of(&POSITIONS, self.spec().positions), self.spec().tail_align as u8]
    }
}

fn number_of<T: PartialEq + Copy>(values: &[T], value: T) -> u8 {
    values.iter().position(|known| *known == value).unwrap_or(0) as u8
}

fn take<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], GeometryBytesError> {
    let (taken, after) = rest.split_first_chunk::<N>().ok_or(GeometryBytesError::Short)?;
    *rest = after;
    Ok(*taken)
}

fn take_u32(rest: &mut &[u8]) -> Result<u32, GeometryBytesError> {
    take(rest).map(u32::from_le_bytes)
}

fn take_size(rest: &mut &[u8]) -> Result<[u32; 3], GeometryBytesError> {
    Ok([take_u32(rest)?, take_u32(rest)?, take_u32(rest)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(shape: &[u8], placement: [u8; 2]) -> Result<Geometry, String> {
        let mut parts = GeometryParts::from_shape(shape).map_err(|error| error.to_string())?;
        parts.set_placement(placement).map_err(|error| error.to_string())?;
        parts.geometry().map_err(|error| error.to_string())
    }

    fn sample() -> Geometry {
        let spec = GeometrySpec {
            address: [AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border],
            positions: TexelPositions::Kept,
            tail_align: 16,
            ..GeometrySpec::volume([300, 200, 100])
        };
        Geometry::with_factors(spec, &[[3, 3, 3], [100, 67, 34]]).unwrap()
    }

    /// Files depend on these bytes.
    #[test]
    fn the_bytes_are_those_of_the_format() {
        let numbers = [300u32, 200, 100, 128, 4, 2, 3, 3, 3, 100, 67, 34];
        let expected = [&[3, 1, 2, 3][..], &numbers.map(u32::to_le_bytes).concat()].concat();
        assert_eq!(sample().shape_bytes(), expected);
        assert_eq!(sample().placement_bytes(), [1, 16]);
        let image = Geometry::new(GeometrySpec::image(1000, 777)).unwrap();
        assert_eq!((image.shape_bytes()[..4].to_vec(), image.placement_bytes()), (vec![2, 0, 0, 0], [0, 4]));
    }

    #[test]
    fn every_cut_and_every_addition_is_refused() {
        let shape = sample().shape_bytes();
        assert_eq!(read(&shape, [1, 16]), Ok(sample()));
        for len in 0..shape.len() {
            assert_eq!(GeometryParts::from_shape(&shape[..len]), Err(GeometryBytesError::Short), "{len}");
        }
        let longer = [&shape[..], &[0]].concat();
        assert_eq!(GeometryParts::from_shape(&longer), Err(GeometryBytesError::Long));
    }

    #[test]
    fn what_a_later_program_may_know_is_told_from_damage() {
        let with = |at: usize, value: u8| {
            let mut shape = sample().shape_bytes();
            shape[at] = value;
            GeometryParts::from_shape(&shape).unwrap_err()
        };
        assert_eq!(with(0, 4), GeometryBytesError::Dims(4));
        assert_eq!(with(2, 9), GeometryBytesError::AddressMode(9));
        assert_eq!(with(25, 1), GeometryBytesError::Levels(258));
        assert!(with(0, 4).is_unknown() && with(2, 9).is_unknown() && !with(25, 1).is_unknown());
        let mut parts = GeometryParts::from_shape(&sample().shape_bytes()).unwrap();
        assert_eq!(parts.set_placement([2, 4]), Err(GeometryBytesError::Positions(2)));
        parts.set_placement([0, 5]).unwrap();
        assert_eq!(parts.geometry(), Err(GeometryError::TailAlign(5)));
    }

    proptest! {
        #[test]
        fn a_geometry_reads_back(
            volume: bool, size in prop::array::uniform3(1u32..5000), page in 8u32..300, kept: bool,
            modes in prop::array::uniform3(prop::sample::select(&ADDRESS_MODES[..])),
            tail_align in prop::sample::select(vec![4u32, 8, 16]),
        ) {
            let spec = match volume {
                true => GeometrySpec::volume(size.map(|side| side.div_ceil(20))),
                false => GeometrySpec::image(size[0], size[1]),
            };
            let positions = if kept { TexelPositions::Kept } else { TexelPositions::Centered };
            let spec = GeometrySpec { page, address: modes, positions, tail_align, ..spec };
            let geometry = Geometry::new(spec).unwrap();
            prop_assert_eq!(read(&geometry.shape_bytes(), geometry.placement_bytes()), Ok(geometry));
        }
    }
}
