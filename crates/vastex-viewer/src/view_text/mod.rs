//! All that a view shows as one line of text: where the camera is, which layers are shown and how, how they
//! are compared, and of a planet how it is lit.
//!
//! `image:x=5400,y=2700,zoom=12;layer=color;layer=height:map=viridis:opacity=0.5;compare=swipe:0.25`
//!
//! The parts stand between semicolons, the pose first, each other one as KEY=VALUE. [`KEYS`] are all keys.
//! What a text says nothing of stays as it is; but one that names layers says all of how they are shown, so
//! that they are compared as it says, or not at all.

mod flight;
mod heights;
mod place;
mod planet;
#[cfg(test)]
mod tests;
mod volume;

use crate::camera::{Pose, PoseTextError};
use crate::layers::{CompareMode, MOST_LAYERS, Placement};
use crate::overlay::Overlay;
use crate::scene::Scene;
use crate::surface::{DisplayOptions, Heights, LayerOptions, PlanetOptions};
pub use flight::VolumeFlight;
pub use place::VolumePlace;
pub use planet::{ParseSunError, Sun, ViewPlanet};
pub use volume::{VOLUME_KEYS, ViewChannel, ViewLabels, ViewSlices, VolumeViewError, VolumeViewText};

/// The keys of a text after its pose, each with what stands after it.
pub const KEYS: [(&str, &str); 12] = [
    ("on", "image, plane, globe, terrain or planet"),
    ("layer", "[NAME][:SETTING].., the lowest first"),
    ("compare", "off, swipe[:AT], flicker[:SECONDS], difference[:TIMES] or beside"),
    ("placement", "stretched or by-texel"),
    ("overlay", "off, levels, wanted, deficit, pages, feedback, table or atlas"),
    ("height", "[NAME][:file=N][:scale=N][:zero=N]"),
    ("sun", "LON,LAT or off"),
    ("exaggeration", "N"),
    ("atmosphere", "N"),
    ("lights", "N"),
    ("night", "[NAME][:SETTING].."),
    ("clouds", "[NAME][:SETTING].."),
];

/// What a view shows.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewText {
    /// Where the camera is.
    pub pose: Pose,
    /// The scene that the pose is of, where that is said.
    pub scene: Option<Scene>,
    /// The layers, the lowest first; none where nothing is said of them.
    pub layers: Vec<LayerOptions>,
    /// How the uppermost layer is compared with those beneath it, if the text says so.
    pub compare_mode: Option<CompareMode>,
    /// Where layers of another size than the lowest one's lie, if the text says so.
    pub placement: Option<Placement>,
    /// What is drawn in the place of the picture, where that is said: an overlay, or nothing.
    pub overlay: Option<Option<Overlay>>,
    /// The heights that displace the scene, where anything is said of them.
    pub heights: Option<Heights>,
    /// What is said of a planet.
    pub planet: ViewPlanet,
}

/// A text says of no view what it shows.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ViewTextError {
    /// The text's first part is no pose.
    #[error(transparent)]
    Pose(#[from] PoseTextError),
    /// A further part has a key that there is not.
    #[error(
        "'{part}' is no part of a view: there is no '{key}'; after where the camera is, parts are {}, each after a semicolon",
        keys()
    )]
    Key {
        /// The part.
        part: String,
        /// The key of the part.
        key: String,
    },
    /// A further part cannot be read.
    #[error("'{part}' is no part of a view: {why}")]
    Part {
        /// The part.
        part: String,
        /// What is wrong with the part.
        why: String,
    },
}

/// All keys and what stands after them, in words.
fn keys() -> String {
    KEYS.map(|(key, value)| format!("{key}={value}")).join("; ")
}

impl ViewText {
    /// A view that says where the camera is, and nothing else.
    pub fn of_pose(pose: Pose) -> ViewText {
        ViewText {
            pose,
            scene: None,
            layers: Vec::new(),
            compare_mode: None,
            placement: None,
            overlay: None,
            heights: None,
            planet: ViewPlanet::default(),
        }
    }

    /// All that is shown of so many textures.
    pub fn of(
        pose: Pose,
        scene: Scene,
        options: &DisplayOptions,
        overlay: Option<Overlay>,
        textures: usize,
    ) -> ViewText {
        let layers = match options.layers.is_empty() {
            false => options.layers.iter().map(as_first).collect(),
            true => {
                let is_shown = |texture: &usize| !options.is_of_planet(*texture);
                let first_of = |texture| LayerOptions { texture, ..LayerOptions::default() };
                (0..textures).filter(is_shown).map(first_of).collect()
            }
        };
        let has_heights = options.heights.are_wanted() && options.displaces(scene);
        ViewText {
            pose,
            scene: Some(scene),
            layers,
            compare_mode: Some(options.compare_mode).filter(|mode| *mode != CompareMode::Off),
            placement: Some(options.placement).filter(|placement| *placement != Placement::Stretched),
            overlay: overlay.map(Some),
            heights: has_heights.then(|| options.heights.clone()),
            planet: match scene {
                Scene::Planet => ViewPlanet::of(&options.planet),
                _ => ViewPlanet::default(),
            },
        }
    }

    /// The scene of the view, if `displayed` is the one shown now.
    pub fn scene(&self, displayed: Scene) -> Scene {
        self.scene.unwrap_or_else(|| self.pose.scene(displayed))
    }

    /// Returns true if the text names any layer, and so says all of how layers are shown.
    pub fn names_layers(&self) -> bool {
        !self.layers.is_empty()
    }

    /// Applies the view to display options. Settings that the text does not name stay as they are.
    pub fn change(&self, options: &mut DisplayOptions) {
        if self.names_layers() {
            options.layers.clone_from(&self.layers);
            (options.compare_mode, options.placement) = (CompareMode::Off, Placement::Stretched);
        }
        options.placement = self.placement.unwrap_or(options.placement);
        if let Some(mode) = self.compare_mode {
            options.compare_mode = mode;
        }
        if let Some(heights) = &self.heights {
            options.heights.clone_from(heights);
        }
        self.planet.change(&mut options.planet);
    }

    /// The overlay that is drawn where it is shown, and `displayed` is drawn now.
    pub fn overlay(&self, displayed: Option<Overlay>) -> Option<Overlay> {
        let unsaid = if self.names_layers() { None } else { displayed };
        self.overlay.unwrap_or(unsaid)
    }

    /// The textures that it names, counted from 0, each as often as it does.
    pub fn textures(&self) -> impl Iterator<Item = usize> {
        let layers = self.layers.iter().chain(&self.planet.night).chain(&self.planet.clouds);
        let heights = self.heights.iter().filter_map(|heights| heights.texture);
        layers.map(|layer| layer.texture).chain(heights)
    }

    /// The text, over an image of `size` texels.
    pub fn to_text(&self, size: [u32; 2]) -> String {
        let mut text = self.pose.to_text(size);
        let mut add = |key: &str, value: &dyn std::fmt::Display| text += &format!(";{key}={value}");
        // An image's pose is of no other scene.
        if let Some(scene) = self.scene.filter(|scene| *scene != Scene::Image) {
            add("on", &scene.name());
        }
        for layer in &self.layers {
            add("layer", layer);
        }
        if let Some(mode) = &self.compare_mode {
            add("compare", mode);
        }
        if let Some(placement) = &self.placement {
            add("placement", placement);
        }
        if let Some(overlay) = self.overlay {
            add("overlay", &overlay.map_or("off", Overlay::name));
        }
        if let Some(heights) = &self.heights {
            add("height", &heights::text_of(heights));
        }
        self.planet.write(&mut add);
        text
    }

    /// The view of a text, over an image of `size` texels.
    pub fn from_text(text: &str, size: [u32; 2]) -> Result<ViewText, ViewTextError> {
        let mut parts = text.trim().split(';');
        let mut view = ViewText::of_pose(Pose::from_text(parts.next().unwrap_or_default().trim(), size)?);
        let mut told: Vec<&str> = Vec::new();
        for part in parts.map(str::trim) {
            let (key, value) = part.split_once('=').unwrap_or((part, ""));
            if !KEYS.iter().any(|(known, _)| *known == key) {
                return Err(ViewTextError::Key { part: part.to_owned(), key: key.to_owned() });
            }
            let error = |why: String| ViewTextError::Part { part: part.to_owned(), why };
            if key != "layer" && told.contains(&key) {
                return Err(error(format!("{key} is told twice")));
            }
            told.push(key);
            view.read(key, value).map_err(error)?;
        }
        Ok(view)
    }

    /// Takes in one part of a text.
    fn read(&mut self, key: &str, value: &str) -> Result<(), String> {
        let layer = || value.parse::<LayerOptions>().map_err(|why| why.to_string());
        match key {
            "on" => self.scene = Some(scene_of(value, &self.pose)?),
            "layer" if self.layers.len() == MOST_LAYERS => {
                return Err(format!("{MOST_LAYERS} layers are shown at most"));
            }
            "layer" => self.layers.push(layer()?),
            "compare" => {
                self.compare_mode = Some(value.parse::<CompareMode>().map_err(|why| why.to_string())?);
            }
            "placement" => {
                self.placement = Some(value.parse::<Placement>().map_err(|why| why.to_string())?);
            }
            "overlay" => self.overlay = Some(overlay_of(value)?),
            "height" => self.heights = Some(heights::of_text(value)?),
            "night" => self.planet.night = Some(layer()?),
            "clouds" => self.planet.clouds = Some(layer()?),
            _ => self.planet.read(key, value)?,
        }
        Ok(())
    }
}

/// A layer as it is said: what is black and white in any case is not.
fn as_first(layer: &LayerOptions) -> LayerOptions {
    LayerOptions { range: layer.range.filter(|range| *range != [0.0, 1.0]), ..layer.clone() }
}

/// A scene by its name, which a pose must be of.
fn scene_of(name: &str, pose: &Pose) -> Result<Scene, String> {
    let names = || Scene::ALL.map(Scene::name).join(", ");
    let scene = Scene::ALL.into_iter().find(|scene| scene.name() == name);
    let scene = scene.ok_or_else(|| format!("the scenes are {}", names()))?;
    if pose.scene(scene) == scene {
        return Ok(scene);
    }
    let place = match scene {
        Scene::Image => "image:",
        Scene::Plane | Scene::Terrain => "plane:",
        Scene::Globe | Scene::Planet => "globe:",
    };
    Err(format!("{name} is seen from a place of {place}.."))
}

/// An overlay by its name, or none.
fn overlay_of(name: &str) -> Result<Option<Overlay>, String> {
    if name == "off" {
        return Ok(None);
    }
    let named = Overlay::ALL.into_iter().find(|overlay| overlay.name() == name);
    named
        .map(Some)
        .ok_or_else(|| format!("the overlays are {}, and off", Overlay::ALL.map(Overlay::name).join(", ")))
}

/// What is said of a planet's parts and its light, from what it is made of.
impl ViewPlanet {
    fn of(planet: &PlanetOptions) -> ViewPlanet {
        let PlanetOptions { night, clouds, light } = planet;
        ViewPlanet {
            night: night.as_ref().map(as_first),
            clouds: clouds.as_ref().map(as_first),
            ..ViewPlanet::lit(light)
        }
    }
}
