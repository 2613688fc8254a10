use dymlm_core::PinholeCamera;

/// Rays of a camera's pixels at depth 1: x = `x`[u] z, y = `y`[v] z.
#[derive(Debug, Clone, Default)]
pub(super) struct Rays {
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
    /// `x` in single precision, which is enough for the distance of a reading from a plane.
    pub(super) x_single: Vec<f32>,
}

impl Rays {
    pub(super) fn set(&mut self, camera: &PinholeCamera) {
        self.x.clear();
        self.x.extend((0..camera.width()).map(|u| (u as f64 - camera.cx()) / camera.fx()));
        self.x_single.clear();
        self.x_single.extend(self.x.iter().map(|&x| x as f32));
        self.y.clear();
        self.y.extend((0..camera.height()).map(|v| (v as f64 - camera.cy()) / camera.fy()));
    }
}
