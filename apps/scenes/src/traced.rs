//! Traces of the camera paths, without a GPU: what each frame of a path wants, from where its pixels meet the
//! surface.
//!
//! The surfaces are the ideal ones, not their triangles; what is wanted where follows by the twins of the
//! shaders.

use glam::{Mat4, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

use vastex::prefetch::Trace;
use vastex::{CpuFeedback, Geometry};

use vastex_viewer::Path;
use vastex_viewer::Scene;

/// The trace of a path from its first frame to its last, over one texture, for pictures of so many pixels.
///
/// Costs about 0.1 ms for every 1,000 pixels of a picture in each frame, a 64th of which are looked at.
pub fn trace_of(scene: Scene, path: Path, geometry: &Geometry, picture: [u32; 2]) -> Trace {
    trace_of_every(1, scene, path, geometry, picture)
}

/// The trace of the first frame of a path and of every so-many-th after it, as [`trace_of`] makes them.
///
/// # Panics
///
/// If every 0th frame is asked for.
pub fn trace_of_every(nth: usize, scene: Scene, path: Path, geometry: &Geometry, picture: [u32; 2]) -> Trace {
    let mut trace = Trace::new();
    let Ok(texture) = trace.add_texture(geometry.clone()) else { return trace };
    let mut feedback = CpuFeedback::new(geometry, texture);
    let [width, height, _] = geometry.size().map(|side| side as f32);
    let [columns, rows] = picture.map(|side| side as f32);
    for frame in (0..path.frames()).step_by(nth) {
        let pose = path.pose(scene, f64::from(width) / f64::from(height), frame);
        let world_from_clip = pose
            .clip_from_world(f64::from(columns) / f64::from(rows), f64::from(width) / f64::from(height))
            .inverse();
        let wanted = feedback.of_view(picture, frame, |[x, y]| {
            let clip = Vec2::new(2.0 * x / columns - 1.0, 1.0 - 2.0 * y / rows);
            uv_from_clip(scene, width / height, &world_from_clip, clip)
        });
        // Feedback of a texture names its pages, in order.
        debug_assert!(wanted.pages.iter().all(|wanted| wanted.page.texture() == texture));
        if trace.add_frame_at(wanted.pages, pose.place()).is_err() {
            break;
        }
    }
    trace
}

/// Where the surface is hit that is seen at a point of the picture; the plane goes on beyond the texture.
fn uv_from_clip(scene: Scene, image: f32, world_from_clip: &Mat4, clip: Vec2) -> Option<[f32; 2]> {
    let near = world_from_clip.project_point3(clip.extend(0.0));
    let far = world_from_clip.project_point3(clip.extend(1.0));
    match scene {
        Scene::Image | Scene::Plane | Scene::Terrain => uv_on_plane(near, far - near, image),
        Scene::Globe | Scene::Planet => uv_on_globe(near, (far - near).normalize()),
    }
}

fn uv_on_plane(start: Vec3, along: Vec3, image: f32) -> Option<[f32; 2]> {
    let steps = -start.z / along.z;
    let hit = start + along * steps;
    let uv = [(hit.x + 1.0) / 2.0, (1.0 - hit.y * image) / 2.0];
    (0.0..=1.0).contains(&steps).then_some(uv)
}

fn uv_on_globe(start: Vec3, direction: Vec3) -> Option<[f32; 2]> {
    let closest = -start.dot(direction);
    let depth_squared = closest * closest - start.length_squared() + 1.0;
    if depth_squared < 0.0 || closest < 0.0 {
        return None;
    }
    let hit = start + direction * (closest - depth_squared.sqrt());
    let (longitude, latitude) = (hit.y.atan2(hit.x), hit.z.clamp(-1.0, 1.0).asin());
    Some([longitude / TAU + 0.5, 0.5 - latitude / PI])
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex_viewer::Pose;
    use vastex_viewer::direction;

    #[test]
    fn a_point_of_a_surface_is_found_where_it_is_drawn() {
        let on_globe = |uv: Vec2| direction((uv.x - 0.5) * TAU, (0.5 - uv.y) * PI);
        let on_plane = |uv: Vec2| Vec3::new(2.0 * uv.x - 1.0, (1.0 - 2.0 * uv.y) / 2.0, 0.0);
        for scene in Scene::ALL {
            let clip_from_world = Pose::first(scene).clip_from_world(1.6, 2.0);
            for uv in [Vec2::new(0.52, 0.3), Vec2::new(0.5, 0.4), Vec2::new(0.55, 0.45)] {
                let world = if scene.is_round() { on_globe(uv) } else { on_plane(uv) };
                let clip = clip_from_world.project_point3(world).truncate();
                let found = uv_from_clip(scene, 2.0, &clip_from_world.inverse(), clip).map(Vec2::from);
                assert!(found.is_some_and(|found| found.distance(uv) < 1e-3), "{scene:?} {uv}: {found:?}");
            }
        }
    }
}
