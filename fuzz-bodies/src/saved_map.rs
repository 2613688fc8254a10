use dymlm::files::MapSaver;
use dymlm::{MapBuilder, MultiLevelMap};
use dymlm_core::{FrameId, Pose};
use dymlm_io::MapFolderSaver;

use crate::choices::Choices;
use crate::damage::damage;
use crate::memory_folder::memory_folder;
use crate::walk::{MAP, MAPPED, SAVED, SECTIONS, WALK};

/// A folder of maps with one section damaged under valid checksums: if it loads, the maps take further frames
/// and a correction, and are saved and loaded again.
pub fn saved_map(bytes: &[u8]) {
    let mut choices = Choices::new(bytes);
    // Sections that other bodies load alone are damaged less often.
    let section = if choices.byte() < 60 { choices.below(4) } else { 4 + choices.below(4) };
    let mut sections = SAVED.clone();
    damage(sections.get_mut(SECTIONS[usize::from(section)]).unwrap(), &mut choices);

    let folder = memory_folder();
    let path = folder.path().join("map");
    let mut saver = MapFolderSaver::create(&path).unwrap();
    let write = saver.save(MAP.config(), &MAP.counts(), |folder, state| {
        MAP.write_files(folder)?;
        sections.iter().try_for_each(|(section, parts)| {
            state.section(section, |sink| parts.iter().try_for_each(|(key, bytes)| sink(*key, Some(bytes))))
        })
    });
    write.unwrap();
    drop(saver);
    let Ok((map, _)) = MultiLevelMap::load_partial(&path) else { return };
    let Ok(mut builder) = MapBuilder::resume(map) else { return };
    for frame in &WALK[MAPPED..][..2] {
        let _ = builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera);
    }
    let moved: Vec<(FrameId, Pose)> =
        builder.trajectory().map(|(id, _, pose)| (id, choices.pose() * pose)).collect();
    let _ = builder.correct_poses(&moved);
    let _ = builder.remove(FrameId::new(choices.below(16).into()));
    let _ = builder.transform(&choices.pose());

    MapSaver::create(&path).unwrap().save(builder.map()).unwrap();
    let again = MultiLevelMap::load(&path).unwrap();
    assert_eq!(again.counts(), builder.map().counts());
}
