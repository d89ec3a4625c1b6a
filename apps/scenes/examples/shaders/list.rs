//! Every shader text that the project hands to a device: the library's, the scenes', the examples', the benchmark's and the tests'.
//!
//! Whatever makes a text from options makes it here of all of them, by the functions that make it for a device. Where options are
//! numbers, of taps and of bind groups, there are those that the project uses. The suite fails for a text that is handed to a device
//! and is not among these.

use std::fmt::Write as _;

use vastex::{Filter, MaxTaps};
use vastex_scenes::{Attribute, shaders};
use vastex_wgpu::{
    Atlas, FeedbackWay, GroupMember, GroupShape, PageSides, ShaderOptions, TableKinds, compute_texts,
    group_wgsl, wgsl,
};

#[path = "../../benches/draw/texts.rs"]
mod bench;
#[allow(unreachable_pub, reason = "a module of a test program")]
#[path = "../../../../crates/vastex/tests/suite/common/texts.rs"]
mod vastex_tests;

/// What is called with each text and its name.
pub(crate) type Visit<'a> = dyn FnMut(&str, String) + 'a;

/// Options of texts, all by all.
#[derive(Clone)]
struct Options {
    groups: Vec<u32>,
    filters: Vec<Filter>,
    atlases: Vec<Atlas>,
    ways: Vec<FeedbackWay>,
    tables: Vec<TableKinds>,
    pages: Vec<PageSides>,
    fades: Vec<bool>,
}

impl Options {
    /// What the library gives an application, whatever its textures, device and settings are, but for the numbers.
    fn all() -> Options {
        Options {
            groups: vec![0],
            filters: Filter::KINDS.to_vec(),
            atlases: Atlas::ALL.to_vec(),
            ways: FeedbackWay::ALL.to_vec(),
            tables: vec![TableKinds::Direct, TableKinds::Hashed],
            pages: vec![PageSides::Any, PageSides::PowersOfTwo],
            fades: vec![false, true],
        }
    }

    /// What the tests of the GPU crate ask for.
    fn of_tests() -> Options {
        Options { ways: vec![FeedbackWay::Separate], tables: vec![TableKinds::Either], ..Options::all() }
    }

    fn each(&self, mut visit: impl FnMut(&ShaderOptions)) {
        for &group in &self.groups {
            for &filter in &self.filters {
                for &atlas in &self.atlases {
                    for &feedback in &self.ways {
                        for &tables in &self.tables {
                            for &pages in &self.pages {
                                for &fade in &self.fades {
                                    let options =
                                        ShaderOptions { group, filter, atlas, feedback, tables, pages, fade };
                                    visit(&options);
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Every filter.
fn all_filters() -> Vec<Filter> {
    let anisotropic = MaxTaps::ALL.into_iter().map(Filter::Anisotropic);
    let others = anisotropic.filter(|filter| !Filter::KINDS.contains(filter));
    Filter::KINDS.into_iter().chain(others).collect()
}

/// Calls `visit` with every text; one that comes again has another name.
pub(crate) fn each(visit: &mut Visit<'_>) {
    for (name, text) in compute_texts() {
        visit(&format!("library-{name}"), text);
    }
    whole(visit);
    scenes(visit);
    examples(visit);
    benchmark(visit);
    tests(visit);
}

/// An application of one texture by all of these options.
fn alone(visit: &mut Visit<'_>, name: &str, options: &Options, text: impl Fn(&str) -> String) {
    options.each(|options| visit(&format!("{name}-{}", name_of(options)), text(&wgsl(options))));
}

/// The library's text alone, all of it, for one texture and for a group: what an application joins to its own. The other texts lack what
/// their entry points do not need.
fn whole(visit: &mut Visit<'_>) {
    alone(visit, "library-whole", &Options::all(), str::to_owned);
    Options { atlases: vec![Atlas::Float], ..Options::all() }.each(|options| {
        let members = vec![
            member(options, "color", 0, (None, true)),
            GroupMember { atlas: Atlas::Uint16, ..member(options, "height", 1, (None, true)) },
        ];
        visit(&format!("library-whole-group-{}", name_of(options)), group(options, members));
    });
}

fn scenes(visit: &mut Visit<'_>) {
    alone(visit, "scene", &Options { filters: all_filters(), ..Options::all() }, shaders::flat);
    // Colour and heights are layers of one texture. Each may be one whose values may not be mixed: labels in formats that every device
    // filters, over heights of 8 or 16 bits.
    let nearest = (Some(Filter::Nearest), false);
    let plain = (None, true);
    Options { filters: all_filters(), ..Options::all() }.each(|options| {
        for heights in Atlas::ALL {
            let mixed = [
                ("", plain, plain),
                ("-color_nearest", nearest, plain),
                ("-height_nearest", plain, nearest),
                ("-both_nearest", nearest, nearest),
            ];
            let may_be_labels =
                options.atlas == Atlas::Float && matches!(heights, Atlas::Float | Atlas::Uint16);
            for (name, color, height) in mixed {
                if name.is_empty() || may_be_labels {
                    let members = vec![
                        member(options, "color", 0, color),
                        GroupMember { atlas: heights, ..member(options, "height", 0, height) },
                    ];
                    let text = shaders::relief(&group(options, members));
                    visit(&format!("relief-{}-{}{name}", name_of(options), atlas_name(heights)), text);
                }
            }
        }
    });
}

/// A member with a filter of its own or the group's, and whether its tiles fade in where the group's do.
fn member(
    options: &ShaderOptions,
    name: &str,
    texture: usize,
    (filter, fades): (Option<Filter>, bool),
) -> GroupMember {
    let ShaderOptions { atlas, tables, pages, .. } = *options;
    GroupMember { name: name.to_owned(), texture, atlas, tables, pages, filter, fades }
}

fn examples(visit: &mut Visit<'_>) {
    let plain = Options { filters: vec![Filter::Trilinear], fades: vec![false], ..Options::all() };
    let ground = include_str!("../../../../crates/vastex/examples/existing_renderer/ground.wgsl");
    let grounds = Options { groups: vec![1], ..plain.clone() };
    alone(visit, "existing-renderer", &grounds, |vastex| ground.to_owned() + vastex);
    alone(visit, "wall", &plain, |vastex| include_str!("../wall/wall.wgsl").to_owned() + vastex);
    alone(visit, "descent", &Options { filters: Filter::KINDS.to_vec(), ..plain.clone() }, shaders::descent);
    planets(visit);
}

/// A planet of every choice of attributes, 8 bits a channel but heights, which may be of 16, in the order in which the example names
/// them; and the tests' one.
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
                let member = |(texture, part): (usize, &Attribute)| GroupMember {
                    name: part.name().to_owned(),
                    texture,
                    atlas: if *part == Height { heights } else { Atlas::Float },
                    tables: TableKinds::Direct,
                    pages: if *part == Clouds { pages } else { PageSides::PowersOfTwo },
                    filter: None,
                    fades: true,
                };
                for way in FeedbackWay::ALL {
                    let members = parts.iter().enumerate().map(member).collect();
                    let options = ShaderOptions { feedback: way, ..ShaderOptions::default() };
                    let text = group(&options, members);
                    let parts_name: Vec<&str> = parts.iter().map(|part| part.name()).collect();
                    let name =
                        format!("{}-{}-{name}-{}", parts_name.join("_"), atlas_name(heights), way.name());
                    visit(&format!("planet-{name}"), shaders::planet(&text, &parts));
                    visit(&format!("planet_ordinary-{name}"), shaders::ordinary_planet(&text, &parts));
                }
            }
        }
    }
}

fn benchmark(visit: &mut Visit<'_>) {
    let tables = vec![TableKinds::Either, TableKinds::Direct, TableKinds::Hashed];
    let options = Options {
        filters: vec![Filter::Trilinear],
        fades: vec![false],
        ways: vec![FeedbackWay::Separate],
        tables,
        ..Options::all()
    };
    for (name, own) in
        [("", None), ("-one_lookup", Some(bench::Own::OneLookup)), ("-loop", Some(bench::Own::Loop))]
    {
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
    for (name, options, text) in [
        ("disc", plain.clone(), of_gpu_tests!("disc")),
        ("plane", of(Filter::Trilinear), of_gpu_tests!("plane")),
        ("ground", plain.clone(), of_gpu_tests!("ground")),
        ("inspect", of(Filter::Bilinear), of_gpu_tests!("inspect")),
        ("texture_space", of(Filter::Nearest), of_gpu_tests!("texture_space")),
        ("folding", of(Filter::Trilinear), of_gpu_tests!("folding")),
        ("fixed", Options { pages: all.pages.clone(), ..plain.clone() }, of_gpu_tests!("fixed")),
        ("exact", Options { atlases: Atlas::ALL.to_vec(), ..plain.clone() }, of_gpu_tests!("exact")),
        ("harness", all.clone(), of_gpu_tests!("harness")),
    ] {
        alone(visit, &format!("test-{name}"), &options, |vastex| text.to_owned() + vastex);
    }
    let points = of_gpu_tests!("points");
    alone(visit, "test-points", &plain, |vastex| format!("{points}\nconst SIDE: u32 = 64u;\n{vastex}"));
    let inline = Options { ways: vec![FeedbackWay::Inline], ..of(Filter::Trilinear) };
    alone(visit, "test-surfaces", &inline, |vastex| of_gpu_tests!("surfaces").to_owned() + vastex);
    visit("test-fill", of_gpu_tests!("fill").to_owned());
    groups_of_gpu_tests(visit, of_gpu_tests!("harness"));
    let screen = Options { atlases: vec![Atlas::Float], ..Options::all() };
    alone(visit, "test-screen", &screen, |vastex| vastex_tests::SCREEN.to_owned() + vastex);
    let telling = Options { filters: vec![Filter::Nearest, Filter::Trilinear], ..screen.clone() };
    alone(visit, "test-telling", &telling, |vastex| vastex_tests::telling() + vastex);
    let fixed = Options { filters: vec![Filter::Nearest], fades: vec![false], ..screen.clone() };
    alone(visit, "test-screen_fixed", &fixed, |vastex| vastex_tests::fixed() + vastex);
    let separate = Options { ways: vec![FeedbackWay::Separate], fades: vec![false], ..Options::all() };
    alone(visit, "test-sample_cpu", &separate, |vastex| vastex_tests::POINTS.to_owned() + vastex);
    groups_of_vastex_tests(visit);
    mixing_of_vastex_tests(visit);
}

/// A colour and a height of one texture, and two textures, each member called as one alone is, and the group's feedback.
fn groups_of_gpu_tests(visit: &mut Visit<'_>, harness: &str) {
    let names = ["color", "height", "night", "clouds_2"];
    let atlases = vec![Atlas::Float, Atlas::Unfiltered];
    let options = Options { atlases, pages: vec![PageSides::PowersOfTwo], ..Options::of_tests() };
    options.each(|options| {
        let member = |(nth, texture): (usize, usize)| GroupMember {
            name: names[nth].to_owned(),
            texture,
            atlas: if names[nth] == "height" { options.atlas } else { Atlas::Float },
            tables: [TableKinds::Hashed, TableKinds::Direct, TableKinds::Hashed][texture],
            pages: options.pages,
            filter: None,
            fades: true,
        };
        let text = group(options, [0, 0, 1, 2].into_iter().enumerate().map(member).collect());
        for sampled in names {
            for wanted in [format!("vastex_feedback_{sampled}"), "vastex_feedback".to_owned()] {
                // What the whole group wants is looked at once.
                if wanted == "vastex_feedback" && sampled != "color" {
                    continue;
                }
                let harness = harness
                    .replace("vastex_sample", &format!("vastex_sample_{sampled}"))
                    .replace("vastex_feedback", &wanted);
                let name = format!("test-group-{}-{sampled}-{wanted}", name_of(options));
                visit(&name, harness + &text);
            }
        }
    });
}

fn groups_of_vastex_tests(visit: &mut Visit<'_>) {
    let filters = vec![Filter::Nearest, Filter::Trilinear];
    let options = Options { atlases: vec![Atlas::Float], filters, ..Options::all() };
    options.each(|options| {
        let members = |names: &[&str]| -> Vec<GroupMember> {
            names
                .iter()
                .enumerate()
                .map(|(texture, name)| member(options, name, texture, (None, true)))
                .collect()
        };
        let columns = group(options, members(&vastex_tests::NAMES));
        visit(&format!("test-columns-{}", name_of(options)), vastex_tests::by_columns() + &columns);
        visit(&format!("test-apart-{}", name_of(options)), vastex_tests::apart() + &columns);
        let [first, second, again] = [("first", 0), ("second", 1), ("again", 1)];
        let halves = [first, second, again]
            .map(|(name, texture)| member(options, name, texture, (None, true)))
            .to_vec();
        visit(&format!("test-halves-{}", name_of(options)), vastex_tests::halves() + &group(options, halves));
    });
}

/// Two layers of a texture, or of two, of which one may not be mixed.
fn mixing_of_vastex_tests(visit: &mut Visit<'_>) {
    let (atlases, filters) = (vec![Atlas::Float], vec![Filter::KINDS[3]]);
    let options = Options { atlases, filters, fades: vec![false], ..Options::all() };
    options.each(|options| {
        for (wanted, texture) in [(0, 0), (1, 0), (2, 1)] {
            let members = vec![
                member(options, "value", 0, (None, true)),
                member(options, "label", texture, (Some(Filter::Nearest), false)),
            ];
            let text = vastex_tests::two_filters(wanted) + &group(options, members);
            visit(&format!("test-mixing-{wanted}-{}", name_of(options)), text);
        }
    });
}

/// The text for a group with feedback of its own.
#[expect(clippy::expect_used, reason = "these are the project's own names")]
fn group(options: &ShaderOptions, members: Vec<GroupMember>) -> String {
    let shape = GroupShape::new(members, true).expect("names of members are fit").with_fade(options.fade);
    group_wgsl(options.group, options.filter, options.feedback, &shape)
}

fn atlas_name(atlas: Atlas) -> &'static str {
    match atlas {
        Atlas::Float => "float",
        Atlas::Unfiltered => "unfiltered",
        Atlas::Uint16 => "uint16",
        Atlas::Uint16Rgba => "uint16_rgba",
    }
}

/// For file names.
fn name_of(options: &ShaderOptions) -> String {
    let ShaderOptions { group, filter, atlas, feedback, tables, pages, fade } = options;
    let mut name = format!("{filter}-{}-{}", atlas_name(*atlas), feedback.name());
    name += match tables {
        TableKinds::Either => "-either",
        TableKinds::Direct => "-direct",
        TableKinds::Hashed => "-hashed",
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
