//! What the pictures of a window have to be for some layers.

use crate::layers::Layers;
use crate::stage::TargetKind;
use crate::surface::SceneRenderer;

/// What the pictures of a window have to be for some layers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureFormat {
    /// The format of the pictures themselves.
    pub stored: wgpu::TextureFormat,
    /// The format of the views of them that are drawn to.
    pub viewed: wgpu::TextureFormat,
    /// What scenes are drawn into.
    pub kind: TargetKind,
}

impl PictureFormat {
    /// The format that scenes are drawn in.
    pub fn drawn_format(&self) -> wgpu::TextureFormat {
        self.kind.drawn_format(self.viewed)
    }
}

/// What the pictures of a window can be.
#[derive(Clone, Debug)]
pub struct PictureFormats {
    adapter: wgpu::Adapter,
    offered: Vec<wgpu::TextureFormat>,
    usual: wgpu::TextureFormat,
}

impl PictureFormats {
    /// Pictures of a window whose surface offers some formats, the best first, and has `usual` where none of
    /// them is known here.
    pub fn new(
        adapter: &wgpu::Adapter,
        offered: Vec<wgpu::TextureFormat>,
        usual: wgpu::TextureFormat,
    ) -> PictureFormats {
        PictureFormats { adapter: adapter.clone(), offered, usual }
    }

    /// What pictures of these layers have to be.
    pub fn for_layers(&self, layers: &Layers) -> PictureFormat {
        let [stored, viewed] = self.choose(layers.picture_format());
        PictureFormat { stored, viewed, kind: SceneRenderer::target_kind(&self.adapter, layers) }
    }

    /// What pictures that are drawn straight have to be: such as panels alone, or nothing yet.
    pub fn straight(&self, picture: wgpu::TextureFormat) -> PictureFormat {
        let [stored, viewed] = self.choose(picture);
        PictureFormat { stored, viewed, kind: TargetKind::Direct }
    }

    /// Chooses a format that encodes colours as pictures do: of the surface itself, or else of views of it.
    /// The first is that of the surface, the second that of the views.
    fn choose(&self, picture: wgpu::TextureFormat) -> [wgpu::TextureFormat; 2] {
        let is_plain = |format: &wgpu::TextureFormat| {
            use wgpu::TextureFormat::{Bgra8Unorm, Rgba8Unorm};
            matches!(format.remove_srgb_suffix(), Bgra8Unorm | Rgba8Unorm)
        };
        let alike = |format: &&wgpu::TextureFormat| is_plain(format) && format.is_srgb() == picture.is_srgb();
        if let Some(&format) = self.offered.iter().find(alike) {
            return [format; 2];
        }
        let stored = self.offered.iter().find(|format| is_plain(format)).copied().unwrap_or(self.usual);
        let other = match picture.is_srgb() {
            true => stored.add_srgb_suffix(),
            false => stored.remove_srgb_suffix(),
        };
        let flags = self.adapter.get_downlevel_capabilities().flags;
        let has_views = flags.contains(wgpu::DownlevelFlags::SURFACE_VIEW_FORMATS);
        if has_views { [stored, other] } else { [stored; 2] }
    }
}
