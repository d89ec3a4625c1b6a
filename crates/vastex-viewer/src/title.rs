//! The title of the window: what is shown and how large, and for some seconds what there is to say to a
//! person.
//!
//! It is told what happens and says when the title changes; the window is its owner's. Times are told from
//! when the host began.

use std::time::Duration;

use vastex::diagnostics::FrameStats;

use crate::inspect::InspectedTexel;

/// Between two titles.
const EVERY: Duration = Duration::from_millis(250);
/// As long a notice stays.
const NOTICE: Duration = Duration::from_secs(6);

/// What the title of a window is made of.
pub struct TitleParts<'a> {
    /// Name of the source.
    pub name: &'a str,
    /// What is seen of it, if anything is.
    pub image: Option<TitleImage>,
    /// What lies below the pointer.
    pub texel: Option<&'a InspectedTexel>,
    /// Name of the overlay, if one is drawn.
    pub overlay: Option<&'static str>,
    /// What the last frame did.
    pub stats: &'a FrameStats,
    /// True if the picture stays as it is.
    pub is_settled: bool,
    /// How much is done of a source that is being opened, 0 to 1.
    pub opening: Option<f64>,
}

/// What is seen of a source.
#[derive(Clone, Copy)]
pub struct TitleImage {
    /// Width and height of the image in texels.
    pub size: [u32; 2],
    /// Name of the scene, or how large its texels are where all are alike.
    pub scene: Scale,
    /// What the picture lacks: it is reduced, or incomplete.
    pub lack: Option<&'static str>,
}

/// How large the image is seen.
#[derive(Clone, Copy)]
pub enum Scale {
    /// Pixels per texel.
    Even(f64),
    /// The image lies on a scene of this name.
    On(&'static str),
}

/// What the title of the window says, and for how long.
#[derive(Default)]
pub struct Title {
    text: String,
    changed_at: Option<Duration>,
    notice: Option<(String, Duration)>,
    /// True until the title has said the notice.
    is_news: bool,
    /// Frames that followed another without a pause since the rate was worked out, and the time that they
    /// took.
    frames: u32,
    busy: Duration,
    rate: f64,
}

impl Title {
    /// Says something to the person at the window.
    pub fn notify(&mut self, notice: String, now: Duration) {
        (self.notice, self.is_news) = (Some((notice, now + NOTICE)), true);
    }

    /// What was said is about something else.
    pub fn forget_notice(&mut self) {
        self.notice = None;
    }

    /// Forgets what was said long enough.
    pub fn expire(&mut self, now: Duration) {
        if self.notice.as_ref().is_some_and(|(_, until)| now >= *until) {
            self.notice = None;
        }
    }

    /// What there is to say to the person at the window.
    pub fn notice(&self) -> Option<&str> {
        self.notice.as_ref().map(|(notice, _)| &**notice)
    }

    /// How long a notice stays; `None` if there is none.
    pub fn notice_left(&self, now: Duration) -> Option<Duration> {
        self.notice.as_ref().map(|(_, until)| until.saturating_sub(now))
    }

    /// A frame was drawn so long after the last one, between which nobody slept.
    pub fn count_frame(&mut self, since_last: Duration) {
        self.frames += 1;
        self.busy += since_last;
        if self.busy >= EVERY {
            self.rate = f64::from(self.frames) / self.busy.as_secs_f64();
            (self.frames, self.busy) = (0, Duration::ZERO);
        }
    }

    /// The title if it should change now.
    pub fn due(&mut self, now: Duration, shown: &TitleParts<'_>) -> Option<&str> {
        self.expire(now);
        let notice = self.notice.as_ref().map_or_else(String::new, |(notice, _)| format!(" – {notice}"));
        let text = [shown.name, &notice, &self.usual(shown)].concat();
        let is_early = self.changed_at.is_some_and(|changed| now.saturating_sub(changed) < EVERY);
        let is_news = std::mem::take(&mut self.is_news) && self.notice.is_some();
        // The last title before a pause is right.
        if text == self.text || is_early && !shown.is_settled && !is_news {
            return None;
        }
        (self.text, self.changed_at) = (text, Some(now));
        Some(&self.text)
    }

    /// What stands behind the name, and behind what there is to say: that may be long, and hides nothing.
    fn usual(&self, shown: &TitleParts<'_>) -> String {
        let TitleParts { stats, is_settled, .. } = shown;
        let (pager, mut text) = (&stats.pager, String::new());
        if let Some(overlay) = shown.overlay {
            let bias = f64::from(pager.bias_eighths) / 8.0;
            let pace = if *is_settled { "settled".to_owned() } else { format!("{:.0} frames/s", self.rate) };
            return format!(
                " – {overlay} – {pace}, {} of {} slots in use, {} pages missing, mip bias {bias}",
                pager.occupied, pager.slots, pager.missing
            );
        }
        if let Some(TitleImage { size: [width, height], scene, lack }) = shown.image {
            text += &match scene {
                Scale::On(scene) => format!(" – {scene}"),
                Scale::Even(scale) if scale < 0.1 => format!(" – {:.2} %", 100.0 * scale),
                Scale::Even(scale) => format!(" – {:.0} %", 100.0 * scale),
            };
            text += &format!(" – {width}×{height}");
            text += &lack.map_or_else(String::new, |lack| format!(" – {lack}"));
        }
        text += &shown.texel.map_or_else(String::new, |texel| format!(" – {texel}"));
        match pager.failed {
            0 => {}
            1 => text += " – 1 tile failed",
            failed => text += &format!(" – {failed} tiles failed"),
        }
        match shown.opening {
            Some(share) if share > 0.0 => text += &format!(" – opening {:.0} %", (100.0 * share).floor()),
            Some(_) => text += " – opening",
            None if !*is_settled && pager.missing > 0 => text += " – loading",
            None => {}
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown<'a>(stats: &'a FrameStats, scene: Scale) -> TitleParts<'a> {
        TitleParts {
            name: "earth.vastex",
            image: Some(TitleImage { size: [10800, 5400], scene, lack: None }),
            texel: None,
            overlay: None,
            stats,
            is_settled: true,
            opening: None,
        }
    }

    fn missing(missing: u32) -> FrameStats {
        let mut stats = FrameStats::default();
        stats.pager.missing = missing;
        stats
    }

    #[test]
    fn the_title_says_what_is_shown_and_how_large() {
        let (mut title, now, stats) = (Title::default(), Duration::from_secs(5), missing(0));
        let mut text = |shown: &TitleParts<'_>| title.due(now, shown).map(str::to_owned);
        assert_eq!(text(&shown(&stats, Scale::Even(0.12))).unwrap(), "earth.vastex – 12 % – 10800×5400");
        assert_eq!(text(&shown(&stats, Scale::Even(0.12))), None, "it is there already");
        assert_eq!(text(&shown(&stats, Scale::Even(0.0042))).unwrap(), "earth.vastex – 0.42 % – 10800×5400");
        assert_eq!(text(&shown(&stats, Scale::On("globe"))).unwrap(), "earth.vastex – globe – 10800×5400");
        let opening = |share| TitleParts { opening: Some(share), ..shown(&stats, Scale::Even(0.12)) };
        let title = "earth.vastex – 12 % – 10800×5400 – opening";
        assert_eq!(text(&opening(0.0)).unwrap(), title);
        assert_eq!(text(&opening(0.459)).unwrap(), format!("{title} 45 %"));
        let nothing = TitleParts { image: None, ..opening(0.5) };
        assert_eq!(text(&nothing).unwrap(), "earth.vastex – opening 50 %");
        let image = TitleImage { size: [10800, 5400], scene: Scale::Even(0.12), lack: Some("reduced") };
        let reduced = TitleParts { image: Some(image), ..shown(&stats, Scale::On("globe")) };
        assert_eq!(text(&reduced).unwrap(), "earth.vastex – 12 % – 10800×5400 – reduced");
        let overlay =
            text(&TitleParts { overlay: Some("levels"), ..shown(&stats, Scale::On("globe")) }).unwrap();
        assert!(overlay.contains("levels") && overlay.contains("of 0 slots in use"), "{overlay}");
    }

    #[test]
    fn the_title_changes_four_times_a_second_and_when_the_view_settles() {
        let (mut title, begin) = (Title::default(), Duration::from_secs(5));
        let at = |ms: u64| begin + Duration::from_millis(ms);
        let (loading, done) = (missing(3), missing(0));
        let moving = |stats, percent| TitleParts {
            is_settled: false,
            ..shown(stats, Scale::Even(f64::from(percent)))
        };
        let changes = (0..=50).filter(|n| title.due(at(10 * n), &moving(&loading, *n as u32)).is_some());
        assert_eq!(changes.count(), 3, "at 0, 250 and 500 ms");
        assert!(title.due(at(501), &moving(&loading, 99)).is_none());
        let settled = title.due(at(510), &shown(&done, Scale::Even(0.5))).unwrap();
        assert_eq!(settled, "earth.vastex – 50 % – 10800×5400");
    }

    #[test]
    fn a_notice_stays_for_some_seconds() {
        let (mut title, begin, stats) = (Title::default(), Duration::from_secs(5), missing(0));
        let usual = shown(&stats, Scale::On("globe"));
        assert!(title.due(begin, &usual).is_some());
        title.notify("a terrain needs heights".into(), begin);
        let said = "earth.vastex – a terrain needs heights – globe – 10800×5400";
        assert_eq!(title.due(begin, &usual).unwrap(), said, "at once, and beside what stands there");
        let moved = TitleParts { is_settled: false, ..shown(&stats, Scale::On("plane")) };
        assert_eq!(title.due(begin + EVERY / 2, &moved), None, "no more often than without");
        assert_eq!(title.notice_left(begin), Some(NOTICE));
        assert!(title.due(begin + NOTICE / 2, &usual).is_none());
        assert_eq!(title.due(begin + NOTICE, &usual).unwrap(), "earth.vastex – globe – 10800×5400");
        assert_eq!(title.notice_left(begin + NOTICE), None);
    }

    #[test]
    fn pauses_are_no_slow_frames() {
        let mut title = Title::default();
        (0..30).for_each(|_| title.count_frame(Duration::from_millis(10)));
        assert!((99.0..=101.0).contains(&title.rate), "{}", title.rate);
    }
}
