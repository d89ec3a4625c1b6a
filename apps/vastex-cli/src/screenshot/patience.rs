//! How long somebody waits for a picture that is drawn beside a window, and what is broken off after that.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Result, bail};

use crate::open::{Looked, OpenObserver};

/// The patience of those who asked for a picture: they may lose it at any time, from another thread.
#[derive(Debug, Default)]
pub(crate) struct Patience {
    is_short: AtomicBool,
    is_over: AtomicBool,
}

impl Patience {
    /// From now on no image is built or decoded for the picture; what is open, or is read where it lies, is
    /// drawn.
    pub(crate) fn shorten(&self) {
        self.is_short.store(true, Ordering::Relaxed);
    }

    /// From now on nobody waits for it.
    pub(crate) fn end(&self) {
        self.shorten();
        self.is_over.store(true, Ordering::Relaxed);
    }

    /// `Break` where nobody waits for the picture any more.
    pub(super) fn flow(&self) -> ControlFlow<()> {
        if self.check().is_err() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Fails where nobody waits for the picture any more.
    pub(crate) fn check(&self) -> Result<()> {
        if self.is_over.load(Ordering::Relaxed) {
            bail!("the window was closed before the picture was there");
        }
        Ok(())
    }
}

/// Opens the files of a picture, as long as there is patience for that.
pub(super) struct OpeningShot<'a> {
    pub(super) looked: Looked,
    pub(super) patience: &'a Patience,
}

impl OpenObserver for OpeningShot<'_> {
    fn looked(&self) -> Option<&Looked> {
        Some(&self.looked)
    }

    fn advance(&self, _: f64) -> ControlFlow<()> {
        match self.patience.is_short.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    /// Little of a pyramid is read at its opening.
    fn advance_in_place(&self, _: f64) -> ControlFlow<()> {
        self.patience.flow()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_built_is_broken_off_before_what_is_drawn() {
        let patience = Patience::default();
        let opening = OpeningShot { looked: Looked::default(), patience: &patience };
        assert!(opening.advance(0.5).is_continue() && patience.check().is_ok());
        patience.shorten();
        assert!(opening.advance(0.5).is_break() && patience.check().is_ok());
        assert!(opening.advance_in_place(0.5).is_continue());
        patience.end();
        assert!(opening.advance(0.5).is_break() && patience.check().is_err());
        assert!(opening.advance_in_place(0.5).is_break());
    }
}
