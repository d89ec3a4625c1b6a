//! Lengths and areas on a sphere, between places in degrees of latitude and longitude.
//!
//! Lengths are those of great circles, by the haversine formula (R. W. Sinnott, Virtues of the Haversine,
//! Sky and Telescope 68, 1984, page 159), which is exact to the last digits for short ones too. Areas are
//! sums of the spherical excess of what lies between each edge and the equator (C. F. F. Karney, Algorithms
//! for geodesics, Journal of Geodesy 87, 2013, section 6). On a sphere of the Earth's mean radius both
//! differ by up to about half a percent from those on its ellipsoid.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// Metres of the Earth's mean radius, (2a + b) / 3 of GRS 80.
pub(super) const EARTH: f64 = 6_371_008.771;

/// Metres between two places, on a sphere of so many metres' radius.
pub(super) fn distance(radius: f64, from: [f64; 2], to: [f64; 2]) -> f64 {
    let [[from, from_east], [to, to_east]] = [from, to].map(|place| place.map(f64::to_radians));
    let half_sine = |angle: f64| (angle / 2.0).sin().powi(2);
    let chord = half_sine(to - from) + from.cos() * to.cos() * half_sine(to_east - from_east);
    2.0 * radius * chord.clamp(0.0, 1.0).sqrt().asin()
}

/// Places along the great circle from one place to another, the shorter way, both ends among them, at most a
/// degree apart. Longitudes go on from that of `from` without a jump, but at a pole, and so may end whole
/// turns from that of `to`.
pub(super) fn way(from: [f64; 2], to: [f64; 2]) -> Vec<[f64; 2]> {
    let [start, end] = [from, to].map(|place| {
        let [north, east] = place.map(f64::to_radians);
        DVec3::new(north.cos() * east.cos(), north.cos() * east.sin(), north.sin())
    });
    let angle = start.cross(end).length().atan2(start.dot(end));
    // Of ends that lie opposite each other any way is the shortest; east is as good as any.
    let across = end - start.dot(end) * start;
    let east = from[1].to_radians();
    let ahead = across.try_normalize().unwrap_or(DVec3::new(-east.sin(), east.cos(), 0.0));
    let steps = (angle.to_degrees().ceil() as u32).max(1);
    let mut before = from[1];
    let mut step = |step: u32| {
        let (sin, cos) = (angle * f64::from(step) / f64::from(steps)).sin_cos();
        let place = cos * start + sin * ahead;
        let north = place.z.atan2(place.x.hypot(place.y)).to_degrees();
        // A pole has the longitude of whatever is beside it.
        if north.abs() < 90.0 - 1e-9 {
            before += turn(before, place.y.atan2(place.x).to_degrees());
        }
        [north, before]
    };
    let mut places = vec![from];
    places.extend((1..steps).map(&mut step));
    let last = places[places.len() - 1][1];
    // As it was given, whole turns apart.
    let turns = ((last + turn(last, to[1]) - to[1]) / 360.0).round();
    places.push([to[0], if to[0].abs() < 90.0 { to[1] + 360.0 * turns } else { to[1] }]);
    places
}

/// Degrees of longitude from one to another, the shorter way round.
fn turn(from: f64, to: f64) -> f64 {
    (to - from + 180.0).rem_euclid(360.0) - 180.0
}

/// Square metres that a closed line of great circles surrounds, each edge the shorter way between its ends.
/// Of the two parts of a sphere that is the one without poles, however large it is, and the smaller one where
/// each has a pole. Where the line crosses itself, parts gone round the other way are subtracted.
pub(super) fn area(radius: f64, places: &[[f64; 2]]) -> f64 {
    let (mut excess, mut turned) = (0.0, 0.0);
    let ends = places.iter().zip(places.iter().cycle().skip(1));
    for (from, to) in ends {
        let [[from, from_east], [to, to_east]] = [*from, *to].map(|place| place.map(f64::to_radians));
        // The shorter way round.
        let east = (to_east - from_east + PI).rem_euclid(TAU) - PI;
        let [from, to] = [from, to].map(|north| (north / 2.0).tan());
        excess += 2.0 * ((east / 2.0).tan() * (from + to)).atan2(1.0 + from * to);
        turned += east;
    }
    // The sum is what lies between the line and the equator, which a line round a pole goes round too: there
    // is a half of the sphere on either side of it for each time.
    let halves = TAU * (turned / TAU).round();
    radius * radius * f64::min((halves - excess).abs(), (halves + excess).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_near(found: f64, expected: f64, share: f64) -> bool {
        (found / expected - 1.0).abs() < share
    }

    #[test]
    fn lengths_are_those_of_great_circles() {
        let quarter = EARTH * PI / 2.0;
        for (from, to, expected) in [
            ([0.0, 0.0], [90.0, 77.0], quarter),
            ([0.0, -45.0], [0.0, 45.0], quarter),
            ([0.0, 179.5], [0.0, -179.5], quarter / 90.0),
            ([60.0, 10.0], [60.0, -170.0], quarter * 2.0 / 3.0),
            ([51.5, 7.0], [51.5 + 1e-6, 7.0], quarter / 90e6),
        ] {
            let found = distance(EARTH, from, to);
            assert!(is_near(found, expected, 1e-6), "{from:?} to {to:?}: {found} for {expected}");
        }
        // Along a parallel it is shorter than the parallel, which is half as long at 60 degrees.
        let along = distance(EARTH, [60.0, 0.0], [60.0, 10.0]);
        assert!(along < quarter / 18.0 && along > quarter / 18.0 * 0.995, "{along}");
        assert_eq!(distance(EARTH, [12.0, 3.0], [12.0, 3.0]), 0.0);
    }

    #[test]
    fn areas_are_those_of_the_sphere() {
        let all = 4.0 * PI * EARTH * EARTH;
        let octant = [[0.0, 0.0], [0.0, 90.0], [90.0, 0.0]];
        assert!(is_near(area(EARTH, &octant), all / 8.0, 1e-12));
        let reversed = [octant[2], octant[1], octant[0]];
        assert!(is_near(area(EARTH, &reversed), all / 8.0, 1e-12));
        // A degree by a degree on the equator, and over the date line.
        let cell = all * 1f64.to_radians().sin() / 720.0;
        for east in [0.0, 179.5] {
            let places = [[0.0, east], [0.0, east + 1.0], [1.0, east + 1.0], [1.0, east]];
            assert!(is_near(area(EARTH, &places), cell, 1e-4), "{east}");
        }
        // Round a pole, whichever way.
        let cap: Vec<[f64; 2]> = (0..720).map(|n| [-80.0, f64::from(n) / 2.0]).collect();
        let expected = all * (1.0 - 80f64.to_radians().sin()) / 2.0;
        assert!(is_near(area(EARTH, &cap), expected, 1e-4));
        let back: Vec<[f64; 2]> = cap.iter().rev().copied().collect();
        assert!(is_near(area(EARTH, &back), expected, 1e-4));
    }

    /// Places along a parallel, from one longitude to another.
    fn along(north: f64, from: f64, to: f64) -> Vec<[f64; 2]> {
        let steps = 4 * (to - from).abs() as u32;
        let step = |n: u32| [north, from + (to - from) * f64::from(n) / f64::from(steps)];
        (0..=steps).map(step).collect()
    }

    /// Bands of so many degrees of longitude, wider than half of the sphere and larger than it, whether they
    /// are drawn over the date line or the numbers of longitude begin anew there.
    #[test]
    fn areas_may_be_wider_than_half_of_the_sphere() {
        let all = 4.0 * PI * EARTH * EARTH;
        for (south, north, from, to) in [
            (-30.0, 30.0, -120.0, 120.0),
            (-10.0, 50.0, 0.0, 359.0),
            (-89.0, 89.0, 20.0, 320.0),
            (-30.0, 30.0, 100.0, 260.0),
        ] {
            let sines = f64::to_radians(north).sin() - f64::to_radians(south).sin();
            let expected = all / 2.0 * sines * (to - from) / 360.0;
            let line = [along(north, from, to), along(south, to, from)].concat();
            let jumping: Vec<[f64; 2]> =
                line.iter().map(|[lat, east]| [*lat, (east + 180.0).rem_euclid(360.0) - 180.0]).collect();
            for line in [line, jumping] {
                let reversed: Vec<[f64; 2]> = line.iter().rev().copied().collect();
                for line in [line, reversed] {
                    let found = area(EARTH, &line);
                    assert!(is_near(found, expected, 1e-5), "{from} to {to}: {found} for {expected}");
                }
            }
        }
        // All round: what lies between two parallels.
        let line = [along(30.0, -180.0, 180.0), along(-30.0, 180.0, -180.0)].concat();
        assert!(is_near(area(EARTH, &line), all / 2.0, 1e-5));
    }

    #[test]
    fn areas_round_a_pole_are_those_of_caps() {
        let all = 4.0 * PI * EARTH * EARTH;
        let cap = |north: f64| all * (1.0 - f64::abs(north).to_radians().sin()) / 2.0;
        for north in [60.0, 5.0, -5.0, -60.0] {
            let line = along(north, -180.0, 179.75);
            // The smaller part, whichever way, wherever it begins.
            let moved: Vec<[f64; 2]> = line.iter().map(|[lat, east]| [*lat, east + 180.0]).collect();
            let back: Vec<[f64; 2]> = line.iter().rev().copied().collect();
            for line in [&line, &moved, &back] {
                assert!(is_near(area(EARTH, line), cap(north), 1e-4), "{north}");
            }
            // Round it twice it is counted twice, as a plane surface is.
            let twice = area(EARTH, &line.repeat(2));
            assert!(is_near(twice, 2.0 * cap(north), 1e-4), "{north}: {twice}");
        }
        // An octant at a pole, whatever longitude the pole is given.
        for east in [0.0, 45.0, 200.0, -170.0] {
            let octant = [[0.0, 10.0], [0.0, 100.0], [90.0, east]];
            assert!(is_near(area(EARTH, &octant), all / 8.0, 1e-12), "{east}");
        }
        // Half of the sphere over both poles.
        let half = [[0.0, 0.0], [90.0, 0.0], [0.0, 180.0], [-90.0, 0.0]];
        assert!(is_near(area(EARTH, &half), all / 2.0, 1e-12));
    }

    #[test]
    fn ways_are_the_shorter_ones_along_great_circles() {
        for (from, to) in [
            ([40.7, -74.0], [35.7, 139.7]),
            ([35.7, 139.7], [40.7, -74.0]),
            ([-30.0, 10.0], [60.0, 100.0]),
            ([80.0, 0.0], [80.0, 120.0]),
            ([1.0, 2.0], [1.0 + 1e-7, 2.0]),
            ([90.0, 0.0], [10.0, 50.0]),
            ([10.0, 50.0], [90.0, 0.0]),
            ([0.0, 0.0], [0.0, 180.0]),
        ] {
            let places = way(from, to);
            let steps: Vec<f64> = places.windows(2).map(|ends| distance(EARTH, ends[0], ends[1])).collect();
            let (sum, whole) = (steps.iter().sum::<f64>(), distance(EARTH, from, to));
            assert!(is_near(sum, whole, 1e-6), "{from:?} to {to:?}: {sum} of {whole}");
            assert!(steps.iter().all(|step| *step < 1.001 * EARTH * 1f64.to_radians()));
            let [first, last] = [places[0], places[places.len() - 1]];
            assert!(
                first == from && last[0] == to[0] && ((last[1] - to[1]) / 360.0).fract().abs() < 1e-9,
                "{last:?}"
            );
            let widest = places.windows(2).map(|ends| f64::abs(ends[1][1] - ends[0][1])).fold(0.0, f64::max);
            assert!(widest < 100.0, "{from:?} to {to:?} jumps by {widest}");
        }
        // Over the Pacific, not over Europe.
        let places = way([40.7, -74.0], [35.7, 139.7]);
        assert!(places.last().is_some_and(|[_, east]| f64::abs(east - (139.7 - 360.0)) < 1e-9));
        assert!(places.iter().any(|[north, _]| *north > 65.0));
    }
}
