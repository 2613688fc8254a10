/// Numbers of meridians and parallels of a drawn ball.
const MERIDIANS: u32 = 24;
const PARALLELS: u32 = 11;

/// A ball of diameter 1 around the origin: its corners, and three corner indices per triangle,
/// counterclockwise seen from outside.
pub(crate) fn unit_ball() -> (Vec<[f64; 3]>, Vec<u32>) {
    let mut corners = vec![[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]];
    for parallel in 1..=PARALLELS {
        let latitude = std::f64::consts::PI * f64::from(parallel) / f64::from(PARALLELS + 1);
        for meridian in 0..MERIDIANS {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(meridian) / f64::from(MERIDIANS)).sin_cos();
            let radius = 0.5 * latitude.sin();
            corners.push([radius * cos, radius * sin, -0.5 * latitude.cos()]);
        }
    }
    let corner = |parallel: u32, meridian: u32| 2 + parallel * MERIDIANS + meridian % MERIDIANS;
    let mut triangles = Vec::new();
    for meridian in 0..MERIDIANS {
        let next = meridian + 1;
        triangles.extend([0, corner(0, next), corner(0, meridian)]);
        triangles.extend([1, corner(PARALLELS - 1, meridian), corner(PARALLELS - 1, next)]);
        for parallel in 0..PARALLELS - 1 {
            let (a, b) = (corner(parallel, meridian), corner(parallel, next));
            let (c, d) = (corner(parallel + 1, meridian), corner(parallel + 1, next));
            triangles.extend([a, b, c, c, b, d]);
        }
    }
    (corners, triangles)
}

#[cfg(test)]
mod tests {
    use dymlm_core::vector3::{cross, difference, dot};

    use super::*;

    #[test]
    fn the_ball_is_closed_and_faces_outward() {
        let (corners, triangles) = unit_ball();
        let mut volume = 0.0;
        for &[a, b, c] in triangles.as_chunks().0 {
            let [a, b, c] = [a, b, c].map(|corner: u32| corners[corner as usize]);
            assert!(dot(cross(difference(b, a), difference(c, a)), a) > 0.0);
            volume += dot(a, cross(b, c)) / 6.0;
        }
        // A ball's volume is pi / 6. A gap or a triangle of the wrong orientation would cost more than the
        // flat faces do.
        assert!((0.96..1.0).contains(&(volume / (std::f64::consts::PI / 6.0))), "{volume}");
    }
}
