//! Regions that are cut out while somebody watches, and stops it.

use std::cell::Cell;
use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use vastex_build::{CropError, CropFormat, CropRegion, CropSource, Notice, Progress, crop};

use crate::common::files::jpeg;
use crate::common::sandbox::Sandbox;

const SIZE: [u32; 2] = [96, 80];

/// Hears of a region, and stops it from an output of so many bytes on, or while nothing of it is there yet.
#[derive(Default)]
struct Watcher {
    beginnings: Cell<u32>,
    told: Cell<Option<u64>>,
    written: Cell<usize>,
    stops_at: Option<usize>,
    stops_before: bool,
}

impl Progress for Watcher {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        match self.stops_at.is_some_and(|bytes| self.written.get() >= bytes) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    fn beginning(&self, _: f64) -> ControlFlow<()> {
        assert!(self.told.get().is_some(), "what it costs is told before");
        self.beginnings.set(self.beginnings.get() + 1);
        if self.stops_before { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn note(&self, _: &Path, notice: &Notice) {
        if let Notice::WholeImage { bytes, .. } = notice {
            assert_eq!(self.told.replace(Some(*bytes)), None, "once");
        }
    }
}

/// Counts what is written.
struct Counted<'a>(&'a Watcher);

impl Write for Counted<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.written.set(self.0.written.get() + bytes.len());
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

fn cut(path: &Path, watcher: &Watcher) -> Result<(), CropError> {
    let mut source = CropSource::open(path, 0).unwrap();
    let region = CropRegion { at: [0, 0], size: SIZE };
    crop(&mut source, region, CropFormat::Npy, &mut Counted(watcher), watcher)
}

fn image(sandbox: &Sandbox, is_progressive: bool) -> PathBuf {
    let texels: Vec<u8> = (0..SIZE[0] * SIZE[1] * 3).map(|n| (n / 7) as u8).collect();
    let path = sandbox.path("image.jpg");
    std::fs::write(&path, jpeg(SIZE, 3, is_progressive, &texels)).unwrap();
    path
}

#[test]
fn what_stops_a_region_while_its_last_rows_are_written_is_heard() {
    let sandbox = Sandbox::new();
    let path = image(&sandbox, false);
    let all = Watcher::default();
    cut(&path, &all).unwrap();
    assert_eq!(all.told.get(), None, "it is read by rows");
    let late = Watcher { stops_at: Some(all.written.get()), ..Watcher::default() };
    assert!(matches!(cut(&path, &late), Err(CropError::Cancelled)));
}

#[test]
fn a_progressive_jpeg_tells_what_it_takes_and_can_be_stopped_before_its_first_row() {
    let sandbox = Sandbox::new();
    let path = image(&sandbox, true);
    let all = Watcher::default();
    cut(&path, &all).unwrap();
    assert!(all.told.get().is_some_and(|bytes| bytes > 0) && all.beginnings.get() > 0);
    let early = Watcher { stops_before: true, ..Watcher::default() };
    assert!(matches!(cut(&path, &early), Err(CropError::Cancelled)));
}
