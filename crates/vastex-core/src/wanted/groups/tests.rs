//! What entries of groups come to, beside what each pixel would want of each member.

use super::*;
use crate::texture::geometry::page_id;
use crate::texture::geometry::{AddressMode, GeometrySpec};
use crate::texture::page::PagePos;
use crate::wanted::feedback::WantedPage;
use proptest::prelude::*;

fn id(number: u16) -> TextureNumber {
    TextureNumber::new(number).unwrap()
}

fn image(size: [u32; 2], page: u32, address: AddressMode) -> Geometry {
    let spec =
        GeometrySpec { page, border: 2, address: [address; 3], ..GeometrySpec::image(size[0], size[1]) };
    Geometry::new(spec).unwrap()
}

/// A pixel of a picture: where it lies, and its gradients, in uv.
#[derive(Clone, Copy, Debug)]
struct Pixel {
    uv: [f64; 2],
    ddx: [f64; 2],
    ddy: [f64; 2],
}

impl Pixel {
    fn lambda(&self, shape: &Geometry) -> f64 {
        let length =
            |g: [f64; 2]| (g[0] * f64::from(shape.size()[0])).hypot(g[1] * f64::from(shape.size()[1]));
        length(self.ddx).max(length(self.ddy)).log2()
    }

    /// The level in eighths that the pixel wants of a texture by itself.
    fn steps(&self, shape: &Geometry, rule: LevelRule) -> u32 {
        let level = self.lambda(shape) + f64::from(rule.bias);
        (level.max(f64::from(rule.finest)).min(f64::from(rule.coarsest)) * 8.0) as u32
    }

    /// The page of a level that the pixel falls on, as if there were no tail.
    fn page(&self, shape: &Geometry, level: u8) -> PagePos {
        let at = shape.level(level);
        let coord = |axis: usize| {
            let uv = self.uv[axis];
            let folded = match shape.address()[axis] {
                AddressMode::Wrap => uv - uv.floor(),
                AddressMode::Mirror => 1.0 - (uv.rem_euclid(2.0) - 1.0).abs(),
                AddressMode::Clamp | AddressMode::Border => uv.clamp(0.0, 1.0),
            };
            let size = shape.size()[axis];
            let texel = ((folded * f64::from(size)) as u32).min(size - 1);
            (texel / at.scale[axis] as u32 / shape.page()[axis]).min(at.pages[axis] - 1)
        };
        PagePos::new_2d(level, coord(0), coord(1))
    }

    /// The entry that it writes for a group of this shape.
    fn entry(&self, shape: &Geometry, pixels: u32) -> WantedPage {
        let steps = self.steps(shape, LevelRule::default().within(shape));
        let page = page_id(id(9), shape, self.page(shape, (steps / 8) as u8)).unwrap();
        WantedPage { page, pixels, eighth: (steps % 8) as u8 }
    }
}

/// Returns true if two pages, each of its texture and of any level, have a point of uv in common; by
/// comparing fractions.
fn overlap(a: (&Geometry, PagePos), b: (&Geometry, PagePos)) -> bool {
    let side = |(shape, pos): (&Geometry, PagePos), axis: usize| {
        let texels = shape.level(pos.level).scale[axis] * u64::from(shape.page()[axis]);
        let (size, first) = (u64::from(shape.size()[axis]), u64::from(pos.coords()[axis]) * texels);
        (first, (first + texels).min(size), size)
    };
    (0..2).all(|axis| {
        let ((a0, a1, a), (b0, b1, b)) = (side(a, axis), side(b, axis));
        a0 * b < b1 * a && b0 * a < a1 * b
    })
}

fn shapes() -> impl Strategy<Value = (Geometry, Geometry)> {
    let sides = || (1u32..600, 1u32..600, 8u32..90);
    let scaled =
        |(w, h, page): (u32, u32, u32), by: Option<u32>, (ow, oh, own): (u32, u32, u32), mode: usize| {
            use AddressMode::{Border, Clamp, Mirror, Wrap};
            let mode = [Clamp, Wrap, Mirror, Border][mode];
            // Half of the members have the aspect of the shape.
            let member = by.map_or([ow, oh], |by| [w, h].map(|side| side.div_ceil(by)));
            (image([w, h], page, mode), image(member, own, mode))
        };
    (sides(), prop::option::of(1u32..9), sides(), 0usize..4)
        .prop_map(move |(a, by, b, mode)| scaled(a, by, b, mode))
}

fn pixels() -> impl Strategy<Value = Pixel> {
    let gradient = || {
        (-14.0f64..1.0, 0.0f64..6.3)
            .prop_map(|(size, turn)| [turn.cos(), turn.sin()].map(|c| c * size.exp2()))
    };
    (prop::array::uniform2(-1.5f64..2.5), gradient(), gradient()).prop_map(|(uv, ddx, ddy)| Pixel {
        uv,
        ddx,
        ddy,
    })
}

fn rules() -> impl Strategy<Value = LevelRule> {
    let some = (-3.0f32..3.0, 0u8..4, 0u8..12);
    let some = some.prop_map(|(bias, finest, coarsest)| LevelRule { bias, finest, coarsest });
    prop_oneof![Just(LevelRule::default()), some]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn an_entry_wants_what_its_pixels_would_want_of_a_member(
        (shape, own) in shapes(), pixel in pixels(), rule in rules(),
    ) {
        let rule = rule.within(&own);
        let entry = pixel.entry(&shape, 1 << 20);
        let mut found = Vec::new();
        Overlap::new(&shape, id(3), &own, rule).want(&entry, &mut found);
        let steps = pixel.steps(&own, rule);
        let wanted = pixel.page(&own, (steps / 8) as u8);
        if own.is_tail(wanted) {
            prop_assert!(!found.is_empty());
            return Ok(());
        }
        // The page itself, as sharply at least, or one below it, which brings it along.
        let serves = |found: &WantedPage| {
            let pos = found.page.pos(own.dims());
            let need = u32::from(pos.level) * 8 + u32::from(found.eighth);
            pos.level <= wanted.level && need <= steps && own.ancestor(pos, wanted.level) == wanted
        };
        prop_assert!(found.iter().any(serves), "{wanted} at {steps} of {found:?}");
    }

    #[test]
    fn it_wants_all_pages_that_overlap_and_no_others(
        (shape, own) in shapes(), pixel in pixels(), rule in rules(), pixels in 1u32..5000,
    ) {
        let rule = rule.within(&own);
        let entry = pixel.entry(&shape, pixels);
        let entry_pos = entry.page.pos(shape.dims());
        let mut found = Vec::new();
        Overlap::new(&shape, id(3), &own, rule).want(&entry, &mut found);
        let positions: Vec<PagePos> = found.iter().map(|wanted| wanted.page.pos(own.dims())).collect();
        let level = positions[0].level;
        if level == own.tail().first_level() {
            prop_assert_eq!(positions, [own.tail_pos()]);
            return Ok(());
        }
        let overlaps = |pos: &PagePos| overlap((&shape, entry_pos), (&own, *pos));
        let expected: Vec<PagePos> = own.pages_of_level(level).filter(overlaps).collect();
        prop_assert_eq!(&positions, &expected);
        // Every page counts for some pixels, and all of them for no more than rounding up adds.
        let counted: u32 = found.iter().map(|wanted| wanted.pixels).sum();
        prop_assert!(counted >= pixels && counted < pixels + found.len() as u32);
        prop_assert!(found.iter().all(|wanted| wanted.pixels > 0 && wanted.eighth == found[0].eighth));
        prop_assert!(found.len() as u64 <= 64 * u64::from(pixels));
    }

    #[test]
    fn of_the_same_aspect_the_level_is_right_to_an_eighth(
        (shape, by) in ((20u32..600, 20u32..600, 8u32..90), 1u32..9), pixel in pixels(), bias in -1.0f32..1.0,
    ) {
        let (w, h, page) = shape;
        let own = image([w, h], page, AddressMode::Clamp);
        let shape = image([w * by, h * by], page, AddressMode::Clamp);
        let rule = LevelRule { bias, ..LevelRule::default() }.within(&own);
        // Where the shape is magnified its entry does not say how much.
        prop_assume!(pixel.lambda(&shape) > 0.2 && pixel.lambda(&shape) < f64::from(shape.coarsest()));
        let mut found = Vec::new();
        Overlap::new(&shape, id(3), &own, rule).want(&pixel.entry(&shape, 1 << 20), &mut found);
        let need = u32::from(found[0].page.level()) * 8 + u32::from(found[0].eighth);
        let (steps, tail) = (pixel.steps(&own, rule), u32::from(own.tail().first_level()));
        prop_assert!(need >= tail * 8 || (need..=need + 1).contains(&steps), "{need} is not {steps}");
    }
}
