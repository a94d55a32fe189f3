//! `freeswing init VIDEO`.

use std::path::{Path, PathBuf};

use super::Bar;
use crate::error::{Error, Result};
use crate::look::{Finding, look, preview, to_toml};
use crate::measure::Options;
use crate::output::OutputFile;

/// Look at a recording and write a starting experiment file.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  freeswing init swing.mp4
  freeswing init swing.mp4 --out rig/experiment.toml --preview seen.png
  track swing.mp4 --config experiment.toml --out angles.csv

Finds what swings, in which colours, and what stands still; proposes the marks in order, the pivot as the centre of the
first arc, and what only a ruler and a scale can tell is left as a marked line. Look at the preview before believing it.")]
pub struct InitArgs {
    /// The recording: MP4, MOV, AVI, MKV, …, or a folder of stills.
    video: PathBuf,
    /// The experiment file to write; an existing one is not replaced. `-` for standard output.
    #[arg(long, value_name = "TOML", default_value = "experiment.toml")]
    out: PathBuf,
    /// A picture of what was found.
    #[arg(long, value_name = "PNG")]
    preview: Option<PathBuf>,
    /// Replace an existing experiment file.
    #[arg(long)]
    force: bool,
    /// No progress bar and no summary.
    #[arg(long)]
    quiet: bool,
}

impl InitArgs {
    /// Looks and writes.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self) -> Result<()> {
        self.keep_inputs()?;
        if self.out.exists() && !self.force && self.out.as_os_str() != "-" {
            let message = format!("{} exists already; name another file, or say --force", self.out.display());
            return Err(Error::Option { option: "--out".to_owned(), message });
        }
        let bar = Bar::new(self.quiet);
        let out = OutputFile::create(&self.out)?;
        let picture = self.preview.as_deref().map(OutputFile::create).transpose()?;
        let finding = look(&self.video, &Options::default(), Path::new(""), &bar)?;
        drop(bar);
        if let Some(picture) = picture {
            picture.commit(&preview(&finding)?)?;
        }
        let name = self.video.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        out.commit(to_toml(&finding, &name).as_bytes())?;
        if !self.quiet {
            self.report(&finding);
        }
        Ok(())
    }

    /// The recording is never written over, nor is one output by the other; the preview is a PNG.
    fn keep_inputs(&self) -> Result<()> {
        let same =
            |a: &Path, b: &Path| a == b || a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b));
        let refused = |option: &str, message: String| Err(Error::Option { option: option.to_owned(), message });
        for (option, target) in [("--out", Some(&self.out)), ("--preview", self.preview.as_ref())] {
            if let Some(target) = target.filter(|target| same(target, &self.video)) {
                return refused(option, format!("{} is the recording and would be overwritten", target.display()));
            }
        }
        let Some(preview) = &self.preview else { return Ok(()) };
        if same(preview, &self.out) {
            return refused("--preview", format!("{} is the experiment file; name another", preview.display()));
        }
        if !preview.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            return refused("--preview", format!("{}: the preview is a PNG; name it .png", preview.display()));
        }
        Ok(())
    }

    fn report(&self, finding: &Finding) {
        let colours: Vec<&str> = finding.marks.iter().map(|m| m.colour.as_str()).collect();
        let n = colours.len();
        eprintln!("{}: {n} mark{}: {}", self.video.display(), if n == 1 { "" } else { "s" }, colours.join(", "));
        if let Some(arc) = finding.arc {
            let ([x, y], [sx, sy]) = (arc.centre_px, arc.sd_px);
            eprintln!("pivot at {x:.1}, {y:.1} px (± {sx:.1}, ± {sy:.1})");
        }
        let (video, out) = (self.video.display(), self.out.display());
        eprintln!("written to {out}; next: track {video} --config {out} --out angles.csv");
    }
}
