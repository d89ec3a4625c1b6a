//! What shaders read of a pool's tables and of the records, through the modules that do so, from buffers and
//! from textures.

use vastex_core::{ChangeRule, Dims, PageId, PagePos, Slot, TableChange, TableEntry, TextureNumber};
use vastex_wgpu::{FeedbackMode, ParamStore, PoolTableChanger, PoolTables, shader_module};

use crate::common::{GPU, read, storage};
use crate::table_texts::text;

/// Words of a record.
const STRIDE: u32 = 5;

#[test]
fn shaders_find_every_page_of_every_texture_of_a_pool() {
    let gpu = &*GPU;
    let (device, queue) = (&gpu.device, &gpu.queue);
    for mode in [FeedbackMode::Separate, FeedbackMode::Raw] {
        let changer = PoolTableChanger::new(device, mode);
        let mut tables = PoolTables::hashed(device, queue, mode, 100).unwrap();
        let mut params = ParamStore::new(device, STRIDE).unwrap();
        let number = |n: u32| TextureNumber::new((n % 40 * 50) as u16).unwrap();
        let loads: Vec<TableChange> = (0..3000)
            .map(|n| {
                let pos = PagePos::new_2d((n / 40 % 20) as u8, n / 800 * 70_000 + n % 3, n % 7);
                let page = PageId::new(number(n), Dims::D2, pos).unwrap();
                TableChange {
                    page,
                    rule: ChangeRule::Coarser,
                    entry: TableEntry::new(pos.level, Slot::new(n)),
                }
            })
            .collect();
        for n in 0..40 {
            params.set(number(n), &[[1, 2, 3, 4], [5, n + 1000, 6, 7]]);
        }
        for loads in loads.chunks(500) {
            let mut encoder = device.create_command_encoder(&Default::default());
            let mut budget = u64::MAX;
            tables.apply(&changer, device, queue, &mut encoder, loads, &mut |_, _| (), &mut budget).unwrap();
            params.write(device, &mut encoder).unwrap();
            queue.submit([encoder.finish()]);
            tables.submitted();
            params.submitted();
        }
        // Every page that is there, and as many that are not: the same of the next texture.
        let mut asked: Vec<[u32; 4]> = Vec::new();
        let mut expected: Vec<[u32; 2]> = Vec::new();
        for (n, load) in (0..).zip(&loads) {
            for texture in
                [load.page.texture(), TextureNumber::new(load.page.texture().number() + 1).unwrap()]
            {
                let page = PageId::new(texture, Dims::D2, load.page.pos(Dims::D2)).unwrap();
                let bits = page.to_bits();
                asked.push([bits as u32, (bits >> 32) as u32, u32::from(number(n).number()), 1]);
                let found = tables.hash_table().unwrap().get(page).map_or(u32::MAX, TableEntry::to_bits);
                expected.push([found, n % 40 + 1000]);
            }
        }
        assert_eq!(expected.iter().filter(|[found, _]| *found == u32::MAX).count(), 3000);
        let answers = storage(gpu, bytemuck::cast_slice(&asked));
        let module = shader_module(device, None, text(mode));
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            cache: None,
        });
        let resources = [tables.binding(), params.binding(), answers.as_entire_binding()];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(asked.len().div_ceil(64) as u32, 1, 1);
        drop(pass);
        queue.submit([encoder.finish()]);
        let answers: Vec<[u32; 4]> = read(gpu, &answers);
        for ((answer, expected), asked) in answers.iter().zip(&expected).zip(&asked) {
            assert_eq!(answer[..2], expected[..], "{mode:?}: {asked:x?}");
            assert_eq!(answer[2], 2048, "records for numbers up to 1950");
        }
    }
}
