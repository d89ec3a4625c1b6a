//! The shader texts of tests.

use vastex::Filter;
use vastex_wgpu::{Atlas, FeedbackMode, Kind, KindMember, PageSides, TableKind};

use super::{Choice, Options, Visit, alone, group, member, name_of, table_texts, unmixed, vastex_tests};

/// The texts of the tests of the library's crates: alone, of groups, and of layers that are mixed or not.
pub(super) fn each(visit: &mut Visit<'_>) {
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
    let scaled = Options {
        scales: vec![Some(2), Some(4)],
        atlases: vec![Atlas::Float],
        pages: vec![PageSides::PowersOfTwo],
        ..all.clone()
    };
    alone(visit, "test-harness", &scaled, |vastex| of_test(of_gpu_tests!("harness"), vastex));
    let points = of_gpu_tests!("points");
    alone(visit, "test-points", &of_pages(plain.clone()), |vastex| {
        of_test(&format!("{points}\nconst SIDE: u32 = 64u;"), vastex)
    });
    let inline = Options { modes: vec![FeedbackMode::Inline], ..of(Filter::Trilinear) };
    alone(visit, "test-surfaces", &inline, |vastex| {
        of_test(of_gpu_tests!("surfaces"), vastex) + "\noverride VIEW: u32 = 0u;\n"
    });
    visit("test-fill", of_gpu_tests!("fill").to_owned());
    for mode in [FeedbackMode::Separate, FeedbackMode::Raw] {
        visit(&format!("test-tables-{}", mode.name()), table_texts::text(mode));
    }
    groups_of_gpu_tests(visit, of_gpu_tests!("harness"));
    let screen = Options { atlases: vec![Atlas::Float], ..Options::all() };
    alone(visit, "test-screen", &screen, |vastex| vastex_tests::SCREEN.to_owned() + vastex);
    unmixed(visit, "test-screen", &screen, |vastex| vastex_tests::SCREEN.to_owned() + vastex);
    let scaled = Options { modes: vec![FeedbackMode::Separate], filters: vec![Filter::Trilinear], ..scaled };
    alone(visit, "test-screen", &scaled, |vastex| vastex_tests::SCREEN.to_owned() + vastex);
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
            // Heights have half as many texels along a side.
            let (atlas, scale) = if names[nth] == "height" { (options.atlas, 2) } else { (Atlas::Float, 1) };
            KindMember { kind: Kind { atlas, tables, scale, ..member.kind }, ..member }
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
                visit(&name, of_test(&harness, &text) + "\noverride WANTED: u32 = 0u;\n");
            }
        }
    });
}

/// A test's shader, whose pipelines are told an id.
pub(super) fn of_test(shader: &str, vastex: &str) -> String {
    format!("{shader}\n{vastex}\noverride ID: u32 = 0u;\n")
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
