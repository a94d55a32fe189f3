//! Files written whole or not at all: a temporary beside the target, renamed when finished.

use std::fs::Permissions;
use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{Error, Result};

/// An output that appears only when it is finished.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    sink: Sink,
}

#[derive(Debug)]
enum Sink {
    /// Beside the target, renamed over it.
    Temporary(NamedTempFile),
    /// A pipe or device, which cannot be renamed over.
    Device,
    /// `-`.
    StandardOutput,
}

impl OutputFile {
    /// Makes sure that `path` can be written, before any work is done.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn create(path: &Path) -> Result<Self> {
        let sink = if path.as_os_str() == "-" {
            Sink::StandardOutput
        } else if path.is_dir() {
            let kind = std::io::Error::other("it is a folder");
            return Err(Error::unwritable(path, kind));
        } else if path.exists() && !path.is_file() {
            Sink::Device
        } else {
            Sink::Temporary(temporary_beside(path)?)
        };
        Ok(Self { path: path.to_owned(), sink })
    }

    /// Whether it goes to standard output.
    pub fn is_standard_output(&self) -> bool {
        matches!(self.sink, Sink::StandardOutput)
    }

    /// Writes everything and lets it appear.
    ///
    /// # Errors
    /// [`Error::Unwritable`]; nothing appears then.
    pub fn commit(mut self, contents: &[u8]) -> Result<()> {
        self.write(contents)?;
        self.appear()
    }

    /// Writes everything, to appear later together with others; only a device shows it already.
    ///
    /// # Errors
    /// [`Error::Unwritable`]; nothing appears then.
    pub fn write(&mut self, contents: &[u8]) -> Result<()> {
        let written = match &mut self.sink {
            Sink::StandardOutput => std::io::stdout().write_all(contents),
            Sink::Device => std::fs::write(&self.path, contents),
            Sink::Temporary(file) => file.write_all(contents),
        };
        written.map_err(|e| Error::unwritable(&self.path, e))
    }

    /// Lets what was written appear under its name.
    ///
    /// # Errors
    /// [`Error::Unwritable`]; nothing appears then.
    pub fn appear(self) -> Result<()> {
        match self.sink {
            Sink::StandardOutput | Sink::Device => Ok(()),
            Sink::Temporary(file) => {
                file.persist(&self.path).map(drop).map_err(|e| Error::unwritable(&self.path, e.error))
            }
        }
    }
}

/// A temporary file in the folder of `path`, with its extension, deleted unless it is persisted.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn temporary_beside(path: &Path) -> Result<NamedTempFile> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let suffix = path.extension().map(|e| format!(".{}", e.to_string_lossy())).unwrap_or_default();
    let mut builder = tempfile::Builder::new();
    builder.prefix(".freeswing-").suffix(&suffix);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // the umask applies, as to any file a program makes
        builder.permissions(Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder).map_err(|e| Error::unwritable(path, e))
}
