//! The upload budget: a token bucket, so that uploads are even and a budget below one tile still gets there.

/// Limits uploaded bytes: over any `n` frames at most `n * budget + max(one tile, 4 * budget)`.
///
/// ```
/// use vastex_core::UploadBucket;
/// let mut bucket = UploadBucket::new(100, 250); // less than half a tile per frame
/// assert!(bucket.take(250) && !bucket.take(250));
/// let waited = (1..10).find(|_| { bucket.begin_frame(); bucket.take(250) });
/// assert_eq!(waited, Some(1)); // 150 were left over, 100 came
/// ```
#[derive(Clone, Copy, Debug)]
pub struct UploadBucket {
    per_frame: u64,
    capacity: u64,
    tokens: u64,
}

impl UploadBucket {
    /// A full bucket for `per_frame` bytes a frame and tiles of at most `tile_bytes`.
    pub fn new(per_frame: u64, tile_bytes: u64) -> UploadBucket {
        let capacity = tile_bytes.max(per_frame.saturating_mul(4));
        UploadBucket { per_frame, capacity, tokens: capacity }
    }

    /// A frame begins: adds the frame's bytes, up to the bucket's capacity.
    pub fn begin_frame(&mut self) {
        self.tokens = self.tokens.saturating_add(self.per_frame).min(self.capacity);
    }

    /// Takes `bytes` if they are there.
    pub fn take(&mut self, bytes: u64) -> bool {
        let enough = self.tokens >= bytes;
        if enough {
            self.tokens -= bytes;
        }
        enough
    }

    /// Bytes that may be uploaded now.
    pub fn available(&self) -> u64 {
        self.tokens
    }
}
