//! Surveys: what a view wants, from geometry alone, without a feedback pass.
//!
//! A [`Survey`] is told of each textured surface in the world and gives what feedback gives: pages, how
//! sharply they are needed and over how many pixels. It knows nothing of what hides what, so it wants more
//! than is shown; in return it sees what is hidden, behind the camera or beside the picture, and it is never
//! late. Of two kinds:
//!
//! | kind | knows of a surface | wants |
//! |---|---|---|
//! | [`Survey::surface`] | where each rectangle of its texture lies ([`Surface`]) | each part at its own level, by a walk down the quadtree of pages |
//! | [`Survey::object`] | a sphere around it, and how densely texels lie on it | all of it at the level of its nearest point |
//!
//! A third kind is drawn by the GPU, in texture space, and becomes pages here ([`LevelImage`]). What is seen
//! can feed a pager as feedback does ([`Pager::observe`](crate::Pager::observe)), what is not seen as a
//! prediction ([`Pager::expect`](crate::Pager::expect)).

mod camera;
mod levels;
mod look;
mod object;
mod surface;
mod walk;

pub use camera::Camera;
pub use levels::LevelImage;
pub use object::SurveyedObject;
pub use surface::{FlatSurface, GlobeSurface, Patch, Surface, UvBox};

use crate::texture::geometry::Geometry;
use crate::texture::level_rule::LevelRule;
use crate::texture::page::{Dims, PagePos, TextureNumber};
use crate::wanted::feedback::Feedback;
use look::Footprint;
use walk::{Found, walk};

/// A texture, as a survey needs it.
#[derive(Clone, Copy, Debug)]
pub struct SurveyedTexture<'a> {
    /// The texture's number in page ids.
    pub number: TextureNumber,
    /// The texture's shape. Of a volume nothing is wanted.
    pub geometry: &'a Geometry,
    /// How the texture's levels are chosen.
    pub rule: LevelRule,
}

impl<'a> SurveyedTexture<'a> {
    /// A texture whose levels are chosen as they are needed.
    pub fn new(number: TextureNumber, geometry: &'a Geometry) -> SurveyedTexture<'a> {
        SurveyedTexture { number, geometry, rule: LevelRule::default() }
    }

    fn ruled(&self, look: Footprint) -> Footprint {
        let LevelRule { bias, finest, coarsest } = self.rule.within(self.geometry);
        let lambda = look.lambda + f64::from(bias);
        Footprint { lambda: lambda.max(f64::from(finest)).min(f64::from(coarsest)), ..look }
    }
}

/// How far a survey goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurveySettings {
    /// Levels by which surfaces behind the camera, beside the picture or turned away may be coarser than if
    /// they were seen; `None` to want nothing of them.
    pub unseen: Option<f32>,
    /// Pages that one surface or object may want at most; the finest are left out. Bounds what a survey
    /// costs: about 0.2 us for each page visited.
    pub max_pages: usize,
}

impl Default for SurveySettings {
    /// Only what is seen, and 4096 pages.
    fn default() -> SurveySettings {
        SurveySettings { unseen: None, max_pages: 4096 }
    }
}

/// What a survey has found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Surveyed {
    /// Pages that the view wants; more than it shows if one thing hides another.
    pub seen: Feedback,
    /// What the view would want if it turned, or if surfaces that are turned away were not.
    pub unseen: Feedback,
}

/// Finds what a view wants from geometry alone, without a feedback pass.
///
/// The application tells a survey each textured surface ([`Survey::surface`]) or object ([`Survey::object`]),
/// and gets what feedback gives: pages, how sharply they are needed and over how many pixels. A survey does
/// not know what hides what, so it wants more than is shown, and it is never late.
#[derive(Clone, Debug)]
pub struct Survey {
    camera: Camera,
    settings: SurveySettings,
    found: Found,
}

impl Survey {
    /// Begins the survey of a view.
    pub fn new(camera: Camera, settings: SurveySettings) -> Survey {
        Survey { camera, settings, found: Found::default() }
    }

    /// Adds a surface with all of a texture on it. No point of it that is seen is wanted less sharply than
    /// feedback would, to within an eighth or two of a level; most are wanted a little more sharply.
    pub fn surface(&mut self, texture: SurveyedTexture<'_>, surface: &dyn Surface) {
        let geometry = texture.geometry;
        if geometry.dims() == Dims::D3 {
            return;
        }
        let size = [0, 1].map(|axis| f64::from(geometry.size()[axis]));
        let (camera, settings) = (self.camera, self.settings);
        walk(texture.number, geometry, settings.max_pages, &mut self.found, |uv| {
            let look = settings.reached(camera.look(surface, uv, size))?;
            Some(texture.ruled(look))
        });
    }

    /// Adds an object that shows a region of a texture: all of it at the level that the nearest point of its
    /// sphere needs or, where that would be more than [`SurveySettings::max_pages`], at the finest level that
    /// is not.
    pub fn object(&mut self, texture: SurveyedTexture<'_>, object: &SurveyedObject) {
        let geometry = texture.geometry;
        let Some(look) = self.settings.reached(self.camera.look_at_object(object)) else { return };
        if geometry.dims() == Dims::D3 {
            return;
        }
        let look = texture.ruled(look);
        let tail = geometry.tail().first_level();
        let mut level = (look.lambda as u8).min(tail);
        while level < tail && pages_at(geometry, level, &object.uv).1 > self.settings.max_pages as u64 {
            level += 1;
        }
        let lambda = look.lambda.max(f64::from(level));
        if level == tail {
            self.found.add(texture.number, geometry, geometry.tail_pos(), Footprint { lambda, ..look });
            return;
        }
        let ([first, end], count) = pages_at(geometry, level, &object.uv);
        let look = Footprint { lambda, pixels: look.pixels / count as f64, ..look };
        for (y, x) in (first[1]..end[1]).flat_map(|y| (first[0]..end[0]).map(move |x| (y, x))) {
            self.found.add(texture.number, geometry, PagePos::new_2d(level, x, y), look);
        }
    }

    /// What was found, as the feedback of a frame.
    pub fn finish(self, frame: u64) -> Surveyed {
        let Found { seen, mut unseen } = self.found;
        let seen = Feedback::of_pages(frame, seen);
        unseen.retain(|wanted| seen.pages.binary_search_by_key(&wanted.page, |seen| seen.page).is_err());
        Surveyed { seen, unseen: Feedback::of_pages(frame, unseen) }
    }
}

impl SurveySettings {
    /// What is wanted of what was looked at.
    fn reached(&self, look: Footprint) -> Option<Footprint> {
        match self.unseen {
            _ if look.is_seen => Some(look),
            Some(coarser) => Some(Footprint { lambda: look.lambda + f64::from(coarser), ..look }),
            None => None,
        }
    }
}

/// The pages of a level that overlap a region: the first, the one past the last, and how many they are.
fn pages_at(geometry: &Geometry, level: u8, uv: &UvBox) -> ([[u32; 2]; 2], u64) {
    let (scale, pages) = (geometry.level(level).scale, geometry.level(level).pages);
    let page = |axis: usize, uv: f64| {
        uv * f64::from(geometry.size()[axis]) / (f64::from(geometry.page()[axis]) * scale[axis] as f64)
    };
    let first = [0, 1].map(|axis| (page(axis, uv[0][axis]) as u32).min(pages[axis] - 1));
    let end = [0, 1].map(|axis| (page(axis, uv[1][axis]).ceil() as u32).clamp(first[axis] + 1, pages[axis]));
    ([first, end], u64::from(end[0] - first[0]) * u64::from(end[1] - first[1]))
}

#[cfg(test)]
mod tests;
