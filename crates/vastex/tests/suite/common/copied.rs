//! Pictures of the screen, copied back row by row.

use vastex_wgpu::test_device::finish;

use super::{MAIN, PICTURE, Screen, begin_picture, draw};

/// Bytes of a row of a picture that is copied.
const ROW: u32 = (PICTURE[0] * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);

impl Screen {
    /// The picture from what is in the pool now, row by row.
    pub fn picture(&self) -> Vec<[u8; 4]> {
        let (encoder, buffer) = self.record_copy();
        self.gpu.queue.submit([encoder.finish()]);
        self.read_copy(&buffer)
    }

    /// The picture with what is bound now, which says nothing of what it wants, and a copy of it; not yet
    /// submitted.
    pub fn record_copy(&self) -> (wgpu::CommandEncoder, wgpu::Buffer) {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let view = self.colour.create_view(&Default::default());
        let depth = self.depth.create_view(&Default::default());
        let mut pass = begin_picture(&mut encoder, &view, &depth);
        draw(&mut pass, MAIN, &self.shown, |shown| {
            (&shown.picture, self.textures.bind_group(shown.sampled).unwrap())
        });
        drop(pass);
        let buffer = self.copy_picture(&mut encoder);
        (encoder, buffer)
    }

    /// Records a copy of the picture that the commands before have drawn.
    pub fn copy_picture(&self, encoder: &mut wgpu::CommandEncoder) -> wgpu::Buffer {
        let buffer = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(ROW * PICTURE[1]),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(ROW), rows_per_image: None };
        let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(self.colour.as_image_copy(), target, self.colour.size());
        buffer
    }

    /// Such a picture, once its commands are submitted.
    pub fn read_copy(&self, buffer: &wgpu::Buffer) -> Vec<[u8; 4]> {
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        finish(&self.gpu.device);
        let bytes = buffer.get_mapped_range(..).unwrap();
        let rows = bytes.chunks(ROW as usize).flat_map(|row| &row[..PICTURE[0] as usize * 4]);
        let bytes: Vec<u8> = rows.copied().collect();
        bytemuck::cast_slice(&bytes).to_vec()
    }
}
