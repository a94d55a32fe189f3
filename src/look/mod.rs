//! A recording of which nothing is known → what moves, the marks in order, the pivot, the links.
//!
//! Every hue that moves, and dark and light spots, are looked for at once, roughly, in some hundred frames in a row. Of
//! what lasts and swings, the things that keep their distances form a chain; the look whose chain is longest is that of
//! the marks. Only this look is then measured in every frame, and the chain with it. The hinge is a still thing of the
//! marks' look at the centre of the first arc, or else that centre itself.

mod file;
mod preview;

pub use file::to_toml;
pub use preview::preview;

use std::path::Path;

use crate::detect::{Album, COUNTS, Hue, Trial};
use crate::error::{Error, Result};
use crate::experiment::MarkColour;
use crate::hand_hold::{caught_of, released_of};
use crate::measure::{Camera, Options, Session};
use crate::progress::Progress;
use crate::track::chain_detection::{self, MOST_MARKS};
use crate::track::{Arc, FrameBlobs, TrackedObject, things};
use crate::video::{StreamInfo, Timing};

/// Hues that are followed, strongest first.
const MOST_HUES: usize = 6;
/// Hues weaker than this share of the strongest are noise, or too small to be marks.
const LEAST_WEIGHT: f64 = 2e-3;
/// Stretches of the recording in which a chain is sought, one after the other.
const STRETCHES: usize = 3;

/// Chains of a stretch that are measured, the best first, until one of them hangs together throughout.
const CHAINS: usize = 3;
/// A thing is aside where it is farther from its usual place than this part of its whole range (judgement).
const FAR_ASIDE: f64 = 0.05;
/// Marks without a hue.
const SHADES: [&str; 2] = ["dark", "light"];

/// One mark of the chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// What to call its colour: `#rrggbb`, `dark` or `light`.
    pub colour: String,
    /// What it does.
    pub thing: TrackedObject,
}

/// What a recording shows.
#[derive(Debug, Clone)]
pub struct Finding {
    /// From the hinge down.
    pub marks: Vec<Mark>,
    /// The circle of the first mark that swings.
    pub arc: Option<Arc>,
    /// The first mark stands still and is the hinge.
    pub hinge_marked: bool,
    /// Lengths of the links between marks.
    pub links_px: Vec<f64>,
    /// Things of the marks' look that stand still and are none.
    pub still: Vec<TrackedObject>,
    /// Things of the marks' look that swing by themselves.
    pub apart: Vec<TrackedObject>,
    /// Until when it is held still at first, as by a hand: that is left out.
    pub held_until_s: Option<f64>,
    /// After when it is caught and held to the end: that, too.
    pub caught_after_s: Option<f64>,
    /// Turns a second of the first mark that swings.
    pub frequency_hz: Option<f64>,
    /// Time stamps.
    pub timing: Timing,
    /// The stream.
    pub stream: StreamInfo,
    /// The camera's motion.
    pub camera: Camera,
    /// One picture of the free swing, stored as red, green, blue at chroma resolution.
    pub background: Background,
    /// Its place in the marks' paths.
    pub pictured: usize,
}

/// A small picture for the preview.
#[derive(Debug, Clone)]
pub struct Background {
    /// Columns.
    pub width: usize,
    /// Red, green, blue, row by row.
    pub rgb: Vec<[u8; 3]>,
    /// log₂ of luma columns and rows in a sample.
    pub shifts: [u32; 2],
}

/// Looks at a recording. `options` gives the part and the span that are looked at; its marks are not used.
///
/// # Errors
/// Whatever makes the recording unusable, and [`Error::NothingSwings`].
pub fn look(path: &Path, options: &Options, folder: &Path, progress: &dyn Progress) -> Result<Finding> {
    let options = Options { marks: Vec::new(), ..options.clone() };
    let mut session = Session::open(path, &options, folder, progress)?;
    let looks = looks(session.album())?;
    let (hues, names): (Vec<Hue>, Vec<String>) = looks.iter().cloned().unzip();
    let of_looks = |worn: &[u8]| worn.iter().map(|hue| looks[usize::from(*hue)].clone()).collect::<Vec<_>>();
    let (mut seen, mut unsteady, mut from_s, mut rest) = (Vec::new(), Vec::new(), None, Vec::new());
    let mut tried: Vec<Vec<u8>> = Vec::new();
    for stretch in 0..STRETCHES {
        let frames = square(session.glance(&hues, from_s, progress)?, session.stream().pixel_aspect);
        if stretch == 0 {
            rest = further_stretches(&session, &frames);
        }
        let all = things(&frames);
        for chain in chain_detection::chains(&all, &names).into_iter().take(CHAINS) {
            let mut worn: Vec<u8> = chain.marks.iter().map(|i| all[*i].hue).collect();
            worn.sort_unstable();
            worn.dedup();
            if !chain.is_steady(&all) {
                if chain.may_tumble(&all) && !unsteady.iter().any(|own: &(f64, Vec<u8>)| own.1 == worn) {
                    unsteady.push((chain.worth, worn));
                }
            } else if !tried.contains(&worn) {
                tried.push(worn.clone());
                if let Some(finding) = measured(&mut session, of_looks(&worn), true, progress)? {
                    return Ok(finding);
                }
            }
        }
        seen.push((frames.len(), all));
        match rest.pop() {
            Some(begin_s) => from_s = Some(begin_s),
            None => break,
        }
    }
    if let Some(finding) = one_mark(path, &options, (folder, progress), (&names, session.album()))? {
        return Ok(finding);
    }
    // a motion that is no oscillation, as a double pendulum that turns over
    unsteady.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, worn) in unsteady.into_iter().take(CHAINS) {
        if let Some(finding) = measured(&mut session, of_looks(&worn), false, progress)? {
            return Ok(finding);
        }
    }
    Err(nothing_swings(path, &seen, &names, session.stream().stated_frames))
}

/// What swings before things of its own hue or shade is one with them now and then, and lost among many: as `track` finds a single mark of that colour, by the threshold at which
/// something swings.
fn one_mark(
    path: &Path,
    options: &Options,
    (folder, progress): (&Path, &dyn Progress),
    (names, album): (&[String], &Album),
) -> Result<Option<Finding>> {
    let mut colours: Vec<(&str, MarkColour)> = Vec::new();
    let parsed = |name| Some((name, str::parse::<MarkColour>(name).ok()?));
    for (name, colour) in names.iter().map(String::as_str).filter(|name| name.starts_with('#')).filter_map(parsed) {
        // `track` looks for the hues around the one that is named
        if colours.iter().all(|(_, other)| !album.is_of_family(other, &colour)) {
            colours.push((name, colour));
        }
    }
    colours.truncate(CHAINS);
    colours.extend(SHADES.into_iter().filter_map(parsed));
    for (name, colour) in colours {
        let options = Options { marks: vec![colour], ..options.clone() };
        // where there is no mark of that colour there may be one of the next
        let Ok(mut session) = Session::open(path, &options, folder, progress) else { continue };
        let looks = session.hues().iter().map(|hue| (hue.clone(), name.to_owned())).collect();
        if let Some(finding) = measured(&mut session, looks, true, progress)? {
            return Ok(Some(finding));
        }
    }
    Ok(None)
}

/// Where the stretches after the first begin, the last first.
fn further_stretches(session: &Session<'_>, first: &[FrameBlobs]) -> Vec<f64> {
    let (Some(begin), Some(end)) = (first.first(), first.last()) else { return Vec::new() };
    let length_s = end.t_s - begin.t_s;
    let Some([_, last_s]) = session.span_s(begin.t_s) else { return Vec::new() };
    // what is left is looked at in even steps
    let room_s = last_s - begin.t_s - length_s;
    if room_s < 0.1 * length_s {
        return Vec::new();
    }
    (1..STRETCHES).rev().map(|k| begin.t_s + room_s * k as f64 / (STRETCHES - 1) as f64).collect()
}

/// The chain that the things of these looks form throughout the recording, measured exactly; one that seemed steady must be so all the way.
fn measured(
    session: &mut Session<'_>,
    looks: Vec<(Hue, String)>,
    steady: bool,
    progress: &dyn Progress,
) -> Result<Option<Finding>> {
    let (hues, names): (Vec<Hue>, Vec<String>) = looks.into_iter().unzip();
    // circles and distances are those of square pixels; what is found, is in the file's
    let aspect = session.stream().pixel_aspect;
    let mut frames = square(session.gather(hues, progress)?, aspect);
    let mut all = things(&frames);
    let found = |frames: &[FrameBlobs], all: &[TrackedObject]| {
        let t_s: Vec<f64> = frames.iter().map(|frame| frame.t_s).collect();
        let is_there = |i: &usize| session.makes_a_difference(&t_s, &all[*i]) != Some(false);
        let chain = chain_detection::longest(all, &names)?;
        let swings = || chain.is_steady(all) && chain.marks.iter().all(|i| !all[*i].moves || comes_back(&all[*i]));
        ((!steady || swings()) && chain.marks.iter().all(is_there)).then_some(chain)
    };
    let Some(mut chain) = found(&frames, &all) else { return Ok(None) };
    // a hand that holds a mark covers part of it, at one end of its arc
    let [held_until_s, caught_after_s] = held_s(&frames, &chain.marks.iter().map(|i| &all[*i]).collect::<Vec<_>>());
    if held_until_s.or(caught_after_s).is_some() {
        let free_s = held_until_s.unwrap_or(f64::NEG_INFINITY)..=caught_after_s.unwrap_or(f64::INFINITY);
        frames.retain(|frame| free_s.contains(&frame.t_s));
        all = things(&frames);
        chain = match found(&frames, &all) {
            Some(chain) => chain,
            None => return Ok(None),
        };
    }
    let t_s: Vec<f64> = frames.iter().map(|f| f.t_s).collect();
    let place_of = |stamp_s: &f64| t_s.iter().position(|t| t == stamp_s);
    let free = session.sampled_s().iter().enumerate().find_map(|(k, stamp_s)| Some((k, place_of(stamp_s)?)));
    let (picture, pictured) = free.unwrap_or_default();
    let mut marks: Vec<Mark> = chain
        .marks
        .iter()
        .map(|i| Mark { colour: names[usize::from(all[*i].hue)].clone(), thing: all[*i].clone() })
        .collect();
    let first = &marks[usize::from(chain.hinge_marked).min(marks.len() - 1)].thing;
    let stream = session.stream();
    let (width, height) = stream.orientation.size(stream.stored_size_px);
    let size_px = [aspect * width as f64, height as f64];
    let arc = chain.arc.map(|arc| arc.through_a_camera(&first.places_px(), first.radius_px(), size_px));
    // a clamp above a ball looks like it, and is not where the ball swings about; a chain of several marks is known by itself
    let is_elsewhere = |arc: Arc| marks.len() == 2 && arc.excludes(marks[0].thing.place_px());
    let hinge_marked = chain.hinge_marked && !arc.is_some_and(is_elsewhere);
    if chain.hinge_marked && !hinge_marked {
        marks.remove(0);
    }
    let links_px = marks.windows(2).filter_map(|w| w[0].thing.distance_px(&w[1].thing)).collect();
    let swinging = usize::from(hinge_marked);
    let beside = |t: &TrackedObject, m: &Mark| {
        m.thing.distance_px(t).is_some_and(|d| d > m.thing.area_px2.sqrt().max(t.area_px2.sqrt()))
    };
    let alike = |t: &&TrackedObject| marks.iter().any(|m| m.thing.hue == t.hue) && marks.iter().all(|m| beside(t, m));
    let still = all.iter().filter(|t| !t.moves).filter(alike);
    let swings_apart = |t: &&TrackedObject| {
        t.moves && chain_detection::hangs_alone(t) && marks.iter().all(|m| m.thing.is_seen_beside(t))
    };
    let apart = all.iter().filter(swings_apart).filter(alike);
    let in_file = |thing: &TrackedObject| thing.clone().widened(aspect.recip());
    Ok(Some(Finding {
        held_until_s,
        caught_after_s,
        frequency_hz: marks.get(swinging).and_then(|m| turns_per_second(&m.thing, &t_s)),
        still: still.map(in_file).collect(),
        apart: apart.map(in_file).collect(),
        links_px,
        arc: arc.map(|arc| arc.widened(aspect.recip())),
        marks: marks.iter().map(|m| Mark { thing: in_file(&m.thing), ..m.clone() }).collect(),
        hinge_marked,
        timing: Timing::audit(&t_s, session.stream().nominal_rate_hz, session.stream().tick_s),
        stream: session.stream().clone(),
        camera: session.camera(),
        background: background(session.album(), picture),
        pictured,
    }))
}

/// Frames with columns as wide as rows are high.
fn square(frames: Vec<FrameBlobs>, aspect: f64) -> Vec<FrameBlobs> {
    frames.into_iter().map(|frame| frame.widened(aspect)).collect()
}

/// When what moves farthest is let go, if it is held at first, and until when it swings freely, if it is caught.
fn held_s(frames: &[FrameBlobs], marks: &[&TrackedObject]) -> [Option<f64>; 2] {
    let Some(farthest) = marks.iter().max_by(|a, b| a.travel_px.total_cmp(&b.travel_px)) else { return [None; 2] };
    let along = |axis: usize, from_s: f64| -> (Vec<f64>, Vec<f64>) {
        let seen = frames.iter().zip(&farthest.path).filter(|(frame, _)| frame.t_s >= from_s);
        seen.filter_map(|(frame, place)| Some((frame.t_s, (*place)?[axis]))).unzip()
    };
    let paths = |from_s: f64| [0, 1].map(|axis| along(axis, from_s)).into_iter();
    // two digits are written, and must lie in the free swing
    let let_go_s = released_of(paths(f64::NEG_INFINITY)).map(|t_s| (100.0 * t_s).ceil() / 100.0);
    let caught_s = caught_of(paths(let_go_s.unwrap_or(f64::NEG_INFINITY))).map(|t_s| (100.0 * t_s).floor() / 100.0);
    [let_go_s, caught_s]
}

/// What is worth following: every hue that moves, dark spots, light spots; each with its name.
fn looks(album: &Album) -> Result<Vec<(Hue, String)>> {
    let mut looks = Vec::new();
    let peaks = album.hues(0.0, std::f64::consts::PI);
    let least = LEAST_WEIGHT * peaks.first().map_or(0.0, |p| p.weight);
    let hues = peaks.iter().filter(|p| p.weight >= least).take(MOST_HUES);
    let mut trials: Vec<(Trial, Option<&'static str>)> = Vec::new();
    let mut add = |found: Vec<Option<Trial>>, name: Option<&'static str>| {
        for trial in found.into_iter().flatten() {
            if !trials.iter().any(|(known, n)| *n == name && known.is_alike(&trial)) {
                trials.push((trial, name));
            }
        }
    };
    for peak in hues {
        add(album.try_hue(peak.angle_rad, &COUNTS, None)?, None);
    }
    for (dark, name) in [true, false].into_iter().zip(SHADES) {
        add(album.try_luma(dark, &COUNTS, None)?, Some(name));
    }
    // what shows more spots than there can be marks is a wall or a shadow
    let few = |t: &Trial| t.likely().count() <= MOST_MARKS * t.spots.len();
    for (trial, name) in trials.into_iter().filter(|(t, _)| few(t)) {
        let Some(name) = name.map(str::to_owned).or_else(|| album.colour_name(&trial)) else { continue };
        let Ok(colour) = name.parse::<MarkColour>() else { continue };
        let mut hue = Hue { colour, marks: trial.marks, round: true, ..Hue::default() };
        hue.adopt(&trial, album.sample_px2());
        looks.push((hue, name));
    }
    Ok(looks)
}

/// `seen`: frames and things of every stretch. The stretch with most of them speaks.
fn nothing_swings(
    path: &Path,
    seen: &[(usize, Vec<TrackedObject>)],
    names: &[String],
    stated_frames: Option<u64>,
) -> Error {
    // stretches may overlap
    let most = stated_frames.map_or(usize::MAX, |frames| frames as usize);
    let frames = seen.iter().map(|(frames, _)| frames).sum::<usize>().min(most);
    let count = |all: &[TrackedObject]| (all.iter().filter(|t| t.moves).count(), all.len());
    let (moving, lasting) = seen.iter().map(|(_, all)| count(all)).max().unwrap_or_default();
    let still = lasting - moving;
    let found = if names.is_empty() {
        "nothing coloured, dark or light stands out from its surroundings".to_owned()
    } else {
        format!(
            "of {} lasting spots ({}) {moving} move and {still} stand still, but none swings in the plane of the picture on an arc, as a mark of a hung body does",
            lasting,
            names.join(", ")
        )
    };
    Error::NothingSwings { path: path.to_owned(), frames, found }
}

/// From end to end of a thing's motion along an axis.
fn range_px(thing: &TrackedObject, axis: usize) -> f64 {
    let values = thing.path.iter().flatten().map(|p| p[axis]);
    values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
}

/// The axis along which it moves farther.
fn longer_axis(thing: &TrackedObject) -> usize {
    usize::from(range_px(thing, 1) > range_px(thing, 0))
}

/// Whether a thing goes to one side of its usual place, to the other and back, as what swings does and what walks past does not.
fn comes_back(thing: &TrackedObject) -> bool {
    let (axis, middle) = (longer_axis(thing), thing.place_px());
    let far_px = FAR_ASIDE * range_px(thing, axis);
    let aside = thing.path.iter().flatten().map(|p| p[axis] - middle[axis]).filter(|off_px| off_px.abs() > far_px);
    let mut sides: Vec<bool> = aside.map(|off_px| off_px > 0.0).collect();
    sides.dedup();
    sides.len() > 2
}

/// Full turns a second of a thing's motion along its longer axis.
fn turns_per_second(thing: &TrackedObject, t_s: &[f64]) -> Option<f64> {
    let (axis, middle) = (longer_axis(thing), thing.place_px());
    let rows: Vec<(f64, f64)> =
        thing.path.iter().zip(t_s).filter_map(|(p, t)| p.map(|p| (*t, p[axis] - middle[axis]))).collect();
    let rises: Vec<f64> = rows
        .windows(2)
        .filter(|w| w[0].1 < 0.0 && w[1].1 >= 0.0)
        .map(|w| w[0].0 + (w[1].0 - w[0].0) * w[0].1 / (w[0].1 - w[1].1))
        .collect();
    let (first, last) = (rises.first()?, rises.last()?);
    (rises.len() >= 3 && last > first).then(|| (rises.len() - 1) as f64 / (last - first))
}

fn background(album: &Album, picture: usize) -> Background {
    let picture = album.pictures.get(picture);
    let width = picture.map_or(0, |p| p.width);
    let rgb = picture.map_or_else(Vec::new, |p| {
        p.luma.iter().zip(&p.cb).zip(&p.cr).map(|((y, b), r)| album.rgb([*y, *b, *r])).collect()
    });
    Background { width, rgb, shifts: album.shifts }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thing(path: impl Fn(f64) -> [f64; 2]) -> TrackedObject {
        let path = (0..240).map(|frame| Some(path(f64::from(frame) / 24.0))).collect();
        TrackedObject {
            hue: 0,
            presence: 1.0,
            area_px2: 300.0,
            travel_px: 100.0,
            moves: true,
            moves_whole: true,
            steadiness: 1.0,
            path,
        }
    }

    #[test]
    fn what_swings_comes_back_and_what_walks_past_does_not() {
        assert!(comes_back(&thing(|t| [300.0 + 80.0 * (6.0 * t).sin(), 200.0])));
        // one swing to and fro
        assert!(comes_back(&thing(|t| [300.0, 200.0 - 80.0 * (0.9 * t).cos()])));
        assert!(!comes_back(&thing(|t| [40.0 + 110.0 * t, 200.0 + 4.0 * (9.0 * t).sin()])));
    }
}
