//! One batch at a time in an output folder; several parts of one, each once.
//!
//! The system frees a lock when its holder ends, however that came about: a killed batch leaves nothing to be cleared away.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::Path;

use super::Shard;
use crate::error::{Error, Result};

/// The file whose lock is taken, which also marks a folder as results.
pub const FILE: &str = ".batch";
/// Those of its parts begin so.
const PART: &str = ".batch-";

/// Held while a batch works.
#[derive(Debug)]
pub struct Lock {
    _whole: File,
    _part: Option<File>,
}

impl Lock {
    /// Takes the lock of an output folder: for all of it, or for a part beside other parts.
    ///
    /// # Errors
    /// [`Error::Busy`] that names the holder, [`Error::Unwritable`].
    pub fn take(output: &Path, shard: Option<Shard>) -> Result<Self> {
        let whole = Locked { path: &output.join(FILE), folder: output };
        let Some(shard) = shard else { return Ok(Self { _whole: whole.alone()?, _part: None }) };
        let part = output.join(format!("{PART}{}-of-{}", shard.part, shard.of));
        Ok(Self { _whole: whole.beside_others()?, _part: Some(Locked { path: &part, folder: output }.alone()?) })
    }
}

struct Locked<'p> {
    path: &'p Path,
    folder: &'p Path,
}

impl Locked<'_> {
    fn open(&self) -> Result<File> {
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(self.path);
        file.map_err(|e| Error::unwritable(self.path, e))
    }

    fn alone(&self) -> Result<File> {
        let mut file = self.open()?;
        self.taken(file.try_lock(), &mut file)?;
        let holder = format!("process {} on {}\n", std::process::id(), host());
        let written = file.set_len(0).and_then(|()| file.write_all(holder.as_bytes()));
        written.map_err(|e| Error::unwritable(self.path, e))?;
        Ok(file)
    }

    fn beside_others(&self) -> Result<File> {
        let mut file = self.open()?;
        self.taken(file.try_lock_shared(), &mut file)?;
        // the last batch that was alone is not among the holders
        file.set_len(0).map_err(|e| Error::unwritable(self.path, e))?;
        Ok(file)
    }

    fn taken(&self, outcome: std::result::Result<(), TryLockError>, file: &mut File) -> Result<()> {
        match outcome {
            Ok(()) => Ok(()),
            Err(TryLockError::Error(error)) => Err(Error::unwritable(self.path, error)),
            Err(TryLockError::WouldBlock) => {
                let mut holder = String::new();
                // without a name the message still says what is the matter
                let _ = file.read_to_string(&mut holder);
                let holder = match holder.trim() {
                    "" => part_at_work(self.folder).unwrap_or_else(|| "another batch".to_owned()),
                    holder => format!("another batch ({holder})"),
                };
                Err(Error::Busy { path: self.folder.to_owned(), holder })
            }
        }
    }
}

/// One of the parts that are at work in an output folder.
fn part_at_work(output: &Path) -> Option<String> {
    let entries = std::fs::read_dir(output).ok()?.flatten();
    entries.into_iter().find_map(|entry| {
        let name = entry.file_name().to_string_lossy().strip_prefix(PART)?.replace("-of-", " of ");
        let mut file = File::open(entry.path()).ok()?;
        matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)).then_some(())?;
        let mut holder = String::new();
        file.read_to_string(&mut holder).ok()?;
        Some(format!("part {name} of a batch ({})", holder.trim()))
    })
}

/// The machine's name.
fn host() -> String {
    std::fs::read_to_string("/proc/sys/kernel/hostname")
        .map_or_else(|_| "this machine".to_owned(), |name| name.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_is_refused_by_the_name_of_the_first() {
        let folder = tempfile::tempdir().unwrap();
        let first = Lock::take(folder.path(), None).unwrap();
        let refused = Lock::take(folder.path(), None).unwrap_err().to_string();
        assert!(refused.contains(&format!("process {}", std::process::id())), "{refused}");
        assert!(Lock::take(folder.path(), Some(Shard { part: 1, of: 2 })).is_err());
        drop(first);
        Lock::take(folder.path(), None).unwrap();
    }

    #[test]
    fn parts_work_beside_each_other_each_once() {
        let folder = tempfile::tempdir().unwrap();
        drop(Lock::take(folder.path(), None).unwrap());
        let part = |part| Lock::take(folder.path(), Some(Shard { part, of: 2 }));
        let first = part(1).unwrap();
        let _second = part(2).unwrap();
        assert!(part(1).is_err());
        let refused = Lock::take(folder.path(), None).unwrap_err().to_string();
        assert!(refused.contains(" of 2 of a batch (process "), "{refused}");
        drop(first);
        part(1).unwrap();
    }
}
