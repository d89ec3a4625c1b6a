//! A group samples each member as that is sampled alone, and its feedback is that of its shape without a
//! tail.

use vastex_core::{
    AddressMode, Description, Dims, Geometry, GeometrySpec, Layer, LayerFormat, LevelRule, PageId, PagePos,
    TextureNumber,
};
use vastex_wgpu::{
    FeedbackMode, Filter, KindMember, Kinds, ParamStore, Pool, PoolTables, TableKind, group_record, shader_id,
};

use crate::common::{Bindings, GPU, Random, World, params_of};
use crate::fade::faded;
use crate::sampling::{HARNESS, Harness, Input, Output, inputs, pipeline, run};

const NUMBER: TextureNumber = TextureNumber::new(1500).unwrap();
/// Of the textures.
const NUMBERS: [TextureNumber; 3] =
    [TextureNumber::new(0).unwrap(), TextureNumber::new(700).unwrap(), TextureNumber::new(2046).unwrap()];
const NAMES: [&str; 4] = ["color", "height", "night", "clouds_2"];

fn image(size: [u32; 2], page: u32, border: u32, layers: &[Layer]) -> Description {
    let address = [AddressMode::Wrap, AddressMode::Clamp, AddressMode::Clamp];
    let tail_align = Description::tail_align(layers);
    let spec = GeometrySpec { page, border, address, tail_align, ..GeometrySpec::image(size[0], size[1]) };
    Description::new(Geometry::new(spec).unwrap(), layers.to_vec())
}

/// A color and a height of one texture, and two textures of other sizes, page sizes and formats.
struct Planet {
    worlds: [World; 3],
    fade: bool,
}

impl Planet {
    fn new() -> Planet {
        let layers = [
            Layer::new("color", LayerFormat::Rgba8Srgb),
            Layer { scale: 2, ..Layer::new("height", LayerFormat::R32Float) },
        ];
        let one = |format| [Layer::new("only", format)];
        let of = |description: &Description, nth: usize| {
            let mut random = Random(nth as u64 + 4);
            let mut resident: Vec<PagePos> = description.geometry.pages().skip(1).collect();
            resident.retain(|_| random.unit() < 0.5);
            let kind = [TableKind::Hashed, TableKind::Direct][nth % 2];
            let (number, mode) = (NUMBERS[nth], FeedbackMode::Separate);
            World::numbered(&GPU, description, 0, resident, kind, nth as u64 + 3, number, mode)
        };
        let mut worlds = [
            of(&image([1000, 600], 64, 8, &layers), 0),
            of(&image([500, 300], 32, 2, &one(LayerFormat::R8)), 1),
            of(&image([333, 401], 64, 4, &one(LayerFormat::Bc5)), 2),
        ];
        for (world, bias) in worlds.iter_mut().zip([0, 5, 9]) {
            world.pool.set_bias(&GPU.queue, bias);
        }
        Planet { worlds, fade: false }
    }

    /// The same with tiles that have come at different times.
    fn fading() -> Planet {
        let Planet { worlds, .. } = Planet::new();
        Planet { worlds: worlds.map(|world| faded(world, 7)), fade: true }
    }

    /// The members: which world, and which layer of it.
    fn members(&self) -> [(&World, usize); 4] {
        let [earth, night, clouds] = &self.worlds;
        [(earth, 0), (earth, 1), (night, 0), (clouds, 0)]
    }

    /// The records of all textures, and that of the group.
    fn params(&self) -> ParamStore {
        let textures = self.worlds.iter().map(|world| (world.number, world.record(&world.tables)));
        let group = group_record(&self.worlds[0].geometry, shader_id(NUMBER, 1));
        params_of(&GPU, &textures.chain([(NUMBER, group)]).collect::<Vec<_>>())
    }
}

struct Group {
    filter: Filter,
    bindings: Bindings,
    group: wgpu::BindGroup,
}

impl Group {
    fn new(planet: &Planet, filter: Filter) -> Group {
        let members = planet.members().into_iter().zip(NAMES).zip([0, 0, 1, 2]);
        let member = |(((world, layer), name), pool): (((&World, usize), &str), usize)| KindMember {
            name: name.to_owned(),
            pool,
            kind: world.kind(layer, filter),
        };
        let kinds = Kinds::of_group(members.map(member).collect(), FeedbackMode::Separate, planet.fade);
        let bindings = Bindings::of(&GPU, kinds.unwrap());
        let pools: Vec<(&Pool, &PoolTables)> =
            planet.worlds.iter().map(|world| (&world.pool, &world.tables)).collect();
        let group = bindings.group_of(&GPU, &planet.params(), pools);
        Group { filter, bindings, group }
    }

    /// The harness with other names in the place of `vastex_sample` and `vastex_feedback`.
    fn run(&self, sample: &str, feedback: &str, ids: [u32; 2], inputs: &[Input]) -> Vec<Output> {
        let feedback = format!("{feedback}_");
        let harness = HARNESS.replace("vastex_feedback_level(ID", "vastex_feedback_level(WANTED");
        let harness = harness.replace("vastex_feedback_grad(ID", "vastex_feedback_grad(WANTED");
        let harness = harness.replace("vastex_sample", sample).replace("vastex_feedback_", &feedback);
        let text = self.bindings.text(&harness, ids[0]).with("WANTED", ids[1]);
        run(&GPU, &pipeline(&GPU, &self.bindings.layout, &text), &self.group, inputs)
    }

    fn check_members(&self, planet: &Planet, inputs: &[Input]) {
        for (nth, name) in NAMES.into_iter().enumerate() {
            let (sample, feedback) = (format!("vastex_sample_{name}"), format!("vastex_feedback_{name}"));
            let (world, layer) = planet.members()[nth];
            let outputs = self.run(&sample, &feedback, [world.id; 2], inputs);
            let alone = Harness::with_fade(&GPU, self.filter, world, layer, planet.fade);
            let alone = alone.run(world, inputs);
            for ((input, output), alone) in inputs.iter().zip(&outputs).zip(&alone) {
                assert_eq!(
                    output.color.map(f32::to_bits),
                    alone.color.map(f32::to_bits),
                    "{name}: {input:?}"
                );
                assert_eq!(output.feedback, alone.feedback, "{name}: {input:?}");
            }
        }
    }
}

#[test]
fn every_member_is_sampled_as_if_it_were_alone() {
    let mut planet = Planet::new();
    let inputs = inputs(&planet.worlds[0].geometry, 31);
    for filter in Filter::KINDS {
        Group::new(&planet, filter).check_members(&planet, &inputs);
    }
    // What changes of textures and pools is told to the group.
    planet.worlds[1].set_rule(&GPU, LevelRule { bias: 1.5, finest: 1, coarsest: 4 });
    planet.worlds[2].pool.set_bias(&GPU.queue, 13);
    Group::new(&planet, Filter::Trilinear).check_members(&planet, &inputs);
}

#[test]
fn members_of_several_pools_fade_in_as_if_each_were_alone() {
    let planet = Planet::fading();
    let inputs = inputs(&planet.worlds[0].geometry, 33);
    for filter in [Filter::Trilinear, Filter::Bicubic] {
        Group::new(&planet, filter).check_members(&planet, &inputs);
    }
}

#[test]
fn feedback_of_a_group_names_pages_of_every_level_of_its_shape() {
    let planet = Planet::new();
    let group = Group::new(&planet, Filter::Trilinear);
    let (world, geometry) = (&planet.worlds[0], &planet.worlds[0].geometry);
    let inputs = inputs(geometry, 32);
    let ids = [world.id, shader_id(NUMBER, 1)];
    let outputs = group.run("vastex_sample_color", "vastex_feedback", ids, &inputs);
    let alone = Harness::new(&GPU, Filter::Trilinear, world, 0).run(world, &inputs);
    let page = |feedback: [u32; 4]| {
        PageId::from_bits(u64::from(feedback[1]) << 32 | u64::from(feedback[0])).unwrap()
    };
    let mut beyond = [0; 12];
    for (output, alone) in outputs.iter().zip(&alone) {
        let (found, known) = (page(output.feedback), page(alone.feedback).pos(Dims::D2));
        assert_eq!((found.texture(), output.feedback[3]), (NUMBER, alone.feedback[3]));
        let pos = found.pos(Dims::D2);
        if geometry.is_tail(known) {
            // The tail answers for every level from its first on; the group says which.
            let pages = geometry.level(pos.level).pages;
            assert!(pos.level >= known.level && pos.x < pages[0] && pos.y < pages[1], "{pos}");
            beyond[usize::from(pos.level)] += 1;
        } else {
            assert_eq!((pos, output.feedback[2]), (known, alone.feedback[2]));
        }
    }
    let (tail, coarsest) = (geometry.tail().first_level(), geometry.coarsest());
    assert!(tail < coarsest);
    let tried = &beyond[usize::from(tail)..=usize::from(coarsest)];
    assert!(tried.iter().all(|&pixels| pixels > 0), "{beyond:?}");
}
