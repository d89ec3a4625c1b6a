//! Measuring in the picture: what clicks and keys do to the line that is measured.

use glam::DVec2;

use super::SurfaceScene;
use crate::camera::Pose;
use crate::panels::Measure;

impl SurfaceScene {
    /// Returns true if clicks set points to be measured.
    pub fn is_measuring(&self) -> bool {
        self.beside.panel.measure.is_some()
    }

    /// Begins to measure where `pose` is that of an image, or ends it.
    pub fn measure_or_not(&mut self, pose: Pose) {
        if !self.is_measuring() && !matches!(pose, Pose::Image { .. }) {
            self.beside.notify("lengths are measured in an image; F1 shows it as one");
            return;
        }
        self.beside.panel.measure = if self.is_measuring() { None } else { Some(Measure::default()) };
        if self.is_measuring() {
            self.beside.notify("measure: a click sets a point, a double click closes the line");
        }
        self.beside.refresh();
    }

    /// Ends measuring. Returns true if anything was measured.
    pub fn end_measuring(&mut self) -> bool {
        self.beside.panel.measure.take().is_some()
    }

    /// Sets a point at a pixel of an image, if points are set, or at the nearest place of the image.
    pub fn measure_to(&mut self, pixel: DVec2, pose: Pose) {
        let image = self.image_size();
        let placed = pose.placement(self.size(), image);
        if let (Some(measure), Some(placed)) = (&mut self.beside.panel.measure, placed) {
            measure.add(placed.texel(pixel).clamp(DVec2::ZERO, DVec2::from(image.map(f64::from))));
            self.beside.refresh();
        }
    }

    /// Closes the line that is measured.
    pub fn close_measured(&mut self) {
        self.beside.panel.measure.iter_mut().for_each(Measure::close);
        self.beside.refresh();
    }

    /// Takes back what was done last to the line that is measured.
    pub fn undo_measured(&mut self) {
        if self.beside.panel.measure.as_mut().is_some_and(Measure::undo) {
            self.beside.refresh();
        }
    }
}
