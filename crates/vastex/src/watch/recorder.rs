//! Records what views want, as a trace that can be replayed under any policy.

use std::collections::VecDeque;
use std::sync::Arc;

use vastex_core::shader_constants::JITTER_CYCLE;
use vastex_core::{
    CameraPosition, Description, Feedback, PageId, Pager, TextureNumber, Trace, TraceRecordError, ViewId,
    WantedPage,
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
    /// What each view of rays wants while it looks for gaps, beside these.
    at_rest: Vec<(ViewId, AtRest)>,
}

/// What a view wanted before it came to look for gaps, by its numbers in the trace, and what it has named
/// since.
#[derive(Debug, Default)]
struct AtRest {
    /// Feedbacks of its last jitter cycle, the next one that is repeated first.
    cycle: VecDeque<Vec<WantedPage>>,
    gaps: Vec<WantedPage>,
}

impl AtRest {
    /// A feedback of the cycle names pages.
    fn note_cycle(&mut self, pages: &[WantedPage]) {
        self.gaps.clear();
        self.cycle.push_back(pages.to_vec());
        if self.cycle.len() > JITTER_CYCLE as usize {
            self.cycle.pop_front();
        }
    }

    /// A feedback of gaps names pages. Gives what the view wants in that frame: what it wanted in one of the
    /// cycle, each in turn, and all gaps that it has found. Pages for which `stays` says no are left out.
    fn note_gaps(&mut self, pages: &[WantedPage], stays: impl Fn(&WantedPage) -> bool) -> Vec<WantedPage> {
        let is_new = |page: &&WantedPage| self.gaps.iter().all(|known| known.page != page.page);
        let new: Vec<WantedPage> = pages.iter().filter(is_new).copied().collect();
        self.gaps.extend(new);
        let again = self.cycle.pop_front().unwrap_or_default();
        let wanted = again.iter().chain(&self.gaps).filter(|wanted| stays(wanted)).copied().collect();
        self.cycle.push_back(again);
        wanted
    }
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
        let mut pages = Vec::new();
        for feedback in views {
            let named = pager.pages_of(std::slice::from_ref(feedback));
            let named: Vec<WantedPage> = named.into_iter().filter_map(|page| self.renumbered(page)).collect();
            pages.extend(self.with_what_stays(feedback, named, textures));
        }
        // What several views want is one entry.
        let Feedback { pages, .. } = Feedback::of_pages(0, pages);
        match place {
            Some(place) => self.trace.add_frame_at(pages, place),
            None => self.trace.add_frame(pages),
        }
    }

    /// What a view wants that has named these pages: one that looks for gaps names what is not there, and
    /// wants what it wanted before as well.
    fn with_what_stays(
        &mut self,
        feedback: &Feedback,
        named: Vec<WantedPage>,
        textures: &[(TextureNumber, &Arc<Description>)],
    ) -> Vec<WantedPage> {
        let place = self.at_rest.iter().position(|(view, _)| *view == feedback.view);
        let place = place.unwrap_or_else(|| {
            self.at_rest.push((feedback.view, AtRest::default()));
            self.at_rest.len() - 1
        });
        let Recorder { at_rest, known, .. } = self;
        let at_rest = &mut at_rest[place].1;
        if !feedback.gaps {
            at_rest.note_cycle(&named);
            return named;
        }
        // Of textures that were removed nothing is wanted any more.
        let is_there = |wanted: &WantedPage| {
            textures.iter().any(|(id, _)| {
                let known = known.get(usize::from(id.number())).and_then(Option::as_ref);
                known.is_some_and(|(_, number)| *number == wanted.page.texture())
            })
        };
        at_rest.note_gaps(&named, is_there)
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

#[cfg(test)]
mod tests {
    use vastex_core::{
        BiasRule, Budgets, Dims, Geometry, GeometrySpec, LayerFormat, PagePos, Policy, PoolSize,
        ReplaySettings, replay,
    };

    use super::*;

    /// A pager of an image and a volume, each in a pool of its own, and a view of rays beside the main one.
    fn world() -> (Pager, Vec<Arc<Description>>, ViewId) {
        let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 1000, in_flight_bytes: 1000 });
        let specs = [GeometrySpec::image(4096, 4096), GeometrySpec::volume([2048; 3])];
        let descriptions = specs.map(|spec| {
            let geometry = Geometry::new(spec).unwrap();
            let pool = pager.add_pool(100, 1, Some(BiasRule::Solved)).unwrap();
            pager.add_texture(pool, &geometry, None, None).unwrap();
            Arc::new(Description::one_layer(geometry, LayerFormat::R8))
        });
        let rays = pager.add_view(1.0).unwrap();
        (pager, descriptions.to_vec(), rays)
    }

    fn pages(texture: u16, dims: Dims, at: impl IntoIterator<Item = u32>) -> Vec<WantedPage> {
        let number = TextureNumber::new(texture).unwrap();
        let page = |x| PageId::new(number, dims, PagePos { level: 0, x, y: 0, z: 0 }).unwrap();
        at.into_iter().map(|x| WantedPage { page: page(x), pixels: 3, eighth: 0 }).collect()
    }

    /// A view of rays that rests beside a view of surfaces that goes on: each frame of the trace has what
    /// both want, and gaps stay wanted until the view moves.
    #[test]
    fn rays_and_surfaces_of_one_frame_are_both_recorded() {
        let (pager, descriptions, rays) = world();
        let textures: Vec<(TextureNumber, &Arc<Description>)> = (0..)
            .zip(&descriptions)
            .map(|(number, description)| (TextureNumber::new(number).unwrap(), description))
            .collect();
        let mut recorder = Recorder::default();
        let cycle = u64::from(JITTER_CYCLE);
        let bricks = |at: Vec<u32>| pages(1, Dims::D3, at);
        let mut note = |frame: u64, wanted: Vec<WantedPage>, gaps: bool| {
            let surface = pages(0, Dims::D2, [(frame % 4) as u32]);
            let views = [
                Feedback::of_pages(frame, surface),
                Feedback { view: rays, gaps, ..Feedback::of_pages(frame, wanted) },
            ];
            recorder.note(&views, &Places::default(), &pager, &textures);
        };
        (0..cycle).for_each(|frame| note(frame, bricks(vec![(frame % 3) as u32]), false));
        note(cycle, bricks(vec![5]), true);
        (1..2 * cycle).for_each(|frame| note(cycle + frame, bricks(vec![]), true));
        note(3 * cycle, bricks(vec![6]), false);
        let trace = recorder.finish().unwrap();
        let frames = trace.frames();
        assert_eq!(frames.len() as u64, 3 * cycle + 1);
        let of = |frame: &[WantedPage], texture: u16| -> Vec<u32> {
            let is_of = |wanted: &&WantedPage| wanted.page.texture().number() == texture;
            let dims = if texture == 0 { Dims::D2 } else { Dims::D3 };
            frame.iter().filter(is_of).map(|wanted| wanted.page.pos(dims).x).collect()
        };
        for (nth, frame) in (0..).zip(frames) {
            assert_eq!(of(frame, 0), [nth % 4], "the surface in frame {nth}");
            let brick = (u64::from(nth) % cycle % 3) as u32;
            let expected = match u64::from(nth) {
                n if n < cycle => vec![brick],
                n if n < 3 * cycle => vec![brick, 5],
                _ => vec![6],
            };
            assert_eq!(of(frame, 1), expected, "the rays in frame {nth}");
        }
        // A replay loads what both want, and nothing twice where there is room.
        let settings = ReplaySettings::new(Policy::Lru, PoolSize::Share(2.0));
        let replayed = replay(&trace, &settings).unwrap();
        assert!(replayed.loads >= 9 && replayed.reloads == 0, "{replayed:?}");
    }
}
