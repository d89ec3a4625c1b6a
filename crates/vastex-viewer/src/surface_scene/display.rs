//! What the window displays, and what takes its place when.
//!
//! A preview stands for a source that is still being opened. The source takes its place as soon as it is as
//! sharp, so that nothing is seen of the change; whatever belongs to another file is replaced at once. What
//! leaves the display is given back, to be taken out of the textures. Times are those of the host's clock.

use std::time::Duration;

/// Frames after which what a source wants is known, and how long it is waited for at most before it is shown.
const FIRST_WANTED: u32 = 8;
const LONGEST_WAIT: Duration = Duration::from_secs(1);

/// What a window displays. `S` is a source in the textures. Times are told from when the host began.
#[derive(Debug, PartialEq, Eq)]
pub enum Display<S> {
    /// Nothing.
    Empty,
    /// A picture of the source that the opening with this number will bring.
    Preview {
        /// The number of the opening.
        opening: u64,
        /// The picture, a source of its own.
        source: S,
    },
    /// A source.
    Source(S),
    /// The preview is displayed, and the source behind it is asked what it wants.
    Replacing {
        /// What is displayed.
        preview: S,
        /// What takes the place of the preview.
        next: S,
        /// When that came.
        since: Duration,
        /// Frames drawn since then.
        frames: u32,
    },
}

impl<S> Display<S> {
    /// What is seen.
    pub fn displayed(&self) -> Option<&S> {
        match self {
            Display::Empty => None,
            Display::Preview { source, .. } | Display::Source(source) => Some(source),
            Display::Replacing { preview, .. } => Some(preview),
        }
    }

    /// What is seen, to be changed.
    pub fn displayed_mut(&mut self) -> Option<&mut S> {
        match self {
            Display::Empty => None,
            Display::Preview { source, .. } | Display::Source(source) => Some(source),
            Display::Replacing { preview, .. } => Some(preview),
        }
    }

    /// What is seen, and what is about to be.
    pub fn each_mut(&mut self) -> impl Iterator<Item = &mut S> {
        let (seen, next) = match self {
            Display::Empty => (None, None),
            Display::Preview { source, .. } | Display::Source(source) => (Some(source), None),
            Display::Replacing { preview, next, .. } => (Some(preview), Some(next)),
        };
        seen.into_iter().chain(next)
    }

    /// The source that is about to take the place of its preview.
    pub fn next(&self) -> Option<&S> {
        match self {
            Display::Replacing { next, .. } => Some(next),
            _ => None,
        }
    }

    /// Returns true if it is a source that is seen, and no preview.
    pub fn is_source(&self) -> bool {
        matches!(self, Display::Source(_))
    }

    /// Displays a preview of what an opening will bring.
    #[must_use = "what is gone is still among the textures"]
    pub fn show_preview(&mut self, opening: u64, source: S) -> Vec<S> {
        self.replace(Display::Preview { opening, source })
    }

    /// Displays the source that an opening brought: behind its preview first, if it has one and if it may be
    /// so.
    #[must_use = "what is gone is still among the textures"]
    pub fn show_source(&mut self, opening: u64, source: S, may_be_behind: bool, now: Duration) -> Vec<S> {
        match std::mem::replace(self, Display::Empty) {
            Display::Preview { opening: of, source: preview } if of == opening && may_be_behind => {
                *self = Display::Replacing { preview, next: source, since: now, frames: 0 };
                Vec::new()
            }
            before => {
                *self = before;
                self.replace(Display::Source(source))
            }
        }
    }

    /// Displays the same source made anew in the place of the one that is displayed, which is given back.
    /// `None`, and `source` is dropped, if nothing is displayed.
    #[must_use = "what is gone is still among the textures"]
    pub fn exchange(&mut self, source: S) -> Option<S> {
        Some(std::mem::replace(self.displayed_mut()?, source))
    }

    /// This display with something else made of each source. The first failure ends it, and drops them.
    pub fn try_map<T, E>(self, mut map: impl FnMut(S) -> Result<T, E>) -> Result<Display<T>, E> {
        Ok(match self {
            Display::Empty => Display::Empty,
            Display::Preview { opening, source } => Display::Preview { opening, source: map(source)? },
            Display::Source(source) => Display::Source(map(source)?),
            Display::Replacing { preview, next, since, frames } => {
                Display::Replacing { preview: map(preview)?, next: map(next)?, since, frames }
            }
        })
    }

    /// All that is displayed, and what is about to be.
    pub fn into_sources(self) -> Vec<S> {
        match self {
            Display::Empty => Vec::new(),
            Display::Preview { source, .. } | Display::Source(source) => vec![source],
            Display::Replacing { preview, next, .. } => vec![preview, next],
        }
    }

    /// A frame was drawn.
    pub fn count_frame(&mut self) {
        if let Display::Replacing { frames, .. } = self {
            *frames += 1;
        }
    }

    /// Displays the source in the place of its preview, if it is sharp or has been waited for long enough.
    #[must_use = "what is gone is still among the textures"]
    pub fn take_over(&mut self, is_sharp: bool, now: Duration) -> Option<S> {
        match self {
            Display::Replacing { since, frames, .. }
                if is_sharp && *frames >= FIRST_WANTED || now.saturating_sub(*since) > LONGEST_WAIT =>
            {
                self.finish()
            }
            _ => None,
        }
    }

    /// Displays the source in the place of its preview in any case.
    #[must_use = "what is gone is still among the textures"]
    pub fn finish(&mut self) -> Option<S> {
        match std::mem::replace(self, Display::Empty) {
            Display::Replacing { preview, next, .. } => {
                *self = Display::Source(next);
                Some(preview)
            }
            other => {
                *self = other;
                None
            }
        }
    }

    fn replace(&mut self, with: Display<S>) -> Vec<S> {
        match std::mem::replace(self, with) {
            Display::Empty => Vec::new(),
            Display::Preview { source, .. } | Display::Source(source) => vec![source],
            Display::Replacing { preview, next, .. } => vec![preview, next],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_takes_the_place_of_its_preview_once_it_is_sharp() {
        let (mut display, now) = (Display::Empty, Duration::from_secs(5));
        assert!(display.displayed().is_none() && display.show_preview(7, 'p').is_empty());
        assert!(display.show_source(7, 's', true, now).is_empty());
        assert_eq!((display.displayed(), display.next()), (Some(&'p'), Some(&'s')));
        assert_eq!(display.take_over(true, now), None, "nobody knows yet what it wants");
        (0..FIRST_WANTED).for_each(|_| display.count_frame());
        assert_eq!(display.take_over(false, now), None, "it is not sharp yet");
        assert_eq!(display.take_over(true, now), Some('p'));
        assert_eq!((display.displayed(), display.next(), display.is_source()), (Some(&'s'), None, true));
        assert_eq!(display.finish(), None);
    }

    #[test]
    fn what_is_made_anew_takes_the_place_of_what_it_was_made_of() {
        let mut display = Display::Preview { opening: 3, source: 'p' };
        assert_eq!(display.exchange('q'), Some('p'));
        assert_eq!(display, Display::Preview { opening: 3, source: 'q' });
        let mut display = Display::Source('s');
        assert_eq!((display.exchange('t'), &display), (Some('s'), &Display::Source('t')));
        assert_eq!(Display::Empty.exchange('x'), None);
    }

    #[test]
    fn it_is_not_waited_for_longer_than_a_second() {
        let (mut display, now) = (Display::Preview { opening: 1, source: 'p' }, Duration::from_secs(5));
        assert!(display.show_source(1, 's', true, now).is_empty());
        assert_eq!(display.take_over(false, now + LONGEST_WAIT), None);
        assert_eq!(display.take_over(false, now + LONGEST_WAIT + Duration::from_millis(1)), Some('p'));
    }

    #[test]
    fn what_is_of_another_file_goes_at_once() {
        let now = Duration::from_secs(5);
        let mut display = Display::Preview { opening: 1, source: 'a' };
        assert_eq!(display.show_source(2, 'b', true, now), ['a'], "the preview is of another file");
        assert_eq!(display.show_preview(3, 'c'), ['b']);
        assert_eq!(display.show_source(3, 'd', false, now), ['c'], "it may not be behind its preview");
        assert!(display.show_preview(4, 'e') == ['d'] && display.show_source(4, 'f', true, now).is_empty());
        assert_eq!(display.show_source(5, 'g', true, now), ['e', 'f']);
        assert_eq!(display, Display::Source('g'));
    }
}
