use std::collections::BTreeMap;
use std::path::Path;

use dymlm::core::vector3::{difference, norm};
use dymlm::core::{Frame, Pose};
use dymlm::geometry::OrientedBox;
use dymlm::{FoundObject, HistoryConfig, MapBuilder, MapConfig, MultiLevelMap, SessionChanges};
use dymlm_examples::{AnyError, progress_bar};
use dymlm_sim::{PlaceChange, Sequence, SequenceConfig, SimulatedFrame};

/// Number of recordings of the first day and of the other day.
const RECORDINGS: [usize; 2] = [6, 2];
/// When the first recording begins, and the time from one to the next, seconds.
const START: f64 = 1.79e9;
const BETWEEN: f64 = 3600.0;
const DAY: f64 = 86_400.0;
/// A reported place counts as true if a true one's centre is within this distance, metres.
const NEAR: f64 = 0.5;
/// A thing counts as seen when it covers this many pixels in this many frames, and an empty place when this
/// many frames look through it.
const PIXELS: usize = 500;
const FRAMES: usize = 10;

/// A place that a thing has left or has come to.
struct ChangedPlace {
    thing: usize,
    label: &'static str,
    place: OrientedBox,
    is_left: bool,
}

/// How often the frames have shown the places.
#[derive(Default)]
struct Seen {
    /// For each thing, the number of frames in which it was seen.
    things: BTreeMap<usize, usize>,
    /// For each place, the number of frames that looked through it.
    looked_through: Vec<usize>,
}

/// A building in eight recordings, the last two of them made on another day after things were moved. Their
/// maps are merged, and the changes that the merged map reports are compared with the truth.
pub(crate) fn evaluate(seed: u64, rooms: usize, rate: f64, out: &Path) -> Result<(), AnyError> {
    let day = |day: u64| {
        let mut config = SequenceConfig::building(seed, rooms);
        config.frames = (config.frames as f64 * rate / config.frame_rate).round() as usize;
        (config.frame_rate, config.day) = (rate, day);
        Sequence::new(&config)
    };
    let days = [day(0)?, day(1)?];
    let changes = days[1].differences_from(&days[0]);
    let places: Vec<ChangedPlace> = changes.iter().flat_map(changed_places).collect();

    let mut seen = [Seen::default(), Seen::default()];
    let mut maps = Vec::new();
    for ((sequence, day), seen) in days.iter().zip(0..).zip(&mut seen) {
        seen.looked_through = vec![0; places.len()];
        for recording in 0..RECORDINGS[day] {
            let start = START + DAY * day as f64 + BETWEEN * recording as f64;
            let frames = [recording, recording + 1].map(|k| sequence.len() * k / RECORDINGS[day]);
            maps.push(record(sequence, frames[0]..frames[1], start, &places, seen)?);
        }
    }
    let map = merged(maps)?;
    map.save(out.join("recordings"))?;
    let found = map.session_changes()?;
    report(&places, &seen, &found);
    Ok(())
}

fn changed_places(change: &PlaceChange) -> impl Iterator<Item = ChangedPlace> + use<> {
    let (thing, label) = (change.id, change.label);
    let places = [(change.before, true), (change.after, false)];
    places
        .into_iter()
        .filter_map(move |(place, is_left)| Some(ChangedPlace { thing, label, place: place?, is_left }))
}

/// The map of a part of a sequence; its clock starts at `start`.
fn record(
    sequence: &Sequence,
    frames: std::ops::Range<usize>,
    start: f64,
    places: &[ChangedPlace],
    seen: &mut Seen,
) -> Result<MultiLevelMap, AnyError> {
    let mut config = MapConfig::default();
    config.history = HistoryConfig::Memory;
    let mut builder = MapBuilder::new(config)?;
    let begin = sequence.timestamp(frames.start);
    let bar = progress_bar(frames.len(), "recording");
    for index in frames {
        let Some(SimulatedFrame { mut frame, detections, world_from_camera, visible_things, .. }) =
            sequence.frame(index)
        else {
            break;
        };
        for thing in visible_things.iter().filter(|thing| thing.pixels >= PIXELS) {
            *seen.things.entry(thing.id).or_default() += 1;
        }
        for (place, looks) in places.iter().zip(&mut seen.looked_through) {
            *looks += usize::from(looks_through(&frame, &world_from_camera, &place.place));
        }
        frame.set_timestamp(frame.timestamp() - begin + start)?;
        builder.insert(&frame, &detections, &world_from_camera)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(builder.into_map())
}

/// A place that a session reports as left, or as come to.
#[derive(Clone, Copy)]
struct Told<'a> {
    object: &'a FoundObject,
    is_left: bool,
}

fn told_by(session: &SessionChanges) -> impl Iterator<Item = Told<'_>> {
    let changes = &session.changes;
    let left = changes.moved.iter().map(|moved| &moved.from).chain(&changes.vanished);
    let come = changes.moved.iter().map(|moved| &moved.to).chain(&changes.appeared);
    let left = left.map(|object| Told { object, is_left: true });
    left.chain(come.map(|object| Told { object, is_left: false }))
}

/// For each report, the place that it is about: the nearest true one that no report before it was about.
fn matched(places: &[ChangedPlace], told: &[Told<'_>]) -> Vec<Option<usize>> {
    let mut is_taken = vec![false; places.len()];
    let mut matches = Vec::with_capacity(told.len());
    for &Told { object, is_left } in told {
        let apart =
            |index: usize| norm(difference(places[index].place.center(), object.oriented_box.center()));
        let own = (0..places.len()).filter(|&index| {
            let place = &places[index];
            !is_taken[index] && place.is_left == is_left && place.label == object.label && apart(index) < NEAR
        });
        let nearest = own.min_by(|&a, &b| apart(a).total_cmp(&apart(b)));
        if let Some(index) = nearest {
            is_taken[index] = true;
        }
        matches.push(nearest);
    }
    matches
}

fn direction(is_left: bool) -> &'static str {
    if is_left { "left" } else { "come" }
}

/// Whether the ray to the middle of a place continues behind it.
fn looks_through(frame: &Frame, world_from_camera: &Pose, place: &OrientedBox) -> bool {
    let in_camera = world_from_camera.inverse().transform_point(place.center());
    let camera = frame.camera();
    let Some([u, v]) = camera.project(in_camera) else { return false };
    let is_in_image =
        (0.0..camera.width() as f64 - 1.0).contains(&u) && (0.0..camera.height() as f64 - 1.0).contains(&v);
    let radius = 0.5 * place.lengths().into_iter().fold(0.0, f64::max);
    is_in_image && f64::from(frame.depth().at(u.round() as usize, v.round() as usize)) > in_camera[2] + radius
}

/// Merges the maps in a tree, neighbours first.
fn merged(mut maps: Vec<MultiLevelMap>) -> Result<MultiLevelMap, AnyError> {
    while maps.len() > 1 {
        let mut next = Vec::new();
        let mut rest = maps.into_iter();
        while let Some(mut map) = rest.next() {
            if let Some(other) = rest.next() {
                map.merge(&other, &Pose::identity())?;
            }
            next.push(map);
        }
        maps = next;
    }
    Ok(maps.pop().ok_or("no recordings")?)
}

/// Compares the changes that the second day's sessions found with the truth. Nothing has changed within the
/// first day: what its sessions found is false.
fn report(places: &[ChangedPlace], [first, second]: &[Seen; 2], found: &[SessionChanges]) {
    for ChangedPlace { thing, label, place, is_left } in places {
        let [x, y, z] = place.center();
        println!("true: {thing} {label} {} at {x:.2} {y:.2} {z:.2}", direction(*is_left));
    }
    // The first session has found no changes.
    let (first_day, second_day) = found.split_at(found.len().min(RECORDINGS[0] - 1));
    let told: Vec<Told<'_>> = second_day.iter().flat_map(told_by).collect();
    let matched = matched(places, &told);
    let (mut asked, mut known) = (0, 0);
    for (index, place) in places.iter().enumerate() {
        let (with, without) = if place.is_left { (first, second) } else { (second, first) };
        let views = with.things.get(&place.thing).copied().unwrap_or(0);
        if views < FRAMES || without.looked_through[index] < FRAMES {
            continue;
        }
        asked += 1;
        let is_known = matched.contains(&Some(index));
        known += usize::from(is_known);
        if !is_known {
            let ([x, y, z], what) = (place.place.center(), direction(place.is_left));
            println!("missed: {} {what} at {x:.2} {y:.2} {z:.2}, {views} views", place.label);
        }
    }
    let right = matched.iter().flatten().count();
    let too_early: Vec<Told<'_>> = first_day.iter().flat_map(told_by).collect();
    let reported = told.len() + too_early.len();
    let wrong = told.iter().zip(&matched).filter(|(_, place)| place.is_none()).map(|(told, _)| told);
    for Told { object, is_left } in wrong.chain(&too_early) {
        let ([x, y, z], what) = (object.oriented_box.center(), direction(*is_left));
        let [from, to] = object.seen;
        println!(
            "wrong: {} {} {what} at {x:.2} {y:.2} {z:.2}, seen {from:.1} to {to:.1}",
            object.id, object.label
        );
    }
    for session in found {
        let changes = &session.changes;
        println!(
            "session from frame {}: {} moved, {} appeared, {} vanished",
            session.session.first,
            changes.moved.len(),
            changes.appeared.len(),
            changes.vanished.len()
        );
    }
    let share = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
    println!(
        "{asked} changed places seen both times: recall {:.1} %; {reported} reported: precision {:.1} %",
        share(known, asked),
        share(right, reported)
    );
}
