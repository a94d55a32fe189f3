//! Which of the things of the right colour are the marks.
//!
//! Marks are seen most of the time, look alike, swing, and keep their distances: a link is rigid, a strip hardly
//! shortens. Only the uppermost, or one below all others, may stand still, at the hinge: then it is where the next mark's distance from it does
//! not change while that mark swings. A knob on the stand keeps its distance from nothing that swings.

use std::cmp::Ordering;

use super::chain_detection::{CHANCE, SLIGHT};
use super::steadiness::{STILL, steadiness};
use super::tracklet::Tracklet;
use super::{FrameBlobs, MarkSlot, Sighting};
use crate::statistics::median;

/// Which tracklet is which mark.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Choice {
    pub chosen: Vec<Option<usize>>,
    /// Other lasting things of a mark's hue.
    pub spares: Vec<UnusedObject>,
    /// Something that was chosen swings.
    pub moves: bool,
}

/// A lasting thing of a mark's hue that was not taken for a mark.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnusedObject {
    /// Index of its hue.
    pub hue: u8,
    /// Where it usually is.
    pub position_px: [f64; 2],
    /// Half the range of its motion.
    pub travel_px: f64,
    /// It swings.
    pub moves: bool,
    /// It keeps its distance from a mark, as the marks of a chain do.
    pub keeps_distance: bool,
}

/// Half a range of motion below which a thing stands still, px, beyond its own scatter.
const STILL_PX: f64 = 0.5;
/// The same as a share of the largest motion: a hinge gives a little.
const STILL_SHARE: f64 = 0.01;
/// Scatters of a position that are no motion.
const STILL_SCATTERS: f64 = 4.0;
/// A link's change of length over the motion of its lower end, beyond which it is none. A plane of swing turned by
/// 45° out of the picture gives 0.1 at an amplitude of 30°.
const MOST_STRETCH: f64 = 0.15;
/// What it costs to take a thing for a mark that cannot be one.
const UNFIT: f64 = 2.0;
/// Share of the window in which a candidate must be seen.
const LEAST_PRESENCE: f64 = 0.2;
/// Candidates beyond the marks that are considered, most seen first.
const SPARE_CANDIDATES: usize = 5;

/// Part by which areas of one and the same thing, seen whole, differ.
pub(super) const SAME_AREA: f64 = 0.1;

/// A tracklet as a candidate.
pub(super) struct Candidate {
    tracklet: usize,
    pub hue: u8,
    pub presence: f64,
    /// Share of the window that is over when it is first seen.
    lateness: f64,
    pub ln_area: f64,
    /// How far down the picture it comes, or how far from the pivot; one frame in twenty apart.
    order: f64,
    /// Half the range of its motion, the outermost twentieths apart.
    pub travel_px: f64,
    pub moves: bool,
    /// It moves while it is seen whole, too.
    pub(super) moves_whole: bool,
    /// See [`steadiness`].
    pub steadiness: f64,
    /// How much its distance from the pivot changes; see [`stretch`].
    pivot_stretch: f64,
    /// Position by frame.
    pub path: Vec<Option<[f64; 2]>>,
}

/// Candidates among which is chosen, with how much the distance of each two of them changes.
struct Kept<'c> {
    candidates: Vec<&'c Candidate>,
    stretches: Vec<Vec<f64>>,
}

impl<'c> Kept<'c> {
    fn of(candidates: Vec<&'c Candidate>) -> Self {
        let of_one = |a: &&Candidate| candidates.iter().map(|b| stretch(a, b)).collect();
        Self { stretches: candidates.iter().map(of_one).collect(), candidates }
    }
}

/// Chooses a tracklet for every slot.
pub(super) fn choose(
    tracklets: &[Tracklet],
    window: &[FrameBlobs],
    slots: &[MarkSlot],
    pivot_px: Option<[f64; 2]>,
) -> Choice {
    let mut candidates = candidates(tracklets, window, pivot_px);
    let farthest_px = candidates.iter().map(|c| c.travel_px).fold(0.0, f64::max);
    // what only ever moves while it is covered in part stands still, unless its like swings: then it is a mark that a hand lifts
    let swinging: Vec<u8> = candidates.iter().filter(|c| c.moves_whole).map(|c| c.hue).collect();
    candidates.iter_mut().for_each(|c| {
        c.moves &= c.travel_px > STILL_SHARE * farthest_px && swinging.contains(&c.hue);
        if !c.moves {
            c.steadiness = STILL;
        }
    });
    if let Some(place_px) = hinge_below(&candidates).filter(|_| pivot_px.is_none()) {
        candidates.iter_mut().for_each(|c| c.order = order(&c.path, Some(place_px)));
    }
    candidates.sort_by(|a, b| (b.moves, b.presence).partial_cmp(&(a.moves, a.presence)).unwrap_or(Ordering::Equal));
    // of what stands still only a possible hinge is considered, if anything swings at all
    let swings = candidates.iter().any(|c| c.moves);
    let hinge = |c: &Candidate| candidates.iter().any(|m| m.moves && stretch(c, m) < MOST_STRETCH);
    let possible: Vec<usize> =
        (0..candidates.len()).filter(|i| candidates[*i].moves || !swings || hinge(&candidates[*i])).collect();
    let mut kept: Vec<&Candidate> = Vec::new();
    for candidate in possible.into_iter().map(|i| &candidates[i]) {
        let wanted = slots.iter().filter(|s| s.hue == candidate.hue).count();
        let have = kept.iter().filter(|k| k.hue == candidate.hue).count();
        if have < wanted + SPARE_CANDIDATES {
            kept.push(candidate);
        }
    }
    let kept = Kept::of(kept);
    let mut best: Option<(f64, Vec<Option<usize>>)> = None;
    let mut partial = vec![None; slots.len()];
    search(&kept.candidates, slots, 0, &mut partial, &mut |assignment| {
        let score = score(&kept, assignment);
        if best.as_ref().is_none_or(|(s, _)| score > *s) {
            best = Some((score, assignment.to_vec()));
        }
    });
    let mut assignment = best.map(|(_, a)| a).unwrap_or(partial);
    if swings {
        drop_unfit(&kept, &mut assignment);
    }
    let moves = assignment.iter().flatten().any(|i| kept.candidates[*i].moves);
    let chosen: Vec<Option<usize>> = assignment.into_iter().map(|c| c.map(|i| kept.candidates[i].tracklet)).collect();
    let taken: Vec<usize> = chosen.iter().flatten().copied().collect();
    let spares = spares(&candidates, &taken);
    Choice { chosen, spares, moves }
}

/// Where a hinge stands below all that swings about it: the chain then begins there, and not at the top.
fn hinge_below(candidates: &[Candidate]) -> Option<[f64; 2]> {
    let mut swinging = candidates.iter().filter(|c| c.moves).peekable();
    swinging.peek()?;
    let is_below = |c: &&Candidate| swinging.clone().all(|m| m.order < c.order && stretch(c, m) < MOST_STRETCH);
    candidates.iter().find(|c| !c.moves && is_below(c)).and_then(|c| middle_px(&c.path))
}

/// Where a thing usually is.
fn middle_px(path: &[Option<[f64; 2]>]) -> Option<[f64; 2]> {
    let middle = |axis: usize| median(&mut path.iter().flatten().map(|p| p[axis]).collect::<Vec<_>>());
    Some([middle(0)?, middle(1)?])
}

/// How far from the hinge a thing comes, or, where that is not known, how far down the picture.
fn order(path: &[Option<[f64; 2]>], hinge_px: Option<[f64; 2]>) -> f64 {
    let of = |p: &[f64; 2]| match hinge_px {
        Some(hinge) => (p[0] - hinge[0]).hypot(p[1] - hinge[1]),
        None => p[1],
    };
    let mut orders: Vec<f64> = path.iter().flatten().map(of).collect();
    orders.sort_unstable_by(f64::total_cmp);
    orders.get(orders.len() * 19 / 20).copied().unwrap_or(0.0)
}

/// What was not taken, but was seen beside what was.
fn candidates_but<'a>(candidates: &'a [Candidate], taken: &[usize]) -> Vec<&'a Candidate> {
    let chosen: Vec<&Candidate> = candidates.iter().filter(|c| taken.contains(&c.tracklet)).collect();
    let beside = |c: &&Candidate| {
        !taken.contains(&c.tracklet)
            && chosen.iter().filter(|other| other.hue == c.hue).all(|other| {
                let both = c.path.iter().zip(&other.path).filter(|(p, q)| p.is_some() && q.is_some()).count();
                2 * both > c.path.iter().flatten().count()
            })
    };
    candidates.iter().filter(beside).collect()
}

fn spares(candidates: &[Candidate], taken: &[usize]) -> Vec<UnusedObject> {
    let marks: Vec<&Candidate> = candidates.iter().filter(|c| taken.contains(&c.tracklet)).collect();
    let spare = |c: &Candidate| UnusedObject {
        hue: c.hue,
        position_px: middle_px(&c.path).unwrap_or_default(),
        travel_px: c.travel_px,
        moves: c.moves,
        keeps_distance: marks.iter().any(|mark| stretch(c, mark) < MOST_STRETCH),
    };
    candidates_but(candidates, taken).into_iter().map(spare).collect()
}

/// Takes back what cannot be a mark: what stands still and is no hinge.
fn drop_unfit(kept: &Kept<'_>, assignment: &mut [Option<usize>]) {
    for slot in 0..assignment.len() {
        let unfit = assignment[slot].is_some_and(|i| !kept.candidates[i].moves && !is_hinge(kept, assignment, slot));
        if unfit {
            assignment[slot] = None;
        }
    }
}

/// What stands still in this slot is the first of the chain, and the next keeps its distance from it.
fn is_hinge(kept: &Kept<'_>, assignment: &[Option<usize>], slot: usize) -> bool {
    let Some(own) = assignment[slot] else { return false };
    let next = assignment[slot + 1..].iter().flatten().next();
    assignment[..slot].iter().all(Option::is_none)
        && next.is_some_and(|next| kept.candidates[*next].moves && kept.stretches[own][*next] < MOST_STRETCH)
}

/// Everything that lasts.
pub(super) fn candidates(tracklets: &[Tracklet], window: &[FrameBlobs], pivot_px: Option<[f64; 2]>) -> Vec<Candidate> {
    let least = ((window.len() as f64 * LEAST_PRESENCE) as usize).max(2);
    tracklets
        .iter()
        .enumerate()
        .filter(|(_, t)| t.sightings.len() >= least.min(window.len()))
        .map(|(tracklet, t)| {
            let sighting = |&(frame, blob): &(usize, usize)| -> &Sighting { &window[frame].sightings[blob] };
            let mut path = vec![None; window.len()];
            for at in &t.sightings {
                path[at.0] = Some(sighting(at).measured.position_px);
            }
            let mut areas = vec![None; window.len()];
            for at in &t.sightings {
                areas[at.0] = Some(f64::from(sighting(at).measured.area_px2));
            }
            let mut ln_areas: Vec<f64> = areas.iter().flatten().map(|a: &f64| a.ln()).collect();
            let (travel_px, scatter_px) = motion(&path);
            let still_px = STILL_PX + STILL_SCATTERS * scatter_px;
            let moves = travel_px > still_px;
            Candidate {
                travel_px,
                moves,
                moves_whole: moves && is_no_cover(&path, &areas, (travel_px, still_px)),
                tracklet,
                hue: t.hue,
                presence: t.sightings.len() as f64 / window.len() as f64,
                lateness: t.sightings.first().map_or(1.0, |s| s.0 as f64 / window.len() as f64),
                ln_area: median(&mut ln_areas).unwrap_or(0.0),
                order: order(&path, pivot_px),
                steadiness: if moves { steadiness(&path) } else { STILL },
                pivot_stretch: pivot_px.map_or(0.0, |p| stretch_of(&vec![Some(p); path.len()], &path, travel_px)),
                path,
            }
        })
        .collect()
}

/// Visits every way to fill the slots, those of one hue in order down the picture. A slot stays empty only where
/// its hue has too few candidates.
fn search(
    kept: &[&Candidate],
    slots: &[MarkSlot],
    slot: usize,
    partial: &mut Vec<Option<usize>>,
    visit: &mut dyn FnMut(&[Option<usize>]),
) {
    if slot == slots.len() {
        visit(partial);
        return;
    }
    let hue = slots[slot].hue;
    let previous = (0..slot).rev().find(|s| slots[*s].hue == hue).and_then(|s| partial[s]);
    let mut any = false;
    for (i, candidate) in kept.iter().enumerate() {
        let in_order = previous.is_none_or(|p| (kept[p].order, p) < (candidate.order, i));
        if candidate.hue == hue && in_order && !partial[..slot].contains(&Some(i)) {
            any = true;
            partial[slot] = Some(i);
            search(kept, slots, slot + 1, partial, visit);
        }
    }
    partial[slot] = None;
    let wanted = slots.iter().filter(|s| s.hue == hue).count();
    let have = kept.iter().filter(|k| k.hue == hue).count();
    if !any || have < wanted {
        search(kept, slots, slot + 1, partial, visit);
    }
}

fn score(kept: &Kept<'_>, assignment: &[Option<usize>]) -> f64 {
    let Kept { candidates, stretches } = kept;
    let places: Vec<usize> = assignment.iter().flatten().copied().collect();
    let chosen: Vec<&Candidate> = places.iter().map(|i| candidates[*i]).collect();
    // of two halves of a track, before a gap and after it, the first: what follows it will be found again
    let presence: f64 = chosen.iter().map(|c| c.presence * c.steadiness - c.lateness).sum();
    // a mark by itself has no distance to another that tells it: of two like pendulums, the one that swings about the pivot
    let from_pivot = match assignment {
        [only] => only.map_or(0.0, |only| candidates[only].pivot_stretch),
        _ => 0.0,
    };
    // and of any, one that swings by more than its own radius, and of those as good as each other the one that swings farthest
    let alone = match places[..] {
        [only] => alone(candidates, only),
        _ => 0.0,
    };
    let stretch = places.windows(2).map(|w| stretches[w[0]][w[1]]).fold(from_pivot, f64::max);
    let mean = chosen.iter().map(|c| c.ln_area).sum::<f64>() / chosen.len().max(1) as f64;
    let unlike = (chosen.iter().map(|c| (c.ln_area - mean).powi(2)).sum::<f64>() / chosen.len().max(1) as f64).sqrt();
    let swings = candidates.iter().any(|c| c.moves);
    let still = |slot: &usize| assignment[*slot].is_some_and(|i| !candidates[i].moves);
    let unfit = (0..assignment.len()).filter(still).filter(|slot| !is_hinge(kept, assignment, *slot)).count();
    presence + alone - 3.0 * stretch - 0.5 * unlike - if swings { UNFIT * unfit as f64 } else { 0.0 }
}

/// What speaks for a mark by itself beside others of its hue.
fn alone(candidates: &[&Candidate], only: usize) -> f64 {
    let own = candidates[only];
    let radius_px = (own.ln_area.exp() / std::f64::consts::PI).sqrt();
    let of_hue = candidates.iter().filter(|other| other.hue == own.hue);
    let farthest_px = of_hue.map(|other| other.travel_px).fold(f64::MIN_POSITIVE, f64::max);
    let slight = if own.moves && own.travel_px <= radius_px { SLIGHT } else { 0.0 };
    CHANCE * own.travel_px / farthest_px - slight
}

/// Half the range of a path along its longer axis, the outermost twentieths apart, and its scatter from frame to
/// frame.
fn motion(path: &[Option<[f64; 2]>]) -> (f64, f64) {
    let of_axis = |axis: usize| {
        let mut at: Vec<f64> = path.iter().flatten().map(|p| p[axis]).collect();
        at.sort_unstable_by(f64::total_cmp);
        let last = at.len().saturating_sub(1);
        if at.is_empty() { 0.0 } else { 0.5 * (at[last * 19 / 20] - at[last / 20]) }
    };
    // the third difference of white scatter has √20 times its standard deviation; a swing's is next to nothing
    let mut thirds: Vec<f64> = path
        .windows(4)
        .flat_map(|w| [0, 1].map(|axis| Some(w[3]?[axis] - 3.0 * w[2]?[axis] + 3.0 * w[1]?[axis] - w[0]?[axis])))
        .flatten()
        .map(f64::abs)
        .collect();
    let scatter_px = median(&mut thirds).unwrap_or(0.0) / (0.6745 * 20f64.sqrt());
    let travel_px = of_axis(0).max(of_axis(1));
    // a swing of few frames per turn has differences of its own: they are no scatter
    (travel_px, scatter_px.min(0.1 * travel_px))
}

/// It moves by more than a thing that stands still and is covered in part, or grows together with what lies beside it. What
/// is left of such a thing lies within its radius r; and while its area is nearly the usual one, nearer than
///
/// ```text
/// shift ≤ (A / A_left − 1) r
/// ```
fn is_no_cover(path: &[Option<[f64; 2]>], areas: &[Option<f64>], (travel_px, still_px): (f64, f64)) -> bool {
    let Some(usual) = median(&mut areas.iter().flatten().copied().collect::<Vec<_>>()) else { return false };
    let is_whole = |area: &Option<f64>| area.is_some_and(|a| (a / usual - 1.0).abs() < SAME_AREA);
    let whole: Vec<Option<[f64; 2]>> = path.iter().zip(areas).map(|(p, a)| p.filter(|_| is_whole(a))).collect();
    let radius_px = (usual / std::f64::consts::PI).sqrt();
    let shift_px = SAME_AREA / (1.0 - SAME_AREA) * radius_px;
    travel_px > radius_px || motion(&whole).0 > still_px.max(shift_px)
}

/// How much the distance of two candidates changes, as a share of how they move against each other; 1 where they
/// do not, or are never seen together.
fn stretch(a: &Candidate, b: &Candidate) -> f64 {
    stretch_of(&a.path, &b.path, a.travel_px.max(b.travel_px))
}

/// The same of two paths of things that move by this much.
pub(super) fn stretch_of(a: &[Option<[f64; 2]>], b: &[Option<[f64; 2]>], travel_px: f64) -> f64 {
    let between: Vec<[f64; 2]> = a
        .iter()
        .zip(b)
        .filter_map(|(p, q)| {
            let (p, q) = (p.as_ref()?, q.as_ref()?);
            Some([q[0] - p[0], q[1] - p[1]])
        })
        .collect();
    let mut lengths: Vec<f64> = between.iter().map(|d| d[0].hypot(d[1])).collect();
    let Some(usual) = median(&mut lengths).filter(|l| *l > 0.0) else { return 1.0 };
    let n = between.len() as f64;
    let mean = [0, 1].map(|axis| between.iter().map(|d| d[axis]).sum::<f64>() / n);
    let motion = between.iter().map(|d| (d[0] - mean[0]).hypot(d[1] - mean[1])).sum::<f64>() / n;
    let change = lengths.iter().map(|l| (l - usual).abs()).sum::<f64>() / n;
    let moved_px = motion.max(travel_px * 0.05);
    if moved_px <= 0.0 { 1.0 } else { (change / moved_px).max(change / usual).min(1.0) }
}
