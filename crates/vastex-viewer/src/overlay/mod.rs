//! Views of the machine: what sampling goes by, drawn in the place of the picture.
//!
//! Some colour the surface, some draw a plan of the page table, of the slots or of the feedback.
//! docs/overlays.md says how to read them.

mod small;

use vastex::diagnostics::{FeedbackTarget, SlotUsage};
use vastex::{Error, Textures};

use crate::layers::ShownLayer;
use crate::stage::{StageScene, Target};
use crate::surface::{CameraBinding, ScenePipelines, SceneRenderer};
pub use small::SmallOverlay;

/// What is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Overlay {
    /// A colour for each level that is shown.
    Levels,
    /// A colour for each level that is wanted at mip bias 0, blended between levels.
    Wanted,
    /// How many levels coarser than wanted the surface is.
    Deficit,
    /// The borders of the pages that are shown.
    Pages,
    /// What the feedback pass of the frame sees: a colour for each page.
    Feedback,
    /// The page table: every page of every level, in the colour of the level that it leads to.
    Table,
    /// The slots of the pool and the tiles in them.
    Atlas,
}

impl Overlay {
    /// Every overlay.
    pub const ALL: [Overlay; 7] = [
        Overlay::Levels,
        Overlay::Wanted,
        Overlay::Deficit,
        Overlay::Pages,
        Overlay::Feedback,
        Overlay::Table,
        Overlay::Atlas,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Overlay::Levels => "levels",
            Overlay::Wanted => "wanted",
            Overlay::Deficit => "deficit",
            Overlay::Pages => "pages",
            Overlay::Feedback => "feedback",
            Overlay::Table => "table",
            Overlay::Atlas => "atlas",
        }
    }

    /// The next one, after the last none.
    pub fn next(overlay: Option<Overlay>) -> Option<Overlay> {
        let place = overlay.map_or(0, |overlay| overlay as usize + 1);
        Overlay::ALL.get(place).copied()
    }

    /// The overlay's entry point, and true if it colours the surface; else it is a plan.
    fn entry(self) -> (&'static str, bool) {
        match self {
            Overlay::Levels => ("shade_levels", true),
            Overlay::Wanted => ("shade_wanted", true),
            Overlay::Deficit => ("shade_deficit", true),
            Overlay::Pages => ("shade_pages", true),
            Overlay::Feedback => ("shade_feedback", false),
            Overlay::Table => ("shade_table", false),
            Overlay::Atlas => ("shade_atlas", false),
        }
    }
}

/// Texels in a row of the texture that tells the state of the slots.
const TEXELS_IN_A_ROW: u32 = 1024;

/// What draws an overlay: on the surface, or as a plan in each pane.
#[derive(Debug)]
enum Method {
    OnSurface(ScenePipelines),
    Plans(Vec<Plan>),
}

/// The plan of a pane.
#[derive(Debug)]
struct Plan {
    /// What it is of.
    shown: ShownLayer,
    camera: CameraBinding,
    pipeline: wgpu::RenderPipeline,
    /// A texture of its own, where it reads one.
    read: Option<wgpu::BindGroup>,
}

impl Plan {
    /// Returns true if it is drawn by what was made for it.
    fn is_of(&self, shown: &ShownLayer) -> bool {
        self.shown.layer == shown.layer && self.shown.color_map.shares_pipelines(&shown.color_map)
    }
}

/// Draws one overlay of a scene; of several layers, for the one that is inspected at each place
/// ([`crate::Layers::inspected_at`]), so that of layers side by side each pane has its own. Made anew where
/// the scene's renderer is.
#[derive(Debug)]
pub struct OverlayRenderer {
    overlay: Overlay,
    method: Method,
    /// Where plans read a texture of their own.
    layout: Option<wgpu::BindGroupLayout>,
}

impl OverlayRenderer {
    /// Prepares an overlay for pictures of the renderer's format. Fails where the texture was removed.
    pub fn new(
        device: &wgpu::Device,
        textures: &Textures,
        renderer: &SceneRenderer,
        overlay: Overlay,
    ) -> Result<OverlayRenderer, Error> {
        let (entry, is_on_surface) = overlay.entry();
        let reads_texture = matches!(overlay, Overlay::Feedback | Overlay::Atlas);
        let layout = reads_texture.then(|| texture_layout(device));
        let method = match is_on_surface {
            true => Method::OnSurface(renderer.pipelines(entry, None, &[renderer.format()])),
            false => Method::Plans(plans(device, textures, renderer, overlay)?),
        };
        Ok(OverlayRenderer { overlay, method, layout })
    }

    /// Which overlay it is.
    pub fn overlay(&self) -> Overlay {
        self.overlay
    }

    /// Takes in what the overlay shows of this frame beside the bind group of its texture: to be called
    /// before each [`OverlayRenderer::draw`]. Before the frame's own feedback is drawn, or after it is
    /// submitted, with the scene's eye where it is in this frame. Compiles pipelines where other layers are
    /// in the panes than before.
    pub fn look(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        textures: &Textures,
        renderer: &SceneRenderer,
        picture: [u32; 2],
    ) -> Result<(), Error> {
        let Method::Plans(drawn) = &mut self.method else { return Ok(()) };
        let layers = renderer.layers();
        let is_same = drawn.len() == layers.in_panes().count()
            && drawn.iter().zip(layers.in_panes()).all(|(plan, shown)| plan.is_of(shown));
        if !is_same {
            *drawn = plans(device, textures, renderer, self.overlay)?;
        }
        let feedback = match self.overlay {
            Overlay::Feedback => {
                let target: FeedbackTarget =
                    textures.inspect().feedback_to_look_at(picture, |pass, groups| {
                        if let Some(group) = groups.get(renderer.sampled()) {
                            renderer.draw_wanted(renderer.camera(), pass, group);
                        }
                    })?;
                Some(target.raw().view().clone())
            }
            _ => None,
        };
        for (plan, shown) in drawn.iter_mut().zip(layers.in_panes()) {
            plan.shown = *shown;
            renderer.place_plan(&plan.camera, queue, textures, shown, picture);
            let Some(layout) = &self.layout else { continue };
            let view = match &feedback {
                Some(view) => view.clone(),
                None => {
                    let texture = shown.layer.texture();
                    let slots = textures.inspect().slots_beside(texture);
                    let [width, height, _] = textures.texture(texture)?.description().geometry.tile();
                    let pane = [renderer.panes_in(picture).width, picture[1]];
                    let columns = columns(slots.len(), pane, [width, height]);
                    slots_texture(device, queue, &slots, columns)
                }
            };
            plan.read = Some(device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("overlay"),
                layout,
                entries: &[wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&view),
                }],
            }));
        }
        Ok(())
    }

    /// Draws the overlay. If its texture was removed, it draws nothing.
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        renderer: &SceneRenderer,
        textures: &Textures,
        target: &Target<'_>,
    ) {
        let mut pass = target.begin(encoder, renderer.background());
        match &self.method {
            Method::OnSurface(pipelines) => {
                if let Ok(group) = textures.bind_group(renderer.sampled()) {
                    renderer.draw(&mut pass, pipelines, group);
                }
            }
            Method::Plans(plans) => {
                for (pane, plan) in (0..).zip(plans) {
                    let Ok(group) = textures.bind_group(plan.shown.layer) else { continue };
                    if let Some(read) = &plan.read {
                        pass.set_bind_group(2, read, &[]);
                    }
                    renderer.draw_plan(&mut pass, (&plan.camera, pane), &plan.pipeline, group);
                }
            }
        }
    }
}

/// The plan of each pane. Fails where a texture was removed.
fn plans(
    device: &wgpu::Device,
    textures: &Textures,
    renderer: &SceneRenderer,
    overlay: Overlay,
) -> Result<Vec<Plan>, Error> {
    let (entry, _) = overlay.entry();
    let group = matches!(overlay, Overlay::Feedback | Overlay::Atlas).then_some(&TEXTURE_ENTRIES[..]);
    let plan = |shown: &ShownLayer| {
        let pipeline = renderer.plan_pipeline(textures, shown, entry, group)?;
        Ok(Plan { shown: *shown, camera: renderer.new_camera(device), pipeline, read: None })
    };
    renderer.layers().in_panes().map(plan).collect()
}

/// A texture of whole numbers.
const TEXTURE_ENTRIES: [wgpu::BindGroupLayoutEntry; 1] = [wgpu::BindGroupLayoutEntry {
    binding: 0,
    visibility: wgpu::ShaderStages::FRAGMENT,
    ty: wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Uint,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    },
    count: None,
}];

fn texture_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let (label, entries) = (Some("overlay"), &TEXTURE_ENTRIES);
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries })
}

/// As few columns of slots, a tile wide and high each, as let all rows fit into a picture.
fn columns(slots: usize, picture: [u32; 2], tile: [u32; 2]) -> u32 {
    if picture.contains(&0) || slots == 0 {
        return 1;
    }
    let [width, height] = picture.map(f64::from);
    let tile_aspect = f64::from(tile[1]) / f64::from(tile[0]);
    let fits = |&columns: &u32| {
        let rows = slots.div_ceil(columns as usize) as f64;
        rows * tile_aspect * width / f64::from(columns) <= height
    };
    let least = (slots as f64 * width / height * tile_aspect).sqrt().floor().max(1.0) as u32;
    (least..).find(fits).unwrap_or(least) // there is one: with more and more columns a row becomes as low as one likes
}

/// What overlay/wgsl/atlas.wgsl reads: how many slots there are and in how many columns, then for each how
/// many pages its tile is of, and what they are; 0 where it is free.
fn slots_texture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    slots: &[Option<SlotUsage>],
    columns: u32,
) -> wgpu::TextureView {
    const IN_VIEW: u32 = 1 << 8;
    const LOCKED: u32 = 1 << 9;
    const PAGES: u32 = 10;
    let state = |usage: &SlotUsage| {
        let in_view = if usage.is_in_view { IN_VIEW } else { 0 };
        let locked = if usage.is_locked { LOCKED } else { 0 };
        u32::from(usage.page.level()) | in_view | locked | (usage.pages.min(u32::MAX >> PAGES) << PAGES)
    };
    let mut states = vec![slots.len() as u32, columns];
    states.extend(slots.iter().map(|slot| slot.as_ref().map_or(0, state)));
    let rows = (states.len() as u32).div_ceil(TEXELS_IN_A_ROW);
    states.resize((rows * TEXELS_IN_A_ROW) as usize, 0);
    let size = wgpu::Extent3d { width: TEXELS_IN_A_ROW, height: rows, depth_or_array_layers: 1 };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("overlay"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R32Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(4 * TEXELS_IN_A_ROW),
        rows_per_image: None,
    };
    queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(&states), layout, size);
    texture.create_view(&Default::default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_slots_fit_into_the_picture() {
        for slots in [1, 2, 7, 160, 1000, 12_345] {
            for picture in [[640, 360], [100, 900], [1, 1], [1920, 1080]] {
                for tile in [[136, 136], [40, 20], [8, 64]] {
                    let columns = columns(slots, picture, tile);
                    let cell = f64::from(picture[0]) / f64::from(columns);
                    let high = slots.div_ceil(columns as usize) as f64 * cell * f64::from(tile[1])
                        / f64::from(tile[0]);
                    assert!(
                        high <= f64::from(picture[1]) + 1e-6,
                        "{slots} {picture:?} {tile:?}: {columns} columns"
                    );
                }
            }
        }
    }

    #[test]
    fn every_overlay_has_its_turn() {
        let mut seen = Vec::new();
        let mut overlay = Overlay::next(None);
        while let Some(shown) = overlay {
            seen.push(shown);
            overlay = Overlay::next(overlay);
        }
        assert_eq!(seen, Overlay::ALL);
    }
}
