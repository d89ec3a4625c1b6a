//! What a frame asks of the pager: nothing here can fail.

use vastex_core::{Event, Feedback, PoolId, TableChange, Upload};

use super::Paging;

impl Paging {
    pub(crate) fn begin_frame(&mut self) {
        self.pager.begin_frame(self.frame);
        self.ram.begin_frame();
        self.follow_tickets();
    }

    pub(crate) fn end_frame(&mut self) {
        self.frame += 1;
    }

    /// What a view wants in this frame, as the application says it; said again before the frame is played,
    /// the last counts.
    pub(crate) fn ingest(&mut self, feedback: Feedback) {
        self.reported.retain(|reported| reported.view != feedback.view);
        self.reported.push(Feedback { frame: self.frame, ..feedback });
    }

    /// Adds what was said to what has arrived.
    pub(crate) fn take_reported(&mut self, arrived: &mut Vec<Feedback>) {
        arrived.append(&mut self.reported);
    }

    /// What all views wanted in a frame.
    pub(crate) fn observe(&mut self, views: &[Feedback]) {
        self.pager.observe_views(views);
    }

    pub(crate) fn feedback_under_way(&mut self, oldest: Option<u64>) {
        self.pager.feedback_under_way(oldest);
    }

    pub(crate) fn expect(&mut self, feedback: &Feedback) {
        self.pager.expect(feedback);
    }

    pub(crate) fn poll_upload(&mut self) -> Option<(PoolId, Upload)> {
        let (pool, upload) = self.pager.poll_upload()?;
        let number = usize::from(upload.page.texture().number());
        if let Some(Some(state)) = self.textures.get_mut(number)
            && upload.page.level() >= state.description.geometry.tail().first_level()
        {
            state.tail = upload.bytes.clone();
        }
        Some((pool, upload))
    }

    pub(crate) fn take_table_changes(&mut self, changes: &mut Vec<TableChange>) {
        self.pager.take_table_changes(changes);
    }

    /// The next event. That the pager has converged is told when all views have been seen whole, too.
    pub(crate) fn poll_event(&mut self, is_seen_whole: bool) -> Option<Event> {
        loop {
            self.converged.take_if(|_| !self.pager.is_converged());
            if self.converged.is_some() && is_seen_whole {
                return self.converged.take();
            }
            match self.pager.poll_event()? {
                // Some pixels have not been looked at: their feedback was lost.
                event @ Event::Converged { .. } if !is_seen_whole => self.converged = Some(event),
                event => return Some(event),
            }
        }
    }

    pub(crate) fn report(&mut self, event: Event) {
        self.pager.report(event);
    }
}
