//! The rows of several layers' images, read at once.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, Builder, Scope};

use crate::image::{InputFault, RowReader};

type Reader<'l> = &'l mut (dyn RowReader + 'static);
/// An image, to be named where it is damaged, and what reads it.
type Image<'l> = (&'l Path, Reader<'l>);

/// The images of all layers: the first is read by the caller, each other one by a thread of its own, or by
/// the caller too where the system gives no thread.
pub(crate) struct LayerReaders<'l> {
    first: Option<Image<'l>>,
    others: Vec<(&'l Path, Source<'l>)>,
}

enum Source<'l> {
    Caller(Reader<'l>),
    /// Where buffers go to be filled, and where they come back, or what the reader panicked with.
    Thread {
        asked: Sender<Vec<u8>>,
        filled: Receiver<thread::Result<Result<Vec<u8>, InputFault>>>,
    },
}

impl<'l> Source<'l> {
    fn start<'scope, 'env>(
        reader: Reader<'l>,
        scope: &'scope Scope<'scope, 'env>,
        builder: Builder,
    ) -> Source<'l>
    where
        'l: 'scope,
    {
        let ((asked, asked_rx), (filled_tx, filled)) = (channel::<Vec<u8>>(), channel());
        // The reader follows once there is a thread: what cannot be started is lost with all that it was
        // given.
        let (give, given) = channel::<Reader<'l>>();
        let started = builder.spawn_scoped(scope, move || {
            let Ok(reader) = given.recv() else { return };
            for mut rows in asked_rx {
                // A reader that panicked is not used again.
                let read = catch_unwind(AssertUnwindSafe(|| reader.read_rows(&mut rows)));
                let has_panicked = read.is_err();
                // Nobody waits for it where another layer's image is damaged.
                let _ = filled_tx.send(read.map(|read| read.map(|()| rows)));
                if has_panicked {
                    return;
                }
            }
        });
        if started.is_err() {
            return Source::Caller(reader);
        }
        match give.send(reader) {
            Ok(()) => Source::Thread { asked, filled },
            Err(back) => Source::Caller(back.0),
        }
    }
}

impl<'l> LayerReaders<'l> {
    /// The threads end when this is dropped.
    pub(crate) fn new<'scope, 'env>(
        layers: impl Iterator<Item = Image<'l>>,
        scope: &'scope Scope<'scope, 'env>,
    ) -> LayerReaders<'l>
    where
        'l: 'scope,
    {
        LayerReaders::with_threads(layers, scope, Builder::new)
    }

    fn with_threads<'scope, 'env>(
        mut layers: impl Iterator<Item = Image<'l>>,
        scope: &'scope Scope<'scope, 'env>,
        builder: fn() -> Builder,
    ) -> LayerReaders<'l>
    where
        'l: 'scope,
    {
        let first = layers.next();
        let others = layers.map(|(path, reader)| (path, Source::start(reader, scope, builder())));
        LayerReaders { first, others: others.collect() }
    }

    /// Fills a buffer for each layer with its next rows. Of several faults the first layer's counts; a
    /// reader's panic goes on here.
    pub(crate) fn read(&mut self, rows: &mut [Vec<u8>]) -> Result<(), (&'l Path, InputFault)> {
        let Some((first, others)) = rows.split_first_mut() else { return Ok(()) };
        for ((_, source), rows) in self.others.iter().zip(&mut *others) {
            if let Source::Thread { asked, .. } = source {
                // Where its thread has ended, nothing comes back either.
                let _ = asked.send(std::mem::take(rows));
            }
        }
        if let Some((path, reader)) = &mut self.first {
            reader.read_rows(first).map_err(|fault| (*path, fault))?;
        }
        for ((path, source), rows) in self.others.iter_mut().zip(others) {
            let read = match source {
                Source::Caller(reader) => reader.read_rows(rows),
                Source::Thread { filled, .. } => match filled.recv() {
                    Ok(Ok(read)) => read.map(|filled| *rows = filled),
                    Ok(Err(panic)) => resume_unwind(panic),
                    // After a panic, which no caller reads on from.
                    Err(_) => Err(InputFault::Truncated { place: "where its reader stopped".into() }),
                },
            };
            read.map_err(|fault| (*path, fault))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::image::{ImageHeader, PixelFormat, Rendezvous, Watch};

    /// Rows of its number; waits for the others. Panics with its number where that is 7.
    struct WaitingReader {
        header: ImageHeader,
        number: u8,
        watch: Watch,
        left: u32,
    }

    impl RowReader for WaitingReader {
        fn header(&self) -> &ImageHeader {
            &self.header
        }

        fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
            (self.watch)();
            if self.number == 7 {
                resume_unwind(Box::new(self.number));
            }
            rows.fill(self.number);
            self.left -= 1;
            if self.left == 0 { Err(InputFault::Empty) } else { Ok(()) }
        }
    }

    #[test]
    fn all_layers_are_read_at_once_and_the_first_fault_counts() {
        let rendezvous = Arc::new(Rendezvous::default());
        let header = ImageHeader::new(4, 9, PixelFormat::GREY8).unwrap();
        let reader = |number: u8| WaitingReader {
            header: header.clone(),
            number,
            watch: rendezvous.watch(3),
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
        assert_eq!(rendezvous.most(), 3);
    }

    fn readers(
        rendezvous: &Arc<Rendezvous>,
        wanted: usize,
        numbers: [u8; 3],
    ) -> [(String, WaitingReader); 3] {
        let header = ImageHeader::new(4, 9, PixelFormat::GREY8).unwrap();
        numbers.map(|number| {
            let watch = rendezvous.watch(wanted);
            (number.to_string(), WaitingReader { header: header.clone(), number, watch, left: 9 })
        })
    }

    #[test]
    fn where_there_are_no_threads_layers_are_read_in_turn() {
        let rendezvous = Arc::new(Rendezvous::default());
        let mut readers = readers(&rendezvous, 1, [0, 1, 2]);
        thread::scope(|scope| {
            let images =
                readers.iter_mut().map(|(name, reader)| (Path::new(name), reader as &mut dyn RowReader));
            // No system has room for such a stack.
            let builder = || Builder::new().stack_size(usize::MAX / 4);
            let mut layers = LayerReaders::with_threads(images, scope, builder);
            assert!(layers.others.iter().all(|(_, source)| matches!(source, Source::Caller(_))));
            let mut rows = vec![vec![9; 4]; 3];
            assert!(layers.read(&mut rows).is_ok());
            assert_eq!(rows, [[0; 4], [1; 4], [2; 4]]);
        });
    }

    #[test]
    fn a_panic_of_a_reader_goes_on_as_it_is() {
        let rendezvous = Arc::new(Rendezvous::default());
        let mut readers = readers(&rendezvous, 1, [0, 7, 2]);
        let reads = AssertUnwindSafe(|| {
            thread::scope(|scope| {
                let images =
                    readers.iter_mut().map(|(name, reader)| (Path::new(name), reader as &mut dyn RowReader));
                LayerReaders::new(images, scope).read(&mut vec![vec![9; 4]; 3]).is_ok()
            })
        });
        let panic = catch_unwind(reads).unwrap_err();
        assert_eq!(panic.downcast_ref(), Some(&7u8));
    }
}
