/// Place of the maximum of a parabola through three neighbours, relative to the middle one, -0.5..=0.5.
pub(crate) fn vertex(left: f32, middle: f32, right: f32) -> f32 {
    let curvature = 2.0 * middle - left - right;
    if curvature > 0.0 { (0.5 * (right - left) / curvature).clamp(-0.5, 0.5) } else { 0.0 }
}
