//! Which of the things of the right colour are the marks.
//!
//! Marks are seen most of the time, look alike, and keep their distances: a link is rigid, a strip hardly shortens.
//! A knob on the stand keeps its distance from nothing that swings.

use super::tracklet::Tracklet;
use super::{FrameBlobs, MarkSlot, Sighting};
use crate::statistics::median;

/// Which tracklet is which mark.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Choice {
    pub chosen: Vec<Option<usize>>,
    /// Other lasting things of a mark's hue.
    pub others: usize,
}

/// Share of the window in which a candidate must be seen.
const LEAST_PRESENCE: f64 = 0.2;
/// Candidates beyond the marks that are considered, most seen first.
const SPARE_CANDIDATES: usize = 5;

/// A tracklet as a candidate.
struct Candidate {
    tracklet: usize,
    hue: u8,
    presence: f64,
    /// Share of the window that is over when it is first seen.
    lateness: f64,
    ln_area: f64,
    /// How far down the picture it comes, or how far from the pivot; one frame in twenty apart.
    order: f64,
    /// Position by frame.
    path: Vec<Option<[f64; 2]>>,
}

/// Chooses a tracklet for every slot.
pub(super) fn choose(
    tracklets: &[Tracklet],
    window: &[FrameBlobs],
    slots: &[MarkSlot],
    pivot_px: Option<[f64; 2]>,
) -> Choice {
    let mut candidates = candidates(tracklets, window, pivot_px);
    candidates.sort_by(|a, b| b.presence.total_cmp(&a.presence));
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in candidates {
        let wanted = slots.iter().filter(|s| s.hue == candidate.hue).count();
        let have = kept.iter().filter(|k| k.hue == candidate.hue).count();
        if have < wanted + SPARE_CANDIDATES {
            kept.push(candidate);
        }
    }
    let mut best: Option<(f64, Vec<Option<usize>>)> = None;
    let mut partial = vec![None; slots.len()];
    search(&kept, slots, 0, &mut partial, &mut |assignment| {
        let score = score(&kept, assignment);
        if best.as_ref().is_none_or(|(s, _)| score > *s) {
            best = Some((score, assignment.to_vec()));
        }
    });
    let chosen: Vec<Option<usize>> =
        best.map(|(_, a)| a).unwrap_or(partial).into_iter().map(|c| c.map(|i| kept[i].tracklet)).collect();
    let others = kept.len() - chosen.iter().flatten().count();
    Choice { chosen, others }
}

fn candidates(tracklets: &[Tracklet], window: &[FrameBlobs], pivot_px: Option<[f64; 2]>) -> Vec<Candidate> {
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
            let order = |p: &[f64; 2]| match pivot_px {
                Some(pivot) => (p[0] - pivot[0]).hypot(p[1] - pivot[1]),
                None => p[1],
            };
            let mut orders: Vec<f64> = path.iter().flatten().map(order).collect();
            orders.sort_unstable_by(f64::total_cmp);
            let mut ln_areas: Vec<f64> =
                t.sightings.iter().map(|s| f64::from(sighting(s).measured.area_px2).ln()).collect();
            Candidate {
                tracklet,
                hue: t.hue,
                presence: t.sightings.len() as f64 / window.len() as f64,
                lateness: t.sightings.first().map_or(1.0, |s| s.0 as f64 / window.len() as f64),
                ln_area: median(&mut ln_areas).unwrap_or(0.0),
                order: orders.get(orders.len() * 19 / 20).copied().unwrap_or(0.0),
                path,
            }
        })
        .collect()
}

/// Visits every way to fill the slots, those of one hue in order down the picture. A slot stays empty only where
/// its hue has too few candidates.
fn search(
    kept: &[Candidate],
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

fn score(kept: &[Candidate], assignment: &[Option<usize>]) -> f64 {
    let chosen: Vec<&Candidate> = assignment.iter().flatten().map(|i| &kept[*i]).collect();
    // of two halves of a track, before a gap and after it, the first: what follows it will be found again
    let presence: f64 = chosen.iter().map(|c| c.presence - c.lateness).sum();
    let stretch = chosen.windows(2).map(|w| length_spread(w[0], w[1])).fold(0.0, f64::max);
    let mean = chosen.iter().map(|c| c.ln_area).sum::<f64>() / chosen.len().max(1) as f64;
    let unlike = (chosen.iter().map(|c| (c.ln_area - mean).powi(2)).sum::<f64>() / chosen.len().max(1) as f64).sqrt();
    presence - 3.0 * stretch - 0.5 * unlike
}

/// Relative spread of the distance of two candidates over the frames that show both; 1 where there are none.
fn length_spread(a: &Candidate, b: &Candidate) -> f64 {
    let mut lengths: Vec<f64> = a
        .path
        .iter()
        .zip(&b.path)
        .filter_map(|(p, q)| {
            let (p, q) = (p.as_ref()?, q.as_ref()?);
            Some((p[0] - q[0]).hypot(p[1] - q[1]))
        })
        .collect();
    let Some(usual) = median(&mut lengths).filter(|l| *l > 0.0) else { return 1.0 };
    let mean_deviation = lengths.iter().map(|l| (l - usual).abs()).sum::<f64>() / lengths.len() as f64;
    (mean_deviation / usual).min(1.0)
}
