//! Settings of the maps.

use std::path::{Path, PathBuf};

use dymlm::MapConfig;
use dymlm::files::LoadOptions;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use toml::{Table, Value};

use crate::error::{FileError, OrRaise, refused_setting};

/// Settings of the maps. Fields that are not given have their defaults, or those of `preset` ("default",
/// "offline": every frame is mapped, "robot"). The fields are those of a config file:
/// `Config(history="memory", cloud={"voxel_size": 0.02})`, `Config("robot", sensor={"preset":
/// "realsense_d4xx"})`.
///
/// `history`: "memory", or {"folder": path}, keeps the observations of key frames, which correcting, merging
/// and refining need. A MapBuilder's exception names a field that is outside its range.
#[pyclass(frozen, eq, name = "Config", module = "dymlm")]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PyConfig(pub(crate) MapConfig);

#[pymethods]
impl PyConfig {
    #[new]
    #[pyo3(signature = (preset = None, **fields))]
    fn new(preset: Option<String>, fields: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut table = fields.map_or_else(|| Ok(Table::new()), table_of)?;
        table.extend(preset.map(|preset| ("preset".to_owned(), Value::String(preset))));
        Self::of_text(&toml::to_string(&table).or_raise()?)
    }

    /// Reads a config, given as the path of a file (any `os.PathLike`, or a string of one line that ends with
    /// ".toml") or as TOML text.
    #[staticmethod]
    fn from_toml(text_or_path: &Bound<'_, PyAny>) -> PyResult<Self> {
        let Ok(text) = text_or_path.extract::<String>() else {
            return Self::of_file(&text_or_path.extract::<PathBuf>()?);
        };
        let path = PathBuf::from(&text);
        let is_path = !text.contains('\n') && path.extension().is_some_and(|extension| extension == "toml");
        if is_path { Self::of_file(&path) } else { Self::of_text(&text) }
    }

    /// All fields as the text of a config file.
    fn to_toml(&self) -> PyResult<String> {
        toml::to_string(&self.0).or_raise()
    }

    /// All fields as nested dictionaries.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        dict_of(py, Table::try_from(&self.0).or_raise()?)
    }

    /// For pickle and copy.
    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        Ok((PyTuple::empty(py), self.to_dict(py)?))
    }

    fn __repr__(&self) -> PyResult<String> {
        Ok(format!("Config.from_toml({:?})", self.to_toml()?))
    }
}

impl PyConfig {
    fn of_text(text: &str) -> PyResult<Self> {
        MapConfig::from_toml(text).or_raise().map(Self)
    }

    fn of_file(path: &Path) -> PyResult<Self> {
        let named = |words: &dyn std::fmt::Display| format!("{}: {words}", path.display());
        let text = std::fs::read_to_string(path).map_err(|error| FileError::new_err(named(&error)))?;
        MapConfig::from_toml(&text).map_err(|error| refused_setting(named(&error))).map(Self)
    }
}

/// Most levels of dictionaries and lists in a config, which has four: one that holds itself has no end.
const MOST_LEVELS: usize = 16;

pub(crate) fn table_of(fields: &Bound<'_, PyDict>) -> PyResult<Table> {
    table_within(fields, MOST_LEVELS)
}

/// The options of `load`: settings as a config has them, or None.
pub(crate) fn load_options(
    history: Option<&Bound<'_, PyAny>>,
    memory: Option<&Bound<'_, PyAny>>,
) -> PyResult<LoadOptions> {
    let mut options = LoadOptions::default();
    options.history = history.map(|given| setting("history", given, Value::try_into)).transpose()?;
    options.memory = memory.map(|given| setting("memory", given, Value::try_into)).transpose()?;
    Ok(options)
}

fn setting<T>(
    name: &str,
    given: &Bound<'_, PyAny>,
    read: fn(Value) -> Result<T, toml::de::Error>,
) -> PyResult<T> {
    let value = value_within(given, MOST_LEVELS)?;
    read(value).map_err(|error| refused_setting(format!("{name}: {error}")))
}

fn table_within(fields: &Bound<'_, PyDict>, levels: usize) -> PyResult<Table> {
    fields.iter().map(|(name, value)| Ok((name.extract()?, value_within(&value, levels)?))).collect()
}

/// The levels that are left one level deeper.
fn deeper(levels: usize) -> PyResult<usize> {
    let words = || format!("a config cannot hold more than {MOST_LEVELS} levels of dictionaries and lists");
    levels.checked_sub(1).ok_or_else(|| refused_setting(words()))
}

fn value_within(value: &Bound<'_, PyAny>, levels: usize) -> PyResult<Value> {
    if let Ok(table) = value.cast::<PyDict>() {
        return table_within(table, deeper(levels)?).map(Value::Table);
    }
    // Booleans come before integers, since a bool is an int in Python; those of numpy are none of Python's.
    if let Ok(bit) = value.extract() {
        return Ok(Value::Boolean(bit));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let levels = deeper(levels)?;
        let values: PyResult<_> = value.try_iter()?.map(|value| value_within(&value?, levels)).collect();
        return values.map(Value::Array);
    }
    if value.is_instance_of::<PyString>() {
        return value.extract().map(Value::String);
    }
    if value.is_instance_of::<PyFloat>() {
        return value.extract().map(Value::Float);
    }
    // Integers and numpy's scalars, then paths.
    if let Ok(whole) = value.extract() {
        return Ok(Value::Integer(whole));
    }
    if let Ok(number) = value.extract() {
        return Ok(Value::Float(number));
    }
    match value.extract::<PathBuf>() {
        Ok(path) => match path.to_str() {
            Some(path) => Ok(Value::String(path.to_owned())),
            None => Err(refused_setting(format!("{} is not UTF-8, and cannot be saved", path.display()))),
        },
        Err(_) => Err(PyTypeError::new_err(format!("a config cannot hold {}", value.get_type()))),
    }
}

fn dict_of(py: Python<'_>, table: Table) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    for (name, value) in table {
        dict.set_item(name, object_of(py, value)?)?;
    }
    Ok(dict)
}

fn object_of(py: Python<'_>, value: Value) -> PyResult<Bound<'_, PyAny>> {
    Ok(match value {
        Value::String(text) => text.into_pyobject(py)?.into_any(),
        Value::Integer(whole) => PyInt::new(py, whole).into_any(),
        Value::Float(number) => PyFloat::new(py, number).into_any(),
        Value::Boolean(bit) => PyBool::new(py, bit).to_owned().into_any(),
        Value::Datetime(time) => time.to_string().into_pyobject(py)?.into_any(),
        Value::Array(values) => {
            let objects: PyResult<Vec<_>> = values.into_iter().map(|value| object_of(py, value)).collect();
            PyList::new(py, objects?)?.into_any()
        }
        Value::Table(table) => dict_of(py, table)?.into_any(),
    })
}
