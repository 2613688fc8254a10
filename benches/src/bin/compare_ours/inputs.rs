//! Input files, each read once and kept in memory for later requests.
//!
//! - points: x, y, z as f32, nothing else;
//! - frames: for each frame the sensor's position as 3 f32, the number of points as u32, and the points, all
//!   in the world;
//! - rays: origin and direction, 6 f32 each;
//! - depth images and matrices: f32; the operation decodes them and keeps the result.

use std::collections::BTreeMap;
use std::fs;

use dymlm_core::Point;

use crate::Failure;

/// A posed scan.
pub(crate) struct Scan {
    /// Position of the sensor, world, metres.
    pub(crate) origin: Point,
    /// Readings, world, metres.
    pub(crate) points: Vec<Point>,
}

/// A ray to cast.
pub(crate) struct Ray {
    pub(crate) origin: Point,
    pub(crate) direction: Point,
}

/// The content of all files read so far.
#[derive(Default)]
pub(crate) struct Inputs {
    points: BTreeMap<String, Vec<Point>>,
    frames: BTreeMap<String, Vec<Scan>>,
    rays: BTreeMap<String, Vec<Ray>>,
    floats: BTreeMap<String, Vec<f32>>,
}

impl Inputs {
    pub(crate) fn points(&mut self, path: &str) -> Result<&[Point], Failure> {
        cached(&mut self.points, path, |numbers| Ok(numbers.as_chunks().0.to_vec()))
    }

    pub(crate) fn frames(&mut self, path: &str) -> Result<&[Scan], Failure> {
        cached(&mut self.frames, path, scans)
    }

    pub(crate) fn floats(&mut self, path: &str) -> Result<&[f32], Failure> {
        cached(&mut self.floats, path, |numbers| Ok(numbers.to_vec()))
    }

    pub(crate) fn rays(&mut self, path: &str) -> Result<&[Ray], Failure> {
        cached(&mut self.rays, path, |numbers| {
            let rays = numbers.as_chunks().0.iter();
            Ok(rays.map(|&[a, b, c, x, y, z]| Ray { origin: [a, b, c], direction: [x, y, z] }).collect())
        })
    }
}

fn cached<'a, T>(
    files: &'a mut BTreeMap<String, Vec<T>>,
    path: &str,
    decode: impl FnOnce(&[f32]) -> Result<Vec<T>, Failure>,
) -> Result<&'a [T], Failure> {
    if !files.contains_key(path) {
        let bytes = fs::read(path).map_err(|error| format!("{path}: {error}"))?;
        let numbers: Vec<f32> = bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        files.insert(path.to_owned(), decode(&numbers)?);
    }
    Ok(files.get(path).map_or(&[], Vec::as_slice))
}

fn scans(mut numbers: &[f32]) -> Result<Vec<Scan>, Failure> {
    let mut scans = Vec::new();
    while let Some((&[x, y, z, count], rest)) = numbers.split_first_chunk() {
        // The count is a u32 whose bits stand among the f32.
        let count = 3 * count.to_bits() as usize;
        let (points, rest) = rest.split_at_checked(count).ok_or("a frame is cut short")?;
        scans.push(Scan { origin: [x, y, z], points: points.as_chunks().0.to_vec() });
        numbers = rest;
    }
    Ok(scans)
}
