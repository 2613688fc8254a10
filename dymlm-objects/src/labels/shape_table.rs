use std::collections::BTreeMap;

/// The shape that represents an object in the map.
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
    /// Its name in files, in lower case letters.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cuboid => "cuboid",
            Self::Ellipsoid => "ellipsoid",
        }
    }
}

/// The shapes of labels; a label that is not listed is an ellipsoid. By default the regular things of COCO
/// are cuboids, as in the paper: tv, laptop, keyboard, book and so on. In a config file, the listed labels
/// extend the default:
///
/// ```toml
/// [objects.shapes]
/// robot = "cuboid"
/// book = "ellipsoid"
/// ```
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
#[cfg_attr(
    feature = "serde",
    serde(from = "BTreeMap<String, ShapeKind>", into = "BTreeMap<String, ShapeKind>")
)]
pub struct ShapeTable {
    shapes: BTreeMap<String, ShapeKind>,
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
        self.shapes.get(label).copied().unwrap_or(ShapeKind::Ellipsoid)
    }

    /// Sets the shape of a label.
    pub fn set(&mut self, label: &str, shape: ShapeKind) {
        self.shapes.insert(label.to_owned(), shape);
    }
}

impl Default for ShapeTable {
    fn default() -> Self {
        Self { shapes: COCO_CUBOIDS.map(|label| (label.to_owned(), ShapeKind::Cuboid)).into() }
    }
}

/// The default, extended and overridden by the given shapes.
impl From<BTreeMap<String, ShapeKind>> for ShapeTable {
    fn from(given: BTreeMap<String, ShapeKind>) -> Self {
        let mut table = Self::default();
        table.shapes.extend(given);
        table
    }
}

impl From<ShapeTable> for BTreeMap<String, ShapeKind> {
    fn from(table: ShapeTable) -> Self {
        table.shapes
    }
}
