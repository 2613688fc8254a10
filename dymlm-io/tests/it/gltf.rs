//! Maps as glTF: that the file is what the specification of glTF 2.0 says. Khronos' validator says so, too:
//! `tests/viewers/validate_glb.mjs`.
#![cfg(feature = "gltf")]
use dymlm_core::PointCloud;
use dymlm_io::{ObjectRecord, PlaneRecord, ShapeRecord, encode_glb};
use serde_json::Value;

fn plane(id: u64) -> PlaneRecord {
    let square =
        |side: f64| [[-side, -side], [side, -side], [side, side], [-side, side]].map(|[x, y]| [x, y, 0.5]);
    let mut hole = square(0.25).to_vec();
    hole.reverse();
    PlaneRecord {
        id,
        normal: [0.0, 0.0, 1.0],
        d: -0.5,
        centroid: [0.0, 0.0, 0.5],
        area_m2: 3.75,
        observations: 7,
        inliers: 9000,
        boundary: vec![square(1.0).to_vec(), hole],
    }
}

fn object(id: u64, shape: ShapeRecord) -> ObjectRecord {
    ObjectRecord {
        id,
        label: "chair \"2\"".into(),
        score: 0.8,
        shape,
        rotation: [0.0, 0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt()],
        translation: [1.0, 2.0, 0.5],
        dimensions: [0.4, 0.5, 1.0],
        observations: 5,
        points: 100,
    }
}

fn glb(cloud: &PointCloud, planes: &[PlaneRecord], objects: &[ObjectRecord]) -> Vec<u8> {
    let mut file = Vec::new();
    encode_glb(&mut file, cloud, planes, objects, [0.0, 0.0, 1.0]).unwrap();
    file
}

fn word(file: &[u8], at: usize) -> usize {
    u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize
}

/// A file's JSON and bytes, after a look at its frame.
fn parts(file: &[u8]) -> (Value, Vec<u8>) {
    assert_eq!((&file[..4], word(file, 4), word(file, 8)), (&b"glTF"[..], 2, file.len()));
    let length = word(file, 12);
    assert_eq!((&file[16..20], length % 4), (&b"JSON"[..], 0));
    let json: Value = serde_json::from_slice(&file[20..20 + length]).unwrap();
    let rest = &file[20 + length..];
    if rest.is_empty() {
        assert!(json.get("buffers").is_none());
        return (json, Vec::new());
    }
    assert_eq!((&rest[4..8], word(rest, 0)), (&b"BIN\0"[..], rest.len() - 8));
    assert_eq!(json["buffers"][0]["byteLength"].as_u64().unwrap() as usize, rest.len() - 8);
    (json, rest[8..].to_vec())
}

fn number(value: &Value) -> usize {
    value.as_u64().unwrap_or(0) as usize
}

/// The numbers of an accessor, after a look at its bounds.
fn numbers(json: &Value, bytes: &[u8], index: &Value) -> Vec<Vec<f64>> {
    let accessor = &json["accessors"][number(index)];
    let view = &json["bufferViews"][number(&accessor["bufferView"])];
    let count = if accessor["type"] == "VEC3" { 3 } else { 1 };
    let size = match number(&accessor["componentType"]) {
        5123 => 2,
        5125 | 5126 => 4,
        other => unreachable!("component type {other}"),
    };
    let stride = view.get("byteStride").map_or(size * count, number);
    let (start, inner) = (number(&view["byteOffset"]), number(&accessor["byteOffset"]));
    let elements = number(&accessor["count"]);
    assert!(
        elements > 0 && start.is_multiple_of(4) && stride.is_multiple_of(4) && inner.is_multiple_of(size)
    );
    assert!(inner + stride * (elements - 1) + size * count <= number(&view["byteLength"]));
    assert!(start + number(&view["byteLength"]) <= bytes.len());
    let component = |at: usize| {
        let bytes = &bytes[at..at + size];
        match number(&accessor["componentType"]) {
            5123 => f64::from(u16::from_le_bytes(bytes.try_into().unwrap())) / 65535.0,
            5125 => f64::from(u32::from_le_bytes(bytes.try_into().unwrap())),
            _ => f64::from(f32::from_le_bytes(bytes.try_into().unwrap())),
        }
    };
    let element = |i: usize| (0..count).map(|c| component(start + inner + i * stride + c * size)).collect();
    let elements: Vec<Vec<f64>> = (0..elements).map(element).collect();
    for (name, pick) in [("min", f64::min as fn(f64, f64) -> f64), ("max", f64::max)] {
        let Some(bound) = accessor.get(name).filter(|bound| !bound.is_null()) else { continue };
        for axis in 0..count {
            let extreme = elements.iter().map(|element| element[axis]).reduce(pick).unwrap();
            assert_eq!(bound[axis].as_f64().unwrap(), extreme);
        }
    }
    elements
}

#[test]
fn every_accessor_is_within_its_bytes_and_bounds() {
    let cloud = PointCloud::with_colors(
        vec![[0.1, 0.2, 0.3], [f32::NAN; 3], [-1.0, 5.5, 2.0]],
        vec![[255, 0, 0], [9; 3], [188; 3]],
    )
    .unwrap();
    let objects =
        [object(4, ShapeRecord::Cuboid), object(5, ShapeRecord::Ellipsoid), object(6, ShapeRecord::Cuboid)];
    let (json, bytes) = parts(&glb(&cloud, &[plane(1), plane(2)], &objects));
    let primitives: Vec<Value> = json["meshes"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|mesh| mesh["primitives"].as_array().unwrap().clone())
        .collect();
    // The cloud, and faces and lines of each thing.
    assert_eq!(primitives.len(), 1 + 2 * 5);
    for primitive in &primitives {
        let positions = numbers(&json, &bytes, &primitive["attributes"]["POSITION"]);
        let Some(indices) = primitive.get("indices").filter(|indices| !indices.is_null()) else { continue };
        let indices = numbers(&json, &bytes, indices);
        assert!(indices.iter().all(|index| (index[0] as usize) < positions.len()));
        assert_eq!(indices.len() % if number(&primitive["mode"]) == 4 { 3 } else { 2 }, 0);
    }
    let points = numbers(&json, &bytes, &primitives[0]["attributes"]["POSITION"]);
    assert_eq!(points.len(), 2, "the point that is none is left out");
    // Proportional to light: code 188 is half of it.
    let colors = numbers(&json, &bytes, &primitives[0]["attributes"]["COLOR_0"]);
    assert_eq!(colors[0], [1.0, 0.0, 0.0]);
    assert!((colors[1][0] - 0.5).abs() < 0.005);
}

#[test]
fn a_plane_has_its_hole_and_an_object_its_place() {
    let (json, bytes) = parts(&glb(&PointCloud::default(), &[plane(12)], &[object(4, ShapeRecord::Cuboid)]));
    let nodes = json["nodes"].as_array().unwrap();
    let named = |name: &str| nodes.iter().find(|node| node["name"] == name).unwrap();
    let table = named("plane 12");
    assert_eq!((&table["extras"]["id"], &table["extras"]["observations"]), (&12.into(), &7.into()));
    let faces = &json["meshes"][number(&table["mesh"])]["primitives"][0];
    let corners = numbers(&json, &bytes, &faces["attributes"]["POSITION"]);
    let indices: Vec<usize> =
        numbers(&json, &bytes, &faces["indices"]).iter().map(|i| i[0] as usize).collect();
    let area: f64 = indices
        .chunks(3)
        .map(|t| {
            let [a, b, c] = [0, 1, 2].map(|k| &corners[t[k]]);
            0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        })
        .sum();
    assert!((area - 3.75).abs() < 1e-6, "{area}");
    let material = &json["materials"][number(&faces["material"])];
    assert_eq!((&material["alphaMode"], &material["doubleSided"]), (&"BLEND".into(), &true.into()));

    let chair = named("chair \"2\"");
    assert_eq!(chair["translation"], serde_json::json!([1.0, 2.0, 0.5]));
    assert_eq!(chair["extras"]["label"], "chair \"2\"");
    assert_eq!(number(&json["scenes"][0]["nodes"][0]), nodes.len() - 1);
    assert_eq!(nodes[nodes.len() - 1]["name"], "map");
    assert_eq!(json["extensionsUsed"], serde_json::json!(["KHR_materials_unlit"]));
}

#[test]
fn what_cannot_be_drawn_is_left_out() {
    let (empty, _) = parts(&glb(&PointCloud::default(), &[], &[]));
    assert_eq!(empty["nodes"].as_array().unwrap().len(), 1);
    let mut flat = plane(1);
    flat.boundary = vec![vec![[0.0; 3], [1.0, 0.0, 0.0]]];
    let mut far = plane(2);
    far.boundary[0][0] = [1e300, 0.0, 0.5];
    let mut thin = object(1, ShapeRecord::Cuboid);
    thin.dimensions[1] = 0.0;
    let mut lost = object(2, ShapeRecord::Ellipsoid);
    lost.translation = [f64::NAN; 3];
    let mut turned = object(3, ShapeRecord::Ellipsoid);
    turned.rotation = [0.0; 4];
    let broken = glb(&PointCloud::new(vec![[f32::INFINITY; 3]]), &[flat, far], &[thin, lost, turned]);
    assert_eq!(parts(&broken).0["nodes"].as_array().unwrap().len(), 1);
}
