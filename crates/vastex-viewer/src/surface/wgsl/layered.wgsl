// A surface with several layers on it, one over the other in light.
// The text after this one is generated: vastex's own for a group of layers, layered_sum, palette_color, constants, surface.wgsl.

struct Layered {
    range: vec2<f32>,  // as in Scene
    gamma: f32,
    opacity: f32,      // 0 for a layer that is hidden
    channels: u32,     // SCENE_GREY and its kin
    map: u32,          // see palette_color
    is_display: u32,   // 1 where the values are display values
    id: u32,           // of the texture
}

@group(2) @binding(0) var<uniform> layered: array<Layered, LAYERED_MOST>;

// The light after one more layer.
fn layered_over(below: vec3<f32>, value: vec4<f32>, n: u32) -> vec3<f32> {
    let layer = layered[n];
    let colour = scene_value_color(value, layer.channels, layer.range, layer.gamma, layer.map);
    let light = select(colour.rgb, light_from_display(colour.rgb), layer.is_display == 1u);
    return mix(below, light, colour.a * layer.opacity);
}

@fragment
fn shade_layered(surface: Surface) -> @location(0) vec4<f32> {
    let ddx = dpdx(surface.uv);
    let ddy = dpdy(surface.uv);
    if vastex_asked(scene.ids.view, surface.clip) {
        vastex_tell(scene.ids.view, surface.clip, vastex_feedback_grad(scene.ids.all, scene.ids.view, surface.uv, ddx, ddy));
    }
    return vec4<f32>(layered_sum(surface.uv, ddx, ddy), 1.0);
}

@vertex
fn place_layered_feedback(corner: Corner) -> Surface {
    return Surface(vastex_feedback_clip(scene.ids.view, scene_clip(corner)), scene_texture_uv(corner));
}

@fragment
fn want_layered(surface: Surface) -> @location(0) vec4<u32> {
    let along = vastex_gradients(surface.clip, surface.uv);
    return vastex_feedback_grad(scene.ids.all, scene.ids.view, surface.uv, along[0], along[1]);
}
