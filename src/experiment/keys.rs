//! Every key that an experiment file may hold, as the reader itself knows them.

use super::Experiment;

/// A key that nothing is called by.
const UNKNOWN: &str = "no_such_key";

impl Experiment {
    /// Every key by its path: `rig.marks`, `model.effects.support_motion.amplitude_m`, `specimen.links.com_m`. Tables
    /// themselves are left out.
    ///
    /// The reader is asked, so the list cannot be out of date: a key that it does not know makes it name those that it
    /// does.
    pub fn known_keys() -> Vec<String> {
        let mut keys = Vec::new();
        below("", &mut keys);
        keys
    }
}

/// Adds what stands in a table; `false` where there is no such table.
fn below(table: &str, keys: &mut Vec<String>) -> bool {
    let Some(names) = names_in(table) else { return false };
    for name in names {
        let path = if table.is_empty() { name } else { format!("{table}.{name}") };
        if !below(&path, keys) {
            keys.push(path);
        }
    }
    true
}

/// The keys of a table, or of an array of tables.
fn names_in(table: &str) -> Option<Vec<String>> {
    let heads = match table {
        "" => vec![String::new()],
        _ => vec![format!("[{table}]\n"), format!("[[{table}]]\n")],
    };
    heads.into_iter().find_map(|head| {
        let error = toml::from_str::<Experiment>(&format!("{head}{UNKNOWN} = 0\n")).err()?;
        let known = error.message().strip_prefix(&format!("unknown field `{UNKNOWN}`"))?;
        Some(known.split('`').skip(1).step_by(2).map(str::to_owned).collect())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_in_tables_within_tables_and_in_arrays_of_tables() {
        let keys = Experiment::known_keys();
        for key in ["rig.marks", "specimen.links.com_m", "model.effects.support_motion.phase_rad", "render.codec.crf"] {
            assert!(keys.iter().any(|k| k == key), "{key} is not among {keys:?}");
        }
        assert!(!keys.iter().any(|k| k == "model.effects" || k == "rig"), "{keys:?}");
    }
}
