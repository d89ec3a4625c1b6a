//! A texture of a list whose rows are still coming: nothing is drawn of it where there are none yet.

use vastex::TextureId;

use super::Layers;

impl Layers {
    /// Draws of a texture whose rows are still coming the share of them that is there, 0 to 1, counted from
    /// the top, and nothing below, from the next frame on after [`crate::SceneRenderer::set_layers`].
    /// Nothing is compiled for it.
    pub fn grow(&mut self, growing: Option<(TextureId, f64)>) {
        self.growing = growing;
    }

    /// The texture whose rows are still coming, and the share of them that is there.
    pub fn growing(&self) -> Option<(TextureId, f64)> {
        self.growing
    }

    /// The share of its rows that a texture has, counted from the top: all of one that does not grow.
    pub fn rows_there(&self, texture: TextureId) -> f64 {
        self.growing.filter(|(growing, _)| *growing == texture).map_or(1.0, |(_, share)| share)
    }

    /// Where rows of a growing texture end, for shaders: in uv, and in rows of a surface of so many.
    pub(crate) fn growing_told(&self, rows: u32) -> [f32; 2] {
        let share = match self.is_single {
            true => self.rows_there(self.layers[0].layer.texture()),
            false => self.growing.map_or(1.0, |(_, share)| share),
        };
        if share < 1.0 { [share as f32, (share * f64::from(rows)) as f32] } else { [f32::MAX; 2] }
    }
}
