//! Every shader of the scenes is valid, without a device.

use vastex::{Layer, LayerFormat};
use vastex_scenes::Look;
use vastex_wgpu::{Atlas, Filter, ShaderOptions, wgsl};

#[test]
fn every_shader_is_valid() {
    let surface = include_str!("../../src/wgsl/surface.wgsl");
    for module in [
        include_str!("../../src/wgsl/picture.wgsl"),
        include_str!("../../src/wgsl/wanted.wgsl"),
        include_str!("../../src/wgsl/reference.wgsl"),
        include_str!("../../src/wgsl/coordinates.wgsl"),
    ] {
        for (filter, atlas) in
            Filter::ALL.into_iter().flat_map(|filter| Atlas::ALL.map(|atlas| (filter, atlas)))
        {
            for format in [LayerFormat::R8, LayerFormat::Rg8, LayerFormat::Bc6h] {
                let constants = Look::new(&Layer::new("a", format), None).wgsl();
                let text = wgsl(&ShaderOptions { group: 0, filter, atlas }) + &constants + surface + module;
                check(&text);
            }
        }
    }
    let wall = include_str!("../../examples/wall/wall.wgsl");
    check(&(wgsl(&ShaderOptions::default()) + wall));
}

fn check(text: &str) {
    let parsed = naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    let flags = naga::valid::ValidationFlags::all();
    naga::valid::Validator::new(flags, naga::valid::Capabilities::empty()).validate(&parsed).unwrap();
}
