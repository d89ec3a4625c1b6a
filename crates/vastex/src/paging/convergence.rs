//! The convergence of single views, as futures that need no runtime.

use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::task::{Context, Poll, Waker};

use vastex_core::ViewId;

/// Waits until a view has converged: all pages that it wanted in a whole jitter cycle are in the pools.
/// Awaited, it gives true then, and false if the view or the [`Textures`](crate::Textures) are gone.
///
/// Only [`Textures::update`](crate::Textures::update) drives it, while the view is drawn, so the thread that
/// draws must not block on it: let another thread or task wait, or look at [`Convergence::has_ended`] in each
/// frame. Once it has ended it stays so, whatever the view wants later.
#[derive(Clone, Debug)]
pub struct Convergence {
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    inner: Mutex<Inner>,
}

#[derive(Debug, Default)]
struct Inner {
    /// There when it is over: whether the view has converged.
    outcome: Option<bool>,
    wakers: Vec<Waker>,
}

impl Shared {
    /// What is locked is whole at any moment, so a panic elsewhere does it no harm.
    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn end(&self, outcome: bool) {
        let wakers = {
            let mut inner = self.inner();
            inner.outcome = inner.outcome.or(Some(outcome));
            std::mem::take(&mut inner.wakers)
        };
        wakers.into_iter().for_each(Waker::wake);
    }
}

impl Convergence {
    /// Returns true if the view has converged, or will not any more.
    pub fn has_ended(&self) -> bool {
        self.shared.inner().outcome.is_some()
    }
}

impl Future for Convergence {
    type Output = bool;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<bool> {
        let mut inner = self.shared.inner();
        if let Some(outcome) = inner.outcome {
            return Poll::Ready(outcome);
        }
        if !inner.wakers.iter().any(|waker| waker.will_wake(context.waker())) {
            inner.wakers.push(context.waker().clone());
        }
        Poll::Pending
    }
}

/// The views that somebody may still wait for.
#[derive(Debug, Default)]
pub(super) struct OpenConvergences(Vec<(ViewId, Weak<Shared>)>);

impl OpenConvergences {
    pub(super) fn open(&mut self, view: ViewId) -> Convergence {
        let shared = Arc::new(Shared::default());
        self.0.push((view, Arc::downgrade(&shared)));
        Convergence { shared }
    }

    /// Ends those of views of which `outcome` knows one.
    pub(super) fn follow(&mut self, outcome: impl Fn(ViewId) -> Option<bool>) {
        self.0.retain(|(view, shared)| {
            let Some(shared) = shared.upgrade() else { return false };
            let outcome = outcome(*view);
            outcome.into_iter().for_each(|outcome| shared.end(outcome));
            outcome.is_none()
        });
    }
}

impl Drop for OpenConvergences {
    /// Nobody waits forever for what is gone.
    fn drop(&mut self) {
        self.follow(|_| Some(false));
    }
}
