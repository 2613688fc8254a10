use std::fmt::Write as _;
use std::path::Path;

use dymlm_examples::{AnyError, SequenceSet};
use dymlm_io::write_atomically;
use serde::Serialize;

use crate::columns::{BLOCKS, Block, Column, Scores};
use crate::evaluation::{Row, Stage};
use crate::treatment::Treatment;

/// The table for the terminal: a block of columns a map, the same rows in each.
pub(crate) fn text(rows: &[Row]) -> String {
    let rows = with_means(rows);
    let mut text = String::new();
    for block in BLOCKS {
        let cells = block_cells(block, &rows);
        let widths: Vec<usize> = (0..cells[0].len())
            .map(|column| cells.iter().map(|line| line[column].chars().count()).max().unwrap_or(0))
            .collect();
        writeln!(text, "\n{}", block.title).ok();
        for line in &cells {
            for (column, (cell, &width)) in line.iter().zip(&widths).enumerate() {
                // The names to the left, figures to the right.
                if column == 0 {
                    write!(text, "{cell:<width$}").ok();
                } else {
                    write!(text, "  {cell:>width$}").ok();
                }
            }
            text.push('\n');
        }
    }
    text
}

/// The table as `evaluation.json` and `evaluation.md`.
pub(crate) fn write(rows: &[Row], folder: &Path) -> Result<(), AnyError> {
    let rows = with_means(rows);
    write_atomically(folder.join("evaluation.md"), |out| out.write_all(markdown(&rows).as_bytes()))?;
    write_atomically(folder.join("evaluation.json"), |out| -> Result<(), AnyError> {
        #[derive(Serialize)]
        struct File<'a> {
            rows: &'a [Row],
        }
        serde_json::to_writer_pretty(&mut *out, &File { rows: &rows })?;
        Ok(writeln!(out)?)
    })?;
    Ok(())
}

fn markdown(rows: &[Row]) -> String {
    let mut text = String::new();
    for block in BLOCKS {
        let cells = block_cells(block, rows);
        writeln!(text, "**{}**\n", block.title).ok();
        for (index, line) in cells.iter().enumerate() {
            writeln!(text, "| {} |", line.join(" | ")).ok();
            if index == 0 {
                writeln!(text, "|---|{}", "---:|".repeat(line.len() - 1)).ok();
            }
        }
        text.push('\n');
    }
    text
}

/// The rows, and after them the mean over the eight sequences and over the random rooms for each treatment.
fn with_means(rows: &[Row]) -> Vec<Row> {
    let mut all = rows.to_vec();
    all.extend(means(rows, "mean of the eight", SequenceSet::Eight));
    all.extend(means(rows, "mean of random rooms", SequenceSet::RandomRooms));
    all
}

fn means(rows: &[Row], name: &str, set: SequenceSet) -> Vec<Row> {
    let mut means = Vec::new();
    for &treatment in Treatment::ALL {
        for stage in [Stage::Before, Stage::After] {
            let alike = |row: &&Row| row.set == Some(set) && row.treatment == treatment && row.stage == stage;
            let scores: Vec<&Scores> = rows.iter().filter(alike).map(|row| &row.scores).collect();
            if scores.len() > 1 {
                let scores = Scores::mean(&scores);
                means.push(Row { sequence: name.to_owned(), set: None, treatment, stage, scores });
            }
        }
    }
    means
}

/// Heading and rows of a block; rows that have nothing in it are left out, unless none has anything.
fn block_cells(block: &Block, rows: &[Row]) -> Vec<Vec<String>> {
    let many = rows.iter().any(|row| row.treatment != Treatment::Silhouettes || row.stage == Stage::Before);
    let name = |row: &Row| {
        if many {
            format!("{}, {}, {}", row.sequence, row.treatment.name(), row.stage.name())
        } else {
            row.sequence.clone()
        }
    };
    let any = |row: &&Row| block.columns.iter().any(|column| row.scores.get(column.key).is_some());
    let heading = std::iter::once(String::new()).chain(block.columns.iter().map(Column::title)).collect();
    let mut cells = vec![heading];
    let filled = rows.iter().any(|row| any(&row));
    for row in rows.iter().filter(|row| any(row) || !filled) {
        let values = block.columns.iter().map(|column| column.format(row.scores.get(column.key)));
        cells.push(std::iter::once(name(row)).chain(values).collect());
    }
    cells
}
