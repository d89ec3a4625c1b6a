//! The same in every stage: a vertex shader samples what a compute shader does, and what takes its gradients
//! itself, in a fragment shader, what is given them.

use vastex_core::{AddressMode, Geometry, GeometrySpec, LayerFormat};
use vastex_wgpu::{FeedbackMode, Filter};

use crate::common::{Bindings, GPU, World, storage};
use crate::drawing::{Drawing, SIDE, drawn};
use crate::sampling::{Harness, inputs, tolerance};

/// A point for each input, whose vertex samples.
pub(crate) const POINTS: &str = include_str!("wgsl/points.wgsl");

/// A plane in perspective, along which a function that takes its gradients itself is called beside the one
/// that is given them. What differs is shown: of colours how much, of feedback and of inspections whether.
pub(crate) const GROUND: &str = include_str!("wgsl/ground.wgsl");

fn world(page: u32, filter: Filter) -> (World, Bindings) {
    let address = [AddressMode::Wrap, AddressMode::Mirror, AddressMode::Clamp];
    let spec = GeometrySpec { page, address, ..GeometrySpec::image(700, 450) };
    let world = World::new(&GPU, &Geometry::new(spec).unwrap(), LayerFormat::Rgba8, 0.6, 12);
    let bindings = Bindings::new(&GPU, world.kind(0, filter), FeedbackMode::Separate, false);
    (world, bindings)
}

#[test]
fn every_filter_samples_in_the_vertex_stage_as_in_compute() {
    for filter in Filter::KINDS {
        let (world, bindings) = world(64, filter);
        let inputs = inputs(&world.geometry, 31);
        let expected = Harness::new(&GPU, filter, &world, 0).run(&world, &inputs);
        let (colors, wanted) = drawn(
            &GPU,
            &Drawing {
                text: bindings.text(&format!("{POINTS}\nconst SIDE: u32 = {SIDE}u;"), world.id),
                entries: ["sampled", "shown"],
                topology: wgpu::PrimitiveTopology::PointList,
                vertices: inputs.len() as u32,
                layout: &bindings.layout,
                group: &bindings.group(&GPU, &world),
                inputs: Some(&storage(&GPU, bytemuck::cast_slice(&inputs))),
            },
        );
        assert!(inputs.len() > 2000 && inputs.len() <= colors.len());
        let tolerance = tolerance(&GPU, LayerFormat::Rgba8, filter) / 255.0;
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
    for filter in Filter::KINDS {
        let (world, bindings) = world(40, filter);
        let (colors, wanted) = drawn(
            &GPU,
            &Drawing {
                text: bindings.text(GROUND, world.id),
                entries: ["corner", "beside"],
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                vertices: 4,
                layout: &bindings.layout,
                group: &bindings.group(&GPU, &world),
                inputs: None,
            },
        );
        let tolerance = tolerance(&GPU, LayerFormat::Rgba8, filter) / 255.0;
        let unlike = colors.iter().zip(&wanted).filter(|(color, wanted)| {
            color.iter().any(|difference| *difference > tolerance) || **wanted != [0; 4]
        });
        let unlike = unlike.count();
        assert!(unlike * 100 <= (SIDE * SIDE) as usize, "{filter}: {unlike}");
    }
}
