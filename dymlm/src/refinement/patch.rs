use dymlm_core::vector3::{Vector3, along, difference, dot, norm};
use dymlm_core::{Pose, symmetric_eigen3};
use dymlm_refine::PlaneView;

/// What a view shows of a plane, in the world.
pub(super) struct Patch {
    pub(super) view: PlaneView,
    pub(super) centroid: Vector3,
    /// Toward the camera.
    pub(super) normal: Vector3,
    /// Distance of the inliers from their centroid within the plane, root mean square, metres.
    pub(super) radius: f64,
}

impl Patch {
    pub(super) fn new(view: &PlaneView, poses: &[Pose]) -> Option<Self> {
        let pose = poses.get(view.pose)?;
        let [xx, xy, xz, yy, yz, zz] = view.covariance;
        let eigen = symmetric_eigen3([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])?;
        let normal = eigen.vectors[2];
        let faces_camera = dot(normal, view.centroid) < 0.0;
        let normal = if faces_camera { normal } else { normal.map(|c| -c) };
        Some(Self {
            view: *view,
            centroid: pose.transform_point(view.centroid),
            normal: pose.rotate(normal),
            radius: (eigen.values[0] + eigen.values[1]).max(0.0).sqrt(),
        })
    }

    /// Distance between two patches within their planes, in units of their radii: below 1 they lie over each
    /// other.
    pub(super) fn gap(&self, other: &Self) -> f64 {
        let apart = difference(other.centroid, self.centroid);
        let within = along(apart, -dot(self.normal, apart), self.normal);
        norm(within) / (self.radius + other.radius)
    }

    pub(super) fn faces_as(&self, other: &Self) -> bool {
        dot(self.normal, other.normal) > 0.0
    }
}
