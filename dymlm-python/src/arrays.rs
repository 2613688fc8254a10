//! Conversions between numpy's arrays and Rust's numbers.

use numpy::{
    Element, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::error::refused;

/// An array of one dimension.
pub(crate) type Array1<'py, T> = Bound<'py, PyArray1<T>>;
/// An array of two dimensions.
pub(crate) type Array2<'py, T> = Bound<'py, PyArray2<T>>;

/// Moves the rows into an array with `N` columns. Nothing is copied.
pub(crate) fn rows_to_array<T: Element, const N: usize>(
    py: Python<'_>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let shape = [rows.len(), N];
    PyArray1::from_vec(py, rows.into_flattened()).reshape(shape)
}

/// Moves the values of an image, row by row, into an array. Nothing is copied.
pub(crate) fn image_to_array<T: Element>(
    py: Python<'_>,
    [width, height]: [usize; 2],
    values: Vec<T>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    PyArray1::from_vec(py, values).reshape([height, width])
}

/// A vector as an array.
pub(crate) fn to_vector<T: Element + Copy, const N: usize>(
    py: Python<'_>,
    vector: [T; N],
) -> Bound<'_, PyArray1<T>> {
    PyArray1::from_vec(py, vector.to_vec())
}

/// Read access to an array of this type; `None` when the argument holds values of another type, or is no
/// array.
pub(crate) fn array_of<'py, T: Element>(
    given: &Bound<'py, PyAny>,
) -> PyResult<Option<PyReadonlyArrayDyn<'py, T>>> {
    let Ok(array) = given.cast::<PyArrayDyn<T>>() else { return Ok(None) };
    if array.is_aligned() {
        return Ok(Some(array.try_readonly()?));
    }
    // A view into packed records is copied, since Rust reads numbers only at aligned addresses.
    let aligned = given.call_method0("copy")?;
    Ok(Some(aligned.cast::<PyArrayDyn<T>>()?.try_readonly()?))
}

/// The values of an array in C order: not copied if they are in C order already, else copied into `kept`.
pub(crate) fn values<'a, T: Element + Copy>(
    array: &'a PyReadonlyArrayDyn<'_, T>,
    kept: &'a mut Vec<T>,
) -> &'a [T] {
    // `as_slice` gives memory order, which is C order only if the array is C-contiguous.
    if array.is_c_contiguous()
        && let Ok(values) = array.as_slice()
    {
        return values;
    }
    kept.clear();
    kept.extend(array.as_array().iter().copied());
    kept
}

/// The numbers, as f64, and the shape of anything that numpy can convert to an array.
fn numbers(given: &Bound<'_, PyAny>, what: &str) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let no_numbers = || PyTypeError::new_err(format!("{what}: an array of real numbers is needed"));
    let array = given.py().import("numpy")?.call_method1("asarray", (given,)).map_err(|_| no_numbers())?;
    let kind: char = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let is_empty = array.getattr("size")?.extract::<usize>()? == 0;
    if !matches!(kind, 'f' | 'i' | 'u') && !is_empty {
        return Err(no_numbers());
    }
    let array = array.call_method1("astype", ("float64",))?;
    let array = array_of::<f64>(&array)?.ok_or_else(no_numbers)?;
    let shape = array.shape().to_vec();
    Ok((values(&array, &mut Vec::new()).to_vec(), shape))
}

/// The rows of an (n, `N`) array of numbers, or one row (`N`,).
pub(crate) fn rows<const N: usize>(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<[f64; N]>> {
    let (values, shape) = numbers(given, what)?;
    if !matches!(*shape, [_, columns] | [columns] if columns == N) && !matches!(*shape, [0]) {
        return Err(refused(format!("{what} of shape {shape:?}: (n, {N}) or ({N},) is needed")));
    }
    Ok(values.as_chunks::<N>().0.to_vec())
}

/// `N` numbers.
pub(crate) fn vector<const N: usize>(given: &Bound<'_, PyAny>, what: &str) -> PyResult<[f64; N]> {
    let (values, shape) = numbers(given, what)?;
    <[f64; N]>::try_from(values).map_err(|_| refused(format!("{what} of shape {shape:?}: ({N},) is needed")))
}

/// `N` rows of `M` numbers; `None` when the array has another shape.
pub(crate) fn matrix<const N: usize, const M: usize>(
    given: &Bound<'_, PyAny>,
    what: &str,
) -> PyResult<Option<[[f64; M]; N]>> {
    let (values, shape) = numbers(given, what)?;
    Ok(if *shape == [N, M] { values.as_chunks::<M>().0.try_into().ok() } else { None })
}

/// The points of an (n, 3) array in single precision, as clouds have them.
pub(crate) fn points(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<[f32; 3]>> {
    if let Some(array) = array_of::<f32>(given)?
        && let [_, 3] = *array.shape()
    {
        return Ok(values(&array, &mut Vec::new()).as_chunks::<3>().0.to_vec());
    }
    Ok(rows::<3>(given, what)?.into_iter().map(|point| point.map(|c| c as f32)).collect())
}

/// Describes an argument in an error's text: an array by its type and shape, anything else by its type.
pub(crate) fn described(given: &Bound<'_, PyAny>) -> String {
    match given.cast::<PyUntypedArray>() {
        Ok(array) => format!("{} of shape {:?}", array.dtype(), array.shape()),
        Err(_) => given.get_type().to_string(),
    }
}
