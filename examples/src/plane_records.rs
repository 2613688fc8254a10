use dymlm::PlaneMap;
use dymlm::core::{PointCloud, Rgb};
use dymlm::planes::MapPlane;
use dymlm_io::PlaneRecord;

/// The confirmed planes of a map as `planes.json` holds them.
pub fn plane_records(planes: &PlaneMap) -> Vec<PlaneRecord> {
    planes.confirmed().map(plane_record).collect()
}

fn plane_record(plane: &MapPlane) -> PlaneRecord {
    let rings =
        plane.boundary().into_iter().flat_map(|polygon| [vec![polygon.outline], polygon.holes].concat());
    PlaneRecord {
        id: plane.id(),
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
    for plane in planes.confirmed() {
        points.extend(plane.inlier_points());
        colors.resize(points.len(), plane_color(plane.id()));
    }
    PointCloud::with_colors(points, colors).unwrap_or_default()
}

/// Up as the largest level plane has it (floor, table), given about where up is; that itself when there is none
/// within 45 degrees of it.
pub fn up_of_planes(planes: &PlaneMap, about: [f64; 3]) -> [f64; 3] {
    let cosine = |normal: [f64; 3]| (0..3).map(|axis| normal[axis] * about[axis]).sum::<f64>();
    let level = planes.confirmed().filter(|plane| cosine(plane.plane().normal()) > 0.5_f64.sqrt());
    let largest = level.max_by(|a, b| a.area().total_cmp(&b.area()));
    largest.map_or(about, |plane| plane.plane().normal())
}

/// A colour that neighbouring ids do not share: hues a golden ratio of the circle apart.
pub fn plane_color(id: u64) -> Rgb {
    let hue = (id as f64 * 0.618_033_988_75).fract() * 6.0;
    let value = if id.is_multiple_of(2) { 230.0 } else { 175.0 };
    let channel = |shift: f64| {
        let along = (hue + shift).rem_euclid(6.0);
        ((along - 3.0).abs() - 1.0).clamp(0.15, 1.0) * value
    };
    [channel(0.0) as u8, channel(4.0) as u8, channel(2.0) as u8]
}
