use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::association::associate;
use super::frame::{Listing, TumFrame};
use super::list_file::{List, ListedFile, ListedPair, read_files, read_pairs};
use super::options::TumOptions;
use crate::{Error, UncoveredTime};

const ASSOCIATIONS: &str = "associations.txt";
const RGB: &str = "rgb.txt";
const DEPTH: &str = "depth.txt";

/// The frames of the lists, without poses.
pub(super) struct Lists {
    pub(super) frames: Vec<TumFrame>,
    pub(super) faults: Vec<Error>,
    pub(super) unpaired_depth_images: usize,
}

/// Reads `associations.txt` or, when there is none, pairs the images by time.
pub(super) fn read_lists(folder: &Path, options: &TumOptions) -> Result<Lists, Error> {
    let associations = folder.join(ASSOCIATIONS);
    let (list, lists) = if associations.exists() {
        let lists = read_associations(folder, &associations)?;
        (associations, lists)
    } else {
        let lists = associate_lists(folder, options.max_association_gap)?;
        (folder.join(DEPTH), lists)
    };
    if lists.frames.is_empty() {
        let reason = match lists.unpaired_depth_images {
            0 => "no frame is listed".to_owned(),
            count => format!(
                "none of {count} depth images has a colour image of {RGB} within {} s",
                options.max_association_gap
            ),
        };
        // The first bad line says more than "no frame".
        return Err(lists.faults.into_iter().next().unwrap_or_else(|| Error::malformed(&list, reason)));
    }
    Ok(lists)
}

fn read_associations(folder: &Path, path: &Path) -> Result<Lists, Error> {
    let List { entries, faults } = read_pairs(path)?;
    let depth_first = depth_comes_first(folder, &entries);
    let frames = entries
        .into_iter()
        .map(|ListedPair { first, second }| {
            let (color, depth) = if depth_first { (second, first) } else { (first, second) };
            listed_frame(folder, ASSOCIATIONS, &depth, Some((ASSOCIATIONS, &color)))
        })
        .collect();
    Ok(Lists { frames, faults, unpaired_depth_images: 0 })
}

/// Pairs `rgb.txt` and `depth.txt` by time. Without `rgb.txt` the frames have no colour.
fn associate_lists(folder: &Path, max_gap: f64) -> Result<Lists, Error> {
    let List { entries: depth, mut faults } = read_files(&folder.join(DEPTH))?;
    let rgb = folder.join(RGB);
    if !rgb.exists() {
        let frames = depth.iter().map(|depth| listed_frame(folder, DEPTH, depth, None)).collect();
        return Ok(Lists { frames, faults, unpaired_depth_images: 0 });
    }
    let List { entries: color, faults: color_faults } = read_files(&rgb)?;
    faults.extend(color_faults);
    let times = |files: &[ListedFile]| files.iter().map(|file| file.timestamp).collect::<Vec<_>>();
    let pairs = associate(&times(&color), &times(&depth), max_gap);
    let frames = pairs
        .iter()
        .map(|pair| listed_frame(folder, DEPTH, &depth[pair.depth], Some((RGB, &color[pair.color]))))
        .collect();
    Ok(Lists { frames, faults, unpaired_depth_images: depth.len() - pairs.len() })
}

fn listed_frame(
    folder: &Path,
    depth_list: &'static str,
    depth: &ListedFile,
    color: Option<(&'static str, &ListedFile)>,
) -> TumFrame {
    let depth_listing = Listing { list: depth_list, line: depth.line };
    TumFrame {
        timestamp: depth.timestamp,
        color_timestamp: color.map(|(_, file)| file.timestamp),
        depth: folder.join(&depth.path),
        color: color.map(|(_, file)| folder.join(&file.path)),
        world_from_camera: Err(UncoveredTime::Empty { timestamp: depth.timestamp }),
        depth_listing,
        color_listing: color.map_or(depth_listing, |(list, file)| Listing { list, line: file.line }),
    }
}

/// Whether `associations.txt` gives the depth image first. Each line votes by the files' names: those in
/// `rgb.txt` and `depth.txt`, or else by whether they contain "depth". Without evidence, colour comes first,
/// as the benchmark's own tool writes it.
fn depth_comes_first(folder: &Path, pairs: &[ListedPair]) -> bool {
    let names = |list: &str| -> BTreeSet<PathBuf> {
        let list = read_files(&folder.join(list)).map(|list| list.entries).unwrap_or_default();
        list.into_iter().map(|file| file.path).collect()
    };
    let (color_names, depth_names) = (names(RGB), names(DEPTH));
    let is_depth = |file: &ListedFile| {
        depth_names.contains(&file.path)
            || (!color_names.contains(&file.path) && looks_like_depth(&file.path))
    };
    let votes = |pair: &ListedPair| i64::from(is_depth(&pair.first)) - i64::from(is_depth(&pair.second));
    pairs.iter().map(votes).sum::<i64>() > 0
}

fn looks_like_depth(path: &Path) -> bool {
    path.to_string_lossy().to_ascii_lowercase().contains("depth")
}
