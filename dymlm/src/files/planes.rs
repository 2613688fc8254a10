use dymlm_core::PointCloud;
use dymlm_io::{PlaneRecord, id_color};
use dymlm_planes::{MapPlane, PlaneMap};

/// The confirmed planes of a map as `planes.json` holds them.
pub fn plane_records(planes: &PlaneMap) -> Vec<PlaneRecord> {
    planes.iter().map(plane_record).collect()
}

pub(super) fn plane_record(plane: &MapPlane) -> PlaneRecord {
    let rings =
        plane.boundary().into_iter().flat_map(|polygon| [vec![polygon.outline], polygon.holes].concat());
    PlaneRecord {
        id: plane.id().get(),
        normal: plane.plane().normal(),
        d: plane.plane().d(),
        centroid: plane.centroid(),
        area_m2: plane.area(),
        observations: plane.observations(),
        inliers: plane.inlier_voxels(),
        boundary: rings.collect(),
    }
}

/// The inliers of the confirmed planes, one colour a plane.
pub fn plane_cloud(planes: &PlaneMap) -> PointCloud {
    let mut points = Vec::new();
    let mut colors = Vec::new();
    for plane in planes.iter() {
        points.extend(plane.inlier_points());
        colors.resize(points.len(), id_color(plane.id().get()));
    }
    PointCloud::with_colors(points, colors).unwrap_or_default()
}
