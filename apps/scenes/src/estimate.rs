//! What the scenes report of their surfaces, so that what a view wants can be estimated without a feedback
//! pass.

use vastex::Textures;
use vastex::survey::{
    Camera, FlatSurface, GlobeSurface, Surface, Survey, SurveySettings, Surveyed, SurveyedObject,
    SurveyedTexture,
};

use vastex_viewer::Pose;
use vastex_viewer::Scene;
use vastex_viewer::SceneRenderer;

/// A way to know what a view wants without a feedback pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Estimate {
    /// The surface as a grid of objects, each at the level of its nearest point.
    Distance,
    /// A walk down the quadtree of the texture's pages.
    Quadtree,
    /// The level drawn in texture space, by the GPU.
    TextureSpace,
}

impl Estimate {
    /// Every way.
    pub const ALL: [Estimate; 3] = [Estimate::Distance, Estimate::Quadtree, Estimate::TextureSpace];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Estimate::Distance => "distance",
            Estimate::Quadtree => "quadtree",
            Estimate::TextureSpace => "texture-space",
        }
    }

    /// What a view of so many pixels wants of a scene's only texture, by the surfaces' ideal shapes; `None`
    /// if that is not for the CPU to say.
    pub fn of_view(
        self,
        scene: Scene,
        pose: &Pose,
        texture: SurveyedTexture<'_>,
        picture: [u32; 2],
        settings: SurveySettings,
        frame: u64,
    ) -> Option<Surveyed> {
        let [width, height, _] = texture.geometry.size();
        let image = f64::from(width) / f64::from(height);
        let matrix = pose.clip_from_world(f64::from(picture[0]) / f64::from(picture[1]), image);
        let mut survey = Survey::new(Camera::new(matrix.to_cols_array_2d(), picture), settings);
        let surface = surface(scene, image);
        match self {
            Estimate::Quadtree => survey.surface(texture, &*surface),
            Estimate::TextureSpace => return None,
            Estimate::Distance => {
                for object in SurveyedObject::grid(&*surface, [width, height], OBJECTS) {
                    survey.object(texture, &object);
                }
            }
        }
        Some(survey.finish(frame))
    }
}

/// How an [`Offscreen`](crate::Offscreen) estimates what its views want.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimating {
    /// In which way.
    pub estimate: Estimate,
    /// Beside feedback, as a prediction, rather than in its place.
    pub beside: bool,
    /// How far it goes; what is not seen is expected.
    pub settings: SurveySettings,
}

impl Estimating {
    /// Tells the textures what the view of this frame wants; in texture space, what it wanted two frames ago.
    pub(crate) fn report(
        &self,
        textures: &mut Textures,
        encoder: &mut wgpu::CommandEncoder,
        renderer: &SceneRenderer,
        pose: &Pose,
        picture: [u32; 2],
    ) -> Result<(), vastex::Error> {
        let (settings, layer) = (self.settings, renderer.layer());
        let texture = textures.texture(layer.texture())?.surveyed();
        let frame = textures.inspect().frame();
        let mut found = self.estimate.of_view(renderer.scene(), pose, texture, picture, settings, frame);
        if self.estimate == Estimate::TextureSpace {
            let seen =
                textures.ahead().texture_space(encoder, layer.texture(), settings, |pass, groups| {
                    if let Some(group) = groups.get(layer) {
                        renderer.draw_spread(pass, group);
                    }
                })?;
            found = seen.map(|seen| Surveyed { seen, ..Surveyed::default() });
        }
        found.into_iter().try_for_each(|found| self.hand_over(textures, found))
    }

    fn hand_over(
        &self,
        textures: &mut Textures,
        Surveyed { seen, unseen }: Surveyed,
    ) -> Result<(), vastex::Error> {
        if self.beside {
            textures.ahead().expect(&seen);
        } else {
            textures.view_mut(vastex::ViewId::MAIN)?.want(seen);
        }
        if !unseen.pages.is_empty() {
            textures.ahead().expect(&unseen);
        }
        Ok(())
    }
}

/// Columns and rows of objects that a surface is cut into.
const OBJECTS: [u32; 2] = [64, 32];

/// The surface of a scene, for an image of `image` (width over height).
fn surface(scene: Scene, image: f64) -> Box<dyn Surface> {
    match scene {
        Scene::Image | Scene::Plane | Scene::Terrain => {
            Box::new(FlatSurface::new([-1.0, 1.0 / image, 0.0], [[2.0, 0.0, 0.0], [0.0, -2.0 / image, 0.0]]))
        }
        Scene::Globe | Scene::Planet => Box::new(GlobeSurface::sphere([0.0; 3], 1.0)),
    }
}
