use dymlm_core::vector3::{Vector3, dot};

use super::QuickHull;

/// No number.
const NONE: u32 = u32::MAX;

/// The vertices of a hull and its edges: from a vertex that is far in one direction, few steps lead to the
/// one that is farthest in a direction near it.
#[derive(Debug, Clone, Default)]
pub(crate) struct VertexGraph {
    vertices: Vec<Vector3>,
    /// Index of each vertex's first neighbour, and the number of all neighbours at the end.
    starts: Vec<u32>,
    neighbors: Vec<u32>,
    /// The vertex number of each point.
    numbers: Vec<u32>,
}

impl VertexGraph {
    /// Takes the vertices and edges of a hull of these points.
    pub(crate) fn fill(&mut self, hull: &QuickHull, points: &[Vector3]) {
        self.numbers.clear();
        self.numbers.resize(points.len(), NONE);
        self.vertices.clear();
        self.starts.clear();
        for point in hull.triangles().flatten() {
            let number = &mut self.numbers[point as usize];
            if *number == NONE {
                *number = self.vertices.len() as u32;
                self.vertices.push(points[point as usize]);
                self.starts.push(0);
            }
            self.starts[*number as usize] += 1;
        }
        let mut count = 0;
        for start in &mut self.starts {
            count += std::mem::replace(start, count);
        }
        self.neighbors.clear();
        self.neighbors.resize(count as usize, 0);
        // Each edge is in two triangles, once in each direction.
        for triangle in hull.triangles() {
            let [a, b, c] = triangle.map(|point| self.numbers[point as usize]);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let place = &mut self.starts[from as usize];
                self.neighbors[*place as usize] = to;
                *place += 1;
            }
        }
        // Now each start is where the next vertex's neighbours begin.
        self.starts.insert(0, 0);
    }

    /// The vertices of the hull.
    pub(crate) fn vertices(&self) -> &[Vector3] {
        &self.vertices
    }

    /// Stretches the hull along the axes.
    pub(crate) fn stretch(&mut self, scales: Vector3) {
        for vertex in &mut self.vertices {
            *vertex = std::array::from_fn(|axis| scales[axis] * vertex[axis]);
        }
    }

    /// The vertex that is farthest in a direction, and how far it is; `from` is the vertex at which the
    /// search begins, a number below the count of vertices.
    ///
    /// A vertex none of whose neighbours is farther is the farthest of all, since the hull is convex.
    #[inline]
    pub(crate) fn farthest(&self, direction: Vector3, from: u32) -> (u32, f64) {
        let (mut vertex, mut reach) = (from, dot(direction, self.vertices[from as usize]));
        loop {
            let [start, end] = [0, 1].map(|after| self.starts[vertex as usize + after] as usize);
            let (mut next, mut farthest) = (vertex, reach);
            for &neighbor in &self.neighbors[start..end] {
                let along = dot(direction, self.vertices[neighbor as usize]);
                if along > farthest {
                    (next, farthest) = (neighbor, along);
                }
            }
            if next == vertex {
                return (vertex, reach);
            }
            (vertex, reach) = (next, farthest);
        }
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;

    use super::*;

    #[test]
    fn the_farthest_vertex_is_found_from_any() {
        let mut random = SplitMix64::new(2);
        let (mut hull, mut graph) = (QuickHull::default(), VertexGraph::default());
        for count in [4, 20, 300] {
            let mut vector = || -> Vector3 { [0; 3].map(|_| 2.0 * random.fraction() - 1.0) };
            let mut points: Vec<Vector3> = (0..count).map(|_| vector()).collect();
            // Corners of a cube: faces of many triangles.
            points.extend((0..8).map(|k| [0, 1, 2].map(|axis| f64::from(k >> axis & 1))));
            assert!(hull.build(&points, 0.0));
            graph.fill(&hull, &points);
            let directions: Vec<Vector3> = (0..50).map(|_| vector()).collect();
            for direction in directions.into_iter().chain([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]) {
                let expected = points.iter().map(|p| dot(direction, *p)).fold(f64::NEG_INFINITY, f64::max);
                for from in 0..graph.vertices().len() as u32 {
                    assert_eq!(graph.farthest(direction, from).1, expected);
                }
            }
        }
    }
}
