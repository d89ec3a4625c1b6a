//! A list of shown layers, drawn one over the other in its order.

use vastex::{GroupId, Layer, LayerId, Textures};

use super::{ColorMap, LayerUniform};

/// Layers that a list may have.
pub const MOST_LAYERS: usize = 8;

/// A layer in a list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownLayer {
    /// The layer, of any texture.
    pub layer: LayerId,
    /// How its values become colours.
    pub color_map: ColorMap,
    /// How much of what lies beneath it hides, from 0 to 1, where its own values do not say less.
    pub opacity: f32,
    /// Whether it is drawn.
    pub is_visible: bool,
}

impl ShownLayer {
    /// A layer as its format says, opaque.
    pub fn new(layer: LayerId, described: &Layer) -> ShownLayer {
        ShownLayer { layer, color_map: ColorMap::new(described, None), opacity: 1.0, is_visible: true }
    }
}

/// A list of layers cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum LayersError {
    /// There is none, or there are too many.
    #[error("{0} layers are to be shown; show 1 to {MOST_LAYERS}")]
    Count(usize),
    /// The library said so.
    #[error(transparent)]
    Vastex(#[from] vastex::Error),
}

/// Shown layers, the lowest first, and the group by which one shader samples all of them.
#[derive(Clone, Debug)]
pub struct Layers {
    layers: Vec<ShownLayer>,
    group: GroupId,
}

impl Layers {
    /// Makes a group of all layers, hidden ones too, so that they can be shown without anything being made anew; while they are hidden
    /// nothing of them is sampled, but what is wanted of their textures is loaded.
    pub fn new(textures: &mut Textures, layers: Vec<ShownLayer>) -> Result<Layers, LayersError> {
        if !(1..=MOST_LAYERS).contains(&layers.len()) {
            return Err(LayersError::Count(layers.len()));
        }
        let members = layers.iter().enumerate().map(|(n, shown)| (Layers::member(n), shown.layer));
        let group = textures.add_group(members)?;
        Ok(Layers { layers, group })
    }

    /// The layers, the lowest first.
    pub fn iter(&self) -> impl Iterator<Item = &ShownLayer> {
        self.layers.iter()
    }

    /// A layer to change: anything but which layer it is. The next frame shows it.
    pub fn get_mut(&mut self, n: usize) -> Option<&mut ShownLayer> {
        self.layers.get_mut(n)
    }

    /// The group of all of them.
    pub fn group(&self) -> GroupId {
        self.group
    }

    /// The name of the `n`-th layer in the group.
    fn member(n: usize) -> String {
        format!("layer{n}")
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.layers.len()
    }

    pub(crate) fn uniforms(&self, textures: &Textures) -> [LayerUniform; MOST_LAYERS] {
        let mut uniforms = [LayerUniform::default(); MOST_LAYERS];
        for (uniform, shown) in uniforms.iter_mut().zip(&self.layers) {
            // A layer that is gone has no id: shaders show what they show for any texture that is not there.
            let opacity = if shown.is_visible { shown.opacity.clamp(0.0, 1.0) } else { 0.0 };
            *uniform = shown.color_map.uniform(opacity, textures.shader_id(shown.layer).unwrap_or(0));
        }
        uniforms
    }

    /// The function `layered_sum(uv, ddx, ddy)` of shaders: the light of so many layers one over the other, over the background.
    pub fn wgsl(count: usize) -> String {
        let head = "fn layered_sum(uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> vec3<f32> {\n    \
                    var light = scene.background.rgb;\n";
        let layer = |n| {
            let name = Layers::member(n);
            format!(
                "    if layered[{n}].opacity > 0.0 {{\n        \
                 light = layered_over(light, vastex_sample_{name}_grad(layered[{n}].id, uv, ddx, ddy), {n}u);\n    }}\n"
            )
        };
        let layers: String = (0..count).map(layer).collect();
        format!("const LAYERED_MOST: u32 = {MOST_LAYERS}u;\n{head}{layers}    return light;\n}}\n")
    }
}
