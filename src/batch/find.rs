//! The recordings and tables of angles below a folder, with the experiment files that hold for each.

use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::series::{AngleSeries, FEWEST_ROWS};
use crate::sidecar::Beside;

/// How recordings end. What is in them the decoder says.
const VIDEOS: [&str; 16] = [
    "mp4", "mov", "m4v", "avi", "mkv", "webm", "mts", "m2ts", "ts", "mpg", "mpeg", "wmv", "3gp", "flv", "ogv", "mjpeg",
];
/// The experiment file of a folder and of all below it.
const INHERITED: &str = "experiment.toml";
/// What a folder of stills holds besides them.
const STILL_TIMES: [&str; 3] = ["times.csv", "timestamps.csv", "times.txt"];

/// What a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A video, or a folder of stills.
    Recording,
    /// A table of angles.
    Table,
    /// A folder that cannot be read.
    Unreadable,
}

/// A recording or table below the input folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// Its path below the input folder, with `/`.
    pub name: String,
    /// Its path; of recordings that are taken together those of their tables.
    pub paths: Vec<PathBuf>,
    /// What it is.
    pub kind: Kind,
    /// The experiment files that hold for it, the farthest first.
    pub configs: Vec<PathBuf>,
}

/// What is below a folder.
#[derive(Debug, Default)]
pub struct Contents {
    /// Every recording and every table of angles, sorted by path.
    pub found: Vec<Found>,
    /// What might have been meant as one: the line that says why it is none.
    pub passed_over: Vec<String>,
}

/// What is below a folder; nothing of this or another batch's results, should they lie below it.
///
/// # Errors
/// [`Error::Unreadable`] for the folder itself, [`Error::NotAFolder`]. A folder below it that cannot be read is found as one that failed.
pub fn recordings(input: &Path, output: &Path) -> Result<Contents> {
    if input.is_file() {
        return Err(Error::NotAFolder { path: input.to_owned() });
    }
    // a link that leads back up is followed no further
    let mut search = Search { output: output.canonicalize().ok(), contents: Contents::default(), above: Vec::new() };
    search.folder(input, "", &[]).map_err(|e| Error::unreadable(input, e))?;
    search.contents.found.sort_by(|a, b| a.name.cmp(&b.name));
    search.contents.passed_over.sort();
    Ok(search.contents)
}

struct Search {
    output: Option<PathBuf>,
    contents: Contents,
    /// The folders above the one that is looked into, without links.
    above: Vec<PathBuf>,
}

impl Search {
    fn folder(&mut self, folder: &Path, name: &str, configs: &[PathBuf]) -> std::io::Result<()> {
        let own = folder.canonicalize()?;
        let is_results = self.output.as_ref() == Some(&own) || !name.is_empty() && own.join(super::lock::FILE).exists();
        if is_results || self.above.contains(&own) {
            return Ok(());
        }
        let entries = fs::read_dir(folder)?.collect::<std::io::Result<Vec<_>>>()?;
        let inherited = folder.join(INHERITED);
        let configs: Vec<PathBuf> =
            configs.iter().cloned().chain(fs::symlink_metadata(&inherited).is_ok().then_some(inherited)).collect();
        self.above.push(own);
        for entry in entries {
            let file_name = entry.file_name().to_string_lossy().into_owned();
            // hidden files, and the temporaries of a program that writes
            if file_name.starts_with('.') {
                continue;
            }
            let path = entry.path();
            let name = if name.is_empty() { file_name } else { format!("{name}/{file_name}") };
            let kind =
                if path.is_dir() { self.kind_of_folder(&path, &name, &configs) } else { self.kind_of_file(&path) };
            let Some(kind) = kind else { continue };
            let beside = path.with_extension("toml");
            let beside = (kind != Kind::Unreadable && fs::symlink_metadata(&beside).is_ok()).then_some(beside);
            let configs = configs.iter().cloned().chain(beside).collect();
            self.contents.found.push(Found { name, paths: vec![path], kind, configs });
        }
        self.above.pop();
        Ok(())
    }

    /// A folder of stills with their times is one recording; any other is looked into.
    fn kind_of_folder(&mut self, path: &Path, name: &str, configs: &[PathBuf]) -> Option<Kind> {
        let stills = crate::video::stills_in(path).map_or(0, |stills| stills.len());
        if stills > 0 && STILL_TIMES.iter().any(|times| path.join(times).is_file()) {
            return Some(Kind::Recording);
        }
        // a few pictures are a preview, not a swing
        if stills >= FEWEST_ROWS {
            let why = "says when none of them was taken; put times.csv beside them";
            self.contents.passed_over.push(format!("{}: holds {stills} stills and {why}", path.display()));
        }
        self.folder(path, name, configs).is_err().then_some(Kind::Unreadable)
    }

    fn kind_of_file(&mut self, path: &Path) -> Option<Kind> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        if VIDEOS.contains(&extension.as_str()) {
            return Some(Kind::Recording);
        }
        if extension != "csv" || STILL_TIMES.iter().any(|times| path.ends_with(times)) {
            return None;
        }
        if has_columns_of_angles(path) {
            return Some(Kind::Table);
        }
        self.contents.passed_over.extend(AngleSeries::read(path).err().map(|error| error.to_string()));
        None
    }
}

/// Whether a table has the columns of angles. One that cannot be read is taken for one: its row says why.
fn has_columns_of_angles(path: &Path) -> bool {
    let Ok(file) = File::open(path) else { return true };
    let mut header = Vec::new();
    // a first line of a megabyte is no header
    if BufReader::new(std::io::Read::take(file, 1 << 20)).read_until(b'\n', &mut header).is_err() {
        return true;
    }
    let header = String::from_utf8_lossy(&header);
    let columns: Vec<&str> = header
        .trim_start_matches('\u{feff}')
        .split([',', ';', '\t'])
        .map(|column| column.trim().trim_matches('"'))
        .collect();
    columns.contains(&"t_s") && columns.contains(&"theta1_rad")
}

impl Found {
    /// Its size; of what cannot be asked, 0.
    pub fn bytes(&self) -> u64 {
        let of = |path: &Path| fs::metadata(path).map_or(0, |own| own.len());
        let whole = |path: &PathBuf| match fs::read_dir(path) {
            Ok(entries) => entries.filter_map(|entry| Some(of(&entry.ok()?.path()))).sum(),
            Err(_) => of(path),
        };
        self.paths.iter().map(whole).sum()
    }

    /// The file or folder; of several the first.
    pub fn path(&self) -> &Path {
        self.paths.first().map_or(Path::new(""), PathBuf::as_path)
    }

    /// The recording from which a table was measured, if that is among all: what stands beside the table says so.
    pub fn made_from(&self, all: &[PathBuf]) -> Option<PathBuf> {
        if self.kind != Kind::Table {
            return None;
        }
        let beside = Beside::of(self.path())?;
        let source = beside.recording().file_name()?;
        let is_it = |other: &&PathBuf| other.file_name() == Some(source) && other.parent() == self.path().parent();
        all.iter().find(is_it).cloned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(folder: &Path, name: &str, contents: &str) {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, contents).unwrap();
    }

    #[test]
    fn recordings_and_tables_are_found_with_the_files_that_hold_for_them() {
        let folder = tempfile::tempdir().unwrap();
        let top = folder.path();
        for name in ["b.MP4", "a/c.mov", "a/notes.txt", "a/.hidden.mp4", "out/b.MP4/overlay.mp4", "a/experiment.toml"] {
            file(top, name, "");
        }
        for name in ["experiment.toml", "a/c.toml"] {
            file(top, name, "");
        }
        file(top, "a/d.csv", "frame,t_s,theta1_rad\n");
        file(top, "a/other.csv", "time,volts\n");
        let found = recordings(top, &top.join("out")).unwrap().found;
        let names: Vec<&str> = found.iter().map(|found| found.name.as_str()).collect();
        assert_eq!(names, ["a/c.mov", "a/d.csv", "b.MP4"]);
        let configs = |index: usize| -> Vec<PathBuf> {
            found[index].configs.iter().map(|path| path.strip_prefix(top).unwrap().to_owned()).collect()
        };
        assert_eq!(configs(0), ["experiment.toml", "a/experiment.toml", "a/c.toml"].map(PathBuf::from));
        assert_eq!(configs(2), ["experiment.toml"].map(PathBuf::from));
        assert_eq!(found[1].kind, Kind::Table);
    }

    #[test]
    fn a_table_that_was_measured_from_a_recording_beside_it_is_not_another_one() {
        let folder = tempfile::tempdir().unwrap();
        let top = folder.path();
        file(top, "swing.mp4", "");
        file(top, "angles.csv", "t_s,theta1_rad\n");
        file(top, "angles.json", r#"{"schema": "freeswing.angles/1", "source": {"file": "somewhere/swing.mp4"}}"#);
        let found = recordings(top, &top.join("out")).unwrap().found;
        let all: Vec<PathBuf> = found.iter().map(|found| found.path().to_owned()).collect();
        assert_eq!(found[0].made_from(&all), Some(top.join("swing.mp4")));
        fs::remove_file(top.join("swing.mp4")).unwrap();
        assert_eq!(found[0].made_from(&all[..1]), None);
    }
}
