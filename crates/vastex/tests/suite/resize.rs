//! Pools that grow and shrink while pictures are drawn: the picture stays, tiles are not loaded again, bytes
//! are kept to.

use crate::common::{Mapping, PICTURE, Screen, property, settings};
use vastex::diagnostics::Integrator;
use vastex::{AddressMode, BiasRule, Error, PoolId, PoolSettings, Settings};

const SIZE: [u32; 2] = [1000, 777];
const TILE: u64 = 40 * 40 * 4;
const POOL: PoolId = PoolId::new(0);

/// Two textures of one pool of so many tiles, seen near their level 0.
fn two_textures(tiles: u64) -> Screen {
    let sources = [property(SIZE, 32, AddressMode::Clamp), property([777, 1000], 32, AddressMode::Wrap)];
    let pools = PoolSettings::of_bytes(tiles * TILE);
    let mut screen = Screen::new(&sources, Settings { pools, ..settings() });
    look(&mut screen, 0.3);
    screen.converge();
    screen
}

fn look(screen: &mut Screen, at: f64) {
    screen.set_mapping(0, &Mapping::new(SIZE, [at, 0.4], 1.1, 1.0, 0.2));
    screen.set_mapping(1, &Mapping::new([777, 1000], [0.9, at], 1.3, 1.0, 1.0));
}

#[test]
fn a_pool_that_still_holds_the_view_shows_the_same_picture() {
    let mut screen = two_textures(400);
    let (picture, before) = (screen.picture(), screen.textures.stats().pools[0].clone());
    let needed = u64::from(before.pager.occupied) * 5 / 4;
    // Larger, with another grid of slots; then so small that most tiles have to move.
    for tiles in [1700, needed] {
        let resize = screen.textures.memory().resize_pool(POOL, tiles * TILE).unwrap();
        assert!(
            resize.bytes <= tiles * TILE && resize.transient == resize.before + resize.bytes,
            "{resize:?}"
        );
        assert!(screen.picture() == picture, "at once");
        (0..20).for_each(|_| drop(screen.frame().unwrap()));
        assert!(screen.picture() == picture, "and after some frames");
        let after = &screen.textures.stats().pools[0];
        assert_eq!((after.bytes, after.pager.loaded), (resize.bytes, before.pager.loaded), "{after:?}");
    }
}

#[test]
fn a_pool_that_is_too_small_becomes_coarser_and_sharpens_when_it_grows() {
    let mut screen = two_textures(400);
    let sharp = screen.picture();
    screen.textures.memory().resize_pool(POOL, 40 * TILE).unwrap();
    screen.converge();
    assert!(screen.textures.stats().pager.bias_eighths > 0);
    assert!(screen.picture() == two_textures(40).picture(), "as if it had been small from the beginning");
    // Elsewhere, so that every slot has had another tile, and back.
    look(&mut screen, 0.7);
    screen.converge();
    screen.textures.memory().resize_pool(POOL, 500 * TILE).unwrap();
    (0..40).for_each(|_| drop(screen.frame().unwrap()));
    look(&mut screen, 0.3);
    screen.converge();
    assert_eq!(screen.textures.stats().pager.bias_eighths, 0);
    assert!(screen.picture() == sharp);
}

#[test]
fn rules_and_budgets_change_while_pictures_are_drawn() {
    let mut screen = two_textures(400);
    let sharp = screen.picture();
    screen.textures.memory().resize_pool(POOL, 40 * TILE).unwrap();
    screen.converge();
    let solved = screen.picture();
    assert_eq!(screen.textures.inspect().bias_rule(POOL), Some(BiasRule::Solved));
    screen.textures.memory().set_bias_rule(POOL, None).unwrap();
    (0..40).for_each(|_| drop(screen.frame().unwrap()));
    assert_eq!(
        (screen.textures.inspect().bias_rule(POOL), screen.textures.stats().pager.bias_eighths),
        (None, 0)
    );
    let rule = BiasRule::Integrating(Integrator { rate: 20.0, ..Integrator::default() });
    screen.textures.memory().set_bias_rule(POOL, Some(rule)).unwrap();
    (0..60).for_each(|_| drop(screen.frame().unwrap()));
    assert!(screen.textures.stats().pager.bias_eighths > 0, "hunted");
    screen.textures.memory().set_bias_rule(POOL, Some(BiasRule::Solved)).unwrap();
    screen.converge();
    assert!(screen.picture() == solved, "as if there had been no other rule");
    let error = screen.textures.memory().set_bias_rule(PoolId::new(7), None).unwrap_err();
    assert!(matches!(error, Error::NoPool(_)), "{error}");
    // A tile a frame, and then as many as there are.
    screen.textures.memory().set_budgets(TILE, TILE);
    screen.textures.memory().resize_pool(POOL, 400 * TILE).unwrap();
    let loaded = |screen: &Screen| screen.textures.stats().pager.loaded;
    // A bias falls after a whole jitter cycle.
    let first = loaded(&screen);
    let begun = (0..60).find(|_| {
        screen.frame().unwrap();
        loaded(&screen) > first
    });
    assert!(begun.is_some(), "nothing is loaded");
    let before = loaded(&screen);
    (0..10).for_each(|_| drop(screen.frame().unwrap()));
    let slow = loaded(&screen) - before;
    assert!((1..=10).contains(&slow), "{slow} tiles in ten frames");
    screen.textures.memory().set_budgets(100 * TILE, 100 * TILE);
    (0..10).for_each(|_| drop(screen.frame().unwrap()));
    assert!(loaded(&screen) - before > 3 * slow, "{} tiles after {slow}", loaded(&screen) - before);
    assert_eq!(screen.textures.inspect().settings().upload_bytes_per_frame, 100 * TILE);
    screen.converge();
    assert!(screen.picture() == sharp);
}

#[test]
fn what_cannot_be_done_leaves_everything_as_it_was() {
    let mut screen = two_textures(400);
    let (picture, before) = (screen.picture(), screen.textures.stats());
    let error = screen.textures.memory().resize_pool(PoolId::new(7), TILE).unwrap_err();
    assert!(matches!(error, Error::NoPool(pool) if pool.number() == 7), "{error}");
    // Two tails, and nothing to work with.
    for tiles in [0, 1, 2] {
        let error = screen.textures.memory().resize_pool(POOL, tiles * TILE).unwrap_err();
        assert!(matches!(error, Error::Pool(_)), "{error}");
    }
    assert_eq!(
        screen.textures.memory().resize_pool(POOL, before.pool_bytes).unwrap().bytes,
        before.pool_bytes
    );
    assert_eq!(screen.textures.stats(), before);
    assert!(screen.picture() == picture);
}

#[test]
fn pools_without_a_size_of_their_own_follow_the_picture() {
    let sources = [property(SIZE, 32, AddressMode::Clamp)];
    let mut screen = Screen::new(&sources, Settings { picture: PICTURE, ..settings() });
    let small = screen.textures.stats().pool_bytes;
    assert!(screen.textures.memory().set_picture(PICTURE.map(|side| side * 21 / 20)).unwrap().is_empty());
    let resized = screen.textures.memory().set_picture(PICTURE.map(|side| side * 3)).unwrap();
    let large = screen.textures.stats().pool_bytes;
    assert!(large > 2 * small && resized.len() == 1 && resized[0].1.bytes == large, "{resized:?}");
    screen.textures.memory().set_picture(PICTURE).unwrap();
    assert_eq!(screen.textures.stats().pool_bytes, small);
    // One that has its own size keeps it; one without textures has no memory, and the size for when it has.
    let mut fixed = two_textures(400);
    assert!(fixed.textures.memory().set_picture([9000, 9000]).unwrap().is_empty());
    screen.remove(0);
    let resized = screen.textures.memory().set_picture(PICTURE.map(|side| side * 3)).unwrap();
    assert_eq!((resized.len(), screen.textures.stats().pool_bytes), (1, 0));
    screen.replace(0, property(SIZE, 32, AddressMode::Clamp));
    assert_eq!(screen.textures.stats().pool_bytes, large);
}

#[test]
fn a_pool_that_somebody_sized_keeps_its_size_until_it_is_to_follow_the_picture_again() {
    let sources = [property(SIZE, 32, AddressMode::Clamp)];
    let mut screen = Screen::new(&sources, Settings { picture: PICTURE, ..settings() });
    let planned = screen.textures.stats().pool_bytes;
    let own = screen.textures.memory().resize_pool(POOL, planned * 3 / 2).unwrap().bytes;
    // Not even for a moment: nothing is resized.
    for picture in [PICTURE.map(|side| side * 3), [64, 64], PICTURE] {
        assert_eq!(screen.textures.memory().set_picture(picture).unwrap(), []);
        assert_eq!(screen.textures.stats().pool_bytes, own);
    }
    // Too few bytes for the tails: it stays as it was, and as free.
    let error = screen.textures.memory().resize_pool(POOL, TILE).unwrap_err();
    assert!(matches!(error, Error::Pool(_)), "{error}");
    assert_eq!(screen.textures.memory().fit_pool(POOL).unwrap().bytes, planned);
    let resized = screen.textures.memory().set_picture(PICTURE.map(|side| side * 3)).unwrap();
    assert!(resized.len() == 1 && resized[0].1.bytes > planned, "{resized:?}");
    let error = screen.textures.memory().fit_pool(PoolId::new(7)).unwrap_err();
    assert!(matches!(error, Error::NoPool(pool) if pool.number() == 7), "{error}");
}
