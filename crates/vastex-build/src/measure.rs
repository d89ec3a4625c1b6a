//! Measuring the pipeline and not the encoders: builds whose encoder is another one, for tests and for
//! `examples/encoders_at_work.rs`.

use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use vastex_core::LayerFormat;

use crate::texels::blocks::{Lost, Quality, SIDE, Strip, with_encoder};
use crate::{BuildError, BuildOptions, LayerInput, build};

/// Texels that [`slow`] encodes in a second: as many as the slowest of the real encoders.
const TEXELS_PER_SECOND: f64 = 7e6;

/// What the slow encoder has done since it was last asked.
static DONE: Mutex<Option<Done>> = Mutex::new(None);

struct Done {
    /// When the first strip was begun, and the last one finished.
    from: Instant,
    to: Instant,
    /// The time that all strips took, each by itself.
    all: Duration,
}

/// Sleeps for as long as a slow encoder takes, so that as many can be at work at once as there are threads,
/// however few processors there are. All blocks are zero.
fn slow(format: LayerFormat, _: Quality, strip: &Strip<'_>, blocks: &mut Vec<u8>) -> Lost {
    let from = Instant::now();
    let texels = strip.row_bytes() / format.texel_bytes();
    std::thread::sleep(Duration::from_secs_f64((texels * SIDE) as f64 / TEXELS_PER_SECOND));
    blocks.resize(blocks.len() + texels / SIDE * format.block_bytes(), 0);
    let to = Instant::now();
    let mut done = DONE.lock().unwrap_or_else(PoisonError::into_inner);
    let done = done.get_or_insert(Done { from, to, all: Duration::ZERO });
    (done.from, done.to) = (done.from.min(from), done.to.max(to));
    done.all += to - from;
    Lost::default()
}

/// How many encoders were at work at once, as the mean from the first strip to the last, when an image is
/// built in blocks by so many threads. One measurement at a time.
pub fn encoders_at_work(image: &Path, output: &Path, page: u32, threads: usize) -> Result<f64, BuildError> {
    let take = || DONE.lock().unwrap_or_else(PoisonError::into_inner).take();
    take();
    let input = LayerInput { format: Some(LayerFormat::Bc7Srgb), ..LayerInput::from(image) };
    let options = BuildOptions { page, threads, ..BuildOptions::default() };
    with_encoder(slow, || build(&[input], output, &options, &()))?;
    Ok(take().map_or(0.0, |done| done.all.as_secs_f64() / (done.to - done.from).as_secs_f64()))
}

#[cfg(test)]
mod tests {
    use std::sync::Condvar;

    use super::*;

    const THREADS: usize = 4;
    /// How long an encoder waits for the others, where they never come.
    const PATIENCE: Duration = Duration::from_secs(240);

    /// Encoders at work, the most that ever were, and whether somebody has lost patience.
    static AT_WORK: Mutex<(usize, usize, bool)> = Mutex::new((0, 0, false));
    static CAME: Condvar = Condvar::new();

    /// Stays until as many have been here at once as there are threads.
    fn sociable(format: LayerFormat, _: Quality, strip: &Strip<'_>, blocks: &mut Vec<u8>) -> Lost {
        let mut at_work = AT_WORK.lock().unwrap();
        at_work.0 += 1;
        at_work.1 = at_work.1.max(at_work.0);
        CAME.notify_all();
        let alone = |(_, most, given_up): &mut (usize, usize, bool)| *most < THREADS && !*given_up;
        let (mut at_work, waited) = CAME.wait_timeout_while(at_work, PATIENCE, alone).unwrap();
        at_work.0 -= 1;
        at_work.2 |= waited.timed_out();
        drop(at_work);
        let texels = strip.row_bytes() / format.texel_bytes();
        blocks.resize(blocks.len() + texels / SIDE * format.block_bytes(), 0);
        Lost::default()
    }

    #[test]
    fn every_thread_encodes_at_once_whatever_the_page() {
        let dir = tempfile::tempdir().unwrap();
        let image = dir.path().join("image.raw");
        let texels: Vec<u8> = (0..2048u32 * 512).map(|i| (i.wrapping_mul(i) >> 7) as u8).collect();
        std::fs::write(&image, texels).unwrap();
        let description = "width = 2048\nheight = 512\nsample = \"u8\"\n";
        std::fs::write(dir.path().join("image.raw.toml"), description).unwrap();
        for page in [128, 256, 512] {
            *AT_WORK.lock().unwrap() = (0, 0, false);
            let input = LayerInput { format: Some(LayerFormat::Bc4), ..LayerInput::from(&image) };
            let options = BuildOptions { page, threads: THREADS, ..BuildOptions::default() };
            let output = dir.path().join("image.vastex");
            with_encoder(sociable, || build(&[input], &output, &options, &())).unwrap();
            assert_eq!(AT_WORK.lock().unwrap().1, THREADS, "pages of {page}");
        }
    }
}
