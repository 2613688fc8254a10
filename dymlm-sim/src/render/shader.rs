use dymlm_core::Rgb;
use parry3d::math::Vec3;

use super::view::View;
use crate::scene::{Shape, face_normal, surface_coordinates};

/// Width and height of the tiles whose rays share a list of parts, pixels.
pub(super) const TILE: [usize; 2] = [32, 16];
/// Brightness of the light from all sides, in addition to the two lamps.
const AMBIENT: f32 = 0.48;

/// Colours neighbouring pixels of a row that show one part: its material in the light of the room (Lambert).
/// Each step is a loop over all the pixels without branches, which compiles to vector code.
#[derive(Debug)]
pub(super) struct Shader {
    /// Coordinates along the surface, metres.
    s: [f32; TILE[0]],
    t: [f32; TILE[0]],
    mix: [f32; TILE[0]],
    light: [f32; TILE[0]],
}

impl Default for Shader {
    fn default() -> Self {
        let zeros = [0.0; TILE[0]];
        Self { s: zeros, t: zeros, mix: zeros, light: zeros }
    }
}

impl Shader {
    /// Shades at most a tile's width of pixels; their rays (x, y, 1) in the camera's frame hit the part at
    /// the given depths. All lists have the same length.
    pub(super) fn shade(
        &mut self,
        view: &View<'_>,
        x: &[f32],
        y: f32,
        depth: &[f32],
        incidence: &mut [f32],
        color: &mut [Rgb],
    ) {
        let rays = x.iter().map(|&x| Vec3::new(x, y, 1.0)).zip(depth.iter().copied());
        // The shapes that cover the most pixels get loops of their own.
        match view.shape {
            Shape::Cuboid(cuboid) => {
                self.light(view, rays, incidence, |point| face_normal(point / cuboid.half_extents));
            }
            Shape::Interior(cuboid) => {
                self.light(view, rays, incidence, |point| -face_normal(point / cuboid.half_extents));
            }
            shape => self.light(view, rays, incidence, |point| shape.normal(point)),
        }
        let pixels = x.len().min(TILE[0]);
        let mix = &mut self.mix[..pixels];
        view.material.mix(&self.s[..pixels], &self.t[..pixels], view.index.into(), mix);
        for ((color, &mix), &light) in color.iter_mut().zip(&*mix).zip(&self.light) {
            *color = view.material.color(mix).map(|c| (c * light * 255.0).clamp(0.0, 255.0) as u8);
        }
    }

    /// Computes each pixel's coordinates on the surface, incidence and light.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "a call a pixel would keep the loop scalar")]
    fn light(
        &mut self,
        view: &View<'_>,
        rays: impl Iterator<Item = (Vec3, f32)>,
        incidence: &mut [f32],
        normal_at: impl Fn(Vec3) -> Vec3,
    ) {
        let surface = self.s.iter_mut().zip(&mut self.t).zip(&mut self.light).zip(incidence);
        for ((ray, depth), (((s, t), light), incidence)) in rays.zip(surface) {
            let direction = view.part_from_camera * ray;
            let point = view.eye + direction * depth;
            let normal = normal_at(point);
            *incidence = (-normal.dot(direction) / ray.length()).clamp(0.0, 1.0);
            *light = view.lamps.iter().fold(AMBIENT, |light, &lamp| light + normal.dot(lamp).max(0.0));
            [*s, *t] = surface_coordinates(point, normal);
        }
    }
}
