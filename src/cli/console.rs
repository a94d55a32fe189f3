//! Where a command speaks: to the person who typed it, or, as a stage of a run, into the run's log.

use std::fmt::Display;
use std::fs::File;
use std::io::Write;
use std::sync::Mutex;

use super::Bar;
use super::bar::Shown;
use crate::error::{Error, Result};
use crate::output;

/// Standard output and standard error, and the log of a run if there is one.
#[derive(Debug, Default)]
pub struct Console {
    /// The log of a run, and where the progress of its stages is shown.
    run: Option<(Mutex<File>, Shown)>,
}

impl Console {
    /// For the stages of a run. What they print goes into the log alone; what they warn of also to standard error, where progress is shown there.
    pub fn of_run(log: File, shown: Shown) -> Self {
        Self { run: Some((Mutex::new(log), shown)) }
    }

    /// Something that a person should know.
    pub fn warning(&self, text: impl Display) {
        let line = format!("warning: {text}");
        if self.shown(false) == Shown::OnTerminal {
            eprintln!("{line}");
        }
        self.log(&line);
    }

    /// Everything that a person should know of one thing.
    pub fn warnings(&self, texts: &[impl Display]) {
        texts.iter().for_each(|text| self.warning(text));
    }

    /// What was done, beside the result.
    pub fn remark(&self, line: impl Display) {
        match &self.run {
            Some(_) => self.log(&line.to_string()),
            None => eprintln!("{line}"),
        }
    }

    /// The result.
    ///
    /// # Errors
    /// [`Error::Unwritable`] for standard output.
    pub fn print(&self, text: &str) -> Result<()> {
        if self.run.is_some() {
            self.log(text.trim_end());
            return Ok(());
        }
        output::to_standard_output(text.as_bytes()).map_err(|e| Error::unwritable("standard output".as_ref(), e))
    }

    /// A line of the log, if there is one. A log that cannot grow does not end the work: what cannot be written then is the result, which says so.
    pub fn log(&self, line: &str) {
        if let Some(Ok(mut log)) = self.run.as_ref().map(|(log, _)| log.lock()) {
            let _ = writeln!(log, "{line}");
        }
    }

    /// A bar of frames. While it lives, Ctrl-C asks the work to stop instead of ending it.
    pub fn bar_of_frames(&self, quiet: bool) -> Bar {
        Bar::of_frames(self.shown(quiet))
    }

    /// A bar of fits: Ctrl-C ends the work at once.
    pub fn bar_of_fits(&self, quiet: bool) -> Bar {
        Bar::of_fits(self.shown(quiet))
    }

    fn shown(&self, quiet: bool) -> Shown {
        match &self.run {
            Some((_, shown)) => *shown,
            None if quiet => Shown::Nowhere,
            None => Shown::OnTerminal,
        }
    }
}
