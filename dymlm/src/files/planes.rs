use std::collections::BTreeMap;

use dymlm_core::PointCloud;
use dymlm_io::{PlaneRecord, id_color};
use dymlm_planes::{MapPlane, PlaneMap};

/// The confirmed planes of a map as `planes.json` holds them.
pub fn plane_records(planes: &PlaneMap) -> Vec<PlaneRecord> {
    planes.iter().map(plane_record).collect()
}

/// [`plane_records`], with those of an earlier map given: the records of planes that have not changed since
/// are taken from these.
pub(super) fn renewed_records(
    planes: &PlaneMap,
    earlier: &PlaneMap,
    records: Vec<PlaneRecord>,
) -> Vec<PlaneRecord> {
    let mut records: BTreeMap<u64, PlaneRecord> =
        records.into_iter().map(|record| (record.id, record)).collect();
    let mut kept = |plane: &MapPlane| records.remove(&plane.id().get()).filter(|_| earlier.holds(plane));
    planes.iter().map(|plane| kept(plane).unwrap_or_else(|| plane_record(plane))).collect()
}

pub(super) fn plane_record(plane: &MapPlane) -> PlaneRecord {
    let (boundary, area) = plane.boundary_and_area();
    let rings = boundary.into_iter().flat_map(|polygon| [vec![polygon.outline], polygon.holes].concat());
    PlaneRecord {
        id: plane.id().get(),
        normal: plane.plane().normal(),
        d: plane.plane().d(),
        centroid: plane.centroid(),
        area_m2: area,
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
