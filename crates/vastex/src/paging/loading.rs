//! The pager's decisions go to the loader, and the loader's results to the pager.

use vastex_tiles::{LoadError, Loaded};

use super::Paging;

impl Paging {
    /// Hands the loader's results to the pager, and the pager's decisions to the loader.
    pub(crate) fn exchange_with_loader(&mut self) {
        let pager = &mut self.pager;
        let mut arrived = |loaded: Loaded| match loaded.result {
            Ok(bytes) => pager.tile_ready(loaded.page, bytes),
            Err(LoadError::Cancelled) => pager.tile_cancelled(loaded.page),
            Err(error) => pager.tile_failed(loaded.page, error.to_string()),
        };
        match &mut self.lock_step {
            None => std::iter::from_fn(|| self.loader.poll()).for_each(&mut arrived),
            Some(lock_step) => {
                lock_step.due_loads(self.frame, &mut self.loader).into_iter().for_each(&mut arrived);
            }
        }
        self.send_cancels();
        while let Some(request) = self.pager.poll_rerank() {
            self.loader.rerank(request.page, request.rank);
        }
        while let Some(request) = self.pager.poll_request() {
            self.loader.request(request.page, request.rank);
            if let Some(lock_step) = &mut self.lock_step {
                lock_step.requested(request.page, self.frame);
            }
        }
    }

    /// Calls off the loads that are not worth finishing.
    pub(super) fn send_cancels(&mut self) {
        while let Some(page) = self.pager.poll_cancel() {
            match &mut self.lock_step {
                None => self.loader.cancel(page),
                Some(lock_step) => lock_step.cancel(page),
            }
        }
    }
}
