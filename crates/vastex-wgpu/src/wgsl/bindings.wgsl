// The bind group of one virtual texture, at the index that the application chose; the page table, vastex_table, stands
// before it, the atlas in atlas_*.wgsl.

@group(VASTEX_GROUP) @binding(VASTEX_BINDING_TEXTURE) var<uniform> vastex_texture: VastexTexture;
@group(VASTEX_GROUP) @binding(VASTEX_BINDING_POOL) var<uniform> vastex_pool: VastexPool;
@group(VASTEX_GROUP) @binding(VASTEX_BINDING_VIEW) var<uniform> vastex_view: VastexView;
@group(VASTEX_GROUP) @binding(VASTEX_BINDING_SAMPLER) var vastex_sampler: sampler;
