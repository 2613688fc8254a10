/// The Kinect's noise; goes once every user has a [`SensorModel`](crate::SensorModel).
#[inline]
pub fn axial_noise(z: f32) -> f32 {
    crate::DepthNoise::kinect().sigma(z)
}
