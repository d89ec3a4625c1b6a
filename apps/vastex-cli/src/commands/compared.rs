//! What `--compare` adds to what `vastex render` prints, of images and of volumes.

use serde::Serialize;
use vastex_scenes::Comparison;

use crate::report;

/// How alike a picture is to one that an ordinary texture gives. Scripts rely on these names.
#[derive(Serialize)]
pub(crate) struct Compared {
    psnr_db: f64,
    /// In steps of 1/255.
    max_error: u8,
    share_within_1_255: f64,
    share_beyond_3_255: f64,
    /// What drew the picture to compare with.
    reference: &'static str,
    /// Levels by which that picture is coarser than what is wanted: the mip bias, which is in force in both.
    reference_mip_bias: f64,
}

impl Compared {
    /// Of a comparison with what `reference` drew, `mip_bias` levels coarser than what is wanted.
    pub(super) fn new(comparison: &Comparison, reference: &'static str, mip_bias: f64) -> Compared {
        Compared {
            psnr_db: comparison.psnr_db,
            max_error: comparison.max_error,
            share_within_1_255: comparison.share_within_1_255,
            share_beyond_3_255: comparison.share_beyond_3_255,
            reference,
            reference_mip_bias: mip_bias,
        }
    }

    /// A line for people.
    pub(super) fn text(&self) -> String {
        let Compared { psnr_db, max_error, share_within_1_255, reference, reference_mip_bias, .. } = self;
        let within = report::percent(*share_within_1_255);
        let biased = match *reference_mip_bias {
            0.0 => String::new(),
            bias => format!(", drawn {bias} levels coarser than wanted as well"),
        };
        format!(
            "beside an ordinary texture ({reference}{biased}): {psnr_db:.1} dB, {within} within 1/255, largest error \
             {max_error}/255"
        )
    }
}
