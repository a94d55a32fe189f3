//! `track VIDEO --out angles.csv`.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::{Console, Target, arguments};
use crate::angles::{self, AngleSource};
use crate::caution::slow_motion;
use crate::detect::debug::DebugFolder;
use crate::error::{Error, Result};
use crate::experiment::{Experiment, MarkColour};
use crate::measure::{Measurement, Options, Session, Steadying};
use crate::output::OutputFile;
use crate::overlay::{self, Overlay};
use crate::sidecar::Sidecar;
use crate::track::chain_detection::MOST_MARKS;
use crate::video::{Recording, StillTimes};

/// Follow the marks of a recording and write their angles.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  track videos/kapton.mp4 --out angles.csv
  track pendulum.mp4 --out angles.csv --color red --color green --pivot 497,508
  track swing.mov --out angles.csv --config experiment.toml --overlay seen.mp4
  track stills/ --rate 50 --out angles.csv

Beside angles.csv stands angles.json: the source and its SHA-256, the options, the time stamps' gaps and jitter,
the noise, and every warning. Exit code 0: done; 2: bad input, nothing written.")]
pub struct TrackArgs {
    /// The recording: MP4, MOV, AVI, MKV, …, or a folder of stills.
    video: PathBuf,
    /// The table of angles; `-` for standard output.
    #[arg(long, value_name = "CSV")]
    out: Target,
    /// The experiment: marks, pivot, mirror, plumb line, lens.
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    /// The recording with what was measured drawn into it: .mp4, .mov or .mkv.
    #[arg(long, value_name = "VIDEO")]
    overlay: Option<Target>,
    /// Limit the overlay to about this many megabytes; its pictures are made smaller if necessary.
    #[arg(long, value_name = "MB", requires = "overlay")]
    overlay_mb: Option<f64>,
    /// A folder for pictures of each step from frame to marks.
    #[arg(long, value_name = "DIR")]
    debug_frames: Option<PathBuf>,
    /// How many frames are shown in it, evenly spread.
    #[arg(long, value_name = "N", default_value_t = 8, requires = "debug_frames")]
    debug_count: usize,
    /// Colour of the marks, a name or #rrggbb; once for all marks, or once for each mark from top to bottom.
    #[arg(long, value_name = "COLOUR")]
    color: Vec<MarkColour>,
    /// Number of marks [default: that of the file; with one --color all marks of it that swing together; else 3, or 2 with --pivot].
    #[arg(long, value_name = "N")]
    markers: Option<usize>,
    /// A fixed, unmarked pivot above the first mark, in displayed pixels.
    #[arg(long, value_name = "X,Y", value_parser = point, allow_hyphen_values = true)]
    pivot: Option<[f64; 2]>,
    /// The camera looks into a mirror.
    #[arg(long)]
    mirrored: bool,
    /// Seek marks only in this part of the picture: left, top, width, height, displayed pixels.
    #[arg(long, value_name = "X,Y,W,H", value_parser = rectangle, allow_hyphen_values = true)]
    roi: Option<[f64; 4]>,
    /// Seek marks only where this picture, as large as the recording's, is white.
    #[arg(long, value_name = "PNG")]
    mask: Option<PathBuf>,
    /// Leave out what comes before, seconds of the file.
    #[arg(long, value_name = "S")]
    from: Option<f64>,
    /// Leave out what comes after, seconds of the file.
    #[arg(long, value_name = "S")]
    until: Option<f64>,
    /// Frames per second at which the camera ran, where the file plays slower (slow motion).
    #[arg(long, value_name = "HZ")]
    true_rate: Option<f64>,
    /// A fixed point with clear edges, displayed pixels, against which the camera's own motion is taken out; may be
    /// given several times. The standing background is used otherwise.
    #[arg(long, value_name = "X,Y", value_parser = point, allow_hyphen_values = true)]
    reference: Vec<[f64; 2]>,
    /// Take out the camera's own motion.
    #[arg(long, value_name = "WHEN", default_value = "needed")]
    steady: Steady,
    /// Least colour component of a mark, 0 to 255; chosen from the recording otherwise.
    #[arg(long, value_name = "0..255")]
    threshold: Option<f64>,
    /// Positions behind the angles.
    #[arg(long, value_name = "WHICH", default_value = "measured")]
    angles_from: AnglesFrom,
    /// How a mark is represented by one point.
    #[arg(long, value_name = "HOW", default_value = "subpixel")]
    centroid: CentroidKind,
    /// When the stills of a folder were taken: a number of seconds a line, or rows `file,t_s`; else times.csv among them.
    #[arg(long, value_name = "FILE", conflicts_with = "rate")]
    times: Option<PathBuf>,
    /// Stills per second, where nothing says when each was taken.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Cores to use; all by default.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// No progress bar and no warnings.
    #[arg(long)]
    quiet: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum AnglesFrom {
    /// Centroids; gaps stay gaps.
    Measured,
    /// Fixed-interval smoother; gaps are bridged.
    Smoothed,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum CentroidKind {
    /// Background removed, luma and colour weighted.
    Subpixel,
    /// Mean of the binary mask, for comparison.
    Binary,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Steady {
    /// Where the pictures show that the camera moves.
    Needed,
    /// In any case.
    Always,
    /// The camera's motion stays in the positions.
    Never,
}

pub(super) fn rectangle(text: &str) -> std::result::Result<[f64; 4], String> {
    numbers(text).ok_or_else(|| "give four numbers as X,Y,W,H".to_owned())
}

fn point(text: &str) -> std::result::Result<[f64; 2], String> {
    numbers(text).ok_or_else(|| "give two numbers as X,Y".to_owned())
}

/// So many finite numbers between commas, and nothing else.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|n| n.trim().parse().ok().filter(|n: &f64| n.is_finite())).collect();
    numbers?.try_into().ok()
}

impl TrackArgs {
    /// Runs the command.
    ///
    /// # Errors
    /// Whatever [`measure`] and the outputs report.
    pub fn run(&self, console: &Console) -> Result<()> {
        let experiment = self.config.as_deref().map(Experiment::read_rig).transpose()?;
        let folder = self.config.as_deref().and_then(Path::parent).unwrap_or(Path::new("")).to_owned();
        let options = self.options(experiment.clone().unwrap_or_default())?;
        self.keep_account_apart()?;
        // before the first temporary file, so that Ctrl-C leaves none behind
        let bar = console.bar_of_frames(self.quiet);
        let mut table = OutputFile::create(&self.out)?;
        let mut beside = self.sidecar_path().map(|path| OutputFile::create(&path)).transpose()?;
        let most_bytes = self.most_bytes()?;
        self.overlay.as_deref().map(overlay::check_target).transpose()?;
        let debug = self.debug_frames.as_deref().map(DebugFolder::create).transpose()?;
        let mut session = Session::open(&self.video, &options, &folder, &bar)?;
        let outcome = session.run(&bar);
        // what was seen is wanted most where nothing came of it
        if let Some(debug) = debug.filter(|_| !matches!(outcome, Err(Error::Interrupted))) {
            let recording = Recording::open(&self.video, &options.still_times)?;
            debug.show(&recording, session.hues(), session.stamps_s(), self.debug_count, &bar)?;
        }
        let measurement = outcome?;
        let mut sidecar = Sidecar::new(&self.video, &options, &measurement)?;
        sidecar.warnings.extend(experiment.as_ref().and_then(|e| slow_motion(&measurement, e)));
        if let Some(target) = &self.overlay {
            let Measurement { tracks, angles, timing, .. } = &measurement;
            // the pictures carry the file's stamps
            let mut tracks = tracks.clone();
            tracks.t_s.clone_from(&measurement.file_t_s);
            let rate_hz = timing.real_rate_hz.or(timing.nominal_rate_hz).map(|r| r * measurement.time_scale);
            let overlay = Overlay { tracks: &tracks, angles, pivot_px: options.rig.pivot_px, rate_hz, most_bytes };
            let recording = Recording::open(&self.video, &options.still_times)?;
            overlay.write(recording, target, options.workers, &bar)?;
        }
        drop(bar);
        if let Some(beside) = &mut beside {
            beside.write(sidecar.to_json().as_bytes())?;
        }
        table.write(angles::to_csv(&measurement.tracks, &measurement.angles).as_bytes())?;
        table.appear()?;
        beside.map_or(Ok(()), OutputFile::appear)?;
        if !self.quiet {
            self.report(&measurement, &sidecar, console);
        }
        Ok(())
    }

    fn options(&self, experiment: Experiment) -> Result<Options> {
        let mut rig = experiment.rig;
        rig.mirrored |= self.mirrored;
        if self.pivot.is_some() {
            (rig.pivot_px, rig.pivot_sd_px) = (self.pivot, None);
        }
        rig.roi_px = self.roi.or(rig.roi_px);
        rig.mask = self.mask_path()?.or(rig.mask);
        rig.from_s = self.from.or(rig.from_s);
        rig.until_s = self.until.or(rig.until_s);
        rig.true_rate_hz = self.true_rate.or(rig.true_rate_hz);
        if !self.reference.is_empty() {
            rig.reference_marks.clone_from(&self.reference);
        }
        rig.validate().map_err(|message| self.by_option(&message))?;
        let threshold = self.threshold;
        if threshold.is_some_and(|t| !(t > 0.0 && t < 255.0)) {
            return Err(option("--threshold", "must lie between 0 and 255"));
        }
        if self.threads == Some(0) {
            return Err(option("--threads", "must be at least 1"));
        }
        let defaults = Options::default();
        Ok(Options {
            count_marks: self.color.len() == 1 && self.markers.is_none() && rig.marks.is_empty(),
            marks: self.marks(&rig.marks, rig.pivot_px.is_some())?,
            rig,
            threshold,
            angle_source: match self.angles_from {
                AnglesFrom::Measured => AngleSource::Measured,
                AnglesFrom::Smoothed => AngleSource::Smoothed,
            },
            steadying: match self.steady {
                Steady::Needed => Steadying::WhereNeeded,
                Steady::Always => Steadying::Always,
                Steady::Never => Steadying::Never,
            },
            binary_centroid: self.centroid == CentroidKind::Binary,
            still_times: match (&self.times, self.rate) {
                (Some(file), _) => StillTimes::File(file.clone()),
                (None, Some(rate_hz)) => StillTimes::Rate(rate_hz),
                (None, None) => StillTimes::Beside,
            },
            workers: self.threads.unwrap_or(defaults.workers),
        })
    }

    /// What is wrong with a key, by the name of the option that gave it: the file by itself was sound.
    fn by_option(&self, message: &str) -> Error {
        let options = [
            (self.pivot.is_some(), ("rig.pivot_px", "--pivot")),
            (self.roi.is_some(), ("rig.roi_px", "--roi")),
            (self.from.is_some(), ("rig.from_s", "--from")),
            (self.until.is_some(), ("rig.until_s", "--until")),
            (self.true_rate.is_some(), ("rig.true_rate_hz", "--true-rate")),
            (!self.reference.is_empty(), ("rig.reference_marks", "--reference")),
        ];
        let given: Vec<_> = options.into_iter().filter_map(|(is_given, names)| is_given.then_some(names)).collect();
        super::by_option(message, &given)
    }

    /// One colour a mark: the command line before the file before the paper's three red ones.
    fn marks(&self, configured: &[MarkColour], pivot: bool) -> Result<Vec<MarkColour>> {
        let given = if self.color.is_empty() { configured } else { &self.color };
        let usual = if pivot { 2 } else { 3 };
        let (colour, count) = match given {
            [] => (Some(MarkColour::red()), self.markers.unwrap_or(usual)),
            [one] if self.color.len() == 1 => {
                let of_file = if configured.is_empty() { usual } else { configured.len() };
                (Some(one.clone()), self.markers.unwrap_or(of_file))
            }
            // of marks that are all alike there may be more or fewer than the file says
            [one, others @ ..] if self.color.is_empty() && others.iter().all(|other| other == one) => {
                (Some(one.clone()), self.markers.unwrap_or(given.len()))
            }
            several => (None, several.len()),
        };
        if let Some(wanted) = self.markers.filter(|wanted| *wanted != count) {
            return Err(option("--markers", &format!("{wanted} marks asked for, {count} colours given")));
        }
        if !(1..=MOST_MARKS).contains(&count) {
            return Err(option("--markers", &format!("1 to {MOST_MARKS} marks can be followed")));
        }
        Ok(colour.map_or_else(|| given.to_vec(), |one| vec![one; count]))
    }

    /// The mask where the user stands, not where the experiment file is.
    fn mask_path(&self) -> Result<Option<PathBuf>> {
        let absolute = |p: &PathBuf| std::path::absolute(p).map_err(|e| Error::unreadable(p, e));
        self.mask.as_ref().map(absolute).transpose()
    }

    /// Nor may the account beside the table, which no option names, take the place of anything.
    fn keep_account_apart(&self) -> Result<()> {
        let Some(beside) = self.sidecar_path() else { return Ok(()) };
        if beside == *self.out {
            let message = format!("{} is the name of the account beside the table; use .csv", self.out.display());
            return Err(option("--out", &message));
        }
        let inputs = [Some(&self.video), self.config.as_ref(), self.times.as_ref(), self.mask.as_ref()];
        let inputs: Vec<&Path> = inputs.into_iter().flatten().map(PathBuf::as_path).collect();
        arguments::refuse_overwriting(&inputs, &[("--out".to_owned(), &beside)], "use another name")
    }

    fn most_bytes(&self) -> Result<Option<u64>> {
        match self.overlay_mb {
            Some(mb) if mb > 0.0 && mb < 1e6 => Ok(Some((1e6 * mb) as u64)),
            Some(mb) => Err(option("--overlay-mb", &format!("{mb}: must be a positive number of megabytes"))),
            None => Ok(None),
        }
    }

    fn sidecar_path(&self) -> Option<PathBuf> {
        (self.out.as_os_str() != "-" && (self.out.is_file() || !self.out.exists()))
            .then(|| self.out.with_extension("json"))
    }

    fn report(&self, measurement: &Measurement, sidecar: &Sidecar, console: &Console) {
        console.warnings(&sidecar.warnings);
        let links = &measurement.angles.links;
        let measured = (0..measurement.timing.frames).filter(|f| links.iter().all(|l| l[*f].is_some())).count();
        let marks = match measurement.marks.len() {
            1 => "1 mark".to_owned(),
            several => format!("{several} marks"),
        };
        let what =
            if links.is_empty() { "a displacement, no angle".to_owned() } else { format!("all angles in {measured}") };
        console.remark(format!(
            "{}: {} frame{}, {marks}, {what}, written to {}",
            self.video.display(),
            measurement.timing.frames,
            if measurement.timing.frames == 1 { "" } else { "s" },
            self.out.display()
        ));
    }
}

fn option(option: &str, message: &str) -> Error {
    Error::Option { option: option.to_owned(), message: message.to_owned() }
}
