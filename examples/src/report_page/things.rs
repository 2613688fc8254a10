use dymlm::PlaneMap;
use dymlm::core::vector3::{any_across, cross, dot};
use dymlm::core::{PlaneId, Rgb};
use dymlm::files::id_color;
use dymlm::geometry::minimum_area_rectangle;
use dymlm::objects::{MapObject, ShapeKind};
use dymlm::planes::{BoundaryPolygon, MapPlane};
use serde::Serialize;

use super::thing_history::{Event, ThingHistory};

/// A plane as the page shows it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct PagePlane {
    id: u64,
    color: Rgb,
    normal: [f64; 3],
    centroid: [f64; 3],
    /// Square metres.
    area: f64,
    /// Sides of the smallest rectangle around it, metres.
    size: [f64; 2],
    /// Root mean square distance of its points from it, metres.
    deviation: f64,
    observations: u32,
    /// Seconds, the maps' clock.
    first_seen: f64,
    last_seen: f64,
    polygons: Vec<PagePolygon>,
    events: Vec<Event>,
}

/// Corners in the world, metres.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct PagePolygon {
    outline: Vec<[f64; 3]>,
    holes: Vec<Vec<[f64; 3]>>,
}

/// An object as the page shows it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(Default))]
pub(super) struct PageObject {
    pub(super) id: u64,
    pub(super) color: Rgb,
    pub(super) label: String,
    /// Labels with their shares of the evidence, the largest first.
    pub(super) labels: Vec<(String, f64)>,
    pub(super) shape: &'static str,
    /// World from box: quaternion x y z w.
    pub(super) rotation: [f64; 4],
    pub(super) translation: [f64; 3],
    /// Full lengths along its axes, metres.
    pub(super) dimensions: [f64; 3],
    pub(super) observations: u32,
    pub(super) frames_in_view: u32,
    pub(super) points: usize,
    /// Seconds, the maps' clock.
    pub(super) first_seen: f64,
    pub(super) last_seen: f64,
    /// The plane that it stands on.
    pub(super) support: Option<u64>,
    pub(super) events: Vec<Event>,
}

/// The confirmed planes, the largest first.
pub(super) fn page_planes(planes: &PlaneMap, history: &ThingHistory) -> Vec<PagePlane> {
    let mut pages: Vec<PagePlane> = planes.iter().map(|plane| page_plane(plane, history)).collect();
    pages.sort_by(|a, b| b.area.total_cmp(&a.area));
    pages
}

fn page_plane(plane: &MapPlane, history: &ThingHistory) -> PagePlane {
    let boundary = plane.boundary();
    let size = size_of(&boundary, plane.plane().normal());
    PagePlane {
        id: plane.id().get(),
        color: id_color(plane.id().get()),
        normal: plane.plane().normal(),
        centroid: plane.centroid(),
        area: plane.area(),
        size,
        deviation: plane.mse().max(0.0).sqrt(),
        observations: plane.observations(),
        first_seen: plane.first_seen(),
        last_seen: plane.last_seen(),
        polygons: boundary.into_iter().map(page_polygon).collect(),
        events: history.of_plane(plane.id()),
    }
}

fn page_polygon(polygon: BoundaryPolygon) -> PagePolygon {
    let ring = |ring: Vec<[f64; 3]>| ring.into_iter().map(millimetres).collect();
    PagePolygon { outline: ring(polygon.outline), holes: polygon.holes.into_iter().map(ring).collect() }
}

/// Sides of the smallest rectangle around all polygons of a plane.
fn size_of(boundary: &[BoundaryPolygon], normal: [f64; 3]) -> [f64; 2] {
    let across = any_across(normal);
    let along = cross(normal, across);
    let corners = boundary.iter().flat_map(|polygon| &polygon.outline);
    let flat: Vec<[f64; 2]> = corners.map(|&corner| [dot(across, corner), dot(along, corner)]).collect();
    minimum_area_rectangle(&flat).map_or([0.0; 2], |rectangle| rectangle.lengths)
}

/// An object with its events.
pub(super) fn page_object(object: &MapObject, events: Vec<Event>) -> PageObject {
    let oriented_box = object.oriented_box();
    let mut labels: Vec<(String, f64)> = object
        .evidence()
        .iter()
        .map(|(label, _)| (label.to_owned(), object.evidence().share(label)))
        .collect();
    labels.sort_by(|a, b| b.1.total_cmp(&a.1));
    PageObject {
        id: object.id().get(),
        color: id_color(object.id().get()),
        label: object.label().to_owned(),
        labels,
        shape: match object.shape().kind() {
            ShapeKind::Cuboid => "cuboid",
            ShapeKind::Ellipsoid => "ellipsoid",
        },
        rotation: oriented_box.world_from_box().quaternion(),
        translation: oriented_box.center(),
        dimensions: oriented_box.lengths(),
        observations: object.observations(),
        frames_in_view: object.frames_in_view(),
        points: object.point_count(),
        first_seen: object.first_seen(),
        last_seen: object.last_seen(),
        support: object.support().and_then(|support| support.id).map(PlaneId::get),
        events,
    }
}

/// A place rounded to millimetres: further digits are noise and would make up most of the page.
pub(super) fn millimetres(place: [f64; 3]) -> [f64; 3] {
    place.map(|c| (c * 1e3).round() / 1e3)
}
