/// Most vertices made while a box is clipped six times: two boxes need 68, rounding may add more.
const MOST_VERTICES: usize = 96;
/// Most faces: two boxes need 12.
const MOST_FACES: usize = 24;
/// Most corners of a face: two boxes need 11.
const MOST_CORNERS: usize = 23;

/// A convex polyhedron as a closed surface of faces that share vertices.
///
/// Whether a vertex is inside a half space is decided once for all its faces, and neighbouring faces cut an
/// edge at the same new vertex. So the surface stays closed whatever rounding decides about vertices on the
/// clipping plane, and the volume is wrong by no more than rounding, even where boxes share planes.
#[derive(Debug, Clone)]
pub(super) struct Polyhedron {
    vertices: [[f64; 3]; MOST_VERTICES],
    vertex_count: usize,
    faces: [Face; MOST_FACES],
    face_count: usize,
}

/// Vertices of a face, counterclockwise seen from outside.
#[derive(Debug, Clone, Copy)]
struct Face {
    vertices: [u8; MOST_CORNERS],
    count: u8,
}

/// An edge that passes through the clipping plane.
#[derive(Debug, Clone, Copy)]
struct CutEdge {
    inside: u8,
    outside: u8,
    /// The vertex on the plane.
    vertex: u8,
    /// The next such vertex around the new face.
    next: u8,
}

/// Edges cut by one plane: the corners of the new face.
#[derive(Debug)]
struct CutEdges {
    edges: [CutEdge; MOST_CORNERS],
    count: usize,
}

/// Corners of the six sides of a box, counterclockwise seen from outside; corner k lies on the positive side
/// of axis i where bit i of k is set.
const SIDES: [[u8; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

impl Polyhedron {
    /// A box of right-handed axes, from its corners.
    pub(super) fn cuboid(corners: [[f64; 3]; 8]) -> Self {
        let mut vertices = [[0.0; 3]; MOST_VERTICES];
        vertices[..8].copy_from_slice(&corners);
        let mut faces = [Face::EMPTY; MOST_FACES];
        for (face, side) in faces.iter_mut().zip(SIDES) {
            for vertex in side {
                face.push(vertex);
            }
        }
        Self { vertices, vertex_count: 8, faces, face_count: 6 }
    }

    /// Keeps what lies in the half space side * x[axis] <= limit.
    pub(super) fn clip(&mut self, axis: usize, side: f64, limit: f64) {
        let mut heights = [0.0; MOST_VERTICES];
        for (height, vertex) in heights.iter_mut().zip(&self.vertices[..self.vertex_count]) {
            *height = side * vertex[axis] - limit;
        }
        if heights[..self.vertex_count].iter().all(|&height| height <= 0.0) {
            return;
        }
        // The kept part of a face takes its place, or the place of an earlier face of which nothing was kept.
        let given = std::mem::take(&mut self.face_count);
        let mut cut = CutEdges::new();
        for index in 0..given {
            let face = self.faces[index];
            let mut kept = Face::EMPTY;
            self.clip_face(&face, &heights, &mut kept, &mut cut);
            self.push(kept);
        }
        // For vertices on the plane, its equation holds exactly.
        for edge in &cut.edges[..cut.count] {
            self.vertices[usize::from(edge.vertex)][axis] = side * limit;
        }
        cut.for_each_ring(|ring| self.push(ring));
    }

    /// Clips a face to its part inside, and notes its cut edges.
    fn clip_face(
        &mut self,
        face: &Face,
        heights: &[f64; MOST_VERTICES],
        kept: &mut Face,
        cut: &mut CutEdges,
    ) {
        let vertices = face.corners();
        let is_inside = |vertex: u8| heights[usize::from(vertex)] <= 0.0;
        let Some(start) = vertices.iter().position(|&vertex| is_inside(vertex)) else { return };
        // Around the face, from a vertex inside back to itself: each way out is followed by a way in.
        let round = vertices[start..].iter().chain(&vertices[..=start]).copied();
        let mut way_out = 0;
        for (from, to) in round.clone().zip(round.skip(1)) {
            match (is_inside(from), is_inside(to)) {
                (true, true) => kept.push(to),
                (true, false) => {
                    way_out = self.cut_edge(from, to, heights, cut);
                    kept.push(cut.edges[way_out].vertex);
                }
                (false, true) => {
                    // The new face runs along this one in the opposite direction.
                    let way_in = self.cut_edge(to, from, heights, cut);
                    cut.edges[way_in].next = cut.edges[way_out].vertex;
                    kept.push(cut.edges[way_in].vertex);
                    kept.push(to);
                }
                (false, false) => {}
            }
        }
    }

    /// The place of a cut edge in the list; both of its faces find the same.
    fn cut_edge(
        &mut self,
        inside: u8,
        outside: u8,
        heights: &[f64; MOST_VERTICES],
        cut: &mut CutEdges,
    ) -> usize {
        let known = &cut.edges[..cut.count];
        if let Some(place) = known.iter().position(|edge| edge.inside == inside && edge.outside == outside) {
            return place;
        }
        let (p, q) = (self.vertices[usize::from(inside)], self.vertices[usize::from(outside)]);
        let (below, above) = (heights[usize::from(inside)], heights[usize::from(outside)]);
        let share = below / (below - above);
        let vertex = self.vertex_count.min(MOST_VERTICES - 1);
        self.vertices[vertex] = std::array::from_fn(|k| p[k] + share * (q[k] - p[k]));
        self.vertex_count = vertex + 1;
        let vertex = vertex as u8;
        let place = cut.count.min(MOST_CORNERS - 1);
        cut.edges[place] = CutEdge { inside, outside, vertex, next: vertex };
        cut.count = place + 1;
        place
    }

    fn push(&mut self, face: Face) {
        if let Some(free) = self.faces.get_mut(self.face_count).filter(|_| face.count > 2) {
            *free = face;
            self.face_count += 1;
        }
    }

    /// Volume: a sixth of the sum, over the triangles of the surface, of their determinants (the divergence
    /// theorem for the field x / 3).
    pub(super) fn volume(&self) -> f64 {
        let faces = &self.faces[..self.face_count];
        let Some(first) = faces.first() else { return 0.0 };
        let origin = self.vertices[usize::from(first.vertices[0])];
        let place = |vertex: u8| -> [f64; 3] {
            std::array::from_fn(|k| self.vertices[usize::from(vertex)][k] - origin[k])
        };
        let sixfold = |face: &Face| -> f64 {
            let apex = place(face.vertices[0]);
            let triangles = face.corners()[1..].windows(2);
            triangles.map(|side| determinant(apex, place(side[0]), place(side[1]))).sum()
        };
        faces.iter().map(sixfold).sum::<f64>() / 6.0
    }
}

impl Face {
    const EMPTY: Self = Self { vertices: [0; MOST_CORNERS], count: 0 };

    fn push(&mut self, vertex: u8) {
        if let Some(free) = self.vertices.get_mut(usize::from(self.count)) {
            *free = vertex;
            self.count += 1;
        }
    }

    fn corners(&self) -> &[u8] {
        &self.vertices[..usize::from(self.count)]
    }
}

impl CutEdges {
    fn new() -> Self {
        Self { edges: [CutEdge { inside: 0, outside: 0, vertex: 0, next: 0 }; MOST_CORNERS], count: 0 }
    }

    /// The rings that the cut edges form on the plane: one, unless rounding makes more.
    fn for_each_ring(&self, mut take: impl FnMut(Face)) {
        let edges = &self.edges[..self.count];
        let mut visited = [false; MOST_CORNERS];
        for start in 0..edges.len() {
            let mut ring = Face::EMPTY;
            let mut at = start;
            while !visited[at] {
                visited[at] = true;
                ring.push(edges[at].vertex);
                at = edges.iter().position(|edge| edge.vertex == edges[at].next).unwrap_or(start);
            }
            take(ring);
        }
    }
}

fn determinant(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}
