//! `freeswing doctor`: what is there, and whether it measures what it should.

use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use super::table::number;
use super::{Console, Target};
use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::measure::{Options, measure};
use crate::output::OutputFile;
use crate::progress::Silent;
use crate::statistics::median;
use crate::synth::Recording;
use crate::video::codecs;

/// A recording of two seconds whose truth is known.
const EXPERIMENT: &str = "\
[specimen]
name = \"self-test\"
mass_kg = 0.3606e-3
link_lengths_m = [0.10, 0.10]
[model]
k_eq_n_m_per_rad = 1.5e-4
c_eq_n_m_s_per_rad = 2.0e-8
release_rad = [0.35, 0.5]
[render]
width_px = 480
height_px = 300
duration_s = 2.0
scale_px_per_m = 1150.0
hinge_px = [240.0, 30.0]
mark_diameter_px = 14.0
strip_width_px = 30.0
noise = { read = 0.003, shot = 0.004 }
";
/// Median error of an angle beyond which something is broken: ten times what this recording leaves.
const MOST_RAD: f64 = 5e-3;

/// Say what is installed, and test it on a recording of known truth.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  freeswing doctor
  freeswing doctor --json -

Renders two seconds of a swing, tracks them and compares the angles with the truth. Exit code 0: all is well; 2: the self-test failed.")]
pub struct DoctorArgs {
    /// The same as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<Target>,
}

/// What was found.
#[derive(Debug, Serialize)]
struct Findings {
    schema: &'static str,
    version: &'static str,
    cores: usize,
    libavcodec: String,
    opencv: String,
    decoders_missing: Vec<&'static str>,
    decoders: Vec<&'static str>,
    encoders: Vec<&'static str>,
    encoders_missing: Vec<&'static str>,
    hdf5: bool,
    self_test: SelfTest,
}

#[derive(Debug, Serialize)]
struct SelfTest {
    frames: usize,
    median_error_rad: f64,
    rendered_in_s: f64,
    tracked_in_s: f64,
    passed: bool,
}

impl DoctorArgs {
    /// Looks and tests.
    ///
    /// # Errors
    /// One line; [`Error::SelfTest`] where the angles are not the truth.
    pub fn run(&self, console: &Console) -> Result<()> {
        let json = self.json.as_deref().map(OutputFile::create).transpose()?;
        let those = |all: &[(&'static str, bool)], there: bool| -> Vec<&'static str> {
            all.iter().filter(|(_, is)| *is == there).map(|(name, _)| *name).collect()
        };
        let (decoders, encoders) = (codecs::decoders(), codecs::encoders());
        let findings = Findings {
            schema: "freeswing.doctor/1",
            version: env!("CARGO_PKG_VERSION"),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            libavcodec: codecs::version(),
            opencv: opencv::core::get_version_string().map_err(Error::opencv("asking for its version"))?,
            decoders_missing: those(&decoders, false),
            decoders: those(&decoders, true),
            encoders_missing: those(&encoders, false),
            encoders: those(&encoders, true),
            hdf5: cfg!(feature = "hdf5"),
            self_test: self_test()?,
        };
        super::deliver(&findings.text(), &findings, json, console)?;
        if findings.self_test.passed {
            return Ok(());
        }
        Err(Error::SelfTest { error_rad: findings.self_test.median_error_rad, most_rad: MOST_RAD })
    }
}

/// Renders, tracks, and compares with the truth.
fn self_test() -> Result<SelfTest> {
    let experiment = Experiment::parse(EXPERIMENT, Path::new("self-test.toml"))?;
    let folder = tempfile::tempdir().map_err(|e| Error::unwritable(&std::env::temp_dir(), e))?;
    let video = folder.path().join("self-test.mp4");
    let began = Instant::now();
    let recording = Recording::of(&experiment)?;
    recording.write(&video, None, &mut |_| Ok(()))?;
    let rendered_in_s = began.elapsed().as_secs_f64();
    let began = Instant::now();
    let measured = measure(&video, &Options::default(), folder.path(), &Silent)?;
    let tracked_in_s = began.elapsed().as_secs_f64();
    let frames = recording.len().min(measured.timing.frames);
    let errors = (0..frames).flat_map(|frame| {
        let truth = recording.truth(frame).theta_rad;
        let links = measured.angles.links.iter().zip(truth);
        links
            .map(|(link, truth)| link[frame].map_or(f64::INFINITY, |angle| (angle.theta_rad - truth).abs()))
            .collect::<Vec<_>>()
    });
    let median_error_rad = median(&mut errors.collect::<Vec<f64>>()).unwrap_or(f64::INFINITY);
    Ok(SelfTest { frames, median_error_rad, rendered_in_s, tracked_in_s, passed: median_error_rad <= MOST_RAD })
}

impl Findings {
    fn text(&self) -> String {
        let list = |does: &str, names: &[&str]| {
            if names.is_empty() { String::new() } else { format!("; {does} {}", names.join(", ")) }
        };
        let test = &self.self_test;
        format!(
            "freeswing {}, {} cores\nlibavcodec {}{}{}{}{}\nOpenCV {}\nHDF5 {}\n\
             self-test: {} frames rendered in {} s, tracked in {} s, median error of the angles {} mrad: {}\n",
            self.version,
            self.cores,
            self.libavcodec,
            list("reads", &self.decoders),
            list("does not read", &self.decoders_missing),
            list("writes", &self.encoders),
            list("does not write", &self.encoders_missing),
            self.opencv,
            if self.hdf5 { "built in" } else { "not built in (--features hdf5)" },
            test.frames,
            number(test.rendered_in_s, 2),
            number(test.tracked_in_s, 2),
            number(1e3 * test.median_error_rad, 2),
            if test.passed { "passed" } else { "FAILED" }
        )
    }
}
