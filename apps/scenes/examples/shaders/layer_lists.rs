//! The shader texts of lists of layers.

use vastex::Filter;
use vastex_scenes::shaders;
use vastex_viewer::LayersText;
use vastex_viewer::layers::MOST_LAYERS;
use vastex_wgpu::{Atlas, FeedbackMode, KindMember, TableKind, wgsl};

use super::{Choice, NAMES, Options, Visit, atlas_name, kinds_of, member, name_of, of_atlas};

/// The text of a list of the first so many of these, and the part of it that goes through them.
fn listed(options: &Choice, members: Vec<KindMember>, count: usize) -> (String, LayersText) {
    let kinds = kinds_of(options, members);
    (wgsl(&kinds, options.place()), LayersText::list(&kinds, count))
}

/// Of a list without heights.
fn flat(options: &Choice, members: Vec<KindMember>) -> String {
    let count = members.len();
    let (text, layers) = listed(options, members, count);
    shaders::layered(&text, layers)
}

/// Of a list of textures of unlike size that lie texel upon texel.
fn by_texel(options: &Choice, members: Vec<KindMember>) -> String {
    let count = members.len();
    let (text, layers) = listed(options, members, count);
    shaders::layered(&text, LayersText { is_by_texel: true, ..layers })
}

/// Of one over heights, which are the last.
fn relief(options: &Choice, members: Vec<KindMember>) -> String {
    let count = members.len() - 1;
    let (text, layers) = listed(options, members, count);
    shaders::relief(&text, layers)
}

/// Lists of layers, as the tests have them: each of a pool of its own, or all of one, of a texture or of
/// several, by filters of their own; and two over heights, which are the second or none of them.
pub(super) fn each(visit: &mut Visit<'_>) {
    let options = Options { filters: vec![Filter::Trilinear], fades: vec![false], ..Options::of_viewer() };
    options.each(|options| {
        let filters = |nth: usize, bits: usize| {
            if bits >> nth & 1 == 1 { Filter::Nearest } else { Filter::Trilinear }
        };
        for (count, bits) in (1..=3).flat_map(|count| (0..1 << count).map(move |bits| (count, bits))) {
            for (pools, is_one_texture) in [(count, false), (1, false), (1, true)] {
                let layer = |n: usize| {
                    let member =
                        member(options, NAMES[n], n % pools, if is_one_texture { n as u8 } else { 0 });
                    KindMember { kind: member.kind.filtered(filters(n, bits)), ..member }
                };
                let text = flat(options, (0..count).map(layer).collect());
                let of = if is_one_texture { "-one" } else { "" };
                let by = if bits == 0 { String::new() } else { format!("-by{bits}") };
                visit(&format!("layered-{count}-{pools}{of}{by}-{}", name_of(options)), text);
                // Two images over one another, smooth or seen near.
                if count == 2 && !is_one_texture && matches!(bits, 0 | 3) {
                    let text = by_texel(options, (0..count).map(layer).collect());
                    visit(&format!("layered-by-texel-{pools}{by}-{}", name_of(options)), text);
                }
            }
        }
        let first_again = [0, 1, 0].iter().zip(NAMES).map(|(pool, name)| member(options, name, *pool, 0));
        let text = flat(options, first_again.collect());
        visit(&format!("layered-3-first-again-{}", name_of(options)), text);
        // One layer that is no opaque one, over heights that are another layer of its texture or itself.
        for (heights, layer) in Atlas::ALL.into_iter().flat_map(|atlas| [0, 1].map(|layer| (atlas, layer))) {
            let first = if layer == 0 { heights } else { Atlas::Float };
            let members = vec![
                of_atlas(first, member(options, "layer0", 0, 0)),
                of_atlas(heights, member(options, "height", 0, layer)),
            ];
            let text = relief(options, members);
            let of = format!("{}-{layer}", atlas_name(heights));
            visit(&format!("layered-relief-one-{of}-{}", name_of(options)), text);
        }
        // One or two layers of a texture over heights that are of another.
        for (heights, count) in Atlas::ALL.into_iter().flat_map(|atlas| [1, 2].map(|count| (atlas, count))) {
            let mut members: Vec<_> = (0..count).map(|n| member(options, NAMES[n], 0, n as u8)).collect();
            members.push(of_atlas(heights, member(options, "height", 1, 0)));
            let text = relief(options, members);
            let of = format!("{count}-{}", atlas_name(heights));
            visit(&format!("layered-relief-other-{of}-{}", name_of(options)), text);
        }
        // And one layer twice over heights that are of another texture.
        for heights in Atlas::ALL {
            let mut members: Vec<_> = NAMES[..2].iter().map(|name| member(options, name, 0, 0)).collect();
            members.push(of_atlas(heights, member(options, "height", 1, 0)));
            let text = relief(options, members);
            visit(&format!("layered-relief-again-{}-{}", atlas_name(heights), name_of(options)), text);
        }
        for (heights, layer) in Atlas::ALL.into_iter().flat_map(|atlas| [1, 2].map(|layer| (atlas, layer))) {
            for first in [Atlas::Float, heights] {
                let members = vec![
                    of_atlas(first, member(options, "layer0", 0, 0)),
                    of_atlas(if layer == 1 { heights } else { first }, member(options, "layer1", 0, 1)),
                    of_atlas(heights, member(options, "height", 0, layer)),
                ];
                let text = relief(options, members);
                let of = format!("{}-{}-{layer}", atlas_name(first), atlas_name(heights));
                visit(&format!("layered-relief-{of}-{}", name_of(options)), text);
            }
        }
    });
    many(visit);
}

/// As many layers as a list may have, by filters of several taps: textures of one pool, or each of a pool of
/// its own.
fn many(visit: &mut Visit<'_>) {
    let (filters, tables) = (vec![Filter::KINDS[3], Filter::Bicubic], vec![TableKind::Direct]);
    let (atlases, modes) = (vec![Atlas::Float], vec![FeedbackMode::Separate]);
    let options = Options { filters, tables, atlases, modes, fades: vec![false], ..Options::of_viewer() };
    options.each(|options| {
        for (of, pools) in [("alike", 1), ("apart", MOST_LAYERS)] {
            let layer = |n: usize| member(options, &format!("layer{n}"), n % pools, 0);
            let text = flat(options, (0..MOST_LAYERS).map(layer).collect());
            visit(&format!("layered-many-{of}-{}", name_of(options)), text);
        }
    });
}
