// A plan that fills the picture: one triangle, larger than it.

@vertex
fn fill(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32(index % 2u), f32(index / 2u)) * 4.0 - 1.0;
    return vec4<f32>(corner, 0.0, 1.0);
}

// Where a pixel lies in its pane.
fn plan_at(at: vec4<f32>) -> vec2<f32> {
    let x = at.x + scene.origin.x;
    return vec2<f32>(x - (floor(x / scene.picture.x) * scene.picture.x), at.y);
}

const PLAN_PAPER: vec3<f32> = vec3<f32>(0.008, 0.010, 0.014);
