//! Recordings of one specimen, fitted and diagnosed together: those of the same `[specimen]` and `[model]` under the same gravity, however each was filmed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::find::{Found, Kind};
use super::layers;
use super::state::{self, Status};
use crate::digest;
use crate::series::AngleSeries;

/// The folder of what recordings say together, below that of all results.
pub const FOLDER: &str = "together";
/// Most recordings of one fit (cost: its time grows with them; more of the same amplitudes tell little more).
const MOST: usize = 6;

/// Every specimen of which two or more recordings are done, with their tables; of many recordings the smallest swing, the largest, and some between.
pub fn specimens(found: &[Found], folder_of: impl Fn(&Found) -> PathBuf) -> Vec<Found> {
    let mut groups: BTreeMap<String, Vec<&Found>> = BTreeMap::new();
    for own in found {
        let is_done = state::read(&folder_of(own)).is_some_and(|finished| finished.status == Status::Done);
        if let Some(specimen) = specimen(own).filter(|_| is_done) {
            groups.entry(specimen).or_default().push(own);
        }
    }
    groups.retain(|_, members| members.len() > 1);
    let names: Vec<String> = groups.keys().map(|config| named(config)).collect();
    let group = |((config, members), name): ((&String, &Vec<&Found>), &String)| {
        let is_alone = names.iter().filter(|other| *other == name).count() == 1;
        let name =
            if is_alone { name.clone() } else { format!("{name}-{}", &digest::of_bytes(config.as_bytes())[..8]) };
        let tables = members.iter().map(|member| folder_of(member).join("angles.csv")).collect();
        Found {
            name: format!("{FOLDER}/{name}"),
            paths: of_all_amplitudes(tables),
            kind: Kind::Table,
            configs: members[0].configs.clone(),
        }
    };
    groups.iter().zip(&names).map(group).collect()
}

/// What tells specimens apart in the experiment files of a recording.
fn specimen(own: &Found) -> Option<String> {
    let contents = layers::together(&own.configs).and_then(|layered| layered.contents()).ok()?;
    let mut all: Table = toml::from_str(std::str::from_utf8(&contents).ok()?).ok()?;
    all.contains_key("specimen").then_some(())?;
    all.retain(|key, _| ["specimen", "model", "rig"].contains(&key));
    if let Some(Value::Table(rig)) = all.get_mut("rig") {
        rig.retain(|key, _| key == "gravity_m_s2");
    }
    toml::to_string(&all).ok()
}

/// The specimen's name as that of a folder.
fn named(config: &str) -> String {
    let name: String = layers::specimen_name(config)
        .unwrap_or_default()
        .chars()
        .map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' })
        .collect();
    let name = name.trim_matches(['.', '_']);
    if name.is_empty() { "specimen".to_owned() } else { name.to_owned() }
}

/// At most [`MOST`] tables, evenly spread over the amplitudes, in the order of their names.
fn of_all_amplitudes(mut tables: Vec<PathBuf>) -> Vec<PathBuf> {
    if tables.len() > MOST {
        let mut sorted: Vec<(f64, PathBuf)> = tables.into_iter().map(|table| (amplitude_rad(&table), table)).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
        tables = (0..MOST).map(|k| sorted[k * (sorted.len() - 1) / (MOST - 1)].1.clone()).collect();
        tables.sort();
    }
    tables
}

/// The largest first angle; of a table that cannot be read 0.
fn amplitude_rad(table: &Path) -> f64 {
    let series = AngleSeries::read(table).ok();
    let first = series.and_then(|series| series.theta_rad.into_iter().next()).unwrap_or_default();
    first.into_iter().flatten().map(f64::abs).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_specimen_s_name_is_a_folder_s_name() {
        assert_eq!(named("[specimen]\nname = \"../Kapton 1 mil\"\n"), "Kapton_1_mil");
        assert_eq!(named("[rig]\n"), "specimen");
    }

    #[test]
    fn of_many_swings_the_smallest_and_the_largest_are_among_those_chosen() {
        let folder = tempfile::tempdir().unwrap();
        let table = |k: usize| {
            let path = folder.path().join(format!("{k:02}.csv"));
            let rows: String =
                (0..20).map(|row| format!("{row},{}\n", 0.01 * k as f64 * f64::from(row % 4 - 1))).collect();
            std::fs::write(&path, format!("t_s,theta1_rad\n{rows}")).unwrap();
            path
        };
        let chosen = of_all_amplitudes((1..=20).map(table).collect());
        let names: Vec<&str> = chosen.iter().map(|path| path.file_stem().unwrap().to_str().unwrap()).collect();
        assert_eq!(names, ["01", "04", "08", "12", "16", "20"]);
    }
}
