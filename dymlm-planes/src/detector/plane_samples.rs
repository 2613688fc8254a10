use dymlm_core::vector3::{dot, norm};
use dymlm_core::{PinholeCamera, Plane, record};

/// Most points that a sample stands for along rows, and along columns: it represents that many pixels. With
/// 1, half of a desk's side seen at a slant is missing.
const MOST_PARTS: f64 = 4.0;

/// Number of consecutive places that share the first one's number of points.
const NEIGHBORS: u32 = 16;

/// Most sites of a lattice. A key frame's label image has one label for each site up to its last sample, so
/// that what a file claims must be bounded: 32 MB while a key frame is inserted. A camera with a Kinect's
/// focal length has 16 million sites with an image of 268 million pixels.
pub(crate) const MOST_SITES: usize = 1 << 24;
/// Most sites of a row of a lattice.
pub(crate) const MOST_COLUMNS: usize = 1 << 16;

/// The pixels of a lattice in the image that show a plane's inliers: its patch, which can be drawn at any pose.
/// Camera frame.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "RawSamples"))]
pub struct PlaneSamples {
    pub(crate) lattice: RayLattice,
    /// Indices of lattice sites, row by row: strictly ascending, below [`MOST_SITES`].
    pub(crate) places: Vec<u32>,
}

/// Samples as they are written, before they are checked.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
#[serde(rename = "PlaneSamples")]
struct RawSamples {
    lattice: RayLattice,
    places: Vec<u32>,
}

#[cfg(feature = "serde")]
impl TryFrom<RawSamples> for PlaneSamples {
    type Error = &'static str;

    fn try_from(RawSamples { lattice, places }: RawSamples) -> Result<Self, Self::Error> {
        Self::checked(lattice, places).ok_or(
            "samples of a plane that no detector makes: places out of order or out of the image, or a lattice \
             without finite rays",
        )
    }
}

/// Rays of a lattice in the image, x and y at depth 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct RayLattice {
    pub(crate) first: [f32; 2],
    pub(crate) step: [f32; 2],
    pub(crate) columns: u32,
}

impl PlaneSamples {
    /// Samples that somebody has written; `None` for those that no detector makes.
    pub(super) fn checked(lattice: RayLattice, places: Vec<u32>) -> Option<Self> {
        let is_ascending = places.is_sorted_by(|a, b| a < b);
        let is_within = places.last().is_none_or(|&last| (last as usize) < MOST_SITES && lattice.columns > 0);
        (is_ascending && is_within && lattice.is_possible()).then_some(Self { lattice, places })
    }

    /// Removes all samples and sets a new lattice.
    pub(super) fn begin(&mut self, lattice: RayLattice) {
        self.lattice = lattice;
        self.places.clear();
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// The points where the samples' rays meet a plane, metres, row by row.
    pub fn points(&self, plane: &Plane) -> impl Iterator<Item = [f64; 3]> {
        self.lattice.centers(self.places.iter().copied(), plane)
    }
}

record!(RayLattice { first, step, columns });

impl RayLattice {
    /// The site nearest to the ray (x, y, 1), if it is in the lattice or below it.
    pub(crate) fn site(&self, ray: [f64; 2]) -> Option<usize> {
        let at = [0, 1]
            .map(|axis| ((ray[axis] - f64::from(self.first[axis])) / f64::from(self.step[axis])).round());
        let is_within =
            at[0] >= 0.0 && at[0] < self.columns.into() && at[1] >= 0.0 && at[1] < MOST_SITES as f64;
        is_within.then(|| at[1] as usize * self.columns as usize + at[0] as usize)
    }

    /// Whether its numbers are plausible; a damaged file may hold others.
    pub(crate) fn is_possible(&self) -> bool {
        let mut rays = self.first.iter().chain(&self.step);
        rays.all(|ray| ray.is_finite()) && self.columns as usize <= MOST_COLUMNS
    }

    /// The least spacing of samples along rows and columns, pixels, from `stride` upwards, with which an image
    /// has no more than [`MOST_SITES`] and [`MOST_COLUMNS`]. Only images far larger than those of today's
    /// cameras need a wider one.
    pub(crate) fn bounded_stride(camera: &PinholeCamera, stride: usize) -> usize {
        let least = camera.width().div_ceil(MOST_COLUMNS).max(stride).max(1);
        let sites = |stride: usize| camera.width().div_ceil(stride) * camera.height().div_ceil(stride);
        let widest = camera.width().max(camera.height()).max(least);
        (least..=widest).find(|&stride| sites(stride) <= MOST_SITES).unwrap_or(widest)
    }

    /// The rays of every `stride`-th pixel along rows and columns, the first one half a stride from the
    /// border.
    pub(crate) fn of_pixels(camera: &PinholeCamera, stride: usize) -> Self {
        let first = stride / 2;
        let at = |center: f64, focal_length: f64| ((first as f64 - center) / focal_length) as f32;
        Self {
            first: [at(camera.cx(), camera.fx()), at(camera.cy(), camera.fy())],
            step: [(stride as f64 / camera.fx()) as f32, (stride as f64 / camera.fy()) as f32],
            columns: camera.width().saturating_sub(first).div_ceil(stride) as u32,
        }
    }

    /// Number of points that a sample stands for along rows and along columns, so that around `point` on the
    /// plane they are at most `spacing` metres apart: at a slant or far away, samples are sparser than the
    /// voxels of a patch.
    fn parts(self, plane: &Plane, point: [f64; 3], spacing: f64) -> [u32; 2] {
        let ray = point.map(|c| c / point[2]);
        std::array::from_fn(|axis| {
            // Derivative of the point by the ray: z (e - r n_axis / n.r).
            let mut moved = point.map(|c| -c * plane.normal()[axis] / dot(plane.normal(), ray));
            moved[axis] += point[2];
            let step = norm(moved) * f64::from(self.step[axis]).abs();
            (step / spacing).ceil().clamp(1.0, MOST_PARTS) as u32
        })
    }

    /// The ray of a place.
    #[inline]
    fn ray(self, place: u32) -> [f64; 2] {
        let at = [place % self.columns.max(1), place / self.columns.max(1)].map(f64::from);
        std::array::from_fn(|axis| f64::from(self.first[axis]) + at[axis] * f64::from(self.step[axis]))
    }

    /// The points where the rays of `places` meet a plane, metres: one for each place.
    pub(crate) fn centers(
        self,
        places: impl Iterator<Item = u32>,
        plane: &Plane,
    ) -> impl Iterator<Item = [f64; 3]> {
        let plane = *plane;
        places.map(move |place| self.center(place, &plane))
    }

    /// The point where the ray of a place meets a plane, metres.
    #[inline]
    pub(crate) fn center(self, place: u32, plane: &Plane) -> [f64; 3] {
        meet(plane, self.ray(place))
    }

    /// The points where the rays of `places` (row by row) meet a plane, metres. Each sample gives as many
    /// points side by side as `spacing` requires.
    pub(crate) fn points(
        self,
        places: impl Iterator<Item = u32>,
        plane: &Plane,
        spacing: f64,
    ) -> impl Iterator<Item = [f64; 3]> {
        let plane = *plane;
        // Neighbouring places share the number of points, and how far these lie from the sample's own ray.
        let (mut neighbors, mut parts) = (u32::MAX, [Parts::default(); 2]);
        places.flat_map(move |place| {
            let [x, y] = self.ray(place);
            if place / NEIGHBORS != neighbors {
                neighbors = place / NEIGHBORS;
                let counts = self.parts(&plane, meet(&plane, [x, y]), spacing);
                parts = std::array::from_fn(|axis| Parts::new(counts[axis], f64::from(self.step[axis])));
            }
            let [columns, rows] = parts;
            rows.offsets().flat_map(move |dy| columns.offsets().map(move |dx| meet(&plane, [x + dx, y + dy])))
        })
    }
}

/// The point where the ray (x, y, 1) meets a plane.
#[inline]
fn meet(plane: &Plane, [x, y]: [f64; 2]) -> [f64; 3] {
    let normal = plane.normal();
    let z = -plane.d() / (normal[0] * x + normal[1] * y + normal[2]);
    [x * z, y * z, z]
}

/// The points for which a sample stands along one axis.
#[derive(Debug, Clone, Copy, Default)]
struct Parts {
    count: usize,
    /// Their rays, relative to the sample's.
    offsets: [f64; MOST_PARTS as usize],
}

impl Parts {
    /// `count` points, at most [`MOST_PARTS`], spread evenly over a step of the lattice.
    fn new(count: u32, step: f64) -> Self {
        let offset = |k: usize| ((k as f64 + 0.5) / f64::from(count) - 0.5) * step;
        Self { count: count as usize, offsets: std::array::from_fn(offset) }
    }

    fn offsets(self) -> impl Iterator<Item = f64> {
        self.offsets.into_iter().take(self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn huge_images_have_a_bounded_lattice() {
        let camera = |width, height| PinholeCamera::new(width, height, 525.0, 525.0, 0.0, 0.0).unwrap();
        for (width, height, stride) in
            [(640, 480, 4), (1 << 14, 1 << 14, 4), (1 << 28, 1, 1 << 12), (1, 1 << 28, 16), (1, 1, 4)]
        {
            let camera = camera(width, height);
            assert_eq!(RayLattice::bounded_stride(&camera, 4), stride, "{width}x{height}");
            assert!(RayLattice::of_pixels(&camera, stride).is_possible());
        }
        assert_eq!(RayLattice::bounded_stride(&camera(1 << 14, 1 << 14), 1), 4);
    }

    #[test]
    fn rays_meet_the_plane() {
        let lattice = RayLattice { first: [-0.5, -0.5], step: [0.5, 0.25], columns: 3 };
        let samples = PlaneSamples { lattice, places: vec![1, 5] };
        let plane = Plane::new([0.0, 0.0, -1.0], 2.0).unwrap();
        assert_eq!(samples.points(&plane).collect::<Vec<_>>(), [[0.0, -1.0, 2.0], [1.0, -0.5, 2.0]]);
        // 1 m apart along rows, half a metre along columns.
        let dense: Vec<_> = lattice.points([1, 5].into_iter(), &plane, 0.5).take(3).collect();
        assert_eq!(dense, [[-0.25, -1.0, 2.0], [0.25, -1.0, 2.0], [0.75, -0.5, 2.0]]);
    }
}
