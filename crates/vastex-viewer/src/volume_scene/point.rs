//! What is asked and told of places: the values below the pointer, and where a click was.

use glam::DVec3;

/// A place that is asked about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointPlace {
    /// A point of the scene's world.
    At(DVec3),
    /// What is seen along a ray.
    Along {
        /// Where the ray begins.
        from: DVec3,
        /// The ray's direction, of unit length.
        toward: DVec3,
        /// The side of a pixel there, in the world.
        pixel: f64,
    },
}

/// A question about a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointAsked {
    /// Tells questions from one another.
    pub number: u64,
    /// The time, from 0.
    pub time: u64,
    /// Which of [`super::VolumeFacts::labels`] are asked, if any are shown.
    pub labels: Option<usize>,
    /// The place.
    pub place: PointPlace,
}

/// The value of a channel at a place.
#[derive(Clone, Debug, PartialEq)]
pub struct PointValue {
    /// Which channel, from 0.
    pub channel: usize,
    /// The value as it is stored, in words.
    pub value: String,
    /// The level that it is of.
    pub level: u8,
}

/// What lies at a place.
#[derive(Clone, Debug, PartialEq)]
pub struct PointAnswer {
    /// Of the question.
    pub number: u64,
    /// Where the point is, in the scene's world; `None` where nothing is seen.
    pub place: Option<DVec3>,
    /// The voxel of level 0 that it lies in.
    pub voxel: [u32; 3],
    /// Of the channels that are shown.
    pub values: Vec<PointValue>,
    /// The label there, by its number.
    pub label: Option<i128>,
}

/// What an answer changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Heard {
    /// The crosshair goes there.
    pub(super) cross: Option<DVec3>,
    /// This label is selected, or none any more, of the labels that were asked.
    pub(super) label: Option<(Option<usize>, Option<i128>)>,
}

/// What a question is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Purpose {
    /// What is below the pointer.
    Below,
    /// What lies where a click was.
    Click,
    /// As for a click, and the label there is selected.
    Select,
}

/// Questions about places, one at a time, and the newest answers.
#[derive(Clone, Debug, Default)]
pub struct Points {
    asked: u64,
    /// What waits for the question that is out: below the pointer, and of a click, which is not lost for what
    /// comes after it.
    wanted: [Option<(PointPlace, Purpose)>; 2],
    /// The question that is out, and what it is for.
    out: Option<(PointAsked, Purpose)>,
    clicked: Option<PointAnswer>,
    below: Option<PointAnswer>,
}

impl Points {
    /// What lies where the last click was.
    pub fn clicked(&self) -> Option<&PointAnswer> {
        self.clicked.as_ref()
    }

    /// What lies below the pointer, as far as that is known.
    pub fn below(&self) -> Option<&PointAnswer> {
        self.below.as_ref()
    }

    pub(super) fn want(&mut self, place: PointPlace, purpose: Purpose) {
        self.wanted[usize::from(purpose > Purpose::Below)] = Some((place, purpose));
    }

    /// The pointer is over nothing.
    pub(super) fn leave(&mut self) {
        (self.wanted[0], self.below) = (None, None);
    }

    /// The next question, of a time and of labels that are shown, where none is out.
    pub(super) fn ask(&mut self, time: u64, labels: Option<usize>) -> Option<PointAsked> {
        if self.out.is_some() {
            return None;
        }
        let is_click = self.wanted[1].is_some();
        let (place, purpose) = self.wanted[usize::from(is_click)].take()?;
        self.asked += 1;
        let asked = PointAsked { number: self.asked, time, labels, place };
        self.out = Some((asked, purpose));
        Some(asked)
    }

    /// Returns true if a question can be asked.
    pub(super) fn waits(&self) -> bool {
        self.out.is_none() && self.wanted.iter().any(Option::is_some)
    }

    /// There is no answer.
    pub(super) fn give_up(&mut self, number: u64) {
        self.out.take_if(|(out, _)| out.number == number);
    }

    /// The answer. Says what follows from it: where a click along a ray has hit something, which label it is.
    pub(super) fn report(&mut self, told: PointAnswer) -> Heard {
        let Some((asked, purpose)) = self.out.take_if(|(out, _)| out.number == told.number) else {
            return Heard::default();
        };
        let is_click = purpose > Purpose::Below;
        let cross = told.place.filter(|_| is_click && matches!(asked.place, PointPlace::Along { .. }));
        let label = (purpose == Purpose::Select).then_some((asked.labels, told.label));
        let has_place = told.place.is_some();
        let keeps = if is_click { &mut self.clicked } else { &mut self.below };
        *keeps = Some(told).filter(|_| has_place);
        Heard { cross, label }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_question_is_out_and_no_click_is_lost() {
        let mut points = Points::default();
        let at = |x: f64| PointPlace::At(DVec3::new(x, 0.0, 0.0));
        let told =
            |number, place| PointAnswer { number, place, voxel: [0; 3], values: Vec::new(), label: None };
        points.want(at(1.0), Purpose::Below);
        let first = points.ask(2, None).unwrap();
        assert_eq!((first.place, first.time), (at(1.0), 2));
        points.want(at(2.0), Purpose::Below);
        points.want(at(3.0), Purpose::Click);
        points.want(at(4.0), Purpose::Below);
        assert_eq!(points.ask(2, None), None, "one is out");
        assert_eq!(points.report(told(99, None)), Heard::default(), "another's");
        assert_eq!(points.ask(2, None), None);
        points.report(told(first.number, Some(DVec3::X)));
        assert!(points.below().is_some() && points.clicked().is_none());
        let click = points.ask(2, None).unwrap();
        assert_eq!(click.place, at(3.0), "the click before what came after it");
        let heard = points.report(told(click.number, Some(DVec3::X)));
        assert_eq!(heard, Heard::default(), "a slice's crosshair is there already");
        assert!(points.clicked().is_some());
        assert_eq!(points.ask(2, None).unwrap().place, at(4.0), "the newest of the others");
        points.leave();
        assert!(points.below().is_none());
    }

    #[test]
    fn a_click_along_a_ray_says_what_it_hits_and_selects_where_it_is_to() {
        let mut points = Points::default();
        let place = PointPlace::Along { from: DVec3::ZERO, toward: DVec3::X, pixel: 1.0 };
        for (purpose, label, selected) in [
            (Purpose::Click, Some(7), None),
            (Purpose::Select, Some(7), Some((Some(1), Some(7)))),
            (Purpose::Select, None, Some((Some(1), None))),
        ] {
            points.want(place, purpose);
            let number = points.ask(0, Some(1)).unwrap().number;
            let told =
                PointAnswer { number, place: Some(DVec3::Y), voxel: [0; 3], values: Vec::new(), label };
            assert_eq!(points.report(told), Heard { cross: Some(DVec3::Y), label: selected }, "{purpose:?}");
        }
    }
}
