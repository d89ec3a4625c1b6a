//! Which texels of a row or a column make one of another size, and with what weights: a tent as wide as the
//! larger of both texels.

/// A run of texels and the weight of each; the weights' sum is 1. It may reach beyond the edges.
pub(crate) struct Taps {
    pub(crate) first: i64,
    pub(crate) weights: Vec<f32>,
}

impl Taps {
    /// For texel `at` of `to` texels, made of `from`.
    pub(crate) fn new(at: u32, to: u32, from: u32) -> Taps {
        let scale = f64::from(from) / f64::from(to);
        let (center, radius) = ((f64::from(at) + 0.5) * scale - 0.5, scale.max(1.0));
        let first = (center - radius).ceil() as i64;
        let last = (center + radius).floor() as i64;
        let weights: Vec<f64> =
            (first..=last).map(|i| (1.0 - (i as f64 - center).abs() / radius).max(0.0)).collect();
        let sum: f64 = weights.iter().sum();
        Taps { first, weights: weights.iter().map(|weight| (weight / sum) as f32).collect() }
    }

    /// For the same, the one texel in whose middle, or next to it, the middle of texel `at` lies.
    pub(crate) fn nearest(at: u32, to: u32, from: u32) -> Taps {
        let first = (2 * u64::from(at) + 1) * u64::from(from) / (2 * u64::from(to));
        Taps { first: first as i64, weights: vec![1.0] }
    }

    /// The texels with their weights.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (i64, f32)> {
        (self.first..).zip(self.weights.iter().copied())
    }

    /// The last texel of the run.
    pub(crate) fn last(&self) -> i64 {
        self.first + self.weights.len() as i64 - 1
    }
}
