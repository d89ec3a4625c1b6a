//! A picture of surfaces that stays on the GPU, for frames in which only what lies over it changes.

/// What a window's pictures are drawn into first, to be copied into the window: its own pictures are others
/// in each frame. Whoever draws knows it by [`Target::lasting`](super::Target::lasting), and in a frame whose
/// picture would be the same one records the copy alone.
#[derive(Debug)]
pub struct KeptPicture {
    view: wgpu::TextureView,
}

impl KeptPicture {
    /// For a window's pictures of `size` pixels, whose textures have one format, the first, and are drawn to
    /// by views of the other. These textures need `COPY_DST`. Takes as much memory as one of them, as a rule
    /// 4 bytes a pixel.
    pub fn new(
        device: &wgpu::Device,
        size: [u32; 2],
        [stored, viewed]: [wgpu::TextureFormat; 2],
    ) -> KeptPicture {
        let view_formats = [viewed];
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("kept picture"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: stored,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: if viewed == stored { &[] } else { &view_formats },
        });
        let described = wgpu::TextureViewDescriptor { format: Some(viewed), ..Default::default() };
        KeptPicture { view: texture.create_view(&described) }
    }

    pub(super) fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Records the copy into a picture of the same size.
    pub(super) fn copy(&self, encoder: &mut wgpu::CommandEncoder, picture: &wgpu::TextureView) {
        let (kept, picture) = (self.view.texture(), picture.texture());
        debug_assert_eq!((picture.depth_or_array_layers(), picture.mip_level_count()), (1, 1));
        encoder.copy_texture_to_texture(kept.as_image_copy(), picture.as_image_copy(), kept.size());
    }
}
