//! Where panes lie in a picture, in which layers are seen side by side ([`super::CompareMode::Beside`]).

use glam::DVec2;

/// Where a picture's panes are: side by side, all of one width.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Panes {
    /// How many there are, at least one.
    pub count: u32,
    /// Columns of the picture to the left of the first one.
    pub left: u32,
    /// The width of each, in physical pixels.
    pub width: u32,
    /// Columns of the picture.
    pub whole: u32,
}

impl Panes {
    /// Columns that a pane has at least where panes lie beside panels.
    const LEAST: u32 = 64;

    /// So many panes in a picture of so many columns, of which no panel covers those between `free`: several
    /// share these, unless that would leave each too little. A single pane is all of the picture.
    pub fn sharing(count: u32, whole: u32, free: [f64; 2]) -> Panes {
        let count = count.max(1);
        let [first, end] =
            [free[0].ceil(), free[1].floor()].map(|column| column.clamp(0.0, whole.into()) as u32);
        let width = end.saturating_sub(first) / count;
        match count > 1 && width >= Panes::LEAST {
            true => Panes { count, left: first, width, whole },
            false => Panes { count, left: 0, width: (whole / count).max(1), whole },
        }
    }

    /// How many widths of a pane a pixel of the picture lies to the right of the first one's left edge.
    pub fn across(&self, pixel: DVec2) -> f64 {
        (pixel.x - f64::from(self.left)) / f64::from(self.width.max(1))
    }

    /// The pane in which a pixel of the picture lies, the first or the last where it lies in none.
    pub fn at(&self, pixel: DVec2) -> u32 {
        self.across(pixel).floor().clamp(0.0, f64::from(self.count.max(1) - 1)) as u32
    }

    /// The column of the picture that is the first one of a pane.
    pub fn first(&self, pane: u32) -> u32 {
        self.left.saturating_add(pane.saturating_mul(self.width))
    }

    /// A pixel of the picture as one of a pane, from the pane's own corner.
    pub fn within(&self, pane: u32, pixel: DVec2) -> DVec2 {
        pixel - DVec2::new(self.first(pane).into(), 0.0)
    }

    /// How many times as wide as a pane the picture is.
    pub fn stretch(&self) -> f64 {
        f64::from(self.whole) / f64::from(self.width.max(1))
    }

    /// A pixel of a pane where feedback has it, which has one pane, as wide as all of the picture.
    pub fn stretched(&self, within: DVec2) -> DVec2 {
        DVec2::new(within.x * self.stretch(), within.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_lies_in_one_pane_at_the_place_that_it_has_in_all() {
        let panes = Panes { count: 3, left: 40, width: 100, whole: 400 };
        for (x, pane, within) in
            [(0.0, 0, 0.0), (99.5, 0, 99.5), (100.0, 1, 0.0), (250.0, 2, 50.0), (301.0, 2, 101.0)]
        {
            let pixel = DVec2::new(40.0 + x, 7.0);
            assert_eq!(panes.at(pixel), pane);
            assert_eq!(panes.within(pane, pixel), DVec2::new(within, 7.0));
        }
        assert_eq!(panes.at(DVec2::new(-5.0, 0.0)), 0);
        assert_eq!(panes.stretched(DVec2::new(25.0, 7.0)), DVec2::new(100.0, 7.0));
    }

    #[test]
    fn panes_share_what_panels_leave_free() {
        let told = |panes: Panes| [panes.count, panes.left, panes.width, panes.whole];
        for (count, free, expected) in [
            (1, [348.0, 960.0], [1, 0, 1280, 1280]),
            (2, [0.0, 1280.0], [2, 0, 640, 1280]),
            (2, [348.0, 960.0], [2, 348, 306, 1280]),
            (3, [347.4, 960.6], [3, 348, 204, 1280]),
            // What is left is too narrow for either, or is nothing at all.
            (2, [700.0, 820.0], [2, 0, 640, 1280]),
            (2, [900.0, 300.0], [2, 0, 640, 1280]),
            (2, [f64::NAN, f64::NAN], [2, 0, 640, 1280]),
        ] {
            assert_eq!(told(Panes::sharing(count, 1280, free)), expected, "{count} in {free:?}");
        }
        assert_eq!(told(Panes::sharing(3, 2, [0.0, 2.0])), [3, 0, 1, 2]);
    }
}
