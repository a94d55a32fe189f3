//! `freeswing diagnose --figure`: before and after on one page.
//!
//! Above, the end of the swing as measured and by both models; in the middle, what each model leaves of each angle. A single recording is fitted
//! up to the border of the held-out proof, and the rest of both curves is prediction. Below, the torque that the base model lacks, against the angle
//! it works on and against that one's rate: the shape of a law before it has a name.

use std::fmt::Write;
use std::ops::Range;

use crate::cli::table::number;
use crate::diagnose::{Diagnosis, Drawn, MissingTorque, Place};
use crate::error::{Error, Result};
use crate::fit::{Residual, Residuals};
use crate::report::svg::{Panel, line, text};

/// Swings in the upper panel.
const SWINGS: f64 = 4.0;
/// The upper panel ends where the swing is lost in this many times the noise.
const SEEN: f64 = 15.0;
/// Left and right edge of the upper panel, and of the lower ones before and after, px.
const WHOLE_PX: Range<f64> = 84.0..940.0;
const BEFORE_PX: Range<f64> = 84.0..484.0;
const AFTER_PX: Range<f64> = 540.0..940.0;
/// Upper and lower edge of the upper panel and of all lower ones, px.
const UPPER_PX: Range<f64> = 122.0..314.0;
const LOWER_PX: Range<f64> = 410.0..664.0;
/// Upper and lower edge of the torque's panels, px.
const TORQUE_PX: Range<f64> = 760.0..944.0;
/// Height of the page without and with the torque.
const HEIGHT_PX: [u32; 2] = [720, 1000];
/// Between two lower panels, for the heading of the second.
const GAP_PX: f64 = 34.0;

const HEAD: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 960 HEIGHT" width="960" height="HEIGHT" font-family="Helvetica, Arial, 'DejaVu Sans', sans-serif" font-size="14" fill="#222">
<style>
.title { font-size: 22px; font-weight: bold } .heading { font-size: 14px } .number { font-size: 13px; fill: #555 } .note { font-size: 13px; fill: #555 }
.middle { text-anchor: middle } .end { text-anchor: end }
.outline { fill: none; stroke: #888 } .grid { stroke: #e9e9e9 } .zero { stroke: #bbb } .noise { fill: #d3dbe3 } .ahead { fill: #fbf6e7 }
.here { font-size: 12px; fill: #7a5508; paint-order: stroke; stroke: #fff; stroke-width: 4px }
.border { stroke: #96690a; stroke-width: 1.5; stroke-dasharray: 6 4 }
.measured, .left-before, .left-after { fill: none; stroke-linecap: round }
.measured { stroke: #333; stroke-width: 4.5 } .left-before { stroke: #d1495b; stroke-width: 2.6 } .left-after { stroke: #0b6cab; stroke-width: 2.6 }
.torque { fill: none; stroke-linecap: round; stroke: #5b4b8a; stroke-width: 3 }
.before, .after { fill: none; stroke-width: 2 } .before { stroke: #d1495b } .after { stroke: #0b6cab }
</style>
<rect width="960" height="HEIGHT" fill="#fff"/>
"##;

/// Both models beside the first recording.
#[derive(Debug)]
pub struct Figure<'d> {
    /// Of the specimen.
    title: &'d str,
    /// What it shows.
    drawn: &'d Drawn,
}

impl<'d> Figure<'d> {
    /// Of a diagnosis.
    ///
    /// # Errors
    /// [`Error::Simulation`] where a model cannot be integrated.
    pub fn of(diagnosis: &'d Diagnosis) -> Result<Self> {
        let not_drawn = || Error::Simulation { detail: "the fitted motion cannot be integrated to be drawn".into() };
        let drawn = diagnosis.drawn.as_ref().ok_or_else(not_drawn)?;
        Ok(Self { title: &diagnosis.specimen, drawn })
    }

    /// The page.
    pub fn svg(&self) -> String {
        let mut svg = HEAD.replace("HEIGHT", &HEIGHT_PX[usize::from(self.drawn.torque.is_some())].to_string());
        self.legend(&mut svg);
        self.swing(&mut svg);
        self.left(&mut svg);
        if let Some(torque) = &self.drawn.torque {
            law(&mut svg, torque);
        }
        svg.push_str("</svg>\n");
        svg
    }

    fn legend(&self, svg: &mut String) {
        text(svg, "title", [28.0, 42.0], self.title);
        let fitted = match self.drawn.border_s {
            Some(border_s) => format!("Fitted before {border_s:.2} s, predicted from there on"),
            None => "Fitted to all of it".to_owned(),
        };
        text(svg, "note", [28.0, 66.0], &fitted);
        let mut x_px = 34.0;
        let y_px = 96.0;
        let mut entry = |class: &str, dot: bool, words: &str| {
            line(svg, class, [x_px, y_px - 5.0], [if dot { x_px } else { x_px + 24.0 }, y_px - 5.0]);
            let begin_px = if dot { x_px + 10.0 } else { x_px + 32.0 };
            text(svg, "heading", [begin_px, y_px], words);
            x_px = begin_px + 8.0 * words.chars().count() as f64 + 28.0;
        };
        entry("measured", true, "measured");
        entry("before", false, "base model (before)");
        if let Some((effects, _)) = &self.drawn.after {
            let names: Vec<&str> = effects.iter().map(|c| c.id()).collect();
            entry("after", false, &format!("with {} (after)", names.join(" and ")));
        }
    }

    /// The end of the first angle.
    fn swing(&self, svg: &mut String) {
        let Some(values) = self.drawn.before.values.first().filter(|v| !v.is_empty()) else { return };
        let (first_s, last_s) = (values[0].t_s, values[values.len() - 1].t_s);
        let least_rad = SEEN * self.drawn.before.noise_rad.first().copied().unwrap_or(0.0);
        let seen_s = values.iter().rfind(|v| v.measured_rad.abs() > least_rad).map_or(last_s, |v| v.t_s);
        let until_s = seen_s.max(first_s + SWINGS * self.drawn.swing_s).min(last_s);
        let from_s = (until_s - SWINGS * self.drawn.swing_s).max(first_s);
        let shown = |of: &Residuals| -> Vec<Residual> {
            of.values[0].iter().filter(|v| from_s <= v.t_s && v.t_s <= until_s).copied().collect()
        };
        let (before, after) = (shown(&self.drawn.before), self.drawn.after.as_ref().map(|(_, left)| shown(left)));
        let angles = before.iter().flat_map(|v| [v.measured_rad, v.predicted_rad]);
        let largest_rad = 1.12 * angles.fold(0.0f64, |a, b| a.max(b.abs()));
        let panel = Panel { x_px: WHOLE_PX, y_px: UPPER_PX, x: from_s..until_s, y: -largest_rad..largest_rad };
        let curve = |of: &[Residual]| of.iter().map(|v| (v.t_s, v.predicted_rad, v.rate_rad_s)).collect::<Vec<_>>();
        let gap_s = 0.5 * self.drawn.swing_s;
        self.ahead(svg, &panel);
        panel.axes(svg, true);
        panel.curve(svg, "before", &curve(&before), gap_s);
        if let Some(after) = after {
            panel.curve(svg, "after", &curve(&after), gap_s);
        }
        panel.dots(svg, "measured", &before.iter().map(|v| (v.t_s, v.measured_rad)).collect::<Vec<_>>());
        panel.outline(svg);
        upright(svg, &panel, "θ1 (rad)");
        text(svg, "heading", [WHOLE_PX.start, UPPER_PX.end + 38.0], "The end of the swing");
        text(svg, "heading end", [WHOLE_PX.end, UPPER_PX.end + 38.0], "time (s)");
    }

    /// What is left of every angle, before and after, each with a scale of its own.
    fn left(&self, svg: &mut String) {
        match &self.drawn.after {
            None => self.column(svg, WHOLE_PX, "left-before", &self.drawn.before),
            Some((_, after)) => {
                self.column(svg, BEFORE_PX, "left-before", &self.drawn.before);
                self.column(svg, AFTER_PX, "left-after", after);
            }
        }
        text(
            svg,
            "note",
            [WHOLE_PX.start, LOWER_PX.end + 40.0],
            "Grey: ±2 standard deviations of the noise. Every panel has its own scale.",
        );
        text(svg, "heading end", [WHOLE_PX.end, LOWER_PX.end + 40.0], "time (s)");
    }

    fn column(&self, svg: &mut String, x_px: Range<f64>, class: &str, left: &Residuals) {
        let count = left.values.len();
        let height_px = (LOWER_PX.end - LOWER_PX.start + GAP_PX) / count.max(1) as f64 - GAP_PX;
        for (link, values) in left.values.iter().enumerate() {
            let (Some(first), Some(last)) = (values.first(), values.last()) else { continue };
            let left_mrad: Vec<(f64, f64)> = values.iter().map(|v| (v.t_s, 1e3 * v.left_rad())).collect();
            let band_mrad = 2e3 * left.noise_rad[link];
            let largest_mrad = 1.08 * left_mrad.iter().fold(1.5 * band_mrad, |a, b| a.max(b.1.abs()));
            let top_px = LOWER_PX.start + link as f64 * (height_px + GAP_PX);
            let panel = Panel {
                x_px: x_px.clone(),
                y_px: top_px..top_px + height_px,
                x: first.t_s..last.t_s,
                y: -largest_mrad..largest_mrad,
            };
            self.ahead(svg, &panel);
            panel.rectangle(svg, "noise", &panel.x, &(-band_mrad..band_mrad));
            panel.axes(svg, link + 1 == count);
            panel.dots(svg, class, &left_mrad);
            panel.outline(svg);
            self.border(svg, &panel, link == 0);
            text(svg, "heading", [x_px.start, top_px - 8.0], &self.heading(class == "left-after", left, link));
            if x_px.start == WHOLE_PX.start {
                upright(svg, &panel, &format!("θ{} left (mrad)", link + 1));
            }
        }
    }

    /// The line from which on a panel shows predictions.
    fn border(&self, svg: &mut String, panel: &Panel, with_words: bool) {
        let Some(border_px) = self.drawn.border_s.and_then(|border_s| panel.vertical(svg, "border", border_s)) else {
            return;
        };
        let y_px = panel.y_px.start + 16.0;
        let is_late = border_px > 0.5 * (panel.x_px.start + panel.x_px.end);
        if with_words && is_late {
            text(svg, "here end", [border_px - 6.0, y_px], "predicted from here →");
        } else if with_words {
            text(svg, "here", [border_px + 6.0, y_px], "predicted from here");
        }
    }

    /// Root mean squares, of the prediction where there is one.
    fn heading(&self, is_after: bool, left: &Residuals, link: usize) -> String {
        let from_s = self.drawn.border_s.unwrap_or(f64::NEG_INFINITY);
        let counted = left.values[link].iter().filter(|v| v.t_s >= from_s);
        let (count, squares) = counted.fold((0usize, 0.0), |(n, sum), v| (n + 1, sum + v.left_rad().powi(2)));
        let rms = number(1e3 * (squares / count.max(1) as f64).sqrt(), 3);
        let of = if self.drawn.border_s.is_some() { "prediction" } else { "fit" };
        let noise = number(1e3 * left.noise_rad[link], 3);
        let when = if is_after { "After" } else { "Before" };
        format!("{when}, θ{}: {of} {rms} mrad rms, noise {noise}", link + 1)
    }

    /// A tint behind what was not fitted.
    fn ahead(&self, svg: &mut String, panel: &Panel) {
        if let Some(border_s) = self.drawn.border_s {
            panel.rectangle(svg, "ahead", &(border_s..panel.x.end), &panel.y);
        }
    }
}

/// The torque against what it works on, and against its rate.
fn law(svg: &mut String, torque: &MissingTorque) {
    let largest = 1.08 * torque.course.iter().fold(1e-30f64, |a, c| a.max(c.0.abs()));
    let (scale, unit) = match largest {
        l if l < 1e-6 => (1e9, "nN·m"),
        l if l < 1e-3 => (1e6, "µN·m"),
        _ => (1e3, "mN·m"),
    };
    let works_on = match torque.place {
        Place::Hinge => "θ1",
        Place::Joint => "the bend θ1 − θ2",
        Place::Air | Place::Camera => "the angle of the whole strip",
    };
    type Side = fn(&(f64, f64)) -> f64;
    let sides: [(Range<f64>, Side, &str); 2] = [(BEFORE_PX, |on| on.0, "rad"), (AFTER_PX, |on| on.1, "rad/s")];
    for (x_px, side, x_unit) in sides {
        let reach = 1.05 * torque.works_on.iter().fold(1e-30f64, |a, on| a.max(side(on).abs()));
        let y = -scale * largest..scale * largest;
        let panel = Panel { x_px: x_px.clone(), y_px: TORQUE_PX, x: -reach..reach, y };
        panel.axes(svg, true);
        let dots: Vec<(f64, f64)> =
            torque.works_on.iter().zip(&torque.course).map(|(on, course)| (side(on), scale * course.0)).collect();
        panel.dots(svg, "torque", &dots);
        panel.outline(svg);
        let whose = if x_unit == "rad" { works_on.to_owned() } else { format!("rate of {works_on}") };
        text(svg, "heading end", [x_px.end, TORQUE_PX.end + 38.0], &format!("{whose} ({x_unit})"));
        if x_px.start == BEFORE_PX.start {
            let at = match torque.place {
                Place::Hinge => "at the hinge",
                Place::Joint => "in the joint",
                Place::Air | Place::Camera => "from the air",
            };
            text(
                svg,
                "heading",
                [x_px.start, TORQUE_PX.start - 8.0],
                &format!("Torque that the base model lacks {at}"),
            );
            upright(svg, &panel, &format!("torque ({unit})"));
        }
    }
}

/// A label along the left edge.
fn upright(svg: &mut String, panel: &Panel, words: &str) {
    let y_px = 0.5 * (panel.y_px.start + panel.y_px.end);
    let _ = writeln!(svg, r#"<g transform="translate(26 {y_px:.1}) rotate(-90)">"#);
    text(svg, "heading middle", [0.0, 0.0], words);
    svg.push_str("</g>\n");
}
