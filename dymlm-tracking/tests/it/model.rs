//! Surfaces of objects to follow.

use dymlm_core::Point;
use dymlm_core::vector3::{dot, unit};
use dymlm_tracking::ObjectModel;

#[test]
fn normals_of_a_sampled_sphere_point_outwards() {
    let golden = 2.399_963_2_f32;
    let points: Vec<Point> = (0..4000)
        .map(|i| {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 4000.0;
            let r = (1.0 - z * z).sqrt();
            let angle = golden * i as f32;
            [0.1 * r * angle.cos(), 0.1 * r * angle.sin(), 0.1 * z]
        })
        .collect();
    let model = ObjectModel::from_points(&points).unwrap();
    assert!(model.surface().len() > 500);
    for point in model.surface() {
        let cosine = dot(unit(point.position).unwrap(), point.normal);
        assert!(cosine > 0.97, "{cosine}");
    }
}

#[test]
fn clouds_that_are_no_surface_are_refused() {
    assert!(ObjectModel::from_points(&[]).is_err());
    assert!(ObjectModel::from_points(&[[0.1; 3]; 100]).is_err());
    assert!(ObjectModel::from_points(&[[f32::NAN; 3]; 100]).is_err());
    assert!(ObjectModel::cuboid([0.1, 0.0, 0.1]).is_err());
    assert!(ObjectModel::ellipsoid([0.1, f64::NAN, 0.1]).is_err());
}
