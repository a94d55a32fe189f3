//! The progress bar on standard error, only on a terminal, and Ctrl-C.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, Once};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::error::Error;
use crate::output;
use crate::progress::{Progress, ProgressEvent};

static CANCELLED: AtomicBool = AtomicBool::new(false);
/// Bars whose work stops by itself when it is asked to.
static LISTENERS: AtomicUsize = AtomicUsize::new(0);
static HANDLER: Once = Once::new();

/// How often the time of a stage is drawn anew.
const TICK: Duration = Duration::from_millis(200);

/// From here on Ctrl-C, and the signals that end a program, ask work that listens to stop; any other work, or a second signal, ends with the temporary
/// files removed.
pub fn install_signal_handler() {
    HANDLER.call_once(|| {
        let _ = ctrlc::set_handler(|| {
            let again = CANCELLED.swap(true, Ordering::SeqCst);
            if again || LISTENERS.load(Ordering::SeqCst) == 0 {
                let _no_more = output::remove_temporaries();
                eprintln!("error: {}", Error::Interrupted);
                std::process::exit(2);
            }
        });
    });
}

/// Where progress is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// On standard error, where that is a terminal.
    OnTerminal,
    /// On standard output, a line each time, for a program that watches.
    AsLines,
    /// Nowhere.
    Nowhere,
}

/// Tells a program that watches. One that has gone hears nothing.
fn tell(heard: &ProgressEvent) {
    let line = serde_json::to_string(heard).unwrap_or_default() + "\n";
    let _ = output::to_standard_output(line.as_bytes());
}

/// Shows progress; hears Ctrl-C.
pub struct Bar {
    bar: Mutex<ProgressBar>,
    shown: Shown,
    /// Whether it counts frames, all alike, not fits, some of which take a hundred times as long as others.
    frames: bool,
}

impl Bar {
    /// A bar of frames. While it lives, Ctrl-C asks the work to stop instead of ending it.
    pub fn of_frames(shown: Shown) -> Self {
        LISTENERS.fetch_add(1, Ordering::SeqCst);
        Self::counting(true, shown)
    }

    /// The same for work that counts fits: Ctrl-C ends it at once.
    pub fn of_fits(shown: Shown) -> Self {
        Self::counting(false, shown)
    }

    fn counting(frames: bool, shown: Shown) -> Self {
        Self { bar: Mutex::new(ProgressBar::hidden()), shown, frames }
    }

    /// What is shown of a stage. The time that is left can be told only where the steps are alike; elsewhere the time that has passed says as much.
    fn template(&self, total: Option<u64>) -> &'static str {
        match (self.frames, total) {
            (true, Some(_)) => "{prefix:>11} {wide_bar} {pos}/{len} frames, {per_sec}, {eta} left",
            (true, None) => "{prefix:>11} {spinner} {pos} frames, {per_sec}",
            (false, Some(_)) => "{prefix:>11} {wide_bar} {pos}/{len}, {elapsed}",
            (false, None) => "{prefix:>11} {spinner} {elapsed}",
        }
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
        if self.frames {
            LISTENERS.fetch_sub(1, Ordering::SeqCst);
        }
    }
}

impl Progress for Bar {
    fn begin(&self, stage: &'static str, total: Option<u64>) {
        // indicatif itself stays silent where standard error is no terminal
        let target = match self.shown {
            Shown::OnTerminal => ProgressDrawTarget::stderr(),
            Shown::AsLines | Shown::Nowhere => ProgressDrawTarget::hidden(),
        };
        if self.shown == Shown::AsLines {
            tell(&ProgressEvent::Began { stage: stage.to_owned(), total });
        }
        let new = ProgressBar::with_draw_target(total, target);
        if let Ok(style) = ProgressStyle::with_template(self.template(total)) {
            new.set_style(style);
        }
        new.set_prefix(stage);
        self.with(|bar| {
            bar.finish_and_clear();
            *bar = new;
            if self.shown == Shown::OnTerminal {
                bar.enable_steady_tick(TICK);
            }
        });
    }

    fn advance(&self, steps: u64) {
        self.with(|bar| {
            bar.inc(steps);
            if self.shown == Shown::AsLines {
                tell(&ProgressEvent::Stands { at: bar.position() });
            }
        });
    }

    fn is_cancelled(&self) -> bool {
        CANCELLED.load(Ordering::SeqCst)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_steps_that_are_alike_promise_a_time_that_is_left() {
        assert!(Bar::of_frames(Shown::Nowhere).template(Some(10)).contains("{eta} left"));
        let fits = Bar::of_fits(Shown::Nowhere);
        assert!([Some(10), None].into_iter().all(|total| !fits.template(total).contains("eta")));
        assert!(fits.template(Some(10)).contains("{elapsed}"));
    }
}
