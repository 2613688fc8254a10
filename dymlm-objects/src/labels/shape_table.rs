/// What stands for an object in the map (DESIGN 4.5.4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum ShapeKind {
    /// A box: for regular things with flat sides.
    Cuboid,
    /// The ellipsoid inscribed in that box, a dual quadric: for round and irregular things.
    Ellipsoid,
}

impl ShapeKind {
    /// Its name in files, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cuboid => "cuboid",
            Self::Ellipsoid => "ellipsoid",
        }
    }
}

/// Which labels are boxes; all others are ellipsoids. By default the regular things of COCO, as in the paper: tv,
/// laptop, keyboard, book and so on are boxes; chair, bottle, teddy bear are not.
///
/// ```
/// use dymlm_objects::{ShapeKind, ShapeTable};
///
/// let mut shapes = ShapeTable::default();
/// assert_eq!(shapes.of("tv"), ShapeKind::Cuboid);
/// assert_eq!(shapes.of("teddy bear"), ShapeKind::Ellipsoid);
/// shapes.set("chair", ShapeKind::Cuboid);
/// assert_eq!(shapes.of("chair"), ShapeKind::Cuboid);
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "Vec<String>", into = "Vec<String>"))]
pub struct ShapeTable {
    /// Labels of boxes, ascending.
    cuboids: Vec<String>,
}

const COCO_CUBOIDS: [&str; 22] = [
    "bed",
    "bench",
    "book",
    "bus",
    "car",
    "cell phone",
    "couch",
    "dining table",
    "keyboard",
    "laptop",
    "microwave",
    "oven",
    "refrigerator",
    "remote",
    "sandwich",
    "sink",
    "suitcase",
    "toaster",
    "traffic light",
    "train",
    "truck",
    "tv",
];

impl ShapeTable {
    /// The shape of a label.
    pub fn of(&self, label: &str) -> ShapeKind {
        match self.place(label) {
            Ok(_) => ShapeKind::Cuboid,
            Err(_) => ShapeKind::Ellipsoid,
        }
    }

    /// Says which shape a label has from now on.
    pub fn set(&mut self, label: &str, shape: ShapeKind) {
        match (self.place(label), shape) {
            (Err(place), ShapeKind::Cuboid) => self.cuboids.insert(place, label.to_owned()),
            (Ok(place), ShapeKind::Ellipsoid) => {
                self.cuboids.remove(place);
            }
            _ => {}
        }
    }

    fn place(&self, label: &str) -> Result<usize, usize> {
        self.cuboids.binary_search_by(|own| own.as_str().cmp(label))
    }
}

impl Default for ShapeTable {
    fn default() -> Self {
        COCO_CUBOIDS.map(String::from).to_vec().into()
    }
}

impl From<Vec<String>> for ShapeTable {
    /// From the labels of boxes.
    fn from(mut cuboids: Vec<String>) -> Self {
        cuboids.sort_unstable();
        cuboids.dedup();
        Self { cuboids }
    }
}

impl From<ShapeTable> for Vec<String> {
    fn from(table: ShapeTable) -> Self {
        table.cuboids
    }
}
