// The two ways in which a colour is told: as light, and as a display value, which is light encoded as sRGB has it.

fn display_from_light(light: vec3<f32>) -> vec3<f32> {
    let above = max(light, vec3<f32>(0.0));
    let curve = 1.055 * pow(above, vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(above * 12.92, curve, above > vec3<f32>(0.0031308));
}

fn light_from_display(display: vec3<f32>) -> vec3<f32> {
    let above = max(display, vec3<f32>(0.0));
    let curve = pow((above + 0.055) / 1.055, vec3<f32>(2.4));
    return select(above / 12.92, curve, above > vec3<f32>(0.04045));
}
