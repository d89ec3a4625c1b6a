//! Constants that Rust and WGSL share: defined here once, and generated into every shader from [`WGSL`].
//!
//! What a field is for stands where it is used: [`PageId`](crate::PageId) and
//! [`TableEntry`](crate::TableEntry).

/// Bits of one page coordinate of an image.
pub const COORD_BITS_2D: u32 = 24;
/// Bits of one page coordinate of a volume.
pub const COORD_BITS_3D: u32 = 16;
/// Bits of a level in a page id and in a table entry.
pub const LEVEL_BITS: u32 = 5;
/// Where the level begins in a page id.
pub const LEVEL_SHIFT: u32 = 48;
/// Bits of a texture's number in a page id.
pub const TEXTURE_BITS: u32 = 11;
/// Where the texture's number begins in a page id.
pub const TEXTURE_SHIFT: u32 = 53;
/// Bits of a slot in a table entry; the level stands above them.
pub const ENTRY_SLOT_BITS: u32 = 27;
/// Slots that a pool can have: so many that shaders find a slot's place in single precision.
pub const POOL_SLOTS: u32 = 1 << 22;
/// Steps into which feedback divides a level.
pub const STEPS_PER_LEVEL: u32 = 8;
/// Bits of such a step.
pub const STEP_BITS: u32 = 3;
/// As how many pixels a feedback pixel counts at most: one less stands above the eighth.
pub const MOST_WEIGHT: u32 = 16;
/// Side of the block of full-resolution pixels that one feedback pixel stands for.
pub const FEEDBACK_SCALE: u32 = 8;
/// Frames after which the feedback pass has looked at every one of its sample positions.
pub const JITTER_CYCLE: u32 = 16;
/// Bricks that a ray asks for in one frame at most: a feedback target of so many rows is as high as the
/// picture.
pub const RAY_ANSWERS: u32 = 8;
/// Jitter cycles of a view at most, until each of its rays has asked for every brick that it meets: as many
/// as the working set can count the feedbacks of in 8 bits.
pub const RAY_TURNS: u32 = u8::MAX as u32 / JITTER_CYCLE;
/// Bricks of a ray that a feedback pixel counts at most.
pub const RAY_BRICKS: u32 = 4096;
/// Levels that a texture can have.
pub const MAX_LEVELS: u32 = 32;
/// Feedback flag: the pixel shows no virtual texture.
pub const FEEDBACK_EMPTY: u32 = 0;
/// Feedback flag: the pixel wants the page that it names.
pub const FEEDBACK_WANTED: u32 = 1;
/// Feedback flag: the pixel's gradients are zero, infinite or no numbers, so it wants nothing.
pub const FEEDBACK_DEGENERATE: u32 = 2;
/// In texture space, what says level 0 with nothing into it; each eighth of a level coarser is one less, and
/// 0 is not seen.
pub const TEXTURE_SPACE_FINEST: u32 = 255;
/// Texels of level 0 that a place in fixed point may be from its anchor, either way.
pub const FIXED_REACH: u32 = 1 << 30;
/// Places of a hashed page table that a page is looked for in at most.
pub const HASHED_PROBES: u32 = 32;
/// Buckets that a hashed page table has at least, as a power of two.
pub const HASHED_FEWEST_BITS: u32 = 10;
/// Factors by which the hash of a page mixes its bits: odd, with about as many ones as zeros.
pub const HASH_LOW: u32 = 0x9e37_79b1;
/// See [`HASH_LOW`].
pub const HASH_HIGH: u32 = 0x85eb_ca6b;
/// See [`HASH_LOW`].
pub const HASH_LAST: u32 = 0xc2b2_ae35;
/// Threads of one workgroup of every compute shader.
pub const WORKGROUP: u32 = 64;

/// The constants that shaders use, as (name, value), for the generator of shader text.
pub const WGSL: &[(&str, u32)] = &[
    ("COORD_BITS_2D", COORD_BITS_2D),
    ("COORD_BITS_3D", COORD_BITS_3D),
    ("LEVEL_BITS", LEVEL_BITS),
    ("LEVEL_SHIFT", LEVEL_SHIFT),
    ("TEXTURE_BITS", TEXTURE_BITS),
    ("TEXTURE_SHIFT", TEXTURE_SHIFT),
    ("ENTRY_SLOT_BITS", ENTRY_SLOT_BITS),
    ("STEPS_PER_LEVEL", STEPS_PER_LEVEL),
    ("STEP_BITS", STEP_BITS),
    ("MOST_WEIGHT", MOST_WEIGHT),
    ("FEEDBACK_SCALE", FEEDBACK_SCALE),
    ("JITTER_CYCLE", JITTER_CYCLE),
    ("RAY_BRICKS", RAY_BRICKS),
    ("MAX_LEVELS", MAX_LEVELS),
    ("FEEDBACK_EMPTY", FEEDBACK_EMPTY),
    ("FEEDBACK_WANTED", FEEDBACK_WANTED),
    ("FEEDBACK_DEGENERATE", FEEDBACK_DEGENERATE),
    ("TEXTURE_SPACE_FINEST", TEXTURE_SPACE_FINEST),
    ("FIXED_REACH", FIXED_REACH),
    ("HASHED_PROBES", HASHED_PROBES),
    ("HASHED_FEWEST_BITS", HASHED_FEWEST_BITS),
    ("HASH_LOW", HASH_LOW),
    ("HASH_HIGH", HASH_HIGH),
    ("HASH_LAST", HASH_LAST),
    ("WORKGROUP", WORKGROUP),
];
