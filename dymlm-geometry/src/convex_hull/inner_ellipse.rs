/// An ellipse that is inside a convex polygon by more than rounding: about the polygon's centroid, with the
/// axes of its distribution of area, as large as fits.
#[derive(Debug, Clone, Copy)]
pub(super) struct InnerEllipse {
    center: [f64; 2],
    /// Lower triangle of the map that makes the ellipse a circle of radius 1: u = xx x, v = yx x + yy y.
    xx: f64,
    yx: f64,
    yy: f64,
}

/// Share of its radius by which the ellipse is smaller than what fits. An ellipse thinner than this share is
/// not used, since rounding grows with one over the thinness.
const MARGIN: f64 = 1e-6;

impl InnerEllipse {
    /// The ellipse of a hull given counter-clockwise; `None` when the hull is too narrow.
    pub(super) fn of(hull: &[[f64; 2]]) -> Option<Self> {
        let center = centroid(hull)?;
        let [cxx, cxy, cyy] = shape(hull, center);
        // The inverse of the Cholesky factor.
        let (lxx, lyx) = (cxx.sqrt(), cxy / cxx.sqrt());
        let lyy = (cyy - lyx * lyx).sqrt();
        let circle = Self { center, xx: 1.0 / lxx, yx: -lyx / (lxx * lyy), yy: 1.0 / lyy };
        let radius = (1.0 - MARGIN) * circle.distance(hull)?;
        let own = Self { center, xx: circle.xx / radius, yx: circle.yx / radius, yy: circle.yy / radius };
        let is_resolved = lyy > MARGIN * cyy.sqrt() && [own.xx, own.yx, own.yy].iter().all(|c| c.is_finite());
        is_resolved.then_some(own)
    }

    /// Whether four points are all inside; false when one is not finite.
    #[inline]
    #[allow(clippy::needless_bitwise_bool, reason = "without branches")]
    pub(super) fn contains(&self, points: &[[f64; 2]; 4]) -> bool {
        points.iter().fold(true, |all, point| {
            let [u, v] = self.in_circle(point);
            all & (u * u + v * v < 1.0)
        })
    }

    #[inline]
    fn in_circle(&self, point: &[f64; 2]) -> [f64; 2] {
        let [x, y] = [point[0] - self.center[0], point[1] - self.center[1]];
        [self.xx * x, self.yx * x + self.yy * y]
    }

    /// Distance of the hull's nearest side from the centre, after the map that makes the ellipse a circle.
    fn distance(&self, hull: &[[f64; 2]]) -> Option<f64> {
        let distances = sides(hull).map(|side| {
            let [a, b] = side.map(|end| self.in_circle(&end));
            cross(a, b) / (b[0] - a[0]).hypot(b[1] - a[1])
        });
        distances.reduce(f64::min).filter(|&least| least > 0.0)
    }
}

/// The centroid of a polygon's area.
fn centroid(hull: &[[f64; 2]]) -> Option<[f64; 2]> {
    let about = *hull.first()?;
    let (mut area, mut first) = (0.0, [0.0; 2]);
    for [a, b] in sides(hull).map(|side| side.map(|end| [end[0] - about[0], end[1] - about[1]])) {
        let doubled = cross(a, b);
        area += doubled;
        first = [first[0] + doubled * (a[0] + b[0]), first[1] + doubled * (a[1] + b[1])];
    }
    Some([about[0] + first[0] / (3.0 * area), about[1] + first[1] / (3.0 * area)])
}

/// Second moments xx, xy, yy of the triangles between a centre and the sides, each triangle taken as one
/// point: they transform with the polygon under a linear map.
fn shape(hull: &[[f64; 2]], center: [f64; 2]) -> [f64; 3] {
    let triangles = sides(hull).map(|side| side.map(|end| [end[0] - center[0], end[1] - center[1]]));
    triangles.fold([0.0; 3], |[xx, xy, yy], [a, b]| {
        let (doubled, [x, y]) = (cross(a, b), [a[0] + b[0], a[1] + b[1]]);
        [xx + doubled * x * x, xy + doubled * x * y, yy + doubled * y * y]
    })
}

fn sides(hull: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
    let next = hull.iter().skip(1).chain(hull.first());
    hull.iter().zip(next).map(|(from, to)| [*from, *to])
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
