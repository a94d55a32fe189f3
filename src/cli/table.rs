//! Text for a terminal of 100 columns: tables and paragraphs.

use std::fmt::Write;

pub use crate::digits::number;

/// Columns of a terminal.
const WIDTH: usize = 100;
/// Blanks before every line of a table.
const INDENT: usize = 2;

/// A table whose first column is text, the others numbers; a last column of sentences is wrapped.
#[derive(Debug, Default)]
pub struct Table {
    rows: Vec<Vec<String>>,
    sentences: bool,
}

impl Table {
    /// A table under these headings.
    pub fn new<const N: usize>(headings: [&str; N]) -> Self {
        Self { rows: vec![headings.map(str::to_owned).to_vec()], sentences: false }
    }

    /// The last column holds sentences.
    pub fn with_sentences<const N: usize>(headings: [&str; N]) -> Self {
        Self { sentences: true, ..Self::new(headings) }
    }

    /// Adds a row, a cell a heading.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// The table as text.
    pub fn text(&self) -> String {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |column: usize| self.rows.iter().filter_map(|r| r.get(column)).map(|c| columns_of(c)).max();
        let widths: Vec<usize> = (0..columns).map(|c| width(c).unwrap_or(0)).collect();
        let numbers = if self.sentences { columns.saturating_sub(1) } else { columns };
        let before: usize = INDENT + widths[..numbers].iter().map(|w| w + 2).sum::<usize>();
        let mut text = String::new();
        for row in &self.rows {
            let mut line = " ".repeat(INDENT);
            for (column, cell) in row.iter().enumerate().take(numbers) {
                let blanks = " ".repeat(widths[column] - columns_of(cell));
                let (left, right) = if column == 0 { ("", blanks.as_str()) } else { (blanks.as_str(), "") };
                let _ = write!(line, "{left}{cell}{right}  ");
            }
            if let Some(sentence) = row.get(numbers) {
                line.push_str(&wrapped(sentence, WIDTH - before).join(&format!("\n{}", " ".repeat(before))));
            }
            let _ = writeln!(text, "{}", line.trim_end());
        }
        text
    }
}

/// A paragraph after `bullet`, under whose end the further lines begin.
pub fn paragraph(bullet: &str, text: &str) -> String {
    let hanging = columns_of(bullet);
    let lines = wrapped(text, WIDTH - hanging).join(&format!("\n{}", " ".repeat(hanging)));
    format!("{bullet}{lines}\n")
}

/// A configured value as a person would write it.
pub fn setting(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) { value.to_string() } else { format!("{value:e}") }
}

fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let fits = lines.last().is_some_and(|l| l.is_empty() || columns_of(l) + 1 + columns_of(word) <= width);
        match lines.last_mut() {
            Some(line) if fits => {
                if !line.is_empty() {
                    line.push(' ');
                }
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Columns a text takes: one a character, for nothing here is wide or combining.
fn columns_of(text: &str) -> usize {
    text.chars().count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_significant_digits() {
        assert_eq!(number(1.34888, 5), "1.3489");
        assert_eq!(number(0.025341, 4), "0.02534");
        assert_eq!(number(1.883e-8, 3), "1.88e-8");
        assert_eq!(number(-292.54, 4), "-292.5");
        assert_eq!(number(0.0, 3), "0.00");
        assert_eq!([0.05, 2e-8, 0.0].map(setting), ["0.05", "2e-8", "0"]);
    }

    #[test]
    fn no_line_is_longer_than_the_terminal_and_numbers_stand_right() {
        let mut table = Table::with_sentences(["what", "Hz", "verdict"]);
        table.row(["a".to_owned(), "1.5".to_owned(), "word ".repeat(60).trim().to_owned()]);
        table.row(["longer".to_owned(), "10.5".to_owned(), "short".to_owned()]);
        let text = table.text();
        assert!(text.lines().all(|l| l.chars().count() <= WIDTH), "{text}");
        assert!(text.contains("  a        1.5  word") && text.contains("  longer  10.5  short"), "{text}");
    }
}
