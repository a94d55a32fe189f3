//! Programs as one starts them who may not read everything. Root may, so root starts them as the user nobody.

use std::fs::{self, File, Permissions};
use std::os::unix::fs::{PermissionsExt, chown};
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

/// The user and group nobody.
const NOBODY: u32 = 65534;

/// Starts a program in a folder that it may write to, and where closed files are closed to it.
pub struct Nobody {
    /// The program, and what must stand before it.
    words: Vec<PathBuf>,
    folder: PathBuf,
    /// Where the program stands: a build may lie where nobody else can go.
    _copy: Option<TempDir>,
}

impl Nobody {
    /// The folder becomes nobody's with all in it. Nothing, and a word about it, where that is not to be had.
    pub fn at(folder: &Path, program: &Path) -> Option<Self> {
        let mut own = Self { words: vec![program.to_owned()], folder: folder.to_owned(), _copy: None };
        if !may_read_all() {
            return Some(own);
        }
        let place = tempfile::tempdir().unwrap();
        set_mode(place.path(), 0o755);
        let copy = place.path().join("program");
        fs::copy(program, &copy).unwrap();
        let user = ["setpriv".to_owned(), format!("--reuid={NOBODY}"), format!("--regid={NOBODY}")];
        own.words = user.into_iter().chain(["--clear-groups".to_owned()]).map(PathBuf::from).chain([copy]).collect();
        own._copy = Some(place);
        let starts = give_away(folder).and_then(|()| own.command().arg("--version").output());
        if starts.is_ok_and(|output| output.status.success()) {
            return Some(own);
        }
        eprintln!("skipped: this user may read everything, and cannot start a program as nobody (setpriv)");
        None
    }

    pub fn command(&self) -> Command {
        let mut command = Command::new(&self.words[0]);
        command.args(&self.words[1..]).current_dir(&self.folder);
        command
    }
}

/// Gives a file or folder these rights, for its owner and others.
pub fn set_mode(path: &Path, mode: u32) {
    fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
}

fn may_read_all() -> bool {
    let probe = tempfile::NamedTempFile::new().unwrap();
    set_mode(probe.path(), 0o000);
    File::open(probe.path()).is_ok()
}

fn give_away(path: &Path) -> std::io::Result<()> {
    chown(path, Some(NOBODY), Some(NOBODY))?;
    if path.is_dir() {
        for entry in fs::read_dir(path)? {
            give_away(&entry?.path())?;
        }
    }
    Ok(())
}
