//! The text by which shaders sample the layers of a list and show them.

use std::ops::Range;

use vastex::Kinds;

/// Layers that a list may have.
pub const MOST_LAYERS: usize = 8;

/// The name of the `n`-th layer in the group.
pub(super) fn member(n: usize) -> String {
    format!("layer{n}")
}

/// What a text depends on that shows a list of layers: how many there are, whether it is a single opaque one,
/// whether they are members of a group, which of them are sampled by the same lines, whether they are on a
/// planet, and whether they lie texel upon texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LayersText {
    /// Layers.
    pub count: usize,
    /// True for a single opaque layer.
    pub is_single: bool,
    /// True if the layers are sampled as members of a group.
    pub is_grouped: bool,
    /// Which layers are sampled by other lines than the one beneath: bit `n` for the `n`-th. A loop goes
    /// through those between.
    pub breaks: u8,
    /// Which parts a planet has beside its ground, the last of the layers, if they are on one.
    pub planet: Option<PlanetText>,
    /// True if textures of unlike size lie upon the lowest one texel by texel, in fixed point.
    pub is_by_texel: bool,
}

/// What a planet has beside its ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PlanetText {
    /// What shines where it is night.
    pub has_night: bool,
    /// Clouds.
    pub has_clouds: bool,
}

impl PlanetText {
    /// How many of them there are.
    pub(super) fn count(self) -> usize {
        usize::from(self.has_night) + usize::from(self.has_clouds)
    }
}

/// The layer that a call samples or inspects.
#[derive(Clone, Copy)]
enum Called {
    /// The only one.
    Single,
    /// The one of this number in the list.
    Nth(usize),
    /// The one of the list that a loop's counter `n` has come to.
    Counted,
}

impl Called {
    /// The layer's id.
    fn id(self) -> String {
        match self {
            Called::Single => "scene.ids.color".to_owned(),
            Called::Nth(n) => format!("layered[{n}].id"),
            Called::Counted => "layered[n].id".to_owned(),
        }
    }

    /// The layer's number.
    fn number(self) -> String {
        match self {
            Called::Single => "0u".to_owned(),
            Called::Nth(n) => format!("{n}u"),
            Called::Counted => "n".to_owned(),
        }
    }
}

impl LayersText {
    /// One opaque layer alone.
    pub const ALONE: LayersText = LayersText {
        count: 1,
        is_single: true,
        is_grouped: false,
        breaks: 0,
        planet: None,
        is_by_texel: false,
    };
    /// One opaque layer beside heights.
    pub const BESIDE_HEIGHTS: LayersText = LayersText { is_grouped: true, ..LayersText::ALONE };

    /// A list of the first so many members of `kinds`, which are those of a group.
    pub fn list(kinds: &Kinds, count: usize) -> LayersText {
        let reads: Vec<usize> = kinds.member_reads().take(count).collect();
        let is_break = |n: &usize| reads[*n] != reads[*n - 1];
        let breaks = (1..reads.len().min(MOST_LAYERS)).filter(is_break).fold(0, |bits, n| bits | (1 << n));
        LayersText { count, breaks, is_single: false, ..LayersText::BESIDE_HEIGHTS }
    }

    /// One layer of the ground of a planet and the parts that it has beside it.
    pub fn planet(parts: PlanetText) -> LayersText {
        let (count, planet) = (1 + parts.count(), Some(parts));
        LayersText { count, planet, is_single: false, ..LayersText::BESIDE_HEIGHTS }
    }

    /// The functions `shown_WAY` and `inspected_WAY` of shaders, for a uv and in fixed point, and
    /// `layer_look`, and `asked_fixed`: what feedback is told of a place in fixed point.
    pub fn wgsl(self) -> String {
        let looks = match self.is_single {
            true => "fn layer_look(look: Look, n: u32) -> Look {\n    return look;\n}\n".to_owned(),
            false => format!("const LAYERED_MOST: u32 = {MOST_LAYERS}u;\n"),
        };
        let at = |n| {
            let suffix = if self.is_grouped { format!("_{}", member(n)) } else { String::new() };
            let function = |name: &str, value: &str| {
                format!(
                    "fn {name}_at{suffix}(id: u32, at: Look) -> {value} {{\n    \
                     return vastex_{name}{suffix}_fixed_grad(id, at.anchor, at.offset, at.ddx, at.ddy);\n}}\n"
                )
            };
            function("sample", "vec4<f32>") + &function("inspect", "VastexInspection")
        };
        let ats: String = (0..self.count).map(at).collect();
        [looks, ats, self.of_way("mesh"), self.of_way("fixed"), self.asked()].concat()
    }

    /// The pages that are asked for in fixed point: by one entry for all layers, or of each by its own.
    fn asked(self) -> String {
        let body = match self.is_by_texel {
            true => self.asked_in_turns(),
            false => "    let place = fixed_place(layer_look(look, PLACE_WANTED), scene.ids.all);\n    return vastex_feedback_fixed_grad(\
                      scene.ids.all, scene.ids.view, place.anchor, place.offset, place.ddx, place.ddy);\n"
                .to_owned(),
        };
        format!("fn asked_fixed(look: Look, at: vec4<f32>) -> vec4<u32> {{\n{body}}}\n")
    }

    fn asked_in_turns(self) -> String {
        let asked = |run: Range<usize>| {
            let call = format!(
                "vastex_feedback_{}_fixed_grad(id, scene.ids.view, place.anchor, place.offset, place.ddx, place.ddy)",
                member(run.start)
            );
            match run.start {
                0 => format!("    var asked = {call};\n"),
                first => format!("    if n >= {first}u {{\n        asked = {call};\n    }}\n"),
            }
        };
        let asked: String = self.runs().into_iter().map(asked).collect();
        format!(
            "    let n = layered_turn(look, at, {}u);\n    let id = layered[n].id;\n    \
             let place = fixed_place(layer_look(look, n), id);\n{asked}    \
             return select(vec4<u32>(0u), asked, layered_is_drawn(look, n) & layered_has(look, n));\n",
            self.count
        )
    }

    fn of_way(self, way: &str) -> String {
        let (shown, inspected) = match self.planet {
            Some(parts) => (self.on_planet(way, parts), self.several(way).1),
            None if self.is_single => self.single(way),
            None => self.several(way),
        };
        let behind = match way {
            "fixed" => "f32(look.anchor.y) + look.offset.y, scene.growing.y",
            _ => "look.offset.y, scene.growing.x",
        };
        format!(
            "fn shown_{way}(look: Look, at: vec2<f32>) -> vec4<f32> {{\n    scene_at = at;\n    \
             scene_missing = scene_behind({behind});\n{shown}}}\n\
             fn inspected_{way}(look: Look, at: vec2<f32>) -> VastexInspection {{\n{inspected}}}\n"
        )
    }

    /// The call of a function that samples or inspects a layer, where `look` looks: by the lines of the
    /// `n`-th layer. In fixed point, of a list, the place is the one of the layer's number.
    fn call(self, function: &str, way: &str, n: usize, called: Called, look: &str) -> String {
        let suffix = if self.is_grouped { format!("_{}", member(n)) } else { String::new() };
        let id = called.id();
        match way {
            "fixed" => {
                let place = format!("fixed_place(layer_look({look}, {}), {id})", called.number());
                format!("{function}_at{suffix}({id}, {place})")
            }
            _ => format!("vastex_{function}{suffix}_grad({id}, {look}.offset, {look}.ddx, {look}.ddy)"),
        }
    }

    fn single(self, way: &str) -> (String, String) {
        let call = |function| self.call(function, way, 0, Called::Single, "look");
        let shown = format!("    return scene_lit({}, light_{way}(look));\n", call("sample"));
        (shown, format!("    return {};\n", call("inspect")))
    }

    fn several(self, way: &str) -> (String, String) {
        let overs = self.sum(way, "light_of_ground") + &self.lacking(way);
        let inspected = |run: Range<usize>| {
            let call = self.call("inspect", way, run.start, Called::Counted, "look");
            match run.start {
                0 => format!("    return {call};\n"),
                first => format!("    if n >= {first}u {{\n        return {call};\n    }}\n"),
            }
        };
        let inspecteds: String = self.runs().into_iter().rev().map(inspected).collect();
        let count = self.over_one_another();
        let uppermost = if self.lies_by_texel(way) { "uppermost_texel" } else { "uppermost" };
        (
            format!(
                "    let light_of_ground = light_{way}(look);\n{overs}    return scene_stored(vec4<f32>(sum, 1.0));\n"
            ),
            format!("    let n = layered_{uppermost}(look, at, {count}u);\n{inspecteds}"),
        )
    }

    /// Whether textures lie texel upon texel where a surface is placed so.
    fn lies_by_texel(self, way: &str) -> bool {
        self.is_by_texel && way == "fixed"
    }

    /// Takes away what is seen where one of the layers that are compared has no texel.
    fn lacking(self, way: &str) -> String {
        if !self.lies_by_texel(way) {
            return String::new();
        }
        format!("    sum = select(sum, scene_ground(), layered_lacks(look, at, {}u));\n", self.count)
    }

    /// The light of the layers that lie over one another, on ground that is so light.
    fn sum(self, way: &str, light: &str) -> String {
        let over = |run: Range<usize>| {
            let sampled = self.call("sample", way, run.start, Called::Counted, "look");
            let then = format!("sum = layered_over(sum, {sampled}, n, {light});");
            let is_there = if self.lies_by_texel(way) { " & layered_has(look, n)" } else { "" };
            in_turns(run, &format!("layered_is_seen(look, at, n){is_there}"), &then)
        };
        let overs: String = self.runs().into_iter().map(over).collect();
        format!("    var sum = scene_ground();\n{overs}")
    }

    /// How many layers lie over one another.
    fn over_one_another(self) -> usize {
        self.count - self.planet.map_or(0, PlanetText::count)
    }

    /// The layers that lie over one another, those together that are sampled by the same lines.
    fn runs(self) -> Vec<Range<usize>> {
        let count = self.over_one_another();
        let starts: Vec<usize> = (0..count).filter(|n| *n == 0 || self.breaks >> n & 1 == 1).collect();
        let ends = starts.iter().skip(1).copied().chain([count]);
        starts.iter().copied().zip(ends).map(|(start, end)| start..end).collect()
    }

    /// What is seen of a planet: its ground, what shines on it at night, and clouds, which are seen and throw
    /// shadows beside where they are.
    fn on_planet(self, way: &str, parts: PlanetText) -> String {
        let (night, clouds) = (self.over_one_another(), self.count - 1);
        let sampled = |n: usize, look: &str| self.call("sample", way, n, Called::Nth(n), look);
        let lights = format!("lights = planet_lights({}, n);", sampled(night, "look"));
        let covered = format!(
            "let moved = planet_moved_{way}(look, select(site.clouds, site.shadow, turn == 1u));\n        \
             let share = planet_coverage({}, {clouds}u);\n        \
             cover = select(cover, vec2<f32>(share), vec2<u32>(turn) == vec2<u32>(0u, 1u));",
            sampled(clouds, "moved")
        );
        let of_clouds = format!("layered_is_drawn(look, {clouds}u)");
        [
            self.sum(way, "1.0"),
            format!("    let site = planet_site_{way}(look, at);\n"),
            "    var lights = vec3<f32>(0.0);\n    var cover = vec2<f32>(0.0);\n".to_owned(),
            if parts.has_night {
                in_turns(night..night + 1, "layered_is_drawn(look, n)", &lights)
            } else {
                String::new()
            },
            if parts.has_clouds { turns("turn", 0..2, &of_clouds, &covered) } else { String::new() },
            "    return scene_stored(vec4<f32>(planet_seen(site, sum, lights, cover.x, cover.y), 1.0));\n"
                .to_owned(),
        ]
        .concat()
    }
}

/// A statement for each layer `n` of these for which a condition holds.
fn in_turns(layers: Range<usize>, condition: &str, then: &str) -> String {
    turns("n", layers, condition, then)
}

/// A statement in turns of a loop, for each of which a condition is asked. The loop ends where no compiler
/// knows, so that none writes it out: ARCHITECTURE.md, "Where the text bends to a driver".
fn turns(counter: &str, range: Range<usize>, condition: &str, then: &str) -> String {
    let Range { start, end } = range;
    format!(
        "    for (var {counter} = {start}u; {counter} < layered_end(look, {end}u); {counter}++) {{\n    \
         if {condition} {{\n        {then}\n    }}\n    }}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(count: usize, breaks: u8) -> LayersText {
        LayersText { count, breaks, is_single: false, ..LayersText::BESIDE_HEIGHTS }
    }

    /// The functions that show something, and how often they sample.
    fn samples(text: LayersText) -> Vec<usize> {
        let text = text.wgsl();
        let shown = |way: &str| {
            let begin = text.split_once(&format!("fn shown_{way}(")).unwrap().1;
            begin.split_once("\n}\n").unwrap().0.to_owned()
        };
        let calls = [("mesh", "vastex_sample_"), ("fixed", "sample_at")];
        calls.iter().map(|(way, call)| shown(way).matches(call).count()).collect()
    }

    /// Compilers write out each call: the text has one for all layers that are sampled by the same lines, and
    /// each in a loop of its own.
    #[test]
    fn calls_do_not_grow_with_layers() {
        for count in 1..=MOST_LAYERS {
            assert_eq!(samples(list(count, 0)), [1, 1], "{count} layers");
            let breaks = (1..count).fold(0, |bits, n| bits | (1 << n));
            assert_eq!(samples(list(count, breaks)), [count; 2], "{count} layers, each by lines of its own");
        }
        let text = list(5, 0b0_1010);
        assert_eq!(text.runs(), [0..1, 1..3, 3..5]);
        assert_eq!(samples(text), [3, 3]);
        assert_eq!(samples(LayersText { is_by_texel: true, ..text }), [3, 3]);
        let planet = LayersText::planet(PlanetText { has_night: true, has_clouds: true });
        assert_eq!(samples(planet), [3, 3], "ground, lights, and clouds with their shadows");
        for text in [text, planet] {
            let text = text.wgsl();
            assert_eq!(text.matches("    for (var ").count(), 6);
            assert_eq!(text.matches("< layered_end(look, ").count(), 6, "no compiler writes them out");
        }
    }

    #[test]
    fn a_single_layer_has_no_loop() {
        for text in [LayersText::ALONE, LayersText::BESIDE_HEIGHTS] {
            assert!(!text.wgsl().contains("for ("));
            assert_eq!(samples(text), [1, 1]);
        }
    }
}
