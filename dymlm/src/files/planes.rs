use dymlm_core::{PointCloud, Rgb};
use dymlm_io::PlaneRecord;
use dymlm_planes::{MapPlane, PlaneMap};

/// The confirmed planes of a map as `planes.json` holds them.
pub fn plane_records(planes: &PlaneMap) -> Vec<PlaneRecord> {
    planes.iter().map(plane_record).collect()
}

fn plane_record(plane: &MapPlane) -> PlaneRecord {
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

/// A colour for the id of a plane or object, unlike those of neighbouring ids: hues a golden ratio of the
/// circle apart.
pub fn id_color(id: u64) -> Rgb {
    let hue = (id as f64 * 0.618_033_988_75).fract() * 6.0;
    let value = if id.is_multiple_of(2) { 230.0 } else { 175.0 };
    let channel = |shift: f64| {
        let along = (hue + shift).rem_euclid(6.0);
        ((along - 3.0).abs() - 1.0).clamp(0.15, 1.0) * value
    };
    [channel(0.0) as u8, channel(4.0) as u8, channel(2.0) as u8]
}
