//! Feedback without a GPU: what a view wants, from where each of its pixels lies on a texture.
//!
//! The sample positions and the arithmetic are those of the feedback pass; only the surface is asked for
//! instead of drawn. For traces, which a test makes without a device, and for what looks ahead.

use vastex_core::{
    AddressMode, Feedback, FeedbackCompactor, Geometry, HashedTextureTable, Slot, TextureNumber,
};
use vastex_wgpu::twins::Texture;
use vastex_wgpu::{FeedbackScale, FeedbackView, Filter};

/// Finds on the CPU what views of a texture want of which nothing but the tail is resident.
#[derive(Debug)]
pub struct CpuFeedback {
    geometry: Geometry,
    number: TextureNumber,
    filter: Filter,
    table: HashedTextureTable,
    compactor: FeedbackCompactor,
    /// uv of the target's pixels and one more row and column; `None` if a pixel shows no surface.
    places: Vec<Option<[f32; 2]>>,
    pixels: Vec<[u32; 4]>,
}

impl CpuFeedback {
    /// For a texture with this number, drawn by a trilinear filter.
    pub fn new(geometry: &Geometry, number: TextureNumber) -> CpuFeedback {
        CpuFeedback {
            geometry: geometry.clone(),
            number,
            filter: Filter::default(),
            table: HashedTextureTable::new(geometry, number, Slot::new(0)),
            compactor: FeedbackCompactor::new(),
            places: Vec::new(),
            pixels: Vec::new(),
        }
    }

    /// This feedback for a texture drawn by another filter; an anisotropic one wants finer levels.
    pub fn with_filter(self, filter: Filter) -> CpuFeedback {
        CpuFeedback { filter, ..self }
    }

    /// What a picture of so many pixels wants in a frame. `uv` says where a point of the picture, in pixels
    /// from its top left, lies on the surface; `None` if it shows none. Beyond 0 to 1 the surface goes on
    /// without the texture: what lies there is not wanted, but tells its neighbours their derivatives, as it
    /// does on a GPU.
    pub fn of_view(
        &mut self,
        picture: [u32; 2],
        frame: u64,
        uv: impl Fn([f32; 2]) -> Option<[f32; 2]>,
    ) -> Feedback {
        let view = FeedbackView::new(picture, FeedbackScale::Reduced, frame);
        let (block, jitter, covered) = (FeedbackScale::Reduced.block(), view.jitter(), view.covered());
        // Derivatives are taken within blocks of 2x2 pixels, so the last may need a neighbour beyond the
        // picture.
        let stride = covered[0] as usize + 1;
        self.places.clear();
        for y in 0..=covered[1] {
            let at = |x: u32| [(block * x + jitter[0]) as f32 + 0.5, (block * y + jitter[1]) as f32 + 0.5];
            self.places.extend((0..=covered[0]).map(|x| uv(at(x))));
        }
        let mut texture = Texture::new(&self.geometry, &self.table, self.number);
        texture.filter = self.filter;
        texture.level_offset = -(block.ilog2() as f32);
        self.pixels.clear();
        for y in 0..covered[1] as usize {
            for x in 0..covered[0] as usize {
                let place = |x: usize, y: usize| self.places[y * stride + x];
                let is_covered = |uv: &[f32; 2]| uv.iter().all(|uv| (0.0..1.0).contains(uv));
                let Some(here) = place(x, y).filter(is_covered) else { continue };
                let (beside, below) = (place(x ^ 1, y), place(x, y ^ 1));
                let [ddx, ddy] = [beside, below].map(|there| self.difference(here, there));
                self.pixels.push(texture.feedback_grad(here, ddx, ddy));
            }
        }
        let mut feedback = Feedback::default();
        self.compactor.compact(frame, &self.pixels, &mut feedback);
        feedback
    }

    /// The difference of uv between neighbours, but for its sign; none where there is no neighbour. Where the
    /// texture closes on itself they lie on the same side.
    fn difference(&self, here: [f32; 2], there: Option<[f32; 2]>) -> [f32; 2] {
        let Some(there) = there else { return [0.0; 2] };
        let address = self.geometry.address();
        std::array::from_fn(|axis| {
            let difference = there[axis] - here[axis];
            if address[axis] == AddressMode::Wrap { difference - difference.round() } else { difference }
        })
    }
}
