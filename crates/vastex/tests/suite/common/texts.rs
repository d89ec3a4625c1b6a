//! The shader texts of these tests, before Vastex's own is added. The list of all shader texts has them from here.

/// Pixels of the pictures that tests draw.
pub const PICTURE: [u32; 2] = [160, 120];

/// A texture over the whole picture, or a column of it.
pub const SCREEN: &str = include_str!("screen.wgsl");

/// What the GPU says at points and levels.
pub const POINTS: &str = include_str!("../sample_cpu.wgsl");

/// The members of most groups.
pub const NAMES: [&str; 4] = ["color", "night", "clouds", "height"];

/// The shader of the screen, with places in fixed point.
pub fn fixed() -> String {
    let replaced = [
        ("columns: vec4<f32>,", "columns: vec2<f32>, anchor: vec2<u32>,"),
        (
            "along: vec4<f32>,\n}",
            "along: vec4<f32>,\n    @location(3) @interpolate(flat) anchor: vec2<u32>,\n}",
        ),
        ("mapping.origin, along)", "mapping.origin, along, mapping.anchor)"),
        ("vastex_sample(", "vastex_sample_fixed(placed.anchor, "),
        ("vastex_feedback(", "vastex_feedback_fixed(placed.anchor, "),
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
    SCREEN
        .replace("return vastex_sample(uv_from_pixel(placed));", &by_column)
        .replace("return vastex_feedback(uv_from_pixel(placed));", &wanted)
}

/// A column of the picture for each member.
pub fn by_columns() -> String {
    let shown = NAMES.map(|name| format!("vastex_sample_{name}(uv)"));
    columns(shown.each_ref().map(String::as_str), "return vastex_feedback(uv);")
}

/// Two textures at coordinates of their own, and two that one entry serves.
pub fn apart() -> String {
    columns(
        [
            "vastex_sample_color(uv)",
            "vastex_sample_clouds(uv)",
            "vastex_sample_night(uv.yx)",
            "vastex_sample_height(1.0 - uv)",
        ],
        "let wanted = array(vastex_feedback(uv), vastex_feedback_night(uv.yx), vastex_feedback_height(1.0 - uv));
        return wanted[vastex_turn(placed.clip, 3u)];",
    )
}

/// One member in the left half of the picture, two others in the right one.
pub fn halves() -> String {
    SCREEN.replace(
        "return vastex_sample(uv_from_pixel(placed));",
        "let uv = uv_from_pixel(placed);
        let others = vastex_sample_second(uv) * 0.5 + vastex_sample_again(uv) * 0.5;
        return select(others, vastex_sample_first(uv), placed.pixel.x < 80.0);",
    )
}

/// Each of two members, which are not blended alike, in a half of the picture, and what one of them wants by itself, or (2) both
/// together.
pub fn two_filters(wanted: usize) -> String {
    let shown = "let uv = uv_from_pixel(placed);
            let shown = array(vastex_sample_value(uv), vastex_sample_label(uv));
            return shown[u32(placed.pixel.x) / 80u];";
    let wanted = format!(
        "let uv = uv_from_pixel(placed);
            let wanted = array(vastex_feedback_value(uv), vastex_feedback_label(uv), vastex_feedback(uv));
            return wanted[{wanted}];"
    );
    SCREEN
        .replace("return vastex_sample(uv_from_pixel(placed));", shown)
        .replace("return vastex_feedback(uv_from_pixel(placed));", &wanted)
}

/// The screen's shader, whose picture tells what it wants.
pub fn telling() -> String {
    let from = "    return vastex_sample(uv_from_pixel(placed));";
    assert!(SCREEN.contains(from));
    let to = "    vastex_tell(placed.clip, vastex_feedback(uv_from_pixel(placed)));\n";
    SCREEN.replace(from, &format!("{to}{from}"))
}
