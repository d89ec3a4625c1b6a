//! Frames that are recorded ahead of those that are submitted, while page tables grow, pages leave, pools are resized and textures come and
//! go: every picture shows what is where it looks, and at last all of it.

use vastex::{AddressMode, Dims, FeedbackWay, PoolId};
use vastex_tiles::PropertySource;

use crate::common::{Mapping, PICTURE, property};
use crate::dropped::{SIZE, TILE, pose, screen};

const POOL: PoolId = PoolId::new(0);

/// Down from an overview to level 0, and on over the texture, fast enough for pages to leave.
fn flight(frame: u32) -> Mapping {
    let down = f64::from(frame.min(25)) / 25.0;
    let on = f64::from(frame.saturating_sub(25)) / 60.0;
    Mapping::new(SIZE, [0.4 + 0.3 * on, 0.45 + 0.1 * on], 12.0 * (0.9 / 12.0f64).powf(down), 1.0, 0.4)
}

/// How many pixels show something else than the texel where they are, at whatever level; those within 1/50 of an edge may be either.
fn wrong_pixels(picture: &[[u8; 4]], mapping: &Mapping) -> usize {
    let is_wrong = |(n, colour): (u32, &[u8; 4])| {
        let (level, shown) = PropertySource::texel_from_color(Dims::D2, *colour);
        let at = [n % PICTURE[0], n / PICTURE[0]].map(|pixel| f64::from(pixel) + 0.5);
        let texel: [f64; 2] = std::array::from_fn(|a| {
            let of = |part: [f32; 2]| f64::from(part[a]);
            let uv = of(mapping.origin) + of(mapping.along_x) * at[0] + of(mapping.along_y) * at[1];
            uv * f64::from(SIZE[a]) / 2f64.powi(i32::from(level))
        });
        let is_near_edge = texel.iter().any(|texel| (texel - texel.round()).abs() < 0.02);
        level > 12 || !is_near_edge && (0..2).any(|a| texel[a].floor() as i64 % 4096 != i64::from(shown[a]))
    };
    (0..).zip(picture).filter(|&(n, colour)| is_wrong((n, colour))).count()
}

fn recorded_ahead(way: FeedbackWay) {
    let mut screen = screen(way, 70);
    let (mut behind, mut other) = (None, None);
    let mut bind_group = screen.textures.bind_group(screen.texture(0)).clone();
    let mut grown = 0;
    for frame in 0..90 {
        match frame {
            30 => drop(screen.textures.resize_pool(POOL, 110 * TILE).unwrap()),
            40 => other = Some(screen.textures.add(property([900, 900], 64, AddressMode::Clamp)).unwrap()),
            50 => assert!(screen.textures.remove(other.unwrap())),
            60 => drop(screen.textures.resize_pool(POOL, 60 * TILE).unwrap()),
            _ => {}
        }
        let mapping = flight(frame);
        screen.set_mapping(0, &mapping);
        let wanted = screen.record_wanted(PICTURE);
        screen.textures.update().unwrap();
        let now = screen.textures.bind_group(screen.texture(0)).clone();
        grown += u32::from(now != bind_group && !matches!(frame, 30 | 60));
        bind_group = now;
        let mut picture = screen.record_picture(PICTURE);
        let copy = screen.copy_picture(&mut picture);
        // What was recorded a frame ago, in two parts; where the camera is, the queue has been told meanwhile.
        let ahead = behind.replace((wanted, picture, copy));
        let Some((wanted, picture, copy)): Option<(wgpu::CommandEncoder, wgpu::CommandEncoder, _)> = ahead
        else {
            continue;
        };
        screen.gpu.queue.submit([wanted.finish()]);
        screen.gpu.queue.submit([picture.finish()]);
        let wrong = wrong_pixels(&screen.read_copy(&copy), &mapping);
        assert_eq!(wrong, 0, "{way:?}: frame {frame}");
    }
    let stats = screen.textures.stats();
    assert!(grown > 0 && stats.pager.evicted > 100, "{way:?}: {grown} growths, {stats:?}");
    drop(behind);
    let mut control = crate::dropped::screen(way, 400);
    screen.textures.resize_pool(POOL, 400 * TILE).unwrap();
    for screen in [&mut screen, &mut control] {
        screen.set_mapping(0, &pose(2));
        screen.textures.view_cut();
        screen.settle(|_| false, |_| {});
    }
    assert!(screen.picture() == control.picture(), "{way:?}");
}

#[test]
fn frames_with_a_pass_of_its_own_are_recorded_ahead() {
    recorded_ahead(FeedbackWay::Separate);
}

#[test]
fn frames_with_inline_feedback_are_recorded_ahead() {
    recorded_ahead(FeedbackWay::Inline);
}

#[test]
fn frames_with_raw_feedback_are_recorded_ahead() {
    recorded_ahead(FeedbackWay::Raw);
}
