//! The shader texts of these tests, before Vastex's own is added. The list of all shader texts has them from here.

/// Pixels of the pictures that tests draw.
pub const PICTURE: [u32; 2] = [160, 120];

/// A texture over the whole picture, or a column of it.
pub const SCREEN: &str = include_str!("screen.wgsl");

/// What the GPU says at points and levels.
pub const POINTS: &str = include_str!("../sample_cpu.wgsl");

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

/// The shader of the screen with other answers: `shown`, one for each column of the picture, and `wanted`, of `uv`.
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

/// Each of two members, which are not blended alike, in a half of the picture, and what one of them wants by itself, or (2) both
/// together.
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
    SCREEN.replace(SHOWN, &format!("vastex_tell(placed.view, placed.clip, {told});\n    {SHOWN}"))
}
