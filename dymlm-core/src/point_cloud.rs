use crate::{Error, Point, Rgb};

/// A cloud of points, with one colour per point or without colours.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "RawCloud"))]
pub struct PointCloud {
    points: Vec<Point>,
    colors: Option<Vec<Rgb>>,
}

impl PointCloud {
    /// A cloud without colours.
    pub fn new(points: Vec<Point>) -> Self {
        Self { points, colors: None }
    }

    /// A cloud with one colour per point.
    ///
    /// # Errors
    ///
    /// [`Error::ColorCount`] when the numbers differ.
    pub fn with_colors(points: Vec<Point>, colors: Vec<Rgb>) -> Result<Self, Error> {
        if points.len() != colors.len() {
            return Err(Error::ColorCount { points: points.len(), colors: colors.len() });
        }
        Ok(Self { points, colors: Some(colors) })
    }

    /// The points.
    #[inline]
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// The colours, as many as points, if there are any.
    #[inline]
    pub fn colors(&self) -> Option<&[Rgb]> {
        self.colors.as_deref()
    }

    /// Number of points.
    #[inline]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The points at `indices`, in that order; indices outside the cloud are ignored.
    #[must_use]
    pub fn select(&self, indices: &[usize]) -> Self {
        let points = indices.iter().filter_map(|&i| self.points.get(i).copied()).collect();
        let colors = self
            .colors
            .as_ref()
            .map(|colors| indices.iter().filter_map(|&i| colors.get(i).copied()).collect());
        Self { points, colors }
    }

    /// Gives points and colours back.
    pub fn into_parts(self) -> (Vec<Point>, Option<Vec<Rgb>>) {
        (self.points, self.colors)
    }
}

#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct RawCloud {
    points: Vec<Point>,
    colors: Option<Vec<Rgb>>,
}

#[cfg(feature = "serde")]
impl TryFrom<RawCloud> for PointCloud {
    type Error = Error;

    fn try_from(RawCloud { points, colors }: RawCloud) -> Result<Self, Error> {
        match colors {
            Some(colors) => Self::with_colors(points, colors),
            None => Ok(Self::new(points)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_colours_that_do_not_match() {
        let error = PointCloud::with_colors(vec![[0.0; 3]; 2], vec![[0; 3]; 3]).unwrap_err();
        assert_eq!(error, Error::ColorCount { points: 2, colors: 3 });
    }

    #[test]
    fn selects_points_with_their_colours() {
        let cloud = PointCloud::with_colors(vec![[0.0; 3], [1.0; 3], [2.0; 3]], vec![[0; 3], [1; 3], [2; 3]])
            .unwrap();
        let chosen = cloud.select(&[2, 7, 0]);
        assert_eq!(chosen.points(), [[2.0; 3], [0.0; 3]]);
        assert_eq!(chosen.colors(), Some(&[[2; 3], [0; 3]][..]));
    }
}
