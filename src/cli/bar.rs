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
        Self { bar: Mutex::new(ProgressBar::hidden()), quiet }
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
            Some(_) => "{prefix:>10} {wide_bar} {pos}/{len} frames, {per_sec}, {eta} left",
            None => "{prefix:>10} {spinner} {pos} frames, {per_sec}",
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
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
