//! What was found, as a commented `experiment.toml`.

use std::fmt::Write as _;

use super::Finding;
use crate::caution::MOST_LENGTH_SPREAD;
use crate::experiment::Rig;
use crate::statistics::median;
use crate::track::TrackedObject;

/// Standard deviation of the pivot, over the radius, beyond which it is only a remark.
const MOST_PIVOT_SD: f64 = 0.15;

impl Finding {
    /// The pivot is known well enough to measure angles from it, and no mark shows it.
    pub fn states_pivot(&self) -> bool {
        !self.hinge_marked && self.shows_pivot() && self.keeps_distance()
    }

    /// The angle at which the first link hangs in the middle of its swing, from the picture's downward direction, positive to the right (rad); `None` where nothing shows its upper end.
    pub fn hangs_at_rad(&self) -> Option<f64> {
        let (first, rest) = self.marks.split_first()?;
        let (upper, lower) = match (self.hinge_marked, self.arc.filter(|_| self.states_pivot())) {
            (true, _) => (first.thing.place_px(), rest.first()?.thing.place_px()),
            (false, arc) => (arc?.centre_px, first.thing.place_px()),
        };
        Some((self.stream.pixel_aspect * (lower[0] - upper[0])).atan2(lower[1] - upper[1]))
    }

    /// Enough of a circle is swung to show its centre.
    fn shows_pivot(&self) -> bool {
        self.arc.is_some_and(|arc| arc.sd_px[0].max(arc.sd_px[1]) < MOST_PIVOT_SD * arc.radius_px)
    }

    /// The first mark keeps its distance from the centre as nearly as `track` asks of a link.
    fn keeps_distance(&self) -> bool {
        let Some((arc, first)) = self.arc.as_ref().zip(self.marks.first()) else { return false };
        let ([x, y], aspect) = (arc.centre_px, self.stream.pixel_aspect);
        let distances = first.thing.path.iter().flatten().map(|p| (aspect * (p[0] - x)).hypot(p[1] - y));
        let mut off: Vec<f64> = distances.map(|d| (d - arc.radius_px).abs()).collect();
        median(&mut off).is_some_and(|spread| 1.4826 * spread < MOST_LENGTH_SPREAD * arc.radius_px)
    }

    /// Links that will have an angle.
    fn links(&self) -> usize {
        self.marks.len() - usize::from(!self.states_pivot())
    }
}

/// The text of the file for a recording named `video`, of which this part was looked at.
pub fn to_toml(finding: &Finding, video: &str, part: &Rig) -> String {
    let mut text = format!(
        "# Written by `freeswing init {video}` from what the recording shows. Every line can be changed by hand.\n\
         # Next: track {video} --config THIS_FILE --out angles.csv\n\
         # then: freeswing identify angles.csv\n\
         # Lengths and mass are marked \"MEASURE\": put numbers there before `freeswing fit` or `diagnose`; `track` and\n\
         # `identify` do not need them.\n\n"
    );
    specimen(&mut text, finding);
    rig(&mut text, finding);
    let held = Rig {
        from_s: finding.held_until_s.or(part.from_s),
        until_s: finding.caught_after_s.or(part.until_s),
        ..part.clone()
    };
    looked_at(&mut text, &held);
    text
}

/// The part of the pictures and of the recording that was looked at.
fn looked_at(text: &mut String, part: &Rig) {
    let _ = match part.roi_px {
        Some([x, y, w, h]) => writeln!(text, "roi_px = [{x}, {y}, {w}, {h}]"),
        None => writeln!(text, "# roi_px = [x, y, w, h]       # seek marks only in this part of the picture"),
    };
    if part.from_s.is_none() && part.until_s.is_none() {
        text.push_str("# from_s = 0.0                # leave out what comes before, until_s what comes after\n");
    }
    for (key, value) in [("from_s", part.from_s), ("until_s", part.until_s)] {
        if let Some(value) = value {
            let _ = writeln!(text, "{key} = {value:?}");
        }
    }
}

fn specimen(text: &mut String, finding: &Finding) {
    // of one mark of which nobody knows where it hangs, too
    let links = finding.links().max(1);
    text.push_str("[specimen]\n");
    text.push_str("name = \"unnamed\"              # for reports\n");
    let _ = writeln!(
        text,
        "link_lengths_m = \"MEASURE\"    # {links} length{} in metres, from the hinge down, as in [{}]",
        if links == 1 { "" } else { "s" },
        vec!["0.1"; links].join(", ")
    );
    text.push_str("mass_kg = \"MEASURE\"           # kilograms, the whole strip or pendulum, marks included\n");
    text.push_str("# length_m = 0.25             # metres, the whole strip, where it goes on beyond its last mark\n");
    text.push_str("# width_m = 0.05              # metres, width of a strip, for its bending stiffness\n");
    text.push_str(
        "# for rigid arms or a bob give [[specimen.links]] with length_m, mass_kg, com_m, inertia_kg_m2 instead\n\n",
    );
}

fn rig(text: &mut String, finding: &Finding) {
    text.push_str("[rig]\n");
    let colours: Vec<String> = finding.marks.iter().map(|m| format!("\"{}\"", m.colour)).collect();
    let _ = writeln!(text, "# {}", found_in_words(finding));
    let _ = writeln!(text, "marks = [{}]  # from the hinge down", colours.join(", "));
    for (k, length) in finding.links_px.iter().enumerate() {
        let _ = writeln!(text, "# marks {} and {} are {length:.1} px apart", k + 1, k + 2);
    }
    pivot(text, finding);
    rate(text, finding);
    if let Some(places) = places(&finding.still) {
        let _ = writeln!(text, "# of the same look but standing still, and not taken for marks: {places}");
    }
    if let Some(places) = places(&finding.apart) {
        let _ = writeln!(
            text,
            "# of the same look but swinging by themselves, and not measured: about {places}; roi_px picks one of them"
        );
    }
    if finding.camera.taken_out {
        let _ = writeln!(
            text,
            "# the camera moves by up to {:.1} px; that is taken out with the standing background",
            finding.camera.greatest_shift_px
        );
    }
    text.push_str("gravity_m_s2 = 9.80665\n");
    text.push_str("# mirrored = true             # if the camera looks into a mirror\n");
    text.push_str(
        "# plumb_px = [[x, y], [x, y]] # two points of a plumb line, upper first, if the camera hangs askew\n",
    );
}

/// Where the first of some things are; `None` of none.
fn places(things: &[TrackedObject]) -> Option<String> {
    let places: Vec<String> =
        things.iter().take(4).map(|thing| thing.place_px()).map(|[x, y]| format!("({x:.0}, {y:.0})")).collect();
    (!places.is_empty()).then(|| places.join(", "))
}

fn found_in_words(finding: &Finding) -> String {
    let n = finding.marks.len();
    let first = &finding.marks[usize::from(finding.hinge_marked)];
    let width_px = 2.0 * first.thing.radius_px();
    let turns = finding.frequency_hz.map_or(String::new(), |f| format!(", about {f:.3} times a second of the file"));
    format!(
        "{n} mark{} about {width_px:.0} px wide; the {} swings by ± {:.0} px{turns}",
        if n == 1 { "" } else { "s" },
        if n == 1 {
            "mark"
        } else if finding.hinge_marked {
            "first stands still at the hinge, the next"
        } else {
            "first"
        },
        first.thing.travel_px
    )
}

fn pivot(text: &mut String, finding: &Finding) {
    let Some(arc) = &finding.arc else {
        text.push_str(
            "# the first mark swings on no clear arc: where it hangs is not known, so angles are between marks\n",
        );
        return;
    };
    let ([x, y], [sx, sy]) = (arc.centre_px, arc.sd_px);
    if sx.hypot(sy) > arc.radius_px && !finding.hinge_marked {
        text.push_str(
            "# the first mark's path is too straight to show where it hangs: set pivot_px = [x, y] if that is known\n",
        );
        return;
    }
    let (width, height) = finding.stream.orientation.size(finding.stream.stored_size_px);
    let inside = (0.0..width as f64).contains(&x) && (0.0..height as f64).contains(&y);
    let beside = if inside { "" } else { ", outside the picture" };
    let what = format!("centre of the first arc{beside}: ± {sx:.1}, ± {sy:.1} px (standard deviation)");
    if finding.hinge_marked && !arc.is_near(finding.marks[0].thing.place_px()) {
        let [hinge_x, hinge_y] = finding.marks[0].thing.place_px();
        let _ = writeln!(
            text,
            "# the first mark is the hinge, at {hinge_x:.1}, {hinge_y:.1}, but the arc of the next one has its centre at {x:.1}, {y:.1}: the plane of the swing is turned out of the picture"
        );
    } else if finding.hinge_marked {
        let _ = writeln!(text, "# the first mark is the hinge: at {x:.1}, {y:.1} lies the {what}");
    } else if finding.states_pivot() {
        let _ = writeln!(text, "pivot_px = [{x:.2}, {y:.2}]    # centre of the first arc{beside}");
        let _ = writeln!(
            text,
            "pivot_sd_px = [{sx:.2}, {sy:.2}]      # its standard deviation, with that of a lens nobody has calibrated and of a camera that was set up by eye"
        );
        let _ = writeln!(text, "# the first mark is {:.1} px below it", arc.radius_px);
    } else {
        let _ = writeln!(
            text,
            "# pivot_px = [{x:.1}, {y:.1}]  # {what}: {}; set it by hand if it is known",
            if finding.shows_pivot() {
                "the first mark does not keep its distance from there, so it is not the pivot"
            } else {
                "too little is swung to use it"
            }
        );
    }
}

fn rate(text: &mut String, finding: &Finding) {
    let timing = &finding.timing;
    let stated = timing.nominal_rate_hz.map_or("no rate".to_owned(), |r| format!("{r:.3} frames per second"));
    let real = timing.real_rate_hz.map_or("unknown".to_owned(), |r| format!("{r:.3}"));
    let _ = writeln!(text, "# the file states {stated}, its time stamps say {real}; the stamps are used");
    text.push_str("# true_rate_hz = 240          # if this is slow motion: the rate at which the camera ran\n");
}
