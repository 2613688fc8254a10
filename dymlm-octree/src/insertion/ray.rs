use super::marks::Marks;
use crate::lattice::{Key, Lattice};

/// The sensor's position, with what all rays from it share.
// The order of the fields is fixed, with the point last: the compiler multiplies the point together with the
// bytes behind it, and small integers there, read as floats, are denormal and slow.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct RayOrigin {
    resolution: f64,
    /// Distances along each axis to the upper and the lower border of the origin's cell, metres.
    borders: [[f64; 2]; 3],
    /// The cell's indices, in four bytes each, so that no padding follows the point.
    key: [u32; 3],
    pub(crate) point: [f32; 3],
}

/// Traversal of the cells between two points (Amanatides and Woo 1987), with the arithmetic of OctoMap's
/// `computeRayKeys`, operation by operation, so that the cells agree to the last one.
#[derive(Debug, Clone, Copy)]
struct Ray {
    /// Distance along the ray to the next border, for each axis, metres.
    next: [f64; 3],
    /// Distance along the ray between borders.
    between: [f64; 3],
    up: [bool; 3],
    length: f64,
}

impl RayOrigin {
    pub(crate) fn new(point: [f32; 3], key: Key, lattice: &Lattice) -> Self {
        let resolution = lattice.resolution;
        let borders = std::array::from_fn(|axis| {
            [1.0, -1.0].map(|step| {
                let border = lattice.center(key[axis]) + f64::from((step * resolution * 0.5) as f32);
                border - f64::from(point[axis])
            })
        });
        Self { resolution, borders, key: key.map(u32::from), point }
    }

    /// The cell of the sensor.
    #[inline]
    pub(crate) fn key(&self) -> Key {
        self.key.map(|index| index as u16)
    }

    /// Distance to a point as OctoMap computes it: squares summed in single precision, the root taken in
    /// double.
    #[inline]
    pub(crate) fn distance(&self, point: [f32; 3]) -> f64 {
        norm(difference(point, self.point))
    }

    /// The point at `range` on the way to `point`.
    #[inline]
    pub(crate) fn cut(&self, point: [f32; 3], range: f64) -> [f32; 3] {
        let offset = difference(point, self.point);
        let length = norm(offset) as f32;
        std::array::from_fn(|axis| self.point[axis] + offset[axis] / length * range as f32)
    }

    fn ray_to(&self, end: [f32; 3]) -> Ray {
        let offset = difference(end, self.point);
        let length = norm(offset) as f32;
        let mut ray =
            Ray { next: [f64::MAX; 3], between: [f64::MAX; 3], up: [true; 3], length: f64::from(length) };
        for (axis, offset) in offset.into_iter().enumerate() {
            let direction = f64::from(offset / length);
            if direction != 0.0 {
                ray.up[axis] = direction > 0.0;
                ray.next[axis] = self.borders[axis][usize::from(direction < 0.0)] / direction;
                ray.between[axis] = self.resolution / direction.abs();
            }
        }
        ray
    }

    /// Marks the cells from the origin's to the one before the end's as passed; none when both are the same.
    #[inline]
    pub(crate) fn pass_to<M: Marks>(&self, end: [f32; 3], end_key: Key, marks: &mut M) {
        let key = self.key();
        if end_key == key {
            return;
        }
        let ray = self.ray_to(end);
        let mut walk = Walk { next: ray.next, between: ray.between, cursor: marks.cursor(key, ray.up) };
        marks.pass(&walk.cursor);
        // The square of an offset may underflow. Such a ray has no direction; OctoMap's ends here too.
        if ray.length == 0.0 {
            return;
        }
        let steps = ray.steps_between(key, end_key);
        if !ray.surely_takes(steps) {
            let last = marks.cursor(end_key, ray.up);
            return walk.pass_until(&last, ray.length, marks);
        }
        let [x, y, z] = steps;
        let count = x + y + z;
        if x > y && x > z {
            walk.pass_steps::<0, 1, 2, M>(count, marks);
        } else if y > z {
            walk.pass_steps::<1, 2, 0, M>(count, marks);
        } else {
            walk.pass_steps::<2, 0, 1, M>(count, marks);
        }
    }
}

impl Ray {
    /// Number of steps along each axis from one cell to another; negative against the ray's direction.
    #[inline]
    fn steps_between(&self, from: Key, to: Key) -> [i32; 3] {
        std::array::from_fn(|axis| {
            let steps = i32::from(to[axis]) - i32::from(from[axis]);
            if self.up[axis] { steps } else { -steps }
        })
    }

    /// Whether the ray crosses just so many borders within its length, whatever rounding does: these steps
    /// lead to its last cell, and nothing ends it before.
    #[inline]
    fn surely_takes(&self, steps: [i32; 3]) -> bool {
        // A walk sums up to 65536 distances, each rounded by 1e-16 of the sum.
        const SLACK: f64 = 1e-9;
        let (before, after) = (self.length * (1.0 - SLACK), self.length * (1.0 + SLACK));
        (0..3).all(|axis| {
            let border = |i: i32| self.next[axis] + f64::from(i) * self.between[axis];
            border(steps[axis] - 1) < before && border(steps[axis]) > after
        })
    }
}

/// A ray on its way.
struct Walk<P> {
    /// Distance along the ray to the next border, for each axis, metres.
    next: [f64; 3],
    /// Distance along the ray between borders.
    between: [f64; 3],
    cursor: P,
}

impl<P: Copy> Walk<P> {
    /// Takes a number of steps, and marks every cell that one of them leaves. `MAIN` is the axis with most
    /// steps: as long as the ray takes these, there is one comparison a cell.
    #[inline]
    fn pass_steps<const MAIN: usize, const B: usize, const C: usize, M: Marks<Cursor = P>>(
        &mut self,
        mut count: i32,
        marks: &mut M,
    ) {
        while count > 0 {
            count = if self.crosses_first::<B, C>() {
                self.pass_run::<MAIN, B, M>(count, marks)
            } else {
                self.pass_run::<MAIN, C, M>(count, marks)
            };
        }
    }

    /// Takes the steps along `MAIN` before the next one along `SIDE`, then this one. Returns how many of
    /// `count` steps are left.
    #[inline]
    fn pass_run<const MAIN: usize, const SIDE: usize, M: Marks<Cursor = P>>(
        &mut self,
        mut count: i32,
        marks: &mut M,
    ) -> i32 {
        while self.crosses_first::<MAIN, SIDE>() {
            marks.pass(&self.cursor);
            self.step::<MAIN, M>();
            count -= 1;
            if count == 0 {
                return 0;
            }
        }
        marks.pass(&self.cursor);
        self.step::<SIDE, M>();
        count - 1
    }

    /// Takes steps to the cell `last`, or as far as the ray's length: rounding may carry it past its last
    /// cell. Marks every cell that a step leaves.
    fn pass_until<M: Marks<Cursor = P>>(&mut self, last: &P, length: f64, marks: &mut M) {
        while !M::same(&self.cursor, last) && self.next.iter().any(|&border| border <= length) {
            marks.pass(&self.cursor);
            if self.crosses_first::<2, 1>() && self.crosses_first::<2, 0>() {
                self.step::<2, M>();
            } else if self.crosses_first::<1, 0>() {
                self.step::<1, M>();
            } else {
                self.step::<0, M>();
            }
        }
    }

    /// Whether the next border along `A` comes before the one along `B`. Of two at the same distance OctoMap
    /// takes z before y before x.
    #[inline]
    fn crosses_first<const A: usize, const B: usize>(&self) -> bool {
        if A > B { self.next[A] <= self.next[B] } else { self.next[A] < self.next[B] }
    }

    /// Enters the next cell along an axis.
    #[inline]
    fn step<const AXIS: usize, M: Marks<Cursor = P>>(&mut self) {
        self.next[AXIS] += self.between[AXIS];
        M::advance::<AXIS>(&mut self.cursor);
    }
}

#[inline]
fn difference(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// OctoMap's `norm`.
#[inline]
fn norm(v: [f32; 3]) -> f64 {
    f64::from(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}
