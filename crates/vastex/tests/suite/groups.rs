//! Groups: several textures in one shader, served by one feedback entry, beside each of them drawn alone.

use std::sync::Arc;

use crate::common::texts::{NAMES, apart, by_columns};
use crate::common::{Mapping, PICTURE, Screen, property, settings};
use vastex::diagnostics::PageState;
use vastex::{
    AddressMode, Error, Event, GpuError, GroupError, GroupId, LevelRule, Member, Settings, TextureId,
    TextureNumber, Textures, TileSource,
};
use vastex_wgpu::test_device::TestDevice;

/// The largest is not the first; sizes that divide it and one that does not, pages of three sizes.
const SIZES: [([u32; 2], u32); 4] =
    [([1000, 800], 32), ([4000, 3200], 128), ([1700, 1360], 64), ([500, 400], 128)];

fn sources() -> [Arc<dyn TileSource>; 4] {
    SIZES.map(|(size, page)| property(size, page, AddressMode::Wrap))
}

fn add_all(textures: &mut Textures) -> Vec<TextureId> {
    sources().into_iter().map(|source| textures.add_blocking(source).unwrap()).collect()
}

fn add_group(textures: &mut Textures) -> GroupId {
    let ids = add_all(textures);
    textures.add_group(NAMES.into_iter().zip(ids)).unwrap()
}

/// Level 0 of the largest along a pixel of the picture.
fn mapping(texels: f64) -> Mapping {
    Mapping::new(SIZES[1].0, [0.4, 0.6], texels, 1.3, 0.7)
}

/// The picture of each member alone, each in a `Textures` of its own, with the same mapping and levels.
fn alone(nth: usize, texels: f64, rule: LevelRule) -> Vec<[u8; 4]> {
    let mut screen = Screen::new(&sources()[nth..=nth], settings());
    screen.textures.texture_mut(screen.texture(0)).unwrap().set_levels(rule);
    screen.set_mapping(0, &mapping(texels));
    screen.converge();
    screen.complete();
    screen.picture()
}

/// Each column of the picture is as that of the member alone.
fn check(screen: &mut Screen, texels: f64, rules: [LevelRule; 4]) {
    screen.set_mapping(0, &mapping(texels));
    screen.converge();
    screen.complete();
    let (picture, width) = (screen.picture(), PICTURE[0] as usize);
    for (nth, rule) in rules.into_iter().enumerate() {
        let alone = alone(nth, texels, rule);
        let columns = nth * width / 4..(nth + 1) * width / 4;
        let of_columns = |picture: &[[u8; 4]]| -> Vec<[u8; 4]> {
            picture.chunks(width).flat_map(|row| row[columns.clone()].to_vec()).collect()
        };
        let (found, expected) = (of_columns(&picture), of_columns(&alone));
        let wrong = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
        assert_eq!(wrong, 0, "{} at {texels} texels a pixel: of {} pixels", NAMES[nth], found.len());
    }
}

const ALL_LEVELS: LevelRule = LevelRule { bias: 0.0, finest: 0, coarsest: u8::MAX };

#[test]
fn every_member_looks_as_it_does_alone() {
    let mut screen = Screen::showing(settings(), &by_columns(), add_group);
    for texels in [0.3, 1.1, 3.0, 11.0, 40.0] {
        check(&mut screen, texels, [ALL_LEVELS; 4]);
    }
    assert_eq!(screen.textures.stats().pools.len(), 3, "one for each page size");
}

#[test]
fn a_pool_may_be_resized_under_a_group() {
    let mut screen = Screen::showing(settings(), &by_columns(), add_group);
    check(&mut screen, 2.0, [ALL_LEVELS; 4]);
    let pools: Vec<_> = screen.textures.stats().pools.iter().map(|pool| (pool.pool, pool.bytes)).collect();
    let loaded = screen.textures.stats().pager.loaded;
    for (pool, bytes) in pools {
        // Of another number of columns and rows, and with the tails in other slots.
        assert_ne!(screen.textures.memory().resize_pool(pool, bytes * 2 / 3).unwrap().bytes, bytes);
    }
    check(&mut screen, 2.0, [ALL_LEVELS; 4]);
    assert_eq!(screen.textures.stats().pager.loaded, loaded, "tiles are kept");
}

#[test]
fn members_keep_their_clamps_and_biases() {
    let mut screen = Screen::showing(settings(), &by_columns(), add_group);
    let rules = [
        LevelRule { bias: 1.3, ..ALL_LEVELS },
        LevelRule { finest: 2, ..ALL_LEVELS },
        LevelRule { bias: -0.8, ..ALL_LEVELS },
        LevelRule { coarsest: 1, ..ALL_LEVELS },
    ];
    let ids: Vec<TextureId> = screen.textures.inspect().textures().collect();
    for (id, rule) in ids.into_iter().zip(rules) {
        screen.textures.texture_mut(id).unwrap().set_levels(rule);
    }
    for texels in [0.3, 2.7, 14.0] {
        check(&mut screen, texels, rules);
    }
}

#[test]
fn a_group_outlives_its_device_but_not_its_members() {
    let screen = Screen::showing(settings(), &by_columns(), add_group);
    let ids: Vec<TextureId> = screen.textures.inspect().textures().collect();
    let mut screen = screen;
    screen.set_mapping(0, &mapping(2.0));
    (0..5).for_each(|_| drop(screen.frame().unwrap()));
    screen.gpu.device.destroy();
    let mut screen = screen.on_another_device();
    check(&mut screen, 2.0, [ALL_LEVELS; 4]);
    // In the place of the group that loses a member comes another, under a number of its own.
    let textures = &mut screen.textures;
    assert!(textures.remove(ids[3]));
    let group = textures.add_group([("a", ids[0]), ("b", ids[1])]).unwrap();
    assert!(textures.remove(group) && !textures.remove(group));
    assert!(textures.inspect().textures().eq(ids[..3].iter().copied()));
}

#[test]
fn members_apart_take_turns() {
    let mut screen = Screen::showing(settings(), &apart(), |textures| {
        let ids = add_all(textures);
        let members = [
            Member::new("color", ids[0]),
            Member::apart("night", ids[1]),
            Member::new("clouds", ids[2]),
            Member::apart("height", ids[3]),
        ];
        textures.add_group(members).unwrap()
    });
    screen.set_mapping(0, &mapping(1.1));
    screen.converge();
    // Whatever pixels want, whoever's turn it is: all is there.
    for _ in 0..3 {
        let wanted = screen.feedback_of_every_pixel().pages;
        let textures: std::collections::BTreeSet<TextureNumber> =
            wanted.iter().map(|wanted| wanted.page.texture()).collect();
        assert_eq!(textures.len(), 4, "each has its turn");
        for wanted in wanted.iter().filter(|wanted| wanted.pixels > 64) {
            assert!(
                matches!(screen.textures.inspect().state(wanted.page), PageState::Resident(_)),
                "{wanted:?}"
            );
        }
        screen.frame().unwrap();
    }
}

#[test]
fn what_cannot_be_a_group_is_refused_and_leaves_nothing() {
    let gpu = TestDevice::new();
    let mut textures = Textures::new(&gpu.device, &gpu.queue, Settings::default()).unwrap();
    let ids = add_all(&mut textures);
    let refused = |result: Result<GroupId, Error>| result.unwrap_err();
    let nobody: [(&str, TextureId); 0] = [];
    assert!(matches!(refused(textures.add_group(nobody)), Error::Group(GroupError::Empty)));
    let error = refused(textures.add_group([("Night", ids[0])]));
    assert!(matches!(error, Error::Gpu(GpuError::MemberName { .. })), "{error}");
    // Tables of pools are storage buffers; members that are the same layer bind it once.
    let most = gpu.device.limits().max_storage_buffers_per_shader_stage;
    let pools = (0..=most).map(|nth| property([100, 100], 8 + 4 * nth, AddressMode::Clamp));
    let of_pools: Vec<TextureId> = pools.map(|source| textures.add_blocking(source).unwrap()).collect();
    let many = of_pools.iter().enumerate().map(|(nth, id)| (format!("m{nth}"), *id));
    let error = refused(textures.add_group(many));
    assert!(matches!(error, Error::Gpu(GpuError::GroupTooLarge { pools: 9, max_pools: 8, .. })), "{error}");
    let group = textures.add_group((0..20).map(|nth| (format!("m{nth}"), ids[0]))).unwrap();
    assert_eq!(textures.bindings().ids(group).unwrap()[1..], vec![textures.shader_id(ids[0]).unwrap(); 20]);
    textures.remove(group);
    textures.remove(ids[3]);
    let error = refused(textures.add_group([("a", ids[0]), ("b", ids[3])]));
    assert!(matches!(error, Error::Group(GroupError::NoTexture(3))), "{error}");
    let error = refused(textures.add_group([Member::new("a", ids[0]), Member::apart("b", ids[3])]));
    assert!(matches!(error, Error::Group(GroupError::NoTexture(3))), "{error}");
    assert!(textures.add_group([("a", ids[0]), ("b", ids[1])]).is_ok());
}

#[test]
fn a_group_goes_with_a_member_and_says_so() {
    let mut group = None;
    let mut screen = Screen::showing(settings(), &by_columns(), |textures| {
        let added = add_group(textures);
        group = Some(added);
        added
    });
    let group = group.unwrap();
    screen.set_mapping(0, &mapping(1.1));
    screen.frame().unwrap();
    let member = screen.textures.inspect().textures().nth(2).unwrap();
    assert!(screen.textures.remove(member));
    let events: Vec<Event> = std::iter::from_fn(|| screen.textures.poll_event()).collect();
    assert!(events.contains(&Event::GroupRemoved { group: group.number() }), "{events:?}");
    assert!(matches!(screen.textures.kinds(group), Err(Error::NoGroup(id)) if id == group));
    assert!(screen.textures.bind_group(group).is_err() && !screen.textures.remove(group));
    assert_eq!(screen.textures.inspect().textures().count(), 3, "the others stay");
}
