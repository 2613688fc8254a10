use dymlm_core::Pose;

/// An edge of a pose graph: a measurement of one pose relative to another.
#[derive(Debug, Clone, Copy)]
pub struct MeasuredPose {
    /// Index of the pose from which `to` is measured.
    pub from: usize,
    /// Index of the pose that is measured.
    pub to: usize,
    /// Takes points from `to`'s frame to `from`'s.
    pub measured: Pose,
    /// Inverse covariance, rotation first.
    pub information: [[f64; 6]; 6],
}

/// The poses and edges of a file of g2o: `VERTEX_SE3:QUAT`, numbered from 0 without gaps, and `EDGE_SE3:QUAT`,
/// whose information has the translation first.
pub fn read_g2o(text: &str) -> (Vec<Pose>, Vec<MeasuredPose>) {
    let (mut poses, mut edges) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let kind = words.next().unwrap_or_default();
        let numbers: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
        match kind {
            "VERTEX_SE3:QUAT" => {
                assert_eq!(numbers[0] as usize, poses.len(), "poses are in order");
                poses.push(pose(&numbers[1..]));
            }
            "EDGE_SE3:QUAT" => edges.push(MeasuredPose {
                from: numbers[0] as usize,
                to: numbers[1] as usize,
                measured: pose(&numbers[2..]),
                information: information(&numbers[9..]),
            }),
            _ => {}
        }
    }
    (poses, edges)
}

fn pose(numbers: &[f64]) -> Pose {
    let [x, y, z, qx, qy, qz, qw] = numbers[..7].try_into().unwrap();
    Pose::new([x, y, z], [qx, qy, qz, qw]).unwrap()
}

/// The symmetric matrix with this upper triangle, given row by row.
fn information(triangle: &[f64]) -> [[f64; 6]; 6] {
    let mut triangle = triangle.iter();
    let mut information = [[0.0; 6]; 6];
    for k in 0..6 {
        for l in k..6 {
            let (row, column) = ((k + 3) % 6, (l + 3) % 6);
            let number = *triangle.next().unwrap();
            (information[row][column], information[column][row]) = (number, number);
        }
    }
    information
}
