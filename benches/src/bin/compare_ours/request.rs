use std::collections::BTreeMap;
use std::path::Path;
use std::str::FromStr;

use crate::Failure;

/// One line from the script: `operation key=value key=value ..`.
pub(crate) struct Request {
    operation: String,
    parameters: BTreeMap<String, String>,
}

impl Request {
    pub(crate) fn parse(line: &str) -> Result<Self, Failure> {
        let mut words = line.split_whitespace();
        let operation = words.next().ok_or("an empty request")?.to_owned();
        let parameters = words
            .map(|word| {
                let (key, value) = word.split_once('=').ok_or_else(|| format!("no value in {word}"))?;
                Ok((key.to_owned(), value.to_owned()))
            })
            .collect::<Result<_, Failure>>()?;
        Ok(Self { operation, parameters })
    }

    pub(crate) fn operation(&self) -> &str {
        &self.operation
    }

    /// A parameter as text.
    pub(crate) fn text(&self, key: &str) -> Result<&str, Failure> {
        let value = self.parameters.get(key);
        Ok(value.ok_or_else(|| format!("{} needs {key}=", self.operation))?)
    }

    /// A parameter as a number.
    pub(crate) fn number<T: FromStr>(&self, key: &str) -> Result<T, Failure> {
        let text = self.text(key)?;
        text.parse().map_err(|_| format!("{key}={text} is no number").into())
    }

    /// Whether working memory and output are reused from the run before (`buffers=kept`) or new
    /// (`buffers=fresh`).
    pub(crate) fn keeps_buffers(&self) -> Result<bool, Failure> {
        match self.text("buffers")? {
            "kept" => Ok(true),
            "fresh" => Ok(false),
            other => Err(format!("buffers={other} is neither kept nor fresh").into()),
        }
    }

    /// The file to write the result to, if any.
    pub(crate) fn result(&self) -> Option<&Path> {
        self.parameters.get("result").map(Path::new)
    }
}
