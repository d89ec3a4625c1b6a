// A surface without heights as a mesh, whose corners have a uv.

struct Corner {
    @location(0) position: vec3<f32>,
    @location(1) uv: vec2<f32>,
}

struct Seen_mesh {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

fn mesh_clip(corner: Corner) -> vec4<f32> {
    return scene.clip_from_world * vec4<f32>(corner.position, 1.0);
}

// Where on the texture a corner is. It goes on beyond 0 to 1, without a jump, so that whatever a picture is compared with has none.
fn mesh_uv(corner: Corner) -> vec2<f32> {
    return corner.uv * vec2<f32>(SCENE_REPEATS_U, SCENE_REPEATS_V) + vec2<f32>(SCENE_FIRST_U, SCENE_FIRST_V);
}

@vertex
fn place_mesh(corner: Corner) -> Seen_mesh {
    return Seen_mesh(mesh_clip(corner), mesh_uv(corner));
}

@vertex
fn place_mesh_feedback(corner: Corner) -> Seen_mesh {
    return Seen_mesh(vastex_feedback_clip(scene.ids.view, mesh_clip(corner)), mesh_uv(corner));
}

// A place with its gradients. Folded it is as a shader has it that computes uv in turns, which jumps.
fn mesh_look(uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> Look {
    if SCENE_FOLDS_U || SCENE_FOLDS_V {
        let texture = vastexi_texture(scene.ids.color);
        return Look(vec2<u32>(0u), uv, vastexi_wrapped(texture, ddx), vastexi_wrapped(texture, ddy), vec4<f32>(0.0), true);
    }
    return Look(vec2<u32>(0u), uv, ddx, ddy, vec4<f32>(0.0), true);
}

fn mesh_folded(uv: vec2<f32>) -> vec2<f32> {
    return select(uv, fract(uv), vec2<bool>(SCENE_FOLDS_U, SCENE_FOLDS_V));
}

fn look_mesh(seen: Seen_mesh) -> Look {
    let uv = mesh_folded(seen.uv);
    return mesh_look(uv, dpdx(uv), dpdy(uv));
}

fn wanted_mesh(seen: Seen_mesh, look: Look) -> vec4<u32> {
    return vastex_feedback_grad(scene.ids.all, scene.ids.view, look.offset, look.ddx, look.ddy);
}

fn light_mesh(look: Look) -> f32 {
    return 1.0;
}

// The feedback pass: the same surface, the pages that it wants.
@fragment
fn want_mesh(seen: Seen_mesh) -> @location(0) vec4<u32> {
    if SCENE_FOLDS_U || SCENE_FOLDS_V {
        return wanted_mesh(seen, look_mesh(seen));
    }
    let along = vastex_gradients(seen.clip, seen.uv);
    return wanted_mesh(seen, mesh_look(seen.uv, along[0], along[1]));
}
