//! What nobody bounds from outside stays bounded: bad feedback, tickets that nobody asks for.

use vastex_core::{
    BiasRule, Budgets, Dims, Feedback, Geometry, GeometrySpec, PageId, PagePos, Pager, Region, TextureNumber,
    TicketState, Urgency, WantedPage,
};

fn texture() -> TextureNumber {
    TextureNumber::new(0).unwrap()
}

fn page(x: u32, y: u32) -> PageId {
    PageId::new(texture(), Dims::D2, PagePos::new_2d(0, x, y)).unwrap()
}

fn pager() -> Pager {
    let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 1000, in_flight_bytes: 1000 });
    let pool = pager.add_pool(400, 1, Some(BiasRule::Solved)).unwrap();
    let geometry = Geometry::new(GeometrySpec::image(4096, 4096)).unwrap();
    pager.add_texture(pool, &geometry, None, None).unwrap();
    pager
}

fn seen(frame: u64, page: PageId) -> Feedback {
    let pages = vec![WantedPage { page, pixels: 64, eighth: 0 }];
    Feedback { frame, pages, ..Feedback::default() }
}

#[test]
fn feedback_that_names_no_page_is_dropped() {
    let mut pager = pager();
    let at_rest = pager.stats().wanted;
    pager.begin_frame(1);
    pager.observe(&seen(1, page(0, 0)));
    assert!(pager.stats().wanted > at_rest);
    // It was counted to the page that came first, and kept that in view.
    for frame in 2..60 {
        pager.begin_frame(frame);
        pager.observe(&seen(frame, PageId::NONE));
    }
    assert_eq!(pager.stats().wanted, at_rest);
    for frame in 60..120 {
        pager.begin_frame(frame);
        pager.observe(&seen(frame, page(31, 31)));
        assert_eq!(pager.state(PageId::NONE), vastex_core::PageState::Absent);
    }
}

#[test]
fn tickets_that_have_ended_and_nobody_asks_for_do_not_pile_up() {
    let mut pager = pager();
    let empty = Region::image(9000..9001, 0..1); // beyond the texture, so done at once
    let mut last = None;
    for frame in 1..=5000 {
        pager.begin_frame(frame);
        last = Some(pager.prefetch(texture(), &empty, Urgency::default()).unwrap());
    }
    pager.begin_frame(5001);
    let ended: Vec<_> = std::iter::from_fn(|| pager.poll_ended()).collect();
    assert!(ended.len() < 1024 + 100, "{}", ended.len());
    let (ticket, progress) = *ended.last().unwrap();
    assert_eq!((Some(ticket), progress.state), (last, TicketState::Done), "the newest are kept");
    // Of as many at once none is lost for whoever asks in each frame.
    let open: Vec<_> = (0..3000)
        .map(|_| pager.prefetch(texture(), &Region::whole().on_levels(4..=4), Urgency::default()).unwrap())
        .collect();
    open.iter().for_each(|&ticket| assert!(pager.release(ticket)));
    pager.begin_frame(5002);
    assert_eq!(std::iter::from_fn(|| pager.poll_ended()).count(), 3000);
}
