//! Views by chance are what their texts say, and what is no view is told by its place.

use glam::{DVec2, DVec3};
use vastex::Filter;

use super::*;
use crate::camera::Orientation;
use crate::layers::{Bands, Curve, Nodata, Palette};
use crate::surface::PlanetLight;

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
        nodata_color: chance.coin().then(|| [0, 1, 2].map(|_: u8| chance.below(256) as u8)),
        range: chance.coin().then(|| {
            let low = (chance.part() * 1e4 - 5e3) as f32;
            [low, low + 0.5 + chance.part() as f32]
        }),
        exposure: if chance.coin() { 0.0 } else { 20.0 * chance.part() as f32 - 10.0 },
        curve: Curve::ALL[chance.below(Curve::ALL.len())],
        gamma: if chance.coin() { 1.0 } else { 0.01 + 99.0 * chance.part() as f32 },
        palette: Palette::ALL[chance.below(Palette::ALL.len())],
        opacity: if chance.coin() { 1.0 } else { chance.part() as f32 },
        is_visible: chance.coin(),
        filter: FILTERS[chance.below(FILTERS.len())],
    }
}

fn any_planet(chance: &mut Chance) -> ViewPlanet {
    let sun = match chance.below(3) {
        0 => None,
        1 => Some(Sun::Off),
        _ => Some(Sun::Over([720.0 * chance.part() - 360.0, 180.0 * chance.part() - 90.0])),
    };
    let number = |chance: &mut Chance, most: f32| chance.coin().then(|| most * chance.part() as f32);
    ViewPlanet {
        sun,
        exaggeration: number(chance, PlanetLight::MOST_EXAGGERATION),
        atmosphere: number(chance, PlanetLight::MOST_ATMOSPHERE),
        lights: number(chance, PlanetLight::MOST_NIGHT),
        night: chance.coin().then(|| any_layer(chance)),
        clouds: chance.coin().then(|| any_layer(chance)),
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
        let compare_mode = match chance.below(6) {
            0 => None,
            1 => Some(CompareMode::Off),
            2 => Some(CompareMode::Swipe(chance.part() as f32)),
            3 => Some(CompareMode::Flicker(0.05 + 50.0 * chance.part() as f32)),
            4 => Some(CompareMode::Difference(0.01 + 900.0 * chance.part() as f32)),
            _ => Some(CompareMode::Beside),
        };
        let scenes: Vec<Scene> =
            Scene::ALL.into_iter().filter(|scene| pose.scene(*scene) == *scene).collect();
        // Of an image nothing has to be said.
        let scene = scenes[chance.below(scenes.len())];
        let scene = Some(scene).filter(|scene| *scene != Scene::Image && chance.coin());
        let layers = (0..chance.below(MOST_LAYERS + 1)).map(|_| any_layer(&mut chance)).collect();
        let overlay = [None, Some(None), Some(Some(Overlay::ALL[chance.below(7)]))][chance.below(3)];
        let heights = chance.coin().then(|| Heights {
            texture: chance.coin().then(|| chance.below(MOST_LAYERS)),
            layer: chance.coin().then(|| "a: b".to_owned()),
            scale: chance.coin().then(|| chance.part() as f32),
            zero: chance.coin().then(|| -1e8 * chance.part() as f32),
            is_torn: false,
        });
        let planet = any_planet(&mut chance);
        let placement = [None, Some(Placement::Stretched), Some(Placement::ByTexel)][chance.below(3)];
        let view = ViewText { pose, scene, layers, compare_mode, placement, overlay, heights, planet };
        let text = view.to_text(SIZE);
        assert!(!text.contains(char::is_whitespace), "{text}");
        let again = ViewText::from_text(&text, SIZE).unwrap_or_else(|error| panic!("{text}: {error}"));
        let place = |pose: Pose| (pose.over(), pose.orientation());
        assert!(place(again.pose).0.distance(place(view.pose).0) < 1e-12, "{text}");
        assert_eq!(place(again.pose).1, place(view.pose).1, "{text}");
        assert_eq!(ViewText { pose, ..again }, view, "{text}");
        assert_eq!(view.scene(view.pose.scene(Scene::Planet)), scene.unwrap_or(pose.scene(Scene::Planet)));
    }
}

#[test]
fn what_is_no_part_of_a_view_is_told_by_its_place() {
    let image = "image:x=1,y=2,zoom=3";
    for (text, why) in [
        ("", "'' is no view"),
        ("layer=a", "'layer=a' is no view"),
        (&*format!("{image};"), "'' is no part"),
        (&*format!("{image};layers=a"), "there is no 'layers'; after where the camera is, parts are on="),
        (&*format!("{image};layers=a"), "sun=LON,LAT or off"),
        (&*format!("{image};on=moon"), "image, plane, globe, terrain, planet"),
        (&*format!("{image};overlay=all"), "levels, wanted"),
        (&*format!("{image};sun=1"), "-40,15"),
        (&*format!("{image};sun=1,2;sun=off"), "sun is told twice"),
        (&*format!("{image};exaggeration=1001"), "0 to 1000"),
        (&*format!("{image};atmosphere=-1"), "0 to 20"),
        (&*format!("{image};lights=nan"), "0 to 100"),
        (&*format!("{image};night=file=2"), "stands where the layer's name does"),
        (&*format!("{image};height=a:high=1"), "no such setting of heights"),
        (&*format!("{image};layer=a:map=jet"), "grey, viridis"),
        (&*format!("{image};compare=swap"), "write off, swipe[:AT]"),
        (&*format!("{image};compare=swipe;compare=off"), "told twice"),
        (&*format!("{image};on=terrain"), "plane:"),
        ("plane:x=0,y=0,z=1,yaw=0,pitch=0;on=globe", "globe is seen from a place of globe:"),
        (&*format!("{image}{}", ";layer=a".repeat(9)), "8 layers"),
    ] {
        let error = ViewText::from_text(text, SIZE).unwrap_err().to_string();
        assert!(error.contains(why), "{text}: {error}");
    }
}

#[test]
fn all_that_is_shown_is_said_and_shown_again() {
    let night = LayerOptions { texture: 2, opacity: 0.5, ..LayerOptions::default() };
    let clouds = LayerOptions { texture: 3, is_visible: false, ..LayerOptions::default() };
    let light = PlanetLight { sun: None, exaggeration: 3.5, atmosphere: 0.25, night: 2.0 };
    let options = DisplayOptions {
        layers: vec![LayerOptions { gamma: 1.4, ..LayerOptions::default() }],
        heights: Heights { texture: Some(1), scale: Some(0.01), ..Heights::default() },
        planet: PlanetOptions { night: Some(night), clouds: Some(clouds), light },
        ..DisplayOptions::default()
    };
    let pose = Pose::first(Scene::Planet);
    let view = ViewText::of(pose, Scene::Planet, &options, Some(Overlay::Pages), 4);
    let text = view.to_text(SIZE);
    assert_eq!(
        text.split_once(';').unwrap().1,
        "on=planet;layer=:gamma=1.4;overlay=pages;height=:file=2:scale=0.01;sun=off;exaggeration=3.5;\
         atmosphere=0.25;lights=2;night=:file=3:opacity=0.5;clouds=:file=4:hidden"
    );
    let again = ViewText::from_text(&text, SIZE).unwrap();
    let mut other = DisplayOptions { compare_mode: CompareMode::Beside, ..DisplayOptions::default() };
    again.change(&mut other);
    assert_eq!(
        (other, again.scene(Scene::Image), again.overlay(None)),
        (options, Scene::Planet, Some(Overlay::Pages))
    );
    assert_eq!(again.textures().collect::<Vec<_>>(), [0, 2, 3, 1]);
    // What nobody chose is said as well, so that it is shown again; a planet's files are no layers.
    let planet = again.planet.clone();
    let mut unchosen = DisplayOptions::default();
    ViewText { planet, ..ViewText::of_pose(pose) }.change(&mut unchosen);
    let text = ViewText::of(pose, Scene::Planet, &unchosen, None, 4).to_text(SIZE);
    assert!(text.contains(";on=planet;layer=;layer=:file=2;sun=off;"), "{text}");
    let text = ViewText::of(Pose::first(Scene::Image), Scene::Image, &DisplayOptions::default(), None, 1);
    assert_eq!(text.to_text(SIZE), "image:x=10800,y=5400,zoom=1;layer=");
}

#[test]
fn texts_of_before_say_what_they_said() {
    let view = |text: &str| ViewText::from_text(text, SIZE).unwrap();
    let mut options = DisplayOptions {
        layers: vec![LayerOptions { opacity: 0.5, ..LayerOptions::default() }],
        compare_mode: CompareMode::Beside,
        ..DisplayOptions::default()
    };
    let before = options.clone();
    let terrain = view("plane:x=0,y=0,z=1,yaw=0,pitch=0;on=terrain");
    terrain.change(&mut options);
    assert_eq!((&options, terrain.scene(Scene::Image)), (&before, Scene::Terrain), "layers stay");
    assert_eq!(view("globe:lon=1,lat=2,alt=3m").scene(Scene::Planet), Scene::Planet, "as it is shown");
    assert_eq!(terrain.overlay(Some(Overlay::Table)), Some(Overlay::Table));
    let layers = view("image:x=1,y=2,zoom=3;layer=color;layer=height:map=viridis:opacity=0.5");
    layers.change(&mut options);
    assert_eq!((options.layers.len(), options.compare_mode), (2, CompareMode::Off));
    // Texts of before images of unlike size could lie otherwise.
    let placed = view("image:x=1,y=2,zoom=3;placement=by-texel");
    placed.change(&mut options);
    assert_eq!(options.placement, Placement::ByTexel);
    view("image:x=1,y=2,zoom=3;compare=swipe").change(&mut options);
    assert_eq!(options.placement, Placement::ByTexel, "nothing is said of it");
    layers.change(&mut options);
    assert_eq!(options.placement, Placement::Stretched);
    assert_eq!(layers.overlay(Some(Overlay::Table)), None, "what layers are named for is a picture");
}
