//! Lengths and areas on a sphere, between places in degrees of latitude and longitude.
//!
//! Lengths are those of great circles, by the haversine formula (R. W. Sinnott, Virtues of the Haversine,
//! Sky and Telescope 68, 1984, page 159), which is exact to the last digits for short ones too. Areas are
//! sums of the spherical excess of what lies between each edge and the equator (C. F. F. Karney, Algorithms
//! for geodesics, Journal of Geodesy 87, 2013, section 6). On a sphere of the Earth's mean radius both
//! differ by up to about half a percent from those on its ellipsoid.

use std::f64::consts::{PI, TAU};

/// Metres of the Earth's mean radius, (2a + b) / 3 of GRS 80.
pub(super) const EARTH: f64 = 6_371_008.771;

/// Metres between two places, on a sphere of so many metres' radius.
pub(super) fn distance(radius: f64, from: [f64; 2], to: [f64; 2]) -> f64 {
    let [[from, from_east], [to, to_east]] = [from, to].map(|place| place.map(f64::to_radians));
    let half_sine = |angle: f64| (angle / 2.0).sin().powi(2);
    let chord = half_sine(to - from) + from.cos() * to.cos() * half_sine(to_east - from_east);
    2.0 * radius * chord.clamp(0.0, 1.0).sqrt().asin()
}

/// Square metres that a closed line of great circles surrounds, the smaller part of the sphere where it goes
/// round a pole. Where the line crosses itself, parts gone round the other way are subtracted.
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
    // Of a line round a pole the sum is what lies between it and the equator.
    let goes_round = f64::abs(turned) > PI;
    let excess = if goes_round { TAU - excess.abs() } else { excess.abs() };
    radius * radius * excess
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
}
