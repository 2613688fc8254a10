use dymlm_core::DepthNoise;
use wide::f32x4;

/// [`DepthNoise::sigma`] of four readings, to the bit.
#[inline]
pub(super) fn sigmas(noise: &DepthNoise, z: f32x4) -> f32x4 {
    let beyond = (z - f32x4::splat(noise.start)).fast_max(f32x4::ZERO);
    f32x4::splat(noise.floor) + f32x4::splat(noise.growth) * beyond * beyond
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_of_four_readings_is_that_of_each() {
        for noise in
            [DepthNoise::kinect(), DepthNoise::stereo(425.0, 0.05, 0.08), DepthNoise::constant(0.008)]
        {
            for first in 0..200 {
                let z = [0.0, 0.07, 0.31, 2.5].map(|step| 0.05 * first as f32 + step);
                assert_eq!(sigmas(&noise, f32x4::from(z)).to_array(), z.map(|z| noise.sigma(z)));
            }
        }
    }
}
