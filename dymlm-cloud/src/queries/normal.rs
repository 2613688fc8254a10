use dymlm_core::vector3::{along, difference, dot, with_positive_greatest};
use dymlm_core::{Point, symmetric_eigen3};

use super::StaticPoints;

/// Least variance across a neighbourhood's longest extent, as a share of the variance along it. With a lower
/// value a cable has a normal, which noise decides (`a_line_and_a_few_points_have_no_normal`); a higher one
/// denies a normal to surfaces of few points (`normals_are_those_of_the_surfaces_and_face_the_camera`).
const LEAST_SPREAD: f64 = 0.01;
/// Greatest distance from a surface at which looks of frames are compared, in cells of the evidence. With a
/// lower value there are none before a surface that was read from afar, where the noise is large, or at an
/// angle (`normals_are_those_of_the_surfaces_and_face_the_camera`); with a higher one, looks in other rooms
/// may decide.
const LOOK_REACH: u32 = 6;

/// Which way a surface faces.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SurfaceNormal {
    /// Unit vector across the surface, world.
    pub direction: [f64; 3],
    /// Whether it is known to point to the side from which the surface was seen: more frames have looked
    /// through the space before it than behind it. Otherwise its component of greatest magnitude is positive.
    pub is_oriented: bool,
    /// Surface variation (Pauly 2002): the share of the neighbourhood's variance along the normal, 0 for a
    /// plane to 1/3 for points all around. High at edges, corners and small things.
    pub variation: f64,
}

impl StaticPoints<'_> {
    /// The normal of the static surface around a place: the direction in which the points within `radius`
    /// metres of it spread least, towards the side that frames looked through. `None` where there are fewer
    /// than three points, or they lie on a line. O(points in the blocks around).
    ///
    /// A larger radius averages the noise, a smaller one keeps the edges of small things. For a Kinect's
    /// floor, wall and box at 1 to 3 m, half of the normals are within 9 degrees at 4 voxels (4 cm), and
    /// within 1.5 degrees at 8 voxels.
    pub fn normal_at(&self, place: Point, radius: f64) -> Option<SurfaceNormal> {
        let center = place.map(f64::from);
        if !center.iter().all(|c| c.is_finite()) || !radius.is_finite() {
            return None;
        }
        let covariance = self.covariance_around(center, radius)?;
        let eigen = symmetric_eigen3(covariance)?;
        let [longest, across, least] = eigen.values;
        if across <= LEAST_SPREAD * longest {
            return None;
        }
        let [_, _, direction] = eigen.vectors;
        let direction = with_positive_greatest(direction);
        let side = self.seen_side(center, direction);
        Some(SurfaceNormal {
            direction: direction.map(|c| side.unwrap_or(1.0) * c),
            is_oriented: side.is_some(),
            variation: least.max(0.0) / (longest + across + least.max(0.0)),
        })
    }

    /// Covariance of the points within `radius` of a place.
    fn covariance_around(&self, center: [f64; 3], radius: f64) -> Option<[[f64; 3]; 3]> {
        let (mut count, mut sum, mut products) = (0.0, [0.0; 3], [[0.0; 3]; 3]);
        let region = [-radius, radius].map(|side| center.map(|c| c + side));
        self.for_each_block(region, |slot, _| {
            for point in self.cloud.points(slot) {
                let offset = difference(point.map(f64::from), center);
                if dot(offset, offset) > radius * radius {
                    continue;
                }
                count += 1.0;
                for row in 0..3 {
                    sum[row] += offset[row];
                    for column in row..3 {
                        products[row][column] += offset[row] * offset[column];
                    }
                }
            }
        });
        let mean = |row: usize| sum[row] / count;
        let entry = |row: usize, column: usize| products[row][column] / count - mean(row) * mean(column);
        let covariance = || [0, 1, 2].map(|row| [0, 1, 2].map(|column| entry(row, column)));
        (count >= 3.0).then(covariance)
    }

    /// The side of a surface on which more frames have looked through the space: 1.0 along the normal, -1.0
    /// against it. The nearest pair of cells that differs decides, since behind a thin wall frames look
    /// through another room.
    fn seen_side(&self, center: [f64; 3], normal: [f64; 3]) -> Option<f64> {
        let evidence = &self.map.evidence;
        let looks = |side: f64, step: u32| {
            let place = along(center, side * f64::from(step) * evidence.cell_size(), normal);
            self.map.voxel_at(place).map_or(0, |voxel| evidence.of_voxel(voxel).looked_through)
        };
        let both = (1..=LOOK_REACH).map(|step| (looks(1.0, step), looks(-1.0, step)));
        let (before, behind) = both.into_iter().find(|(before, behind)| before != behind)?;
        Some(if before > behind { 1.0 } else { -1.0 })
    }
}
