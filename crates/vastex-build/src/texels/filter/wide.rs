//! The means of sRGB colours that [`super::quad`] makes texel by texel, eight texels at a time where the
//! processor looks up 64 bytes at once (AVX-512 VBMI): the same bytes, in a third of the time.
//!
//! Light of 16 bits is looked up as two bytes, and each is summed by itself: 256 times the sum of four upper
//! bytes is a multiple of four, so the mean is 64 times that sum, and a quarter of the sum of the lower ones,
//! rounded. Both fit into 16 bits together. Only opaque texels are made here, whose colours all weigh the
//! same; encoding a mean stays a look-up for each of them.

use std::arch::x86_64::{
    __m512i, _mm512_add_epi16, _mm512_and_si512, _mm512_cmpeq_epi8_mask, _mm512_mask_blend_epi8,
    _mm512_movepi8_mask, _mm512_or_si512, _mm512_permutex2var_epi8, _mm512_set1_epi16, _mm512_set1_epi64,
    _mm512_slli_epi16, _mm512_slli_epi64, _mm512_srli_epi16, _mm512_srli_epi64,
};
use std::sync::LazyLock;

use crate::texels::srgb::SRGB;

/// Texels of the coarser level that are made at once, and their bytes.
const TEXELS: usize = 8;
const BYTES: usize = 4 * TEXELS;
/// Which of 64 bytes are alphas.
const ALPHAS: u64 = 0x8888_8888_8888_8888;

/// The lower bytes of the light of each stored value, 64 values at a time, then the upper ones.
static LIGHT: LazyLock<[[[u8; 64]; 4]; 2]> = LazyLock::new(|| {
    std::array::from_fn(|byte| {
        std::array::from_fn(|part| {
            std::array::from_fn(|i| SRGB.linear_from_srgb[64 * part + i].to_le_bytes()[byte])
        })
    })
});

/// Fills a row with the means of 2x2 texels, as [`super::quad`] says, and returns true; `false`, with nothing
/// done, where the processor has no such instructions. `one_by_one` makes the means of texels that are not
/// opaque, and those at the end of the row.
pub(super) fn srgb_means(
    coarse: &mut [u8],
    upper: &[u8],
    lower: &[u8],
    one_by_one: impl Fn(&mut [u8], &[u8], &[u8]),
) -> bool {
    if !(is_x86_feature_detected!("avx512bw") && is_x86_feature_detected!("avx512vbmi")) {
        return false;
    }
    #[expect(unsafe_code, reason = "what names the instructions of a processor is unsafe to call")]
    // SAFETY: the processor has them.
    unsafe {
        row(coarse, upper, lower, one_by_one);
    }
    true
}

#[target_feature(enable = "avx512bw,avx512vbmi")]
fn row(coarse: &mut [u8], upper: &[u8], lower: &[u8], one_by_one: impl Fn(&mut [u8], &[u8], &[u8])) {
    let light = LIGHT.each_ref().map(|byte| byte.map(vector));
    let encoded = &*SRGB.srgb_from_linear;
    let (eights, rest) = coarse.as_chunks_mut::<BYTES>();
    let ((upper, rest_upper), (lower, rest_lower)) =
        (upper.as_chunks::<{ 2 * BYTES }>(), lower.as_chunks::<{ 2 * BYTES }>());
    for (to, (upper, lower)) in eights.iter_mut().zip(upper.iter().zip(lower)) {
        let (a, b) = (vector(*upper), vector(*lower));
        let opaque = _mm512_cmpeq_epi8_mask(_mm512_and_si512(a, b), _mm512_set1_epi64(-1));
        if opaque & ALPHAS != ALPHAS {
            one_by_one(to, upper, lower);
            continue;
        }
        for (to, means) in to.as_chunks_mut::<4>().0.iter_mut().zip(words(means(&light, a, b))) {
            let value = |at: u32| u32::from(encoded[usize::from((means >> at) as u16)]);
            *to = (value(0) | value(32) << 8 | value(16) << 16 | 0xff << 24).to_le_bytes();
        }
    }
    // Of the finer rows as much as belongs to the rest of the coarser one.
    one_by_one(rest, rest_upper, rest_lower);
}

/// The light of the means of 2x2 texels, 16 bits each: those of one texel in a word of 64 bits, red, blue,
/// green and alpha.
#[target_feature(enable = "avx512bw,avx512vbmi")]
fn means(light: &[[__m512i; 4]; 2], upper: __m512i, lower: __m512i) -> __m512i {
    let sums = |table: &[__m512i; 4]| sums(look_up(table, upper), look_up(table, lower));
    let [low, high] = [sums(&light[0]), sums(&light[1])];
    let mean = |i: usize| {
        let rounded = _mm512_srli_epi16::<2>(_mm512_add_epi16(low[i], _mm512_set1_epi16(2)));
        _mm512_add_epi16(_mm512_slli_epi16::<6>(high[i]), rounded)
    };
    let in_lower_half = _mm512_set1_epi64(0xffff_ffff);
    _mm512_or_si512(_mm512_and_si512(mean(0), in_lower_half), _mm512_slli_epi64::<32>(mean(1)))
}

/// The sums of four bytes, of two texels and the two below them, 16 bits each: in the lower half of each word
/// of 64 bits those of the first and third channel, and those of the second and fourth.
#[target_feature(enable = "avx512bw")]
fn sums(upper: __m512i, lower: __m512i) -> [__m512i; 2] {
    let even = |bytes| _mm512_and_si512(bytes, _mm512_set1_epi16(0xff));
    let both = [
        _mm512_add_epi16(even(upper), even(lower)),
        _mm512_add_epi16(_mm512_srli_epi16::<8>(upper), _mm512_srli_epi16::<8>(lower)),
    ];
    both.map(|two| _mm512_add_epi16(two, _mm512_srli_epi64::<32>(two)))
}

/// What a table of 256 bytes has for each of 64.
#[target_feature(enable = "avx512bw,avx512vbmi")]
fn look_up([a, b, c, d]: &[__m512i; 4], bytes: __m512i) -> __m512i {
    let (first, second) = (_mm512_permutex2var_epi8(*a, bytes, *b), _mm512_permutex2var_epi8(*c, bytes, *d));
    _mm512_mask_blend_epi8(_mm512_movepi8_mask(bytes), first, second)
}

#[expect(unsafe_code, reason = "the safe way takes the bytes one by one")]
fn vector(bytes: [u8; 64]) -> __m512i {
    // SAFETY: both are 64 bytes, any of which make a vector.
    unsafe { std::mem::transmute(bytes) }
}

#[expect(unsafe_code, reason = "the safe way takes the words one by one")]
fn words(vector: __m512i) -> [u64; TEXELS] {
    // SAFETY: both are 64 bytes, any of which make words.
    unsafe { std::mem::transmute(vector) }
}
