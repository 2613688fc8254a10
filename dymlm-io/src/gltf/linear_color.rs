use dymlm_core::Rgb;

/// Takes an sRGB colour to linear light, 0 to 1, as glTF has it in vertices and materials.
pub(super) fn linear(color: Rgb) -> [f32; 3] {
    color.map(|channel| {
        let value = f64::from(channel) / 255.0;
        let light = if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) };
        light as f32
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_white_and_the_middle() {
        assert_eq!(linear([0, 255, 0]), [0.0, 1.0, 0.0]);
        // IEC 61966-2-1: half the light is code 188.
        assert!((linear([188; 3])[0] - 0.5).abs() < 0.005);
    }
}
