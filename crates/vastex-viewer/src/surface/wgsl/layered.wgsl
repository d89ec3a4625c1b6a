// Several layers, one over the other in light. What goes through them is generated (layers/text.rs): loops over layers that are sampled by the same
// lines.

struct Layered {
    tone: Tone,
    opacity: f32,     // 0 for a layer that is hidden
    look: u32,        // as SCENE_LOOK of one layer; LAYERED_DISPLAY more where the values are display values, LAYERED_GROWS where rows may be missing
    map: u32,         // 1 where the palette makes colours of a single channel
    id: u32,          // of the texture
    begins: f32,      // the share of a pane's width, from the left of the picture, up to which it is not drawn
    difference: f32,  // by how much it is magnified how far it is from what lies beneath; 0 where it lies over that, and below 0 where it hides it
    nodata: f32,      // the value that stands for no data
    ends: f32,        // and the one from which on it is not drawn
    nodata_colour: vec4<f32>, // of what is without data; alpha 0 where it is not drawn
    palette: array<vec4<u32>, PALETTE_WORDS>, // see Scene
}

const LAYERED_DISPLAY: u32 = 4096u;
const LAYERED_GROWS: u32 = 262144u;

@group(2) @binding(0) var<uniform> layered: array<Layered, LAYERED_MOST>;

// Whether a layer is drawn at all. It is asked of the pixel first, so that the condition does not depend on a uniform alone (ARCHITECTURE.md,
// "Where the text bends to a driver").
fn layered_is_drawn(look: Look, n: u32) -> bool {
    return (!(look.ddx.x > 1e30)) & (layered[n].opacity > 0.0);
}

// Whether it is seen at a pixel, where layers are compared or have panes of their own.
fn layered_is_seen(look: Look, at: vec2<f32>, n: u32) -> bool {
    let x = at.x + scene.origin.x;
    let is_there = (x >= (layered[n].begins * scene.picture.x)) & (x < (layered[n].ends * scene.picture.x));
    return layered_is_drawn(look, n) & is_there;
}

// The uppermost of so many layers that is seen at a pixel, else the lowest.
fn layered_uppermost(look: Look, at: vec2<f32>, count: u32) -> u32 {
    var uppermost = 0u;
    for (var n = 1u; n < count; n++) {
        uppermost = select(uppermost, n, layered_is_seen(look, at, n));
    }
    return uppermost;
}

// Where a loop over layers ends: where it says, as no compiler knows.
fn layered_end(look: Look, end: u32) -> u32 {
    return select(end, 0u, look.ddx.x > 1e30);
}

// The colour of a layer's value, and how much it hides.
fn layered_color(value: vec4<f32>, n: u32) -> vec4<f32> {
    // Shades that no layer has are known to be none when the pipeline is made.
    let look = layered[n].look & ((SCENE_LOOK | ~SCENE_SHADES) & ~LAYERED_DISPLAY);
    let plain = scene_value_color(value, look, layered[n].nodata, layered[n].tone);
    if !scene_takes_map(plain, look, layered[n].map) {
        return scene_or_nodata(plain, layered[n].nodata_colour);
    }
    let at = palette_place(plain.r);
    let first = palette_first(at);
    let low = layered[n].palette[first / 4u][first % 4u];
    let high = layered[n].palette[(first + 1u) / 4u][(first + 1u) % 4u];
    return vec4<f32>(palette_between(low, high, at - f32(first)), plain.a);
}

// The light after one more layer, on ground that is so light.
fn layered_over(below: vec3<f32>, value: vec4<f32>, n: u32, light: f32) -> vec3<f32> {
    let colour = layered_color(value, n);
    let lit = colour.rgb * light;
    var shown = select(lit, light_from_display(lit), (layered[n].look & LAYERED_DISPLAY) != 0u);
    // Asked of the value first: no condition depends on a uniform alone.
    if (!(value.a < -1e30)) & (layered[n].difference > 0.0) {
        let apart = abs(display_from_light(shown) - display_from_light(below));
        shown = light_from_display(min(apart * layered[n].difference, vec3<f32>(1.0)));
    }
    let missing = select(0.0, scene_missing, (layered[n].look & LAYERED_GROWS) != 0u);
    return mix(below, shown, colour.a * layered[n].opacity * (1.0 - missing));
}

// What is looked at, in the texels of one of the textures.
fn layer_look(look: Look, n: u32) -> Look {
    // By a number that no compiler knows: below the camera nothing else is told but this place.
    let place = scene.places[n + scene_zero];
    let offset = ((look.offset - scene.fixed[scene_zero].fraction) * place.ratio) + place.fraction;
    return Look(place.anchor, offset, look.ddx * place.ratio, look.ddy * place.ratio, look.steps, look.is_met);
}

// Whether a layer has a texel at what is looked at, where layers lie texel upon texel.
fn layered_has(look: Look, n: u32) -> bool {
    let place = layer_look(look, n);
    return all(place.offset >= -vec2<f32>(place.anchor)) & all(place.offset < scene.places[n + scene_zero].end);
}

// Whether nothing is seen of so many layers that lie texel upon texel and are compared: where the uppermost has no texel in its turn, and for a
// difference where nothing beneath has one.
fn layered_lacks(look: Look, at: vec2<f32>, count: u32) -> bool {
    var lacks = false;
    var has_below = false;
    for (var n = 0u; n < layered_end(look, count); n++) {
        let is_seen = layered_is_seen(look, at, n);
        let has = layered_has(look, n);
        let is_alone = !has | ((layered[n].difference > 0.0) & !has_below);
        lacks = lacks | (is_seen & (layered[n].difference != 0.0) & is_alone);
        has_below = has_below | (is_seen & has);
    }
    return lacks;
}

// The uppermost of so many layers that lie texel upon texel and that is seen and has a texel at a pixel, else the lowest.
fn layered_uppermost_texel(look: Look, at: vec2<f32>, count: u32) -> u32 {
    var uppermost = 0u;
    for (var n = 1u; n < layered_end(look, count); n++) {
        uppermost = select(uppermost, n, layered_is_seen(look, at, n) & layered_has(look, n));
    }
    return uppermost;
}

// Of so many layers that are asked for in turns the one whose turn it is: those that are drawn and have a texel there take turns, each with an
// entry of its own.
fn layered_turn(look: Look, at: vec4<f32>, count: u32) -> u32 {
    var drawn = 0u;
    for (var n = 0u; n < layered_end(look, count); n++) {
        drawn += select(0u, 1u, layered_is_drawn(look, n) & layered_has(look, n));
    }
    let turn = vastex_turn(scene.ids.view, at, max(drawn, 1u));
    var chosen = 0u;
    var passed = 0u;
    for (var n = 0u; n < layered_end(look, count); n++) {
        let is_drawn = layered_is_drawn(look, n) & layered_has(look, n);
        chosen = select(chosen, n, is_drawn & (passed == turn));
        passed += select(0u, 1u, is_drawn);
    }
    return chosen;
}
