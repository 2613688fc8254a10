use dymlm_core::Point;

/// Points that lie side by side in the grid, one slice an axis, of equal lengths.
///
/// Tests against a run are plain loops without branches over pieces of a few points, which compile to vector code.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run<'a> {
    pub(super) x: &'a [f32],
    pub(super) y: &'a [f32],
    pub(super) z: &'a [f32],
}

/// Points tested between looks at the result.
const PIECE: usize = 32;

impl<'a> Run<'a> {
    /// Number of points within the distance, counted no further than the piece that reaches `enough`.
    #[inline]
    pub(super) fn count_within(self, point: Point, squared_eps: f32, enough: u32) -> u32 {
        let mut count = 0;
        for piece in self.pieces() {
            count += piece.count_all_within(point, squared_eps);
            if count >= enough {
                break;
            }
        }
        count
    }

    /// Whether any point lies within the distance.
    #[inline]
    pub(super) fn any_within(self, point: Point, squared_eps: f32) -> bool {
        self.pieces().any(|piece| piece.count_all_within(point, squared_eps) > 0)
    }

    /// Whether any point lies within the distance of any point of another run.
    pub(super) fn any_pair_within(self, other: Self, squared_eps: f32) -> bool {
        const FEW: usize = 8;
        let (few, many) = if self.len() < other.len() { (self, other) } else { (other, self) };
        if few.len() <= FEW {
            return few.points().any(|point| many.any_within(point, squared_eps));
        }
        let bounds = many.bounds();
        few.points().any(|point| {
            squared_distance_to_box(point, bounds) <= squared_eps && many.any_within(point, squared_eps)
        })
    }

    #[inline]
    pub(super) fn len(self) -> usize {
        self.x.len()
    }

    #[inline]
    pub(super) fn is_empty(self) -> bool {
        self.x.is_empty()
    }

    #[inline]
    pub(super) fn points(self) -> impl Iterator<Item = Point> + 'a {
        self.x.iter().zip(self.y).zip(self.z).map(|((&x, &y), &z)| [x, y, z])
    }

    #[inline]
    fn pieces(self) -> impl Iterator<Item = Self> {
        let (x, y, z) = (self.x.chunks(PIECE), self.y.chunks(PIECE), self.z.chunks(PIECE));
        x.zip(y).zip(z).map(|((x, y), z)| Self { x, y, z })
    }

    #[inline]
    fn count_all_within(self, [x, y, z]: Point, squared_eps: f32) -> u32 {
        let within = self.points().map(|[other_x, other_y, other_z]| {
            let (dx, dy, dz) = (x - other_x, y - other_y, z - other_z);
            u32::from(dx * dx + dy * dy + dz * dz <= squared_eps)
        });
        within.sum()
    }

    /// Least and greatest coordinates.
    fn bounds(self) -> [Point; 2] {
        let start = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        self.points().fold(start, |[min, max], point| {
            let least = |axis: usize| if point[axis] < min[axis] { point[axis] } else { min[axis] };
            let greatest = |axis: usize| if point[axis] > max[axis] { point[axis] } else { max[axis] };
            [std::array::from_fn(least), std::array::from_fn(greatest)]
        })
    }
}

/// Never more than to any point of the box, in f32 as well: rounding is monotone.
#[inline]
fn squared_distance_to_box(point: Point, [min, max]: [Point; 2]) -> f32 {
    let [dx, dy, dz]: Point =
        std::array::from_fn(|axis| (min[axis] - point[axis]).max(point[axis] - max[axis]).max(0.0));
    dx * dx + dy * dy + dz * dz
}
