//! The progress bar on standard error, only on a terminal, and Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, Once};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::progress::Progress;

static CANCELLED: AtomicBool = AtomicBool::new(false);
static HANDLER: Once = Once::new();

/// Shows progress; hears Ctrl-C.
pub struct Bar {
    bar: Mutex<ProgressBar>,
    quiet: bool,
    /// What is counted, with a space before it.
    unit: &'static str,
}

impl Bar {
    /// A bar that stays silent with `quiet`. From here on Ctrl-C asks the work to stop instead of killing it, so
    /// that no temporary file is left behind; a second one kills.
    pub fn new(quiet: bool) -> Self {
        HANDLER.call_once(|| {
            let _ = ctrlc::set_handler(|| {
                if CANCELLED.swap(true, Ordering::SeqCst) {
                    std::process::exit(2);
                }
            });
        });
        Self::counting(" frames", quiet)
    }

    /// The same for work that counts fits and holds no file open: Ctrl-C ends it at once.
    pub fn of_fits(quiet: bool) -> Self {
        Self::counting("", quiet)
    }

    fn counting(unit: &'static str, quiet: bool) -> Self {
        Self { bar: Mutex::new(ProgressBar::hidden()), quiet, unit }
    }

    fn with(&self, f: impl FnOnce(&mut ProgressBar)) {
        if let Ok(mut bar) = self.bar.lock() {
            f(&mut bar);
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.with(|bar| bar.finish_and_clear());
    }
}

impl Progress for Bar {
    fn begin(&self, stage: &'static str, total: Option<u64>) {
        // indicatif itself stays silent where standard error is no terminal
        let target = if self.quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let new = ProgressBar::with_draw_target(total, target);
        let template = match total {
            Some(_) => format!("{{prefix:>11}} {{wide_bar}} {{pos}}/{{len}}{}, {{per_sec}}, {{eta}} left", self.unit),
            None => format!("{{prefix:>11}} {{spinner}} {{pos}}{}, {{per_sec}}", self.unit),
        };
        if let Ok(style) = ProgressStyle::with_template(&template) {
            new.set_style(style);
        }
        new.set_prefix(stage);
        self.with(|bar| {
            bar.finish_and_clear();
            *bar = new;
        });
    }

    fn advance(&self, steps: u64) {
        self.with(|bar| bar.inc(steps));
    }

    fn is_cancelled(&self) -> bool {
        CANCELLED.load(Ordering::SeqCst)
    }
}
