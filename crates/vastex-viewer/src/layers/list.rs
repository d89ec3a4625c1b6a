//! A list of shown layers, drawn one over the other in its order.

mod growing;

use glam::DVec2;
use vastex::{Filter, GroupId, Kinds, Layer, LayerId, Member, Sampled, TextureId, Textures};

use super::placement::{ImageSizes, size_of};
use super::text::{LayersText, MOST_LAYERS, PlanetText, member};
use super::{ColorMap, CompareMode, LayerUniform, Panes};

/// An id that names no texture, so that nothing is wanted by it.
const NO_TEXTURE: u32 = u32::MAX;
/// What the heights are called in a group.
const HEIGHT: &str = "height";

/// A layer in a list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownLayer {
    /// The layer, of any texture.
    pub layer: LayerId,
    /// How the layer's values become colours.
    pub color_map: ColorMap,
    /// How much the layer hides of what lies beneath, from 0 to 1, where its own alpha does not say less.
    pub opacity: f32,
    /// True if the layer is drawn. Pages of a hidden layer are not asked for.
    pub is_visible: bool,
    /// How the layer's texels are blended; by the textures' own filter where none is named. Values that may
    /// not be mixed are not, whatever is named.
    pub filter: Option<Filter>,
}

impl ShownLayer {
    /// A layer as its format says, opaque.
    pub fn new(layer: LayerId, described: &Layer) -> ShownLayer {
        let color_map = ColorMap::new(described, None);
        ShownLayer { layer, color_map, opacity: 1.0, is_visible: true, filter: None }
    }

    /// The filter by which the layer is drawn; the default one if its texture was removed.
    pub fn filter_in(&self, textures: &Textures) -> Filter {
        let texture = textures.texture(self.layer.texture());
        let kind = texture.ok().and_then(|texture| texture.kind(self.layer.index()));
        kind.map_or(Filter::default(), |kind| kind.filtered(self.filter.unwrap_or(kind.filter)).filter)
    }

    fn is_seen(&self) -> bool {
        self.is_visible && self.opacity > 0.0
    }

    fn hides_all(&self) -> bool {
        self.is_visible && self.opacity >= 1.0
    }
}

/// What a planet has beside its ground, each perhaps; drawn by their values, ranges and opacities.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlanetLayers {
    /// What shines where it is night.
    pub night: Option<ShownLayer>,
    /// The clouds: they hide the ground by their lightness and, if they have it, their alpha.
    pub clouds: Option<ShownLayer>,
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

/// Shown layers, the lowest first, and what shaders sample them by.
///
/// A single opaque layer is sampled by itself, in a text that is made for it. Several are sampled through one
/// bind group, hidden ones too, so that showing and hiding makes no pipeline anew; what is asked for is what
/// the visible ones need.
#[derive(Clone, Debug)]
pub struct Layers {
    /// Layers that lie over one another, then the parts of a planet.
    layers: Vec<ShownLayer>,
    /// The parts that a planet has, if they are on one.
    planet: Option<PlanetText>,
    heights: Option<LayerId>,
    is_single: bool,
    /// All layers, and the heights; `None` if there is one layer alone.
    group: Option<GroupId>,
    /// What is seen of them, where that is less and more than one texture.
    seen: Option<GroupId>,
    compare_mode: CompareMode,
    /// Over how many of its own texels each layer lies on all of the lowest one's place, where images of
    /// unlike size lie upon it texel by texel.
    by_texel: Option<Vec<DVec2>>,
    /// A texture whose rows are still coming, and the share of them that is there.
    growing: Option<(TextureId, f64)>,
}

impl Layers {
    /// One opaque layer on a surface without heights.
    pub fn one(layer: ShownLayer) -> Layers {
        let layer = ShownLayer { opacity: 1.0, is_visible: true, ..layer };
        let (heights, group, seen) = (None, None, None);
        let (planet, compare_mode, by_texel) = (None, CompareMode::Off, None);
        let layers = vec![layer];
        let growing = None;
        Layers { layers, planet, heights, is_single: true, group, seen, compare_mode, by_texel, growing }
    }

    /// Layers on a surface that `heights` displace, if there are any.
    ///
    /// Fails if there is none or if there are more than [`MOST_LAYERS`], if a texture was removed, and if the
    /// layers have more pools or layers than a shader of the device can read.
    pub fn new(
        textures: &mut Textures,
        layers: Vec<ShownLayer>,
        heights: Option<LayerId>,
    ) -> Result<Layers, LayersError> {
        Layers::of(textures, layers, (None, heights), None)
    }

    /// Layers whose images lie upon the lowest one texel by texel from the upper left corner, on an image
    /// ([`super::Placement::ByTexel`]). Texels are those of the images, of which textures may have fewer.
    /// Each layer that is seen has an entry of feedback of its own, so that it takes as many jitter cycles as
    /// there are layers until all of them are there. Otherwise as [`Layers::new`], also where all images have
    /// one size.
    pub fn by_texel(
        textures: &mut Textures,
        layers: Vec<ShownLayer>,
        images: &ImageSizes,
    ) -> Result<Layers, LayersError> {
        let spread = || images.spread(textures, layers.iter().map(|shown| shown.layer));
        let by_texel = Layers::are_unlike(textures, &layers, images).then(spread);
        Layers::of(textures, layers, (None, None), by_texel)
    }

    /// Returns true if images of layers have unlike sizes.
    pub fn are_unlike(textures: &Textures, layers: &[ShownLayer], images: &ImageSizes) -> bool {
        let size = |shown: &ShownLayer| images.of(textures, shown.layer);
        layers.windows(2).any(|two| size(&two[0]) != size(&two[1]))
    }

    /// Layers of the ground of a planet, its lights and its clouds, if there are any, and what stands for its
    /// heights. Together there are at most [`MOST_LAYERS`] of them; otherwise as [`Layers::new`].
    pub fn on_planet(
        textures: &mut Textures,
        ground: Vec<ShownLayer>,
        parts: PlanetLayers,
        heights: LayerId,
    ) -> Result<Layers, LayersError> {
        if ground.is_empty() {
            return Err(LayersError::Count(0));
        }
        let has = PlanetText { has_night: parts.night.is_some(), has_clouds: parts.clouds.is_some() };
        let layers = ground.into_iter().chain(parts.night).chain(parts.clouds).collect();
        Layers::of(textures, layers, (Some(has), Some(heights)), None)
    }

    fn of(
        textures: &mut Textures,
        layers: Vec<ShownLayer>,
        (planet, heights): (Option<PlanetText>, Option<LayerId>),
        by_texel: Option<Vec<DVec2>>,
    ) -> Result<Layers, LayersError> {
        if !(1..=MOST_LAYERS).contains(&layers.len()) {
            return Err(LayersError::Count(layers.len()));
        }
        let is_single = planet.is_none() && is_single(&layers);
        let group = if is_single && heights.is_none() {
            None
        } else {
            let of_layer = if by_texel.is_some() { Member::apart } else { Member::new };
            let members = layers.iter().enumerate().map(|(n, shown)| of_layer(member(n), shown.layer));
            let heights = heights.map(|layer| Member::new(HEIGHT, layer));
            Some(textures.add_group(members.chain(heights))?)
        };
        let (compare_mode, seen, growing) = (CompareMode::Off, None, None);
        let mut made =
            Layers { layers, planet, heights, is_single, group, seen, compare_mode, by_texel, growing };
        made.gather_seen(textures)?;
        Ok(made)
    }

    /// The layers, the lowest first; on a planet those of its ground, then its lights and its clouds.
    pub fn iter(&self) -> impl Iterator<Item = &ShownLayer> {
        self.layers.iter()
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.layers.len()
    }

    /// Shows a layer otherwise: all of it may be another but the layer that it is of. The next frame shows
    /// it, after [`crate::SceneRenderer::set_layers`]; returns true if the renderer has to be made anew
    /// instead, since its text or its pipelines are others: where the filter is another, where colour maps do
    /// not share them ([`ColorMap::shares_pipelines`]), and where the list becomes a single opaque layer or
    /// ceases to be one. Nothing changes where there is no such layer.
    pub fn set(&mut self, textures: &mut Textures, n: usize, shown: ShownLayer) -> Result<bool, LayersError> {
        let Some(place) = self.layers.get_mut(n) else { return Ok(false) };
        let before = std::mem::replace(place, ShownLayer { layer: place.layer, ..shown });
        let is_changed = *place != before;
        let is_other = before.filter != place.filter || !before.color_map.shares_pipelines(&place.color_map);
        if !is_changed {
            return Ok(false);
        }
        let is_single = self.planet.is_none() && is_single(&self.layers);
        if is_single != self.is_single && self.heights.is_none() {
            let (layers, heights) = (self.layers.clone(), self.heights);
            let mut made = Layers::new(textures, layers, heights).inspect_err(|_| self.layers[n] = before)?;
            (made.compare_mode, made.growing) = (self.compare_mode, self.growing);
            std::mem::replace(self, made).remove(textures);
            return Ok(true);
        }
        let was_single = std::mem::replace(&mut self.is_single, is_single);
        if let Err(error) = self.gather_seen(textures) {
            (self.layers[n], self.is_single) = (before, was_single);
            return Err(error);
        }
        Ok(is_other || was_single != is_single)
    }

    /// Compares the uppermost layer that is seen with those beneath it, from the next frame on after
    /// [`crate::SceneRenderer::set_layers`]. Nothing is compiled for it, and no other pages are wanted.
    ///
    /// [`CompareMode::Flicker`] shows the layer all the time: a host that draws frame after frame passes
    /// [`CompareMode::at`] of its time, and draws again after [`CompareMode::changes_after`].
    pub fn compare(&mut self, mode: CompareMode) {
        self.compare_mode = mode;
    }

    /// How the uppermost layer that is seen is compared with those beneath it.
    pub fn compare_mode(&self) -> CompareMode {
        self.compare_mode
    }

    /// Returns true if two layers or more are seen, so that the uppermost of them can be compared with those
    /// beneath it.
    pub fn can_compare(&self) -> bool {
        self.over_one_another().iter().filter(|shown| shown.is_seen()).count() > 1
    }

    /// Gives back what a list takes of the textures, where nothing is drawn with it any more. The layers'
    /// textures stay.
    pub fn remove(self, textures: &mut Textures) {
        for group in self.group.into_iter().chain(self.seen) {
            textures.remove(group);
        }
    }

    /// What shaders sample.
    pub fn sampled(&self) -> Sampled {
        self.group.map_or_else(|| self.inspected().layer.into(), Sampled::Group)
    }

    /// What the text for them is made for. Fails where a texture was removed.
    pub fn kinds(&self, textures: &Textures) -> Result<Kinds, vastex::Error> {
        let mut filters: Vec<_> = self.layers.iter().map(|shown| shown.filter).collect();
        filters.extend(self.heights.map(|_| None));
        Ok(textures.kinds(self.sampled())?.with_filters(&filters))
    }

    /// The format of pictures: of a single layer as its colours are encoded, of several one that light is
    /// encoded for.
    pub fn picture_format(&self) -> wgpu::TextureFormat {
        match self.is_single {
            true => self.inspected().color_map.picture_format(),
            false => wgpu::TextureFormat::Rgba8UnormSrgb,
        }
    }

    /// The layer that is asked about where one of several is meant: the uppermost that is seen, else the
    /// lowest.
    pub fn inspected(&self) -> &ShownLayer {
        &self.layers[self.inspected_number()]
    }

    fn inspected_number(&self) -> usize {
        self.over_one_another().iter().rposition(ShownLayer::is_seen).unwrap_or(0)
    }

    /// Without the lights and the clouds of a planet.
    fn over_one_another(&self) -> &[ShownLayer] {
        let parts = self.planet.map_or(0, PlanetText::count);
        &self.layers[..self.layers.len() - parts]
    }

    /// Panes of a picture: one, or of layers side by side as many as are seen.
    pub fn panes(&self) -> u32 {
        let is_beside = self.compare_mode == CompareMode::Beside && self.can_compare();
        let seen = || self.over_one_another().iter().filter(|shown| shown.is_seen());
        if is_beside { seen().count() as u32 } else { 1 }
    }

    /// Where the panes of a picture of so many columns are, of which no panel covers those between `free`.
    /// What is left beside them shows the background.
    pub fn panes_in(&self, width: u32, free: [f64; 2]) -> Panes {
        Panes::sharing(self.panes(), width, free)
    }

    /// The layers in the order of the panes, the leftmost first: one for each pane, the layer that is
    /// inspected where there is one pane.
    pub fn in_panes(&self) -> impl Iterator<Item = &ShownLayer> {
        let is_beside = self.panes() > 1;
        let inspected = self.inspected_number();
        let is_in_one = move |(n, shown): &(usize, &ShownLayer)| {
            if is_beside { shown.is_seen() } else { *n == inspected }
        };
        self.over_one_another().iter().enumerate().filter(is_in_one).map(|(_, shown)| shown)
    }

    /// The numbers of the layers in the order of the panes, from the lowest layer.
    pub fn numbers_in_panes(&self) -> Vec<usize> {
        let is_seen = |n: &usize| self.over_one_another()[*n].is_seen();
        let all = 0..self.over_one_another().len();
        if self.panes() > 1 { all.filter(is_seen).collect() } else { vec![self.inspected_number()] }
    }

    /// The layer that is asked about at a share of a pane's width, from the left edge of the picture: the
    /// uppermost that is seen there.
    pub fn inspected_at(&self, across: f64) -> &ShownLayer {
        if self.panes() > 1 {
            let last = self.panes() as usize - 1;
            return self.in_panes().nth((across.max(0.0) as usize).min(last)).unwrap_or(self.inspected());
        }
        let (upper, [begins, _]) = (self.inspected_number(), self.compare_mode.told());
        let beneath = || self.layers[..upper].iter().rev().find(|shown| shown.is_seen());
        let is_beside = across < f64::from(begins);
        beneath().filter(|_| is_beside).unwrap_or(&self.layers[upper])
    }

    /// The layers that may be asked about at such a place: the one that is seen there, and where layers that
    /// lie texel upon texel are not compared those beneath it, which are seen where it has no texel.
    pub fn seen_at(&self, across: f64) -> impl Iterator<Item = &ShownLayer> {
        let see_through = self.by_texel.is_some() && self.compare_mode == CompareMode::Off;
        let beneath = if see_through { &self.layers[..self.inspected_number()] } else { &[] };
        let beneath = beneath.iter().rev().filter(|shown| shown.is_seen());
        std::iter::once(self.inspected_at(across)).chain(beneath)
    }

    /// Over how many texels of its own a layer's texture of so many lies on the place of the lowest one: over
    /// all of them, or where they lie texel upon texel over as many as the lowest one's image has there.
    pub fn spread_over(&self, layer: LayerId, texels: [u32; 2]) -> DVec2 {
        let is_of = |shown: &ShownLayer| shown.layer.texture() == layer.texture();
        self.spread_of(self.layers.iter().position(is_of), texels)
    }

    /// The same of a layer by its number, if it has one.
    fn spread_of(&self, number: Option<usize>, texels: [u32; 2]) -> DVec2 {
        let spread = number.and_then(|number| self.by_texel.as_ref()?.get(number));
        spread.copied().unwrap_or(DVec2::from(texels.map(f64::from)))
    }

    /// Returns true if images of unlike size lie upon the lowest one texel by texel.
    pub fn is_by_texel(&self) -> bool {
        self.by_texel.is_some()
    }

    /// Returns true if the text is that of one opaque layer.
    pub fn is_single(&self) -> bool {
        self.is_single
    }

    /// The ids of what is wanted together, of the layer that is inspected, and of the heights.
    pub(crate) fn ids(&self, textures: &Textures) -> [u32; 3] {
        // What was removed has no id; shaders show what they show for any texture that is not there.
        let id = |layer: LayerId| textures.shader_id(layer).unwrap_or(NO_TEXTURE);
        let color = id(self.inspected().layer);
        let height = self.heights.map_or(color, id);
        let of_group = |group: GroupId| textures.bindings().ids(group).ok()?.first().copied();
        let all = match self.seen.or(self.group.filter(|_| self.is_all_wanted())) {
            Some(group) => of_group(group),
            None => self.wanted().next().map(id),
        };
        [all.unwrap_or(NO_TEXTURE), color, height]
    }

    /// One layer of each texture of which pages are wanted.
    fn wanted(&self) -> impl Iterator<Item = LayerId> {
        let seen = self.layers.iter().filter(|shown| shown.is_seen()).map(|shown| shown.layer);
        let mut textures = Vec::new();
        seen.chain(self.heights).filter(move |layer| {
            let is_new = !textures.contains(&layer.texture());
            textures.push(layer.texture());
            is_new
        })
    }

    /// Texels of each layer's texture, of the heights' and of what is wanted together: as a group has them,
    /// those of its largest texture. Beside each over how many of its own it lies on the lowest one's place.
    pub(crate) fn places(&self, textures: &Textures) -> [([u32; 2], DVec2); MOST_LAYERS + 2] {
        let size = |layer: LayerId| size_of(textures, layer);
        let texels = |layer: &LayerId| size(*layer).iter().map(|&side| u64::from(side)).product::<u64>();
        let mut wanted: Vec<LayerId> = self.wanted().collect();
        wanted.sort_unstable_by_key(|layer| std::cmp::Reverse(layer.texture()));
        let largest = wanted.into_iter().max_by_key(texels);
        let mut sizes = [[1; 2]; MOST_LAYERS + 2];
        self.layers.iter().zip(&mut sizes).for_each(|(shown, place)| *place = size(shown.layer));
        sizes[MOST_LAYERS] = self.heights.map_or([1; 2], size);
        sizes[MOST_LAYERS + 1] = largest.map_or([1; 2], size);
        std::array::from_fn(|n| (sizes[n], self.spread_of(Some(n), sizes[n])))
    }

    fn is_all_wanted(&self) -> bool {
        let is_wanted =
            |shown: &ShownLayer| self.wanted().any(|layer| layer.texture() == shown.layer.texture());
        self.layers.iter().all(is_wanted)
    }

    /// Makes the group by which what is seen is wanted, where it is not the group of all.
    fn gather_seen(&mut self, textures: &mut Textures) -> Result<(), LayersError> {
        let (wanted, is_all) = (self.wanted().collect::<Vec<LayerId>>(), self.is_all_wanted());
        let members = || wanted.iter().enumerate().map(|(n, layer)| (member(n), *layer));
        let is_asked = !is_all && wanted.len() > 1 && self.by_texel.is_none();
        let seen = if !is_asked { None } else { Some(textures.add_group(members())?) };
        if let Some(before) = std::mem::replace(&mut self.seen, seen) {
            textures.remove(before);
        }
        Ok(())
    }

    pub(crate) fn uniforms(&self, textures: &Textures) -> [LayerUniform; MOST_LAYERS] {
        let mut uniforms = [LayerUniform::default(); MOST_LAYERS];
        for (uniform, shown) in uniforms.iter_mut().zip(&self.layers) {
            // A layer that is gone has no id: shaders show what they show for any texture that is not there.
            let opacity = if shown.is_visible { shown.opacity.clamp(0.0, 1.0) } else { 0.0 };
            *uniform = shown.color_map.uniform(opacity, textures.shader_id(shown.layer).unwrap_or(0));
            if self.rows_there(shown.layer.texture()) < 1.0 {
                uniform.grow();
            }
        }
        if self.panes() > 1 {
            let seen = self.layers.iter().zip(&mut uniforms).filter(|(shown, _)| shown.is_seen());
            for (pane, (_, uniform)) in (0u8..).zip(seen) {
                (uniform.begins, uniform.ends) = (pane.into(), (pane + 1).into());
            }
        } else if self.can_compare() {
            let [begins, difference] = self.compare_mode.told();
            let uppermost = &mut uniforms[self.inspected_number()];
            let is_alone = self.by_texel.is_some() && self.compare_mode.takes_turns();
            (uppermost.begins, uppermost.difference) = (begins, if is_alone { -1.0 } else { difference });
        }
        uniforms
    }

    /// What pipelines of the scene are made with for a target that is given light or else display values.
    pub(crate) fn constants(&self, takes_light: bool) -> [(&'static str, f64); 3] {
        let map = self.inspected().color_map;
        if self.is_single {
            return map.constants(takes_light);
        }
        // The sum of several is light, as the background behind them is. Each is told its own look, and the
        // pipeline which shades any of them needs.
        let [(look, _), decodes, encodes] = map.of_light().constants(takes_light);
        let shades = ColorMap::shades(self.layers.iter().map(|shown| &shown.color_map));
        [(look, f64::from(shades)), decodes, encodes]
    }

    /// What shaders are told of values: of a single layer its own, else nothing that is used.
    pub(crate) fn shown_map(&self) -> ColorMap {
        let map = self.inspected().color_map;
        if self.is_single { map } else { map.of_light() }
    }

    /// The part of shader texts by which layers are sampled, for what [`Layers::kinds`] gives.
    pub fn text_of(&self, kinds: &Kinds) -> LayersText {
        let (is_single, is_grouped) = (self.is_single, self.group.is_some());
        let breaks = LayersText::list(kinds, self.over_one_another().len()).breaks;
        let (count, planet, is_by_texel) = (self.count(), self.planet, self.is_by_texel());
        LayersText { count, is_single, is_grouped, breaks, planet, is_by_texel }
    }

    /// Returns true if the layers are on a planet.
    pub fn is_on_planet(&self) -> bool {
        self.planet.is_some()
    }
}

fn is_single(layers: &[ShownLayer]) -> bool {
    matches!(layers, [layer] if layer.hides_all())
}
