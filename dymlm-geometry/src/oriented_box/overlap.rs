use super::OrientedBox;

/// Volume that two boxes share, cubic metres.
pub(super) fn intersection_volume(a: &OrientedBox, b: &OrientedBox) -> f64 {
    let smaller = a.volume().min(b.volume());
    let (half_a, half_b) = (a.lengths.map(|length| 0.5 * length), b.lengths.map(|length| 0.5 * length));
    let Some(b_in_a) = Placement::of(b, a).filter(|place| place.spheres_meet(half_a, half_b)) else {
        return 0.0;
    };
    let a_in_b = b_in_a.reversed();

    // Where faces of both boxes lie on one plane, those of a are kept and those of b are not: b's half spaces are
    // grown, and a's shrunk, by more than rounding and by less than anything that matters.
    let margin = 16.0 * f64::EPSILON * (half_a.iter().sum::<f64>() + half_b.iter().sum::<f64>());
    let about_center_of_a = [0.0; 3];
    let cones_over_a = cones(half_a, about_center_of_a, &a_in_b, half_b.map(|half| half + margin));
    let cones_over_b = cones(half_b, a_in_b.center, &b_in_a, half_a.map(|half| half - margin));
    ((cones_over_a + cones_over_b) / 3.0).clamp(0.0, smaller)
}

/// How a box stands in another's frame.
#[derive(Debug, Clone, Copy)]
struct Placement {
    /// Takes directions of the box to the other's frame, by rows.
    rotation: [[f64; 3]; 3],
    /// Its centre in the other's frame.
    center: [f64; 3],
}

impl Placement {
    /// `None` when the boxes are too far apart to say how far.
    fn of(own: &OrientedBox, other: &OrientedBox) -> Option<Self> {
        let (own_axes, other_axes) =
            (own.world_from_box.rotation_matrix(), other.world_from_box.rotation_matrix());
        // Far from the origin, centres are compared before anything is multiplied.
        let (from, to) = (other.center(), own.center());
        let offset: [f64; 3] = std::array::from_fn(|axis| to[axis] - from[axis]);
        let place = Self {
            rotation: std::array::from_fn(|i| {
                std::array::from_fn(|j| (0..3).map(|k| other_axes[k][i] * own_axes[k][j]).sum())
            }),
            center: std::array::from_fn(|i| (0..3).map(|k| other_axes[k][i] * offset[k]).sum()),
        };
        place.center.iter().all(|c| c.is_finite()).then_some(place)
    }

    /// How the other stands in the box's frame.
    fn reversed(&self) -> Self {
        let rotation = std::array::from_fn(|i| std::array::from_fn(|j| self.rotation[j][i]));
        let center =
            std::array::from_fn(|i| -(0..3).map(|k| self.rotation[k][i] * self.center[k]).sum::<f64>());
        Self { rotation, center }
    }

    fn spheres_meet(&self, half_a: [f64; 3], half_b: [f64; 3]) -> bool {
        let length = |v: [f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
        length(self.center) <= length(half_a) + length(half_b)
    }
}

/// Sum over the six faces of a box, each clipped to another box, of area times signed distance of `apex` (in the box's
/// frame) from the face: three times the volume of the cones from the apex over what is left of the faces.
fn cones(half: [f64; 3], apex: [f64; 3], in_clip: &Placement, clip_half: [f64; 3]) -> f64 {
    let mut sum = 0.0;
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [-1.0, 1.0] {
            let mut face = Polygon::rectangle(half[u], half[v]);
            for ((row, center), limit) in in_clip.rotation.iter().zip(in_clip.center).zip(clip_half) {
                // A coordinate of the clip box on the face, as a function of the face's two coordinates.
                let level = center + row[axis] * side * half[axis];
                face.clip([row[u], row[v]], level, limit);
                face.clip([-row[u], -row[v]], -level, limit);
            }
            sum += face.area() * (half[axis] - side * apex[axis]);
        }
    }
    sum
}

/// A convex polygon in a face's two coordinates. A rectangle has four corners, and each of six lines adds one at most.
#[derive(Debug, Clone, Copy)]
struct Polygon {
    corners: [[f64; 2]; 10],
    count: usize,
}

impl Polygon {
    fn rectangle(half_u: f64, half_v: f64) -> Self {
        let mut corners = [[0.0; 2]; 10];
        corners[..4].copy_from_slice(&[
            [-half_u, -half_v],
            [half_u, -half_v],
            [half_u, half_v],
            [-half_u, half_v],
        ]);
        Self { corners, count: 4 }
    }

    /// Keeps the part where gradient . corner + level <= limit.
    fn clip(&mut self, gradient: [f64; 2], level: f64, limit: f64) {
        let height = |corner: [f64; 2]| gradient[0] * corner[0] + gradient[1] * corner[1] + (level - limit);
        let corners = self.corners;
        let given = &corners[..self.count];
        let Some(&last) = given.last() else { return };
        self.count = 0;
        let (mut before, mut height_before) = (last, height(last));
        for &corner in given {
            let height_here = height(corner);
            if (height_before <= 0.0) != (height_here <= 0.0) {
                let share = height_before / (height_before - height_here);
                self.push(std::array::from_fn(|k| before[k] + share * (corner[k] - before[k])));
            }
            if height_here <= 0.0 {
                self.push(corner);
            }
            (before, height_before) = (corner, height_here);
        }
    }

    fn push(&mut self, corner: [f64; 2]) {
        // Rounding may make a sliver concave; what a line then adds beyond the bound is a corner of no area.
        if let Some(free) = self.corners.get_mut(self.count) {
            *free = corner;
            self.count += 1;
        }
    }

    /// Area by the shoelace formula about the first corner.
    fn area(&self) -> f64 {
        let corners = &self.corners[..self.count];
        let Some((&[u0, v0], rest)) = corners.split_first() else { return 0.0 };
        let doubled: f64 = rest
            .windows(2)
            .map(|pair| (pair[0][0] - u0) * (pair[1][1] - v0) - (pair[1][0] - u0) * (pair[0][1] - v0))
            .sum();
        0.5 * doubled
    }
}
