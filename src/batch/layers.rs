//! Experiment files inherited downwards, put together: what a nearer file states takes the place of what a farther one does, key by key.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

use crate::error::{Error, Result};

/// Keys of `[specimen]` that describe its geometry, in two ways that exclude each other.
const AS_STRIP: [&str; 5] = ["mass_kg", "length_m", "link_lengths_m", "inertia", "lumps"];
const AS_LINKS: &str = "links";
/// Keys of `[rig]` that name a file, from the folder of the file that states them.
const PATHS: [&str; 2] = ["lens_calibration", "mask"];

/// What holds for a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Layered {
    /// No file.
    None,
    /// One file, as it stands.
    One(PathBuf),
    /// Several, put together into this text.
    Several(String),
}

/// Puts experiment files together, the farthest first.
///
/// # Errors
/// [`Error::Unreadable`], [`Error::Config`] for one that is no TOML.
pub fn together(files: &[PathBuf]) -> Result<Layered> {
    match files {
        [] => Ok(Layered::None),
        [one] => Ok(Layered::One(one.clone())),
        several => {
            let mut all = Table::new();
            for file in several {
                lay_over(&mut all, read(file)?);
            }
            let names: Vec<String> = several.iter().map(|file| format!("# {}\n", file.display())).collect();
            // a table that was read can be written
            let text = toml::to_string(&all).unwrap_or_default();
            Ok(Layered::Several(format!("# Put together from, the last before the first:\n{}\n{text}", names.concat())))
        }
    }
}

impl Layered {
    /// The bytes that a result depends on.
    ///
    /// # Errors
    /// [`Error::Unreadable`].
    pub fn contents(&self) -> Result<Vec<u8>> {
        match self {
            Self::None => Ok(Vec::new()),
            Self::One(path) => std::fs::read(path).map_err(|e| Error::unreadable(path, e)),
            Self::Several(text) => Ok(text.clone().into_bytes()),
        }
    }
}

/// The specimen's name in the text of an experiment file.
pub fn specimen_name(text: &str) -> Option<String> {
    let table: Table = toml::from_str(text).ok()?;
    Some(table.get("specimen")?.get("name")?.as_str()?.to_owned())
}

fn read(path: &Path) -> Result<Table> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::unreadable(path, e))?;
    let mut table: Table = toml::from_str(&text).map_err(|error: toml::de::Error| Error::Config {
        path: path.to_owned(),
        line: error.span().map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1),
        message: error.message().lines().next().unwrap_or_default().to_owned(),
    })?;
    let folder = std::path::absolute(path).ok().and_then(|path| path.parent().map(Path::to_owned)).unwrap_or_default();
    if let Some(Value::Table(rig)) = table.get_mut("rig") {
        for key in PATHS {
            if let Some(Value::String(file)) = rig.get_mut(key) {
                *file = folder.join(&*file).to_string_lossy().into_owned();
            }
        }
    }
    Ok(table)
}

fn lay_over(all: &mut Table, nearer: Table) {
    if let (Some(Value::Table(far)), Some(Value::Table(near))) = (all.get_mut("specimen"), nearer.get("specimen")) {
        if near.contains_key(AS_LINKS) {
            far.retain(|key, _| !AS_STRIP.contains(&key));
        } else if AS_STRIP.iter().any(|key| near.contains_key(*key)) {
            far.remove(AS_LINKS);
        }
    }
    for (key, value) in nearer {
        match (all.get_mut(&key), value) {
            (Some(Value::Table(far)), Value::Table(near)) => lay_over(far, near),
            (_, value) => _ = all.insert(key, value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::Experiment;

    fn put_together(texts: &[&str]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let file = |(i, text): (usize, &&str)| {
            let path = folder.path().join(format!("{i}.toml"));
            std::fs::write(&path, text).unwrap();
            path
        };
        let files: Vec<PathBuf> = texts.iter().enumerate().map(file).collect();
        match together(&files).unwrap() {
            Layered::Several(text) => text,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_nearer_file_overrides_key_by_key() {
        let far = "[specimen]\nname = \"PET\"\nmass_kg = 4e-4\nlength_m = 0.2\nlink_lengths_m = [0.1, 0.1]\n[rig]\ngravity_m_s2 = 9.81\n";
        let text = put_together(&[far, "[rig]\npivot_px = [3.0, 4.0]\n", "[specimen]\nmass_kg = 5e-4\n"]);
        let all = Experiment::parse(&text, Path::new("e.toml")).unwrap();
        assert_eq!((all.specimen.mass_kg, all.specimen.length_m), (5e-4, 0.2));
        assert_eq!((all.rig.gravity_m_s2, all.rig.pivot_px), (9.81, Some([3.0, 4.0])));
    }

    #[test]
    fn links_take_the_place_of_a_strip() {
        let far = "[specimen]\nname = \"PET\"\nmass_kg = 4e-4\nlength_m = 0.2\nlink_lengths_m = [0.1, 0.1]\n";
        let near = "[[specimen.links]]\nlength_m = 0.3\nmass_kg = 0.1\ncom_m = 0.15\ninertia_kg_m2 = 7.5e-4\n";
        let all = Experiment::parse(&put_together(&[far, near]), Path::new("e.toml")).unwrap();
        assert_eq!((all.specimen.name.as_str(), all.specimen.lengths_m()), ("PET", vec![0.3]));
    }

    #[test]
    fn files_are_named_from_the_folder_of_the_file_that_names_them() {
        let text = put_together(&["[rig]\nmask = \"seen.png\"\n", "[specimen]\nname = \"a\"\n"]);
        let table: Table = toml::from_str(&text).unwrap();
        assert!(Path::new(table["rig"]["mask"].as_str().unwrap()).is_absolute(), "{text}");
    }
}
