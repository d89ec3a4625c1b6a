//! The rows of several layers' images, read at once.

use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::Scope;

use crate::error::InputFault;
use crate::readers::RowReader;

/// An image, to be named where it is damaged, and what reads it.
type Image<'l> = (&'l Path, &'l mut (dyn RowReader + 'static));

/// The images of all layers: the first is read by the caller, each other one by a thread of its own.
pub(crate) struct LayerReaders<'l> {
    first: Option<Image<'l>>,
    others: Vec<OtherLayer<'l>>,
}

/// Where buffers go to be filled, and where they come back.
struct OtherLayer<'l> {
    path: &'l Path,
    asked: Sender<Vec<u8>>,
    filled: Receiver<Result<Vec<u8>, InputFault>>,
}

impl<'l> LayerReaders<'l> {
    /// The threads end when this is dropped.
    pub(crate) fn new<'scope, 'env>(
        mut layers: impl Iterator<Item = Image<'l>>,
        scope: &'scope Scope<'scope, 'env>,
    ) -> LayerReaders<'l>
    where
        'l: 'scope,
    {
        let first = layers.next();
        let other = |(path, reader): Image<'l>| {
            let ((asked, asked_rx), (filled_tx, filled)) = (channel::<Vec<u8>>(), channel());
            scope.spawn(move || {
                for mut rows in asked_rx {
                    let read = reader.read_rows(&mut rows);
                    // Nobody waits for it where another layer's image is damaged.
                    let _ = filled_tx.send(read.map(|()| rows));
                }
            });
            OtherLayer { path, asked, filled }
        };
        LayerReaders { first, others: layers.map(other).collect() }
    }

    /// Fills a buffer for each layer with its next rows. Of several faults the first layer's counts.
    pub(crate) fn read(&mut self, rows: &mut [Vec<u8>]) -> Result<(), (&'l Path, InputFault)> {
        let Some((first, others)) = rows.split_first_mut() else { return Ok(()) };
        for (layer, rows) in self.others.iter().zip(&mut *others) {
            // Where its thread has panicked, nothing comes back either.
            let _ = layer.asked.send(std::mem::take(rows));
        }
        if let Some((path, reader)) = &mut self.first {
            reader.read_rows(first).map_err(|fault| (*path, fault))?;
        }
        for (layer, rows) in self.others.iter().zip(others) {
            // The scope goes on with a panic when it ends.
            let stopped = || Err(InputFault::Truncated { place: "where its reader stopped".into() });
            *rows = layer.filled.recv().unwrap_or_else(|_| stopped()).map_err(|fault| (layer.path, fault))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::readers::{ImageHeader, Meeting, PixelFormat, Watch};

    /// Rows of its number; waits for the others.
    struct Sociable {
        header: ImageHeader,
        number: u8,
        watch: Watch,
        left: u32,
    }

    impl RowReader for Sociable {
        fn header(&self) -> &ImageHeader {
            &self.header
        }

        fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
            (self.watch)();
            rows.fill(self.number);
            self.left -= 1;
            if self.left == 0 { Err(InputFault::Empty) } else { Ok(()) }
        }
    }

    #[test]
    fn all_layers_are_read_at_once_and_the_first_fault_counts() {
        let meeting = Arc::new(Meeting::default());
        let header = ImageHeader::new(4, 9, PixelFormat::GREY8).unwrap();
        let reader = |number: u8| Sociable {
            header: header.clone(),
            number,
            watch: meeting.watch(3),
            left: if number == 0 { 9 } else { 3 },
        };
        let mut readers = [0, 1, 2].map(|number| (number.to_string(), reader(number)));
        std::thread::scope(|scope| {
            let images =
                readers.iter_mut().map(|(name, reader)| (Path::new(name), reader as &mut dyn RowReader));
            let mut layers = LayerReaders::new(images, scope);
            let mut rows = vec![vec![9; 4]; 3];
            for _ in 0..2 {
                assert!(layers.read(&mut rows).is_ok());
                assert_eq!(rows, [[0; 4], [1; 4], [2; 4]]);
            }
            let (path, fault) = layers.read(&mut rows).unwrap_err();
            assert!(path == Path::new("1") && matches!(fault, InputFault::Empty));
        });
        assert_eq!(meeting.most(), 3);
    }
}
