/// Standard deviation of a structured-light depth reading along the optical axis, in metres, at depth `z`
/// metres: sigma(z) = 0.0012 + 0.0019 (z - 0.4)^2.
///
/// Nguyen, Izadi, Lovell: "Modeling Kinect Sensor Noise for Improved 3D Reconstruction and Tracking", 3DIMPVT
/// 2012. Measured on a first-generation Kinect for 0.4 to 3 m and incidence below 60 degrees; readings nearer
/// than 0.4 m are taken as those at 0.4 m.
///
/// ```
/// assert_eq!(dymlm_core::axial_noise(0.4), 0.0012);
/// assert!((dymlm_core::axial_noise(2.4) - 0.0088).abs() < 1e-6);
/// ```
#[inline]
pub fn axial_noise(z: f32) -> f32 {
    let beyond = (z - 0.4).max(0.0);
    0.0012 + 0.0019 * beyond * beyond
}
