//! Which values a layer has where it is seen.

use glam::DVec2;
use vastex::{LayerId, Textures};

use crate::camera::Pose;
use crate::layers::ColorMap;
use crate::surface::SceneRenderer;

/// Places along and down the picture, one value each.
const PLACES: [u32; 2] = [128, 72];
/// The same where each is looked for along a ray, as over heights.
const MARCHED_PLACES: [u32; 2] = [64, 36];

/// Values of a layer, from places spread evenly over the picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Histogram {
    /// Of each channel but alpha, what shaders sample, in rising order. What is no number is left out.
    channels: Vec<Vec<f32>>,
}

impl Histogram {
    /// The values of a layer that are seen in a picture of a scene, on every surface: at a grid of places of
    /// the picture, or of the part of it in which an image lies. They are of the channels that the colour map
    /// shows; what stands for no data is left out. `picture` is the size of the view in pixels, `image` that
    /// of the image, of which the texture may have fewer texels.
    ///
    /// Values come from a level of which a place has some four texels along a side, or a coarser one where
    /// that is not in memory. Takes 9,216 texels of what is held for the CPU, some milliseconds; over heights
    /// 2,304 and some tens of milliseconds. `None` if the texture is gone, or no part of the image is in
    /// view.
    pub fn of_view(
        textures: &Textures,
        renderer: &SceneRenderer,
        (layer, color_map): (LayerId, &ColorMap),
        pose: &Pose,
        (picture, image): ([u32; 2], [u32; 2]),
    ) -> Option<Histogram> {
        let size = |sides: [u32; 2]| DVec2::new(sides[0].into(), sides[1].into());
        let description = textures.texture(layer.texture()).ok()?.description();
        let [width, height, _] = description.geometry.size();
        let texels = size([width, height]);
        let sizes = (picture, image);
        let exact = renderer.sight(textures, pose, sizes);
        let [low, high] = exact.bounds()?;
        let places = if exact.is_marched() { MARCHED_PLACES } else { PLACES };
        let pixels_a_place = ((high - low) / size(places)).min_element();
        let mut sight = renderer.rough_sight(textures, pose, sizes, pixels_a_place);
        // Somewhat finer than the places and no finer: the tiles of every pixel of a large view would take
        // longer than a frame.
        let texels_a_pixel = texels.x / f64::from(image[0]) * pixels_a_place / 4.0;
        let mut sampler = textures.cpu().sampler(layer)?;
        let mut channels = vec![Vec::new(); color_map.value_channels()];
        let mut is_seen = false;
        for (row, column) in (0..places[1]).flat_map(|row| (0..places[0]).map(move |column| (row, column))) {
            let share = (DVec2::new(column.into(), row.into()) + 0.5) / size(places);
            let Some(seen) = sight.at(low + (high - low) * share) else { continue };
            is_seen = true;
            let level = (seen.texels_a_pixel * texels_a_pixel).log2().floor().clamp(0.0, 31.0) as u8;
            let texel = (seen.texel * texels / size(image)).min(texels - 1.0).max(DVec2::ZERO);
            let sampled = sampler.texel([texel.x as u32, texel.y as u32], level).value;
            let Some(shown) = color_map.values_of(sampled) else { continue };
            for (values, value) in channels.iter_mut().zip(shown) {
                values.extend(Some(value).filter(|value| value.is_finite()));
            }
        }
        channels.iter_mut().for_each(|values| values.sort_unstable_by(f32::total_cmp));
        is_seen.then_some(Histogram { channels })
    }

    /// That of these values, channel by channel.
    #[cfg(all(test, feature = "egui"))]
    pub(crate) fn of_values(mut channels: Vec<Vec<f32>>) -> Histogram {
        channels.iter_mut().for_each(|values| values.sort_unstable_by(f32::total_cmp));
        Histogram { channels }
    }

    /// How many channels there are: alpha is none.
    pub fn channels(&self) -> usize {
        self.channels.len()
    }

    /// The least and the largest value of all channels; `None` if there is no value.
    pub fn extent(&self) -> Option<[f32; 2]> {
        self.between(0.0, 1.0)
    }

    /// The values below which these shares of a channel's values lie, of 0 to 1: of all channels the least of
    /// the first, and the largest of the second. `None` if there is no value.
    pub fn between(&self, low: f64, high: f64) -> Option<[f32; 2]> {
        let at = |values: &Vec<f32>, share: f64| {
            let last = values.len().checked_sub(1)?;
            values.get((share.clamp(0.0, 1.0) * last as f64).round() as usize).copied()
        };
        let lows = self.channels.iter().filter_map(|values| at(values, low));
        let highs = self.channels.iter().filter_map(|values| at(values, high));
        Some([lows.min_by(f32::total_cmp)?, highs.max_by(f32::total_cmp)?])
    }

    /// How many values of a channel lie between each edge and the next, of edges in rising order. Values at
    /// an edge count as above it.
    pub fn counts(&self, channel: usize, edges: &[f32]) -> Vec<usize> {
        let Some(values) = self.channels.get(channel) else { return Vec::new() };
        let below = |edge: f32| values.partition_point(|value| *value < edge);
        edges.windows(2).map(|edges| below(edges[1]) - below(edges[0])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_and_counts_are_those_of_the_values() {
        let rising: Vec<f32> = (0..=100).map(|n| n as f32).collect();
        let histogram = Histogram { channels: vec![rising, vec![50.0, 200.0], Vec::new()] };
        assert_eq!(histogram.extent(), Some([0.0, 200.0]));
        assert_eq!(histogram.between(0.02, 0.98), Some([2.0, 200.0]));
        assert_eq!(histogram.counts(0, &[0.0, 10.0, 50.0, 1000.0]), [10, 40, 51]);
        assert_eq!(histogram.counts(1, &[50.0, 51.0, 60.0]), [1, 0]);
        assert!(histogram.counts(3, &[0.0, 1.0]).is_empty());
        assert_eq!(Histogram::default().extent(), None);
    }
}
