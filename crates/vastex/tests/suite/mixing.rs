//! Layers whose values may not be mixed: each pixel shows one texel as it is stored, whatever the filter is,
//! unless it is asked for.

use std::sync::Arc;
use std::time::Duration;

use crate::common::texts::two_filters;
use crate::common::tiles::parts_of_tile;
use crate::common::{Mapping, SCREEN, Screen, add_with, settings};
use vastex::source::{ReadFuture, Tile};
use vastex::{
    Description, Error, Feedback, Filter, Geometry, GeometrySpec, Kind, Layer, LayerFormat, LayerId, PagePos,
    Sampled, Settings, TextureSettings, Textures, TileSource,
};
use vastex_core::Box3;
use vastex_tiles::Codec;

const SIZE: [u32; 2] = [700, 500];
/// Texels of level 0 along a pixel: where the picture enlarges the texture, between two levels, and far away.
const TEXELS: [f64; 3] = [0.3, 1.6, 5.0];

/// Two layers of the same noise of nothing and all, another on every level; of the second it is numbers of
/// objects.
struct Labels(Arc<Description>);

impl Labels {
    fn new(are_labels: bool) -> Arc<Labels> {
        let spec = GeometrySpec { page: 64, ..GeometrySpec::image(SIZE[0], SIZE[1]) };
        let label = Layer { is_mixable: !are_labels, ..Layer::new("label", LayerFormat::R8) };
        let layers = vec![Layer::new("value", LayerFormat::R8), label];
        Arc::new(Labels(Arc::new(Description::new(Geometry::new(spec).unwrap(), layers))))
    }

    fn fill(&self, level: u8, level_box: Box3, offset: [u32; 3], tile: &mut [u8]) {
        let (geometry, [width, height, _]) = (&self.0.geometry, self.0.geometry.tile());
        for (y, x) in (0..level_box.size[1]).flat_map(|y| (0..level_box.size[0]).map(move |x| (y, x))) {
            let texel = std::array::from_fn(|a| level_box.origin[a] + i64::from([x, y, 0][a]));
            let [x_folded, y_folded, _] = geometry.fold_texel(level, texel);
            let mixed = (x_folded ^ y_folded.wrapping_mul(0x85eb_ca6b) ^ (u32::from(level) << 20))
                .wrapping_mul(0x9e37_79b1);
            let value = if mixed >> 31 == 1 { 255 } else { 0 };
            let at = ((offset[1] + y) * width + offset[0] + x) as usize;
            (tile[at], tile[at + (width * height) as usize]) = (value, value);
        }
    }
}

impl TileSource for Labels {
    fn description(&self) -> &Arc<Description> {
        &self.0
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let (geometry, mut tile) = (&self.0.geometry, vec![0; self.0.tile_bytes()]);
        parts_of_tile(geometry, pos, |level, of_level, offset| self.fill(level, of_level, offset, &mut tile));
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes: tile.into() }) })
    }
}

/// Seen at a slant, so that an anisotropic filter wants finer levels than others.
fn mapping(texels: f64) -> Mapping {
    Mapping::new(SIZE, [0.4, 0.6], texels, 3.0, 0.7)
}

fn of(filter: Filter) -> Settings {
    Settings { filter, ..settings() }
}

fn layer(textures: &mut Textures, source: Arc<Labels>, asked: &TextureSettings, name: &str) -> LayerId {
    let texture = add_with(textures, source, asked.clone()).unwrap();
    textures.texture(texture).unwrap().layer(name).unwrap()
}

/// A layer by itself.
fn alone(settings: Settings, are_labels: bool, asked: &TextureSettings, name: &str) -> Screen {
    Screen::showing(settings, SCREEN, |textures| layer(textures, Labels::new(are_labels), asked, name))
}

/// What it looks like, and what it wants, at each distance.
fn seen(screen: &mut Screen) -> Vec<(Vec<[u8; 4]>, Feedback)> {
    let at = |texels: &f64| {
        screen.set_mapping(0, &mapping(*texels));
        screen.converge();
        let feedback = Feedback { frame: 0, ..screen.feedback_of_every_pixel() };
        (screen.picture(), feedback)
    };
    TEXELS.iter().map(at).collect()
}

fn is_stored(pixel: &[u8; 4]) -> bool {
    matches!(pixel[0], 0 | 255)
}

#[test]
fn labels_are_sampled_nearest_by_every_filter_and_want_what_that_samples() {
    let nearest = seen(&mut alone(of(Filter::Nearest), false, &TextureSettings::default(), "label"));
    for filter in Filter::KINDS {
        let mut labels = alone(of(filter), true, &TextureSettings::default(), "label");
        let found = seen(&mut labels);
        assert!(found.iter().flat_map(|(picture, _)| picture).all(is_stored), "{filter}");
        assert!(found == nearest, "{filter}");
        // The layer beside it is blended.
        let values = seen(&mut alone(of(filter), true, &TextureSettings::default(), "value"));
        let is_blended = values.iter().any(|(picture, _)| !picture.iter().all(is_stored));
        assert_eq!(is_blended, filter != Filter::Nearest, "{filter}");
    }
}

#[test]
fn labels_do_not_fade_in() {
    let settings = Settings { fade: Duration::from_secs(1), ..of(Filter::Trilinear) };
    let pictures = |are_labels| {
        let mut screen = alone(settings.clone(), are_labels, &TextureSettings::default(), "label");
        screen.set_mapping(0, &mapping(0.3));
        let frames = (0..30).map(|_| screen.frame().map(|_| screen.picture()).unwrap());
        frames.collect::<Vec<_>>()
    };
    assert!(pictures(true).iter().flatten().all(is_stored));
    assert!(!pictures(false).iter().flatten().all(is_stored));
}

#[test]
fn whoever_asks_for_a_filter_gets_it() {
    for filter in [Filter::Trilinear, Filter::KINDS[3]] {
        let asked = TextureSettings { filters: [("label".into(), filter)].into(), ..Default::default() };
        let mut labels = alone(of(Filter::Nearest), true, &asked, "label");
        let mut values = alone(of(filter), false, &TextureSettings::default(), "label");
        assert!(seen(&mut labels) == seen(&mut values), "{filter}");
        // Of the others nothing was said.
        assert!(
            seen(&mut alone(of(Filter::Nearest), true, &asked, "value"))
                .iter()
                .all(|(p, _)| p.iter().all(is_stored))
        );
    }
    let asked =
        TextureSettings { filters: [("labels".into(), Filter::Nearest)].into(), ..Default::default() };
    let mut screen = alone(of(Filter::Nearest), true, &TextureSettings::default(), "label");
    let error = add_with(&mut screen.textures, Labels::new(true), asked).unwrap_err();
    assert!(matches!(&error, Error::FilterLayer { .. }), "{error}");
    assert_eq!(
        error.to_string(),
        "there is no layer \"labels\" to set a filter for; the texture has value, label"
    );
}

#[test]
fn in_a_group_each_member_has_its_own_filter() {
    let filter = Filter::KINDS[3];
    let alone = ["value", "label"].map(|name| {
        let mut screen = alone(of(filter), true, &TextureSettings::default(), name);
        seen(&mut screen)
    });
    for (wanted, of_member) in (0..).zip(&alone) {
        let shader = two_filters(wanted);
        let mut screen = Screen::showing(of(filter), &shader, |textures| {
            let texture = textures.add_blocking(Labels::new(true)).unwrap();
            let member = |name| (name, textures.texture(texture).unwrap().layer(name).unwrap());
            let members = ["value", "label"].map(member);
            Sampled::Group(textures.add_group(members).unwrap())
        });
        for ((picture, feedback), (expected, expected_feedback)) in seen(&mut screen).iter().zip(of_member) {
            let half = |picture: &[[u8; 4]]| -> Vec<[u8; 4]> {
                picture.chunks(160).flat_map(|row| row[80 * wanted..][..80].to_vec()).collect()
            };
            assert!(half(picture) == half(expected), "member {wanted}");
            assert_eq!(feedback, expected_feedback, "member {wanted}");
        }
    }
}

/// One answer for members that are not blended alike is that of the filter that needs the finest levels. The
/// others look as they do alone; they have pages that are finer than what they show, by three levels at most.
#[test]
fn together_members_are_asked_for_what_the_finest_of_their_filters_needs() {
    let filter = Filter::KINDS[3];
    let expected = seen(&mut alone(of(filter), true, &TextureSettings::default(), "label"));
    let mut screen = Screen::showing(of(filter), &two_filters(2), |textures| {
        let [value, label] = ["value", "label"].map(|name| {
            let texture = textures.add_blocking(Labels::new(true)).unwrap();
            textures.texture(texture).unwrap().layer(name).unwrap()
        });
        Sampled::Group(textures.add_group([("value", value), ("label", label)]).unwrap())
    });
    let right = |picture: &[[u8; 4]]| -> Vec<[u8; 4]> {
        picture.chunks(160).flat_map(|row| row[80..].to_vec()).collect()
    };
    let geometry = &Labels::new(true).0.geometry;
    let mut is_finer = false;
    for ((picture, feedback), (alone, wanted)) in seen(&mut screen).iter().zip(&expected) {
        assert!(right(picture) == right(alone));
        let of_label = feedback.pages.iter().filter(|wanted| wanted.page.texture().number() == 1);
        let asked: Vec<PagePos> = of_label.map(|wanted| wanted.page.pos(geometry.dims())).collect();
        let needed: Vec<PagePos> =
            wanted.pages.iter().map(|wanted| wanted.page.pos(geometry.dims())).collect();
        let finest = |pages: &[PagePos]| pages.iter().map(|page| page.level).min().unwrap();
        let levels = finest(&needed) - finest(&asked);
        assert!(levels <= 3, "{levels} levels finer");
        is_finer |= levels > 0;
        for page in needed {
            let is_below = |pos: &PagePos| {
                std::iter::successors(Some(*pos), |&pos| geometry.parent(pos)).any(|above| above == page)
            };
            assert!(asked.iter().any(is_below), "{page} is needed and not asked for");
        }
    }
    assert!(is_finer, "an anisotropic filter needs finer levels where it looks at a slant");
}

#[test]
fn the_cpu_does_not_mix_them_either() {
    let mut labels = alone(of(Filter::Trilinear), true, &TextureSettings::default(), "label");
    labels.set_mapping(0, &mapping(1.6));
    labels.converge();
    let texture = labels.textures.inspect().textures().next().unwrap();
    let sample = |name: &str, nth: u32| {
        let layer = labels.textures.texture(texture).unwrap().layer(name).unwrap();
        let uv = [0.4 + nth as f32 * 0.0007, 0.6 - nth as f32 * 0.0003];
        labels.textures.cpu().sample(layer, uv, nth as f32 * 0.01).unwrap()
    };
    assert!(
        (0..100)
            .map(|nth| sample("label", nth))
            .all(|s| [0.0, 1.0].contains(&s.value[0]) && s.level.fract() == 0.0)
    );
    assert!(!(0..100).all(|nth| [0.0, 1.0].contains(&sample("value", nth).value[0])));
}

#[test]
fn whether_values_are_mixed_says_the_pipelines_and_not_the_pool() {
    let mut screen = alone(of(Filter::Trilinear), true, &TextureSettings::default(), "label");
    let first = screen.textures.inspect().textures().next().unwrap();
    let textures = &mut screen.textures;
    let mixable = textures.add_blocking(Labels::new(false)).unwrap();
    assert_eq!(textures.texture(first).unwrap().pool(), textures.texture(mixable).unwrap().pool());
    let filters = |texture| {
        let texture = textures.texture(texture).unwrap();
        ["value", "label"].map(|name| texture.filter(texture.layer(name).unwrap().index()).unwrap())
    };
    assert_eq!(filters(first), [Filter::Trilinear, Filter::Nearest]);
    assert_eq!(filters(mixable), [Filter::Trilinear; 2]);
    let kind = |texture, layer| textures.texture(texture).unwrap().kind(layer);
    assert_eq!(kind(first, 0), kind(mixable, 0));
    let (of_labels, of_values) = (kind(first, 1).unwrap(), kind(mixable, 1).unwrap());
    assert_eq!(of_labels, Kind { filter: Filter::Nearest, is_mixed: false, ..of_values });
    assert_eq!(of_values, Kind { layer: 1, ..kind(mixable, 0).unwrap() });
    assert_eq!(kind(first, 2), None);
    let label = |texture| textures.texture(texture).unwrap().layer("label").unwrap();
    let kinds = |texture| textures.kinds(label(texture)).unwrap();
    assert_ne!(kinds(first), kinds(mixable));
    assert_ne!(kinds(first), kinds(mixable).filtered(Filter::Nearest), "where tiles fade in, theirs do");
    assert_eq!(kinds(first), kinds(first).filtered(Filter::Bicubic));
    assert!(kinds(first).binds_like(&kinds(mixable)));
    // Whoever asks for a filter that mixes gets the kind of values.
    let asked =
        TextureSettings { filters: [("label".into(), Filter::Trilinear)].into(), ..Default::default() };
    let asked = add_with(textures, Labels::new(true), asked).unwrap();
    assert_eq!(textures.texture(asked).unwrap().kind(1), Some(of_values));
    assert_ne!(textures.shader_id(first).unwrap(), textures.shader_id(mixable).unwrap());
    let tiles: Vec<_> = textures.stats().pools.iter().map(|pool| pool.tiles.to_string()).collect();
    assert_eq!(tiles, ["72x72 texels of r8, r8"]);
}
