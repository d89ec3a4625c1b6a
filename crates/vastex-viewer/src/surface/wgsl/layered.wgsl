// Several layers, one over the other in light. The text after this one is generated: layered_sum and its kin, for each layer.

struct Layered {
    tone: Tone,
    opacity: f32,     // 0 for a layer that is hidden
    look: u32,        // as SCENE_LOOK; 4,096 more where the values are display values
    map: u32,         // see palette_color
    id: u32,          // of the texture
    begins: f32,      // the share of a pane's width, from the left of the picture, up to which it is not drawn
    difference: f32,  // by how much it is magnified how far it is from what lies beneath; 0 where it lies over that
    nodata: f32,      // the value that stands for no data
    ends: f32,        // and the one from which on it is not drawn
}

@group(2) @binding(0) var<uniform> layered: array<Layered, LAYERED_MOST>;

// The light after one more layer, on ground that is so light.
fn layered_over(below: vec3<f32>, value: vec4<f32>, n: u32, light: f32) -> vec3<f32> {
    let layer = layered[n];
    let colour = scene_value_color(value, layer.look & 4095u, layer.nodata, layer.tone, layer.map);
    let lit = colour.rgb * light;
    var shown = select(lit, light_from_display(lit), layer.look >= 4096u);
    // Asked of the value first: no condition depends on a uniform alone.
    if (!(value.a < -1e30)) & (layer.difference > 0.0) {
        let apart = abs(display_from_light(shown) - display_from_light(below));
        shown = light_from_display(min(apart * layer.difference, vec3<f32>(1.0)));
    }
    return mix(below, shown, colour.a * layer.opacity);
}

// What is looked at, in the texels of one of the textures.
fn layer_look(look: Look, n: u32) -> Look {
    let place = scene.places[n];
    let offset = ((look.offset - scene.fixed[scene_zero].fraction) * place.ratio) + place.fraction;
    return Look(place.anchor, offset, look.ddx * place.ratio, look.ddy * place.ratio, look.steps, look.is_met);
}
