//! Feedback from the target to the CPU: what is drawn, its compaction, the ring.

use vastex_core::shader_constants::{FEEDBACK_DEGENERATE, FEEDBACK_EMPTY, FEEDBACK_WANTED, JITTER_CYCLE};
use vastex_core::{Dims, Feedback, FeedbackCompactor, Geometry, GeometrySpec, LayerFormat, PageId, PagePos};
use vastex_wgpu::test_device::{TestDevice, finish};
use vastex_wgpu::{
    FEEDBACK_DEPTH_FORMAT, FEEDBACK_FORMAT, FeedbackMode, FeedbackScale, FeedbackTarget, FeedbackView,
    Filter, GpuError, RawFeedback, Readback, ReadbackPipelines, Views,
};

use crate::common::{Bindings, GPU, NUMBER, Random, World, storage};
use crate::test_text::TestText;

/// A pipeline that draws one triangle over the whole picture into a feedback target.
fn pipeline(
    gpu: &TestDevice,
    layout: Option<&wgpu::BindGroupLayout>,
    text: &TestText,
) -> wgpu::RenderPipeline {
    let device = &gpu.device;
    let module = text.module(device);
    let layout = layout.map(|layout| {
        device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(layout)],
            immediate_size: 0,
        })
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: layout.as_ref(),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: text.options(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: FEEDBACK_DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: text.options(),
            targets: &[Some(FEEDBACK_FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn readback(gpu: &TestDevice, target: &FeedbackTarget) -> Readback {
    let pipelines = ReadbackPipelines::new(&gpu.device, FeedbackMode::Separate);
    Readback::new(&gpu.device, &pipelines, target.raw()).unwrap()
}

/// Writes given pixels into a target.
const FILL: &str = include_str!("wgsl/fill.wgsl");

/// A target, its ring, and a way to put any pixels into it.
struct Filled {
    size: [u32; 2],
    target: FeedbackTarget,
    readback: Readback,
    views: Views,
    pipeline: wgpu::RenderPipeline,
    /// A frame that has found no room.
    unheard: Option<wgpu::CommandEncoder>,
}

impl Filled {
    fn new(gpu: &TestDevice, size: [u32; 2]) -> Filled {
        let target = FeedbackTarget::new(&gpu.device, size, FeedbackScale::Full).unwrap();
        Filled {
            size,
            readback: readback(gpu, &target),
            views: Views::new(&gpu.device, &gpu.queue, FeedbackMode::Separate),
            pipeline: pipeline(gpu, None, &TestText::new(FILL.to_owned()).told("WIDTH", size[0])),
            target,
            unheard: None,
        }
    }

    /// One frame: the pixels, compaction, the copy. Returns true if there was room in the ring.
    fn frame(&mut self, gpu: &TestDevice, frame: u64, pixels: &[[u32; 4]]) -> bool {
        let recorded = self.recorded(gpu, frame, pixels);
        let room = recorded.is_some();
        // What is left over of other frames goes with this one, whether or not it has found room.
        gpu.queue.submit(recorded.or_else(|| self.unheard.take()).map(wgpu::CommandEncoder::finish));
        room
    }

    /// The same without submitting it; `None` if there was no room.
    fn recorded(
        &mut self,
        gpu: &TestDevice,
        frame: u64,
        pixels: &[[u32; 4]],
    ) -> Option<wgpu::CommandEncoder> {
        assert_eq!(pixels.len() as u32, self.size[0] * self.size[1]);
        let buffer = storage(gpu, bytemuck::cast_slice(pixels));
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = self.target.begin(&gpu.device, &mut encoder, &self.views, 0, frame, 1.0);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        match self.readback.record(&gpu.device, &mut encoder, frame) {
            true => Some(encoder),
            false => {
                self.unheard = Some(encoder);
                None
            }
        }
    }
}

/// Pixels of about `pages` distinct pages, with some empty and some degenerate.
fn pixels(random: &mut Random, count: u32, pages: usize) -> Vec<[u32; 4]> {
    let mut pixel = || {
        let n = random.below(pages) as u32;
        // Pages that differ only in their high half, and only in their low half, are among them.
        let pos = PagePos::new_2d((n % 3) as u8, ((n / 7 % 2048) << 13) | (n / 7 / 2048), (n % 7) << 20);
        let id = PageId::new(NUMBER, Dims::D2, pos).unwrap().to_bits();
        let flag = [FEEDBACK_WANTED, FEEDBACK_WANTED, FEEDBACK_WANTED, FEEDBACK_EMPTY, FEEDBACK_DEGENERATE];
        [id as u32, (id >> 32) as u32, random.below(8) as u32, flag[random.below(5)]]
    };
    (0..count).map(|_| pixel()).collect()
}

fn compacted(frame: u64, pixels: &[[u32; 4]]) -> Feedback {
    let mut feedback = Feedback::default();
    FeedbackCompactor::new().compact(frame, pixels, &mut feedback);
    feedback
}

#[test]
fn compaction_agrees_with_that_on_the_cpu() {
    let (gpu, size) = (&*GPU, [201, 67]);
    let (mut filled, mut random) = (Filled::new(gpu, size), Random(5));
    for (frame, pages) in [1, 3, 40, 500, 10_000, 2, 1 << 20].into_iter().enumerate() {
        let pixels = pixels(&mut random, size[0] * size[1], pages);
        assert!(filled.frame(gpu, frame as u64, &pixels));
        let raw = RawFeedback::read(&gpu.device, &gpu.queue, filled.target.raw()).unwrap();
        assert!(raw.pixels == pixels && raw.size == size);
        let feedback = filled.readback.wait(&gpu.device, &gpu.queue, frame as u64).unwrap();
        assert_eq!(feedback, compacted(frame as u64, &pixels), "{pages} pages");
        assert!(feedback.degenerate > 0);
    }
    let read = filled.readback.bytes_read();
    let again = pixels(&mut random, size[0] * size[1], 30);
    filled.frame(gpu, 50, &again);
    filled.readback.wait(&gpu.device, &gpu.queue, 50).unwrap();
    filled.frame(gpu, 51, &again);
    let before = filled.readback.bytes_read();
    filled.readback.wait(&gpu.device, &gpu.queue, 51).unwrap();
    assert!(before > read);
    assert_eq!(filled.readback.bytes_read() - before, 16 + 12 * 4096, "48 KiB, since there are fewer");
}

#[test]
fn a_ring_never_waits_and_gives_frames_in_order() {
    let (gpu, size) = (&*GPU, [150, 60]);
    let (mut filled, mut random) = (Filled::new(gpu, size), Random(9));
    let mut expected = Vec::new();
    for frame in 0..7 {
        let pixels = pixels(&mut random, size[0] * size[1], 20_000);
        let room = filled.frame(gpu, frame, &pixels);
        assert_eq!(room, frame < 6, "the seventh frame finds the ring full");
        if room {
            expected.push(compacted(frame, &pixels));
        }
    }
    let mut found = Vec::new();
    let blank = pixels(&mut random, size[0] * size[1], 1);
    // So many pages do not fit the first copy; what is left over comes with frames that find no room
    // themselves.
    assert!(expected.iter().all(|feedback| feedback.pages.len() > 4096));
    for frame in 7..2000 {
        vastex_wgpu::poll(&gpu.device).unwrap();
        while let Some(feedback) = filled.readback.poll().unwrap() {
            found.push(feedback);
        }
        if found.len() >= expected.len() {
            break;
        }
        filled.frame(gpu, frame, &blank);
    }
    assert_eq!(found[..6], expected);
    let missing = filled.readback.wait(&gpu.device, &gpu.queue, 3);
    assert_eq!(missing, Err(GpuError::NoFeedback { frame: 3 }));
}

/// An encoder with a frame's feedback in it, of pixels that all want one page.
fn recorded(filled: &mut Filled, gpu: &TestDevice, frame: u64) -> Option<wgpu::CommandEncoder> {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    drop(filled.target.begin(&gpu.device, &mut encoder, &filled.views, 0, frame, 1.0));
    filled.readback.record(&gpu.device, &mut encoder, frame).then_some(encoder)
}

fn in_each_way(test: impl Fn(&mut Filled, &TestDevice)) {
    for mode in [FeedbackMode::Separate, FeedbackMode::Raw] {
        let mut filled = Filled::new(&GPU, [64, 64]);
        let pipelines = ReadbackPipelines::new(&GPU.device, mode);
        filled.readback = Readback::new(&GPU.device, &pipelines, filled.target.raw()).unwrap();
        test(&mut filled, &GPU);
    }
}

fn submit(gpu: &TestDevice, encoder: wgpu::CommandEncoder) {
    gpu.queue.submit([encoder.finish()]);
    finish(&gpu.device);
}

/// The feedback that has come, once there is so much. Another test on the device may have polled what this
/// one submitted, and be about to say that it is done.
fn frames(filled: &mut Filled, least: usize) -> Vec<u64> {
    let begun = std::time::Instant::now();
    let mut frames = Vec::new();
    loop {
        frames.extend(std::iter::from_fn(|| filled.readback.poll().unwrap()).map(|feedback| feedback.frame));
        if frames.len() >= least || begun.elapsed().as_secs() >= 60 {
            return frames;
        }
        std::thread::yield_now();
    }
}

#[test]
fn commands_that_were_never_submitted_are_not_waited_for() {
    in_each_way(|filled, gpu| {
        let encoder = recorded(filled, gpu, 7).unwrap();
        let missing = Err(GpuError::NoFeedback { frame: 7 });
        assert_eq!(filled.readback.wait(&gpu.device, &gpu.queue, 7), missing);
        assert!(filled.readback.is_under_way(7), "it may still be submitted");
        gpu.queue.submit([encoder.finish()]);
        assert_eq!(filled.readback.wait(&gpu.device, &gpu.queue, 7).unwrap().frame, 7);
        drop(recorded(filled, gpu, 8).unwrap());
        assert_eq!(filled.readback.wait(&gpu.device, &gpu.queue, 8), Err(GpuError::NoFeedback { frame: 8 }));
        assert!(!filled.readback.is_under_way(8));
        assert_eq!((filled.readback.take_lost(), filled.readback.oldest()), (vec![8], None));
    });
}

/// Whether the encoder, or the command buffer that it has become, is dropped, the place is free for the next
/// frame.
#[test]
fn commands_that_are_dropped_give_their_place_back() {
    in_each_way(|filled, gpu| {
        for frame in 0..40 {
            let encoder = recorded(filled, gpu, frame).expect("there is room");
            match frame % 2 {
                0 => drop(encoder),
                _ => drop(encoder.finish()),
            }
        }
        assert_eq!(filled.readback.take_lost(), (0..40).collect::<Vec<u64>>());
        submit(gpu, recorded(filled, gpu, 40).unwrap());
        assert_eq!(frames(filled, 1), [40]);
    });
}

/// Commands that are kept hold up nobody. Submitted late, what they bring is older than what is known, and is
/// dropped.
#[test]
fn commands_that_are_kept_are_overtaken() {
    in_each_way(|filled, gpu| {
        let mut kept: Vec<_> = (0..6).map(|frame| recorded(filled, gpu, frame).unwrap()).collect();
        assert!(recorded(filled, gpu, 6).is_none(), "the ring is full of what may be submitted");
        submit(gpu, kept.remove(3));
        assert_eq!(frames(filled, 1), [3]);
        // Those before it were overtaken, those after it were not.
        submit(gpu, kept.pop().unwrap());
        assert_eq!(frames(filled, 1), [5]);
        // However many are kept.
        for frame in 6..20 {
            let encoder = recorded(filled, gpu, frame).expect("there is room");
            if frame % 3 == 0 {
                kept.push(encoder);
                continue;
            }
            submit(gpu, encoder);
            assert_eq!(frames(filled, 1), [frame]);
        }
        kept.drain(..2).for_each(|late| submit(gpu, late));
        submit(gpu, recorded(filled, gpu, 20).unwrap());
        assert_eq!(frames(filled, 1), [20]);
        drop(kept);
        let mut lost = filled.readback.take_lost();
        lost.sort_unstable();
        assert_eq!(lost, [0, 1, 2, 4, 6, 9, 12, 15, 18]);
        assert_eq!(filled.readback.oldest(), None);
    });
}

/// After a cut from few pages to many the first list comes whole, as soon as any other: three frames later.
#[test]
fn after_a_cut_the_first_feedback_comes_as_soon_as_any_other() {
    const LATENCY: usize = 3;
    // A device of its own: whoever polls a shared one may be late with what it was told of this test's
    // buffers.
    let (gpu, size) = (&TestDevice::new(), [201, 67]);
    let (mut filled, mut random) = (Filled::new(gpu, size), Random(5));
    // Commands that the GPU has not come to are as those that are not submitted.
    let (mut behind, mut came) = (std::collections::VecDeque::new(), Vec::new());
    for frame in 0..20 {
        let pages = if frame < 10 { 100 } else { 3000 };
        let pixels = pixels(&mut random, size[0] * size[1], pages);
        behind.push_back(filled.recorded(gpu, frame, &pixels).expect("there is room").finish());
        if behind.len() > LATENCY {
            gpu.queue.submit(behind.pop_front());
            finish(&gpu.device);
        }
        while let Some(feedback) = filled.readback.poll().unwrap() {
            came.push((feedback.frame, frame - feedback.frame, feedback.pages.len()));
        }
    }
    assert_eq!(came.len(), 20 - LATENCY);
    assert!(came.iter().all(|&(_, late, _)| late == LATENCY as u64), "{came:?}");
    assert!(came[10].2 > 2000, "{came:?}");
}

/// The number of the view that the plane is drawn in.
const VIEW: u32 = 5;
/// A plane seen in no perspective: uv changes by the same amount from pixel to pixel.
pub(crate) const PLANE: &str = include_str!("wgsl/plane.wgsl");

fn draw_plane(
    gpu: &TestDevice,
    world: &World,
    picture: [u32; 2],
    scale: FeedbackScale,
    frames: u64,
) -> Vec<RawFeedback> {
    let bindings = Bindings::new(gpu, world.kind(0, Filter::Trilinear), FeedbackMode::Separate, false);
    let pipeline = pipeline(gpu, Some(&bindings.layout), &bindings.text(PLANE, world.id));
    let (group, views) = (bindings.group(gpu, world), &bindings.views);
    let target = FeedbackTarget::new(&gpu.device, picture, scale).unwrap();
    let frame = |frame| {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = target.begin(&gpu.device, &mut encoder, views, VIEW, frame, 1.0);
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        RawFeedback::read(&gpu.device, &gpu.queue, target.raw()).unwrap()
    };
    (0..frames).map(frame).collect()
}

#[test]
fn a_jitter_cycle_sees_what_the_full_picture_wants() {
    let gpu = &*GPU;
    let geometry = Geometry::new(GeometrySpec { page: 16, ..GeometrySpec::image(531, 477) }).unwrap();
    let world = World::new(gpu, &geometry, LayerFormat::R8, 0.2, 4);
    for picture in [[61, 37], [64, 40], [5, 90]] {
        let full = draw_plane(gpu, &world, picture, FeedbackScale::Full, 1).remove(0);
        assert_eq!(full.size, picture);
        assert!(full.pixels.iter().all(|pixel| pixel[3] == FEEDBACK_WANTED));
        let cycle = u64::from(JITTER_CYCLE);
        let reduced = draw_plane(gpu, &world, picture, FeedbackScale::Reduced, cycle);
        let (mut seen, mut differing) = (0, 0);
        for (frame, raw) in reduced.iter().enumerate() {
            let jitter = FeedbackView::new(picture, FeedbackScale::Reduced, frame as u64).jitter();
            for (n, pixel) in (0u32..).zip(&raw.pixels) {
                let [x, y] = [8 * (n % raw.size[0]) + jitter[0], 8 * (n / raw.size[0]) + jitter[1]];
                if x >= picture[0] || y >= picture[1] {
                    assert_eq!(*pixel, [0; 4], "{picture:?}: a pixel beyond the picture wants a page");
                    continue;
                }
                seen += 1;
                differing += u32::from(*pixel != full.pixels[(y * picture[0] + x) as usize]);
            }
        }
        // A quarter of the pixels are looked at; those on an edge between pages may be rounded to either
        // side.
        assert!(seen * 4 + 8 * (picture[0] + picture[1]) >= picture[0] * picture[1], "{seen} pixels seen");
        assert!(differing * 200 <= seen, "{picture:?}: {differing} of {seen} differ");
    }
}
