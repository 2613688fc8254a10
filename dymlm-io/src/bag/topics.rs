use std::cmp::Reverse;

use super::camera_info::{InfoCamera, camera_of};
use super::catalogue::{Catalogue, ImageTopic};
use super::pictures::{COLOR_ENCODINGS, is_color, is_depth};
use super::transforms::frame_name;

/// An image topic with its camera.
#[derive(Debug)]
pub(super) struct ChosenImages {
    pub(super) topic: String,
    pub(super) camera: InfoCamera,
}

/// The topic of depth images: the named one, or the best topic with a depth encoding.
pub(super) fn depth_topic(catalogue: &Catalogue, named: Option<&str>) -> Result<String, String> {
    if let Some(named) = named {
        return known(catalogue, named);
    }
    let candidates = catalogue.images.iter().filter(|(topic, images)| is_depth(topic, images));
    // Registered images before others, then topics named "depth", then raw before compressed, then by name.
    let merit = |(topic, images): &(&String, &ImageTopic)| {
        let registered = ["aligned_depth", "depth_registered", "registered"];
        (registered.iter().any(|word| topic.contains(word)), topic.contains("depth"), !images.is_compressed)
    };
    let best = candidates.min_by_key(|candidate| (Reverse(merit(candidate)), candidate.0));
    best.map(|(topic, _)| topic.clone()).ok_or_else(|| {
        format!("no depth images (16UC1, 32FC1 or compressedDepth); {}", all_images(catalogue))
    })
}

/// The topic of colour images, if there is one.
pub(super) fn color_topic(
    catalogue: &Catalogue,
    named: Option<&str>,
    depth_frame: &str,
) -> Result<Option<String>, String> {
    if let Some(named) = named {
        return known(catalogue, named).map(Some);
    }
    let candidates =
        catalogue.images.iter().filter(|(topic, images)| is_color(images) && may_be_color(topic));
    let merit = |(topic, images): &(&String, &ImageTopic)| {
        let same_frame = frame_name(&images.frame_id) == frame_name(depth_frame);
        (same_frame, topic.contains("color") || topic.contains("rgb"), !images.is_compressed)
    };
    Ok(candidates
        .min_by_key(|candidate| (Reverse(merit(candidate)), candidate.0))
        .map(|(topic, _)| topic.clone()))
}

/// A warning about images that may be of colours, in a bag without colours that are read.
pub(super) fn unread_colors(catalogue: &Catalogue) -> Option<String> {
    let unread = catalogue
        .images
        .iter()
        .filter(|(topic, images)| may_be_color(topic) && !is_color(images) && !is_depth(topic, images));
    let topics: Vec<_> = unread.map(|(topic, images)| format!("{topic} ({})", images.encoding)).collect();
    (!topics.is_empty()).then(|| {
        format!("no colours: {} is left out, since of colours {COLOR_ENCODINGS} are read", topics.join(", "))
    })
}

fn may_be_color(topic: &str) -> bool {
    !["depth", "infra"].iter().any(|word| topic.contains(word))
}

fn known(catalogue: &Catalogue, named: &str) -> Result<String, String> {
    if catalogue.images.contains_key(named) {
        return Ok(named.to_owned());
    }
    Err(format!("no images on topic {named}; {}", all_images(catalogue)))
}

fn all_images(catalogue: &Catalogue) -> String {
    let all: Vec<_> =
        catalogue.images.iter().map(|(topic, images)| format!("{topic} ({})", images.encoding)).collect();
    if all.is_empty() {
        "there are no image topics".to_owned()
    } else {
        format!("there are: {}", all.join(", "))
    }
}

/// The topic's images with their camera: from the named `CameraInfo`, or from `camera_info` beside the
/// images, or else from the first, by name of the topic, in the images' tf frame.
pub(super) fn with_camera(
    catalogue: &Catalogue,
    topic: String,
    named_info: Option<&str>,
) -> Result<ChosenImages, String> {
    let frame = catalogue.images.get(&topic).map_or("", |images| frame_name(&images.frame_id));
    let beside = |suffix: &str| {
        let base = topic.strip_suffix(suffix)?;
        let (namespace, _) = base.rsplit_once('/')?;
        let path = format!("{namespace}/camera_info");
        catalogue.infos.contains_key(&path).then_some(path)
    };
    let info = match named_info {
        Some(named) => Some(named.to_owned()),
        None => {
            ["/compressedDepth", "/compressed", ""].iter().find_map(|suffix| beside(suffix)).or_else(|| {
                let mut of_frame = catalogue.infos.iter();
                of_frame
                    .find(|(_, info)| frame_name(&info.header.frame_id) == frame)
                    .map(|(path, _)| path.clone())
            })
        }
    };
    let Some((info, found)) = info.and_then(|path| Some((path.clone(), catalogue.infos.get(&path)?))) else {
        let all: Vec<_> = catalogue.infos.keys().map(String::as_str).collect();
        return Err(format!("no CameraInfo for {topic}; there are: {}", all.join(", ")));
    };
    let camera =
        camera_of(&found.lens, is_rectified(&topic)).map_err(|reason| format!("{info}: {reason}"))?;
    Ok(ChosenImages { topic, camera })
}

/// Whether a topic's name says that its images are rectified: `image_rect`, `image_rect_color` (ROS) and
/// `rect/image` (ZED) do, `direct_camera/image_raw` does not.
fn is_rectified(topic: &str) -> bool {
    topic.split(['/', '_']).any(|word| ["rect", "rectified"].contains(&word))
}

#[cfg(test)]
mod tests {
    use super::is_rectified;

    #[test]
    fn only_a_whole_word_says_that_images_are_rectified() {
        for topic in ["/cam/image_rect", "/cam/image_rect_color/compressed", "/zed/rgb/color/rect/image"] {
            assert!(is_rectified(topic), "{topic}");
        }
        for topic in
            ["/direct_camera/image_raw", "/director/color/image_raw", "/cam/color_corrected/image_raw"]
        {
            assert!(!is_rectified(topic), "{topic}");
        }
    }
}
