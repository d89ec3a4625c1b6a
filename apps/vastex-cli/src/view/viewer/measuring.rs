//! Measuring in the picture: what clicks and keys do to the line that is measured.

use glam::DVec2;
use vastex_scenes::Pose;
use vastex_viewer::panels::Measure;

use super::Viewer;

impl Viewer {
    /// Returns true if clicks set points to be measured.
    pub(in super::super) fn is_measuring(&self) -> bool {
        self.panel.measure.is_some()
    }

    /// Begins to measure where `pose` is that of an image, or ends it.
    pub(in super::super) fn measure_or_not(&mut self, pose: Pose) {
        if !self.is_measuring() && !matches!(pose, Pose::Image { .. }) {
            self.notify_in_title("lengths are measured in an image; F1 shows it as one");
            return;
        }
        self.panel.measure = if self.is_measuring() { None } else { Some(Measure::default()) };
        if self.is_measuring() {
            self.notify_in_title("measure: a click sets a point, a double click closes the line");
        }
        self.window.request_redraw();
    }

    /// Ends measuring. Returns true if anything was measured.
    pub(in super::super) fn end_measuring(&mut self) -> bool {
        self.panel.measure.take().is_some()
    }

    /// Sets a point at a pixel of an image, if points are set, or at the nearest place of the image.
    pub(in super::super) fn measure_to(&mut self, pixel: DVec2, pose: Pose) {
        let image = self.image_size();
        let placed = pose.placement(self.size(), image);
        if let (Some(measure), Some(placed)) = (&mut self.panel.measure, placed) {
            measure.add(placed.texel(pixel).clamp(DVec2::ZERO, DVec2::from(image.map(f64::from))));
            self.window.request_redraw();
        }
    }

    /// Closes the line that is measured.
    pub(in super::super) fn close_measured(&mut self) {
        self.panel.measure.iter_mut().for_each(Measure::close);
        self.window.request_redraw();
    }

    /// Takes back what was done last to the line that is measured.
    pub(in super::super) fn undo_measured(&mut self) {
        if self.panel.measure.as_mut().is_some_and(Measure::undo) {
            self.window.request_redraw();
        }
    }
}
