//! Every shader text that is handed to a device, by library, scenes, examples, benchmarks and tests.
//!
//! Whatever makes a text from options makes it here of all of them, by the functions that make it for a
//! device. Where options are numbers, of taps and of bind groups, there are those that the project uses. The
//! suite fails for a text that is handed to a device and is not among these.

use std::fmt::Write as _;

use vastex::Filter;
use vastex_scenes::{Attribute, shaders};
use vastex_viewer::LayersText;
use vastex_wgpu::{
    Atlas, BindingPlace, FeedbackMode, Kind, KindMember, Kinds, PageSides, TableKind, compute_texts,
    filters_text, wgsl,
};

#[path = "../../benches/draw/texts.rs"]
mod bench;
#[path = "layer_lists.rs"]
mod layer_lists;
#[path = "lit_planets.rs"]
mod lit_planets;
#[path = "of_tests.rs"]
mod of_tests;
#[path = "../../../../crates/vastex-wgpu/tests/gpu/table_texts.rs"]
mod table_texts;
#[allow(unreachable_pub, reason = "a module of a test program")]
#[path = "../../../../crates/vastex/tests/suite/common/texts.rs"]
mod vastex_tests;
#[path = "volumes.rs"]
mod volumes;

/// What stands in the place of the library's text in tests of the examples, with ordinary textures.
const ORDINARY: &str = include_str!("../../../../crates/vastex/tests/suite/ordinary.wgsl");

/// What is called with each text and its name.
pub(crate) type Visit<'a> = dyn FnMut(&str, String) + 'a;

/// What a text of one kind is made for, beside numbers that stand in constants.
#[derive(Clone, Copy, Default)]
struct Choice {
    /// At which group it is bound, and what the first number there is.
    place: (u32, u32),
    filter: Filter,
    /// Texels of the texture along one of the layer, where they are more than one.
    scale: Option<u32>,
    /// Whether it is of values that may not be mixed, so that the filter is nearest.
    is_unmixed: bool,
    atlas: Atlas,
    feedback: FeedbackMode,
    tables: TableKind,
    pages: PageSides,
    fade: bool,
}

impl Choice {
    fn kind(self) -> Kind {
        let Choice { filter, atlas, tables, pages, .. } = self;
        let (dims, scale, is_mixed) = (vastex::Dims::D2, self.scale.unwrap_or(1), !self.is_unmixed);
        Kind { dims, tables, pages, layer: 0, atlas, scale, filter, is_mixed }
    }

    fn text(self) -> String {
        wgsl(&Kinds::of(self.kind(), self.feedback, self.fade), self.place())
    }

    fn place(self) -> BindingPlace {
        BindingPlace { group: self.place.0, first: self.place.1 }
    }
}

/// Options of texts, all by all.
#[derive(Clone)]
struct Options {
    places: Vec<(u32, u32)>,
    scales: Vec<Option<u32>>,
    filters: Vec<Filter>,
    atlases: Vec<Atlas>,
    modes: Vec<FeedbackMode>,
    tables: Vec<TableKind>,
    pages: Vec<PageSides>,
    fades: Vec<bool>,
}

impl Options {
    /// What the library gives an application, whatever its textures, device and settings, but for numbers.
    fn all() -> Options {
        Options {
            places: vec![(0, 0)],
            scales: vec![None],
            filters: Filter::KINDS.to_vec(),
            atlases: Atlas::ALL.to_vec(),
            modes: FeedbackMode::ALL.to_vec(),
            tables: vec![TableKind::Direct, TableKind::Hashed],
            pages: vec![PageSides::Any, PageSides::PowersOfTwo],
            fades: vec![false, true],
        }
    }

    /// What is joined to long texts of the viewer. The sides of pages, and how many taps a filter takes, are
    /// constants of the library's text, of which both are among those of the library alone.
    fn of_viewer() -> Options {
        Options { pages: vec![PageSides::PowersOfTwo], ..Options::all() }
    }

    /// What the tests of the GPU crate ask for.
    fn of_tests() -> Options {
        Options { modes: vec![FeedbackMode::Separate], ..Options::all() }
    }

    fn each(&self, mut visit: impl FnMut(&Choice)) {
        for (&place, &scale) in
            self.places.iter().flat_map(|place| self.scales.iter().map(move |scale| (place, scale)))
        {
            for &filter in &self.filters {
                for &atlas in &self.atlases {
                    for &feedback in &self.modes {
                        let choice = Choice { place, scale, filter, atlas, feedback, ..Choice::default() };
                        for &tables in &self.tables {
                            for &pages in &self.pages {
                                for &fade in &self.fades {
                                    visit(&Choice { tables, pages, fade, ..choice });
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Calls `visit` with every text; one that comes again has another name.
pub(crate) fn each(visit: &mut Visit<'_>) {
    for (name, text) in compute_texts() {
        visit(&format!("library-{name}"), text);
    }
    visit("library-filters", filters_text());
    whole(visit);
    scenes(visit);
    examples(visit);
    benchmark(visit);
    of_tests::each(visit);
    branches(visit);
}

/// What the names of texts begin with that browsers are to refuse; they are handed to no device.
pub(crate) const TO_BE_REFUSED: &str = "refused-";

/// Sampling behind a condition: as every compiler takes it, and as a browser is to refuse it.
fn branches(visit: &mut Visit<'_>) {
    let (branch, vastex) = (include_str!("branch.wgsl"), Choice::default().text());
    visit("branch", branch.to_owned() + &vastex);
    let taken = [("sample", "id, surface.uv"), ("feedback", "id, 0u, surface.uv")];
    for (name, arguments) in taken {
        let by_gradients = format!("vastex_{name}_grad(surface.{arguments}, ddx, ddy)");
        assert!(branch.contains(&by_gradients), "{by_gradients}");
        let by_itself = branch.replace(&by_gradients, &format!("vastex_{name}(surface.{arguments})"));
        visit(&format!("{TO_BE_REFUSED}{name}"), by_itself + &vastex);
    }
}

/// An application of one texture by all of these options.
fn alone(visit: &mut Visit<'_>, name: &str, options: &Options, text: impl Fn(&str) -> String) {
    options.each(|options| visit(&format!("{name}-{}", name_of(options)), text(&options.text())));
}

/// The same where values may not be mixed: what differs from that of a nearest filter is that no tile fades
/// in.
fn unmixed(visit: &mut Visit<'_>, name: &str, options: &Options, text: impl Fn(&str) -> String) {
    let fading = Options { filters: vec![Filter::Nearest], fades: vec![true], ..options.clone() };
    fading.each(|choice| {
        let choice = Choice { is_unmixed: true, ..*choice };
        visit(&format!("{name}-{}", name_of(&choice)), text(&choice.text()));
    });
}

/// The library's text alone, all of it, for one texture and for a group: what an application joins to its
/// own. The other texts lack what their entry points do not need.
fn whole(visit: &mut Visit<'_>) {
    alone(visit, "library-whole", &Options::all(), str::to_owned);
    let surface = include_str!("../../../../crates/vastex-wgpu/tests/gpu/wgsl/whole_surface.wgsl");
    alone(visit, "library-surface", &Options::all(), |vastex| surface.replace("_NAME", "") + vastex);
    unmixed(visit, "library-surface", &Options::all(), |vastex| surface.replace("_NAME", "") + vastex);
    Options { atlases: vec![Atlas::Float], ..Options::all() }.each(|options| {
        let members =
            vec![member(options, "color", 0, 0), of_atlas(Atlas::Uint16, member(options, "height", 1, 0))];
        let text = group(options, members);
        visit(
            &format!("library-surface-group-{}", name_of(options)),
            surface.replace("NAME", "height") + &text,
        );
        visit(&format!("library-whole-group-{}", name_of(options)), text);
    });
}

fn scenes(visit: &mut Visit<'_>) {
    visit("encode", vastex_viewer::stage::encode_text());
    visit("mean", vastex_viewer::volume::mean_text());
    layer_lists::each(visit);
    lit_planets::each(visit);
    volumes::each(visit);
    alone(visit, "scene", &Options::of_viewer(), shaders::flat);
    unmixed(visit, "scene", &Options::of_viewer(), shaders::flat);
    numbers_of_scenes(visit);
    // Colour and heights are layers of one texture, one and the same, or of two textures.
    Options::of_viewer().each(|options| {
        for heights in Atlas::ALL {
            let height = |layer| of_atlas(heights, member(options, "height", 0, layer));
            let other = of_atlas(heights, member(options, "height", 1, 0));
            let apart = vec![member(options, "layer0", 0, 0), height(1)];
            let alike = vec![of_atlas(heights, member(options, "layer0", 0, 0)), height(0)];
            let others = vec![member(options, "layer0", 0, 0), other];
            for (members, name) in [(apart, "relief"), (alike, "relief-itself"), (others, "relief-other")] {
                let text = shaders::relief(&group(options, members), LayersText::BESIDE_HEIGHTS);
                visit(&format!("{name}-{}-{}", name_of(options), atlas_name(heights)), text);
            }
        }
    });
}

/// The tests' scenes of layers with fewer texels than their texture, of pages of any sides, and by filters of
/// other numbers of taps.
fn numbers_of_scenes(visit: &mut Visit<'_>) {
    let common = Options {
        atlases: vec![Atlas::Float],
        modes: vec![FeedbackMode::Separate],
        tables: vec![TableKind::Direct],
        fades: vec![false],
        ..Options::all()
    };
    let taps = ["anisotropic2", "anisotropic4", "anisotropic16"].map(|name| name.parse());
    let filters = taps.into_iter().flatten().chain(Filter::KINDS).collect();
    alone(visit, "scene-of-numbers", &Options { filters, ..common.clone() }, shaders::flat);
    let scaled = Options { scales: vec![Some(2), Some(4)], pages: vec![PageSides::PowersOfTwo], ..common };
    alone(visit, "scene-of-numbers", &scaled, shaders::flat);
    // Heights with fewer texels than colours.
    Options { filters: vec![Filter::Trilinear], ..scaled }.each(|options| {
        let color = Choice { scale: None, ..*options };
        let members = vec![member(&color, "layer0", 0, 0), member(options, "height", 0, 1)];
        let text = shaders::relief(&group(options, members), LayersText::BESIDE_HEIGHTS);
        visit(&format!("relief-of-numbers-{}", name_of(options)), text);
    });
}

/// What layers of a list are called.
const NAMES: [&str; 3] = ["layer0", "layer1", "layer2"];

/// A member that is a layer of a texture of a pool.
fn member(choice: &Choice, name: &str, pool: usize, layer: u8) -> KindMember {
    KindMember { name: name.to_owned(), pool, kind: Kind { layer, ..choice.kind() } }
}

fn of_atlas(atlas: Atlas, member: KindMember) -> KindMember {
    KindMember { kind: Kind { atlas, ..member.kind }, ..member }
}

fn examples(visit: &mut Visit<'_>) {
    let plain = Options { filters: vec![Filter::Trilinear], fades: vec![false], ..Options::all() };
    let ground = include_str!("../../../../crates/vastex/examples/existing_renderer/ground.wgsl");
    let grounds = Options { places: vec![(1, 0)], ..plain.clone() };
    alone(visit, "existing-renderer", &grounds, |vastex| ground.to_owned() + vastex);
    let materials = include_str!("../../../../crates/vastex/examples/many_materials/materials.wgsl");
    alone(visit, "many-materials", &plain, |vastex| materials.to_owned() + vastex);
    let (drawn, _) = materials.split_once("@vertex\nfn place_feedback").unwrap_or((materials, ""));
    visit("many-materials-ordinary", drawn.to_owned() + ORDINARY);
    four_groups(visit, &plain);
    alone(visit, "wall", &plain, |vastex| include_str!("../wall/wall.wgsl").to_owned() + vastex);
    alone(visit, "descent", &Options { filters: Filter::KINDS.to_vec(), ..plain.clone() }, shaders::descent);
    planets(visit);
}

/// The scene of chessmen, and with ordinary textures.
fn four_groups(visit: &mut Visit<'_>, plain: &Options) {
    let scene = include_str!("../../../../crates/vastex/examples/four_groups/scene.wgsl");
    let wanted = include_str!("../../../../crates/vastex/examples/four_groups/feedback.wgsl");
    let options = Options { places: vec![(2, 1)], ..plain.clone() };
    alone(visit, "four-groups", &options, |vastex| [scene, wanted, vastex].concat());
    visit("four-groups-ordinary", [scene, ORDINARY].concat());
}

/// A planet of every choice of attributes, 8 bits a channel but heights, which may be of 16, in the order in
/// which the example names them; and the tests' one.
fn planets(visit: &mut Visit<'_>) {
    use Attribute::{Clouds, Color, Height, Night};
    let mut planets: Vec<Vec<Attribute>> = vec![vec![Height, Color, Night, Clouds]];
    for chosen in 1..1_u32 << Attribute::ALL.len() {
        let is_chosen = |nth: &usize| chosen & (1 << nth) != 0;
        planets.push((0..Attribute::ALL.len()).filter(is_chosen).map(|nth| Attribute::ALL[nth]).collect());
    }
    for parts in planets {
        for heights in [Atlas::Float, Atlas::Uint16] {
            for (pages, name) in [(PageSides::PowersOfTwo, "powers"), (PageSides::Any, "clouds_any")] {
                for mode in FeedbackMode::ALL {
                    // Each is of a pool of its own, or those of 8 bits share one.
                    for is_shared in [false, true] {
                        let options =
                            Choice { feedback: mode, pages: PageSides::PowersOfTwo, ..Choice::default() };
                        let member = |(nth, part): (usize, &Attribute)| {
                            let is_alone = !is_shared || *part == Height || *part == Clouds;
                            let member = member(&options, part.name(), if is_alone { nth + 1 } else { 0 }, 0);
                            let atlas = if *part == Height { heights } else { Atlas::Float };
                            let pages = if *part == Clouds { pages } else { PageSides::PowersOfTwo };
                            KindMember { kind: Kind { atlas, pages, ..member.kind }, ..member }
                        };
                        let members = parts.iter().enumerate().map(member).collect();
                        let kinds = kinds_of(&options, members);
                        let text = wgsl(&kinds, options.place());
                        let parts_name: Vec<&str> = parts.iter().map(|part| part.name()).collect();
                        let shared = if is_shared { "-shared" } else { "" };
                        let name = format!(
                            "{}-{}-{name}-{}{shared}",
                            parts_name.join("_"),
                            atlas_name(heights),
                            mode.name()
                        );
                        let pools: Vec<usize> = kinds.member_pools().collect();
                        visit(&format!("planet-{name}"), shaders::planet(&text, &parts));
                        let ordinary = shaders::ordinary_planet(&text, &parts, &pools);
                        visit(&format!("planet_ordinary-{name}"), ordinary);
                    }
                }
            }
        }
    }
}

fn benchmark(visit: &mut Visit<'_>) {
    let options = Options {
        filters: vec![Filter::Trilinear],
        fades: vec![false],
        modes: vec![FeedbackMode::Separate],
        ..Options::all()
    };
    for (name, own, tables) in [
        ("", None, vec![TableKind::Direct, TableKind::Hashed]),
        ("-one_lookup", Some(bench::Own::OneLookup), vec![TableKind::Direct]),
        ("-loop", Some(bench::Own::Loop), vec![TableKind::Direct]),
    ] {
        let options = Options { tables, ..options.clone() };
        alone(visit, &format!("bench-lookups{name}"), &options, |vastex| bench::picture(vastex, own));
    }
}

/// The text for a group.
fn group(choice: &Choice, members: Vec<KindMember>) -> String {
    wgsl(&kinds_of(choice, members), choice.place())
}

#[expect(clippy::expect_used, reason = "these are the project's own names")]
fn kinds_of(choice: &Choice, members: Vec<KindMember>) -> Kinds {
    Kinds::of_group(members, choice.feedback, choice.fade).expect("names of members are fit")
}

fn atlas_name(atlas: Atlas) -> &'static str {
    match atlas {
        Atlas::Float => "float",
        Atlas::Unfiltered => "unfiltered",
        Atlas::Uint16 => "uint16",
        Atlas::Uint16Rgba => "uint16_rgba",
        Atlas::HighLow => "high_low",
        Atlas::Whole => "whole",
    }
}

/// For file names.
fn name_of(options: &Choice) -> String {
    let Choice { place, filter, scale, is_unmixed, atlas, feedback, tables, pages, fade } = options;
    let mut name = format!("{filter}-{}-{}", atlas_name(*atlas), feedback.name());
    name += if *is_unmixed { "-unmixed" } else { "" };
    name += match tables {
        TableKind::Direct => "-direct",
        TableKind::Hashed => "-hashed",
    };
    name += match pages {
        PageSides::Any => "-any",
        PageSides::PowersOfTwo => "-powers",
    };
    name += if *fade { "-fading" } else { "" };
    // Writing to a String cannot fail.
    if let Some(scale) = scale {
        let _ = write!(name, "-by{scale}");
    }
    if *place != (0, 0) {
        let _ = write!(name, "-group{}", place.0);
    }
    name
}
