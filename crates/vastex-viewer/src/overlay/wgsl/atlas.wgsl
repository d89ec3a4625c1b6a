// The slots of the pool, row by row: the tile in each, in a frame of the colour of its level; dimmed where it is out of view, a white
// frame where it is locked, dark where the slot is free. What several pages share has a white corner.

@group(2) @binding(0) var overlay_slots: texture_2d<u32>;

const ATLAS_HEAD: u32 = 2u; // texels before the first slot's: slots, and columns of the plan
const ATLAS_FREE: vec3<f32> = vec3<f32>(0.05, 0.06, 0.08);

fn atlas_state(place: u32) -> u32 {
    let row = textureDimensions(overlay_slots).x;
    return textureLoad(overlay_slots, vec2<u32>(place % row, place / row), 0).r;
}

@fragment
fn shade_atlas(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let tile = vec2<f32>(vastex_inspect_slot_size());
    let columns = atlas_state(1u);
    let cell = scene.picture.x / f32(columns) * vec2<f32>(1.0, tile.y / tile.x);
    let place = plan_at(at) / cell;
    let slot = u32(place.y) * columns + u32(place.x);
    if slot >= atlas_state(0u) || u32(place.x) >= columns {
        return vec4<f32>(PLAN_PAPER, 1.0);
    }
    let state = atlas_state(ATLAS_HEAD + slot);
    let in_cell = fract(place);
    let frame = max(1.0 / min(cell.x, cell.y), 0.04);
    let from_edge = min(min(in_cell.x, in_cell.y), min(1.0 - in_cell.x, 1.0 - in_cell.y));
    if state == 0u {
        return vec4<f32>(select(ATLAS_FREE, PLAN_PAPER, from_edge < frame), 1.0);
    }
    let is_shared = state >> 10u > 1u;
    if is_shared && in_cell.x + in_cell.y < 4.0 * frame {
        return vec4<f32>(1.0);
    }
    if from_edge < frame {
        let is_locked = ((state >> 9u) & 1u) == 1u;
        return vec4<f32>(select(overlay_level(state & 255u), vec3<f32>(1.0), is_locked), 1.0);
    }
    let colour = scene_colour(vastex_inspect_slot(slot, (in_cell - frame) / (1.0 - 2.0 * frame) * tile)).rgb;
    return vec4<f32>(colour * select(0.3, 1.0, ((state >> 8u) & 1u) == 1u), 1.0);
}
