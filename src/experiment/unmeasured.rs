//! Keys that wait for a person with a ruler: `freeswing init` writes them as `key = "MEASURE"`.

use std::path::Path;

use crate::error::{Error, Result};

/// What stands in place of a number.
pub const MARKER: &str = "\"MEASURE\"";

/// The key of a line that still waits.
fn waiting(line: &str) -> Option<&str> {
    let (key, value) = line.split_once('=')?;
    let key = key.trim();
    (!key.starts_with('#') && value.trim_start().starts_with(MARKER)).then_some(key)
}

/// No key may still wait.
///
/// # Errors
/// [`Error::Config`] with the first key that does, and its line.
pub fn refuse(text: &str, path: &Path) -> Result<()> {
    let mut table = String::new();
    for (number, line) in text.lines().enumerate() {
        if let Some(name) = line.trim().strip_prefix('[').and_then(|l| l.split(']').next()) {
            table = format!("{}.", name.trim_matches('['));
        }
        if let Some(key) = waiting(line) {
            let message = format!("{table}{key} is still to be measured; put the number in place of {MARKER}");
            return Err(Error::Config { path: path.to_owned(), line: Some(number + 1), message });
        }
    }
    Ok(())
}

/// The text with every line that still waits left empty, so that the others keep their numbers.
pub fn without(text: &str) -> String {
    text.lines()
        .map(|line| if waiting(line).is_some() { "" } else { line })
        .fold(String::new(), |text, line| text + line + "\n")
}

/// A line of the text states this key.
pub fn states(text: &str, key: &str) -> bool {
    text.lines().filter_map(|line| line.split_once('=')).any(|(name, _)| name.trim() == key)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "[specimen]\nname = \"x\"\nmass_kg = \"MEASURE\"  # kg\n# length_m = \"MEASURE\"\n";

    #[test]
    fn the_first_key_that_waits_is_named_with_its_line() {
        let error = refuse(FILE, Path::new("e.toml")).unwrap_err().to_string();
        assert_eq!(error, "e.toml:3: specimen.mass_kg is still to be measured; put the number in place of \"MEASURE\"");
        assert!(refuse("[rig]\nmirrored = true\n", Path::new("e.toml")).is_ok());
    }

    #[test]
    fn without_them_the_rest_can_be_read() {
        let text = without(FILE);
        assert!(!text.contains("mass_kg") && text.contains("name = \"x\""));
        assert_eq!(text.lines().count(), FILE.lines().count());
    }
}
