// The colours of overlays. What they stand for is told in docs/overlays.md.

// A level: eight hues, the finest red, then over and over; those of the second round are darker.
fn overlay_level(level: u32) -> vec3<f32> {
    var colors = array<vec3<f32>, 8>(
        vec3<f32>(0.90, 0.16, 0.22),
        vec3<f32>(0.96, 0.52, 0.12),
        vec3<f32>(0.95, 0.85, 0.20),
        vec3<f32>(0.35, 0.75, 0.25),
        vec3<f32>(0.20, 0.78, 0.78),
        vec3<f32>(0.22, 0.45, 0.90),
        vec3<f32>(0.55, 0.30, 0.85),
        vec3<f32>(0.90, 0.40, 0.75),
    );
    return colors[level % 8u] * (1.0 - 0.25 * f32(level / 8u % 4u));
}

// Levels that are missing: none green, one yellow, two orange, three red, four and more violet to white.
fn overlay_deficit(levels: f32) -> vec3<f32> {
    var colors = array<vec3<f32>, 6>(
        vec3<f32>(0.10, 0.55, 0.25),
        vec3<f32>(0.95, 0.85, 0.20),
        vec3<f32>(0.96, 0.52, 0.12),
        vec3<f32>(0.85, 0.10, 0.15),
        vec3<f32>(0.60, 0.15, 0.75),
        vec3<f32>(1.0, 1.0, 1.0),
    );
    let at = clamp(levels, 0.0, 5.0);
    let below = min(u32(at), 4u);
    return mix(colors[below], colors[below + 1u], at - f32(below));
}

// Over a picture whose brightness still shows.
fn overlay_over(picture: vec3<f32>, color: vec3<f32>) -> vec4<f32> {
    let brightness = dot(picture, vec3<f32>(0.2126, 0.7152, 0.0722));
    return vec4<f32>(color * (0.55 + 0.45 * sqrt(clamp(brightness, 0.0, 1.0))), 1.0);
}
