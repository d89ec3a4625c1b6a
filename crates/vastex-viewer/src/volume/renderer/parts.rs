//! A volume drawn in parts, and with other channels than before.

use std::ops::Range;

use vastex::{LayerId, Sampled, Textures};

use super::{
    LabelsOnGpu, Purpose, SceneUniform, VolumeCameraBinding, VolumeDesc, VolumeError, VolumeRenderer, bound,
    brick_of,
};
use crate::stage::{Target, Uniform};

impl VolumeRenderer {
    /// Draws rows of the picture that a camera sees, of `size` pixels in all; what is there of the others
    /// stays. For pictures that take longer than a frame may.
    pub fn draw_rows(
        &self,
        camera: &VolumeCameraBinding,
        encoder: &mut wgpu::CommandEncoder,
        textures: &wgpu::BindGroup,
        target: &Target<'_>,
        (size, rows): ([u32; 2], Range<u32>),
    ) {
        let mut pass = target.go_on(encoder);
        let end = rows.end.min(size[1]);
        if rows.start < end {
            pass.set_scissor_rect(0, rows.start, size[0], end - rows.start);
            self.draw(camera, &mut pass, textures, Purpose::Picture);
        }
    }

    /// Draws as described from now on, also with other channels. Several channels become a group of the
    /// textures, in the place of the one before. Fails as [`VolumeRenderer::new`] does, and if the channels
    /// lie in another pool than those before; then it draws as it did.
    pub fn show(&mut self, textures: &mut Textures, desc: VolumeDesc) -> Result<(), VolumeError> {
        let layers = |desc: &VolumeDesc| desc.channels.iter().map(|c| c.layer).collect::<Vec<LayerId>>();
        if layers(&desc) != layers(&self.desc) {
            let (sampled, bound, kinds) = bound(textures, &desc)?;
            let is_fit = kinds.binds_like(&self.kinds);
            // What is not drawn any more, or is not drawn.
            let gone = if is_fit { [self.of_channels, self.bound] } else { [sampled, bound] };
            gone.into_iter().for_each(|group| remove_group(textures, group));
            if !is_fit {
                return Err(VolumeError::Apart);
            }
            (self.of_channels, self.bound) = (sampled, bound);
        }
        self.desc = desc;
        Ok(())
    }

    /// A renderer of other channels beside this one, by the same shaders, which are not compiled again: the
    /// volume at another time. Fails as [`VolumeRenderer::new`] does, and where the channels lie in other
    /// pools than these, or labels are shown by one of the two alone.
    pub fn beside(&self, textures: &mut Textures, desc: VolumeDesc) -> Result<VolumeRenderer, VolumeError> {
        let has_labels = |desc: &VolumeDesc| (desc.labels.is_some(), desc.channels.is_empty());
        if has_labels(&desc) != has_labels(&self.desc) || desc.is_exact != self.desc.is_exact {
            return Err(VolumeError::Apart);
        }
        let (sampled, bound, kinds) = bound(textures, &desc)?;
        if !kinds.binds_like(&self.kinds) {
            [sampled, bound].into_iter().for_each(|group| remove_group(textures, group));
            return Err(VolumeError::Apart);
        }
        let gpu = self.gpu.clone();
        let labels = desc.labels.as_ref().map(|labels| LabelsOnGpu::new(&gpu, labels, self.told_in));
        let uniform = Uniform::new_in::<SceneUniform>(&gpu.device, &self.camera_layout, self.told_in);
        let brick = brick_of(textures, &desc)?;
        Ok(VolumeRenderer {
            drawn: 0,
            desc,
            of_channels: sampled,
            kinds,
            bound,
            told_in: self.told_in,
            brick,
            format: self.format,
            module: self.module.clone(),
            layout: self.layout.clone(),
            camera_layout: self.camera_layout.clone(),
            camera: VolumeCameraBinding::new(uniform, labels.as_ref().map(|labels| labels.camera(&gpu)), 0),
            labels,
            pipelines: self.pipelines.clone(),
            gpu,
        })
    }

    /// Takes back what it added to the textures. The channels themselves stay.
    pub fn forget(self, textures: &mut Textures) {
        self.give_back(textures);
    }

    /// Takes back what this renderer added to the textures, when another is about to take its place. It must
    /// draw nothing afterwards.
    pub fn give_back(&self, textures: &mut Textures) {
        [self.of_channels, self.bound].into_iter().for_each(|group| remove_group(textures, group));
    }
}

fn remove_group(textures: &mut Textures, sampled: Sampled) {
    if let Sampled::Group(_) = sampled {
        textures.remove(sampled);
    }
}
