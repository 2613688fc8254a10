use dymlm_core::Pose;
use nalgebra::{Matrix3, Vector3};

/// Newton steps on the three distances: two reach the precision of f64, or more where two solutions are
/// nearly one.
const POLISHING_STEPS: usize = 5;
/// Distances that miss an equation by more are no solution; in units of the largest distance between the
/// points, squared. Of far points, rounding alone is a larger share of the distances' own squares.
const LARGEST_RESIDUAL: f64 = 1e-9;
const LARGEST_SHARE: f64 = 1e-12;

/// The poses `camera_from_body` at which a camera sees three points of a body along three given directions:
/// up to four.
///
/// Persson, Nordberg: "Lambda Twist: An Accurate Fast Robust Perspective Three Point (P3P) Solver", ECCV
/// 2018. The distances to the points satisfy three quadratic equations. A root of a cubic gives a degenerate
/// combination of them, which splits into two planes; each plane leaves a quadratic. Unlike there, no
/// distance is expressed by the two others, which fails where two points are seen alike. O(1).
///
/// `directions` are in the camera's frame, of any length; `points` are in the body's frame, metres. There is
/// no pose when the points lie on a line or a number is not finite.
///
/// ```
/// use dymlm_core::Pose;
/// use dymlm_tracking::p3p;
///
/// let camera_from_body = Pose::new([0.1, -0.2, 2.0], [0.0, 0.0, 0.0, 1.0])?;
/// let points = [[0.0, 0.0, 0.0], [0.3, 0.0, 0.1], [0.0, 0.2, 0.0]];
/// let directions = points.map(|point| camera_from_body.transform_point(point));
/// let poses = p3p(&directions, &points);
/// assert!(poses.iter().any(|pose| pose.distance(&camera_from_body) < 1e-9));
/// # Ok::<(), dymlm_core::Error>(())
/// ```
pub fn p3p(directions: &[[f64; 3]; 3], points: &[[f64; 3]; 3]) -> Vec<Pose> {
    let mut poses = Vec::with_capacity(4);
    if directions.iter().chain(points).flatten().all(|x| x.is_finite()) {
        solve(directions, points, &mut poses);
    }
    poses
}

/// The quadratic equations of the distances l: `l_i^2 + l_j^2 + b_ij l_i l_j = a_ij`, in the order 12, 13,
/// 23.
struct Equations {
    a: [f64; 3],
    b: [f64; 3],
}

fn solve(directions: &[[f64; 3]; 3], points: &[[f64; 3]; 3], poses: &mut Vec<Pose>) {
    let rays = directions.map(|direction| Vector3::from(direction).normalize());
    let points = points.map(Vector3::from);
    let [d12, d13, d23] = [points[0] - points[1], points[0] - points[2], points[1] - points[2]];
    let normal = d12.cross(&d13);
    let longest = d12.norm_squared().max(d13.norm_squared());
    let area = normal.norm();
    if area.is_nan() || area <= 1e-9 * longest {
        return;
    }
    let Some(body) = Matrix3::from_columns(&[d12, d13, normal]).try_inverse() else { return };
    // In units of the largest distance between the points, so that tolerances do not depend on the scale.
    let unit = longest.sqrt();
    let equations = Equations {
        a: [d12, d13, d23].map(|d| d.norm_squared() / longest),
        b: [(0, 1), (0, 2), (1, 2)].map(|(i, j): (usize, usize)| -2.0 * rays[i].dot(&rays[j])),
    };
    for distances in equations.distances() {
        let [p1, p2, p3]: [Vector3<f64>; 3] = std::array::from_fn(|i| rays[i] * distances[i] * unit);
        let (e12, e13) = (p1 - p2, p1 - p3);
        let rotation = Matrix3::from_columns(&[e12, e13, e12.cross(&e13)]) * body;
        let translation = p1 - rotation * points[0];
        let rows = std::array::from_fn(|row| std::array::from_fn(|column| rotation[(row, column)]));
        poses.extend(Pose::from_rotation_matrix(rows, translation.into()));
    }
}

impl Equations {
    /// All positive solutions.
    fn distances(&self) -> Vec<[f64; 3]> {
        let mut found = Vec::with_capacity(4);
        let forms = self.forms();
        let Some(degenerate) = degenerate_conic(&forms) else { return found };
        let Some(planes) = split(&degenerate) else { return found };
        for normal in planes {
            for direction in directions_in(&normal, &forms) {
                let distances = self.scaled(direction).map(|distances| self.polish(distances));
                found.extend(distances.filter(|&distances| self.is_solved_by(distances)));
            }
        }
        found
    }

    /// The distances along a direction, as far as the equations say in sum; `None` unless all are positive.
    fn scaled(&self, direction: Vector3<f64>) -> Option<[f64; 3]> {
        let direction = direction * direction.sum().signum();
        let (left, right) = (self.left_sides(direction.into()), self.a);
        let distances = direction * (right.iter().sum::<f64>() / left.iter().sum::<f64>()).sqrt();
        distances.iter().all(|l| *l > 0.0 && l.is_finite()).then(|| distances.into())
    }

    fn left_sides(&self, [l1, l2, l3]: [f64; 3]) -> [f64; 3] {
        let [b12, b13, b23] = self.b;
        [
            l1 * l1 + l2 * l2 + b12 * l1 * l2,
            l1 * l1 + l3 * l3 + b13 * l1 * l3,
            l2 * l2 + l3 * l3 + b23 * l2 * l3,
        ]
    }

    fn is_solved_by(&self, distances: [f64; 3]) -> bool {
        let most = LARGEST_RESIDUAL.max(LARGEST_SHARE * Vector3::from(distances).norm_squared());
        self.residual(distances).amax() <= most
    }

    fn residual(&self, distances: [f64; 3]) -> Vector3<f64> {
        Vector3::from(self.left_sides(distances)) - Vector3::from(self.a)
    }

    /// D1 = a23 M12 - a12 M23 and D2 = a13 M23 - a23 M13, where M are the matrices of the equations' left
    /// sides. Both forms vanish at any solution.
    fn forms(&self) -> [Matrix3<f64>; 2] {
        let [a12, a13, a23] = self.a;
        let [b12, b13, b23] = self.b.map(|b| 0.5 * b);
        let d1 = Matrix3::new(
            a23,
            a23 * b12,
            0.0, //
            a23 * b12,
            a23 - a12,
            -a12 * b23, //
            0.0,
            -a12 * b23,
            -a12,
        );
        let d2 = Matrix3::new(
            -a23,
            0.0,
            -a23 * b13, //
            0.0,
            a13,
            a13 * b23, //
            -a23 * b13,
            a13 * b23,
            a13 - a23,
        );
        [d1, d2]
    }

    fn polish(&self, mut l: [f64; 3]) -> [f64; 3] {
        let [b12, b13, b23] = self.b;
        for _ in 0..POLISHING_STEPS {
            let [l1, l2, l3] = l;
            let jacobian = Matrix3::new(
                2.0 * l1 + b12 * l2,
                2.0 * l2 + b12 * l1,
                0.0, //
                2.0 * l1 + b13 * l3,
                0.0,
                2.0 * l3 + b13 * l1, //
                0.0,
                2.0 * l2 + b23 * l3,
                2.0 * l3 + b23 * l2,
            );
            let Some(inverse) = jacobian.try_inverse() else { return l };
            let step = inverse * self.residual(l);
            let next = [l1 - step[0], l2 - step[1], l3 - step[2]];
            if !next.iter().all(|l| l.is_finite() && *l > 0.0) {
                return l;
            }
            l = next;
        }
        l
    }
}

/// D1 + gamma D2 with determinant 0; D2 where it is degenerate itself, and no other combination is.
fn degenerate_conic([d1, d2]: &[Matrix3<f64>; 2]) -> Option<Matrix3<f64>> {
    let mixed = |p: &Matrix3<f64>, q: &Matrix3<f64>| adjugate(p).dot(&q.transpose());
    let coefficients = [d2.determinant(), mixed(d2, d1), mixed(d1, d2), d1.determinant()];
    let [c3, c2, c1, c0] = coefficients;
    let is_finite = coefficients.iter().all(|c| c.is_finite());
    is_finite.then(|| cubic_root(c3, c2, c1, c0).map_or(*d2, |gamma| d1 + d2 * gamma))
}

/// Splits a degenerate conic into two planes, of which it gives the normals.
fn split(conic: &Matrix3<f64>) -> Option<[Vector3<f64>; 2]> {
    let eigen = conic.symmetric_eigen();
    // In a degenerate conic, one eigenvalue is 0: the one nearest to 0.
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].abs().total_cmp(&eigen.eigenvalues[i].abs()));
    let [strong, weak] = [eigen.eigenvalues[order[0]], eigen.eigenvalues[order[1]]];
    let [v, w] = [eigen.eigenvectors.column(order[0]), eigen.eigenvectors.column(order[1])];
    let ratio = (-weak / strong).max(0.0).sqrt();
    ratio.is_finite().then(|| [ratio, -ratio].map(|s| v - s * w))
}

/// The directions of (l1, l2, l3) in a plane through the origin at which both forms vanish.
fn directions_in(normal: &Vector3<f64>, forms: &[Matrix3<f64>; 2]) -> [Vector3<f64>; 2] {
    let thinnest = Vector3::ith(normal.iamin(), 1.0);
    let first = normal.cross(&thinnest).normalize();
    let second = normal.cross(&first).normalize();
    // In the plane, one of the two forms is a multiple of the other: the larger one says more.
    let within = |form: &Matrix3<f64>| {
        let [with_first, with_second] = [form * first, form * second];
        [first.dot(&with_first), 2.0 * first.dot(&with_second), second.dot(&with_second)]
    };
    let size = |form: &[f64; 3]| form.iter().fold(0.0_f64, |largest, c| largest.max(c.abs()));
    let [form, other] = forms.each_ref().map(within);
    let [square, linear, constant] = if size(&form) >= size(&other) { form } else { other };
    // Roots x : y of square x^2 + linear x y + constant y^2. Where two of them are one, rounding must
    // not lose it.
    let discriminant = (linear * linear - 4.0 * square * constant).max(0.0);
    let sum = -0.5 * (linear + discriminant.sqrt().copysign(linear));
    [[sum, square], [constant, sum]].map(|[x, y]| first * x + second * y)
}

fn adjugate(m: &Matrix3<f64>) -> Matrix3<f64> {
    let [a, b, c] = [m.column(0).into_owned(), m.column(1).into_owned(), m.column(2).into_owned()];
    Matrix3::from_rows(&[b.cross(&c).transpose(), c.cross(&a).transpose(), a.cross(&b).transpose()])
}

/// Real roots of a quadratic, numerically stable for coefficients of any size.
fn quadratic_roots(square: f64, linear: f64, constant: f64) -> [Option<f64>; 2] {
    let discriminant = linear * linear - 4.0 * square * constant;
    if discriminant.is_nan() || discriminant < 0.0 {
        return [None; 2];
    }
    let sum = -0.5 * (linear + discriminant.sqrt().copysign(linear));
    let finite = |root: f64| root.is_finite().then_some(root);
    [finite(sum / square), finite(constant / sum)]
}

/// A real root of a cubic (or of a quadratic, if the first coefficient is about 0): the best conditioned one,
/// polished by Newton's method.
fn cubic_root(c3: f64, c2: f64, c1: f64, c0: f64) -> Option<f64> {
    let largest = [c3, c2, c1, c0].into_iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    if c3.abs() <= 1e-13 * largest {
        return quadratic_roots(c2, c1, c0).into_iter().flatten().next();
    }
    let [b, c, d] = [c2 / c3, c1 / c3, c0 / c3];
    let value = |x: f64| ((x + b) * x + c) * x + d;
    let slope = |x: f64| (3.0 * x + 2.0 * b) * x + c;
    // The depressed cubic: y^3 + p y + q with x = y - b / 3.
    let shift = b / 3.0;
    let p = c - b * shift;
    let q = d + shift * (2.0 * shift * shift - c);
    let discriminant = 0.25 * q * q + p * p * p / 27.0;
    let y = if discriminant >= 0.0 {
        let one = (-0.5 * q - discriminant.sqrt().copysign(q)).cbrt();
        if one == 0.0 { 0.0 } else { one - p / (3.0 * one) }
    } else {
        // Three real roots: of the two outer ones, that with the steeper slope is certainly simple.
        let radius = 2.0 * (-p / 3.0).sqrt();
        let angle = (3.0 * q / (p * radius)).clamp(-1.0, 1.0).acos() / 3.0;
        let outer = [radius * angle.cos(), radius * (angle + 2.0 * std::f64::consts::FRAC_PI_3).cos()];
        if slope(outer[0] - shift).abs() >= slope(outer[1] - shift).abs() { outer[0] } else { outer[1] }
    };
    let mut x = y - shift;
    for _ in 0..3 {
        let slope = slope(x);
        if slope == 0.0 {
            break;
        }
        x -= value(x) / slope;
    }
    x.is_finite().then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_roots() {
        for [c3, c2, c1, c0] in [
            [1.0, -6.0, 11.0, -6.0],
            [2.0, 0.0, 0.0, -16.0],
            [1.0, 3.0, 3.0, 1.0],
            [0.0, 1.0, -3.0, 2.0],
            [-1.0, 2.0, 5.0, 1.0],
        ] {
            let x = cubic_root(c3, c2, c1, c0).unwrap();
            assert!((((c3 * x + c2) * x + c1) * x + c0).abs() < 1e-6, "{x}");
        }
        assert_eq!(quadratic_roots(1.0, 0.0, 1.0), [None, None]);
        assert_eq!(quadratic_roots(0.0, 2.0, -4.0).into_iter().flatten().next(), Some(2.0));
    }

    #[test]
    fn the_adjugate_times_the_matrix_is_the_determinant() {
        let m = Matrix3::new(1.0, 2.0, 3.0, 0.5, -1.0, 4.0, 2.0, 2.5, -3.0);
        let product = adjugate(&m) * m;
        assert!((product - Matrix3::identity() * m.determinant()).amax() < 1e-12);
    }
}
