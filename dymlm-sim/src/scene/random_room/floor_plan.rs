use parry3d::math::Vec2;

/// A rectangle of the floor (or of a table's top) that a thing takes up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Footprint {
    pub(super) center: Vec2,
    /// Rotation of the thing's axes, radians.
    pub(super) yaw: f32,
    /// Half of the lengths along the thing's axes.
    pub(super) half: Vec2,
    /// The direction of the thing's first axis.
    along: Vec2,
}

impl Footprint {
    pub(super) fn new(center: Vec2, yaw: f32, half: [f32; 2]) -> Self {
        Self { center, yaw, half: half.into(), along: Vec2::from_angle(yaw) }
    }

    /// The footprint with `margin` metres more on each side.
    pub(super) fn widened(&self, margin: f32) -> Self {
        Self { half: self.half + Vec2::splat(margin), ..*self }
    }

    fn axes(&self) -> [Vec2; 2] {
        [self.along, self.along.perp()]
    }

    /// The point with the given coordinates along the thing's axes.
    pub(super) fn point(&self, x: f32, y: f32) -> Vec2 {
        let [along, across] = self.axes();
        self.center + x * along + y * across
    }

    /// Distance of a point from the footprint, metres; 0 within.
    pub(super) fn distance(&self, point: Vec2) -> f32 {
        let [along, across] = self.axes();
        let offset = point - self.center;
        let beyond = Vec2::new(offset.dot(along).abs(), offset.dot(across).abs()) - self.half;
        beyond.max(Vec2::ZERO).length()
    }

    /// Half of its extent along a direction.
    fn reach(&self, direction: Vec2) -> f32 {
        let [along, across] = self.axes();
        self.half.x * direction.dot(along).abs() + self.half.y * direction.dot(across).abs()
    }

    /// Whether the two rectangles are at least `gap` metres apart along one of their axes (the separating
    /// axis theorem).
    fn clear_of(&self, other: &Self, gap: f32) -> bool {
        let offset = other.center - self.center;
        let parts = |axis: &Vec2| offset.dot(*axis).abs() >= self.reach(*axis) + other.reach(*axis) + gap;
        self.axes().iter().chain(&other.axes()).any(parts)
    }
}

/// The occupied parts of a rectangle about the origin.
#[derive(Debug, Clone)]
pub(super) struct FloorPlan {
    pub(super) half: Vec2,
    taken: Vec<Footprint>,
    /// Points around which nothing may stand.
    kept_free: Vec<Vec2>,
    /// How far around these points, metres.
    radius: f32,
}

impl FloorPlan {
    pub(super) fn new(half: Vec2) -> Self {
        Self { half, taken: Vec::new(), kept_free: Vec::new(), radius: 0.0 }
    }

    /// Occupies a footprint and returns true if it is within the bounds and `gap` metres clear of all others.
    pub(super) fn take(&mut self, footprint: Footprint, gap: f32) -> bool {
        let fits = self.fits(&footprint, gap);
        if fits {
            self.taken.push(footprint);
        }
        fits
    }

    /// Occupies a footprint, whatever stands there.
    pub(super) fn reserve(&mut self, footprint: Footprint) {
        self.taken.push(footprint);
    }

    pub(super) fn fits(&self, footprint: &Footprint, gap: f32) -> bool {
        let within = |axis: Vec2, half: f32| footprint.center.dot(axis).abs() + footprint.reach(axis) <= half;
        within(Vec2::X, self.half.x)
            && within(Vec2::Y, self.half.y)
            && self.taken.iter().all(|other| footprint.clear_of(other, gap))
            && self.kept_free.iter().all(|&point| footprint.distance(point) >= self.radius)
    }

    /// Keeps the floor free to `radius` metres around some points.
    pub(super) fn keep_free(&mut self, points: impl Iterator<Item = Vec2>, radius: f32) {
        self.kept_free.extend(points);
        self.radius = radius;
    }

    /// Distance of a point to the nearest wall or thing, metres; not positive where something stands.
    pub(super) fn clearance(&self, point: Vec2) -> f32 {
        let walls = (self.half - point.abs()).min_element();
        self.taken.iter().map(|footprint| footprint.distance(point)).fold(walls, f32::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn footprint() -> impl Strategy<Value = Footprint> {
        (-1.5_f32..1.5, -1.5_f32..1.5, -4.0_f32..4.0, 0.05_f32..0.8, 0.05_f32..0.8)
            .prop_map(|(x, y, yaw, a, b)| Footprint::new(Vec2::new(x, y), yaw, [a, b]))
    }

    proptest! {
        #[test]
        fn footprints_are_clear_of_each_other_when_no_point_of_one_is_in_the_other(a in footprint(), b in footprint()) {
            let nearest = |a: &Footprint, b: &Footprint| {
                let along = |k: i32, half: f32| half * (k as f32 / 20.0 - 1.0);
                (0..41 * 41)
                    .map(|k| b.distance(a.point(along(k % 41, a.half.x), along(k / 41, a.half.y))))
                    .fold(f32::INFINITY, f32::min)
            };
            let nearest = nearest(&a, &b).min(nearest(&b, &a));
            // The samples are at most 4 cm apart.
            if a.clear_of(&b, 0.0) {
                prop_assert!(nearest > 0.0);
            } else {
                prop_assert!(nearest < 0.06, "{nearest}");
            }
            prop_assert_eq!(a.clear_of(&b, 0.1), b.clear_of(&a, 0.1));
            prop_assert!(!a.clear_of(&b, 0.1) || nearest > 0.099);
        }
    }

    #[test]
    fn what_is_taken_is_taken() {
        let mut plan = FloorPlan::new(Vec2::new(2.0, 1.0));
        assert!(plan.take(Footprint::new(Vec2::new(1.0, 0.0), 0.0, [0.5, 0.5]), 0.0));
        assert!(!plan.take(Footprint::new(Vec2::new(0.3, 0.0), 0.0, [0.3, 0.3]), 0.0));
        assert!(!plan.take(Footprint::new(Vec2::new(-1.8, 0.0), 0.0, [0.3, 0.3]), 0.0));
        assert!(plan.take(Footprint::new(Vec2::new(-0.3, 0.0), 0.0, [0.3, 0.3]), 0.4));
        assert_eq!(plan.clearance(Vec2::new(0.25, 0.0)), 0.25);
        assert_eq!(plan.clearance(Vec2::new(-1.5, 0.0)), 0.5);
        assert_eq!(plan.clearance(Vec2::new(0.9, 0.2)), 0.0);
        assert!(plan.clearance(Vec2::new(0.0, 3.0)) < 0.0);
        plan.keep_free([Vec2::new(-1.5, 0.0)].into_iter(), 0.2);
        assert!(!plan.take(Footprint::new(Vec2::new(-1.2, 0.0), 0.0, [0.11, 0.5]), 0.0));
        assert!(plan.take(Footprint::new(Vec2::new(-1.2, 0.0), 0.0, [0.09, 0.5]), 0.0));
    }
}
