//! The plane that `vastex render --on slices` shows, as it is told.

/// A plane of a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum AskedSlice {
    /// Voxels of level 0 across an axis.
    Voxels {
        /// 0 to 2: x, y, z.
        axis: u8,
        /// Which voxel, from 0.
        voxel: u32,
    },
    /// Through a point, however it lies.
    Oblique {
        /// The point, in voxels of level 0: voxel i fills i to i + 1.
        at: [f64; 3],
        /// What stands upright on it and points away from the eye, in the world; not 0.
        normal: [f64; 3],
    },
}

pub(super) fn parse_slice(text: &str) -> Result<AskedSlice, String> {
    if let Some(words) = text.strip_prefix("plane:") {
        return parse_plane(words);
    }
    let wrong = || {
        "write x=K, y=K or z=K, K counting voxels from 0, as in z=40; or plane:x=X,y=Y,z=Z,nx=N,ny=N,nz=N"
            .to_owned()
    };
    let (axis, voxel) = text.split_once('=').ok_or_else(wrong)?;
    let axis = ["x", "y", "z"].iter().position(|name| *name == axis).ok_or_else(wrong)?;
    Ok(AskedSlice::Voxels { axis: axis as u8, voxel: voxel.parse().map_err(|_| wrong())? })
}

fn parse_plane(text: &str) -> Result<AskedSlice, String> {
    let (mut at, mut normal) = ([None; 3], [0.0; 3]);
    for word in text.split(',') {
        let number = |value: &str| {
            let number = value.parse().ok().filter(|number: &f64| number.abs() < 1e12);
            number.ok_or_else(|| format!("'{word}': write a number, as in x=12.5"))
        };
        match word.split_once('=') {
            Some(("x", value)) => at[0] = Some(number(value)?),
            Some(("y", value)) => at[1] = Some(number(value)?),
            Some(("z", value)) => at[2] = Some(number(value)?),
            Some(("nx", value)) => normal[0] = number(value)?,
            Some(("ny", value)) => normal[1] = number(value)?,
            Some(("nz", value)) => normal[2] = number(value)?,
            _ => {
                return Err(format!(
                    "'{word}': there are x, y and z of a point, and nx, ny and nz of the normal"
                ));
            }
        }
    }
    let [Some(x), Some(y), Some(z)] = at else {
        return Err("a plane needs a point, as in plane:x=40,y=50,z=30,nx=1,ny=1,nz=0".into());
    };
    if normal.iter().map(|along| along * along).sum::<f64>() < 1e-12 {
        return Err(
            "a plane needs a normal, of which nx, ny or nz is not 0, as in plane:x=40,y=50,z=30,nx=1,ny=1"
                .into(),
        );
    }
    Ok(AskedSlice::Oblique { at: [x, y, z], normal })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_are_planes_of_voxels_or_lie_as_they_like() {
        assert_eq!(parse_slice("y=7"), Ok(AskedSlice::Voxels { axis: 1, voxel: 7 }));
        let oblique = AskedSlice::Oblique { at: [1.5, -2.0, 30.0], normal: [0.0, 1.0, -0.5] };
        assert_eq!(parse_slice("plane:x=1.5,y=-2,ny=1,nz=-0.5,z=30"), Ok(oblique));
        for bad in ["7", "y", "w=1", "z=-1", "z=1.5", "z=99999999999", "plane:", "plane:x=1,y=2,nz=1"] {
            assert!(parse_slice(bad).is_err(), "{bad}");
        }
        for bad in
            ["x=1,y=2,z=3", "x=1,y=2,z=3,nx=0", "x=1,y=nan,z=3,nx=1", "x=1,y=2,z=3,nx=inf", "x=1,y=2,z=3,q=1"]
        {
            assert!(parse_slice(&format!("plane:{bad}")).is_err(), "{bad}");
        }
    }
}
