//! Groups: what feedback that names a group wants of its members, whichever pools they are in.

use vastex_core::{
    AddressMode, Budgets, Dims, Feedback, Geometry, GeometrySpec, GroupError, GroupNumber, LevelRule, PageId,
    PagePos, Pager, PoolId, TextureNumber, WantedPage,
};

fn id(number: u16) -> TextureNumber {
    TextureNumber::new(number).unwrap()
}

fn image(size: [u32; 2], page: u32, address: AddressMode) -> Geometry {
    let spec =
        GeometrySpec { page, border: 2, address: [address; 3], ..GeometrySpec::image(size[0], size[1]) };
    Geometry::new(spec).unwrap()
}

/// Three textures in two pools: the largest, half of it, and one of another pool with small pages.
fn three() -> (Pager, [TextureNumber; 3]) {
    let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 1000, in_flight_bytes: 1000 });
    let pools: Vec<PoolId> = (0..2).map(|_| pager.add_pool(200, 10, None).unwrap()).collect();
    let mut add = |pool: usize, side, page| {
        pager
            .add_texture(pools[pool], &image([side, side / 2], page, AddressMode::Clamp), None, None)
            .unwrap()
            .0
    };
    let textures = [add(0, 2048, 128), add(0, 4096, 128), add(1, 1024, 32)];
    (pager, textures)
}

fn entry(group: GroupNumber, pos: PagePos, pixels: u32, eighth: u8) -> WantedPage {
    WantedPage { page: PageId::new(group.number(), Dims::D2, pos).unwrap(), pixels, eighth }
}

fn positions(wanted: &Feedback) -> Vec<(TextureNumber, PagePos, u32, u8)> {
    let spelt = |w: &WantedPage| (w.page.texture(), w.page.pos(Dims::D2), w.pixels, w.eighth);
    wanted.pages.iter().map(spelt).collect()
}

#[test]
fn a_group_has_the_shape_of_its_largest_member_and_wants_of_all() {
    let (mut pager, [half, whole, small]) = three();
    let group = pager.add_group(&[half, whole, small, half]).unwrap();
    assert_eq!(pager.group_shape(group).unwrap().size(), [4096, 2048, 1]);
    assert_eq!(pager.group_members(group), [half, whole, small]);
    // Page 3,1 of level 1: texels 768 to 1024 of level 0, a sixteenth of the width, an eighth of the height.
    let pages = vec![entry(group, PagePos::new_2d(1, 3, 1), 40, 2)];
    let wanted = pager.of_members(&Feedback { frame: 5, pages, degenerate: 7, ..Feedback::default() });
    assert_eq!((wanted.frame, wanted.degenerate), (5, 7));
    let page = PagePos::new_2d;
    let of_small = [(6, 2), (7, 2), (6, 3), (7, 3)].map(|(x, y)| (small, page(0, x, y), 10, 0));
    let expected = [&[(half, page(0, 3, 1), 40, 2), (whole, page(1, 3, 1), 40, 2)], &of_small[..]].concat();
    assert_eq!(positions(&wanted), expected);
}

#[test]
fn a_members_own_clamp_and_bias_are_kept_to() {
    let (mut pager, [half, whole, small]) = three();
    let group = pager.add_group(&[half, whole, small]).unwrap();
    assert!(pager.set_levels(whole, LevelRule { bias: 1.25, ..LevelRule::default() }));
    assert!(pager.set_levels(half, LevelRule { finest: 2, ..LevelRule::default() }));
    assert!(pager.set_levels(small, LevelRule { coarsest: 1, ..LevelRule::default() }));
    assert_eq!(pager.levels(half).unwrap(), LevelRule { bias: 0.0, finest: 2, coarsest: 11 });
    let feedback =
        Feedback { pages: vec![entry(group, PagePos::new_2d(4, 0, 0), 64, 3)], ..Feedback::default() };
    let levels: Vec<(TextureNumber, u8, u8)> = positions(&pager.of_members(&feedback))
        .into_iter()
        .map(|(t, pos, _, eighth)| (t, pos.level, eighth))
        .collect();
    // Level 4.375 of the shape: 3.375 of the half, 5.625 (a tail from 5 on) of the whole, 2.375 of the small
    // one.
    assert_eq!(levels[..2], [(half, 3, 3), (whole, 5, 5)]);
    assert!(levels[2..].iter().all(|&level| level == (small, 1, 0)), "{levels:?}");
    // An entry of level 0 stands for any magnification, which a bias adds to.
    let feedback =
        Feedback { pages: vec![entry(group, PagePos::new_2d(0, 0, 0), 64, 0)], ..Feedback::default() };
    let finest = positions(&pager.of_members(&feedback));
    assert!(finest.iter().any(|&(texture, pos, ..)| texture == whole && pos.level == 0), "{finest:?}");
}

#[test]
fn what_several_entries_want_of_a_member_is_added_up() {
    let (mut pager, [half, whole, _]) = three();
    pager.set_levels(half, LevelRule { finest: 1, ..LevelRule::default() });
    let groups = [&[half, whole][..], &[whole, half]].map(|members| pager.add_group(members).unwrap());
    let of = |group, x, eighth| entry(group, PagePos::new_2d(0, x, 0), 10, eighth);
    let alone = WantedPage { page: of(groups[0], 1, 0).page, ..of(groups[0], 1, 5) };
    let own = PageId::new(half, Dims::D2, PagePos::new_2d(1, 0, 0)).unwrap();
    let pages = vec![
        WantedPage { page: own, ..alone },
        of(groups[0], 0, 3),
        of(groups[0], 3, 2),
        of(groups[1], 2, 4),
    ];
    let wanted = positions(&pager.of_members(&Feedback { pages, ..Feedback::default() }));
    let page = |x| PagePos::new_2d(0, x, 0);
    let of_whole = [(whole, page(0), 10, 3), (whole, page(2), 10, 4), (whole, page(3), 10, 2)];
    assert_eq!(wanted, [&[(half, PagePos::new_2d(1, 0, 0), 40, 0)], &of_whole[..]].concat());
}

#[test]
fn what_is_gone_is_wanted_no_more_and_numbers_come_back() {
    let (mut pager, [half, whole, small]) = three();
    let group = pager.add_group(&[half, whole]).unwrap();
    assert!(pager.remove_texture(whole, 3));
    assert_eq!(pager.group_members(group), [half]);
    let feedback =
        Feedback { pages: vec![entry(group, PagePos::new_2d(0, 0, 0), 64, 0)], ..Feedback::default() };
    assert!(positions(&pager.of_members(&feedback)).iter().all(|wanted| wanted.0 == half));
    assert!(pager.remove_group(group, 4) && !pager.remove_group(group, 4));
    assert!(pager.group_shape(group).is_none() && pager.group_members(group).is_empty());
    assert!(!pager.of_members(&feedback).pages.iter().any(|wanted| wanted.page.texture() == half));
    pager.feedback_under_way(Some(4));
    assert_ne!(pager.add_group(&[small]).unwrap(), group, "feedback of frame 4 may name it");
    pager.feedback_under_way(Some(5));
    assert_eq!(pager.add_group(&[small]).unwrap(), group);
}

#[test]
fn what_cannot_be_a_group_is_refused() {
    let (mut pager, [half, ..]) = three();
    assert_eq!(pager.add_group(&[]), Err(GroupError::Empty));
    assert_eq!(pager.add_group(&[half, id(77)]), Err(GroupError::NoTexture(77)));
    let group = pager.add_group(&[half]).unwrap();
    assert_eq!(pager.add_group(&[group.number()]), Err(GroupError::NoTexture(group.number().number())));
    let pool = pager.add_pool(20, 10, None).unwrap();
    let volume = Geometry::new(GeometrySpec { page: 16, ..GeometrySpec::volume([40; 3]) }).unwrap();
    let (volume, _) = pager.add_texture(pool, &volume, None, None).unwrap();
    assert_eq!(pager.add_group(&[half, volume]), Err(GroupError::Mixed));
}

#[test]
fn entries_that_name_nothing_want_nothing() {
    let (mut pager, [half, ..]) = three();
    let group = pager.add_group(&[half]).unwrap();
    let nowhere = [PagePos::new_2d(31, 0, 0), PagePos::new_2d(0, 16, 0), PagePos::new_2d(0, 0, 8)];
    let pages = nowhere.map(|pos| entry(group, pos, 1, 0)).to_vec();
    assert!(pager.of_members(&Feedback { pages, ..Feedback::default() }).pages.is_empty());
}

/// In which frames a view has converged of which one page is named in each frame, and another only in every
/// 32nd.
fn frames_converged(turns: u32, frames: u64) -> Vec<u64> {
    let (mut pager, [half, ..]) = three();
    pager.set_turns(turns);
    let page = |x| PageId::new(half, Dims::D2, PagePos::new_2d(0, x, 0)).unwrap();
    let wanted = |x| WantedPage { page: page(x), pixels: 9, eighth: 0 };
    let mut converged = Vec::new();
    for frame in 1..=frames {
        pager.begin_frame(frame);
        let pages = if frame % 32 == 1 { vec![wanted(3), wanted(9)] } else { vec![wanted(3)] };
        pager.observe(&Feedback { frame, pages, ..Feedback::default() });
        while let Some(request) = pager.poll_request() {
            pager.tile_ready(request.page, bytes::Bytes::from_static(b"0123456789"));
        }
        while pager.poll_upload().is_some() {}
        if pager.is_converged() {
            converged.push(frame);
        }
    }
    converged
}

#[test]
fn where_entries_take_turns_feedback_counts_for_as_many_cycles() {
    // Alone, what is seen in every second cycle comes and goes, and a cycle without it looks like the end.
    let alone = frames_converged(1, 160);
    assert!(alone.contains(&32) && !alone.contains(&33) && !alone.contains(&65), "{alone:?}");
    let by_turns = frames_converged(2, 160);
    assert!(by_turns[0] > 32 && by_turns.iter().copied().eq(by_turns[0]..=160), "{by_turns:?}");
}
