use std::io::{self, Write};

use dymlm_core::vector3::{any_across, cross, unit};
use dymlm_core::{PointCloud, Pose, Rgb};
use gltf_json::extensions::material::Unlit;
use gltf_json::material::{
    AlphaMode, EmissiveFactor, PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor,
};
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::scene::UnitQuaternion;
use gltf_json::validation::Checked;
use gltf_json::{Accessor, Index, Material, Mesh, Node, Scene, extensions};
use serde_json::json;
use serde_json::value::to_raw_value;

use super::document::Document;
use super::linear_color::linear;
use crate::shapes::{BOX_TRIANGLES, PlaneMesh, box_edges, unit_ball, unit_circles};
use crate::{ObjectRecord, PlaneRecord, ShapeRecord, id_color};

/// Opacity of the faces of planes and objects.
const ALPHA: f32 = 0.35;
/// Colour of clouds without colours.
const GREY: Rgb = [150; 3];
/// The extension that draws materials in their own colours, without lighting.
const UNLIT: &str = "KHR_materials_unlit";

/// Writes a map as one glTF 2.0 file (`.glb`) to a stream:
/// `write_atomically(path, |out| encode_glb(out, ...))` makes a file.
///
/// Below a root that turns `up` (any length) to glTF's y are three nodes: `cloud`, points with their colours;
/// `planes`, half-transparent faces with their outlines; `objects`, boxes and ellipsoids, half-transparent
/// with their edges. Each plane and object is a node of its own, named by its label, with its id and other
/// values in `extras`. Lengths are metres; colours do not depend on lighting (`KHR_materials_unlit`).
///
/// Points that are not finite are left out, as are planes without a face and objects with an invalid pose or
/// size.
///
/// # Errors
///
/// Those of the stream, and one when the file would have more than 4 GB.
pub fn encode_glb(
    out: &mut dyn Write,
    cloud: &PointCloud,
    planes: &[PlaneRecord],
    objects: &[ObjectRecord],
    up: [f64; 3],
) -> io::Result<()> {
    let mut scene = MapScene { document: Document::new(), solids: None };
    let groups = [scene.cloud(cloud), scene.planes(planes)?, scene.objects(objects)?];
    scene.complete(groups.into_iter().flatten().collect(), up);
    scene.document.encode(out)
}

struct MapScene {
    document: Document,
    /// The box and the ellipsoid of size 1, added when the first object is.
    solids: Option<[Solid; 2]>,
}

/// A shape of size 1 that the node of each object scales.
#[derive(Clone, Copy)]
struct Solid {
    face_corners: Index<Accessor>,
    faces: Index<Accessor>,
    line_corners: Index<Accessor>,
    lines: Index<Accessor>,
}

impl MapScene {
    fn cloud(&mut self, cloud: &PointCloud) -> Option<Index<Node>> {
        let colors = cloud.colors().unwrap_or_default().iter().copied().chain(std::iter::repeat(GREY));
        let finite =
            cloud.points().iter().zip(colors).filter(|(point, _)| point.iter().all(|c| c.is_finite()));
        let (points, colors): (Vec<_>, Vec<_>) = finite.map(|(point, color)| (*point, linear(color))).unzip();
        if points.is_empty() {
            return None;
        }
        let [positions, shades] = self.document.colored_positions(&points, &colors);
        let material = self.material([u8::MAX; 3], 1.0);
        let attributes = [(Semantic::Positions, positions), (Semantic::Colors(0), shades)];
        let mesh = self.mesh(vec![primitive(Mode::Points, &attributes, None, material)]);
        Some(self.document.root.push(Node {
            mesh: Some(mesh),
            name: Some("cloud".into()),
            ..Node::default()
        }))
    }

    fn planes(&mut self, planes: &[PlaneRecord]) -> io::Result<Option<Index<Node>>> {
        let mut nodes = Vec::new();
        for plane in planes {
            nodes.extend(self.plane(plane)?);
        }
        Ok(self.group("planes", nodes))
    }

    fn plane(&mut self, plane: &PlaneRecord) -> io::Result<Option<Index<Node>>> {
        let PlaneMesh { corners, triangles, rings } = PlaneMesh::of(plane);
        let corners: Vec<[f32; 3]> = corners.iter().map(|corner| corner.map(|c| c as f32)).collect();
        if triangles.is_empty() || !corners.iter().flatten().all(|c| c.is_finite()) {
            return Ok(None);
        }
        let sides = rings.into_iter().flat_map(|ring| {
            let (first, end) = (ring.start as u32, ring.end as u32);
            ring.flat_map(move |corner| {
                let next = corner as u32 + 1;
                [corner as u32, if next < end { next } else { first }]
            })
        });
        let sides: Vec<u32> = sides.collect();
        let positions = self.document.positions(&corners);
        let (faces, lines) = (self.document.indices(&triangles), self.document.indices(&sides));
        let solid = Solid { face_corners: positions, faces, line_corners: positions, lines };
        let mesh = self.solid_mesh(solid, id_color(plane.id));
        let known = json!({
            "id": plane.id, "normal": plane.normal, "d": plane.d, "area_m2": plane.area_m2,
            "observations": plane.observations,
        });
        Ok(Some(self.document.root.push(Node {
            mesh: Some(mesh),
            name: Some(format!("plane {}", plane.id)),
            extras: Some(to_raw_value(&known)?),
            ..Node::default()
        })))
    }

    fn objects(&mut self, objects: &[ObjectRecord]) -> io::Result<Option<Index<Node>>> {
        let mut nodes = Vec::new();
        for object in objects {
            nodes.extend(self.object(object)?);
        }
        Ok(self.group("objects", nodes))
    }

    fn object(&mut self, object: &ObjectRecord) -> io::Result<Option<Index<Node>>> {
        let lengths = object.dimensions.map(|c| c as f32);
        let Ok(pose) = Pose::new(object.translation, object.rotation) else { return Ok(None) };
        let place = pose.translation().map(|c| c as f32);
        if !lengths.iter().all(|&c| c > 0.0 && c.is_finite()) || !place.iter().all(|c| c.is_finite()) {
            return Ok(None);
        }
        let [cuboid, ellipsoid] = self.solids();
        let solid = match object.shape {
            ShapeRecord::Cuboid => cuboid,
            ShapeRecord::Ellipsoid => ellipsoid,
        };
        let mesh = self.solid_mesh(solid, id_color(object.id));
        let known = json!({
            "id": object.id, "label": object.label, "score": object.score, "shape": object.shape,
            "observations": object.observations,
        });
        Ok(Some(self.document.root.push(Node {
            mesh: Some(mesh),
            name: Some(object.label.clone()),
            translation: Some(place),
            rotation: Some(UnitQuaternion(pose.quaternion().map(|c| c as f32))),
            scale: Some(lengths),
            extras: Some(to_raw_value(&known)?),
            ..Node::default()
        })))
    }

    /// The box and the ellipsoid of size 1.
    fn solids(&mut self) -> [Solid; 2] {
        if let Some(solids) = self.solids {
            return solids;
        }
        let (corners, edges) = box_edges();
        let positions = self.document.positions(&corners.map(|corner| corner.map(|c| c as f32)));
        let cuboid = Solid {
            face_corners: positions,
            faces: self.document.indices(BOX_TRIANGLES.as_flattened()),
            line_corners: positions,
            lines: self.document.indices(edges.as_flattened()),
        };
        let (corners, triangles) = unit_ball();
        let corners: Vec<[f32; 3]> = corners.iter().map(|corner| corner.map(|c| c as f32)).collect();
        let circles = unit_circles();
        let rings: Vec<[f32; 3]> = circles.iter().flatten().map(|point| point.map(|c| c as f32)).collect();
        let segments = circles.first().map_or(1, |circle| circle.len() as u32);
        let sides = (0..rings.len() as u32).flat_map(|corner| {
            let ring = corner / segments * segments;
            [corner, ring + (corner - ring + 1) % segments]
        });
        let sides: Vec<u32> = sides.collect();
        let ellipsoid = Solid {
            face_corners: self.document.positions(&corners),
            faces: self.document.indices(&triangles),
            line_corners: self.document.positions(&rings),
            lines: self.document.indices(&sides),
        };
        *self.solids.insert([cuboid, ellipsoid])
    }

    /// A mesh of half-transparent faces and opaque lines.
    fn solid_mesh(&mut self, solid: Solid, color: Rgb) -> Index<Mesh> {
        let (faces, lines) = (self.material(color, ALPHA), self.material(color, 1.0));
        let faces = primitive(
            Mode::Triangles,
            &[(Semantic::Positions, solid.face_corners)],
            Some(solid.faces),
            faces,
        );
        let lines =
            primitive(Mode::Lines, &[(Semantic::Positions, solid.line_corners)], Some(solid.lines), lines);
        self.mesh(vec![faces, lines])
    }

    fn mesh(&mut self, primitives: Vec<Primitive>) -> Index<Mesh> {
        self.document.root.push(Mesh {
            extensions: None,
            extras: None,
            name: None,
            primitives,
            weights: None,
        })
    }

    fn material(&mut self, color: Rgb, alpha: f32) -> Index<Material> {
        let [r, g, b] = linear(color);
        let mode = if alpha < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque };
        let shine = PbrMetallicRoughness {
            base_color_factor: PbrBaseColorFactor([r, g, b, alpha]),
            metallic_factor: StrengthFactor(0.0),
            roughness_factor: StrengthFactor(1.0),
            ..PbrMetallicRoughness::default()
        };
        self.document.root.push(Material {
            alpha_mode: Checked::Valid(mode),
            double_sided: true,
            emissive_factor: EmissiveFactor([0.0; 3]),
            pbr_metallic_roughness: shine,
            extensions: Some(extensions::material::Material { unlit: Some(Unlit {}) }),
            ..Material::default()
        })
    }

    /// A node with the given children; `None` when there are none.
    fn group(&mut self, name: &str, nodes: Vec<Index<Node>>) -> Option<Index<Node>> {
        let node = Node { children: Some(nodes), name: Some(name.to_owned()), ..Node::default() };
        let is_empty = node.children.as_ref().is_none_or(Vec::is_empty);
        (!is_empty).then(|| self.document.root.push(node))
    }

    /// Adds the root node, which turns the map's `up` to y, and the scene.
    fn complete(&mut self, groups: Vec<Index<Node>>, up: [f64; 3]) {
        let root = &mut self.document.root;
        if !root.materials.is_empty() {
            root.extensions_used.push(UNLIT.to_owned());
        }
        let map = root.push(Node {
            children: (!groups.is_empty()).then_some(groups),
            name: Some("map".into()),
            rotation: Some(UnitQuaternion(y_up(up))),
            ..Node::default()
        });
        let name = Some("map".to_owned());
        let scene = root.push(Scene { extensions: None, extras: None, name, nodes: vec![map] });
        root.scene = Some(scene);
    }
}

/// The rotation that turns `up` to y; the identity for an `up` without a direction.
fn y_up(up: [f64; 3]) -> [f32; 4] {
    let turned = || {
        let up = unit(up)?;
        // The map's x stays as near to x as possible: viewers begin with a view along -z.
        let across = cross([0.0, 0.0, 1.0], up);
        let x =
            unit(cross(up, cross([1.0, 0.0, 0.0], up))).or_else(|| unit(across)).unwrap_or(any_across(up));
        Pose::from_rotation_matrix([x, up, cross(x, up)], [0.0; 3]).ok()
    };
    turned().unwrap_or_default().quaternion().map(|c| c as f32)
}

fn primitive(
    mode: Mode,
    attributes: &[(Semantic, Index<Accessor>)],
    indices: Option<Index<Accessor>>,
    material: Index<Material>,
) -> Primitive {
    let attributes =
        attributes.iter().map(|(semantic, of)| (Checked::Valid(semantic.clone()), *of)).collect();
    Primitive {
        attributes,
        extensions: None,
        extras: None,
        indices,
        material: Some(material),
        mode: Checked::Valid(mode),
        targets: None,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[test]
    fn up_becomes_y_without_mirroring() {
        for up in [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.3, -0.5, 0.1], [-1.0, 0.0, 0.0]] {
            let turn = Pose::new([0.0; 3], y_up(up).map(f64::from)).unwrap();
            let [x, y, z] = turn.rotate(unit(up).unwrap());
            assert!(x.abs() < 1e-6 && (y - 1.0).abs() < 1e-6 && z.abs() < 1e-6, "{up:?}");
        }
        assert_eq!(y_up([0.0; 3]), [0.0, 0.0, 0.0, 1.0]);
        assert_eq!(y_up([f64::NAN, 0.0, 1.0]), [0.0, 0.0, 0.0, 1.0]);
    }
}
