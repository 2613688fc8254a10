use dymlm::files::{object_records, plane_records};
use dymlm::{MultiLevelMap, Selection};
use dymlm_io::{encode_objects, encode_planes, encode_ply};

/// Everything that can be read from the maps, in bytes.
pub(crate) fn fingerprint(map: &MultiLevelMap) -> Vec<u8> {
    let mut bytes = fingerprint_without_ids(map);
    let planes = map.planes().iter().chain(map.planes().candidates()).map(|plane| plane.id().get());
    let objects = map.objects().objects().chain(map.objects().candidates()).map(|object| object.id().get());
    bytes.extend(planes.chain(objects).flat_map(u64::to_le_bytes));
    bytes
}

/// The same without the ids of planes and objects.
pub(crate) fn fingerprint_without_ids(map: &MultiLevelMap) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode_ply(&mut bytes, &map.cloud().point_cloud(Selection::Static)).unwrap();
    map.octree().write_ot(&mut bytes).unwrap();
    // Each record is encoded alone and all are sorted, since their order is that of their ids.
    let planes = plane_records(map.planes()).into_iter().map(|mut plane| {
        plane.id = 0;
        let mut own = Vec::new();
        encode_planes(&mut own, &[plane]).unwrap();
        own
    });
    let objects = object_records(map.objects()).into_iter().map(|mut object| {
        object.id = 0;
        let mut own = Vec::new();
        encode_objects(&mut own, &[object]).unwrap();
        own
    });
    let mut things: Vec<Vec<u8>> = planes.chain(objects).collect();
    things.sort();
    bytes.extend(things.into_iter().flatten());
    bytes
}
