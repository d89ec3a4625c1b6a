//! Sources that do not answer: a future that never wakes, and a read that never returns, in every thread. All
//! others go on.

use std::collections::BTreeSet;

use super::*;
use crate::sources::LimitedSource;
use crate::stores::ReadLimit;

const TIME_OUT: Duration = Duration::from_secs(30);
/// Long enough for any number of reads to lend their places, and no read's time-out.
const A_WHILE: Duration = Duration::from_millis(300);

#[derive(Clone, Copy, Debug, PartialEq)]
enum How {
    /// The future suspends and is never woken.
    Suspends,
    /// The read blocks its thread.
    Blocks,
}

/// A source whose reads hang until it is told to answer; of those that block, all go on then.
struct Hung {
    inner: PropertySource,
    how: How,
    answers: Mutex<bool>,
    told: Condvar,
    begun: AtomicUsize,
}

impl Hung {
    fn new(how: How) -> Arc<Hung> {
        let (answers, told) = (Mutex::new(false), Condvar::new());
        Arc::new(Hung { inner: source(), how, answers, told, begun: AtomicUsize::new(0) })
    }

    fn begun(&self) -> usize {
        self.begun.load(Ordering::SeqCst)
    }

    fn answer(&self) {
        *self.answers.lock().unwrap() = true;
        self.told.notify_all();
    }
}

impl TileSource for Hung {
    fn description(&self) -> &Arc<Description> {
        self.inner.description()
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            self.begun.fetch_add(1, Ordering::SeqCst);
            match self.how {
                How::Suspends if !*self.answers.lock().unwrap() => std::future::pending().await,
                How::Suspends => {}
                How::Blocks => drop(self.told.wait_while(self.answers.lock().unwrap(), |answers| !*answers)),
            }
            self.inner.read(pos).await
        })
    }
}

/// Page `x` of a texture.
fn of(number: u16, x: u32) -> PageId {
    PageId::new(texture(number), Dims::D2, PagePos::new_2d(0, x % 30, x / 30)).unwrap()
}

fn timed(threads: usize) -> (Loader, Arc<FakeClock>) {
    let clock = Arc::new(FakeClock::default());
    let settings =
        LoaderSettings { threads, reads_at_once: 8, time_out: TIME_OUT, ..LoaderSettings::default() };
    (Loader::with(settings, clock.clone()).unwrap(), clock)
}

/// Polls until so many have ended. `step` passes at each look, until `most` has passed in all.
fn ends(loader: &mut Loader, clock: &FakeClock, step: Duration, most: Duration, count: usize) -> Vec<Loaded> {
    let (mut ends, mut passed) = (Vec::new(), Duration::ZERO);
    until("requests end", || {
        ends.extend(std::iter::from_fn(|| loader.poll()));
        if ends.len() < count && passed + step <= most {
            clock.pass(step);
            passed += step;
        }
        (ends.len() >= count).then_some(())
    });
    assert_eq!(ends.len(), count);
    ends
}

/// Lets as many reads hang as there may be: as many at a time as there are places, which they lend as time
/// passes.
fn hang(
    loader: &mut Loader,
    clock: &FakeClock,
    threads: usize,
    most: usize,
    hung: &[Arc<Hung>],
) -> Vec<Loaded> {
    let begun = || hung.iter().map(|hung| hung.begun()).sum::<usize>();
    let mut ended = Vec::new();
    for count in (0..most).step_by(threads).skip(1).chain([most]) {
        until("reads begin", || (begun() >= count).then_some(()));
        clock.pass(A_WHILE);
        ended.extend(std::iter::from_fn(|| loader.poll()));
    }
    assert_eq!(begun(), most);
    assert!(clock.now() < TIME_OUT / 2, "nothing is overdue yet");
    ended
}

/// How many ended overdue, because of silence, and well.
fn tally(ends: &[Loaded]) -> [usize; 3] {
    ends.iter().fold([0; 3], |[overdue, silent, well], end| match &end.result {
        Err(LoadError::Overdue { .. }) => [overdue + 1, silent, well],
        Err(LoadError::SourceSilent { .. }) => [overdue, silent + 1, well],
        Ok(_) => [overdue, silent, well + 1],
        Err(error) => panic!("{error}"),
    })
}

#[test]
fn sources_that_never_answer_hinder_no_other() {
    for (threads, how) in
        [(1, How::Suspends), (1, How::Blocks), (2, How::Suspends), (2, How::Blocks), (5, How::Blocks)]
    {
        let (mut loader, clock) = timed(threads);
        let hung = [Hung::new(how), Hung::new(how)];
        for (number, hung) in (0..).zip(&hung) {
            loader.add_source(texture(number), hung.clone());
        }
        loader.add_source(texture(2), Arc::new(source()));
        // Those that hang come first, in every thread.
        for x in 0..20 {
            (0..2).for_each(|number| loader.request(of(number, x), 0));
        }
        (0..30).for_each(|x| loader.request(of(2, x), 1));
        let mut others = hang(&mut loader, &clock, threads, 16, &hung);
        let left = 30 - others.len();
        others.extend(ends(&mut loader, &clock, Duration::ZERO, Duration::ZERO, left));
        assert_eq!(tally(&others), [0, 0, 30], "{how:?}");
        assert!(others.iter().all(|end| end.page.texture() == texture(2)));
        assert_eq!([hung[0].begun(), hung[1].begun()], [8, 8], "as many as a source may have at once");
        // All of the rest ends: what was read as overdue, what was queued because of that.
        let hanging = ends(&mut loader, &clock, TIME_OUT, 2 * TIME_OUT, 40);
        assert_eq!(tally(&hanging), [16, 24, 0], "{how:?}");
        let pages: BTreeSet<_> = hanging.iter().map(|end| end.page).collect();
        assert_eq!((pages.len(), loader.outstanding()), (40, 0));
        // Silent: the next fails at once, without any time.
        loader.request(of(0, 25), 0);
        let error = loader.poll().unwrap().result.unwrap_err().to_string();
        assert!(error.contains("8 reads of its source have had no answer within 30s"), "{error}");
        in_time("the loader is dropped", move || drop(loader));
        hung.iter().for_each(|hung| hung.answer());
        until("the sources are free", || hung.iter().all(|hung| Arc::strong_count(hung) == 1).then_some(()));
    }
}

#[test]
fn a_source_is_silent_until_a_read_returns() {
    let (mut loader, clock) = timed(2);
    let hung = Hung::new(How::Blocks);
    loader.add_source(texture(0), hung.clone());
    (0..20).for_each(|x| loader.request(of(0, x), 0));
    assert!(hang(&mut loader, &clock, 2, 8, std::slice::from_ref(&hung)).is_empty());
    ends(&mut loader, &clock, TIME_OUT, TIME_OUT, 20);
    // However long and however often it is asked: its threads are all there are.
    for hour in 0..24 {
        clock.pass(Duration::from_secs(3600));
        assert!(loader.poll().is_none());
        loader.request(of(0, hour), 0);
        assert_eq!(tally(&[loader.poll().unwrap()]), [0, 1, 0]);
    }
    assert_eq!(hung.begun(), 8);
    hung.answer();
    until("it is read again", || {
        loader.request(of(0, 3), 0);
        let end = loader.wait().unwrap();
        assert!(end.page == of(0, 3) && !matches!(end.result, Err(LoadError::Overdue { .. })));
        end.result.ok()
    });
    (0..20).for_each(|x| loader.request(of(0, x), 0));
    assert_eq!(drain(&mut loader).len(), 20);
}

#[test]
fn a_silent_source_is_asked_now_and_then() {
    let (mut loader, clock) = timed(2);
    let hung = Hung::new(How::Suspends);
    loader.add_source(texture(0), hung.clone());
    (0..9).for_each(|x| loader.request(of(0, x), 0));
    until("all that may be are begun", || (hung.begun() == 8).then_some(()));
    assert_eq!(tally(&ends(&mut loader, &clock, TIME_OUT, TIME_OUT, 9)), [8, 1, 0]);
    let ask = |loader: &mut Loader, after: u64| {
        clock.pass(Duration::from_secs(after));
        let begun = hung.begun();
        // A read that was dropped is gone when its thread has seen so.
        until("it is asked", || {
            loader.request(of(0, 0), 0);
            match loader.poll() {
                None => Some(()),
                Some(end) => {
                    assert_eq!(tally(&[end]), [0, 1, 0]);
                    None
                }
            }
        });
        // One at a time.
        loader.request(of(0, 1), 0);
        assert_eq!(tally(&[loader.poll().unwrap()]), [0, 1, 0]);
        until("it is read", || (hung.begun() == begun + 1).then_some(()));
    };
    for pause in [1, 2, 4, 8, 16, 32, 64, 64] {
        clock.pass(Duration::from_millis(1000 * pause - 1));
        assert!(loader.poll().is_none());
        loader.request(of(0, 0), 0);
        assert_eq!(tally(&[loader.poll().unwrap()]), [0, 1, 0], "not before {pause} s");
        ask(&mut loader, 1);
        assert_eq!(tally(&ends(&mut loader, &clock, TIME_OUT, TIME_OUT, 1)), [1, 0, 0]);
    }
    hung.answer();
    clock.pass(Duration::from_secs(64));
    until("it answers", || {
        loader.request(of(0, 0), 0);
        loader.wait().unwrap().result.ok()
    });
    (0..20).for_each(|x| loader.request(of(0, x), 0));
    assert_eq!(drain(&mut loader).len(), 20);
}

#[test]
fn sources_with_one_limit_are_silent_together_and_no_others() {
    for how in [How::Suspends, How::Blocks] {
        let (mut loader, clock) = timed(4);
        let (hung, limit) = (Hung::new(how), ReadLimit::new(3));
        for number in 0..2 {
            loader.add_source(texture(number), Arc::new(LimitedSource::new(hung.clone(), limit.clone())));
        }
        loader.add_source(texture(2), Arc::new(LimitedSource::new(source(), ReadLimit::new(3))));
        (0..6).for_each(|x| loader.request(of((x % 2) as u16, x), 0));
        until("as many as the limit says are begun", || {
            loader.poll();
            (hung.begun() == 3).then_some(())
        });
        let failed = ends(&mut loader, &clock, TIME_OUT, TIME_OUT, 6);
        assert_eq!((tally(&failed), hung.begun()), ([3, 3, 0], 3), "{how:?}");
        (0..10).for_each(|x| loader.request(of(2, x), 0));
        assert_eq!(tally(&ends(&mut loader, &clock, Duration::ZERO, Duration::ZERO, 10)), [0, 0, 10]);
        hung.answer();
    }
}

/// As many places as are ever lent freely, and more sources: each still gets its first read, and one that
/// answers all it asks for.
#[test]
fn hundreds_of_sources_that_block_hinder_no_other() {
    let (mut loader, clock) = timed(8);
    let hung: Vec<_> = (0..270).map(|_| Hung::new(How::Blocks)).collect();
    for (number, hung) in (0..).zip(&hung) {
        loader.add_source(texture(number), hung.clone());
        loader.request(of(number, 0), 0);
    }
    assert!(hang(&mut loader, &clock, 8, 270, &hung).is_empty());
    // Asked for only now: before, a thread might take a second read while other sources have none.
    (0..270).for_each(|number| loader.request(of(number, 1), 1));
    loader.add_source(texture(999), Arc::new(source()));
    (0..30).for_each(|x| loader.request(of(999, x), 9));
    let others = ends(&mut loader, &clock, Duration::ZERO, Duration::ZERO, 30);
    assert_eq!(tally(&others), [0, 0, 30]);
    // What is still queued owes nothing yet, and fails as soon as its source does.
    let failed = ends(&mut loader, &clock, TIME_OUT, TIME_OUT, 540);
    assert_eq!(tally(&failed)[2], 0);
    in_time("the loader is dropped", move || drop(loader));
    hung.iter().for_each(|hung| hung.answer());
}

/// Reads that come back only when so many are under way together.
struct Together {
    inner: PropertySource,
    meet: std::sync::Barrier,
}

impl TileSource for Together {
    fn description(&self) -> &Arc<Description> {
        self.inner.description()
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            self.meet.wait();
            self.inner.read(pos).await
        })
    }
}

/// Others still have several reads at once, and every place: no read that hangs keeps one.
#[test]
fn a_crowd_of_reads_that_hang_leaves_others_their_places_and_their_part() {
    const TOGETHER: usize = 4;
    // One source whose limit is larger than all that there is, and many with the limit of every source.
    for (sources, limit, pages) in [(1u16, Some(10_000), 600u32), (40, None, 8)] {
        let (mut loader, clock) = timed(8);
        let hung = Hung::new(How::Blocks);
        for number in 0..sources {
            match limit {
                Some(most) => loader.add_source(
                    texture(number),
                    Arc::new(LimitedSource::new(hung.clone(), ReadLimit::new(most))),
                ),
                None => loader.add_source(texture(number), hung.clone()),
            }
            (0..pages).for_each(|x| loader.request(of(number, x), 0));
        }
        // Until nothing new is begun, though every read has lent its place.
        let mut begun = 0;
        until("there is a crowd", || {
            clock.pass(A_WHILE / 10);
            assert!(loader.poll().is_none() && clock.now() < TIME_OUT / 2, "{} begun", hung.begun());
            let before = std::mem::replace(&mut begun, hung.begun());
            (before == begun && begun >= 256).then_some(())
        });
        let meet = std::sync::Barrier::new(TOGETHER);
        loader.add_source(texture(999), Arc::new(Together { inner: source(), meet }));
        (0..5 * TOGETHER as u32).for_each(|x| loader.request(of(999, x), 1));
        let step = Duration::from_millis(50);
        let others = ends(&mut loader, &clock, step, TIME_OUT / 4, 5 * TOGETHER);
        assert_eq!(tally(&others), [0, 0, 5 * TOGETHER]);
        assert!(hung.begun() <= 40 * 8, "{} threads hang", hung.begun());
        in_time("the loader is dropped", move || drop(loader));
        hung.answer();
    }
}

#[test]
fn a_texture_that_is_given_one_dead_source_after_the_other_costs_no_more_threads() {
    let (mut loader, clock) = timed(2);
    let first = Hung::new(How::Blocks);
    loader.add_source(texture(0), first.clone());
    (0..20).for_each(|x| loader.request(of(0, x), 0));
    assert!(hang(&mut loader, &clock, 2, 8, std::slice::from_ref(&first)).is_empty());
    let mut all = vec![first];
    for turn in 1..40 {
        // The same once more, or another one: as an application tries that has opened its file again.
        let again = all[all.len() - 1].clone();
        let hung = if turn % 2 == 1 { again } else { Hung::new(How::Blocks) };
        let before = hung.begun();
        loader.add_source(texture(0), hung.clone());
        // Reads that hang have lent their places by then.
        clock.pass(A_WHILE);
        while loader.poll().is_some() {}
        (0..20).for_each(|x| loader.request(of(0, x), 0));
        // Of the pages that nobody reads one is begun, or all fail.
        until("a read begins, or none may", || {
            (hung.begun() > before || loader.poll().is_some()).then_some(())
        });
        if turn % 3 == 0 {
            clock.pass(TIME_OUT);
            until("all requests end", || {
                clock.pass(A_WHILE); // a read may have begun since
                while loader.poll().is_some() {}
                (loader.outstanding() == 0).then_some(())
            });
        }
        all.push(hung);
        loader.remove_source(texture(0));
    }
    while loader.poll().is_some() {}
    all.dedup_by(|one, next| Arc::ptr_eq(one, next));
    let begun: usize = all.iter().map(|hung| hung.begun()).sum();
    assert!(
        (16..26).contains(&begun),
        "{begun}: twice as many as a source may have, and one after each pause"
    );
    // A source that answers is read after a pause, though none of them has come back,
    loader.add_source(texture(0), Arc::new(source()));
    until("it is tried", || {
        clock.pass(Duration::from_secs(8));
        loader.request(of(0, 3), 0);
        loader.wait().unwrap().result.ok()
    });
    (0..20).for_each(|x| loader.request(of(0, x), 0));
    assert_eq!(drain(&mut loader).len(), 20);
    // or as soon as one does.
    all.iter().for_each(|hung| hung.answer());
    loader.add_source(texture(0), Arc::new(source()));
    until("it is read", || {
        loader.request(of(0, 3), 0);
        loader.wait().unwrap().result.ok()
    });
    (0..20).for_each(|x| loader.request(of(0, x), 0));
    assert_eq!(drain(&mut loader).len(), 20);
}

#[test]
fn a_suspended_read_that_is_called_off_ends_without_its_source() {
    let (mut loader, _) = timed(1);
    let hung = Hung::new(How::Suspends);
    loader.add_source(texture(0), hung.clone());
    loader.request(of(0, 0), 0);
    until("it is begun", || (hung.begun() == 1).then_some(()));
    loader.cancel(of(0, 0));
    let end = in_time("it ends", move || loader.wait().unwrap());
    assert!(matches!(end.result, Err(LoadError::Cancelled)));
}

#[test]
fn waiting_ends_with_the_time_out() {
    for how in [How::Suspends, How::Blocks] {
        let settings = LoaderSettings { time_out: Duration::from_millis(20), ..LoaderSettings::default() };
        let mut loader = Loader::with(settings, Arc::new(crate::SystemClock::new())).unwrap();
        let hung = Hung::new(how);
        loader.add_source(texture(0), hung.clone());
        (0..30).for_each(|x| loader.request(of(0, x), 0));
        let (ends, loader) = in_time("all end", move || (drain(&mut loader), loader));
        assert_eq!(ends.len(), 30);
        assert!(ends.values().flatten().all(|end| end.contains("no answer within 20ms")), "{ends:?}");
        in_time("the loader is dropped", move || drop(loader));
        hung.answer();
    }
}

#[test]
fn without_threads_a_future_that_never_wakes_hinders_no_other() {
    let clock = Arc::new(FakeClock::default());
    let settings = LoaderSettings { reads_at_once: 3, time_out: TIME_OUT, ..LoaderSettings::default() };
    let mut loader = crate::LocalLoader::with(settings, clock.clone()).unwrap();
    let hung = Hung::new(How::Suspends);
    loader.add_source(texture(0), hung.clone());
    loader.add_source(texture(1), Arc::new(source()));
    (0..10).for_each(|x| loader.request(of(0, x), 0));
    (0..10).for_each(|x| loader.request(of(1, x), 1));
    let poll = |loader: &mut crate::LocalLoader| std::iter::from_fn(|| loader.poll()).collect::<Vec<_>>();
    assert_eq!(tally(&poll(&mut loader)), [0, 0, 10]);
    assert_eq!((hung.begun(), loader.outstanding()), (3, 10));
    clock.pass(TIME_OUT);
    assert_eq!(tally(&poll(&mut loader)), [3, 7, 0]);
    loader.request(of(0, 0), 0);
    assert_eq!(tally(&poll(&mut loader)), [0, 1, 0]);
    hung.answer();
    clock.pass(Duration::from_secs(1));
    loader.request(of(0, 0), 0);
    assert_eq!(tally(&poll(&mut loader)), [0, 0, 1]);
    (0..10).for_each(|x| loader.request(of(0, x), 0));
    assert_eq!(tally(&poll(&mut loader)), [0, 0, 10]);
}
