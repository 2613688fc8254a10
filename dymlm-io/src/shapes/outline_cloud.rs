use dymlm_core::vector3::{along, difference, norm};
use dymlm_core::{Point, PointCloud, Pose, Rgb};

use super::{box_edges, unit_circles};
use crate::{ObjectRecord, PlaneRecord, ShapeRecord, id_color};

/// Largest number of points along a line, however long it is.
const MAX_POINTS: f64 = 1e4;

/// The outlines of planes and the lines of objects as points, at most `spacing` metres apart, each in the
/// colour of its id: for viewers that draw only clouds. A line longer than 10,000 times `spacing` gets 10,000
/// points, evenly spread and thus farther apart, so that a damaged map does not fill the memory. Lines with
/// an end that is not finite are left out, and all lines if `spacing` is not positive.
pub fn outline_cloud(planes: &[PlaneRecord], objects: &[ObjectRecord], spacing: f64) -> PointCloud {
    let mut drawn = Drawn { spacing, points: Vec::new(), colors: Vec::new() };
    for plane in planes {
        for ring in &plane.boundary {
            drawn.ring(ring, id_color(plane.id));
        }
    }
    for object in objects {
        drawn.object(object);
    }
    PointCloud::with_colors(drawn.points, drawn.colors).unwrap_or_default()
}

struct Drawn {
    spacing: f64,
    points: Vec<Point>,
    colors: Vec<Rgb>,
}

impl Drawn {
    fn object(&mut self, object: &ObjectRecord) {
        let Ok(pose) = Pose::new(object.translation, object.rotation) else { return };
        let lengths = object.dimensions;
        let placed = |unit: [f64; 3]| {
            pose.transform_point(std::array::from_fn(|axis| {
                unit.get(axis).copied().unwrap_or_default() * lengths.get(axis).copied().unwrap_or_default()
            }))
        };
        let color = id_color(object.id);
        match object.shape {
            ShapeRecord::Cuboid => {
                let (corners, edges) = box_edges();
                let corner = |index: u32| corners.get(index as usize).copied().map(placed);
                for [a, b] in edges {
                    if let (Some(a), Some(b)) = (corner(a), corner(b)) {
                        self.line(a, b, color);
                    }
                }
            }
            ShapeRecord::Ellipsoid => {
                for circle in unit_circles() {
                    self.ring(&circle.map(placed), color);
                }
            }
        }
    }

    fn ring(&mut self, ring: &[[f64; 3]], color: Rgb) {
        let next = ring.iter().cycle().skip(1);
        for (&a, &b) in ring.iter().zip(next) {
            self.line(a, b, color);
        }
    }

    /// Adds the points from `a` to `b`, without `b` itself.
    fn line(&mut self, a: [f64; 3], b: [f64; 3], color: Rgb) {
        let way = difference(b, a);
        let count = (norm(way) / self.spacing).ceil();
        // Also ends here for NaN and infinity.
        if !(count > 0.0 && count < f64::INFINITY) {
            return;
        }
        let count = count.min(MAX_POINTS);
        for step in 0..count as u32 {
            self.points.push(along(a, f64::from(step) / count, way).map(|c| c as f32));
            self.colors.push(color);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_a_box_and_of_an_ellipsoid() {
        let mut object = ObjectRecord {
            id: 3,
            label: "chair".into(),
            score: 0.9,
            shape: ShapeRecord::Cuboid,
            rotation: [0.0, 0.0, 0.0, 1.0],
            translation: [1.0, 2.0, 3.0],
            dimensions: [0.25, 0.5, 1.0],
            observations: 3,
            points: 4,
        };
        let cloud = outline_cloud(&[], std::slice::from_ref(&object), 0.125);
        // Four edges of each length, each without its end point.
        assert_eq!(cloud.len(), 4 * (2 + 4 + 8));
        assert!(cloud.colors().is_some_and(|colors| colors.iter().all(|color| *color == id_color(3))));
        let reach = |axis: usize| cloud.points().iter().map(|point| point[axis]).fold(f32::MIN, f32::max);
        assert_eq!((reach(0), reach(2)), (1.125, 3.5));

        object.shape = ShapeRecord::Ellipsoid;
        for point in outline_cloud(&[], std::slice::from_ref(&object), 0.01).points() {
            let half = [0.125, 0.25, 0.5];
            let ratio: f64 =
                (0..3).map(|k| ((f64::from(point[k]) - object.translation[k]) / half[k]).powi(2)).sum();
            // The chords of the circles lie slightly inside the ellipsoid.
            assert!((0.98..=1.0 + 1e-5).contains(&ratio), "{ratio}");
        }

        object.shape = ShapeRecord::Cuboid;
        object.dimensions = [1e6, 0.0, 0.0];
        let along_x = outline_cloud(&[], std::slice::from_ref(&object), 0.01);
        assert_eq!(along_x.len(), 4 * 10_000, "four lines of 1000 km, and edges without a length");
        let steps = along_x.points().windows(2).map(|pair| f64::from((pair[1][0] - pair[0][0]).abs()));
        let evenly = steps.filter(|step| (99.9..100.1).contains(step)).count();
        assert_eq!(evenly, 4 * 9_999);

        object.dimensions = [f64::NAN; 3];
        assert!(outline_cloud(&[], &[object], 0.01).is_empty());
        assert!(outline_cloud(&[], &[], 0.0).is_empty());
    }
}
