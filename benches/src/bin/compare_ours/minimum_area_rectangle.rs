use dymlm_geometry::{MinimumAreaRectangleScratch, minimum_area_rectangle_with};

use crate::Failure;
use crate::inputs::Inputs;
use crate::request::Request;
use crate::results::write_numbers;
use crate::timing::{Timing, timed};

/// `minimum_area_rectangle input= buffers=kept|fresh`: uses the x and y of the points.
pub(crate) fn run(
    request: &Request,
    inputs: &mut Inputs,
    kept: &mut MinimumAreaRectangleScratch,
) -> Result<Timing, Failure> {
    let points = inputs.points(request.text("input")?)?;
    let points: Vec<[f64; 2]> = points.iter().map(|[x, y, _]| [f64::from(*x), f64::from(*y)]).collect();

    let mut fresh = MinimumAreaRectangleScratch::default();
    let scratch = if request.keeps_buffers()? { kept } else { &mut fresh };
    let (rectangle, timing) = timed(|| minimum_area_rectangle_with(&points, scratch));
    let rectangle = rectangle.ok_or("no rectangle")?;
    if let Some(path) = request.result() {
        write_numbers(path, rectangle.corners().as_flattened())?;
    }
    Ok(timing)
}
