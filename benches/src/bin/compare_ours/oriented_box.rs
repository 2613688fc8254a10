use dymlm_geometry::{BoxFit, OrientedBoxScratch, fit_oriented_box_with};

use crate::Failure;
use crate::inputs::Inputs;
use crate::request::Request;
use crate::results::write_numbers;
use crate::timing::{Timing, timed};

/// `oriented_box input= fit=principal_axes|minimum_rectangle|minimum_volume buffers=kept|fresh`
pub(crate) fn run(
    request: &Request,
    inputs: &mut Inputs,
    kept: &mut OrientedBoxScratch,
) -> Result<Timing, Failure> {
    let fit = match request.text("fit")? {
        "principal_axes" => BoxFit::PrincipalAxes,
        "minimum_rectangle" => BoxFit::MinimumRectangle,
        "minimum_volume" => BoxFit::MinimumVolume,
        other => return Err(format!("fit={other} is unknown").into()),
    };
    let points = inputs.points(request.text("input")?)?;

    let mut fresh = OrientedBoxScratch::default();
    let scratch = if request.keeps_buffers()? { kept } else { &mut fresh };
    let (fitted, timing) = timed(|| fit_oriented_box_with(points, fit, scratch));
    let fitted = fitted.ok_or("no box")?;
    if let Some(path) = request.result() {
        let rows = fitted.world_from_box().rotation_matrix();
        let numbers = [fitted.center().as_slice(), rows.as_flattened(), &fitted.lengths()].concat();
        write_numbers(path, &numbers)?;
    }
    Ok(timing)
}
