use dymlm_core::Point;
use dymlm_core::vector3::{Vector3, difference, dot};

use crate::convex_polytope::{InnerCones, QuickHull, VertexGraph};
use crate::finite::is_finite;
use crate::principal_axes::PrincipalAxes;

/// With this many points or more, dropping inner points first is faster than a hull of them all.
const FEW: usize = 2048;

/// The first hull is that of the first `SAMPLE` of every `SPAN` points: neighbours share a line of the cache.
const SPAN: usize = 512;
const SAMPLE: usize = 4;

/// Points are compared with the hull of earlier points in blocks of this many; after each block the hull may
/// be computed again.
const BLOCK: usize = 4096;

/// The hull is computed again when there are more candidates than `MANY`, twice that the next time and so on,
/// plus `MANY_FOR_VERTEX` for each of its vertices. So all computations together cost little more than the
/// last one, even where the surface is full of points that no cone can tell from vertices.
const MANY: usize = 2048;
const MANY_FOR_VERTEX: usize = 4;

/// Points less than this outside the hull, in standard deviations of the cloud, are left out: a hundred
/// thousandth of the box at most, while the search is good to thousandths. Without this, each point of a
/// plane face that was turned and rounded would be a vertex.
const TOLERANCE: f64 = 1e-5;

/// The map after which a cloud has its centroid in the origin, and variance 1 along each of its principal
/// axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Whitening {
    center: Vector3,
    axes: [Vector3; 3],
    deviations: Vector3,
}

impl Whitening {
    /// `None` for a cloud in a plane, to rounding.
    pub(super) fn of(principal: &PrincipalAxes) -> Option<Self> {
        (principal.rank == 3).then(|| {
            let deviations = principal.variances.map(f64::sqrt);
            let axes = [0, 1, 2].map(|k| principal.axes[k].map(|x| x / deviations[k]));
            Self { center: principal.centroid, axes, deviations }
        })
    }

    #[inline]
    fn apply(&self, &[x, y, z]: &Point) -> Vector3 {
        let own = difference([f64::from(x), f64::from(y), f64::from(z)], self.center);
        let [a, b, c] = self.axes;
        [dot(a, own), dot(b, own), dot(c, own)]
    }
}

/// Working memory for the hull of a cloud.
#[derive(Debug, Clone, Default)]
pub(super) struct HullScratch {
    quick_hull: QuickHull,
    candidates: Vec<Vector3>,
    graph: VertexGraph,
    inner: InnerCones,
}

impl HullScratch {
    /// The hull of the finite points along their principal axes about their centroid, in metres; `None` when
    /// they are in one plane.
    pub(super) fn build(&mut self, points: &[Point], whitening: &Whitening) -> Option<&VertexGraph> {
        self.candidates.clear();
        if points.len() < FEW {
            self.candidates.extend(finite(points).map(|point| whitening.apply(point)));
        } else {
            self.gather_outer(points, whitening);
        }
        if !self.take_hull() {
            return None;
        }
        self.graph.stretch(whitening.deviations);
        Some(&self.graph)
    }

    /// Takes as candidates the points that may be on the hull.
    fn gather_outer(&mut self, points: &[Point], whitening: &Whitening) {
        let sample = points.chunks(SPAN).flat_map(|span| finite(span).take(SAMPLE));
        self.candidates.extend(sample.map(|point| whitening.apply(point)));
        let mut has_inner = self.drop_inner();
        let mut spare = MANY;
        for block in points.chunks(BLOCK) {
            self.add_outer(block, whitening, has_inner);
            if self.candidates.len() > spare + MANY_FOR_VERTEX * self.graph.vertices().len() {
                has_inner = self.drop_inner();
                spare *= 2;
            }
        }
    }

    /// Adds those of a block's points that may be on the hull.
    fn add_outer(&mut self, block: &[Point], whitening: &Whitening, has_inner: bool) {
        let Self { candidates, inner, .. } = self;
        let (fours, rest) = block.as_chunks::<4>();
        for four in fours {
            let [a, b, c, d] = four;
            let whitened = [whitening.apply(a), whitening.apply(b), whitening.apply(c), whitening.apply(d)];
            // Without a branch for each point.
            if !(has_inner && inner.contain_all(&whitened)) {
                let outer = four
                    .iter()
                    .zip(whitened)
                    .filter(|(point, own)| is_finite(point) && !(has_inner && inner.contain(*own)));
                candidates.extend(outer.map(|(_, own)| own));
            }
        }
        candidates.extend(finite(rest).map(|point| whitening.apply(point)));
    }

    /// Keeps only the vertices of the candidates' hull, and takes the region inside it; false when the
    /// candidates are in one plane.
    fn drop_inner(&mut self) -> bool {
        let is_solid = self.take_hull();
        if is_solid {
            self.inner.fill(&self.quick_hull, &self.graph);
            self.candidates.clear();
            self.candidates.extend_from_slice(self.graph.vertices());
        }
        is_solid
    }

    fn take_hull(&mut self) -> bool {
        let is_solid = self.quick_hull.build(&self.candidates, TOLERANCE);
        self.graph.fill(&self.quick_hull, &self.candidates);
        is_solid
    }
}

fn finite(points: &[Point]) -> impl Iterator<Item = &Point> {
    points.iter().filter(|point| is_finite(point))
}
