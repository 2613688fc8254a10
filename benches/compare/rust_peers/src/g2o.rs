use tiny_solver::na;

use crate::Failure;

/// An edge of a pose graph.
pub(crate) struct Edge {
    pub(crate) from: usize,
    pub(crate) to: usize,
    /// Translation and quaternion x y z w.
    pub(crate) measured: [f64; 7],
    /// Inverse covariance, rotation first.
    pub(crate) information: na::Matrix6<f64>,
}

/// Poses (translation and quaternion x y z w) and edges of a g2o file, whose information matrices have the
/// translation first.
pub(crate) fn read(path: &str) -> Result<(Vec<[f64; 7]>, Vec<Edge>), Failure> {
    let (mut poses, mut edges) = (Vec::new(), Vec::new());
    for line in std::fs::read_to_string(path)?.lines() {
        let mut words = line.split_whitespace();
        let kind = words.next().unwrap_or_default();
        let numbers: Vec<f64> = words.map(str::parse).collect::<Result<_, _>>()?;
        match (kind, numbers.as_slice()) {
            ("VERTEX_SE3:QUAT", [_, pose @ ..]) => poses.push(pose.try_into()?),
            ("EDGE_SE3:QUAT", [from, to, rest @ ..]) => {
                let (measured, triangle) = rest.split_at_checked(7).ok_or("an edge is cut short")?;
                edges.push(Edge {
                    from: *from as usize,
                    to: *to as usize,
                    measured: measured.try_into()?,
                    information: information(triangle)?,
                });
            }
            _ => {}
        }
    }
    Ok((poses, edges))
}

/// An information matrix from its upper triangle, row by row.
fn information(triangle: &[f64]) -> Result<na::Matrix6<f64>, Failure> {
    let triangle: [f64; 21] = triangle.try_into()?;
    let mut numbers = triangle.into_iter();
    let mut information = na::Matrix6::zeros();
    for k in 0..6 {
        for (l, number) in (k..6).zip(numbers.by_ref()) {
            let (row, column) = ((k + 3) % 6, (l + 3) % 6);
            (information[(row, column)], information[(column, row)]) = (number, number);
        }
    }
    Ok(information)
}
