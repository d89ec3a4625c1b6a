//! The text by which shaders sample the layers of a list and show them.

/// Layers that a list may have.
pub const MOST_LAYERS: usize = 8;

/// The name of the `n`-th layer in the group.
pub(super) fn member(n: usize) -> String {
    format!("layer{n}")
}

/// What a text depends on that shows a list of layers: how many there are, whether it is a single opaque one,
/// whether they are members of a group, and whether they are on a planet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LayersText {
    /// Layers.
    pub count: usize,
    /// True for a single opaque layer.
    pub is_single: bool,
    /// True if the layers are sampled as members of a group.
    pub is_grouped: bool,
    /// Which parts a planet has beside its ground, the last of the layers, if they are on one.
    pub planet: Option<PlanetText>,
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

impl LayersText {
    /// One opaque layer alone.
    pub const ALONE: LayersText = LayersText { count: 1, is_single: true, is_grouped: false, planet: None };
    /// One opaque layer beside heights.
    pub const BESIDE_HEIGHTS: LayersText = LayersText { is_grouped: true, ..LayersText::ALONE };

    /// A list of so many layers.
    pub const fn list(count: usize) -> LayersText {
        LayersText { count, is_single: false, is_grouped: true, planet: None }
    }

    /// One layer of the ground of a planet and the parts that it has beside it.
    pub fn planet(parts: PlanetText) -> LayersText {
        LayersText { planet: Some(parts), ..LayersText::list(1 + parts.count()) }
    }

    /// The functions `shown_WAY` and `inspected_WAY` of shaders, for a uv and in fixed point, and
    /// `layer_look`.
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
        [looks, ats, self.of_way("mesh"), self.of_way("fixed")].concat()
    }

    fn of_way(self, way: &str) -> String {
        let (shown, inspected) = match self.planet {
            Some(parts) => (self.on_planet(way, parts), self.several(way).1),
            None if self.is_single => self.single(way),
            None => self.several(way),
        };
        format!(
            "fn shown_{way}(look: Look, at: vec2<f32>) -> vec4<f32> {{\n    scene_at = at;\n{shown}}}\n\
             fn inspected_{way}(look: Look, at: vec2<f32>) -> VastexInspection {{\n{inspected}}}\n"
        )
    }

    /// The call of a function that samples or inspects a layer of an id, where `look` looks.
    fn call(self, function: &str, way: &str, n: usize, id: &str) -> String {
        self.call_at(function, way, n, id, "look")
    }

    fn call_at(self, function: &str, way: &str, n: usize, id: &str, look: &str) -> String {
        let suffix = if self.is_grouped { format!("_{}", member(n)) } else { String::new() };
        match way {
            "fixed" => {
                let place = format!("fixed_place(layer_look({look}, {n}u), {id})");
                format!("{function}_at{suffix}({id}, {place})")
            }
            _ => format!("vastex_{function}{suffix}_grad({id}, {look}.offset, {look}.ddx, {look}.ddy)"),
        }
    }

    fn single(self, way: &str) -> (String, String) {
        let call = |function| self.call(function, way, 0, "scene.ids.color");
        let shown = format!("    return scene_lit({}, light_{way}(look));\n", call("sample"));
        (shown, format!("    return {};\n", call("inspect")))
    }

    fn several(self, way: &str) -> (String, String) {
        let overs = self.sum(way, "light_of_ground");
        let call = |n| self.call("inspect", way, n, &format!("layered[{n}].id"));
        let inspected = |n| where_seen(n, &is_there(n), &format!("return {}", call(n)));
        let inspecteds: String = (1..self.over_one_another()).rev().map(inspected).collect();
        (
            format!(
                "    let light_of_ground = light_{way}(look);\n{overs}    return scene_stored(vec4<f32>(sum, 1.0));\n"
            ),
            format!("{inspecteds}    return {};\n", call(0)),
        )
    }

    /// The light of the layers that lie over one another, on ground that is so light.
    fn sum(self, way: &str, light: &str) -> String {
        let over = |n| {
            let sampled = self.call("sample", way, n, &format!("layered[{n}].id"));
            let then = format!("sum = layered_over(sum, {sampled}, {n}u, {light})");
            where_seen(n, &is_there(n), &then)
        };
        let overs: String = (0..self.over_one_another()).map(over).collect();
        format!("    var sum = scene_ground();\n{overs}")
    }

    /// How many layers lie over one another.
    fn over_one_another(self) -> usize {
        self.count - self.planet.map_or(0, PlanetText::count)
    }

    /// What is seen of a planet: its ground, what shines on it at night, and clouds, which are seen and throw
    /// shadows beside where they are.
    fn on_planet(self, way: &str, parts: PlanetText) -> String {
        let (night, clouds) = (self.over_one_another(), self.count - 1);
        let sampled = |n: usize| self.call("sample", way, n, &format!("layered[{n}].id"));
        let lights = format!("lights = planet_lights({}, {night}u)", sampled(night));
        let clouds_then = |to: &str| {
            let id = format!("layered[{clouds}].id");
            let sampled = self.call_at("sample", way, clouds, &id, &format!("{to}_look"));
            let then = format!("{to} = planet_coverage({sampled}, {clouds}u)");
            format!("    let {to}_look = planet_moved_{way}(look, site.{to});\n")
                + &where_seen(clouds, "", &then)
        };
        [
            self.sum(way, "1.0"),
            format!("    let site = planet_site_{way}(look, at);\n"),
            "    var lights = vec3<f32>(0.0);\n    var clouds = 0.0;\n    var shadow = 0.0;\n".to_owned(),
            if parts.has_night { where_seen(night, "", &lights) } else { String::new() },
            if parts.has_clouds { clouds_then("clouds") + &clouds_then("shadow") } else { String::new() },
            "    return scene_stored(vec4<f32>(planet_seen(site, sum, lights, clouds, shadow), 1.0));\n"
                .to_owned(),
        ]
        .concat()
    }
}

/// Whether a pixel lies where a layer that is compared, or has a pane of its own, is seen; to be added to
/// other conditions.
fn is_there(n: usize) -> String {
    let begins = format!("(at.x + scene.origin.x) >= (layered[{n}].begins * scene.picture.x)");
    let ends = format!("(at.x + scene.origin.x) < (layered[{n}].ends * scene.picture.x)");
    format!(" && {begins} && {ends}")
}

/// A statement for a layer that is seen. It is asked of the pixel first, so that the condition does not
/// depend on a uniform alone (ARCHITECTURE.md, "Where the text bends to a driver").
fn where_seen(n: usize, condition: &str, then: &str) -> String {
    format!(
        "    if ((!(look.ddx.x > 1e30)) & (layered[{n}].opacity > 0.0)){condition} {{\n        {then};\n    }}\n"
    )
}
