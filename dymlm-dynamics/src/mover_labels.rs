use crate::{DynamicsConfig, Error};

/// Person and the animals among the COCO classes.
const MOVERS: [&str; 11] =
    ["person", "bird", "cat", "dog", "horse", "sheep", "cow", "elephant", "bear", "zebra", "giraffe"];

/// The other COCO classes.
#[rustfmt::skip]
const OTHERS: [&str; 69] = [
    "bicycle", "car", "motorcycle", "airplane", "bus", "train", "truck", "boat", "traffic light", "fire hydrant",
    "stop sign", "parking meter", "bench", "backpack", "umbrella", "handbag", "tie", "suitcase", "frisbee", "skis",
    "snowboard", "sports ball", "kite", "baseball bat", "baseball glove", "skateboard", "surfboard", "tennis racket",
    "bottle", "wine glass", "cup", "fork", "knife", "spoon", "bowl", "banana", "apple", "sandwich", "orange", "broccoli",
    "carrot", "hot dog", "pizza", "donut", "cake", "chair", "couch", "potted plant", "bed", "dining table", "toilet", "tv",
    "laptop", "mouse", "remote", "keyboard", "cell phone", "microwave", "oven", "toaster", "sink", "refrigerator", "book",
    "clock", "vase", "scissors", "teddy bear", "hair drier", "toothbrush",
];

/// All labels of potential movers: person, the animals, and those of the config; sorted.
///
/// # Errors
///
/// [`Error::UnknownLabel`].
pub(crate) fn mover_labels(config: &DynamicsConfig) -> Result<Vec<String>, Error> {
    let coco = || MOVERS.into_iter().chain(OTHERS);
    if let Some(label) = config.mover_labels.iter().find(|label| !coco().any(|known| known == **label)) {
        let nearest = coco().min_by_key(|known| edits(label, known)).unwrap_or_default();
        return Err(Error::UnknownLabel { label: label.clone(), nearest });
    }
    let own = config.mover_labels.iter().chain(&config.own_mover_labels).cloned();
    let mut labels: Vec<String> = MOVERS.into_iter().map(String::from).chain(own).collect();
    labels.sort_unstable();
    labels.dedup();
    Ok(labels)
}

/// The edit distance of two strings: letters to insert, delete or change (Levenshtein 1966).
fn edits(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.chars().count()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, other) in b.chars().enumerate() {
            let changed = diagonal + usize::from(letter != other);
            diagonal = row[j + 1];
            row[j + 1] = changed.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row.last().copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_are_counted() {
        assert_eq!(edits("", "cat"), 3);
        assert_eq!(edits("kitten", "sitting"), 3);
        assert_eq!(edits("person", "person"), 0);
        assert_eq!(edits("perosn", "person"), 2);
    }

    #[test]
    fn the_classes_of_coco_are_eighty() {
        let mut all: Vec<&str> = MOVERS.into_iter().chain(OTHERS).collect();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 80);
    }
}
