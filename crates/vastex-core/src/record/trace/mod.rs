//! Traces: what views wanted, frame after frame, to be replayed under any policy.
//!
//! A trace holds the shape of every texture, so that a page's ancestors can be walked, and the feedback of
//! every frame: its pages, their pixels and how sharply they are needed, and where the camera was. It does
//! not say what was loaded: that follows from a policy and a pool, and is [`replay()`](crate::replay())'s
//! business. [`Trace::to_bytes`] and [`Trace::from_bytes`] are the file format, which docs/traces.md
//! describes; reading and writing files is left to others.

mod codec;

use std::sync::Arc;

use crate::record::file::FileError;
use crate::texture::geometry::Geometry;
use crate::texture::page::TextureNumber;
use crate::texture::textures::Textures;
use crate::wanted::feedback::WantedPage;

/// What the views of a run wanted, frame after frame, to be replayed under any policy: the shape of every
/// texture, the pages of each frame with their pixels and how sharply they were needed, and where the camera
/// was. What was loaded is not in it. [`Trace::to_bytes`] and [`Trace::from_bytes`] are its file format
/// (docs/traces.md).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    geometries: Vec<Arc<Geometry>>,
    frames: Vec<Vec<WantedPage>>,
    /// Where the camera was in each frame, as far as that is known.
    places: Vec<Option<CameraPosition>>,
}

/// Where a camera is: its position, or any other three numbers that best say what it sees, such as longitude,
/// latitude and the logarithm of the height.
pub type CameraPosition = [f32; 3];

/// Why a frame or a texture cannot become part of a trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TraceRecordError {
    /// There are as many textures as a page id can tell apart.
    #[error("a trace holds at most {max} textures", max = TextureNumber::MAX as usize + 1)]
    TooManyTextures,
    /// A page is none of the trace's textures.
    #[error("entry {entry} of frame {frame} is no page of the trace's {textures} textures")]
    UnknownPage {
        /// The frame, counted from 0.
        frame: usize,
        /// The entry in the frame, counted from 0.
        entry: usize,
        /// Textures that the trace has.
        textures: usize,
    },
    /// The pages of a frame are not in ascending order, or one stands there twice.
    #[error("entry {entry} of frame {frame} is out of order; pages of a frame ascend and stand there once")]
    Order {
        /// The frame, counted from 0.
        frame: usize,
        /// The entry in the frame, counted from 0.
        entry: usize,
    },
}

/// Why bytes are no trace.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TraceError {
    /// The bytes do not begin with the letters of a trace.
    #[error(
        "not a trace: it does not begin with the letters VXTRACE; record one with `vastex render --record-trace`"
    )]
    NotATrace,
    /// The trace is of a version that is not read.
    #[error("a trace of version {0}, and this program reads versions {old} to {new}; record it again", old = codec::WITHOUT_PLACES, new = codec::VERSION)]
    Version(u32),
    /// The trace is damaged.
    #[error("the trace is damaged: {0}; copy or record it again")]
    Damaged(#[from] FileError),
    /// The parts do not fit one another.
    #[error("the trace is damaged before byte {at}: {error}; record it again")]
    Content {
        /// Where the part ends, in bytes from the beginning.
        at: usize,
        /// Why.
        error: TraceRecordError,
    },
}

impl Trace {
    /// A trace of no textures and no frames.
    pub fn new() -> Trace {
        Trace::default()
    }

    /// Adds a texture, under the next number.
    pub fn add_texture(
        &mut self,
        geometry: impl Into<Arc<Geometry>>,
    ) -> Result<TextureNumber, TraceRecordError> {
        let number = u16::try_from(self.geometries.len()).ok().and_then(TextureNumber::new);
        let texture = number.ok_or(TraceRecordError::TooManyTextures)?;
        self.geometries.push(geometry.into());
        Ok(texture)
    }

    /// Adds what a frame wanted: distinct pages of the trace's textures in ascending order, as feedback lists
    /// them.
    pub fn add_frame(&mut self, pages: impl Into<Vec<WantedPage>>) -> Result<(), TraceRecordError> {
        self.add(pages.into(), None)
    }

    /// Adds what a frame wanted, as [`Trace::add_frame`] does, and where the camera was; numbers that are
    /// none count as not known.
    pub fn add_frame_at(
        &mut self,
        pages: impl Into<Vec<WantedPage>>,
        place: CameraPosition,
    ) -> Result<(), TraceRecordError> {
        let is_known = place.iter().all(|coordinate| coordinate.is_finite());
        self.add(pages.into(), is_known.then_some(place))
    }

    fn add(&mut self, pages: Vec<WantedPage>, place: Option<CameraPosition>) -> Result<(), TraceRecordError> {
        let frame = self.frames.len();
        for (entry, wanted) in pages.iter().enumerate() {
            let geometry = self.geometries.get(usize::from(wanted.page.texture().number()));
            if !geometry.is_some_and(|geometry| geometry.contains(wanted.page.pos(geometry.dims()))) {
                return Err(TraceRecordError::UnknownPage { frame, entry, textures: self.geometries.len() });
            }
            if entry > 0 && pages[entry - 1].page >= wanted.page {
                return Err(TraceRecordError::Order { frame, entry });
            }
        }
        self.frames.push(pages);
        self.places.push(place);
        Ok(())
    }

    /// The shapes of the textures, by number.
    pub fn geometries(&self) -> &[Arc<Geometry>] {
        &self.geometries
    }

    /// What each frame wanted.
    pub fn frames(&self) -> &[Vec<WantedPage>] {
        &self.frames
    }

    /// Where the camera was in each frame, as far as that is known.
    pub fn camera_positions(&self) -> &[Option<CameraPosition>] {
        &self.places
    }

    /// The trace as a file's bytes: about 6 for each page of each frame.
    pub fn to_bytes(&self) -> Vec<u8> {
        codec::encode(self)
    }

    /// The trace that a file's bytes hold. Memory grows with what is read, not with what the bytes claim.
    pub fn from_bytes(bytes: &[u8]) -> Result<Trace, TraceError> {
        codec::decode(bytes)
    }

    pub(crate) fn textures(&self) -> Textures {
        let mut textures = Textures::default();
        for (number, geometry) in (0..).zip(&self.geometries) {
            if let Some(texture) = TextureNumber::new(number) {
                textures.add(texture, geometry.clone(), None);
            }
        }
        textures
    }
}
