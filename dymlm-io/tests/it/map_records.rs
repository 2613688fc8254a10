//! Planes and objects come back from their files as they were.
use dymlm_io::{
    Error, ObjectRecord, PlaneRecord, ShapeRecord, encode_objects, encode_planes, read_objects, read_planes,
    write_atomically,
};

#[test]
fn planes_are_read_as_written_in_the_documented_form() {
    let table = PlaneRecord {
        id: 3,
        normal: [0.0, 0.6, 0.8],
        d: -0.7,
        centroid: [0.1, 0.2, 1.0 / 3.0],
        area_m2: 0.72,
        observations: 17,
        inliers: 1800,
        boundary: vec![vec![[0.0; 3], [1.2, 0.0, 0.0], [1.2, 0.48, -0.36]]],
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("planes.json");
    write_atomically(&path, |out| encode_planes(out, std::slice::from_ref(&table))).unwrap();
    assert_eq!(read_planes(&path).unwrap(), [table]);

    let value: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let plane = value["planes"][0].as_object().unwrap();
    let keys: Vec<&str> = plane.keys().map(String::as_str).collect();
    assert_eq!(keys, ["area_m2", "boundary", "centroid", "d", "id", "inliers", "normal", "observations"]);
    write_atomically(&path, |out| encode_planes(out, &[])).unwrap();
    assert_eq!(read_planes(&path).unwrap(), []);
}

#[test]
fn objects_are_read_as_written_in_the_documented_form() {
    let chair = ObjectRecord {
        id: 0,
        label: "chair".to_owned(),
        score: 0.9,
        shape: ShapeRecord::Ellipsoid,
        rotation: [0.0, 0.0, 0.6, 0.8],
        translation: [1.0, -2.0, 0.1],
        dimensions: [0.5, 0.45, 0.9],
        observations: 40,
        points: 812,
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("objects.json");
    write_atomically(&path, |out| encode_objects(out, std::slice::from_ref(&chair))).unwrap();
    assert_eq!(read_objects(&path).unwrap(), [chair]);
    let value: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    assert_eq!(value["objects"][0]["shape"], "ellipsoid");

    std::fs::write(&path, "{\"objects\": [\n{\"id\": -1}]}").unwrap();
    let error = read_objects(&path).unwrap_err();
    assert!(matches!(error, Error::Line { line: 2, .. }), "{error}");
    assert!(matches!(read_planes(folder.path().join("none.json")), Err(Error::Io { .. })));
}
