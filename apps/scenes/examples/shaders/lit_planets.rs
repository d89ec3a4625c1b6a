//! The shader texts of planets under a sun.

use vastex::Filter;
use vastex_scenes::shaders;
use vastex_viewer::{LayersText, PlanetText};
use vastex_wgpu::{Atlas, Kind, KindMember, PageSides, TableKind};

use super::{Choice, NAMES, Options, Visit, atlas_name, group, member, name_of, of_atlas};

/// Planets: with lights, with clouds, with both and with neither, each texture of a pool of its own, or
/// all of one, or lights and clouds of one; and heights of another, or the ground in their place. The texels
/// of the ground are filtered, or seen as they are: heights are filtered whatever the ground's filter is, and
/// lights and clouds by filters of their own.
pub(super) fn each(visit: &mut Visit<'_>) {
    let options = Options { filters: vec![Filter::Trilinear], fades: vec![false], ..Options::of_viewer() };
    options.each(|options| {
        for parts in [(false, false), (false, true), (true, false), (true, true)] {
            for has_texels in [true, false] {
                each_of(visit, options, parts, has_texels);
            }
        }
    });
}

/// Planets with lights and clouds, or not, over ground whose texels are seen as they are, or not.
fn each_of(visit: &mut Visit<'_>, options: &Choice, (has_night, has_clouds): (bool, bool), has_texels: bool) {
    let layers = LayersText::planet(PlanetText { has_night, has_clouds });
    let nearest = |member: KindMember| KindMember { kind: member.kind.filtered(Filter::Nearest), ..member };
    let ground_in = |pools: &dyn Fn(usize) -> usize| -> Vec<KindMember> {
        let of = |n: usize| member(options, NAMES[n], pools(n), 0);
        (0..layers.count).map(|n| if n == 0 && has_texels { nearest(of(n)) } else { of(n) }).collect()
    };
    let ground_of = |most: usize| ground_in(&|n| n.min(most));
    let ground = ground_of(layers.count);
    let mut visit = |of: &str, height: KindMember, ground: &[KindMember]| {
        let members = ground.iter().cloned().chain([height]).collect();
        let text = shaders::relief(&group(options, members), layers);
        let parts = [(has_night, "-night"), (has_clouds, "-clouds"), (has_texels, "-texels")];
        let parts: String = parts.map(|(has, name)| if has { name } else { "" }).concat();
        visit(&format!("lit-planet{parts}-{of}-{}", name_of(options)), text);
    };
    visit("level", member(options, "height", 0, 0), &ground);
    if (options.atlas, options.tables) == (Atlas::Float, TableKind::Direct) {
        // Lights and clouds of pages of any sides, as such have that are held whole.
        let any = |member: &KindMember| match &*member.name {
            "layer0" => member.clone(),
            _ => KindMember { kind: Kind { pages: PageSides::Any, ..member.kind }, ..member.clone() },
        };
        let parts_of_any: Vec<KindMember> = ground.iter().map(any).collect();
        visit("level-any", member(options, "height", 0, 0), &parts_of_any);
        visit("any", member(options, "height", layers.count, 0), &parts_of_any);
    }
    if layers.count > 1 {
        visit("level-alike", member(options, "height", 0, 0), &ground_of(0));
    }
    if has_night && has_clouds {
        // Only the lights are of another pool.
        let ground = ground_in(&|n| usize::from(n == 1));
        visit("level-but-night", member(options, "height", 0, 0), &ground);
    }
    for heights in Atlas::ALL {
        if layers.count == 1 {
            let height = of_atlas(heights, member(options, "height", 0, 1));
            visit(&format!("{}-layer", atlas_name(heights)), height, &ground);
        }
        let height = member(options, "height", layers.count, 0);
        visit(atlas_name(heights), of_atlas(heights, height), &ground);
        if has_night && has_clouds {
            let height = of_atlas(heights, member(options, "height", 2, 0));
            visit(&format!("{}-alike", atlas_name(heights)), height, &ground_of(1));
        }
    }
}
