//! A display that shows nothing to anybody, and what stands on it.

use std::fs;
use std::io::{BufRead, BufReader};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

use anyhow::{Context, Result, ensure};

use super::png;
use crate::shell;

/// Columns and rows: as few as panels on both sides leave something between.
pub(super) const SIZE: [usize; 2] = [704, 448];

pub(super) struct Display {
    server: Child,
    pub(super) name: String,
    /// Pixels of a point of whoever is on it.
    pub(super) scale: usize,
    /// The address of the session bus of whoever is on it, if it has one of its own.
    pub(super) bus: Option<String>,
    pixels: PathBuf,
}

impl Display {
    /// Starts one, whose pixels lie in a directory.
    pub(super) fn start(place: &Path) -> Result<Display> {
        let mut command = shell::command("Xvfb");
        // It would begin anew after the last window, and refuse the next one meanwhile.
        command.arg("-noreset");
        command
            .args(["-displayfd", "1", "-screen", "0", &format!("{}x{}x24", SIZE[0], SIZE[1]), "-fbdir"])
            .arg(place);
        let mut server = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn()?;
        let mut number = String::new();
        if let Some(output) = server.stdout.take() {
            BufReader::new(output).read_line(&mut number)?;
        }
        let display = Display {
            server,
            name: format!(":{}", number.trim()),
            scale: 1,
            bus: None,
            pixels: place.join("Xvfb_screen0"),
        };
        ensure!(!number.trim().is_empty(), "Xvfb has not started");
        Ok(display)
    }

    /// The number of its process.
    pub(super) fn id(&self) -> u32 {
        self.server.id()
    }

    /// Blue, green, red and a byte more of each pixel in some columns, row by row.
    pub(super) fn look(&self, columns: Range<usize>) -> Result<Vec<u8>> {
        let file = fs::read(&self.pixels)?;
        let word = |n: usize| -> Result<usize> {
            let bytes = file.get(4 * n..4 * n + 4).context("the display's pixels have no head")?;
            Ok(u32::from_be_bytes(bytes.try_into()?) as usize)
        };
        // The format of xwd: the length of the head, the bytes of a row, and colours of 12 bytes before the
        // pixels.
        let (first, row_bytes) = (word(0)? + 12 * word(19)?, word(12)?);
        let row = |y: usize| {
            file.get(first + y * row_bytes + 4 * columns.start..first + y * row_bytes + 4 * columns.end)
        };
        let rows: Option<Vec<&[u8]>> = (0..SIZE[1]).map(row).collect();
        Ok(rows.context("the display's pixels are cut off")?.concat())
    }

    /// The pixels of some columns that have a colour, of red, green and blue: how many there are, and their
    /// middle.
    pub(super) fn find(&self, columns: Range<usize>, [r, g, b]: [u8; 3]) -> Result<Option<Found>> {
        let width = columns.len();
        let seen = self.look(columns.clone())?;
        let is_it = |pixel: &&[u8]| pixel[..3] == [b, g, r];
        let places = seen.chunks_exact(4).enumerate().filter(|(_, pixel)| is_it(pixel));
        let (mut count, mut sum) = (0, [0, 0]);
        for (n, _) in places {
            (count, sum) = (count + 1, [sum[0] + columns.start + n % width, sum[1] + n / width]);
        }
        Ok((count > 0).then(|| Found { count, middle: sum.map(|sum| sum / count) }))
    }

    /// The lowest row in which some columns have a pixel of a colour.
    pub(super) fn lowest(&self, columns: Range<usize>, [r, g, b]: [u8; 3]) -> Result<Option<usize>> {
        let width = columns.len();
        let seen = self.look(columns)?;
        Ok(seen.chunks_exact(4).rposition(|pixel| pixel[..3] == [b, g, r]).map(|n| n / width))
    }

    /// Keeps what stands on it as a PNG file.
    pub(super) fn keep(&self, path: &Path) -> Result<()> {
        let rgb: Vec<u8> =
            self.look(0..SIZE[0])?.chunks_exact(4).flat_map(|pixel| [pixel[2], pixel[1], pixel[0]]).collect();
        png::write(path, SIZE, &rgb)
    }
}

/// Pixels of a colour.
pub(super) struct Found {
    pub(super) count: usize,
    /// Column and row.
    pub(super) middle: [usize; 2],
}

impl Drop for Display {
    fn drop(&mut self) {
        // It ends with everything that is on it.
        drop(self.server.kill());
        drop(self.server.wait());
    }
}

/// The mean of bytes of pixels.
pub(super) fn mean(bytes: &[u8]) -> f64 {
    bytes.iter().map(|&byte| f64::from(byte)).sum::<f64>() / bytes.len().max(1) as f64
}
