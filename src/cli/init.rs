//! `freeswing init VIDEO`.

use std::path::{Path, PathBuf};

use super::track::rectangle;
use super::{Console, Target};
use crate::error::{Error, Result};
use crate::experiment::Rig;
use crate::look::{Finding, look, preview, to_toml};
use crate::measure::Options;
use crate::output::OutputFile;

/// A specimen that hangs farther than this from the picture's downward direction hangs along another side of it (geometry: half of a quarter turn).
const SIDEWAYS_RAD: f64 = 0.25 * std::f64::consts::PI;
/// And farther than this, along the opposite one.
const UPSIDE_DOWN_RAD: f64 = 0.75 * std::f64::consts::PI;

/// Look at a recording and write a starting experiment file.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  freeswing init swing.mp4
  freeswing init swing.mp4 --out rig/experiment.toml --preview seen.png
  freeswing init swing.mp4 --from 2.5
  track swing.mp4 --config experiment.toml --out angles.csv

The file names the marks in order from the hinge down, their colours, the hinge or the point they swing about, their
distances in pixels and the frame rate. Lengths and mass, which no picture shows, are left as lines marked \"MEASURE\":
`track` does not need them, `fit` and `diagnose` do. Look at the preview before you believe what was found.
Exit code 0: done; 2: nothing that swings was found, or bad input; nothing written.")]
pub struct InitArgs {
    /// The recording: MP4, MOV, AVI, MKV, …, or a folder of stills.
    video: PathBuf,
    /// The experiment file to write; an existing one is not replaced. `-` for standard output.
    #[arg(long, value_name = "TOML", default_value = "experiment.toml")]
    out: Target,
    /// A picture of what was found.
    #[arg(long, value_name = "PNG")]
    preview: Option<Target>,
    /// Look only at this part of the picture: left, top, width, height, displayed pixels.
    #[arg(long, value_name = "X,Y,W,H", value_parser = rectangle, allow_hyphen_values = true)]
    roi: Option<[f64; 4]>,
    /// Leave out what comes before, seconds of the file: a hand that lets go.
    #[arg(long, value_name = "S")]
    from: Option<f64>,
    /// Leave out what comes from this time on.
    #[arg(long, value_name = "S")]
    until: Option<f64>,
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
    pub fn run(&self, console: &Console) -> Result<()> {
        self.check_preview()?;
        if self.out.exists() && !self.force && self.out.as_os_str() != "-" {
            let message = format!("{} exists already; name another file, or say --force", self.out.display());
            return Err(Error::Option { option: "--out".to_owned(), message });
        }
        let bar = console.bar_of_frames(self.quiet);
        let out = OutputFile::create(&self.out)?;
        let picture = self.preview.as_deref().map(OutputFile::create).transpose()?;
        let options = Options { rig: self.part()?, ..Options::default() };
        let finding = look(&self.video, &options, Path::new(""), &bar)?;
        drop(bar);
        if let Some(picture) = picture {
            picture.commit(&preview(&finding)?)?;
        }
        let name = self.video.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        out.commit(to_toml(&finding, &name, &options.rig).as_bytes())?;
        if !self.quiet {
            self.report(&finding, console);
        }
        Ok(())
    }

    /// The part that is looked at.
    fn part(&self) -> Result<Rig> {
        let part = Rig { roi_px: self.roi, from_s: self.from, until_s: self.until, ..Rig::default() };
        let given = [("rig.roi_px", "--roi"), ("rig.from_s", "--from"), ("rig.until_s", "--until")];
        part.validate().map_err(|message| super::by_option(&message, &given))?;
        Ok(part)
    }

    /// The preview is a PNG.
    fn check_preview(&self) -> Result<()> {
        let Some(preview) = &self.preview else { return Ok(()) };
        if !preview.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            let message = format!("{}: the preview is a PNG; name it .png", preview.display());
            return Err(Error::Option { option: "--preview".to_owned(), message });
        }
        Ok(())
    }

    fn report(&self, finding: &Finding, console: &Console) {
        let colours: Vec<&str> = finding.marks.iter().map(|m| m.colour.as_str()).collect();
        let (video, out) = (self.video.display(), self.out.display());
        match colours[..] {
            [one] => console.remark(format!("{video}: 1 mark: {one}")),
            _ => {
                console.remark(format!("{video}: {} marks, from the hinge down: {}", colours.len(), colours.join(", ")))
            }
        }
        if let Some(held_s) = finding.held_until_s {
            console.remark(format!("held still until t = {held_s:.2} s, as by a hand: left out (from_s in {out})"));
        }
        if let Some(caught_s) = finding.caught_after_s {
            console.remark(format!("caught after t = {caught_s:.2} s, as by a hand: left out (until_s in {out})"));
        }
        console.remark(hinge_in_words(finding));
        if let Some(turned_rad) = finding.hangs_at_rad().filter(|angle_rad| angle_rad.abs() > SIDEWAYS_RAD) {
            let filter = match turned_rad {
                angle_rad if angle_rad.abs() > UPSIDE_DOWN_RAD => "hflip,vflip",
                angle_rad if angle_rad > 0.0 => "transpose=1",
                _ => "transpose=2",
            };
            console.warning(format!(
                "{video}: the specimen lies {:.0}° from the picture's downward direction. If the recording is turned, turn it back (`ffmpeg -i {video} -vf {filter} turned.mp4`), or name two points of a plumb line, upper first, as plumb_px in {out}: angles are measured from the vertical",
                turned_rad.abs().to_degrees()
            ));
        }
        if let Some(other) = finding.apart.first() {
            let [[x, y], [ox, oy]] = [finding.marks[0].thing.place_px(), other.place_px()];
            console.warning(format!(
                "{video}: more than one thing like this swings: the one about {x:.0}, {y:.0} px is measured, not the one about {ox:.0}, {oy:.0} px; roi_px in {out} picks another"
            ));
        }
        match &self.preview {
            Some(picture) => {
                console.remark(format!("look at {} to see whether these are the marks", picture.display()))
            }
            None => console.remark("to see whether these are the marks, run it again with --force --preview seen.png"),
        }
        if self.out.as_os_str() == "-" {
            console.remark(format!(
                "keep what was written in a file; next: track {video} --config THE_FILE --out angles.csv"
            ));
        } else {
            console.remark(format!("written to {out}; next: track {video} --config {out} --out angles.csv"));
        }
    }
}

/// Where it hangs, and how that is known.
fn hinge_in_words(finding: &Finding) -> String {
    if finding.hinge_marked {
        let [x, y] = finding.marks[0].thing.place_px();
        return format!("the first mark stands still and is taken for the hinge: {x:.1}, {y:.1} px");
    }
    match finding.arc.filter(|_| finding.states_pivot()) {
        Some(arc) => {
            let ([x, y], [sx, sy]) = (arc.centre_px, arc.sd_px);
            let still = finding.still.first().map_or(String::new(), |thing| {
                let [x, y] = thing.place_px();
                format!("; what stands still at {x:.0}, {y:.0} px looks like a mark, but is not there")
            });
            format!(
                "no mark shows the hinge; the first mark swings about {x:.1}, {y:.1} px (standard deviation {sx:.1}, {sy:.1}){still}"
            )
        }
        None if finding.marks.len() == 1 => {
            "its path does not show where it hangs: its displacement is measured, no angle; `identify` tells frequency and damping of that, too".to_owned()
        }
        None => {
            "the path of the first mark does not show where it hangs: angles are measured between the marks".to_owned()
        }
    }
}
