//! The mean of several pictures of a camera that rests, beside what it must be: nearer to what many more
//! samples give than one picture, begun anew by whatever changes, and nothing where frames go in lock-step.

use vastex::{LayerFormat, TableChoice};
use vastex_viewer::stage::{Canvas, TargetKind};
use vastex_viewer::volume::{
    StillStep, VolumeCamera, VolumeCameraBinding, VolumeDesc, VolumeFace, VolumeMode, VolumeRenderer,
    VolumeStill, VolumeView,
};

use super::volume_reference::picture;
use super::volume_world::{PICTURE, World, geometry, psnr, read};

const SIZE: [u32; 2] = [64, 48];
const PASSES: u32 = 16;

fn world() -> (World, VolumeView) {
    let world = World::new(&geometry([40, 36, 28], 16), LayerFormat::R16, 1, 200, TableChoice::BySize);
    let around = VolumeView::Around(VolumeCamera::around(&world.of, [1.0, 0.7, 0.5], [0.0, 0.0, 1.0]));
    (world, around)
}

/// What samples that are a fifth as far apart would give.
fn psnr_beside_finer(world: &World, desc: &VolumeDesc, view: VolumeView, drawn: &[[u8; 4]]) -> f64 {
    let fine = VolumeDesc { step: 0.2, ..desc.clone() };
    let expected = picture(&fine, &world.arrays(&fine), &view, SIZE);
    psnr(drawn, &expected)
}

/// A mean, and what it is of.
struct Rest {
    renderer: VolumeRenderer,
    camera: VolumeCameraBinding,
    still: VolumeStill,
}

impl Rest {
    fn new(world: &mut World, desc: VolumeDesc) -> Rest {
        let renderer = VolumeRenderer::new(&world.gpu, &mut world.textures, desc, PICTURE).unwrap();
        let (camera, still) = (renderer.new_camera(0), renderer.new_still(SIZE));
        Rest { renderer, camera, still }
    }

    /// A step, of so many rows at most.
    fn go_on(&mut self, world: &World, (view, content): (VolumeView, u64), rows: u32) -> StillStep {
        let mut encoder = world.gpu.device.create_command_encoder(&Default::default());
        let with = (&self.camera, &world.textures);
        let step = self.renderer.go_on(&mut self.still, &mut encoder, with, (&view, content), rows);
        world.gpu.queue.submit([encoder.finish()]);
        step
    }

    /// Goes on until it rests; how many steps that took, and how often there was something to be seen.
    fn rest(&mut self, world: &World, of: (VolumeView, u64), rows: u32) -> (usize, usize) {
        let (mut steps, mut shown) = (0, 0);
        loop {
            match self.go_on(world, of, rows) {
                StillStep::Rests => return (steps, shown),
                step => (steps, shown) = (steps + 1, shown + usize::from(step == StillStep::Shows)),
            }
            assert!(steps < 1000, "it never rests");
        }
    }

    fn picture(&self, world: &World) -> Vec<[u8; 4]> {
        let canvas = Canvas::new(&world.gpu, SIZE, PICTURE, TargetKind::Direct);
        let mut encoder = world.gpu.device.create_command_encoder(&Default::default());
        self.renderer.draw_mean(&self.still, &mut encoder, &canvas.target());
        read(&world.gpu, encoder, &canvas)
    }
}

#[test]
fn the_mean_of_pictures_is_nearer_to_what_is_there_than_one() {
    let (mut world, view) = world();
    for mode in [VolumeMode::Emission, VolumeMode::Average] {
        // Where samples lie as near as voxels, one picture is off by less than a code.
        let desc = VolumeDesc { density: 4.0, step: 3.0, is_exact: true, ..world.desc(mode) };
        let (single, _) = world.drawn(desc.clone(), view, SIZE);
        let desc = VolumeDesc { passes: PASSES, ..desc };
        let mut rest = Rest::new(&mut world, desc.clone());
        assert_eq!(rest.rest(&world, (view, 0), SIZE[1]), (16, 3), "shown after 4, 8 and 16");
        let mean = rest.picture(&world);
        let [of_one, of_all] = [&single, &mean].map(|drawn| psnr_beside_finer(&world, &desc, view, drawn));
        println!("{mode:?}: {of_one:.1} and {of_all:.1} dB");
        assert!(of_all > of_one + 2.0, "{mode:?}: {of_all:.1} dB, and {of_one:.1} of one picture");
        // In parts it is the same.
        let mut parts = Rest::new(&mut world, desc);
        assert_eq!(parts.rest(&world, (view, 0), 20), (48, 3));
        assert!(parts.picture(&world) == mean, "{mode:?} in parts");
    }
}

/// `passes` is for hosts that go on: what a frame draws is the same to the bit.
#[test]
fn in_lock_step_nothing_changes() {
    let (mut world, view) = world();
    for mode in VolumeMode::ALL {
        let desc = world.desc(mode);
        let (plain, _) = world.drawn(desc.clone(), view, SIZE);
        let (same, _) = world.drawn(VolumeDesc { passes: PASSES, ..desc }, view, SIZE);
        assert!(plain == same, "{mode:?}");
    }
}

#[test]
fn whatever_changes_begins_the_mean_anew() {
    let (mut world, view) = world();
    let desc = VolumeDesc { passes: PASSES, ..world.desc(VolumeMode::Emission) };
    world.drawn(desc.clone(), view, SIZE);
    let mut rest = Rest::new(&mut world, desc.clone());
    rest.rest(&world, (view, 0), SIZE[1]);
    let before = rest.picture(&world);
    let step = rest.go_on(&world, (view, 0), SIZE[1]);
    assert_eq!((step, rest.still.passes()), (StillStep::Rests, PASSES), "nothing more is drawn");
    // Other bricks, another place, another look, and back.
    let other = VolumeView::Face(VolumeFace::MinusY);
    rest.go_on(&world, (view, 1), SIZE[1]);
    assert_eq!(rest.still.passes(), 1);
    rest.go_on(&world, (view, 1), SIZE[1]);
    rest.go_on(&world, (other, 1), SIZE[1]);
    assert_eq!(rest.still.passes(), 1);
    rest.go_on(&world, (other, 1), SIZE[1]);
    assert_eq!(rest.still.passes(), 2);
    rest.renderer.set(VolumeDesc { density: 3.0, ..desc.clone() });
    rest.go_on(&world, (other, 1), SIZE[1]);
    assert_eq!(rest.still.passes(), 1);
    rest.renderer.set(desc);
    rest.rest(&world, (view, 0), SIZE[1]);
    assert!(rest.picture(&world) == before, "nothing is left of what was seen between");
}

#[test]
fn a_maximum_a_surface_and_a_slice_are_of_one_picture() {
    let (mut world, view) = world();
    let slice = VolumeView::Slice { axis: 2, voxel: 3 };
    for (mode, seen, is_better) in [
        (VolumeMode::Mip, view, false),
        (VolumeMode::Minip, view, false),
        (VolumeMode::Iso, view, false),
        (VolumeMode::Emission, slice, false),
        (VolumeMode::Emission, view, true),
        (VolumeMode::Average, view, true),
    ] {
        let one = world.desc(mode);
        let desc = VolumeDesc { passes: PASSES, ..one.clone() };
        let mut rest = Rest::new(&mut world, desc);
        assert_eq!(rest.renderer.is_better_still(&seen), is_better, "{mode:?}");
        assert_eq!(rest.go_on(&world, (seen, 0), SIZE[1]) != StillStep::Rests, is_better, "{mode:?}");
        rest.renderer.set(one);
        assert!(!rest.renderer.is_better_still(&seen), "{mode:?}, as it is by default");
    }
}
