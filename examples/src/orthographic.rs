use dymlm::core::Rgb;
use dymlm::core::vector3::{any_across, cross, dot, unit};

/// Draws points and squares as seen along a direction, without perspective; nearer ones occlude farther ones.
#[derive(Debug, Clone)]
pub struct Orthographic {
    right: [f64; 3],
    down: [f64; 3],
    forward: [f64; 3],
    /// Metres at the left and upper side of the picture.
    corner: [f64; 2],
    metres_per_pixel: f64,
    width: usize,
    height: usize,
    nearest: Vec<f32>,
    pixels: Vec<Rgb>,
}

/// Longer side of a picture, pixels.
const LONG_SIDE: f64 = 1000.0;
const BACKGROUND: Rgb = [255, 255, 255];

impl Orthographic {
    /// A view of these points along `forward`, with `down` approximately downward in the picture. Along each
    /// side of the picture, the lowest and the highest half per cent of the points may be outside, so that
    /// strays do not shrink the rest.
    pub fn onto(forward: [f64; 3], down: [f64; 3], points: impl Iterator<Item = [f64; 3]>) -> Self {
        let forward = unit(forward).unwrap_or([0.0, 0.0, 1.0]);
        let right = unit(cross(down, forward)).unwrap_or_else(|| any_across(forward));
        let down = cross(forward, right);
        let (mut across, mut along): (Vec<f64>, Vec<f64>) =
            points.map(|point| (dot(right, point), dot(down, point))).unzip();
        let ([left, to_right], [top, bottom]) = (bulk(&mut across), bulk(&mut along));
        let metres_per_pixel = ((to_right - left).max(bottom - top) / LONG_SIDE).max(1e-3);
        let pixels_of = |length: f64| ((length / metres_per_pixel).ceil() as usize).clamp(1, 4000);
        let (width, height) = (pixels_of(to_right - left), pixels_of(bottom - top));
        Self {
            right,
            down,
            forward,
            corner: [left, top],
            metres_per_pixel,
            width,
            height,
            nearest: vec![f32::INFINITY; width * height],
            pixels: vec![BACKGROUND; width * height],
        }
    }

    /// Draws a square of `side` metres (at least a pixel) around a point.
    pub fn draw(&mut self, point: [f64; 3], side: f64, color: Rgb) {
        let pixel = |axis: [f64; 3], corner: f64, offset: f64| {
            ((dot(axis, point) - corner + offset) / self.metres_per_pixel).floor()
        };
        let half = (side - self.metres_per_pixel).max(0.0) / 2.0;
        let columns = span(
            pixel(self.right, self.corner[0], -half),
            pixel(self.right, self.corner[0], half),
            self.width,
        );
        let rows = span(
            pixel(self.down, self.corner[1], -half),
            pixel(self.down, self.corner[1], half),
            self.height,
        );
        let distance = dot(self.forward, point) as f32;
        for row in rows {
            for index in columns.clone().map(|column| row * self.width + column) {
                if distance < self.nearest[index] {
                    self.nearest[index] = distance;
                    self.pixels[index] = color;
                }
            }
        }
    }

    /// Width, pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The picture so far, row by row.
    pub fn pixels(&self) -> &[Rgb] {
        &self.pixels
    }

    /// The picture, row by row.
    pub fn into_pixels(self) -> Vec<Rgb> {
        self.pixels
    }
}

fn span(first: f64, last: f64, count: usize) -> std::ops::Range<usize> {
    // Casts saturate: a square outside the picture gives an empty range.
    let end = ((last + 1.0).max(0.0) as usize).min(count);
    (first.max(0.0) as usize).min(end)..end
}

/// The interval that holds 99 % of the values, and a little more.
fn bulk(values: &mut [f64]) -> [f64; 2] {
    if values.is_empty() {
        return [0.0, 1.0];
    }
    values.sort_unstable_by(f64::total_cmp);
    let skipped = values.len() / 200;
    let (low, high) = (values[skipped], values[values.len() - 1 - skipped]);
    let margin = 0.02 * (high - low) + 0.05;
    [low - margin, high + margin]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_is_seen() {
        let points = [[-1.0, 0.0, 5.0], [1.0, 1.0, 5.0]];
        let mut view = Orthographic::onto([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], points.into_iter());
        view.draw([0.0, 0.5, 2.0], 0.1, [1, 2, 3]);
        view.draw([0.0, 0.5, 3.0], 0.1, [9, 9, 9]);
        view.draw([90.0, 0.5, 1.0], 0.1, [7, 7, 7]);
        let (width, height) = (view.width(), view.height());
        let pixels = view.into_pixels();
        assert_eq!(pixels.len(), width * height);
        assert!(pixels.contains(&[1, 2, 3]) && !pixels.contains(&[9; 3]) && !pixels.contains(&[7; 3]));
    }
}
