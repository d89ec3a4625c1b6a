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
    group: u32,
    filter: Filter,
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
        let (dims, is_mixed) = (vastex::Dims::D2, !self.is_unmixed);
        Kind { dims, tables, pages, layer: 0, atlas, scale: 1, filter, is_mixed }
    }

    fn text(self) -> String {
        wgsl(&Kinds::of(self.kind(), self.feedback, self.fade), self.place())
    }

    fn place(self) -> BindingPlace {
        BindingPlace { group: self.group, first: 0 }
    }
}

/// Options of texts, all by all.
#[derive(Clone)]
struct Options {
    groups: Vec<u32>,
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
            groups: vec![0],
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
        for &group in &self.groups {
            for &filter in &self.filters {
                for &atlas in &self.atlases {
                    for &feedback in &self.modes {
                        let choice = Choice { group, filter, atlas, feedback, ..Choice::default() };
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
    tests(visit);
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
    let grounds = Options { groups: vec![1], ..plain.clone() };
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
    let options = Options { groups: vec![2], ..plain.clone() };
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

fn tests(visit: &mut Visit<'_>) {
    macro_rules! of_gpu_tests {
        ($name:literal) => {
            include_str!(concat!("../../../../crates/vastex-wgpu/tests/gpu/wgsl/", $name, ".wgsl"))
        };
    }
    let all = Options::of_tests();
    // Most tests are of one or two options; those of what is sampled are of all.
    let plain = Options {
        atlases: vec![Atlas::Float],
        pages: vec![PageSides::Any],
        fades: vec![false],
        ..all.clone()
    };
    let of = |filter| Options { filters: vec![filter], ..plain.clone() };
    // Whatever the sides of pages are.
    let of_pages = |options| Options { pages: all.pages.clone(), ..options };
    let nearest_harness = of_gpu_tests!("harness").replace("vastex_sample_", "vastex_sample_nearest_");
    for (name, options, text) in [
        ("disc", of_pages(plain.clone()), of_gpu_tests!("disc")),
        ("plane", of_pages(of(Filter::Trilinear)), of_gpu_tests!("plane")),
        ("ground", plain.clone(), of_gpu_tests!("ground")),
        ("inspect", of_pages(of(Filter::Bilinear)), of_gpu_tests!("inspect")),
        ("texture_space", of(Filter::Nearest), of_gpu_tests!("texture_space")),
        ("folding", of(Filter::Nearest), of_gpu_tests!("folding")),
        ("fixed", of_pages(plain.clone()), of_gpu_tests!("fixed")),
        (
            "exact",
            of_pages(Options { atlases: Atlas::ALL.to_vec(), ..plain.clone() }),
            of_gpu_tests!("exact"),
        ),
        ("harness", all.clone(), of_gpu_tests!("harness")),
        ("nearest_harness", of_pages(plain.clone()), &nearest_harness),
    ] {
        alone(visit, &format!("test-{name}"), &options, |vastex| of_test(text, vastex));
    }
    unmixed(visit, "test-harness", &all, |vastex| of_test(of_gpu_tests!("harness"), vastex));
    let points = of_gpu_tests!("points");
    alone(visit, "test-points", &of_pages(plain.clone()), |vastex| {
        of_test(&format!("{points}\nconst SIDE: u32 = 64u;"), vastex)
    });
    let inline = Options { modes: vec![FeedbackMode::Inline], ..of(Filter::Trilinear) };
    alone(visit, "test-surfaces", &inline, |vastex| {
        of_test(&format!("{}\nconst VIEW: u32 = 0u;", of_gpu_tests!("surfaces")), vastex)
    });
    visit("test-fill", of_gpu_tests!("fill").to_owned());
    for mode in [FeedbackMode::Separate, FeedbackMode::Raw] {
        visit(&format!("test-tables-{}", mode.name()), table_texts::text(mode));
    }
    groups_of_gpu_tests(visit, of_gpu_tests!("harness"));
    let screen = Options { atlases: vec![Atlas::Float], ..Options::all() };
    alone(visit, "test-screen", &screen, |vastex| vastex_tests::SCREEN.to_owned() + vastex);
    unmixed(visit, "test-screen", &screen, |vastex| vastex_tests::SCREEN.to_owned() + vastex);
    let telling = Options { filters: Filter::KINDS.to_vec(), ..screen.clone() };
    alone(visit, "test-telling", &telling, |vastex| vastex_tests::telling() + vastex);
    let plain = Options { fades: vec![false], ..screen.clone() };
    alone(visit, "test-scales", &plain, |vastex| vastex_tests::scales() + vastex);
    alone(visit, "test-checkered", &plain, |vastex| vastex_tests::checkered() + vastex);
    let nearest = Options { filters: vec![Filter::Nearest], ..plain };
    for (is_small, by_gradients) in [(false, false), (false, true), (true, false), (true, true)] {
        let name = format!("test-quarter-{is_small}-{by_gradients}");
        let (text, _) = vastex_tests::quarter(is_small, by_gradients);
        alone(visit, &name, &nearest, |vastex| format!("{text}{vastex}"));
    }
    let fixed = Options { filters: vec![Filter::Nearest], fades: vec![false], ..screen.clone() };
    alone(visit, "test-screen_fixed", &fixed, |vastex| vastex_tests::fixed() + vastex);
    let separate = Options { modes: vec![FeedbackMode::Separate], fades: vec![false], ..Options::all() };
    alone(visit, "test-sample_cpu", &separate, |vastex| of_test(vastex_tests::POINTS, vastex));
    groups_of_vastex_tests(visit);
    mixing_of_vastex_tests(visit);
}

/// Colour and height of one texture, and two textures, each called as one alone is; the group's feedback.
fn groups_of_gpu_tests(visit: &mut Visit<'_>, harness: &str) {
    let names = ["color", "height", "night", "clouds_2"];
    let atlases = vec![Atlas::Float, Atlas::Unfiltered];
    let options = Options { atlases, pages: vec![PageSides::PowersOfTwo], ..Options::of_tests() };
    options.each(|options| {
        let member = |(nth, pool): (usize, usize)| {
            let tables = [TableKind::Hashed, TableKind::Direct, TableKind::Hashed][pool];
            let member = member(options, names[nth], pool, u8::from(nth == 1));
            let atlas = if names[nth] == "height" { options.atlas } else { Atlas::Float };
            KindMember { kind: Kind { atlas, tables, ..member.kind }, ..member }
        };
        let text = group(options, [0, 0, 1, 2].into_iter().enumerate().map(member).collect());
        for sampled in names {
            for wanted in [format!("vastex_feedback_{sampled}"), "vastex_feedback".to_owned()] {
                // What the whole group wants is looked at once.
                if wanted == "vastex_feedback" && sampled != "color" {
                    continue;
                }
                let harness = harness
                    .replace("vastex_feedback_level(ID", "vastex_feedback_level(WANTED")
                    .replace("vastex_feedback_grad(ID", "vastex_feedback_grad(WANTED")
                    .replace("vastex_sample", &format!("vastex_sample_{sampled}"))
                    .replace("vastex_feedback_", &format!("{wanted}_"));
                let name = format!("test-group-{}-{sampled}-{wanted}", name_of(options));
                visit(&name, of_test(&format!("{harness}\nconst WANTED: u32 = 0u;"), &text));
            }
        }
    });
}

/// A test's shader, with an id in a constant.
fn of_test(shader: &str, vastex: &str) -> String {
    format!("{shader}\nconst ID: u32 = 0u;\n{vastex}")
}

fn groups_of_vastex_tests(visit: &mut Visit<'_>) {
    let filters = vec![Filter::Nearest, Filter::Trilinear];
    let options = Options { atlases: vec![Atlas::Float], filters, ..Options::all() };
    options.each(|options| {
        let of_pools = |pools: &[(&str, usize)]| -> String {
            group(options, pools.iter().map(|(name, pool)| member(options, name, *pool, 0)).collect())
        };
        let [color, night, clouds, height] = vastex_tests::NAMES;
        // Two of the four have pages as large, and so share a pool.
        let columns = of_pools(&[(color, 0), (night, 1), (clouds, 2), (height, 1)]);
        visit(&format!("test-columns-{}", name_of(options)), vastex_tests::by_columns() + &columns);
        visit(&format!("test-apart-{}", name_of(options)), vastex_tests::apart() + &columns);
        for pools in [[0, 1, 1], [0, 0, 0]] {
            let names = ["first", "second", "again"];
            let members: Vec<(&str, usize)> = names.into_iter().zip(pools).collect();
            let name = format!("test-halves-{}-{}", pools[1], name_of(options));
            visit(&name, vastex_tests::halves() + &of_pools(&members));
        }
    });
}

/// Two layers of a texture, or of two.
fn mixing_of_vastex_tests(visit: &mut Visit<'_>) {
    let (atlases, filters) = (vec![Atlas::Float], vec![Filter::KINDS[3]]);
    let options = Options { atlases, filters, fades: vec![false], ..Options::all() };
    options.each(|options| {
        for wanted in 0..3 {
            let label = member(&Choice { is_unmixed: true, ..*options }, "label", 0, 1);
            let members = vec![member(options, "value", 0, 0), label];
            let text = vastex_tests::two_filters(wanted) + &group(options, members);
            visit(&format!("test-mixing-{wanted}-{}", name_of(options)), text);
        }
    });
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
    let Choice { group, filter, is_unmixed, atlas, feedback, tables, pages, fade } = options;
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
    if *group != 0 {
        // Writing to a String cannot fail.
        let _ = write!(name, "-group{group}");
    }
    name
}
