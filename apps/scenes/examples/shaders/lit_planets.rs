//! The shader texts of planets under a sun.

use vastex::Filter;
use vastex_scenes::shaders;
use vastex_viewer::{LayersText, PlanetText};
use vastex_wgpu::{Atlas, KindMember};

use super::{Choice, NAMES, Options, Visit, atlas_name, group, member, name_of, of_atlas};

/// Planets: with lights, with clouds, with both and with neither, each texture of a pool of its own, or
/// all of one, or lights and clouds of one; and heights of another, or the ground in their place.
pub(super) fn each(visit: &mut Visit<'_>) {
    let options = Options { filters: vec![Filter::Trilinear], fades: vec![false], ..Options::of_viewer() };
    options.each(|options| {
        under_nearest_texels(visit, options);
        for (has_night, has_clouds) in [(false, false), (false, true), (true, false), (true, true)] {
            let parts = PlanetText { has_night, has_clouds };
            let layers = LayersText::planet(parts);
            let ground_of = |most: usize| -> Vec<KindMember> {
                (0..layers.count).map(|n| member(options, NAMES[n], n.min(most), 0)).collect()
            };
            let ground = ground_of(layers.count);
            let mut visit = |of: &str, height: KindMember, ground: &[KindMember]| {
                let members = ground.iter().cloned().chain([height]).collect();
                let text = shaders::relief(&group(options, members), layers);
                let parts = [(has_night, "-night"), (has_clouds, "-clouds")];
                let parts: String = parts.map(|(has, name)| if has { name } else { "" }).concat();
                visit(&format!("lit-planet{parts}-{of}-{}", name_of(options)), text);
            };
            visit("level", member(options, "height", 0, 0), &ground);
            if layers.count > 1 {
                visit("level-alike", member(options, "height", 0, 0), &ground_of(0));
            }
            if has_night && has_clouds {
                // Only the lights are of another pool.
                let ground: Vec<KindMember> =
                    [0, 1, 0].iter().zip(NAMES).map(|(pool, name)| member(options, name, *pool, 0)).collect();
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
    });
}

/// A planet of one image whose texels are seen, over heights of its own, or the image's texture in their
/// place: heights are filtered whatever the image's filter is.
fn under_nearest_texels(visit: &mut Visit<'_>, options: &Choice) {
    let layers = LayersText::planet(PlanetText { has_night: false, has_clouds: false });
    let nearest = |member: KindMember| KindMember { kind: member.kind.filtered(Filter::Nearest), ..member };
    let mut visit = |of: &str, height: KindMember| {
        let members = vec![nearest(member(options, NAMES[0], 0, 0)), height];
        let text = shaders::relief(&group(options, members), layers);
        visit(&format!("lit-planet-texels-{of}-{}", name_of(options)), text);
    };
    visit("level", member(options, "height", 0, 0));
    for heights in Atlas::ALL {
        visit(&format!("{}-layer", atlas_name(heights)), of_atlas(heights, member(options, "height", 0, 1)));
        visit(atlas_name(heights), of_atlas(heights, member(options, "height", 1, 0)));
    }
}
