//! Which values a layer has where it is seen.

use glam::DVec2;
use vastex::{LayerFormat, LayerId, Textures};

use crate::camera::Pose;
use crate::layers::{ColorMap, StoredScale};
use crate::surface::SceneRenderer;

/// Places along and down the picture, one value each.
const PLACES: [u32; 2] = [128, 72];
/// The places where each is looked for along a ray, as over heights.
const MARCHED_PLACES: [u32; 2] = [64, 36];
/// The share of values at each end that a first range leaves out.
const LEFT_OUT: f64 = 0.005;

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
    /// of the image, of which the texture may have fewer texels; `free` has the corners of the part of the
    /// view that is not covered, in pixels from the top left, where not all of it is seen.
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
        free: Option<[DVec2; 2]>,
    ) -> Option<Histogram> {
        let size = |sides: [u32; 2]| DVec2::new(sides[0].into(), sides[1].into());
        let description = textures.texture(layer.texture()).ok()?.description();
        let [width, height, _] = description.geometry.size();
        let texels = size([width, height]);
        let spread = renderer.layers().spread_over(layer, [width, height]);
        let sizes = (picture, image);
        let rows_there = renderer.layers().rows_there(layer.texture()) * texels.y;
        let exact = renderer.sight(textures, pose, sizes);
        let [mut low, mut high] = exact.bounds()?;
        if let Some([first, last]) = free {
            (low, high) = (low.max(first), high.min(last));
        }
        if low.x >= high.x || low.y >= high.y {
            return None;
        }
        let places = if exact.is_marched() { MARCHED_PLACES } else { PLACES };
        let pixels_a_place = ((high - low) / size(places)).min_element();
        let mut sight = renderer.rough_sight(textures, pose, sizes, pixels_a_place);
        // Somewhat finer than the places and no finer: the tiles of every pixel of a large view would take
        // longer than a frame.
        let texels_a_pixel = spread.x / f64::from(image[0]) * pixels_a_place / 4.0;
        let mut sampler = textures.cpu().sampler(layer)?;
        let mut channels = vec![Vec::new(); color_map.value_channels()];
        let mut is_seen = false;
        for (row, column) in (0..places[1]).flat_map(|row| (0..places[0]).map(move |column| (row, column))) {
            let share = (DVec2::new(column.into(), row.into()) + 0.5) / size(places);
            let Some(seen) = sight.at(low + (high - low) * share) else { continue };
            let texel = seen.texel * spread / size(image);
            // A layer that lies texel upon texel may end before the image does.
            if spread != texels && !(texel.x < texels.x && texel.y < texels.y) {
                continue;
            }
            if texel.y >= rows_there {
                continue;
            }
            is_seen = true;
            let level = (seen.texels_a_pixel * texels_a_pixel).log2().floor().clamp(0.0, 31.0) as u8;
            let texel = texel.min(texels - 1.0).max(DVec2::ZERO);
            let sampled = sampler.texel([texel.x as u32, texel.y as u32], level).value;
            let Some(shown) = color_map.values_of(sampled) else { continue };
            for (values, value) in channels.iter_mut().zip(shown) {
                values.extend(Some(value).filter(|value| value.is_finite()));
            }
        }
        channels.iter_mut().for_each(|values| values.sort_unstable_by(f32::total_cmp));
        is_seen.then_some(Histogram { channels })
    }

    /// The values that a layer has in all of the image, or of an image that is yet to come in this share of
    /// its rows, the upper ones: at a grid of places. They are of the channels that the colour map shows;
    /// what stands for no data is left out.
    ///
    /// Values come from a coarse level of what is held for the CPU, which a texture's coarsest levels always
    /// are; each is the mean of many texels, so that the lowest and the highest ones are missed. Takes 9,216
    /// texels, some milliseconds. `None` if the texture is gone.
    pub fn of_image(
        textures: &Textures,
        (layer, color_map): (LayerId, &ColorMap),
        rows: f64,
    ) -> Option<Histogram> {
        let [width, height, _] = textures.texture(layer.texture()).ok()?.description().geometry.size();
        let texels = DVec2::new(width.into(), f64::from(height) * rows.clamp(0.0, 1.0));
        let texels_a_place = (texels / DVec2::new(PLACES[0].into(), PLACES[1].into())).max_element();
        let level = texels_a_place.log2().round().clamp(0.0, 31.0) as u8;
        let mut sampler = textures.cpu().sampler(layer)?;
        let mut channels = vec![Vec::new(); color_map.value_channels()];
        for (row, column) in (0..PLACES[1]).flat_map(|row| (0..PLACES[0]).map(move |column| (row, column))) {
            let share = (DVec2::new(column.into(), row.into()) + 0.5)
                / DVec2::new(PLACES[0].into(), PLACES[1].into());
            let texel = (share * texels).min(texels - 1.0).max(DVec2::ZERO);
            let sampled = sampler.texel([texel.x as u32, texel.y as u32], level).value;
            let Some(shown) = color_map.values_of(sampled) else { continue };
            for (values, value) in channels.iter_mut().zip(shown) {
                values.extend(Some(value).filter(|value| value.is_finite()));
            }
        }
        channels.iter_mut().for_each(|values| values.sort_unstable_by(f32::total_cmp));
        Some(Histogram { channels })
    }

    /// Black and white, in what shaders sample, of a layer that is shown for the first time and that nobody
    /// has said anything of; `None` where 0 and 1 do, as for all of 8 bits. They are what 0.5 % of the values
    /// lie below and above where there is one value in a texel, of floats or of 16 bits, and of colours where
    /// little would be seen of them otherwise: floats beyond 0 to 1, and 16 bits of which a quarter is used.
    pub fn first_range(&self, format: LayerFormat) -> Option<[f32; 2]> {
        let most = StoredScale::new(format).most();
        if most.is_some_and(|most| most <= 255.0) {
            return None;
        }
        let [low, high] = self.between(LEFT_OUT, 1.0 - LEFT_OUT)?;
        let is_usual = match most {
            None => low > -0.1 && (0.2..2.0).contains(&high),
            Some(_) => high > 0.25,
        };
        let is_one = self.channels() == 1;
        // No number is too large or too small to be divided by.
        let is_range = low < high && (1.0 / (high - low)).is_normal();
        (is_range && (is_one || !is_usual)).then_some([low, high])
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

    #[test]
    fn a_first_range_is_that_of_single_values_and_of_colours_of_which_nothing_would_be_seen() {
        use LayerFormat::{R8, R16, R32Float, Rgba8Srgb, Rgba16, Rgba16Float};
        let of = |channels: usize, low: f32, high: f32| {
            let values: Vec<f32> = (0..=1000).map(|n| low + (high - low) * n as f32 / 1000.0).collect();
            Histogram { channels: vec![values; channels] }
        };
        assert_eq!(of(1, -100.0, 900.0).first_range(R32Float), Some([-95.0, 895.0]));
        assert_eq!(of(1, 0.0, 0.1).first_range(R16), Some([0.0005, 0.0995]));
        assert_eq!(of(1, 0.0, 0.1).first_range(R8), None);
        assert_eq!(of(3, 0.0, 0.1).first_range(Rgba8Srgb), None);
        assert!(
            of(3, 0.0, 0.1).first_range(Rgba16).is_some() && of(3, 0.0, 1.0).first_range(Rgba16).is_none()
        );
        assert_eq!(of(3, 0.0, 1.2).first_range(Rgba16Float), None, "light of a scene");
        assert!(of(3, 0.0, 4000.0).first_range(Rgba16Float).is_some());
        assert_eq!(of(1, 7.0, 7.0).first_range(R32Float), None, "black and white differ");
        assert_eq!(Histogram::default().first_range(R32Float), None);
    }
}
