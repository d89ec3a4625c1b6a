//! What a window shows, apart from any window (feature `egui`): surfaces, or a volume in their place, drawn
//! frame by frame by the same calls, and with the same things beside them ([`crate::beside`]).
//!
//! A host keeps a [`SurfaceScene`], which is there as long as the window, and a [`ShownVolume`] while one is
//! shown, and asks [`WindowScene`] for frames of whichever it is. Nothing here waits.
//!
//! A volume comes by [`ShownVolume::new`]; once it is there, the surfaces are told that they give way to it
//! ([`SurfaceScene::give_way`]), under the volume's name. Once [`SurfaceScene::show_preview`] or
//! [`SurfaceScene::show_source`] has displayed something again, the host drops the volume: surfaces are shown
//! only where there is none. After a lost device both are restored, surfaces first.
//!
//! For each frame a host calls [`WindowScene::begin_frame`]; then, unless that says that no frame is due,
//! [`WindowScene::show_panels`], [`WindowScene::record`], whose commands it submits with the panels over
//! them, [`WindowScene::end_frame`] and [`WindowScene::title`]; and in the end [`WindowScene::next_frame`],
//! whether or not a frame was due. Where that says that nobody is to see the next one,
//! [`WindowScene::draw_unseen`] takes the place of the others. What was read for a volume is handed to its
//! scene before a frame begins; what the scene asks for
//! ([`crate::volume_scene::VolumeScene::take_asked`]) is taken after the panels were shown, and where no
//! frame is due as well.

mod volume;
mod volume_panels;

use std::time::Duration;

use egui::Ui;
use glam::{DVec2, Vec4};
use vastex::Textures;
use vastex::diagnostics::FrameStats;

use crate::beside::Wake;
use crate::camera::Pose;
use crate::hud::HudChange;
use crate::input::Action;
use crate::panels::{Bookmark, PanelPainter};
use crate::stage::Target;
use crate::surface_scene::{DisplayError, MarkParts, PictureFormat, SurfaceScene};
pub use volume::{ShownVolume, VolumeToShow};

/// What a window shows at the moment.
pub enum WindowScene<'a> {
    /// Sources on surfaces, or nothing yet.
    Surfaces(&'a mut SurfaceScene),
    /// A volume, and the surfaces in whose place it is.
    Volume(&'a mut ShownVolume, &'a mut SurfaceScene),
}

impl WindowScene<'_> {
    /// A volume, if there is one, in the place of surfaces.
    pub fn of<'a>(surfaces: &'a mut SurfaceScene, volume: Option<&'a mut ShownVolume>) -> WindowScene<'a> {
        match volume {
            Some(volume) => WindowScene::Volume(volume, surfaces),
            None => WindowScene::Surfaces(surfaces),
        }
    }

    /// Name of what is shown, or of what is being opened where nothing is.
    pub fn name(&self) -> &str {
        match self {
            WindowScene::Surfaces(surfaces) | WindowScene::Volume(_, surfaces) => surfaces.name(),
        }
    }

    /// The textures that are shown.
    pub fn textures(&self) -> &Textures {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.textures(),
            WindowScene::Volume(volume, _) => volume.scene.textures(),
        }
    }

    /// A frame begins, of a camera at a pose; volumes have cameras of their own. `panels_are_due` says that
    /// egui wants to run. Returns false if nothing of the frame would be another than in the last one, which
    /// need not be drawn then. What the pictures of the window have to be is [`WindowScene::format`] from
    /// here on.
    pub fn begin_frame(
        &mut self,
        (pose, panels_are_due): (Pose, bool),
        painter: &mut PanelPainter,
    ) -> Result<bool, vastex::Error> {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.begin_frame(pose, painter).map(|()| true),
            WindowScene::Volume(volume, surfaces) => {
                volume.begin_frame(&mut surfaces.beside, panels_are_due, painter)
            }
        }
    }

    /// What the pictures of the window have to be; `None` if nothing is shown.
    pub fn format(&self) -> Option<&PictureFormat> {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.format(),
            WindowScene::Volume(volume, _) => Some(volume.format()),
        }
    }

    /// Shows the panel and what lies over the picture for the frame that comes, and displays what was changed
    /// in them. `recent` are paths of files that were opened lately, the last one first, `bookmarks` views of
    /// what is shown. The host has egui run what it is handed, once or several times, by `run`.
    pub fn show_panels(
        &mut self,
        pose: Pose,
        (recent, bookmarks): (&[String], &[Bookmark]),
        run: impl FnOnce(&mut dyn FnMut(&mut Ui)),
    ) {
        let kept = (recent, bookmarks);
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.show_panels(pose, kept, run),
            WindowScene::Volume(volume, surfaces) => volume.show_panels(&mut surfaces.beside, kept, run),
        }
    }

    /// Records what a camera at a pose sees into a target of the window's size, over nothing; the host draws
    /// the panels over that and submits it. `None` if there is nothing but panels: then what they leave free
    /// is of the colour [`WindowScene::ground`].
    pub fn record(
        &mut self,
        pose: Pose,
        target: &Target<'_>,
        mark: MarkParts<'_>,
    ) -> Result<Option<wgpu::CommandEncoder>, DisplayError> {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.record(pose, target, mark),
            // The pictures of a volume are drawn already; panels show them.
            WindowScene::Volume(..) => Ok(None),
        }
    }

    /// Returns true if the picture itself is recorded with each frame, so that times of its parts say
    /// something.
    pub fn is_recorded(&self) -> bool {
        matches!(self, WindowScene::Surfaces(surfaces) if !surfaces.is_empty())
    }

    /// What lies below panels where nothing is recorded, as light.
    pub fn ground(&self) -> Vec4 {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.beside.ground().beside(),
            WindowScene::Volume(..) => Vec4::W,
        }
    }

    /// The picture that was recorded is on its way.
    pub fn end_frame(&mut self) {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.end_frame(),
            WindowScene::Volume(volume, surfaces) => volume.end_frame(&mut surfaces.beside),
        }
    }

    /// Returns true if a source is shown, and not a preview of one that is being opened, or nothing.
    pub fn is_source(&self) -> bool {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.display().is_source(),
            WindowScene::Volume(..) => true,
        }
    }

    /// Returns true if the picture stays as it is: everything is there.
    pub fn is_settled(&self, stats: &FrameStats) -> bool {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.is_settled(stats),
            WindowScene::Volume(volume, _) => volume.scene.is_settled(),
        }
    }

    /// The title of the window after a frame, if it should change now.
    pub fn title(&mut self, stats: &FrameStats, pose: Pose) -> Option<&str> {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.title(stats, pose),
            WindowScene::Volume(volume, surfaces) => volume.title(&mut surfaces.beside, stats),
        }
    }

    /// The pointer is there, in pixels of the view, or not over it. Gives back the title of the window, if it
    /// is another.
    pub fn set_pointer(&mut self, pointer: Option<DVec2>, pose: Pose) -> Option<&str> {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.set_pointer(pointer, pose),
            // What is below the pointer is asked for where the event is heard; surfaces that come back know
            // where the pointer is.
            WindowScene::Volume(_, surfaces) => {
                surfaces.note_pointer(pointer);
                None
            }
        }
    }

    /// When the next frame is due. `awake` says that the view will change by itself, and `panels` in how long
    /// egui wants to run again.
    pub fn next_frame(&mut self, awake: bool, panels: Option<Duration>) -> Wake {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.next_frame(awake, panels),
            WindowScene::Volume(volume, surfaces) => {
                let beside = &mut surfaces.beside;
                let wake = if awake { Wake::Now } else { volume.next_frame(beside) };
                beside.next_frame(wake, panels, [])
            }
        }
    }

    /// Draws a frame that nobody sees, where [`WindowScene::next_frame`] says that one is due: of what is
    /// wanted, without its picture and without panels. When the next one is due is asked again afterwards.
    pub fn draw_unseen(&mut self, pose: Pose) -> Result<(), DisplayError> {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.draw_unseen(pose),
            // What need not be drawn of a volume is known when a frame of it begins.
            WindowScene::Volume(..) => Ok(()),
        }
    }

    /// Returns true if an action is of surfaces alone, and a volume is shown.
    pub fn ignores(&self, action: &Action) -> bool {
        matches!(self, WindowScene::Volume(..)) && !action.is_of_window()
    }

    /// Carries an action out if it is of what stands beside the picture: a frame is due then. Returns false
    /// if it is not.
    pub fn perform(&mut self, action: &Action) -> bool {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.beside.perform(action, false),
            // A line at the foot of a volume has its place whatever else is shown.
            WindowScene::Volume(_, surfaces) => surfaces.beside.perform(action, true),
        }
    }

    /// Changes how textures are sampled and kept, as the panel of what the machine does asks for. What cannot
    /// be is said, and stays as it was.
    pub fn change(&mut self, change: &HudChange) {
        match self {
            WindowScene::Surfaces(surfaces) => surfaces.change(change),
            WindowScene::Volume(volume, surfaces) => volume.change(&mut surfaces.beside, change),
        }
    }
}
