//! What can go wrong on a GPU, by what the caller can do about it.

/// Why a GPU operation failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// The device is gone: unplugged, reset by its driver, or destroyed. Nothing made from it works any more;
    /// make a new device and build everything on it again.
    #[error(
        "the GPU device was lost; create a new device and rebuild everything that was made from the old one"
    )]
    DeviceLost,
    /// The pool does not fit the memory of the device.
    #[error("the GPU has no {bytes} bytes left for the pool; make the pool smaller")]
    OutOfMemory {
        /// Bytes asked for.
        bytes: u64,
    },
    /// The pool was laid out for a device with wider limits.
    #[error(
        "a pool of {images} images of {width}x{height} texels is beyond this device's {max_images} images of \
         {max_side} texels per side; lay it out with the limits of this device"
    )]
    PoolLimits {
        /// Texels along x of an image.
        width: u32,
        /// Texels along y of an image.
        height: u32,
        /// Images of the array.
        images: u32,
        /// Texels per side that the device allows.
        max_side: u32,
        /// Images that the device allows.
        max_images: u32,
    },
    /// The layers given do not add up to the pool's tiles.
    #[error("the layers of a tile of {texels} texels have {got} bytes, but the pool's slots have {expected}")]
    PoolFormats {
        /// Texels of a slot.
        texels: u64,
        /// Bytes of a tile of these layers.
        got: u64,
        /// Bytes of a slot by the pool's layout.
        expected: u64,
    },
    /// The device has no textures of a layer's format.
    #[error(
        "this device cannot decompress {format}; hold the layer decoded, or ask the device for TEXTURE_COMPRESSION_BC"
    )]
    Format {
        /// Name of the format.
        format: &'static str,
    },
    /// Labels are held by volumes alone.
    #[error(
        "a pool of images cannot hold {format}, which is of volumes alone; an image of labels is a volume one voxel deep"
    )]
    WholeNumbers {
        /// Name of the format.
        format: &'static str,
    },
    /// The device lacks what a mode of feedback needs.
    #[error(
        "this device cannot gather feedback in the mode \"{mode}\": it lacks compute shaders, or storage buffers in some stage; \
         \"raw\" needs neither"
    )]
    FeedbackMode {
        /// Name of the mode.
        mode: &'static str,
    },
    /// The page table of a texture is larger than a buffer that shaders may read.
    #[error(
        "a page table of {entries} entries takes {bytes} bytes, beyond this device's {max} bytes for a storage \
         buffer; use larger pages"
    )]
    TableTooLarge {
        /// Entries of the table.
        entries: u64,
        /// Bytes that the entries take.
        bytes: u64,
        /// Bytes that the device allows.
        max: u64,
    },
    /// A member of a group cannot have its name.
    #[error("a member of a group cannot be named {name:?}: {why}")]
    MemberName {
        /// The name.
        name: String,
        /// Why not.
        why: &'static str,
    },
    /// A group has more pools or layers than a shader can read.
    #[error(
        "a group of {layers} layers from {pools} pools: a shader on this device reads at most {max_pools} pools and {max_layers} layers, \
         less what is the application's own; build textures alike, so that they share a pool, or draw with two groups"
    )]
    GroupTooLarge {
        /// Pools of the group's textures.
        pools: usize,
        /// Layers that are members.
        layers: usize,
        /// Pools that the device allows.
        max_pools: usize,
        /// Layers that the device allows.
        max_layers: usize,
    },
    /// The device has no such bind group, or too few bindings in it.
    #[error(
        "shaders need {needed} bindings from {first} on in group {group}; this device has {max_groups} groups of {max_bindings} bindings: choose another \
         place in `Settings::binding`"
    )]
    BindingPlace {
        /// Index of the bind group that was asked for.
        group: u32,
        /// The first binding that was asked for.
        first: u32,
        /// Bindings that follow the first, it included.
        needed: u32,
        /// Bind groups that the device has.
        max_groups: u32,
        /// Bindings that each has.
        max_bindings: u32,
    },
    /// The picture is larger, or has fewer pixels, than a feedback target on this device can stand for.
    #[error("a feedback target of {width}x{height} pixels is beyond this device's {max} per side, or empty")]
    TargetSize {
        /// Pixels along x of the target.
        width: u32,
        /// Pixels along y of the target.
        height: u32,
        /// Pixels per side that the device allows.
        max: u32,
    },
    /// A tile has another number of bytes than a slot.
    #[error("a tile of {got} bytes does not fit the slots of {expected} bytes")]
    TileBytes {
        /// Bytes of the tile.
        got: u64,
        /// Bytes of a slot.
        expected: u64,
    },
    /// There is no such slot in the pool.
    #[error("slot {slot} is beyond the pool's {slots}")]
    NoSuchSlot {
        /// The slot.
        slot: u32,
        /// Slots of the pool.
        slots: u32,
    },
    /// Feedback of this frame was never recorded, is already collected, or was recorded into commands that
    /// were not submitted.
    #[error("no feedback of frame {frame} is under way; submit the frame's commands before waiting for it")]
    NoFeedback {
        /// The frame.
        frame: u64,
    },
}
