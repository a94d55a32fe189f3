//! Files written whole or not at all: a temporary beside the target, renamed when finished.
//!
//! A program that is stopped runs no destructor, so every temporary is also in one list, which [`remove_temporaries`] clears.

use std::fs::{File, Permissions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{NamedTempFile, TempPath};

use crate::error::{Error, Result};

/// The temporary files there are.
static TEMPORARIES: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn temporaries() -> MutexGuard<'static, Vec<PathBuf>> {
    TEMPORARIES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Deletes every temporary file, for a program that is about to be ended from outside. No further one can be made while the guard lives.
#[must_use = "the program ends while it is held"]
pub fn remove_temporaries() -> impl Sized {
    let mut all = temporaries();
    for path in all.drain(..) {
        // what is not there any more needs no removal
        let _ = std::fs::remove_file(path);
    }
    all
}

/// A temporary file that is deleted unless it is persisted, also when the program is stopped.
#[derive(Debug)]
pub struct Temporary(NamedTempFile);

impl Temporary {
    /// The file in place of `path`.
    ///
    /// # Errors
    /// [`Error::Unwritable`]; the temporary is gone then.
    pub fn persist(self, path: &Path) -> Result<()> {
        let own = self.0.path().to_owned();
        let kept = self.0.persist(path).map(drop).map_err(|e| Error::unwritable(path, e.error));
        forget(&own);
        kept
    }

    /// For a writer of its own.
    pub fn as_file(&self) -> &File {
        self.0.as_file()
    }

    /// Its path alone, for a writer that opens the file itself. The list keeps the path: it is unique to this program.
    pub fn into_path(self) -> TempPath {
        self.0.into_temp_path()
    }
}

/// Takes a file that is gone from the list.
fn forget(path: &Path) {
    temporaries().retain(|other| other != path);
}

/// An output that appears only when it is finished.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    sink: Sink,
}

#[derive(Debug)]
enum Sink {
    /// Beside the target, renamed over it.
    Temporary(Temporary),
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
            Sink::StandardOutput => to_standard_output(contents),
            Sink::Device => std::fs::write(&self.path, contents),
            Sink::Temporary(file) => file.0.write_all(contents),
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
            Sink::Temporary(file) => file.persist(&self.path),
        }
    }
}

/// Whether two paths lead to one file, or folder, that is there.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
}

/// Whether what is written to `b` takes the place of `a`, be they there or not. A device or pipe takes all that comes.
pub fn is_same_target(a: &Path, b: &Path) -> bool {
    if b.exists() {
        return b.is_file() && is_same_file(a, b);
    }
    a == b || (a.file_name() == b.file_name() && is_same_file(folder_of(a), folder_of(b)))
}

/// The folder in which a file stands.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Makes a folder for outputs, and those above it.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn make_folder(path: &Path) -> Result<()> {
    let not_a_folder = path.ancestors().find(|above| above.exists()).filter(|above| !above.is_dir());
    match not_a_folder {
        Some(file) if file == path => Err(Error::unwritable(path, std::io::Error::other("it is a file, not a folder"))),
        Some(file) => Err(Error::unwritable(path, std::io::Error::other(format!("{} is a file", file.display())))),
        None => std::fs::create_dir_all(path).map_err(|e| Error::unwritable(path, e)),
    }
}

/// A copy of a file, whole or not at all.
///
/// # Errors
/// [`Error::Unreadable`], [`Error::Unwritable`].
pub fn copy(from: &Path, to: &Path) -> Result<()> {
    let contents = std::fs::read(from).map_err(|e| Error::unreadable(from, e))?;
    OutputFile::create(to)?.commit(&contents)
}

/// Standard output; a reader that has seen enough, such as `head`, is no failure.
///
/// # Errors
/// Any other failure to write.
pub fn to_standard_output(contents: &[u8]) -> std::io::Result<()> {
    let mut standard_output = std::io::stdout().lock();
    match standard_output.write_all(contents).and_then(|()| standard_output.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}

/// How the names of temporary files begin.
const TEMPORARY: &str = ".freeswing-";

/// Removes what programs that were ended from outside have left in a folder, as well as that can be done.
pub fn remove_left_temporaries(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(TEMPORARY) && entry.path().is_file() {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// A temporary file in the folder of `path`, with its extension, deleted unless it is persisted.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn temporary_beside(path: &Path) -> Result<Temporary> {
    let folder = folder_of(path);
    if !folder.exists() {
        let missing = std::io::Error::other(format!("there is no folder {}", folder.display()));
        return Err(Error::unwritable(path, missing));
    }
    let suffix = path.extension().map(|e| format!(".{}", e.to_string_lossy())).unwrap_or_default();
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY).suffix(&suffix);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // the umask applies, as to any file a program makes
        builder.permissions(Permissions::from_mode(0o666));
    }
    // made under the lock, so that no file can appear that the list does not hold
    let mut all = temporaries();
    // the message that is wrapped in it names the temporary file
    let file = builder.tempfile_in(folder).map_err(|e| Error::unwritable(path, e.kind().into()))?;
    all.push(file.path().to_owned());
    Ok(Temporary(file))
}
