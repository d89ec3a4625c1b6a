//! Which part of panes no panel covers.

use glam::DVec2;

use super::Panes;

/// The corners of the part of a pane, in pixels from its top left, that is free in all panes of which
/// anything is seen: of a picture so high, of which `free` are the corners of what no panel covers. All of
/// the pane where too little would be left to show anything in.
pub fn free_in_panes(panes: &Panes, height: u32, [first, last]: [DVec2; 2]) -> [DVec2; 2] {
    const LEAST: f64 = 64.0;
    let whole = [DVec2::ZERO, DVec2::new(panes.width.into(), height.into())];
    let [mut low, mut high] = whole;
    for pane in 0..panes.count {
        let left = DVec2::new(panes.first(pane).into(), 0.0);
        let (begin, end) = ((first - left).max(DVec2::ZERO), (last - left).min(whole[1]));
        if (end - begin).min_element() > 0.0 {
            (low, high) = (low.max(begin), high.min(end));
        }
    }
    if (high - low).min_element() < LEAST { whole } else { [low, high] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_panel_covers_of_one_pane_is_left_out_of_all() {
        let at = |x: f64, y: f64| DVec2::new(x, y);
        let one = Panes { count: 1, left: 0, width: 1280, whole: 1280 };
        assert_eq!(
            free_in_panes(&one, 800, [at(0.0, 0.0), at(960.0, 800.0)]),
            [at(0.0, 0.0), at(960.0, 800.0)]
        );
        let two = Panes { count: 2, width: 640, ..one };
        let free = [at(100.0, 0.0), at(960.0, 800.0)];
        assert_eq!(free_in_panes(&two, 800, free), [at(100.0, 0.0), at(320.0, 800.0)]);
        // The second pane lies under the panel.
        let free = [at(0.0, 0.0), at(600.0, 800.0)];
        assert_eq!(free_in_panes(&two, 800, free), [at(0.0, 0.0), at(600.0, 800.0)]);
        let free = [at(630.0, 0.0), at(1280.0, 800.0)];
        assert_eq!(free_in_panes(&two, 800, free), [at(0.0, 0.0), at(640.0, 800.0)], "10 pixels are left");
    }
}
