//! `angles.json`: what a reader of `angles.csv` should know about where it came from.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::angles::AngleSource;
use crate::caution::{cautions, longest_gap};
use crate::digest;
use crate::error::Result;
use crate::measure::{Measurement, Options};
use crate::video::Timing;

/// Its form, in whatever version, and in this one.
const FORM: &str = "freeswing.angles/";
const SCHEMA: &str = "freeswing.angles/1";

/// The file, ready to be written.
#[derive(Debug, Serialize)]
pub struct Sidecar {
    schema: &'static str,
    program: &'static str,
    version: &'static str,
    source: Source,
    options: Settings,
    pixel_origin: &'static str,
    video: Video,
    time_stamps: Timing,
    marks: Vec<Mark>,
    angles: Vec<Link>,
    damage: Damage,
    camera: CameraMotion,
    /// Everything that a person should know.
    pub warnings: Vec<String>,
}

/// What the file beside a table says.
#[derive(Debug, Deserialize)]
pub struct Beside {
    schema: String,
    source: From,
    #[serde(default)]
    warnings: Vec<String>,
}

#[derive(Debug, Deserialize)]
struct From {
    file: String,
}

impl Beside {
    /// Of a table; `None` where no such file stands beside it.
    pub fn of(table: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(table.with_extension("json")).ok()?;
        let beside: Self = serde_json::from_str(&text).ok()?;
        beside.schema.starts_with(FORM).then_some(beside)
    }

    /// The recording that was tracked.
    pub fn recording(&self) -> &Path {
        Path::new(&self.source.file)
    }

    /// What was said then.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }
}

#[derive(Debug, Serialize)]
struct Source {
    file: String,
    bytes: u64,
    sha256: String,
    /// What the digest is taken over.
    sha256_of: &'static str,
}

#[derive(Debug, Serialize)]
struct Settings {
    marks: Vec<String>,
    pivot_px: Option<[f64; 2]>,
    pivot_sd_px: Option<[f64; 2]>,
    mirrored: bool,
    plumb_px: Option<[[f64; 2]; 2]>,
    lens_calibration: Option<String>,
    angles_from: &'static str,
    centroid: &'static str,
    threshold: Vec<Threshold>,
    roi_px: Option<[f64; 4]>,
    mask: Option<String>,
    from_s: Option<f64>,
    until_s: Option<f64>,
    /// Frames per second at which the camera ran; the stamps in the table are the file's times `time_scale`.
    true_rate_hz: Option<f64>,
    time_scale: f64,
    reference_marks: Vec<[f64; 2]>,
}

#[derive(Debug, Serialize)]
struct Threshold {
    colour: String,
    of_255: f64,
    chosen: bool,
    /// The hue as the recording shows it, from C_b towards C_r.
    hue_deg: Option<f64>,
    /// Scale at which it was looked for: 2^level chroma samples.
    level: u32,
}

#[derive(Debug, Serialize)]
struct Video {
    container: String,
    codec: String,
    stream: usize,
    streams: usize,
    width_px: usize,
    height_px: usize,
    rotation_deg: i32,
    pixel_aspect: f64,
    chroma_siting: Option<ChromaSiting>,
}

/// Where chroma sample (0, 0) lies, luma pixels from the centre of luma sample (0, 0).
#[derive(Debug, Serialize)]
struct ChromaSiting {
    stated_px: [f64; 2],
    used_px: [f64; 2],
    sd_px: [f64; 2],
    /// What the marks showed, with its standard deviation.
    seen_px: [Option<[f64; 2]>; 2],
}

#[derive(Debug, Serialize)]
struct Mark {
    colour: String,
    frames_measured: usize,
    share_measured: f64,
    longest_gap_frames: usize,
    partial_frames: usize,
    median_area_px2: f64,
    /// Root mean square stated standard deviation, the noise estimate.
    noise_px: [f64; 2],
    /// Factors (x, y) by which the track's own scatter corrected the stated standard deviation.
    scatter_factor_at_rest: [f64; 2],
    scatter_factor_in_motion: [f64; 2],
    acceleration_psd_px2_s3: f64,
}

#[derive(Debug, Serialize)]
struct Link {
    frames_measured: usize,
    /// Median stated standard deviation, the noise estimate.
    noise_rad: f64,
}

#[derive(Debug, Serialize)]
struct CameraMotion {
    /// Null where nothing that stands still shows it.
    greatest_shift_px: Option<f64>,
    taken_out: bool,
    patches: usize,
    sd_px: f64,
    frames_lost: usize,
}

#[derive(Debug, Serialize)]
struct Damage {
    packets: u64,
    damaged_packets: u64,
    damaged_frames: Vec<usize>,
    frames_of_another_size: u64,
    frames_without_time_stamp: u64,
    read_error: Option<String>,
}

impl Sidecar {
    /// Gathers everything; reads the source once more for its digest.
    ///
    /// # Errors
    /// [`crate::Error::Unreadable`].
    pub fn new(path: &Path, options: &Options, m: &Measurement) -> Result<Self> {
        let (width_px, height_px) = m.stream.orientation.size(m.stream.stored_size_px);
        let mut sidecar = Self {
            schema: SCHEMA,
            program: env!("CARGO_PKG_NAME"),
            version: env!("CARGO_PKG_VERSION"),
            source: Source::read(path)?,
            options: Settings::new(options, m),
            pixel_origin: "the centre of the top-left displayed pixel is (0, 0); x right, y down",
            video: Video {
                container: m.stream.container.clone(),
                codec: m.stream.codec.clone(),
                stream: m.stream.stream,
                streams: m.stream.streams,
                width_px,
                height_px,
                rotation_deg: m.stream.orientation.degrees(),
                pixel_aspect: m.stream.pixel_aspect,
                chroma_siting: m.siting.map(|s| ChromaSiting {
                    stated_px: s.stated_px,
                    used_px: s.used_px,
                    sd_px: s.sd_px,
                    seen_px: s.seen_px,
                }),
            },
            time_stamps: m.timing.clone(),
            marks: (0..m.marks.len()).map(|i| Mark::new(m, i)).collect(),
            angles: m.angles.links.iter().map(|link| Link::new(link)).collect(),
            damage: Damage {
                packets: m.decoded.packets,
                damaged_packets: m.decoded.damaged_packets,
                damaged_frames: m.tracks.damaged_frames.clone(),
                frames_of_another_size: m.decoded.resized_frames,
                frames_without_time_stamp: m.decoded.unstamped_frames,
                read_error: m.decoded.read_error.clone(),
            },
            camera: CameraMotion {
                greatest_shift_px: (m.camera.is_told || m.camera.taken_out).then_some(m.camera.greatest_shift_px),
                taken_out: m.camera.taken_out,
                patches: m.camera.patches,
                sd_px: m.camera.sd_px,
                frames_lost: m.camera.lost_frames,
            },
            warnings: Vec::new(),
        };
        sidecar.warnings = sidecar.find_warnings(m);
        sidecar.warnings.extend(cautions(m, options));
        Ok(sidecar)
    }

    /// The file's text.
    pub fn to_json(&self) -> String {
        // every field is a number, a string or a list of them, which cannot fail to serialise
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    fn find_warnings(&self, m: &Measurement) -> Vec<String> {
        let mut warnings = m.timing.warnings();
        let damage = &self.damage;
        let stills = m.stream.container == "stills";
        if damage.damaged_packets > 0 || !damage.damaged_frames.is_empty() {
            let at = damage.damaged_frames.first().map(|f| m.timing_at(*f));
            warnings.push(format!(
                "the {} damaged: {} {} refused, {} frames not measured{}; the rest is measured",
                if stills { "stills are" } else { "file is" },
                damage.damaged_packets,
                if stills { "stills" } else { "packets" },
                damage.damaged_frames.len(),
                at.map(|t| format!(", the first at {t:.3} s")).unwrap_or_default()
            ));
        }
        if stills && damage.frames_of_another_size > 0 {
            let n = damage.frames_of_another_size;
            warnings.push(format!("{n} stills have another size than the first and were left out"));
        }
        if let Some(error) = &damage.read_error {
            warnings.push(format!(
                "reading stopped at {:.3} s: {error}; the file is cut off or damaged there",
                m.timing.last_s
            ));
        // where a file states no count it is that of an even rate
        } else if m.stream.stated_frames.is_some_and(|n| n > m.decoded.packets) && !m.timing.varies() {
            warnings.push(format!(
                "the file states {} frames and holds {}; it ends early",
                m.stream.stated_frames.unwrap_or(0),
                m.decoded.packets
            ));
        }
        if m.stream.streams > 1 && m.stream.other_videos > 0 {
            warnings.push(format!("the file holds several video streams; stream {} was measured", m.stream.stream));
        }
        warnings
    }
}

impl Source {
    fn read(path: &Path) -> Result<Self> {
        let sha256_of =
            if path.is_dir() { "the bytes of the stills, one after the other in order" } else { "the file" };
        let (sha256, bytes) = digest::of_recording(path)?;
        let file = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        Ok(Self { file, bytes, sha256, sha256_of })
    }
}

impl Settings {
    fn new(options: &Options, m: &Measurement) -> Self {
        Self {
            marks: m.marks.iter().map(|c| c.name.clone()).collect(),
            pivot_px: options.rig.pivot_px,
            pivot_sd_px: options.rig.pivot_sd_px,
            mirrored: options.rig.mirrored,
            plumb_px: options.rig.plumb_px,
            lens_calibration: options.rig.lens_calibration.as_ref().map(|p| p.display().to_string()),
            angles_from: match options.angle_source {
                AngleSource::Measured => "measured",
                AngleSource::Smoothed => "smoothed",
            },
            centroid: if options.binary_centroid { "binary" } else { "subpixel" },
            threshold: m
                .hues
                .iter()
                .map(|h| Threshold {
                    colour: h.colour.name.clone(),
                    of_255: h.threshold,
                    chosen: options.threshold.is_none(),
                    hue_deg: h.angle_rad.map(f64::to_degrees),
                    level: h.level,
                })
                .collect(),
            roi_px: options.rig.roi_px,
            mask: options.rig.mask.as_ref().map(|p| p.display().to_string()),
            from_s: options.rig.from_s,
            until_s: options.rig.until_s,
            true_rate_hz: options.rig.true_rate_hz,
            time_scale: m.time_scale,
            reference_marks: options.rig.reference_marks.clone(),
        }
    }
}

impl Mark {
    fn new(m: &Measurement, index: usize) -> Self {
        let points = &m.tracks.marks[index];
        let measured: Vec<[f64; 3]> = points.iter().filter_map(|p| p.measured).map(|m| m.covariance_px2).collect();
        let rms = |axis: usize| (measured.iter().map(|c| c[axis]).sum::<f64>() / measured.len().max(1) as f64).sqrt();
        Self {
            colour: m.marks[index].name.clone(),
            frames_measured: measured.len(),
            share_measured: measured.len() as f64 / points.len().max(1) as f64,
            longest_gap_frames: longest_gap(points).len(),
            partial_frames: points.iter().filter(|p| p.flags.contains(crate::track::Flags::PARTIAL)).count(),
            median_area_px2: m.tracks.area_px2[index],
            noise_px: [rms(0), rms(1)],
            scatter_factor_at_rest: m.tracks.scatter[index].resting,
            scatter_factor_in_motion: [0, 1].map(|axis: usize| m.tracks.scatter[index].moving[axis].mean()),
            acceleration_psd_px2_s3: m.tracks.motion[index].acceleration_psd_px2_s3,
        }
    }
}

impl Link {
    fn new(link: &[Option<crate::angles::Angle>]) -> Self {
        let mut sd: Vec<f64> = link.iter().flatten().map(|a| a.sd_rad).collect();
        sd.sort_by(f64::total_cmp);
        Self { frames_measured: sd.len(), noise_rad: sd.get(sd.len() / 2).copied().unwrap_or(0.0) }
    }
}
