//! Reading what a command is given.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// A file's bytes, `-` being standard input, and what messages call it.
///
/// # Errors
/// [`Error::Unreadable`].
pub fn read(path: &Path) -> Result<(PathBuf, Vec<u8>)> {
    if path.as_os_str() != "-" {
        return Ok((path.to_owned(), std::fs::read(path).map_err(|e| Error::unreadable(path, e))?));
    }
    let name = PathBuf::from("standard input");
    let mut bytes = Vec::new();
    std::io::stdin().lock().read_to_end(&mut bytes).map_err(|e| Error::unreadable(&name, e))?;
    Ok((name, bytes))
}
