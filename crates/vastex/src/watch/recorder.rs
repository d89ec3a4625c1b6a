//! Records what views want, as a trace that can be replayed under any policy.

use std::collections::VecDeque;
use std::sync::Arc;

use vastex_core::{
    CameraPosition, Description, Feedback, PageId, Pager, TextureNumber, Trace, TraceRecordError, WantedPage,
};

use crate::error::Error;

/// A trace in the making. Feedback is recorded as the pager takes it in, whatever that decides.
#[derive(Debug, Default)]
pub(super) struct Recorder {
    trace: Trace,
    /// By number, the texture seen last under it, and its number in the trace: numbers are given out again,
    /// there they are not.
    known: Vec<Option<(Arc<Description>, TextureNumber)>>,
    failed: Option<TraceRecordError>,
    /// What was wanted last, apart from gaps.
    last: Vec<WantedPage>,
}

/// Where the camera was in the last frames, as far as the application said so: feedback comes later.
#[derive(Debug, Default)]
pub(super) struct Places(VecDeque<(u64, CameraPosition)>);

impl Places {
    /// Frames that feedback may be late by.
    const FRAMES: u64 = 64;

    pub(super) fn note(&mut self, frame: u64, place: CameraPosition) {
        self.0.retain(|&(of, _)| of != frame && of + Self::FRAMES > frame);
        self.0.push_back((frame, place));
    }

    fn of(&self, frame: u64) -> Option<CameraPosition> {
        self.0.iter().find(|(of, _)| *of == frame).map(|&(_, place)| place)
    }
}

impl Recorder {
    /// Adds what the views of a frame want together; `textures` are all there are.
    pub(super) fn note(
        &mut self,
        views: &[Feedback],
        places: &Places,
        pager: &Pager,
        textures: &[(TextureNumber, &Arc<Description>)],
    ) {
        if self.failed.is_none() {
            let place = views.first().and_then(|feedback| places.of(feedback.frame));
            self.failed = self.add(views, place, pager, textures).err();
        }
    }

    fn add(
        &mut self,
        views: &[Feedback],
        place: Option<CameraPosition>,
        pager: &Pager,
        textures: &[(TextureNumber, &Arc<Description>)],
    ) -> Result<(), TraceRecordError> {
        for (id, description) in textures.iter().copied() {
            let number = usize::from(id.number());
            self.known.resize(self.known.len().max(number + 1), None);
            let known = &mut self.known[number];
            if !known.as_ref().is_some_and(|(known, _)| Arc::ptr_eq(known, description)) {
                let number = self.trace.add_texture(description.geometry.clone())?;
                *known = Some((description.clone(), number));
            }
        }
        let pages = pager.pages_of(views);
        let mut pages: Vec<WantedPage> = pages.into_iter().filter_map(|page| self.renumbered(page)).collect();
        // A view that looks for gaps wants what it wanted before as well: a trace has all of it.
        if views.iter().all(|feedback| feedback.gaps) {
            pages.extend(
                self.last
                    .iter()
                    .filter(|wanted| pages.iter().all(|page| page.page != wanted.page))
                    .copied()
                    .collect::<Vec<_>>(),
            );
        } else {
            self.last.clone_from(&pages);
        }
        pages.sort_unstable();
        match place {
            Some(place) => self.trace.add_frame_at(pages, place),
            None => self.trace.add_frame(pages),
        }
    }

    /// The page under its texture's number in the trace.
    fn renumbered(&self, wanted: WantedPage) -> Option<WantedPage> {
        let known = self.known.get(usize::from(wanted.page.texture().number()))?.as_ref();
        let (description, number) = known?;
        let dims = description.geometry.dims();
        let page = PageId::new(*number, dims, wanted.page.pos(dims)).ok()?;
        Some(WantedPage { page, ..wanted })
    }

    /// The trace, or why it could not go on.
    pub(super) fn finish(self) -> Result<Trace, Error> {
        match self.failed {
            None => Ok(self.trace),
            Some(error) => Err(error.into()),
        }
    }
}
