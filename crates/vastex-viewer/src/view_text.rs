//! All that a view shows as one line of text: where the camera is, which layers are shown and how, and how
//! they are compared.
//!
//! `image:x=5400,y=2700,zoom=12;layer=color;layer=height:map=viridis:opacity=0.5;compare=swipe:0.25`
//!
//! The parts stand between semicolons, the pose first. `layer=` is followed by a layer as [`LayerOptions`]
//! has its text, the lowest first; `compare=` by a [`CompareMode`]; `on=terrain` says that a pose over a
//! plane is one over a terrain. A text that names no layer says nothing of them: what is shown stays.

use crate::camera::{Pose, PoseTextError};
use crate::layers::{CompareMode, MOST_LAYERS};
use crate::scene::Scene;
use crate::surface::LayerOptions;

/// What a view shows.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewText {
    /// Where the camera is.
    pub pose: Pose,
    /// Whether a pose over a plane is one over a terrain.
    pub is_terrain: bool,
    /// The layers, the lowest first; none where nothing is said of them.
    pub layers: Vec<LayerOptions>,
    /// How the uppermost layer is compared with those beneath it.
    pub compare_mode: CompareMode,
}

/// A text says of no view what it shows.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ViewTextError {
    /// Its first part is no pose.
    #[error(transparent)]
    Pose(#[from] PoseTextError),
    /// A further part cannot be read.
    #[error(
        "'{part}' is no part of a view: {why}; after where the camera is, parts are layer=NAME[:SETTING].., compare=MODE and on=terrain, \
         each after a semicolon"
    )]
    Part {
        /// The part.
        part: String,
        /// What is wrong with it.
        why: String,
    },
}

impl ViewText {
    /// A view that says where the camera is, and nothing else.
    pub fn of_pose(pose: Pose) -> ViewText {
        ViewText { pose, is_terrain: false, layers: Vec::new(), compare_mode: CompareMode::Off }
    }

    /// The scene that it is of, where `displayed` is what is shown now.
    pub fn scene(&self, displayed: Scene) -> Scene {
        self.pose.scene(if self.is_terrain { Scene::Terrain } else { displayed })
    }

    /// The text, over an image of `size` texels.
    pub fn to_text(&self, size: [u32; 2]) -> String {
        let mut text = self.pose.to_text(size);
        if self.is_terrain {
            text += ";on=terrain";
        }
        for layer in &self.layers {
            text += &format!(";layer={layer}");
        }
        if self.compare_mode != CompareMode::Off {
            text += &format!(";compare={}", self.compare_mode);
        }
        text
    }

    /// The view of a text, over an image of `size` texels.
    pub fn from_text(text: &str, size: [u32; 2]) -> Result<ViewText, ViewTextError> {
        let mut parts = text.trim().split(';');
        let mut view = ViewText::of_pose(Pose::from_text(parts.next().unwrap_or_default().trim(), size)?);
        let mut is_compared = false;
        for part in parts {
            let error = |why: String| ViewTextError::Part { part: part.to_owned(), why };
            match part.trim().split_once('=') {
                Some(("layer", layer)) => {
                    let layer = layer.parse::<LayerOptions>().map_err(|why| error(why.to_string()))?;
                    if view.layers.len() == MOST_LAYERS {
                        return Err(error(format!("{MOST_LAYERS} layers are shown at most")));
                    }
                    view.layers.push(layer);
                }
                Some(("compare", mode)) => {
                    if std::mem::replace(&mut is_compared, true) {
                        return Err(error("compare is told twice".into()));
                    }
                    view.compare_mode = mode.parse::<CompareMode>().map_err(|why| error(why.to_string()))?;
                }
                Some(("on", "terrain")) if matches!(view.pose, Pose::Plane { .. }) => view.is_terrain = true,
                Some(("on", "terrain")) => {
                    return Err(error("a terrain is seen from a place of plane:..".into()));
                }
                _ => return Err(error("nothing is known by this name".into())),
            }
        }
        Ok(view)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};
    use vastex::Filter;

    use super::*;
    use crate::camera::Orientation;
    use crate::layers::{Bands, Curve, Nodata, Palette};

    const SIZE: [u32; 2] = [21600, 10800];
    const FILTERS: [Option<Filter>; 4] =
        [None, Some(Filter::Nearest), Some(Filter::Bicubic), Some(Filter::Trilinear)];

    /// Numbers by chance, the same each time.
    struct Chance(u64);

    impl Chance {
        fn next(&mut self) -> u64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb) >> 11
        }

        fn below(&mut self, n: usize) -> usize {
            (self.next() % n as u64) as usize
        }

        fn part(&mut self) -> f64 {
            self.next() as f64 / (1u64 << 53) as f64
        }

        fn coin(&mut self) -> bool {
            self.next() % 2 == 1
        }
    }

    fn any_layer(chance: &mut Chance) -> LayerOptions {
        let names = [None, Some("height"), Some("a:b;c=d 100%"), Some("Höhe %3A"), Some("#1\t")];
        LayerOptions {
            texture: chance.below(MOST_LAYERS),
            name: names[chance.below(names.len())].map(str::to_owned),
            bands: [Bands::default(), Bands::One(3), Bands::Color([2, 1, 0])][chance.below(3)],
            nodata: match chance.below(3) {
                0 => Nodata::OfLayer,
                1 => Nodata::NotANumber,
                _ => Nodata::Value((chance.part() - 0.5) * 1e5),
            },
            range: chance.coin().then(|| {
                let low = (chance.part() * 1e4 - 5e3) as f32;
                [low, low + 0.5 + chance.part() as f32]
            }),
            curve: if chance.coin() { Curve::Log } else { Curve::default() },
            gamma: if chance.coin() { 1.0 } else { 0.01 + 99.0 * chance.part() as f32 },
            palette: Palette::ALL[chance.below(Palette::ALL.len())],
            opacity: if chance.coin() { 1.0 } else { chance.part() as f32 },
            is_visible: chance.coin(),
            filter: FILTERS[chance.below(FILTERS.len())],
        }
    }

    #[test]
    fn views_by_chance_are_what_their_texts_say() {
        let mut chance = Chance(17);
        for _ in 0..500 {
            let zoom = (chance.part() * 12.0).exp();
            let pose = match chance.below(3) {
                0 => Pose::Image {
                    centre: DVec2::new(chance.part(), chance.part()),
                    zoom,
                    orientation: Orientation::new(90.0 * chance.below(4) as f64, chance.coin()),
                },
                1 => Pose::Plane {
                    eye: DVec3::new(chance.part() - 0.5, chance.part() - 0.5, 0.1 + chance.part()),
                    yaw: chance.part(),
                    pitch: chance.part(),
                },
                _ => Pose::globe(chance.part(), chance.part(), chance.part() + 0.1),
            };
            let compare_mode = match chance.below(5) {
                0 => CompareMode::Off,
                4 => CompareMode::Beside,
                1 => CompareMode::Swipe(chance.part() as f32),
                2 => CompareMode::Flicker(0.05 + 50.0 * chance.part() as f32),
                _ => CompareMode::Difference(0.01 + 900.0 * chance.part() as f32),
            };
            let layers = (0..chance.below(MOST_LAYERS + 1)).map(|_| any_layer(&mut chance)).collect();
            let is_terrain = matches!(pose, Pose::Plane { .. }) && chance.coin();
            let view = ViewText { pose, is_terrain, layers, compare_mode };
            let text = view.to_text(SIZE);
            assert!(!text.contains(char::is_whitespace), "{text}");
            let again = ViewText::from_text(&text, SIZE).unwrap_or_else(|error| panic!("{text}: {error}"));
            let place = |pose: Pose| (pose.over(), pose.orientation());
            assert!(place(again.pose).0.distance(place(view.pose).0) < 1e-12, "{text}");
            assert_eq!(place(again.pose).1, place(view.pose).1, "{text}");
            assert_eq!(ViewText { pose, ..again }, view, "{text}");
            assert_eq!(view.scene(Scene::Plane) == Scene::Terrain, is_terrain);
        }
    }

    #[test]
    fn what_is_no_part_of_a_view_is_told_by_its_place() {
        let image = "image:x=1,y=2,zoom=3";
        for (text, why) in [
            ("", "'' is no view"),
            ("layer=a", "'layer=a' is no view"),
            (&*format!("{image};"), "'' is no part"),
            (&*format!("{image};layers=a"), "'layers=a' is no part"),
            (&*format!("{image};layer=a:map=jet"), "grey, viridis"),
            (&*format!("{image};compare=swap"), "write off, swipe[:AT]"),
            (&*format!("{image};compare=swipe;compare=off"), "told twice"),
            (&*format!("{image};on=terrain"), "plane:"),
            ("plane:x=0,y=0,z=1,yaw=0,pitch=0;on=globe", "'on=globe'"),
            (&*format!("{image}{}", ";layer=a".repeat(9)), "8 layers"),
        ] {
            let error = ViewText::from_text(text, SIZE).unwrap_err().to_string();
            assert!(error.contains(why), "{text}: {error}");
        }
    }
}
