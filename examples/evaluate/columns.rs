use std::collections::BTreeMap;

use serde::Serialize;

/// A block of columns of the table, one block for each map.
pub(crate) struct Block {
    /// Name of the map that is measured.
    pub(crate) title: &'static str,
    /// The figures.
    pub(crate) columns: &'static [Column],
}

/// One figure of the table.
pub(crate) struct Column {
    /// Name in [`Scores`] and in the JSON file.
    pub(crate) key: &'static str,
    heading: &'static str,
    unit: Unit,
}

/// How a figure in SI units is printed.
#[derive(Clone, Copy)]
enum Unit {
    /// A share, 0..=1, as per cent with this many decimals.
    Percent(usize),
    Millimetres,
    /// Radians as degrees.
    Degrees,
    Milliseconds,
    /// Seconds; infinite for an event that never happens.
    Seconds,
    /// A count for each map: the mean of several has decimals.
    Count,
    Plain,
}

/// The figures of one row by their columns' keys; SI units, shares as 0..=1. Figures that were not measured
/// are missing.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[serde(transparent)]
pub(crate) struct Scores(BTreeMap<&'static str, f64>);

const fn column(key: &'static str, heading: &'static str, unit: Unit) -> Column {
    Column { key, heading, unit }
}

/// The whole table.
pub(crate) const BLOCKS: &[Block] = &[
    Block {
        title: "Boxes and masks of movers",
        columns: &[
            column("mask.recall", "mask recall", Unit::Percent(2)),
            column("mask.precision", "precision", Unit::Percent(2)),
            column("boxes.misses", "misses", Unit::Count),
            column("boxes.recovered", "recovered", Unit::Percent(1)),
            column("boxes.mota", "MOTA", Unit::Percent(1)),
            column("boxes.idf1", "IDF1", Unit::Percent(1)),
        ],
    },
    Block {
        title: "Cloud",
        columns: &[
            column("cloud.residue", "residue", Unit::Percent(4)),
            column("cloud.stray", "stray", Unit::Percent(2)),
            column("cloud.completeness", "complete", Unit::Percent(2)),
            column("cloud.completeness_near_people", "near people", Unit::Percent(2)),
            column("cloud.completeness_of_thin_things", "thin things", Unit::Percent(2)),
            column("cloud.undetected_residue", "of undetected", Unit::Percent(4)),
            column("cloud.seen_residue", "residue looked through", Unit::Percent(4)),
            column("cloud.median", "median", Unit::Millimetres),
            column("cloud.p95", "95 %", Unit::Millimetres),
            column("cloud.wall_thickness", "walls' thickness", Unit::Millimetres),
            column("cloud.wall_thickness_p95", "95 %", Unit::Millimetres),
            column("cloud.static_accuracy", "SA", Unit::Percent(2)),
            column("cloud.dynamic_accuracy", "DA", Unit::Percent(2)),
            column("cloud.associated_accuracy", "AA", Unit::Percent(2)),
            column("cloud.harmonic_accuracy", "HA", Unit::Percent(2)),
        ],
    },
    Block {
        title: "Trajectory",
        columns: &[
            column("trajectory.translation", "ATE", Unit::Millimetres),
            column("trajectory.rotation", "rotation", Unit::Degrees),
        ],
    },
    Block {
        title: "Octree",
        columns: &[
            column("octree.ghosts", "ghosts", Unit::Percent(3)),
            column("octree.false_occupied", "false occupied", Unit::Percent(3)),
            column("octree.free", "free", Unit::Percent(2)),
            column("octree.completeness", "complete", Unit::Percent(2)),
            column("octree.false_free", "false free", Unit::Percent(2)),
            column("octree.median", "median", Unit::Millimetres),
            column("octree.p95", "95 %", Unit::Millimetres),
            column("octree.residue", "residue", Unit::Percent(4)),
        ],
    },
    Block {
        title: "Planes",
        columns: &[
            column("planes.faces", "faces", Unit::Count),
            column("planes.recall", "recall", Unit::Percent(1)),
            column("planes.precision", "precision", Unit::Percent(1)),
            column("planes.duplicates", "duplicates", Unit::Count),
            column("planes.merged", "wrongly merged", Unit::Count),
            column("planes.angle", "angle", Unit::Degrees),
            column("planes.offset", "offset", Unit::Millimetres),
            column("planes.boundary_iou", "boundary IoU", Unit::Plain),
        ],
    },
    Block {
        title: "Objects",
        columns: &[
            column("objects.objects", "objects", Unit::Count),
            column("objects.recall", "recall", Unit::Percent(1)),
            column("objects.recall_of_detected", "of detected", Unit::Percent(1)),
            column("objects.precision", "precision", Unit::Percent(1)),
            column("objects.duplicates", "duplicates", Unit::Count),
            column("objects.iou", "3D IoU", Unit::Plain),
            column("objects.center", "centre", Unit::Millimetres),
            column("objects.yaw", "yaw", Unit::Degrees),
            column("objects.labels", "labels", Unit::Percent(1)),
        ],
    },
    Block {
        title: "What is pushed, placed and taken away: how long a map holds what is gone, from the third look through each cell on; time from the first look at a place until each map holds it filled (there) to the end; share of the cells that nobody has looked through again",
        columns: &[
            column("changes.cloud.gone", "cloud: gone", Unit::Seconds),
            column("changes.octree.gone", "octree: gone", Unit::Seconds),
            column("changes.planes.gone", "planes: gone", Unit::Seconds),
            column("changes.objects.gone", "objects: gone", Unit::Seconds),
            column("changes.cloud.there", "cloud: there", Unit::Seconds),
            column("changes.octree.there", "octree: there", Unit::Seconds),
            column("changes.planes.there", "planes: there", Unit::Seconds),
            column("changes.objects.there", "objects: there", Unit::Seconds),
            column("changes.cloud.unseen", "never seen again", Unit::Percent(1)),
        ],
    },
    Block {
        title: "Speed (two sequences at once on two cores): median of each step and 95 % of the whole, ms a frame",
        columns: &[
            column("speed.dynamics", "dynamics", Unit::Milliseconds),
            column("speed.cloud", "cloud", Unit::Milliseconds),
            column("speed.octree", "octree", Unit::Milliseconds),
            column("speed.plane_detection", "planes: detect", Unit::Milliseconds),
            column("speed.plane_map", "map", Unit::Milliseconds),
            column("speed.objects", "objects", Unit::Milliseconds),
            column("speed.insert", "insert", Unit::Milliseconds),
            column("speed.insert_p95", "95 %", Unit::Milliseconds),
        ],
    },
];

impl Column {
    /// Heading with unit.
    pub(crate) fn title(&self) -> String {
        match self.unit {
            Unit::Percent(_) => format!("{} %", self.heading.trim_end_matches(" %")),
            Unit::Millimetres => format!("{} mm", self.heading),
            Unit::Degrees => format!("{} deg", self.heading),
            Unit::Seconds => format!("{} s", self.heading),
            Unit::Milliseconds | Unit::Count | Unit::Plain => self.heading.to_owned(),
        }
    }

    /// A figure as text; a dash for one that was not measured.
    pub(crate) fn format(&self, value: Option<f64>) -> String {
        let Some(value) = value else { return "-".to_owned() };
        match self.unit {
            Unit::Percent(decimals) => format!("{:.decimals$}", 100.0 * value),
            Unit::Degrees => format!("{:.2}", value.to_degrees()),
            Unit::Millimetres | Unit::Milliseconds => format!("{:.1}", 1e3 * value),
            Unit::Seconds if value.is_infinite() => "never".to_owned(),
            Unit::Count if value.fract() == 0.0 => format!("{value:.0}"),
            Unit::Count | Unit::Seconds => format!("{value:.1}"),
            Unit::Plain => format!("{value:.2}"),
        }
    }
}

impl Scores {
    /// Notes a figure, if there is one.
    pub(crate) fn set(&mut self, key: &'static str, value: impl Into<Option<f64>>) {
        assert!(
            BLOCKS.iter().any(|block| block.columns.iter().any(|column| column.key == key)),
            "no column {key}"
        );
        if let Some(value) = value.into() {
            self.0.insert(key, value);
        }
    }

    /// A figure, if it was measured.
    pub(crate) fn get(&self, key: &str) -> Option<f64> {
        self.0.get(key).copied()
    }

    /// Removes the times, the only figures that are not the same on each run.
    pub(crate) fn remove_times(&mut self) {
        self.0.retain(|key, _| !key.starts_with("speed."));
    }

    /// The mean of each figure over the rows that have it.
    pub(crate) fn mean(rows: &[&Self]) -> Self {
        let mut sums: BTreeMap<&'static str, (f64, f64)> = BTreeMap::new();
        for (&key, &value) in rows.iter().flat_map(|row| &row.0) {
            let (sum, count) = sums.entry(key).or_default();
            *sum += value;
            *count += 1.0;
        }
        Self(sums.into_iter().map(|(key, (sum, count))| (key, sum / count)).collect())
    }
}
