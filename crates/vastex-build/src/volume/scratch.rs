//! A level between two rounds: the parts that blocks left, in memory or in a file without a name.

use std::ffi::OsString;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use super::block::Block;

/// A level, part by part; all parts have the same size, but those at the end of an axis.
pub(super) struct Scratch {
    size: [u64; 3],
    part: [u64; 3],
    width: usize,
    store: Store,
}

enum Store {
    /// By their numbers.
    Memory(Vec<Vec<u8>>),
    File(Unnamed),
}

impl Scratch {
    /// A level of so many voxels in parts of so many, kept in memory up to `most` bytes, else in a file in
    /// the directory of `beside`.
    pub(super) fn new(
        size: [u64; 3],
        part: [u64; 3],
        width: usize,
        most: u64,
        beside: &Path,
    ) -> io::Result<Scratch> {
        let bytes = size.iter().fold(width as u64, |bytes, side| bytes.saturating_mul(*side));
        let counts: u64 = (0..3).map(|axis| size[axis].div_ceil(part[axis])).product();
        let store = match bytes <= most {
            true => Store::Memory(vec![Vec::new(); counts as usize]),
            false => Store::File(Unnamed::beside(beside)?),
        };
        Ok(Scratch { size, part, width, store })
    }

    /// The sides of the part at a place among the parts.
    fn sides(&self, place: [u64; 3]) -> [u64; 3] {
        std::array::from_fn(|axis| {
            self.part[axis].min(self.size[axis].saturating_sub(place[axis] * self.part[axis]))
        })
    }

    fn number(&self, place: [u64; 3]) -> u64 {
        let count = |axis: usize| self.size[axis].div_ceil(self.part[axis]);
        (place[2] * count(1) + place[1]) * count(0) + place[0]
    }

    /// Keeps a part, which is whole.
    pub(super) fn keep(&mut self, part: Block) -> io::Result<()> {
        let place = std::array::from_fn(|axis| part.at[axis] / self.part[axis]);
        let number = self.number(place);
        let most = self.part.iter().product::<u64>() * self.width as u64;
        match &mut self.store {
            Store::Memory(parts) => {
                if let Some(kept) = parts.get_mut(number as usize) {
                    *kept = part.values;
                }
                Ok(())
            }
            Store::File(file) => file.write(number * most, &part.values),
        }
    }

    /// A box of the level; `inner` is what of it is a part of its own.
    pub(super) fn read(&mut self, at: [u64; 3], size: [u64; 3], inner: [[u64; 3]; 2]) -> io::Result<Block> {
        let sides = size.map(|side| side as usize);
        let width = self.width;
        let mut values = vec![0; sides.iter().product::<usize>() * width];
        let range =
            |axis: usize| at[axis] / self.part[axis]..(at[axis] + size[axis]).div_ceil(self.part[axis]);
        let [across, down, deep] = [range(0), range(1), range(2)];
        let mut held = Vec::new();
        for place_z in deep {
            for place_y in down.clone() {
                for place_x in across.clone() {
                    let place = [place_x, place_y, place_z];
                    let part_sides = self.sides(place);
                    let number = self.number(place);
                    let most = self.part.iter().product::<u64>() * width as u64;
                    let part = match &mut self.store {
                        Store::Memory(parts) => parts.get(number as usize).map_or(&[][..], Vec::as_slice),
                        Store::File(file) => {
                            held.resize(part_sides.iter().product::<u64>() as usize * width, 0);
                            file.read(number * most, &mut held)?;
                            &held
                        }
                    };
                    let first: [u64; 3] = std::array::from_fn(|axis| place[axis] * self.part[axis]);
                    let begin: [u64; 3] = std::array::from_fn(|axis| first[axis].max(at[axis]));
                    let end: [u64; 3] = std::array::from_fn(|axis| {
                        (first[axis] + part_sides[axis]).min(at[axis] + size[axis])
                    });
                    let row = (end[0] - begin[0]) as usize * width;
                    for z in begin[2]..end[2] {
                        for y in begin[1]..end[1] {
                            let offset = |from: [u64; 3], sides: [u64; 3]| {
                                let within = ((z - from[2]) * sides[1] + (y - from[1])) * sides[0];
                                (within + begin[0] - from[0]) as usize * width
                            };
                            let (from, to) = (offset(first, part_sides), offset(at, size));
                            values[to..to + row].copy_from_slice(&part[from..from + row]);
                        }
                    }
                }
            }
        }
        Ok(Block { at, size: sides, values, inner })
    }
}

/// A file that nobody else sees, and that is gone when it is closed.
struct Unnamed {
    file: File,
    /// To be removed at the end, where the system removes no open file.
    path: Option<PathBuf>,
}

impl Unnamed {
    fn beside(output: &Path) -> io::Result<Unnamed> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        loop {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            // Of a name that the next build into the place knows for left behind; builds of this process have
            // other names there, which count from 0.
            let mut name = OsString::from(".");
            name.push(output.file_name().unwrap_or_default());
            name.push(format!(".{}-9{count:04}.partial", std::process::id()));
            let path = output.with_file_name(name);
            match OpenOptions::new().read(true).write(true).create_new(true).open(&path) {
                Ok(file) => {
                    let removed = std::fs::remove_file(&path);
                    return Ok(Unnamed { file, path: removed.is_err().then_some(path) });
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
    }

    fn write(&mut self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(offset))?;
        self.file.write_all(bytes)
    }

    fn read(&mut self, offset: u64, bytes: &mut [u8]) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(offset))?;
        self.file.read_exact(bytes)
    }
}

impl Drop for Unnamed {
    fn drop(&mut self) {
        if let Some(path) = &self.path {
            // Nobody is left to tell where it cannot be removed.
            let _ = std::fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_put_together_again_from_memory_and_from_a_file() {
        let directory = tempfile::tempdir().unwrap();
        let size = [7_u64, 5, 4];
        let value = |[x, y, z]: [u64; 3]| ((z * 5 + y) * 7 + x) as u16;
        let filled = |at: [u64; 3], sides: [u64; 3]| {
            let mut values = Vec::new();
            for z in at[2]..at[2] + sides[2] {
                for y in at[1]..at[1] + sides[1] {
                    values.extend((at[0]..at[0] + sides[0]).flat_map(|x| value([x, y, z]).to_le_bytes()));
                }
            }
            values
        };
        for most in [1 << 20, 0] {
            let mut scratch =
                Scratch::new(size, [3, 2, 3], 2, most, &directory.path().join("out.zarr")).unwrap();
            for n in 0..3 * 3 * 2 {
                let place = [n % 3, n / 3 % 3, n / 9];
                let sides = scratch.sides(place);
                let at = [place[0] * 3, place[1] * 2, place[2] * 3];
                let values = filled(at, sides);
                let size = sides.map(|side| side as usize);
                scratch.keep(Block { at, size, values, inner: [at, at] }).unwrap();
            }
            for (at, sides) in [([0; 3], size), ([2, 1, 2], [4, 3, 2]), ([6, 4, 3], [1, 1, 1])] {
                let read = scratch.read(at, sides, [at, at]).unwrap();
                assert_eq!(read.values, filled(at, sides), "{at:?} {sides:?}");
            }
        }
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    }
}
