//! The shader texts of these tests, before Vastex's own is added. The list of all shader texts has them from
//! here.

/// Pixels of the pictures that tests draw.
pub const PICTURE: [u32; 2] = [160, 120];

/// A texture over the whole picture, or a column of it.
pub const SCREEN: &str = include_str!("screen.wgsl");

/// What the GPU says at points and levels.
pub const POINTS: &str = include_str!("../sample_cpu.wgsl");

/// What the GPU reads of labels at voxels.
pub const LABELS: &str = include_str!("../labels.wgsl");

/// What the screen's shader shows, and what it wants.
const SHOWN: &str = "return vastex_sample(placed.ids.x, uv_from_pixel(placed));";
const WANTED: &str = "return vastex_feedback(placed.ids.x, placed.view, uv_from_pixel(placed));";

/// The ids of a group and its members in it.
const IDS: [&str; 5] = ["placed.ids.x", "placed.ids.y", "placed.ids.z", "placed.ids.w", "placed.last"];

/// The members of most groups.
pub const NAMES: [&str; 4] = ["color", "night", "clouds", "height"];

/// The shader of the screen, with places in fixed point.
pub fn fixed() -> String {
    let replaced = [
        ("columns: vec4<f32>,", "columns: vec2<f32>, anchor: vec2<u32>,"),
        (
            "along: vec4<f32>,\n}",
            "along: vec4<f32>,\n    @location(6) @interpolate(flat) anchor: vec2<u32>,\n}",
        ),
        ("mapping.origin, along)", "mapping.origin, along, mapping.anchor)"),
        ("vastex_sample(placed.ids.x, ", "vastex_sample_fixed(placed.ids.x, placed.anchor, "),
        (
            "vastex_feedback(placed.ids.x, placed.view, ",
            "vastex_feedback_fixed(placed.ids.x, placed.view, placed.anchor, ",
        ),
    ];
    replaced.into_iter().fold(SCREEN.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

/// The shader of the screen with other answers: `shown`, one for each column of the picture, and `wanted`, of
/// `uv`.
fn columns(shown: [&str; 4], wanted: &str) -> String {
    let by_column = format!(
        "let uv = uv_from_pixel(placed);
        let shown = array({});
        return shown[u32(placed.pixel.x) * 4u / {}u];",
        shown.join(", "),
        PICTURE[0]
    );
    let wanted = format!("let uv = uv_from_pixel(placed);\n{wanted}");
    SCREEN.replace(SHOWN, &by_column).replace(WANTED, &wanted)
}

/// A column of the picture for each member.
pub fn by_columns() -> String {
    let shown: [String; 4] =
        std::array::from_fn(|nth| format!("vastex_sample_{}({}, uv)", NAMES[nth], IDS[nth + 1]));
    columns(shown.each_ref().map(String::as_str), "return vastex_feedback(placed.ids.x, placed.view, uv);")
}

/// Two textures at coordinates of their own, and two that one entry serves.
pub fn apart() -> String {
    columns(
        [
            "vastex_sample_color(placed.ids.y, uv)",
            "vastex_sample_clouds(placed.ids.w, uv)",
            "vastex_sample_night(placed.ids.z, uv.yx)",
            "vastex_sample_height(placed.last, 1.0 - uv)",
        ],
        "let wanted = array(
            vastex_feedback(placed.ids.x, placed.view, uv),
            vastex_feedback_night(placed.ids.z, placed.view, uv.yx),
            vastex_feedback_height(placed.last, placed.view, 1.0 - uv));
        return wanted[vastex_turn(placed.view, placed.clip, 3u)];",
    )
}

/// One member in the left half of the picture, two others in the right one.
pub fn halves() -> String {
    SCREEN.replace(
        SHOWN,
        "let uv = uv_from_pixel(placed);
        let others = vastex_sample_second(placed.ids.z, uv) * 0.5 + vastex_sample_again(placed.ids.w, uv) * 0.5;
        return select(others, vastex_sample_first(placed.ids.y, uv), placed.pixel.x < 80.0);",
    )
}

/// Each of two members, which are not blended alike, in a half of the picture, and what one of them wants by
/// itself, or (2) both together.
pub fn two_filters(wanted: usize) -> String {
    let shown = "let uv = uv_from_pixel(placed);
            let shown = array(vastex_sample_value(placed.ids.y, uv), vastex_sample_label(placed.ids.z, uv));
            return shown[u32(placed.pixel.x) / 80u];";
    let wanted = format!(
        "let uv = uv_from_pixel(placed);
            let wanted = array(
                vastex_feedback_value(placed.ids.y, placed.view, uv),
                vastex_feedback_label(placed.ids.z, placed.view, uv),
                vastex_feedback(placed.ids.x, placed.view, uv));
            return wanted[{wanted}];"
    );
    SCREEN.replace(SHOWN, shown).replace(WANTED, &wanted)
}

/// The screen's shader, whose picture tells what it wants.
pub fn telling() -> String {
    assert!(SCREEN.contains(SHOWN));
    let told = "vastex_feedback(placed.ids.x, placed.view, uv_from_pixel(placed))";
    SCREEN.replace(SHOWN, &format!("vastex_report(placed.view, placed.clip, {told});\n    {SHOWN}"))
}

/// The screen's shader, whose picture shows eighths of the pixels along one of its own.
pub fn scales() -> String {
    assert!(SCREEN.contains(SHOWN));
    SCREEN.replace(SHOWN, "return vec4<f32>(vastex_pixel_scale(placed.view) / 8.0);")
}

/// The same, of whose pixels each shows another texture than those beside it: those of two ids in turns.
pub fn checkered() -> String {
    let id = "
fn id_at(placed: Corner) -> u32 {
    let pixel = vec2<u32>(placed.pixel);
    return select(placed.ids[0], placed.ids[1], ((pixel.x ^ pixel.y) & 1u) == 1u);
}
";
    telling().replace("placed.ids.x", "id_at(placed)") + id
}

/// Cells along the sides of a quarter of the picture, each of two triangles smaller than a pixel.
const CELLS: [u32; 2] = [125, 94];
/// Vertices of a row of them; its first and last are there twice, so that one strip makes all rows.
const OF_ROW: u32 = 2 * CELLS[0] + 4;

/// The screen's shader on a quarter of the picture, with a uv that is interpolated: as one rectangle, or of
/// many small triangles; with what is wanted by derivatives, or by `vastex_gradients`. Beside it the vertices
/// of the strip.
pub fn quarter(is_small: bool, by_gradients: bool) -> (String, u32) {
    let rectangle = "let x = mix(mapping.columns.x, mapping.columns.y, f32(index & 1u));
    let y = f32(index >> 1u);";
    let [columns, rows] = CELLS;
    let cells = format!(
        "let nth = clamp(index % {OF_ROW}u, 1u, {OF_ROW}u - 2u) - 1u;
    let x = 0.5 * f32(nth >> 1u) / {columns}.0;
    let y = 0.5 * f32(index / {OF_ROW}u + (nth & 1u)) / {rows}.0;"
    );
    let quarter = "let x = 0.5 * f32(index & 1u);
    let y = 0.5 * f32(index >> 1u);"
        .to_owned();
    let gradients = "let along = vastex_gradients(placed.clip, uv_from_pixel(placed));
    return vastex_feedback_grad(placed.ids.x, placed.view, uv_from_pixel(placed), along[0], along[1]);";
    let replaced = [
        ("let centre = floor(placed.pixel) + 0.5;", "let centre = placed.pixel;"),
        (
            "vec4<f32>(2.0 * x - 1.0, 1.0 - 2.0 * y, 0.5, 1.0);",
            "vec4<f32>(2.0 * x - 1.0, 1.0 - 2.0 * y, 0.5 + 2.0 * y, 1.0 + 4.0 * y);",
        ),
        (rectangle, if is_small { &cells } else { &quarter }),
        (WANTED, if by_gradients { gradients } else { WANTED }),
    ];
    let text = replaced.into_iter().fold(SCREEN.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    (text, if is_small { rows * OF_ROW } else { 4 })
}
