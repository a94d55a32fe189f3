//! When the stills of a folder were taken.
//!
//! A time file holds one number of seconds a line, in the stills' order, or rows `file,t_s`; a header, empty lines and
//! lines that begin with `#` are passed over.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Where the time stamps of stills come from.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum StillTimes {
    /// `times.csv`, `timestamps.csv` or `times.txt` among the stills.
    #[default]
    Beside,
    /// This file.
    File(PathBuf),
    /// So many stills per second.
    Rate(f64),
}

/// Names under which a time file is found among the stills.
const NAMES: [&str; 3] = ["times.csv", "timestamps.csv", "times.txt"];

impl StillTimes {
    /// A rising time stamp for each of `files`, s.
    ///
    /// # Errors
    /// [`Error::StillTimes`] where there is none, or where the times do not belong to the stills;
    /// [`Error::Unreadable`].
    pub(super) fn stamps_s(&self, folder: &Path, files: &[PathBuf]) -> Result<Vec<f64>> {
        let path = match self {
            Self::Rate(rate_hz) if *rate_hz > 0.0 && rate_hz.is_finite() => {
                return Ok((0..files.len()).map(|i| i as f64 / rate_hz).collect());
            }
            Self::Rate(rate_hz) => {
                let message = format!("{rate_hz} stills per second cannot be; give a number above 0");
                return Err(Error::Option { option: "--rate".to_owned(), message });
            }
            Self::File(path) => path.clone(),
            Self::Beside => NAMES.iter().map(|n| folder.join(n)).find(|p| p.is_file()).ok_or_else(|| {
                let detail = "the stills have no time stamps; put them in times.csv in this folder, or give --times FILE or --rate HZ";
                Error::StillTimes { path: folder.to_owned(), detail: detail.to_owned() }
            })?,
        };
        let text = std::fs::read(&path).map_err(|e| Error::unreadable(&path, e))?;
        let refused = |detail: String| Error::StillTimes { path: path.clone(), detail };
        let stamps = parse(&String::from_utf8_lossy(&text), files).map_err(refused)?;
        for (i, pair) in stamps.windows(2).enumerate() {
            if pair[1] <= pair[0] {
                let (name, [before, after]) = (name_of(&files[i + 1]), [pair[0], pair[1]]);
                return Err(refused(format!(
                    "{name}: {after} s does not follow {before} s; times must rise from still to still"
                )));
            }
        }
        Ok(stamps)
    }
}

fn name_of(file: &Path) -> String {
    file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

/// The times of `files` in a time file, or what is wrong with it.
fn parse(text: &str, files: &[PathBuf]) -> std::result::Result<Vec<f64>, String> {
    let mut in_order = Vec::new();
    let mut by_name = HashMap::new();
    let mut header_allowed = true;
    for (number, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let fields: Vec<&str> = line.split([',', ';', '\t']).map(|f| f.trim().trim_matches('"')).collect();
        let (name, value) = match fields[..] {
            [""] => continue,
            [first, ..] if first.starts_with('#') => continue,
            [value] => (None, value),
            [name, value, ..] => (Some(name), value),
            [] => continue,
        };
        let t_s = value.parse::<f64>().ok().filter(|t| t.is_finite());
        match (t_s, name) {
            (Some(t_s), None) => in_order.push(t_s),
            (Some(t_s), Some(name)) => drop(by_name.insert(name.to_owned(), t_s)),
            (None, _) if header_allowed => {}
            (None, _) => return Err(format!("line {}: {value:?} is not a number of seconds", number + 1)),
        }
        header_allowed = false;
    }
    if by_name.is_empty() {
        if in_order.len() != files.len() {
            return Err(format!(
                "holds {} times for {} stills; give one a still, in order",
                in_order.len(),
                files.len()
            ));
        }
        return Ok(in_order);
    }
    let stem = |f: &Path| f.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let time_of = |f: &PathBuf| by_name.get(&name_of(f)).or_else(|| by_name.get(&stem(f))).copied();
    files
        .iter()
        .map(|f| time_of(f).ok_or_else(|| format!("has no row for {}; give one a still: file,t_s", name_of(f))))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files() -> Vec<PathBuf> {
        ["a/1.png", "a/2.png"].map(PathBuf::from).to_vec()
    }

    #[test]
    fn numbers_stand_in_order_with_or_without_a_header() {
        assert_eq!(parse("0.1\n0.25\n", &files()), Ok(vec![0.1, 0.25]));
        assert_eq!(parse("\u{feff}t_s\r\n\r\n# camera 2\r\n0.1\r\n0.25\r\n", &files()), Ok(vec![0.1, 0.25]));
    }

    #[test]
    fn rows_name_their_still_in_any_order_and_may_name_others() {
        assert_eq!(parse("file,t_s\n2.png,0.5\n1.png,0.25\n9.png,7", &files()), Ok(vec![0.25, 0.5]));
        assert_eq!(parse("1,0.25\n2,0.5", &files()), Ok(vec![0.25, 0.5]));
    }

    #[test]
    fn what_does_not_belong_together_is_said() {
        assert_eq!(parse("0.1\n", &files()).unwrap_err(), "holds 1 times for 2 stills; give one a still, in order");
        assert_eq!(parse("1.png,0.5", &files()).unwrap_err(), "has no row for 2.png; give one a still: file,t_s");
        assert_eq!(parse("0.1\nsoon\n", &files()).unwrap_err(), "line 2: \"soon\" is not a number of seconds");
    }
}
