//! Planes and objects of a map as JSON: `planes.json`, `objects.json`.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use dymlm_core::Rgb;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::Error;

/// A finite plane of a map, as `planes.json` holds it: normal . x + d = 0 in the world, metres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlaneRecord {
    /// Stable id of the plane in its map.
    pub id: u64,
    /// Unit normal, towards the side that the plane was seen from.
    pub normal: [f64; 3],
    /// Offset, metres.
    pub d: f64,
    /// Mean of the points on it.
    pub centroid: [f64; 3],
    /// Area in which points lie on it, square metres: the boundary also holds the smallest holes.
    pub area_m2: f64,
    /// Number of frames in which it was seen.
    pub observations: u32,
    /// Number of voxels of points on it.
    pub inliers: usize,
    /// Closed rings of points on the plane, the first point not repeated: an outline, its holes, the next
    /// outline. Seen from the side that the normal points to, outlines run counterclockwise and holes
    /// clockwise.
    pub boundary: Vec<Vec<[f64; 3]>>,
}

/// The shape that an object is drawn as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ShapeRecord {
    /// A box.
    Cuboid,
    /// An ellipsoid inscribed in the object's box.
    Ellipsoid,
}

/// An object of a map, as `objects.json` holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObjectRecord {
    /// Stable id of the object in its map.
    pub id: u64,
    /// Class label.
    pub label: String,
    /// Confidence in the label, 0..=1.
    pub score: f64,
    /// Its shape.
    pub shape: ShapeRecord,
    /// World from object: quaternion x y z w.
    pub rotation: [f64; 4],
    /// World from object: the object's centre, metres.
    pub translation: [f64; 3],
    /// Full lengths along the object's axes, metres.
    pub dimensions: [f64; 3],
    /// Number of frames in which it was seen.
    pub observations: u32,
    /// Number of its points.
    pub points: usize,
}

#[derive(Serialize, Deserialize)]
struct Planes<List> {
    planes: List,
}

#[derive(Serialize, Deserialize)]
struct Objects<List> {
    objects: List,
}

/// The colour of a plane's or object's id. Successive hues differ by the golden ratio of a full circle, so
/// that neighbouring ids have different colours.
pub fn id_color(id: u64) -> Rgb {
    let hue = (id as f64 * 0.618_033_988_75).fract() * 6.0;
    let value = if id.is_multiple_of(2) { 230.0 } else { 175.0 };
    let channel = |shift: f64| {
        let along = (hue + shift).rem_euclid(6.0);
        ((along - 3.0).abs() - 1.0).clamp(0.15, 1.0) * value
    };
    [channel(0.0) as u8, channel(4.0) as u8, channel(2.0) as u8]
}

/// Writes a `planes.json` to a stream: `write_atomically(path, |out| encode_planes(out, &planes))` makes a
/// file.
///
/// # Errors
///
/// Those of the stream.
pub fn encode_planes(out: &mut dyn Write, planes: &[PlaneRecord]) -> io::Result<()> {
    encode(out, &Planes { planes })
}

/// Reads a `planes.json`.
///
/// # Errors
///
/// [`Error::Io`] when the file cannot be read, [`Error::Line`] when it is no list of planes.
pub fn read_planes(path: impl AsRef<Path>) -> Result<Vec<PlaneRecord>, Error> {
    read::<Planes<Vec<PlaneRecord>>>(path.as_ref()).map(|file| file.planes)
}

/// Writes an `objects.json` to a stream, as [`encode_planes`].
///
/// # Errors
///
/// Those of the stream.
pub fn encode_objects(out: &mut dyn Write, objects: &[ObjectRecord]) -> io::Result<()> {
    encode(out, &Objects { objects })
}

/// Reads an `objects.json`.
///
/// # Errors
///
/// [`Error::Io`] when the file cannot be read, [`Error::Line`] when it is no list of objects.
pub fn read_objects(path: impl AsRef<Path>) -> Result<Vec<ObjectRecord>, Error> {
    read::<Objects<Vec<ObjectRecord>>>(path.as_ref()).map(|file| file.objects)
}

fn encode(out: &mut dyn Write, file: &impl Serialize) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *out, file)?;
    out.write_all(b"\n")
}

fn read<File: DeserializeOwned>(path: &Path) -> Result<File, Error> {
    let bytes = fs::read(path).map_err(Error::io(path))?;
    serde_json::from_slice(&bytes).map_err(|error| Error::line(path, error.line().max(1), error.to_string()))
}
