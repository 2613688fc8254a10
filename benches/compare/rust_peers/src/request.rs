use std::collections::BTreeMap;

use crate::Failure;

/// One line from the script: `operation key=value key=value ..`.
pub(crate) struct Request {
    pub(crate) operation: String,
    parameters: BTreeMap<String, String>,
}

impl Request {
    pub(crate) fn parse(line: &str) -> Result<Self, Failure> {
        let mut words = line.split_whitespace();
        let operation = words.next().ok_or("an empty request")?.to_owned();
        let parameters: Result<_, Failure> = words
            .map(|word| {
                let (key, value) = word.split_once('=').ok_or_else(|| format!("no value in {word}"))?;
                Ok((key.to_owned(), value.to_owned()))
            })
            .collect();
        Ok(Self { operation, parameters: parameters? })
    }

    pub(crate) fn text(&self, key: &str) -> Result<&str, Failure> {
        let value = self.parameters.get(key);
        Ok(value.ok_or_else(|| format!("{} needs {key}=", self.operation))?)
    }

    /// Relative decrease of the cost below which a solver should stop; `None` for its own default.
    pub(crate) fn tolerance(&self) -> Result<Option<f64>, Failure> {
        match self.text("tolerance")? {
            "default" => Ok(None),
            number => Ok(Some(number.parse()?)),
        }
    }
}
