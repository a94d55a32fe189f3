//! What was found of the marks' colour and is no mark, why, and the option that would accept it.

use std::path::Path;

use crate::detect::{Album, Hue, Trial};
use crate::error::{Error, Result};
use crate::experiment::{Look, MarkColour, Rig};
use crate::statistics::median;
use crate::track::{MarkFound, Tracks, UnusedObject};

/// A recording whose marks are to be judged.
pub struct Rejected<'a> {
    pub path: &'a Path,
    pub album: &'a Album,
    pub hues: &'a [Hue],
    pub frames: u64,
    pub rig: &'a Rig,
}

/// Frames below which nothing is said of what stands still.
const FEWEST_FRAMES: usize = 8;
/// Things that are listed one by one.
const LISTED: usize = 3;
/// A proposal that shows fewer marks than this share of what is wanted, in the usual picture, is none.
const LEAST_QUALITY: f64 = 0.35;

impl Rejected<'_> {
    /// Every hue has its marks, and they swing.
    ///
    /// # Errors
    /// [`Error::NoMarks`] and [`Error::TooFewMarks`].
    pub fn check(&self, found: &[MarkFound], tracks: &Tracks) -> Result<()> {
        if found.iter().any(|f| f.frames > 0) && !tracks.moves && tracks.t_s.len() >= FEWEST_FRAMES {
            return Err(self.nothing_swings(tracks)?);
        }
        for (index, hue) in self.hues.iter().enumerate() {
            let seen = found.iter().filter(|f| usize::from(f.hue) == index && f.frames > 0).count();
            let spares: Vec<&UnusedObject> = tracks.spares.iter().filter(|s| usize::from(s.hue) == index).collect();
            if seen == 0 {
                return Err(self.no_marks(hue, &spares)?);
            }
            if seen < hue.marks {
                return Err(self.too_few(hue, seen, &spares));
            }
        }
        self.pivot_apart(tracks)
    }

    /// A link is longer than the mark at its end is wide: else the mark is the pivot.
    fn pivot_apart(&self, tracks: &Tracks) -> Result<()> {
        let (Some(pivot), Some(first)) = (self.rig.pivot_px, tracks.marks.first()) else { return Ok(()) };
        let seen = first.iter().filter_map(|p| p.measured);
        let distance = |p: [f64; 2]| (p[0] - pivot[0]).hypot(p[1] - pivot[1]);
        let usual_px = median(&mut seen.map(|m| distance(m.position_px)).collect::<Vec<_>>());
        let width_px = 2.0 * (tracks.area_px2[0] / std::f64::consts::PI).sqrt();
        let Some(usual_px) = usual_px.filter(|d| *d < width_px) else { return Ok(()) };
        let message = format!(
            "{} lies {usual_px:.1} px from the first mark, which is {width_px:.0} px wide: that mark is the pivot itself; leave --pivot out, or count only the marks below it with --markers {}",
            point(pivot),
            tracks.marks.len().saturating_sub(1).max(1)
        );
        Err(Error::Option { option: "--pivot".to_owned(), message })
    }

    /// What is said where only a part of the picture is looked at.
    fn part(&self) -> &'static str {
        match (self.rig.roi_px, &self.rig.mask) {
            (Some(_), _) => " in the region of --roi",
            (None, Some(_)) => " in the white of the mask",
            (None, None) => "",
        }
    }

    fn no_marks(&self, hue: &Hue, spares: &[&UnusedObject]) -> Result<Error> {
        let strongest = self.album.strongest(hue)?;
        let kind = kind(&hue.colour);
        let found = if spares.is_empty() && strongest < hue.threshold {
            format!("the strongest {kind} of 255 is {strongest:.0}, below the threshold {:.0}", hue.threshold)
        } else if spares.is_empty() {
            format!(
                "{kind} reaches {strongest:.0} of 255, threshold {:.0}, but no region of it lasts and looks like a mark",
                hue.threshold
            )
        } else {
            format!("{} stand{} still{}", things(spares, &hue.colour), verb(spares), places(spares))
        };
        self.refusal(hue, found)
    }

    fn nothing_swings(&self, tracks: &Tracks) -> Result<Error> {
        let hue = &self.hues[0];
        let still = tracks.marks.iter().filter_map(|points| points.iter().find_map(|p| p.measured));
        let at: Vec<String> = still.take(LISTED).map(|m| point(m.position_px)).collect();
        let found = format!("what has the colour, at {}, stands still throughout, and marks swing", at.join(" and "));
        self.refusal(hue, found)
    }

    fn refusal(&self, hue: &Hue, found: String) -> Result<Error> {
        let remedy = match self.proposal(hue)? {
            Some(colour) => format!(
                "what moves here is {colour}: try --color '{colour}', or marks = [\"{colour}\", …] in the experiment file"
            ),
            None => {
                "name the marks' colour with --color, or lower --threshold; --debug-frames DIR shows each step".into()
            }
        };
        let remedy = match self.part() {
            "" => remedy,
            part => format!("only what lies{part} is looked at: widen it, or {remedy}"),
        };
        let colour = hue.colour.name.clone();
        Ok(Error::NoMarks { path: self.path.to_owned(), colour, frames: self.frames, found, remedy })
    }

    fn too_few(&self, hue: &Hue, found: usize, spares: &[&UnusedObject]) -> Error {
        let still: Vec<&UnusedObject> = spares.iter().copied().filter(|s| !s.moves).collect();
        let beside = if still.is_empty() {
            String::new()
        } else {
            format!(
                "; {}{} stand{} still and keep{} no distance from what swings",
                things(&still, &hue.colour),
                places(&still),
                verb(&still),
                verb(&still)
            )
        };
        let wider = match self.part() {
            "" => String::new(),
            part => format!(", or look at more of the picture than what lies{part}"),
        };
        let remedy = format!("say --markers {found}, or light or uncover what is missing{wider}, or lower --threshold");
        let (path, colour, wanted) = (self.path.to_owned(), hue.colour.name.clone(), hue.marks);
        Error::TooFewMarks { path, colour, found, wanted, beside, remedy }
    }

    /// The look of what moves like marks.
    fn proposal(&self, hue: &Hue) -> Result<Option<String>> {
        let mut best: Option<(f64, String)> = None;
        let mut consider = |trial: Option<Trial>, name: Option<&str>, album: &Album| {
            let Some(trial) = trial.filter(|t| t.likely().any(|s| s.moves)) else { return };
            let name = name.map(str::to_owned).or_else(|| album.colour_name(&trial));
            if let Some(name) = name.filter(|_| best.as_ref().is_none_or(|(q, _)| trial.quality > *q)) {
                best = Some((trial.quality, name));
            }
        };
        for peak in self.album.hues(0.0, std::f64::consts::PI).iter().take(4) {
            consider(self.album.try_hue(peak.angle_rad, &[hue.marks], None)?.pop().flatten(), None, self.album);
        }
        for (dark, name) in [(true, "dark"), (false, "light")] {
            consider(self.album.try_luma(dark, &[hue.marks], None)?.pop().flatten(), Some(name), self.album);
        }
        Ok(best.filter(|(quality, name)| *quality > LEAST_QUALITY && *name != hue.colour.name).map(|(_, name)| name))
    }
}

fn kind(colour: &MarkColour) -> String {
    match colour.look() {
        Look::Hue => format!("{} component", colour.name),
        Look::Dark | Look::Light => format!("{} contrast", colour.name),
    }
}

fn things(spares: &[&UnusedObject], colour: &MarkColour) -> String {
    match spares.len() {
        1 => format!("another {} thing", colour.name),
        n => format!("{n} other {} things", colour.name),
    }
}

fn verb(spares: &[&UnusedObject]) -> &'static str {
    if spares.len() == 1 { "s" } else { "" }
}

fn places(spares: &[&UnusedObject]) -> String {
    let at: Vec<String> = spares.iter().take(LISTED).map(|s| point(s.position_px)).collect();
    format!(" at {}{}", at.join(", "), if spares.len() > LISTED { ", …" } else { "" })
}

fn point([x, y]: [f64; 2]) -> String {
    format!("({x:.0}, {y:.0}) px")
}
