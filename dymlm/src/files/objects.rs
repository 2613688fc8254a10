use dymlm_io::{ObjectRecord, ShapeRecord};
use dymlm_objects::{MapObject, ObjectMap, ShapeKind};

/// The confirmed objects of a map, as `objects.json` holds them.
pub fn object_records(objects: &ObjectMap) -> Vec<ObjectRecord> {
    objects.objects().map(object_record).collect()
}

pub(super) fn object_record(object: &MapObject) -> ObjectRecord {
    let oriented_box = object.oriented_box();
    ObjectRecord {
        id: object.id().get(),
        label: object.label().to_owned(),
        score: object.score(),
        shape: match object.shape().kind() {
            ShapeKind::Ellipsoid => ShapeRecord::Ellipsoid,
            ShapeKind::Cuboid => ShapeRecord::Cuboid,
        },
        rotation: oriented_box.world_from_box().quaternion(),
        translation: oriented_box.center(),
        dimensions: oriented_box.lengths(),
        observations: object.observations(),
        points: object.point_count(),
    }
}
