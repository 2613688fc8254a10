/// The labels with which an object was detected, and the sum of the detection scores for each.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LabelEvidence {
    /// By ascending label.
    scores: Vec<(String, f64)>,
}

impl LabelEvidence {
    /// Whether its labels ascend and its scores are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(crate) fn is_possible(&self) -> bool {
        self.scores.is_sorted_by(|(a, _), (b, _)| a < b)
            && self.scores.iter().all(|(_, score)| (0.0..1e12).contains(score))
    }

    /// Adds a detection's label and score.
    pub fn add(&mut self, label: &str, score: f64) {
        match self.scores.binary_search_by(|(own, _)| own.as_str().cmp(label)) {
            Ok(place) => self.scores[place].1 += score,
            Err(place) => self.scores.insert(place, (label.to_owned(), score)),
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        other.scores.iter().for_each(|(label, score)| self.add(label, *score));
    }

    /// The label with the highest sum, the alphabetically first among equals; `None` before the first
    /// detection.
    pub fn best(&self) -> Option<&str> {
        let best = self.scores.iter().reduce(|best, next| if next.1 > best.1 { next } else { best });
        best.map(|(label, _)| label.as_str())
    }

    /// A label's share of the sum of all scores, 0..=1.
    pub fn share(&self, label: &str) -> f64 {
        let total: f64 = self.scores.iter().map(|(_, score)| score).sum();
        let own = self.scores.iter().find(|(own, _)| own == label).map_or(0.0, |(_, score)| *score);
        if total > 0.0 { own / total } else { 0.0 }
    }

    /// All labels with their summed scores, by ascending label.
    pub fn iter(&self) -> impl Iterator<Item = (&str, f64)> {
        self.scores.iter().map(|(label, score)| (label.as_str(), *score))
    }
}
