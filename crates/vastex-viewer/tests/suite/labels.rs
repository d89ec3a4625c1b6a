//! Pictures of labels over volumes, and alone, beside what they must be: slices, outlines, a selected one,
//! surfaces from faces and in perspective, coarser levels, in both formats.

use std::sync::Arc;

use glam::DVec3;
use vastex::source::{Codec, ReadError, ReadFuture, Tile};
use vastex::{
    Description, Geometry, Layer, LayerFormat, LayerId, PagePos, Region, StoredLevel, TableChoice,
    TextureSettings, TileSource, VoxelLevels,
};
use vastex_viewer::volume::{
    LabelColors, LabelTurns, OtherLabels, RayBounds, RayVoxels, VolumeBox, VolumeCamera, VolumeClip,
    VolumeDesc, VolumeFace, VolumeLabels, VolumeMode, VolumeView,
};

use super::label_reference::{LabelLevel, over};
use super::volume_reference::picture;
use super::volume_world::{PATIENCE, World, geometry};

const SIZE: [u32; 3] = [40, 36, 28];
/// The same lower half; the first has nothing but it.
const LOW: u64 = 5;
const BALL: u64 = 1 << 32 | 5;
const OTHER_BALL: u64 = 2 << 32 | 5;
const SHEET: u64 = u64::MAX;

/// A volume of labels in main memory, all levels.
struct LabelVolume {
    description: Arc<Description>,
    levels: Vec<LabelLevel>,
}

impl LabelVolume {
    fn new(geometry: Geometry, format: LayerFormat) -> LabelVolume {
        let of_level = |level: &vastex::Level| {
            let scale = level.scale.map(|scale| scale as f64);
            let [nx, ny, nz] = level.size;
            let mut labels = Vec::new();
            for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
                labels.extend((0..nx).map(|x| {
                    let middle = [x, y, z].map(|n| f64::from(n) + 0.5);
                    let label = label_at(std::array::from_fn(|a| middle[a] * scale[a]));
                    if format == LayerFormat::R32Uint { narrow(label) } else { label }
                }));
            }
            LabelLevel { size: level.size, scale, labels }
        };
        let levels = geometry.levels().iter().map(of_level).collect();
        let layer = Layer { is_mixable: false, ..Layer::new("labels", format) };
        LabelVolume { description: Arc::new(Description::new(geometry, vec![layer])), levels }
    }

    fn tile(&self, pos: PagePos) -> Option<Tile> {
        let geometry = &self.description.geometry;
        if !geometry.contains(pos) {
            return None;
        }
        let bytes = self.description.layers[0].format.texel_bytes();
        let [width, height, _] = geometry.tile().map(|n| n as usize);
        let mut tile = vec![0; self.description.tile_bytes()];
        for (level, level_box, offset) in geometry.tile_boxes(pos) {
            let [nx, ny, nz] = level_box.size;
            for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
                for x in 0..nx {
                    let at = std::array::from_fn(|a| level_box.origin[a] + i64::from([x, y, z][a]));
                    let label = self.levels[usize::from(level)].voxel(at);
                    let [tx, ty, tz] = [offset[0] + x, offset[1] + y, offset[2] + z].map(|n| n as usize);
                    let to = ((tz * height + ty) * width + tx) * bytes;
                    tile[to..to + bytes].copy_from_slice(&label.to_le_bytes()[..bytes]);
                }
            }
        }
        Some(Tile { codec: Codec::Raw, bytes: tile.into() })
    }
}

impl TileSource for LabelVolume {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move { self.tile(pos).ok_or(ReadError::NoSuchTile { pos }) })
    }
}

/// Two balls that touch, a column, and a sheet one voxel thick.
fn label_at([x, y, z]: [f64; 3]) -> u64 {
    let is_in = |[cx, cy, cz]: [f64; 3], radius: f64| {
        (x - cx).powi(2) + (y - cy).powi(2) + (z - cz).powi(2) < radius * radius
    };
    if is_in([13.0, 14.0, 10.0], 8.0) {
        BALL
    } else if is_in([26.0, 19.0, 15.0], 9.0) {
        OTHER_BALL
    } else if (4.0..10.0).contains(&x) && (25.0..33.0).contains(&y) && (3.0..25.0).contains(&z) {
        LOW
    } else if (20.0..38.0).contains(&x) && (3.0..14.0).contains(&y) && (22.0..23.0).contains(&z) {
        SHEET
    } else {
        0
    }
}

/// A label of 32 bits in the place of one of 64.
fn narrow(label: u64) -> u64 {
    [0, LOW, BALL, OTHER_BALL, SHEET].iter().position(|known| *known == label).unwrap() as u64
}

/// An image, and labels over it.
struct Labelled {
    world: World,
    volume: Arc<LabelVolume>,
    layer: LayerId,
}

impl Labelled {
    fn new(format: LayerFormat, table: TableChoice) -> Labelled {
        let mut world = World::new(&geometry(SIZE, 16), LayerFormat::R32Float, 1, 200, table);
        let volume = Arc::new(LabelVolume::new(geometry(SIZE, 16), format));
        let own = TextureSettings { page_table: table, ..TextureSettings::default() };
        let prepared = world.textures.preparer().read_blocking(volume.clone(), own).unwrap();
        let layer = world.textures.add(prepared).unwrap().into();
        Labelled { world, volume, layer }
    }

    fn labels(&self) -> VolumeLabels {
        VolumeLabels { opacity: 0.6, ..VolumeLabels::new(self.layer, self.world.of) }
    }

    fn desc(&self, mode: VolumeMode, labels: VolumeLabels) -> VolumeDesc {
        VolumeDesc { is_exact: true, labels: Some(labels), ..self.world.desc(mode) }
    }

    /// The share of pixels within so many codes of the reference.
    fn within(&mut self, desc: &VolumeDesc, view: VolumeView, size: [u32; 2], most: f64) -> f64 {
        let labels = desc.labels.as_ref().unwrap();
        let (drawn, _) = self.world.drawn(desc.clone(), view, size);
        let under = match desc.channels.is_empty() {
            true => vec![[0.0; 3]; drawn.len()],
            false => picture(desc, &self.world.arrays(desc), &view, size),
        };
        let expected = over(&under, labels, &self.volume.levels, (&desc.of, &view, size));
        let change = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).any(|c| (a[c] - b[c]).abs() > 8.0);
        let changed = under.iter().zip(&expected).filter(|pair| change(*pair)).count();
        assert!(changed > drawn.len() / 50, "labels are to be seen: {changed}");
        let is_near = |(drawn, expected): &(&[u8; 4], &[f64; 3])| {
            (0..3).all(|c| (f64::from(drawn[c]) - expected[c]).abs() <= most)
        };
        drawn.iter().zip(&expected).filter(is_near).count() as f64 / drawn.len() as f64
    }
}

#[test]
fn slices_have_the_labels_of_their_voxels() {
    for (format, table) in [
        (LayerFormat::Rg32Uint, TableChoice::Direct),
        (LayerFormat::Rg32Uint, TableChoice::Hashed),
        (LayerFormat::R32Uint, TableChoice::Direct),
    ] {
        let mut labelled = Labelled::new(format, table);
        let colors = Arc::new(LabelColors::new([(OTHER_BALL, [10, 200, 30, 128]), (LOW, [1, 2, 3, 0])]));
        let usual = labelled.labels();
        let views = [
            (VolumeLabels { colors, ..usual.clone() }, 2, 13, [40, 36]),
            (VolumeLabels { outlines: true, ..usual.clone() }, 2, 12, [40, 36]),
            (VolumeLabels { outlines: true, ..usual.clone() }, 1, 16, [40, 28]),
            (usual, 0, 20, [36, 28]),
        ];
        for (labels, axis, voxel, size) in views {
            let desc = labelled.desc(VolumeMode::Mip, labels);
            let within = labelled.within(&desc, VolumeView::Slice { axis, voxel }, size, 2.0);
            assert_eq!(within, 1.0, "{format:?}, {table:?}, across {axis}");
        }
    }
}

#[test]
fn surfaces_of_labels_are_seen_from_every_side() {
    let mut labelled = Labelled::new(LayerFormat::Rg32Uint, TableChoice::Direct);
    for face in VolumeFace::ALL {
        let [right, down, _] = face.axes();
        let voxels = glam::UVec3::from_array(SIZE).as_dvec3();
        let size = [right, down].map(|axis| axis.dot(voxels).abs() as u32);
        let desc = labelled.desc(VolumeMode::Average, labelled.labels());
        let within = labelled.within(&desc, VolumeView::Face(face), size, 2.0);
        assert_eq!(within, 1.0, "{face}");
    }
    // Where some are hidden by their colours, others between these and above them are seen, and what lies
    // behind; the list of all colours has a second row.
    let unused = (0..1100).map(|nth| 6 + nth * 2).chain([4, 2 << 32 | 4, 2 << 32 | 6]);
    let hidden = [LOW, BALL].into_iter().chain(unused).map(|label| (label, [9, 9, 9, 0]));
    let labels = VolumeLabels { colors: Arc::new(LabelColors::new(hidden)), ..labelled.labels() };
    for face in [VolumeFace::PlusZ, VolumeFace::MinusX] {
        let size = if face == VolumeFace::PlusZ { [40, 36] } else { [36, 28] };
        let desc = labelled.desc(VolumeMode::Average, labels.clone());
        assert_eq!(labelled.within(&desc, VolumeView::Face(face), size, 2.0), 1.0, "{face}, some hidden");
    }
    let camera = VolumeCamera::around(&labelled.world.of, [1.0, 0.7, 0.5], [0.0, 0.0, 1.0]);
    let desc = labelled.desc(VolumeMode::Mip, labelled.labels());
    let within = labelled.within(&desc, VolumeView::Around(camera), [96, 72], 2.0);
    assert!(within >= 0.99, "in perspective: {within}");
}

#[test]
fn a_selected_label_is_seen_through_the_others() {
    let mut labelled = Labelled::new(LayerFormat::Rg32Uint, TableChoice::Direct);
    let (face, slice) = (VolumeView::Face(VolumeFace::MinusX), VolumeView::Slice { axis: 2, voxel: 12 });
    for others in OtherLabels::ALL {
        // What differs in the upper half alone is another label.
        let labels = VolumeLabels { selected: Some(BALL), others, ..labelled.labels() };
        let desc = labelled.desc(VolumeMode::Mip, labels);
        for (view, size) in [(face, [36, 28]), (slice, [40, 36])] {
            assert_eq!(labelled.within(&desc, view, size, 2.0), 1.0, "{others:?}, {view:?}");
        }
    }
}

#[test]
fn labels_are_drawn_without_an_image_from_the_level_that_a_pixel_wants() {
    let mut labelled = Labelled::new(LayerFormat::R32Uint, TableChoice::Direct);
    labelled.world.of.voxel = DVec3::ONE;
    let alone = |labels: VolumeLabels| VolumeDesc {
        labels: Some(VolumeLabels { opacity: 1.0, ..labels }),
        ..VolumeDesc::new(VolumeBox::new(SIZE, [1.0; 3]), Vec::new())
    };
    let desc = alone(labelled.labels());
    for size in [[40, 36], [20, 18], [80, 72]] {
        let view = VolumeView::Face(VolumeFace::PlusZ);
        assert_eq!(labelled.within(&desc, view, size, 2.0), 1.0, "{size:?}");
        let view = VolumeView::Slice { axis: 2, voxel: 9 };
        assert_eq!(labelled.within(&desc, view, size, 2.0), 1.0, "a slice, {size:?}");
    }
}

/// A label in the last two voxels of a long volume, and before it two others by turns: coarser levels have
/// none.
struct FarLabel {
    description: Arc<Description>,
}

const FAR: u64 = 7;
const BEFORE: [u64; 2] = [5, 6];

impl TileSource for FarLabel {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let geometry = &self.description.geometry;
        let ([width, height, _], depth) = (geometry.tile(), i64::from(geometry.size()[2]));
        let mut bytes = vec![0; self.description.tile_bytes()];
        for (_, level_box, offset) in geometry.tile_boxes(pos).filter(|(level, ..)| *level == 0) {
            for z in 0..level_box.size[2] {
                let at = level_box.origin[2] + i64::from(z);
                let label = if at >= depth - 2 { FAR } else { BEFORE[at.rem_euclid(2) as usize] };
                let plane = (width * height * 4) as usize;
                let begin = (offset[2] + z) as usize * plane;
                bytes[begin..begin + plane].iter_mut().step_by(4).for_each(|byte| *byte = label as u8);
            }
        }
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes: bytes.into() }) })
    }
}

/// A software driver ends a pixel after 65,535 turns of loops: a voxel of labels takes one, also where each
/// has another label than the one before and none is shown; as many more as halvings of the list of those
/// that are hidden by their colours, where that hides them.
#[test]
fn a_label_at_the_end_of_as_long_a_ray_as_is_taken_is_seen() {
    let size = [2, 2, 30_000];
    let (of, small) = (VolumeBox::new(size, [1.0; 3]), geometry([16; 3], 16));
    let mut world = World::new(&small, LayerFormat::R32Float, 1, 8000, TableChoice::Direct);
    let layer = Layer { is_mixable: false, ..Layer::new("labels", LayerFormat::R32Uint) };
    let description = Arc::new(Description::new(geometry(size, 16), vec![layer]));
    let source = Arc::new(FarLabel { description });
    let prepared = world.textures.preparer().read_blocking(source, TextureSettings::default()).unwrap();
    let id = world.textures.add(prepared).unwrap();
    // Every voxel of level 0 is there to be passed.
    let ticket = world.textures.ahead().pin(id, &Region::whole()).unwrap();
    let is_there = || ticket.progress().resident == ticket.progress().pages;
    (0..PATIENCE).take_while(|_| !is_there()).for_each(|_| world.textures.update().unwrap());
    assert!(is_there(), "{:?}", ticket.progress());
    let stored = StoredLevel { size: size.map(u64::from), scale: [1.0; 3], origin: [0.0; 3] };
    let levels = Arc::new(VoxelLevels::new(&[stored], 16, 1).unwrap().1);
    let colors = Arc::new(LabelColors::new(BEFORE.map(|label| (label, [9, 9, 9, 0]))));
    let plain = VolumeLabels { opacity: 1.0, colors, ..VolumeLabels::new(id, of) };
    // By the one that is selected, the others hidden, and by their colours.
    let selected = VolumeLabels { selected: Some(FAR), others: OtherLabels::Hidden, ..plain.clone() };
    let desc = |labels| VolumeDesc { labels: Some(labels), ..VolumeDesc::new(of, Vec::new()) };
    let mut renderer = world.renderer(desc(plain.clone()));
    let view = VolumeView::Face(VolumeFace::PlusZ);
    for (labels, per_voxel, depth) in [(selected, 1, size[2]), (plain, 3, 18_000)] {
        let turns = labels.turns();
        assert_eq!(turns, LabelTurns { per_voxel, looks: 1 });
        let begin = DVec3::new(0.0, 0.0, f64::from(size[2] - depth));
        let clip = VolumeClip { corners: [begin, of.extent()], plane: None };
        let voxels = RayVoxels::new(of, DVec3::ZERO, (levels.clone(), 16), &clip);
        let (mode, image, own) = (VolumeMode::Mip, voxels.clone(), Some((voxels, turns)));
        let bounds = RayBounds { mode, channels: 0, step: 1.0, is_processor: true, image, labels: own };
        assert_eq!(bounds.cut(&view, [2, 2]), None, "{turns:?}");
        renderer.set(VolumeDesc { clip, ..desc(labels) });
        let drawn = world.shot(&renderer, view, [2, 2]);
        assert!(drawn.iter().all(|pixel| pixel[2] > 100), "{turns:?}: {drawn:?}");
    }
}

/// Voxels twice as large, in a box that begins elsewhere in the world of the image.
#[test]
fn labels_of_another_grid_lie_where_the_file_says() {
    let mut labelled = Labelled::new(LayerFormat::Rg32Uint, TableChoice::Direct);
    labelled.world.of.voxel = DVec3::ONE;
    let labels = VolumeLabels {
        of: VolumeBox::new(SIZE, [0.5, 0.8, 0.5]),
        begin: [10.0, -3.1, 4.0],
        ..labelled.labels()
    };
    let desc = labelled.desc(VolumeMode::Mip, labels);
    // Pixels that no plane between voxels runs through.
    let within = labelled.within(&desc, VolumeView::Face(VolumeFace::PlusZ), [80, 72], 2.0);
    assert!(within >= 0.99, "{within}");
    let within = labelled.within(&desc, VolumeView::Slice { axis: 2, voxel: 9 }, [80, 72], 2.0);
    assert!(within >= 0.99, "on a slice: {within}");
}
