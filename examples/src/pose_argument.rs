use dymlm::core::Pose;

/// Reads a pose from text: tx ty tz qx qy qz qw, metres and a quaternion.
///
/// # Errors
///
/// The error says what is wrong.
pub fn read_pose(text: &str) -> Result<Pose, String> {
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    match numbers.map_err(|error| error.to_string())?[..] {
        [x, y, z, qx, qy, qz, qw] => {
            Pose::new([x, y, z], [qx, qy, qz, qw]).map_err(|error| error.to_string())
        }
        _ => Err("seven numbers are needed: tx ty tz qx qy qz qw".to_owned()),
    }
}
