//! Heights that displace a scene's surface: which layer they are, how high they rise, and where the camera is
//! above them.
//!
//! They are sampled in the vertex stage, at the level of the vertices' distance, and in the fragment stage
//! for the light; colours and heights are a group, so that one feedback entry serves both. Which patches are
//! drawn is `patches`' business, what shaders are told in fixed point that of `fixed_relief`.

use glam::{DVec2, Mat4, Vec2, Vec3};
use vastex::{LayerFormat, LayerId, Region, TextureId, Textures};

use super::patches::{Base, Frustum, MORPH, Patch, Patches};
use super::poles::height_on_globe;
use crate::camera::Pose;
use crate::layers::UnknownLayer;
use crate::picture::PicturePart;
use crate::scene::Scene;

/// What is said of heights; what is not said follows from the texture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heights {
    /// Which of the textures that are shown together they are of, counted from 0; else the one that is shown.
    pub texture: Option<usize>,
    /// Name of the layer; else the one called `height`, else the only one of a texture that was named, else
    /// what is shown, if that is one channel.
    pub layer: Option<String>,
    /// How high a value of 1 rises: in widths of the terrain, in radii of the globe. Else so that what the
    /// coarse levels say rises by a twentieth.
    pub scale: Option<f32>,
    /// The value that is not displaced; else the lowest of the coarse levels. On a planet it is that of the
    /// sea, which covers what is lower.
    pub zero: Option<f32>,
    /// True if vertices stay where their patch has them, so that the ground is torn where patches of two
    /// sizes meet: to see that tears would be seen.
    pub is_torn: bool,
}

impl Heights {
    /// Returns true if anything is said of heights.
    pub fn are_wanted(&self) -> bool {
        *self != Heights::default()
    }
}

/// Why there are no heights.
#[derive(Debug, thiserror::Error)]
pub enum HeightsError {
    /// None is called so.
    #[error(transparent)]
    Layer(#[from] UnknownLayer),
    /// None was named, and none can be told by itself.
    #[error(
        "a terrain needs a layer of heights: build with --layer height=..., or name one with --height-layer (the layers are {})",
        .0.join(", ")
    )]
    None(Vec<String>),
    /// The texture that they are of is not shown.
    #[error("the heights are of file {number}; {count} are open")]
    UnknownTexture {
        /// Which one, counted from 1.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// The library said so.
    #[error(transparent)]
    Vastex(#[from] vastex::Error),
}

/// The heights of a texture beside the layer that is shown, ready to displace a surface.
#[derive(Clone, Debug)]
pub struct Relief {
    layer: LayerId,
    scale: Option<f32>,
    zero: f32,
    /// Lowest and highest value on the coarse levels.
    span: [f32; 2],
    /// Lowest and highest value that there may be.
    bounds: [f32; 2],
    texels: [u32; 2],
    is_torn: bool,
    /// True if somebody has said which value is not displaced.
    has_zero: bool,
    /// True if there are none, and a layer stands for them that displaces nothing.
    is_level: bool,
}

/// By how much heights rise that nobody has said a scale for: a twentieth of the globe's radius, of the
/// terrain's width.
const RISE: f32 = 0.05;
/// And of a planet: as the Earth's, from the deepest sea to the highest mountain.
const PLANET_RISE: f32 = 1.0 / 320.0;
/// The share of that within which a coast becomes sea.
const COAST: f32 = 0.002;
/// In widths of the terrain, which is 2 wide.
const WIDTH: f32 = 2.0;
/// Points along each axis at which the coarse levels are asked for their span.
const PROBES: u32 = 64;

impl Relief {
    /// Finds the heights beside the layer that is shown, of `open` textures that are shown together, and has
    /// them kept for the CPU; best before anything of the texture is loaded.
    pub fn new(
        textures: &mut Textures,
        open: &[TextureId],
        shown: LayerId,
        heights: &Heights,
    ) -> Result<Relief, HeightsError> {
        let layer = layer_of(textures, (open, shown), heights)?;
        textures.texture_mut(layer.texture())?.keep_for_cpu(layer.index(), true);
        let description = textures.texture(layer.texture())?.description();
        let [width, height, _] = description.geometry.size();
        let scale = description.layers[layer.index()].scale;
        let span = span(textures, layer)?;
        let is_bounded = !is_float(description.layers[layer.index()].format);
        // A coarse level is a mean: of floats, peaks are taken to be at most so much higher.
        let margin = 2.0 * (span[1] - span[0]);
        let bounds = if is_bounded { [0.0, 1.0] } else { [span[0] - margin, span[1] + margin] };
        Ok(Relief {
            layer,
            scale: heights.scale,
            zero: heights.zero.unwrap_or(span[0]),
            span,
            bounds,
            texels: [width, height].map(|side| side.div_ceil(scale)),
            is_torn: heights.is_torn,
            has_zero: heights.zero.is_some(),
            is_level: false,
        })
    }

    /// No heights: a layer that is shown stands for them, where a scene must have some, and displaces
    /// nothing.
    pub fn level(textures: &Textures, shown: LayerId) -> Result<Relief, HeightsError> {
        let [width, height, _] = textures.texture(shown.texture())?.description().geometry.size();
        Ok(Relief {
            layer: shown,
            scale: Some(0.0),
            zero: 0.0,
            span: [0.0; 2],
            bounds: [0.0; 2],
            texels: [width, height],
            is_torn: false,
            has_zero: false,
            is_level: true,
        })
    }

    /// Returns true if there are no heights, and a layer stands for them that displaces nothing.
    pub fn is_level(&self) -> bool {
        self.is_level
    }

    /// The layer of the heights.
    pub fn layer(&self) -> LayerId {
        self.layer
    }

    /// The surface of a scene with these heights, for an image of `image` (width over height).
    pub(crate) fn surface(&self, scene: Scene, image: f32) -> ReliefSurface {
        let (base, unit) = match scene {
            Scene::Globe | Scene::Planet => (Base::Globe, 1.0),
            Scene::Image | Scene::Plane | Scene::Terrain => (Base::Flat { image }, WIDTH),
        };
        let rise = if scene == Scene::Planet { PLANET_RISE } else { RISE };
        let said = || rise / (self.span[1] - self.span[0]).max(1e-3);
        let scale = unit * self.scale.unwrap_or_else(said);
        let has_sea = scene == Scene::Planet && self.has_zero;
        ReliefSurface { base, scale, said: scale, has_sea, relief: self.clone() }
    }
}

fn is_float(format: LayerFormat) -> bool {
    use LayerFormat::{Bc6h, R16Float, R32Float, Rgba16Float};
    matches!(format, R16Float | Rgba16Float | R32Float | Bc6h)
}

/// The layer of heights beside one that is shown, of `open` textures that are shown together.
fn layer_of(
    textures: &Textures,
    (open, shown): (&[TextureId], LayerId),
    heights: &Heights,
) -> Result<LayerId, HeightsError> {
    let unknown = |number| HeightsError::UnknownTexture { number: number + 1, count: open.len() };
    let named = heights.texture.map(|number| open.get(number).copied().ok_or_else(|| unknown(number)));
    let named = named.transpose()?;
    let texture: TextureId = named.unwrap_or(shown.texture());
    let layers = &textures.texture(texture)?.description().layers;
    let names = || layers.iter().map(|layer| layer.name.clone()).collect();
    if let Some(name) = &heights.layer {
        let unknown = || UnknownLayer { name: name.clone(), layers: names() };
        return Ok(textures.texture(texture)?.layer(name).ok_or_else(unknown)?);
    }
    let only = if named.is_some() { LayerId::from(texture) } else { shown };
    let is_only = named.is_some() && layers.len() == 1;
    let is_grey = layers[only.index()].format.channels() == 1;
    let found = textures.texture(texture)?.layer("height").or((is_only || is_grey).then_some(only));
    found.ok_or_else(|| HeightsError::None(names()))
}

/// The lowest and the highest value on the levels that are always there.
fn span(textures: &Textures, layer: LayerId) -> Result<[f32; 2], vastex::Error> {
    let tail = textures.texture(layer.texture())?.description().geometry.tail().first_level();
    let mut span = [f32::INFINITY, f32::NEG_INFINITY];
    if let Some(mut sampler) = textures.cpu().sampler(layer) {
        for (x, y) in (0..PROBES).flat_map(|y| (0..PROBES).map(move |x| (x, y))) {
            let uv = [x, y].map(|n| (n as f32 + 0.5) / PROBES as f32);
            let value = sampler.sample(uv, f32::from(tail)).value[0];
            span = [span[0].min(value), span[1].max(value)];
        }
    }
    Ok(if span[0].is_finite() && span[1].is_finite() { span } else { [0.0, 1.0] })
}

/// Heights on the surface of a scene.
#[derive(Clone, Debug)]
pub(crate) struct ReliefSurface {
    pub(super) base: Base,
    /// How high a value of 1 rises, in the world.
    pub(super) scale: f32,
    /// The same before it was exaggerated.
    said: f32,
    /// True if what is lower than what is not displaced is covered by a sea.
    has_sea: bool,
    relief: Relief,
}

/// What the shaders are told about it; laid out as `Relief` in surface.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct ReliefUniform {
    eye: Vec3,
    scale: f32,
    pub(super) spacing: Vec2,
    pub(super) texels: Vec2,
    extent: Vec2,
    zero: f32,
    range_per_side: f32,
}

/// What is drawn of it from a place.
pub(crate) struct ReliefView {
    pub(crate) clip_from_world: Mat4,
    pub(crate) uniform: ReliefUniform,
    pub(crate) patches: Vec<Patch>,
}

impl ReliefSurface {
    /// What pipelines with relief.wgsl are made with.
    pub(crate) fn constants(&self) -> [(&'static str, f64); 5] {
        // Nothing is drawn at a thousand times its range.
        let [begin, end] = if self.relief.is_torn { MORPH.map(|share| 1000.0 + share) } else { MORPH };
        [
            ("RELIEF_MORPH_BEGIN", begin.into()),
            ("RELIEF_MORPH_END", end.into()),
            ("RELIEF_GLOBE", f64::from(u8::from(self.base == Base::Globe))),
            ("RELIEF_SEA", f64::from(u8::from(self.has_sea))),
            ("RELIEF_LEVEL", f64::from(u8::from(self.relief.is_level))),
        ]
    }

    /// What a camera sees that is so far above the ground as its pose says, in a part of a picture.
    pub(crate) fn seen_from(&self, textures: &Textures, pose: &Pose, part: &PicturePart) -> ReliefView {
        let picture = part.whole;
        let patches = Patches::new(self.base, self.relief.texels, picture[1]);
        let uniform = self.uniform(&patches, pose);
        let ground = self.ground_below(textures, &uniform);
        let view = f64::from(picture[0]) / f64::from(picture[1]);
        let image = f64::from(uniform.extent.x) / f64::from(uniform.extent.y);
        let clip_from_world = part.cropped(pose.clip_from_world_over(view, image, ground));
        let heights = self.bounds();
        let cells = patches.select(uniform.eye.as_dvec3(), &Frustum::new(clip_from_world), &mut |_| heights);
        let patches = cells.into_iter().map(|cell| cell.patch(self.base)).collect();
        ReliefView { clip_from_world, uniform, patches }
    }

    pub(super) fn uniform(&self, patches: &Patches, pose: &Pose) -> ReliefUniform {
        let texels = self.relief.texels;
        ReliefUniform {
            eye: pose.eye().as_vec3(),
            scale: self.scale,
            spacing: patches.spacing(),
            texels: Vec2::new(texels[0] as f32, texels[1] as f32),
            extent: self.base.extent(),
            zero: self.relief.zero,
            range_per_side: patches.range_per_side,
        }
    }

    /// Which layer the heights are.
    pub(super) fn layer(&self) -> LayerId {
        self.relief.layer
    }

    /// Returns true if nothing is displaced.
    pub(super) fn is_level(&self) -> bool {
        self.relief.is_level || self.scale == 0.0
    }

    /// Texels of the heights.
    pub(super) fn texels(&self) -> [u32; 2] {
        self.relief.texels
    }

    /// How high a value lies, in the world.
    pub(super) fn height(&self, value: f32) -> f32 {
        let above = value - self.relief.zero;
        (if self.has_sea { above.max(0.0) } else { above }) * self.scale
    }

    /// Makes heights so many times as high as is said of them.
    pub(super) fn exaggerate(&mut self, times: f32) {
        self.scale = self.said * times;
    }

    /// 1 over the value above the sea's at which nothing is sea; 0 where there is no sea.
    pub(super) fn sea(&self) -> f32 {
        let coast = COAST * (self.relief.span[1] - self.relief.zero).max(1e-6);
        if self.has_sea { 1.0 / coast } else { 0.0 }
    }

    /// How low and how high the surface may lie.
    pub(super) fn bounds(&self) -> [f64; 2] {
        let heights = self.relief.bounds.map(|value| f64::from(self.height(value)));
        [heights[0].min(heights[1]), heights[0].max(heights[1])]
    }

    /// How high the ground is below the camera, at the level at which it is drawn there, as far as that is
    /// known.
    pub(super) fn ground_below(&self, textures: &Textures, uniform: &ReliefUniform) -> f32 {
        if self.relief.is_level {
            return 0.0;
        }
        let (uv, level) = self.place_below(uniform);
        let sampled = level.max(0.0) + self.bias(textures);
        let height = |uv: DVec2| {
            let ground = textures.cpu().sample(self.relief.layer, uv.as_vec2().to_array(), sampled);
            f64::from(self.height(ground.map_or(self.relief.zero, |ground| ground.value[0])))
        };
        match self.base {
            Base::Flat { .. } => height(uv.as_dvec2()) as f32,
            Base::Globe => height_on_globe(uv.as_dvec2(), level.into(), self.relief.texels[1], height) as f32,
        }
    }

    /// Levels by which heights are drawn coarser than their places need.
    fn bias(&self, textures: &Textures) -> f32 {
        let bias = textures.texture(self.relief.layer.texture()).map_or(0, |texture| texture.bias_eighths());
        f32::from(bias) / 8.0
    }

    /// The uv below the camera, and the level that heights need there, which may be below 0.
    fn place_below(&self, uniform: &ReliefUniform) -> (Vec2, f32) {
        let uv = self.base.uv_below(uniform.eye);
        let above = uniform.eye.distance(self.base.point(uv));
        let texels = uniform.spacing * uniform.texels * above;
        (uv, texels.max_element().max(1e-6).log2())
    }

    /// The heights that [`ReliefSurface::ground_below`] is taken from, in a picture of so many pixels: texels
    /// of level 0 of their texture, and the levels that it is between.
    pub(crate) fn region_below(
        &self,
        textures: &Textures,
        pose: &Pose,
        picture: [u32; 2],
    ) -> Option<(TextureId, Region)> {
        if self.relief.is_level || matches!(pose, Pose::Image { .. }) {
            return None;
        }
        let texture = self.relief.layer.texture();
        let [width, height, _] = textures.texture(texture).ok()?.description().geometry.size();
        let uniform = self.uniform(&Patches::new(self.base, self.relief.texels, picture[1]), pose);
        let (uv, level) = self.place_below(&uniform);
        let finest = (level.max(0.0) + self.bias(textures)).floor().min(30.0) as u8;
        // Texels beside it are blended with it.
        let reach = (2u32 << finest) * (width / self.relief.texels[0].max(1)).max(1);
        let around = |at: f32, side: u32| {
            let texel = (f64::from(at) * f64::from(side)) as u32;
            texel.saturating_sub(reach)..texel.saturating_add(reach).saturating_add(1).min(side)
        };
        let region = Region::image(around(uv.x, width), around(uv.y, height));
        Some((texture, region.on_levels(finest..=finest.saturating_add(1))))
    }
}
