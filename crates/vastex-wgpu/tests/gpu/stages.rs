//! The same in every stage: a vertex shader samples what a compute shader does, and what takes its gradients itself, in a fragment
//! shader, what is given them.

use vastex_core::{AddressMode, Geometry, GeometrySpec, LayerFormat};
use vastex_wgpu::{Atlas, BindLayout, FeedbackWay, Filter, PageSides, ShaderOptions, ViewBuffer, wgsl};

use crate::common::{GPU, World, storage};
use crate::drawing::{Drawing, SIDE, drawn};
use crate::sampling::{Harness, inputs, tolerance};

/// A point for each input, whose vertex samples.
pub(crate) const POINTS: &str = "
    struct Input { uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>, level: f32, at_level: u32 }
    struct Point {
        @builtin(position) clip: vec4<f32>,
        @location(0) @interpolate(flat) color: vec4<f32>,
        @location(1) @interpolate(flat) feedback: vec4<u32>,
    }
    struct Shown { @location(0) color: vec4<f32>, @location(1) feedback: vec4<u32> }
    @group(1) @binding(0) var<storage, read> inputs: array<Input>;
    @vertex fn sampled(@builtin(vertex_index) n: u32) -> Point {
        let in = inputs[n];
        let pixel = vec2<f32>(f32(n % SIDE), f32(n / SIDE)) + 0.5;
        let at = vec2<f32>(2.0, -2.0) * pixel / f32(SIDE) + vec2<f32>(-1.0, 1.0);
        let clip = vec4<f32>(at, 0.5, 1.0);
        if in.at_level == 1u {
            return Point(clip, vastex_sample_level(in.uv, in.level), vastex_feedback_level(in.uv, in.level));
        }
        return Point(
            clip, vastex_sample_grad(in.uv, in.ddx, in.ddy), vastex_feedback_grad(in.uv, in.ddx, in.ddy));
    }
    @fragment fn shown(point: Point) -> Shown {
        return Shown(point.color, point.feedback);
    }";

/// A plane in perspective, along which a function that takes its gradients itself is called beside the one that is given them. What
/// differs is shown: of colours how much, of feedback and of inspections whether.
pub(crate) const GROUND: &str = "
    struct Spot { @builtin(position) clip: vec4<f32>, @location(0) uv: vec2<f32> }
    struct Shown { @location(0) color: vec4<f32>, @location(1) feedback: vec4<u32> }
    @vertex fn corner(@builtin(vertex_index) n: u32) -> Spot {
        let at = vec2<f32>(f32(n & 1u), f32(n >> 1u)) * 2.0 - 1.0;
        let w = 1.6 + at.y;
        return Spot(vec4<f32>(at.x * w, at.y * w, 0.5 * w, w), vec2<f32>(at.x + 0.3 * at.y, w) * 0.45);
    }
    @fragment fn beside(spot: Spot) -> Shown {
        let uv = spot.uv;
        let ddx = dpdx(uv);
        let ddy = dpdy(uv);
        let size = vec2<f32>(vastex_texture.size.xy);
        let anchor = vec2<u32>(40u, 30u);
        let offset = uv * size - vec2<f32>(anchor);
        let by_uv = abs(vastex_sample(uv) - vastex_sample_grad(uv, ddx, ddy));
        let by_offset = abs(vastex_sample_fixed(anchor, offset)
            - vastex_sample_fixed_grad(anchor, offset, dpdx(offset), dpdy(offset)));
        let wanted = vastex_feedback(uv) != vastex_feedback_grad(uv, ddx, ddy);
        let fixed = vastex_feedback_fixed(anchor, offset)
            != vastex_feedback_fixed_grad(anchor, offset, dpdx(offset), dpdy(offset));
        let seen = vastex_inspect(uv).shown != vastex_inspect_grad(uv, ddx, ddy).shown;
        let along = vastex_gradients(spot.clip, uv);
        // From pixel to pixel they are those in the middle between two, not those at this one.
        let exact = max(length(along[0] - ddx) / length(ddx), length(along[1] - ddy) / length(ddy));
        return Shown(max(by_uv, by_offset), vec4<u32>(vec4<bool>(any(wanted), any(fixed), seen, exact > 0.1)));
    }";

fn world(page: u32, filter: Filter) -> (World, BindLayout, String) {
    let address = [AddressMode::Wrap, AddressMode::Mirror, AddressMode::Clamp];
    let spec = GeometrySpec { page, address, ..GeometrySpec::image(700, 450) };
    let world = World::new(&GPU, &Geometry::new(spec).unwrap(), LayerFormat::Rgba8, 0.6, 12);
    let layout = BindLayout::new(&GPU.device, Atlas::Float, FeedbackWay::Separate);
    (world, layout, wgsl(&ShaderOptions { filter, ..ShaderOptions::default() }))
}

#[test]
fn every_filter_samples_in_the_vertex_stage_as_in_compute() {
    let view = ViewBuffer::new(&GPU.device, &GPU.queue, FeedbackWay::Separate);
    for filter in Filter::KINDS {
        let (world, layout, text) = world(64, filter);
        let inputs = inputs(&world.geometry, 31);
        let expected = Harness::of(&GPU, filter, Atlas::Float, PageSides::Any, false).run(&world, 0, &inputs);
        let (colors, wanted) = drawn(
            &GPU,
            &Drawing {
                text: format!("{POINTS}\nconst SIDE: u32 = {SIDE}u;\n{text}"),
                entries: ["sampled", "shown"],
                topology: wgpu::PrimitiveTopology::PointList,
                vertices: inputs.len() as u32,
                layout: &layout,
                group: &layout.bind_group(&GPU.device, &world.table, &world.pool, 0, &view),
                inputs: Some(&storage(&GPU, bytemuck::cast_slice(&inputs))),
            },
        );
        assert!(inputs.len() > 2000 && inputs.len() <= colors.len());
        let tolerance = tolerance(LayerFormat::Rgba8, filter);
        let unlike = expected.iter().zip(colors.iter().zip(&wanted)).filter(|(expected, (color, wanted))| {
            let is_near = expected.color.iter().zip(*color).all(|(a, b)| (a - b).abs() <= tolerance);
            !is_near || expected.feedback != **wanted
        });
        // Where the stages are compiled differently, what lies on an edge may fall to either side.
        assert!(unlike.count() * 200 <= inputs.len(), "{filter}");
    }
}

#[test]
fn what_takes_its_gradients_itself_gives_what_is_given_them() {
    let view = ViewBuffer::new(&GPU.device, &GPU.queue, FeedbackWay::Separate);
    for filter in Filter::KINDS {
        let (world, layout, text) = world(40, filter);
        let (colors, wanted) = drawn(
            &GPU,
            &Drawing {
                text: GROUND.to_owned() + &text,
                entries: ["corner", "beside"],
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                vertices: 4,
                layout: &layout,
                group: &layout.bind_group(&GPU.device, &world.table, &world.pool, 0, &view),
                inputs: None,
            },
        );
        let tolerance = tolerance(LayerFormat::Rgba8, filter);
        let unlike = colors.iter().zip(&wanted).filter(|(color, wanted)| {
            color.iter().any(|difference| *difference > tolerance) || **wanted != [0; 4]
        });
        let unlike = unlike.count();
        assert!(unlike * 100 <= (SIDE * SIDE) as usize, "{filter}: {unlike}");
    }
}
