use dymlm_core::{PinholeCamera, Pose};
use dymlm_geometry::OrientedBox;

use super::ImageEllipse;

/// An ellipsoid as the set of its tangent planes: p^T Q p = 0 for the planes p = (normal, d) that touch it.
///
/// Q = Z diag(a^2, b^2, c^2, -1) Z^T with the semi-axes a, b, c and Z = `world_from_object`. A camera with
/// the projection matrix P sees the dual conic P Q P^T, whose tangent lines outline it: an ellipse, as long
/// as all of the ellipsoid is in front of the camera.
///
/// Rubino, Crocco, Del Bue: "3D Object Localisation from Multi-View Image Detections", PAMI 2018; Nicholson,
/// Milford, Sünderhauf: "`QuadricSLAM`", RA-L 2019.
///
/// ```
/// use dymlm_core::{PinholeCamera, Pose};
/// use dymlm_geometry::OrientedBox;
/// use dymlm_objects::DualQuadric;
///
/// // A ball of radius 0.3 m, 2 m before the camera.
/// let camera = PinholeCamera::new(640, 480, 500.0, 500.0, 320.0, 240.0)?;
/// let ball = OrientedBox::new(Pose::new([0.0, 0.0, 2.0], [0.0, 0.0, 0.0, 1.0])?, [0.6; 3])?;
/// let outline = DualQuadric::new(&ball).project(&camera, &Pose::identity()).ok_or("behind the camera")?;
/// // The tangent rays touch it before its centre: r / sqrt(d^2 - r^2) instead of r / d.
/// let radius = 500.0 * 0.3 / (2.0_f64.powi(2) - 0.3_f64.powi(2)).sqrt();
/// assert!((outline.semi_axes[0] - radius).abs() < 1e-9 && outline.center == [320.0, 240.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DualQuadric {
    oriented_box: OrientedBox,
}

impl DualQuadric {
    /// The ellipsoid inscribed in a box: its axes are the box's, its diameters the box's lengths.
    pub fn new(oriented_box: &OrientedBox) -> Self {
        Self { oriented_box: *oriented_box }
    }

    /// The box around it.
    pub fn oriented_box(&self) -> OrientedBox {
        self.oriented_box
    }

    /// The symmetric matrix Q in the world, by rows; square metres, metres and 1.
    pub fn matrix(&self) -> [[f64; 4]; 4] {
        let center = self.oriented_box.center();
        let spread = self.spread(&self.oriented_box.world_from_box());
        let center = [center[0], center[1], center[2], 1.0];
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let own = if i < 3 && j < 3 { spread[i][j] } else { 0.0 };
                own - center[i] * center[j]
            })
        })
    }

    /// Its outline in the image; `None` unless all of it is in front of the camera.
    pub fn project(&self, camera: &PinholeCamera, world_from_camera: &Pose) -> Option<ImageEllipse> {
        let camera_from_object = world_from_camera.inverse() * self.oriented_box.world_from_box();
        let [x, y, z] = camera_from_object.translation();
        let spread = self.spread(&camera_from_object);
        // The dual conic P Q P^T = K (S - c c^T) K^T in the camera frame, scaled so that its last element is
        // 1.
        let scale = z * z - spread[2][2];
        if !(z > 0.0 && scale > 0.0) {
            return None;
        }
        let conic = |i: usize, j: usize| {
            let center = [x, y, z];
            (center[i] * center[j] - spread[i][j]) / scale
        };
        // On the plane z = 1: the centre, and the shape matrix about it.
        let middle = [conic(0, 2), conic(1, 2)];
        let shape = [
            middle[0] * middle[0] - conic(0, 0),
            middle[0] * middle[1] - conic(0, 1),
            middle[1] * middle[1] - conic(1, 1),
        ];
        let (fx, fy) = (camera.fx(), camera.fy());
        let center = [fx * middle[0] + camera.cx(), fy * middle[1] + camera.cy()];
        ImageEllipse::from_shape_matrix(center, [fx * fx * shape[0], fx * fy * shape[1], fy * fy * shape[2]])
    }

    /// R diag(a^2, b^2, c^2) R^T, with R the rotation of `frame_from_object`.
    fn spread(&self, frame_from_object: &Pose) -> [[f64; 3]; 3] {
        let rows = frame_from_object.rotation_matrix();
        let squared = self.oriented_box.lengths().map(|length| 0.25 * length * length);
        std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..3).map(|k| rows[i][k] * rows[j][k] * squared[k]).sum())
        })
    }
}
