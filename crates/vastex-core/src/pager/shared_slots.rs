//! Missing pages of one content: one of them is loaded, the others wait and join it in its slot.

use crate::pager::event::Event;
use crate::pager::pool::Pager;
use crate::residency::PageState;

impl Pager {
    /// Of the missing pages of one content leaves the one in the order that is loaded, and none where the content is here.
    pub(crate) fn order_shared(&mut self) {
        if self.residency.sharing().is_empty() {
            return;
        }
        let Pager { order, waiting, residency, textures, .. } = self;
        order.retain_mut(|page| match residency.load_for(*page, textures) {
            Some(representative) if representative == *page => true,
            Some(representative) => {
                waiting.push(std::mem::replace(page, representative));
                true
            }
            None => {
                waiting.extend(Some(*page).filter(|&page| residency.state(page) == PageState::Queued));
                false
            }
        });
        self.emit_recovered();
    }

    /// Pages that wait for a tile which has come join it.
    pub(crate) fn join_waiting(&mut self) {
        let Pager { waiting, residency, textures, .. } = self;
        for &page in waiting.iter() {
            if residency.state(page) == PageState::Queued {
                residency.join(page, textures);
            }
        }
        self.emit_recovered();
        self.check();
    }

    pub(crate) fn emit_recovered(&mut self) {
        let pool = self.pool();
        for page in self.residency.drain_recovered() {
            self.events.push(Event::Recovered { pool, page });
        }
    }
}
