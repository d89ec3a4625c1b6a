//! The picture of one pane: drawn small while what is seen changes, and at its full size, a part at a time,
//! when it stays. So no frame takes long, however slow the device.

use crate::gpu::Gpu;
use crate::stage::{Canvas, StageScene, TargetKind};
use crate::volume::{StillStep, VolumeCameraBinding, VolumeRenderer, VolumeStill, VolumeView};

use super::portion::{Portion, Took};
use super::sight::PaneSight;

/// The format of the pictures, for whoever paints them: display values.
pub const PICTURE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Of how many pictures that of a camera that rests is the mean, and how many seconds these may take.
pub(super) const PASSES: u32 = 16;
const STILL_SECONDS: f64 = 3.0;
/// Pictures whose mean is worth that, at least.
const FEWEST_PASSES: u32 = 4;

/// What a picture follows from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Key {
    /// What is seen.
    pub(super) view: VolumeView,
    /// How it is shown: a number that changes with it.
    pub(super) look: u64,
    /// Which bricks there are: another number.
    pub(super) content: u64,
}

impl Key {
    fn is_of_same_view(&self, other: &Key) -> bool {
        self.view == other.view && self.look == other.look
    }
}

/// The picture of a pane.
#[derive(Debug)]
pub(super) struct PanePicture {
    full: Canvas,
    /// The small one, and how many times smaller it is.
    small: Option<(Canvas, u32)>,
    /// What is in the full one, whole; and what is being drawn into it, up to which row.
    drawn: Option<Key>,
    drawing: Option<(Key, u32)>,
    /// What is in the small one, if that is what is to be seen.
    seen_small: Option<Key>,
    /// How much of it is drawn at once, and how many rows of the full one were last.
    portion: Portion,
    rows: u32,
    /// What it is drawn through, and the number of the renderer that this is of.
    camera: (u64, VolumeCameraBinding),
    /// The mean of several pictures of what is in the full one, what it is of, and how many seconds it took.
    still: Option<VolumeStill>,
    still_of: Option<Key>,
    still_seconds: f64,
    is_still_under_way: bool,
    /// What is seen as well as it can be.
    rested: Option<Key>,
}

impl PanePicture {
    /// For a pane of so many pixels.
    pub(super) fn new(gpu: &Gpu, camera: (u64, VolumeCameraBinding), size: [u32; 2]) -> PanePicture {
        PanePicture {
            full: Canvas::new(gpu, size, PICTURE, TargetKind::Direct),
            small: None,
            drawn: None,
            drawing: None,
            seen_small: None,
            portion: Portion::new(gpu.is_processor()),
            rows: 0,
            camera,
            still: None,
            still_of: None,
            still_seconds: 0.0,
            is_still_under_way: false,
            rested: None,
        }
    }

    /// The picture is drawn by the renderer of this number from here on, through a camera of that.
    pub(super) fn see_through(&mut self, of: u64, camera: impl FnOnce() -> VolumeCameraBinding) {
        if self.camera.0 != of {
            self.camera = (of, camera());
            self.begin_mean_anew();
        }
    }

    /// Of another size from here on.
    pub(super) fn resize(&mut self, gpu: &Gpu, size: [u32; 2]) {
        if self.full.size() != size {
            self.full = Canvas::new(gpu, size, PICTURE, TargetKind::Direct);
            (self.small, self.drawn, self.drawing, self.seen_small) = (None, None, None, None);
            self.begin_mean_anew();
        }
    }

    /// A single picture is in the full one, also where a mean of the same view was there before.
    fn begin_mean_anew(&mut self) {
        (self.still, self.still_of, self.rested) = (None, None, None);
    }

    /// What is to be painted, over the whole of the pane.
    pub(super) fn seen(&self) -> &wgpu::Texture {
        match (&self.small, self.seen_small) {
            (Some((small, _)), Some(_)) => small.picture(),
            _ => self.full.picture(),
        }
    }

    /// Returns true if it is the whole picture of this.
    pub(super) fn is_of(&self, key: &Key) -> bool {
        self.seen_small.is_none() && self.drawn == Some(*key)
    }

    /// Returns true if anything of the same view is seen, however old its bricks.
    pub(super) fn is_of_view(&self, key: &Key) -> bool {
        let seen = self.seen_small.or(self.drawn);
        seen.is_some_and(|seen| seen.is_of_same_view(key))
    }

    /// Takes in how many seconds took what was drawn last: the small picture, or rows of the full one; and
    /// true if the device was seen at work on it.
    pub(super) fn took(&mut self, seconds: f64, was_small: bool, was_waited_for: bool) {
        if std::mem::take(&mut self.is_still_under_way) {
            self.still_seconds += seconds;
        }
        let rows = if was_small { None } else { Some(self.rows) };
        self.portion.took(Took { seconds, rows, was_waited_for }, self.full.size());
    }

    /// Draws black, where there is nothing to be seen.
    pub(super) fn clear(&mut self, encoder: &mut wgpu::CommandEncoder, key: Key) {
        drop(self.full.target().begin(encoder, glam::Vec4::W));
        self.begin_mean_anew();
        (self.drawn, self.drawing, self.seen_small) = (Some(key), None, None);
    }

    /// Draws what is due: at once and small where another view is seen, else the next part of the whole.
    /// Gives back whether it was the small one; `None` if there was nothing to draw.
    pub(super) fn draw(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        (renderer, textures): (&VolumeRenderer, &vastex::Textures),
        (sight, key): (&PaneSight, Key),
        is_whole_asked: bool,
    ) -> Option<bool> {
        if self.is_of(&key) {
            return None;
        }
        let group = textures.bind_group(renderer.sampled()).ok()?;
        let is_new = !self.is_of_view(&key);
        let times = self.portion.times();
        if is_new && times > 1 && !is_whole_asked {
            let size = sight.smaller(times);
            if self.small.as_ref().is_none_or(|(small, _)| small.size() != size) {
                self.small = Some((Canvas::new(gpu, size, PICTURE, TargetKind::Direct), times));
            }
            let (small, times) = self.small.as_ref()?;
            renderer.place(&self.camera.1, &gpu.queue, textures, &sight.view(*times), size);
            renderer.draw_rows(&self.camera.1, encoder, group, &small.target(), (size, 0..size[1]));
            (self.seen_small, self.drawing) = (Some(key), None);
            return Some(true);
        }
        let size = self.full.size();
        let (key, from) = match self.drawing {
            // What has come meanwhile is drawn after it.
            Some((begun, row)) if begun.is_of_same_view(&key) => (begun, row),
            _ => (key, 0),
        };
        let rows = if is_whole_asked { size[1] } else { self.portion.rows(size) };
        let to = from.saturating_add(rows).min(size[1]);
        self.rows = to - from;
        renderer.place(&self.camera.1, &gpu.queue, textures, &sight.view(1), size);
        renderer.draw_rows(&self.camera.1, encoder, group, &self.full.target(), (size, from..to));
        self.begin_mean_anew();
        match to == size[1] {
            true => (self.drawn, self.drawing, self.seen_small) = (Some(key), None, None),
            false => {
                self.drawing = Some((key, to));
                if self.seen_small.is_none() {
                    self.drawn = self.drawn.filter(|drawn| drawn.is_of_same_view(&key));
                }
            }
        }
        Some(false)
    }

    /// Of how many pictures what is seen is the mean.
    pub(super) fn passes(&self) -> u32 {
        let is_seen = self.still_of.is_some() && self.still_of == self.drawn;
        self.still.as_ref().filter(|_| is_seen).map_or(1, |still| still.passes().max(1))
    }

    /// Returns true if nothing makes the picture of this better, as far as it is whole.
    pub(super) fn is_rested(&self, renderer: &VolumeRenderer, key: &Key) -> bool {
        !self.is_of(key) || self.rested == Some(*key) || !renderer.is_better_still(&key.view)
    }

    /// Draws the next part of one more picture of what stays as it is, whose samples lie elsewhere, for the
    /// mean of all. Gives back whether there is anything new to be seen; `None` if there was nothing to draw.
    pub(super) fn go_on(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (renderer, textures): (&VolumeRenderer, &vastex::Textures),
        (sight, key): (&PaneSight, Key),
    ) -> Option<bool> {
        if self.is_rested(renderer, &key) {
            return None;
        }
        // The first part does not count: shaders may have to be compiled for it.
        let is_first = self.still_of != Some(key);
        if is_first {
            (self.still_of, self.still_seconds) = (Some(key), 0.0);
        }
        let size = self.full.size();
        let rows = self.portion.rows(size);
        self.rows = rows;
        let still = self.still.get_or_insert_with(|| renderer.new_still(size));
        // A slow device has more than one part of a picture to show for its time, or nothing.
        let passes = still.passes();
        let share = f64::from(FEWEST_PASSES) / f64::from(passes.clamp(1, FEWEST_PASSES));
        if passes > 0 && self.still_seconds * share > STILL_SECONDS {
            self.rested = Some(key);
            let is_shown = passes >= FEWEST_PASSES;
            if is_shown {
                renderer.draw_mean(still, encoder, &self.full.target());
            }
            return Some(is_shown);
        }
        let of = (&sight.view(1), key.content);
        let step = renderer.go_on(still, encoder, (&self.camera.1, textures), of, rows);
        let is_shown = step == StillStep::Shows;
        if is_shown {
            renderer.draw_mean(still, encoder, &self.full.target());
        }
        if still.passes() >= renderer.desc().passes || step == StillStep::Rests {
            self.rested = Some(key);
        }
        let has_drawn = step != StillStep::Rests;
        self.is_still_under_way = has_drawn && !is_first;
        has_drawn.then_some(is_shown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::VolumeFace;

    #[test]
    fn a_view_is_the_same_whatever_has_come_of_it() {
        let key = Key { view: VolumeView::Face(VolumeFace::PlusZ), look: 1, content: 1 };
        assert!(key.is_of_same_view(&Key { content: 9, ..key }));
        assert!(!key.is_of_same_view(&Key { look: 2, ..key }));
        assert!(!key.is_of_same_view(&Key { view: VolumeView::Face(VolumeFace::MinusX), ..key }));
    }
}
