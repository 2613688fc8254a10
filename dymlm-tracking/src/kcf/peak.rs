use rustfft::num_complex::Complex;

use crate::parabola::vertex;

/// The highest value of a target's response, and how far it stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Peak {
    /// Shift from the centre, cells, interpolated by a parabola through the neighbours.
    pub(super) shift: [f32; 2],
    pub(super) value: f32,
    /// (peak - mean) / standard deviation of the response outside a window around the peak (Bolme 2010).
    pub(super) sidelobe_ratio: f32,
}

impl Peak {
    /// Finds the peak of a cyclic response of `size[0]` columns whose entry (0, 0) is no shift. `radius` is
    /// half the side of the window around the peak, cells.
    pub(super) fn find(response: &[Complex<f32>], size: [usize; 2], radius: usize) -> Self {
        let (mut best, mut value) = (0, f32::NEG_INFINITY);
        for (i, entry) in response.iter().enumerate() {
            if entry.re > value {
                (best, value) = (i, entry.re);
            }
        }
        let [width, height] = size;
        let (x, y) = (best % width, best / width);
        let at = |x: usize, y: usize| response[y % height * width + x % width].re;
        let fraction = [
            vertex(at(x + width - 1, y), value, at(x + 1, y)),
            vertex(at(x, y + height - 1), value, at(x, y + 1)),
        ];
        let shift = [cyclic(x, width) + fraction[0], cyclic(y, height) + fraction[1]];
        Self { shift, value, sidelobe_ratio: sidelobe_ratio(response, size, [x, y], radius, value) }
    }
}

/// Entries after the middle are shifts in the negative direction.
fn cyclic(i: usize, count: usize) -> f32 {
    if 2 * i > count { i as f32 - count as f32 } else { i as f32 }
}

fn sidelobe_ratio(
    response: &[Complex<f32>],
    [width, height]: [usize; 2],
    peak: [usize; 2],
    radius: usize,
    value: f32,
) -> f32 {
    let is_near = |i: usize, center: usize, count: usize| {
        let apart = i.abs_diff(center);
        apart.min(count - apart) <= radius
    };
    let (mut sum, mut squares, mut count) = (0.0_f64, 0.0_f64, 0_u32);
    for (y, row) in response.chunks_exact(width).enumerate() {
        let same_rows = is_near(y, peak[1], height);
        for (x, entry) in row.iter().enumerate() {
            if !(same_rows && is_near(x, peak[0], width)) {
                let entry = f64::from(entry.re);
                sum += entry;
                squares += entry * entry;
                count += 1;
            }
        }
    }
    if count == 0 {
        return 0.0;
    }
    let mean = sum / f64::from(count);
    let deviation = (squares / f64::from(count) - mean * mean).max(0.0).sqrt();
    if deviation > 0.0 { ((f64::from(value) - mean) / deviation) as f32 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_a_parabola_between_cells_across_the_border() {
        for shift in [[0.3_f32, -0.2], [-3.4, 2.1], [4.0, -3.2]] {
            let response: Vec<Complex<f32>> = (0..120)
                .map(|i| {
                    let [dx, dy] = [cyclic(i % 12, 12) - shift[0], cyclic(i / 12, 10) - shift[1]];
                    Complex::new((-0.01 * (dx * dx + dy * dy)).exp(), 0.0)
                })
                .collect();
            let peak = Peak::find(&response, [12, 10], 1);
            for axis in 0..2 {
                assert!((peak.shift[axis] - shift[axis]).abs() < 0.02, "{:?} is not {shift:?}", peak.shift);
            }
        }
    }

    #[test]
    fn the_ratio_is_that_of_the_rest() {
        // Outside the peak the response alternates between 0.1 and 0.3: mean 0.2, deviation 0.1.
        let mut response: Vec<Complex<f32>> =
            (0..100).map(|i| Complex::new(if (i % 10 + i / 10) % 2 == 0 { 0.1 } else { 0.3 }, 0.0)).collect();
        response[44] = Complex::new(1.0, 0.0);
        let peak = Peak::find(&response, [10, 10], 1);
        assert_eq!(peak.shift, [4.0, 4.0]);
        assert!((peak.sidelobe_ratio - 8.0).abs() < 0.1, "{}", peak.sidelobe_ratio);
        assert_eq!(Peak::find(&[Complex::new(0.5, 0.0); 100], [10, 10], 1).sidelobe_ratio, 0.0);
    }
}
