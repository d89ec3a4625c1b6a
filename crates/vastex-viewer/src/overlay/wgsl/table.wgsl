// The page table, level by level: the finest on the left, each coarser one in a strip of half the width to its right, as a chain
// of mip levels is drawn. Each page has the colour of the level that its entry leads to, and is bright where that is its own.

const TABLE_GAP: f32 = 4.0; // pixels between levels

@fragment
fn shade_table(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let size = vec2<f32>(vastex_size(scene.ids.color));
    // Level 0 and strips of a half, a quarter ... of its width take twice its width at most.
    let width = min(0.5 * scene.picture.x - TABLE_GAP, scene.picture.y * size.x / size.y);
    let height = width * size.y / size.x;
    var left = 0.0;
    var side = vec2<f32>(width, height);
    for (var level = 0u; level <= vastexi_texture(scene.ids.color).tail_level; level++) {
        let place = (plan_at(at) - vec2<f32>(left, 0.0)) / side;
        if all(place >= vec2<f32>(0.0)) && all(place < vec2<f32>(1.0)) {
            return vec4<f32>(table_page(place, level), 1.0);
        }
        left += side.x + TABLE_GAP;
        side *= 0.5;
    }
    return vec4<f32>(PLAN_PAPER, 1.0);
}

fn table_page(place: vec2<f32>, level: u32) -> vec3<f32> {
    let texture = vastexi_texture(scene.ids.color);
    let size = vastexi_level_size(texture, vastexi_level(texture, level, false), false);
    let page = min(vec2<u32>(place * vec2<f32>(size)), size - 1u) / vastexi_page_texels(texture, false);
    let shown = vastex_inspect_page(scene.ids.color, page, level);
    return overlay_level(shown) * select(0.35, 1.0, shown == level || level == texture.tail_level);
}
