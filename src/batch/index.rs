//! The summary as a page: `index.html`, one file that needs no network, sortable, with a small picture of every swing.

use std::fmt::Write;
use std::path::Path;

use super::state::Status;
use super::summary::Row;
use crate::digits;
use crate::error::Result;
use crate::output::OutputFile;
use crate::report::html::{escaped, plus_minus};
use crate::series::AngleSeries;

/// Beyond so many rows the page has no pictures: with them it would take a browser longer than a person waits.
const MOST_PICTURES: usize = 2000;
/// Points of a picture.
const POINTS: usize = 240;
/// Its size in pixels.
const SIZE_PX: [f64; 2] = [180.0, 36.0];

const STYLE: &str = include_str!("index.css");
const SCRIPT: &str = include_str!("index.js");

/// Writes the page into a folder.
///
/// # Errors
/// [`crate::Error::Unwritable`].
pub fn write(folder: &Path, rows: &[Row], specimens: &[Row]) -> Result<()> {
    OutputFile::create(&folder.join("index.html"))?.commit(page(folder, rows, specimens).as_bytes())
}

/// A column: its heading, what is shown of a row, and what it is sorted by.
struct Column {
    heading: &'static str,
    explained: &'static str,
    shown: fn(&Row) -> String,
    sorted_by: fn(&Row) -> Option<f64>,
}

/// So many columns come from `freeswing identify`, which takes one recording.
const OF_ONE_RECORDING: usize = 3;
const COLUMNS: [Column; 8] = [
    Column {
        heading: "f₁ (Hz)",
        explained: "frequency of the slowest mode ± half of its 95 % interval",
        shown: |row| with_half(row.f1_hz, row.f1_half_hz),
        sorted_by: |row| row.f1_hz,
    },
    Column {
        heading: "ξ₁",
        explained: "its damping ratio ± half of its 95 % interval",
        shown: |row| with_half(row.zeta1, row.zeta1_half),
        sorted_by: |row| row.zeta1,
    },
    Column {
        heading: "f₂ (Hz)",
        explained: "frequency of the strongest other mode",
        shown: |row| plain(row.f2_hz),
        sorted_by: |row| row.f2_hz,
    },
    Column {
        heading: "k (N·m/rad)",
        explained: "the joint's spring, as fitted",
        shown: |row| plain(row.k_n_m_per_rad),
        sorted_by: |row| row.k_n_m_per_rad,
    },
    Column {
        heading: "c (N·m·s/rad)",
        explained: "the joint's damper, as fitted",
        shown: |row| plain(row.c_n_m_s_per_rad),
        sorted_by: |row| row.c_n_m_s_per_rad,
    },
    Column {
        heading: "missing physics",
        explained: "what the diagnosis says the base model lacks",
        shown: |row| match (&row.verdict, &row.effects) {
            (Some(_), Some(effects)) => effects.replace('+', " + "),
            (Some(verdict), None) => match verdict.as_str() {
                "adequate" => "nothing".to_owned(),
                "unknown" => "not in the table of effects".to_owned(),
                other => other.to_owned(),
            },
            _ => String::new(),
        },
        sorted_by: |_| None,
    },
    Column {
        heading: "probability",
        explained: "of this answer",
        shown: |row| plain(row.probability),
        sorted_by: |row| row.probability,
    },
    Column {
        heading: "prediction (mrad)",
        explained: "what the base model leaves of the part that was not fitted → what the whole answer leaves, root mean square",
        shown: |row| match (row.heldout_before_rad, row.heldout_after_rad) {
            (Some(before), Some(after)) => {
                format!("{} → {}", digits::number(1e3 * before, 3), digits::number(1e3 * after, 3))
            }
            _ => String::new(),
        },
        sorted_by: |row| row.heldout_after_rad,
    },
];

fn plain(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| digits::number(value, 4))
}

fn with_half(value: Option<f64>, half: Option<f64>) -> String {
    match (value, half) {
        (Some(value), Some(half)) if half > 0.0 => plus_minus(value, half),
        (value, _) => plain(value),
    }
}

fn page(folder: &Path, rows: &[Row], specimens: &[Row]) -> String {
    let count = |status: Status| rows.iter().filter(|row| row.status == status).count();
    let (done, failed, skipped) = (count(Status::Done), count(Status::Failed), count(Status::Skipped));
    let mut text = String::from("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    let _ = write!(
        text,
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{} recordings</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n",
        rows.len()
    );
    let _ = write!(
        text,
        "<h1>{} recordings</h1>\n<p>{done} done, {failed} failed, {skipped} left out. All of it as <a href=\"summary.csv\">CSV</a> and \
         <a href=\"summary.parquet\">Parquet</a>. A click on a heading sorts. Behind ± stands half of the 95 % interval; prediction: what the base model leaves of the part that was not fitted → \
         what the whole answer leaves.</p>\n",
        rows.len()
    );
    table(&mut text, folder, rows, &COLUMNS, rows.len() <= MOST_PICTURES);
    if !specimens.is_empty() {
        text.push_str("<h2>Recordings of one specimen, fitted and diagnosed together</h2>\n");
        table(&mut text, folder, specimens, &COLUMNS[OF_ONE_RECORDING..], false);
    }
    let _ = write!(text, "<script>\n{SCRIPT}</script>\n</body>\n</html>\n");
    text
}

/// A sortable table.
fn table(text: &mut String, folder: &Path, rows: &[Row], columns: &[Column], with_pictures: bool) {
    text.push_str("<div class=\"wide\"><table>\n<thead><tr>");
    let heading = |text: &mut String, heading: &str, explained: &str| {
        let _ = write!(text, "<th aria-sort=\"none\"><button title=\"{explained}\">{heading}</button></th>");
    };
    heading(text, "recording", "path below the input folder");
    heading(text, "status", "done, failed or left out");
    if with_pictures {
        text.push_str("<th>θ₁</th>");
    }
    columns.iter().for_each(|column| heading(text, column.heading, column.explained));
    text.push_str("</tr></thead>\n<tbody>\n");
    for row in rows {
        self::row(text, folder, row, columns, with_pictures);
    }
    text.push_str("</tbody>\n</table></div>\n");
}

fn row(text: &mut String, folder: &Path, row: &Row, columns: &[Column], with_picture: bool) {
    let name = escaped(&row.recording);
    let own = folder.join(&row.recording);
    let link = ["report.html", "log.txt"].into_iter().find(|file| own.join(file).exists());
    let first = match link {
        Some(file) => format!("<a href=\"{}/{file}\">{name}</a>", address(&row.recording)),
        None => name,
    };
    // what was left out of one that is done
    let note = if row.status == Status::Done && !row.reason.is_empty() {
        format!("<br><small>{}</small>", escaped(&row.reason))
    } else {
        String::new()
    };
    let _ = write!(text, "<tr class=\"{0}\"><th scope=\"row\">{first}</th><td>{0}{note}</td>", row.status.id());
    if with_picture {
        let _ = write!(text, "<td>{}</td>", swing(&own.join("angles.csv"), &row.recording));
    }
    if row.status == Status::Done {
        for column in columns {
            let by = (column.sorted_by)(row).map_or(String::new(), |by| format!(" data-by=\"{by:e}\""));
            let _ = write!(text, "<td{by}>{}</td>", escaped(&(column.shown)(row)));
        }
    } else {
        let reason = escaped(&row.reason);
        let _ = write!(text, "<td class=\"reason\" colspan=\"{}\">{reason}</td>", columns.len());
    }
    text.push_str("</tr>\n");
}

/// The first angle against time, as a small picture.
fn swing(table: &Path, name: &str) -> String {
    let Ok(series) = AngleSeries::read(table) else { return String::new() };
    let Some(angle) = series.theta_rad.first() else { return String::new() };
    let values: Vec<(f64, f64)> = series.t_s.iter().zip(angle).filter_map(|(t, angle)| Some((*t, (*angle)?))).collect();
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return String::new() };
    let largest = values.iter().map(|(_, angle)| angle.abs()).fold(1e-12, f64::max);
    let [width, height] = SIZE_PX;
    let place = |(t, angle): (f64, f64)| {
        let x = width * (t - first.0) / (last.0 - first.0).max(1e-12);
        format!("{x:.1},{:.1}", 0.5 * height * (1.0 - 0.95 * angle / largest))
    };
    // of each stretch the least and the greatest, so that no swing is lost between two points
    let stretch = values.len().div_ceil(POINTS / 2).max(1);
    let ends = values.chunks(stretch).flat_map(|part| {
        let least = part.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let most = part.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let mut both: Vec<(f64, f64)> = least.into_iter().chain(most).copied().collect();
        both.sort_by(|a, b| a.0.total_cmp(&b.0));
        both
    });
    let points: Vec<String> = ends.map(place).collect();
    format!(
        "<svg role=\"img\" aria-label=\"first angle of {} against time, largest {} degrees\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\"><polyline points=\"{}\"/></svg>",
        escaped(name),
        digits::number(largest.to_degrees(), 3),
        points.join(" ")
    )
}

/// A path as an address relative to the page.
fn address(path: &str) -> String {
    let keep = |b: u8| b.is_ascii_alphanumeric() || b"-_.~/".contains(&b);
    let text: String =
        path.bytes().map(|b| if keep(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect();
    // a name with a colon in its first part would be taken for a protocol
    format!("./{text}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_verdicts_are_shown_as_on_the_page_of_a_run() {
        let row = Row {
            recording: "a.mp4".into(),
            status: Status::Done,
            f1_hz: Some(1.359_63),
            f1_sd_hz: Some(0.000_85),
            f1_half_hz: Some(0.001_67),
            verdict: Some("adequate".into()),
            ..Row::default()
        };
        let text = page(Path::new("."), std::slice::from_ref(&row), std::slice::from_ref(&row));
        let [recordings, together] = text.split("<h2>").collect::<Vec<_>>()[..] else { panic!("{text}") };
        assert!(recordings.contains(">1.3596 ± 0.0017</td>") && recordings.contains("<td>nothing</td>"), "{text}");
        // several recordings have no frequencies of their own
        assert!(recordings.contains("ξ₁") && !together.contains("ξ₁") && !together.contains("1.3596"), "{together}");
    }

    #[test]
    fn names_are_text_and_addresses_are_quoted() {
        assert_eq!(escaped("<b>\"&"), "&lt;b&gt;&quot;&amp;");
        assert_eq!(address("a b/ü#1.mp4"), "./a%20b/%C3%BC%231.mp4");
        let text = page(Path::new("."), &[Row::skipped("<script>", "not asked for")], &[]);
        assert!(!text.contains("<script>\" ") && text.contains("&lt;script&gt;"), "{text}");
        assert!(!text.contains("http://") && !text.contains("https://"));
    }
}
