use std::io::Write;

use super::page_data::{PageData, Run};
use super::template::{escaped, script_json, write_filled};
use crate::AnyError;

const TEMPLATE: &str = include_str!("../../report_page/page.html");
const STYLE: &str = include_str!("../../report_page/style.css");
/// Made from `report_page/src` and three.js by `npm run build`.
const SCRIPT: &str = include_str!("../../report_page/page.js");

/// `report.html`, ready to be written.
#[derive(Debug, Clone)]
pub struct ReportPage {
    title: String,
    subtitle: String,
    data: String,
    /// The `<script>` elements with the packed maps.
    sections: String,
}

impl ReportPage {
    /// Packs everything that the page shows.
    ///
    /// # Errors
    ///
    /// When some data of the run cannot be written as JSON.
    pub fn of(run: &Run<'_>) -> Result<Self, AnyError> {
        let data = PageData::of(run);
        let sections = [&data.cloud, &data.octree, &data.removed].map(|layer| {
            format!(
                "<script type=\"text/plain\" id=\"section-{}\">{}</script>\n",
                layer.section, layer.packed
            )
        });
        Ok(Self {
            title: escaped(run.title),
            subtitle: escaped(&subtitle(run)),
            data: script_json(&data)?,
            sections: sections.concat(),
        })
    }

    /// Writes the page: one file of HTML.
    ///
    /// # Errors
    ///
    /// When writing fails.
    pub fn write(&self, out: &mut dyn Write) -> Result<(), AnyError> {
        let values = [
            ("title", self.title.as_str()),
            ("subtitle", &self.subtitle),
            ("style", STYLE),
            ("data", &self.data),
            ("sections", &self.sections),
            ("script", SCRIPT),
        ];
        Ok(write_filled(out, TEMPLATE, &values)?)
    }
}

fn subtitle(run: &Run<'_>) -> String {
    let seconds = match run.frames {
        [first, .., last] => last.timestamp - first.timestamp,
        _ => 0.0,
    };
    format!(
        "maps of the static world from {} frames in {seconds:.1} s, {} of them key frames",
        run.frames.len(),
        run.report.key_frames
    )
}
