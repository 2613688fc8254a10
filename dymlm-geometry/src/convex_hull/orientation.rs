use std::cmp::Ordering;

/// Which way the path a -> b -> c turns: `Greater` to the left (counter-clockwise), `Less` to the right,
/// `Equal` not at all. Exact for finite coordinates with magnitudes of 1e-120 to 1e120, or 0.
///
/// A floating-point determinant decides where its error bound allows; else its six products are added without
/// rounding. Shewchuk: "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates",
/// Discrete & Computational Geometry 18, 1997.
#[inline]
pub(crate) fn orientation(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Ordering {
    let left = (a[0] - c[0]) * (b[1] - c[1]);
    let right = (a[1] - c[1]) * (b[0] - c[0]);
    let determinant = left - right;
    if determinant.abs() > ERROR_BOUND * (left.abs() + right.abs()) {
        return if determinant > 0.0 { Ordering::Greater } else { Ordering::Less };
    }
    exact_orientation(a, b, c)
}

/// Shewchuk's `ccwerrboundA`: (3 + 16 eps) eps, where eps is half an ulp of 1.
const ERROR_BOUND: f64 = (3.0 + 8.0 * f64::EPSILON) * 0.5 * f64::EPSILON;

/// The sign of a x b + b x c + c x a.
#[cold]
fn exact_orientation(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Ordering {
    let products = [(a[0], b[1]), (-a[1], b[0]), (b[0], c[1]), (-b[1], c[0]), (c[0], a[1]), (-c[1], a[0])];
    let mut sum = Expansion::default();
    for (factor, other) in products {
        let product = factor * other;
        sum.add(factor.mul_add(other, -product));
        sum.add(product);
    }
    sum.sign()
}

/// A sum of numbers without rounding error: components that do not overlap, by ascending magnitude.
#[derive(Default)]
struct Expansion {
    components: [f64; 12],
    count: usize,
}

impl Expansion {
    /// Shewchuk's Grow-Expansion.
    fn add(&mut self, number: f64) {
        let mut carried = number;
        for component in &mut self.components[..self.count] {
            let sum = carried + *component;
            let part = sum - carried;
            *component = (carried - (sum - part)) + (*component - part);
            carried = sum;
        }
        if let Some(component) = self.components.get_mut(self.count) {
            *component = carried;
            self.count += 1;
        }
    }

    /// That of the greatest component that is not 0.
    fn sign(&self) -> Ordering {
        let greatest = self.components.iter().rev().find(|component| **component != 0.0);
        greatest.map_or(Ordering::Equal, |component| component.total_cmp(&0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The determinant of points on the lattice of 2^-60 within 2^2, in integers.
    fn in_integers(points: [[f64; 2]; 3]) -> Ordering {
        let [a, b, c] = points.map(|point| point.map(|x| (x * 2f64.powi(60)) as i128));
        let left = (a[0] - c[0]) * (b[1] - c[1]);
        (left - (a[1] - c[1]) * (b[0] - c[0])).cmp(&0)
    }

    #[test]
    fn is_exact_on_points_that_hardly_turn() {
        let ulp = f64::EPSILON / 2.0;
        let mut turns = [0; 3];
        for i in 0..64 {
            for k in 0..64 {
                // Kettner and others: "Classroom examples of robustness problems in geometric computations",
                // 2008.
                let points = [[0.5 + f64::from(i) * ulp, 0.5 + f64::from(k) * ulp], [1.5, 1.5], [3.0, 3.0]];
                let turn = orientation(points[0], points[1], points[2]);
                assert_eq!(turn, in_integers(points), "{points:?}");
                assert_eq!(turn, orientation(points[1], points[2], points[0]));
                assert_eq!(turn, orientation(points[1], points[0], points[2]).reverse());
                turns[(turn as i8 + 1) as usize] += 1;
            }
        }
        // Those on the diagonal, and as many on either side.
        assert_eq!(turns, [2016, 64, 2016]);
    }

    #[test]
    fn is_exact_on_the_smallest_and_greatest_numbers() {
        for scale in [1e-120, 1.0, 1e120] {
            let on_a_line =
                [[0.1 * scale, 0.1 * scale], [0.7 * scale, 0.7 * scale], [1.3 * scale, 1.3 * scale]];
            assert_eq!(orientation(on_a_line[0], on_a_line[1], on_a_line[2]), Ordering::Equal);
            let above = [on_a_line[1][0], on_a_line[1][1] * (1.0 + f64::EPSILON)];
            assert_eq!(orientation(on_a_line[0], above, on_a_line[2]), Ordering::Less);
        }
    }
}
