//! The keys of an array's chunks, and the way back.

/// How keys of chunks are made of their coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ChunkKeys {
    /// True if `c` stands before the coordinates.
    pub(crate) has_c: bool,
    /// Between the coordinates: `/` or `.`.
    pub(crate) separator: char,
}

impl ChunkKeys {
    /// The key below that of the array.
    pub(crate) fn key(self, coords: &[u64]) -> String {
        let mut key = String::from(if self.has_c { "c" } else { "" });
        for coord in coords {
            if !key.is_empty() {
                key.push(self.separator);
            }
            key.push_str(&coord.to_string());
        }
        key
    }

    /// The coordinates of a key below that of the array; `None` if it is no chunk's of so many axes.
    pub(crate) fn coords(self, key: &str, axes: usize) -> Option<Vec<u64>> {
        let rest = match self.has_c {
            true => key.strip_prefix('c')?.strip_prefix(self.separator)?,
            false => key,
        };
        let coords: Option<Vec<u64>> = rest
            .split(self.separator)
            .take(axes + 1)
            .map(|part| part.parse().ok().filter(|_| part.bytes().all(|byte| byte.is_ascii_digit())))
            .collect();
        coords.filter(|coords| coords.len() == axes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_lead_back_to_coordinates() {
        for (keys, key) in [
            (ChunkKeys { has_c: true, separator: '/' }, "c/0/12/3"),
            (ChunkKeys { has_c: true, separator: '.' }, "c.0.12.3"),
            (ChunkKeys { has_c: false, separator: '/' }, "0/12/3"),
            (ChunkKeys { has_c: false, separator: '.' }, "0.12.3"),
        ] {
            assert_eq!(keys.key(&[0, 12, 3]), key);
            assert_eq!(keys.coords(key, 3), Some(vec![0, 12, 3]));
            for bad in [".zarray", "zarr.json", "0/12", "0.12", "c/0/12", "c/0/12/3/4", "0/+1/2", "c/0/1/x"] {
                assert_eq!(keys.coords(bad, 3), None, "{keys:?} {bad}");
            }
        }
    }
}
