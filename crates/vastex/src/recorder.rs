//! Records what views want, as a trace that can be replayed under any policy.

use std::sync::Arc;

use vastex_core::{Description, Feedback, PageId, Pagers, TextureId, Trace, TraceRecordError, WantedPage};

use crate::error::Error;
use crate::textures::{TextureState, Textures};

/// A trace in the making. Feedback is recorded as the pagers take it in, whatever they decide.
#[derive(Debug, Default)]
pub(crate) struct Recorder {
    trace: Trace,
    /// By number, the texture seen last under it, and its number in the trace: numbers are given out again, there they are not.
    known: Vec<Option<(Arc<Description>, TextureId)>>,
    failed: Option<TraceRecordError>,
}

impl Recorder {
    /// Adds what the views of a frame want together; `textures` are all there are, by number.
    pub(crate) fn note(&mut self, views: &[Feedback], pagers: &Pagers, textures: &[Option<TextureState>]) {
        if self.failed.is_none() {
            self.failed = self.add(views, pagers, textures).err();
        }
    }

    fn add(
        &mut self,
        views: &[Feedback],
        pagers: &Pagers,
        textures: &[Option<TextureState>],
    ) -> Result<(), TraceRecordError> {
        self.known.resize(textures.len(), None);
        for (known, texture) in self.known.iter_mut().zip(textures) {
            let Some(TextureState { description, .. }) = texture else { continue };
            if !known.as_ref().is_some_and(|(known, _)| Arc::ptr_eq(known, description)) {
                let number = self.trace.add_texture(description.geometry.clone())?;
                *known = Some((description.clone(), number));
            }
        }
        let pages = pagers.pages_of(views);
        let mut pages: Vec<WantedPage> = pages.into_iter().filter_map(|page| self.renumbered(page)).collect();
        pages.sort_unstable();
        self.trace.add_frame(pages)
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
    fn finish(self) -> Result<Trace, TraceRecordError> {
        match self.failed {
            None => Ok(self.trace),
            Some(error) => Err(error),
        }
    }
}

impl Textures {
    /// Begins a trace: from now on what each feedback wants is kept. A trace that was under way is dropped.
    pub fn record_trace(&mut self) {
        self.recorder = Some(Recorder::default());
    }

    /// The trace since [`Textures::record_trace`], which ends it; nothing where none was begun.
    pub fn take_trace(&mut self) -> Result<Option<Trace>, Error> {
        Ok(self.recorder.take().map(Recorder::finish).transpose()?)
    }
}
