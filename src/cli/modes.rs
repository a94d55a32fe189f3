//! `freeswing modes`: the normal modes of an experiment.

use std::f64::consts::PI;
use std::fmt::Write;
use std::path::PathBuf;

use super::table::{Table, number, paragraph, setting};
use super::{Console, Target};
use crate::error::Result;
use crate::model::modes::{Component, RodMode, Survey};
use crate::output::OutputFile;

/// Modes printed of a long chain.
const PRINTED_MODES: usize = 6;
/// Components printed of a mode shape.
const PRINTED_COMPONENTS: usize = 6;

/// Compute natural frequencies, damping ratios and mode shapes.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  freeswing modes --config videos/kapton.toml

The chain of links with the springs, dampers and linear effects of [model]; two rods in closed form; the strip without bending stiffness, and
as a beam where thickness_m and young_modulus_pa are given.")]
pub struct ModesArgs {
    /// The experiment file: specimen, rig and model.
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// The same as JSON, in full precision; `-` for standard output instead of the tables.
    #[arg(long, value_name = "FILE")]
    json: Option<Target>,
}

impl ModesArgs {
    /// Computes and prints.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self, console: &Console) -> Result<()> {
        let experiment = super::read_experiment(&self.config, console)?;
        let survey = Survey::of(&experiment)?;
        super::deliver(
            &survey_text(&survey),
            &survey,
            self.json.as_deref().map(OutputFile::create).transpose()?,
            console,
        )
    }
}

fn survey_text(survey: &Survey) -> String {
    let mut text = format!("{}, g = {} m/s²\n", survey.specimen, setting(survey.gravity_m_s2));
    floor(survey, &mut text);
    chain(survey, &mut text);
    rods(survey, &mut text);
    strip(survey, &mut text);
    text
}

fn floor(survey: &Survey, text: &mut String) {
    let floor = &survey.floor;
    let _ = writeln!(text, "\nFrequency floor");
    let mut table = Table::new(["of the first mode", "Hz"]);
    table.row(["these links without springs".to_owned(), hz(floor.links_hz)]);
    if let (Some(limp_hz), Some(rigid_hz)) = (floor.limp_strip_hz.first(), floor.rigid_strip_hz) {
        table.row(["uniform strip, limp".to_owned(), hz(*limp_hz)]);
        table.row(["uniform strip, rigid".to_owned(), hz(rigid_hz)]);
    }
    text.push_str(&table.text());
    let remark = "  A measured first mode below the floor means that time base, length or gravity is wrong.";
    let _ = writeln!(text, "{remark}");
}

fn chain(survey: &Survey, text: &mut String) {
    let chain = &survey.chain;
    let links = chain.rest_rad.len();
    let spring = match (chain.joint_stiffness_n_m_per_rad, chain.bending_stiffness_n_m2) {
        (Some(stiffness), _) => format!("K = {} N·m/rad", setting(stiffness)),
        (None, bending) => format!("EI = {} N·m²", setting(bending.unwrap_or(0.0))),
    };
    let damper = setting(chain.joint_damping_n_m_s_per_rad);
    if links == 1 {
        text.push_str("\nOne link\n");
    } else {
        let _ = writeln!(text, "\nChain of {links} links: {spring}, C = {damper} N·m·s/rad at each joint");
    }
    if chain.rest_rad.iter().any(|a| a.abs() > 1e-9) {
        let angles: Vec<String> =
            chain.rest_rad.iter().map(|a| format!("{:.2}°", (100.0 * a.to_degrees()).round() / 100.0 + 0.0)).collect();
        text.push_str(&paragraph("  at rest at ", &angles.join(", ")));
    }
    let shown: Vec<String> = shown_links(links).map(|i| (i + 1).to_string()).collect();
    let shape_heading = match links {
        1 => "shape".to_owned(),
        2 => "shape θ₁ : θ₂".to_owned(),
        _ => format!("shape, links {}", shown.join(" : ")),
    };
    let mut table = Table::with_sentences(["mode", "Hz", "ξ", &shape_heading]);
    for (k, mode) in chain.modes.modes.iter().enumerate().take(PRINTED_MODES) {
        let ratio = if mode.damping_ratio == 0.0 { "0".to_owned() } else { number(mode.damping_ratio, 4) };
        table.row([(k + 1).to_string(), hz(mode.frequency_hz), ratio, shape_text(&mode.shape)]);
    }
    if !chain.modes.modes.is_empty() {
        text.push_str(&table.text());
    }
    more(chain.modes.modes.len(), text);
    if !chain.modes.overdamped.is_empty() {
        let mut table = Table::with_sentences(["overdamped", "decays in", "shape"]);
        for (k, pole) in chain.modes.overdamped.iter().enumerate().take(PRINTED_MODES) {
            let time = format!("{} s", number(pole.time_constant_s, 4));
            table.row([(k + 1).to_string(), time, shape_text(&pole.shape)]);
        }
        text.push_str(&table.text());
        more(chain.modes.overdamped.len(), text);
    }
    if !chain.not_linear.is_empty() {
        let names = chain.not_linear.join(", ");
        text.push_str(&paragraph("  ", &format!("Left out, having no linear part at rest: {names}.")));
    }
}

fn more(count: usize, text: &mut String) {
    if let Some(hidden) = count.checked_sub(PRINTED_MODES).filter(|n| *n > 0) {
        let _ = writeln!(text, "  … and {hidden} more, see --json");
    }
}

fn rods(survey: &Survey, text: &mut String) {
    let Some(rods) = &survey.two_rods else { return };
    let _ = writeln!(text, "\nTwo rods in closed form (paper Eq. 33, 34)");
    let mut table = Table::new(["", "slow, Hz", "θ₁ : θ₂", "fast, Hz", "θ₁ : θ₂"]);
    let cells = |name: &str, [slow, fast]: &[RodMode; 2]| {
        [name.to_owned(), rod_hz(slow), rod_ratio(slow), rod_hz(fast), rod_ratio(fast)]
    };
    table.row(cells("gravity alone, corrected", &rods.gravity_only));
    table.row(cells("gravity alone, as printed (− root, + root)", &rods.as_printed));
    table.row(cells("with the springs of [model], without damping", &rods.with_springs));
    text.push_str(&table.text());
    if rods.as_printed.iter().any(|m| m.frequency_hz.is_none()) {
        let remark = "  As printed one ω² is negative: the pendulum would fall upwards instead of swinging.";
        let _ = writeln!(text, "{remark}");
    }
}

fn strip(survey: &Survey, text: &mut String) {
    if survey.floor.limp_strip_hz.is_empty() {
        return;
    }
    let _ = writeln!(text, "\nContinuous strip, Hz");
    let mut table = Table::new(["", "1", "2", "3", "4"]);
    let mut row = |name: &str, frequencies_hz: &[f64]| {
        table.row(std::iter::once(name.to_owned()).chain(frequencies_hz.iter().map(|f| hz(*f))));
    };
    row("limp, hinged", &survey.floor.limp_strip_hz);
    let Some(beam) = &survey.beam else {
        text.push_str(&table.text());
        let _ = writeln!(text, "  Give specimen.thickness_m and specimen.young_modulus_pa for the beam's modes.");
        return;
    };
    row("beam, hinged", &beam.hinged_hz);
    row("beam, clamped", &beam.clamped_hz);
    row("beam, clamped, without gravity", &beam.clamped_weightless_hz);
    text.push_str(&table.text());
    let _ = writeln!(
        text,
        "  EI = {} N·m²; a clamp is felt over {} mm.",
        number(beam.bending_stiffness_n_m2, 4),
        number(1e3 * beam.boundary_layer_m, 3)
    );
}

fn hz(frequency_hz: f64) -> String {
    format!("{frequency_hz:.4}")
}

fn rod_hz(mode: &RodMode) -> String {
    mode.frequency_hz.map_or_else(|| format!("ω² = {:.1}", mode.omega_squared_rad2_s2), hz)
}

fn rod_ratio(mode: &RodMode) -> String {
    format!("{:.4}", mode.amplitude_ratio)
}

/// Components with their sign where the links pass the middle together, with their phase where they do not.
fn shape_text(shape: &[Component]) -> String {
    let component = |c: &Component| {
        if c.amplitude < 5e-5 {
            return "0".to_owned();
        }
        let off_phase_rad = (c.phase_rad.abs() - PI).abs().min(c.phase_rad.abs());
        if off_phase_rad.to_degrees() >= 0.1 {
            format!("{:.4}∠{:.1}°", c.amplitude, c.phase_rad.to_degrees())
        } else {
            format!("{:.4}", c.amplitude * c.phase_rad.cos().signum())
        }
    };
    shown_links(shape.len()).map(|i| component(&shape[i])).collect::<Vec<_>>().join(" : ")
}

/// The links whose part of a shape is printed: all of a short chain, else some, evenly from the first to the last.
fn shown_links(links: usize) -> impl Iterator<Item = usize> {
    let shown = links.min(PRINTED_COMPONENTS);
    (0..shown).map(move |k| if shown > 1 { (k * (links - 1) + (shown - 1) / 2) / (shown - 1) } else { k })
}
