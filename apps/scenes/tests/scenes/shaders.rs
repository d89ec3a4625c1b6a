//! Every shader of the scenes is valid, without a device.

use vastex::{Layer, LayerFormat};
use vastex_scenes::{Look, Tiling};
use vastex_wgpu::{
    Atlas, FeedbackWay, Filter, GroupMember, GroupShape, PageSides, ShaderOptions, TableKinds, group_wgsl,
    wgsl,
};

#[test]
fn every_shader_is_valid() {
    let surface = include_str!("../../src/wgsl/surface.wgsl");
    for module in [
        include_str!("../../src/wgsl/picture.wgsl"),
        include_str!("../../src/wgsl/wanted.wgsl"),
        include_str!("../../src/wgsl/texture_space.wgsl"),
        include_str!("../../src/wgsl/reference.wgsl"),
        include_str!("../../src/wgsl/coordinates.wgsl"),
    ] {
        for (filter, atlas) in
            Filter::KINDS.into_iter().flat_map(|filter| Atlas::ALL.map(|atlas| (filter, atlas)))
        {
            for format in [LayerFormat::R8, LayerFormat::Rg8, LayerFormat::Bc6h] {
                let constants = Look::new(&Layer::new("a", format), None).wgsl() + &Tiling::default().wgsl();
                let text = [module, include_str!("../../src/wgsl/unlit.wgsl"), surface, &constants].concat()
                    + &wgsl(&ShaderOptions { filter, atlas, ..Default::default() });
                check(&text);
            }
        }
    }
    let wall = include_str!("../../examples/wall/wall.wgsl");
    check(&(wall.to_owned() + &wgsl(&ShaderOptions::default())));
    let descent = include_str!("../../src/wgsl/descent.wgsl").to_owned();
    check(&(descent + &wgsl(&ShaderOptions::default())));
}

#[test]
fn the_shaders_of_the_planet_are_valid() {
    let names = ["color", "height", "night", "clouds"];
    let member = |(texture, name): (usize, &str)| GroupMember {
        name: name.to_owned(),
        texture,
        atlas: Atlas::Float,
        tables: TableKinds::Either,
        pages: PageSides::PowersOfTwo,
        filter: None,
        fades: true,
    };
    let shape = GroupShape::new(names.into_iter().enumerate().map(member).collect(), true).unwrap();
    let group = group_wgsl(0, Filter::Trilinear, FeedbackWay::Inline, &shape);
    let planet = include_str!("../../src/wgsl/planet.wgsl").to_owned();
    let sampled = names.map(|name| {
        format!(
            "fn planet_{name}(uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> vec4<f32> {{
                return vastex_sample_{name}_grad(uv, ddx, ddy);
            }}\n"
        )
    });
    let wanted = include_str!("../../src/wgsl/planet_wanted.wgsl");
    check(&(planet.clone() + wanted + &sampled.concat() + &group));
    let ordinary = (0..).zip(names).map(|(nth, name): (usize, &str)| {
        let text = include_str!("../../src/wgsl/planet_reference.wgsl").replace("MEMBER", name);
        let text = text.replace("TEXTURE_PLACE", &(nth + 1).to_string());
        let bindings = (3 * nth..).zip(["TEXTURE_BINDING", "SAMPLER_BINDING", "PARAMS_BINDING"]);
        bindings.fold(text, |text, (binding, what)| text.replace(what, &binding.to_string()))
    });
    check(&(planet + &ordinary.collect::<String>() + &group));
}

#[test]
fn the_shaders_of_displaced_surfaces_are_valid() {
    let look = Look::new(&Layer::new("color", LayerFormat::Rgba8), None).wgsl() + &Tiling::default().wgsl();
    for (filter, atlas) in
        Filter::KINDS.into_iter().flat_map(|filter| Atlas::ALL.map(|atlas| (filter, atlas)))
    {
        let member = |name: &str, atlas| GroupMember {
            name: name.to_owned(),
            texture: 0,
            atlas,
            tables: TableKinds::Either,
            pages: PageSides::PowersOfTwo,
            filter: None,
            fades: true,
        };
        let members = vec![member("color", Atlas::Float), member("height", atlas)];
        let group = group_wgsl(0, filter, FeedbackWay::Inline, &GroupShape::new(members, true).unwrap());
        for is_globe in [false, true] {
            let constants = format!(
                "const RELIEF_QUADS: u32 = 16u;\nconst RELIEF_MORPH: vec2<f32> = vec2<f32>(0.75, 0.98);\n\
                 const RELIEF_GLOBE: bool = {is_globe};\n"
            );
            let modules = [
                include_str!("../../src/wgsl/surface.wgsl"),
                &constants,
                include_str!("../../src/wgsl/relief.wgsl"),
                include_str!("../../src/wgsl/relief_wanted.wgsl"),
                include_str!("../../src/wgsl/coordinates.wgsl"),
            ];
            check(&(modules.concat() + &look + &group));
        }
    }
}

fn check(text: &str) {
    let parsed = naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    let flags = naga::valid::ValidationFlags::all();
    naga::valid::Validator::new(flags, naga::valid::Capabilities::empty()).validate(&parsed).unwrap();
}
