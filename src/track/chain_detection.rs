//! Which of the things that last hang together and swing, and in which order: the marks of a recording of which nothing is
//! known, or the best of several ways to see those that are known.

use super::TrackedObject;
use super::arc::Arc;
use super::choose::SAME_AREA;
use super::steadiness::ROUGH_PX;

/// Change of a distance over the motion beyond which two things are not on one link (judgement: a plane of swing turned by 45° out of
/// the picture gives 0.1 at an amplitude of 30°).
const MOST_STRETCH: f64 = 0.15;
/// Distance of a path from its circle, over half its range, beyond which it is no arc (judgement).
const MOST_OFF_ARC: f64 = 0.04;
/// ln of the ratio of areas beyond which two marks of one look are unlike (judgement: a factor e).
const MOST_UNLIKE: f64 = 1.0;
/// What a thing of the marks' look that swings, and is none, takes from a chain's worth (judgement).
const STRAY: f64 = 0.2;
/// Of two chains whose worths differ by less than half a stray, neither is the better (judgement).
pub const CHANCE: f64 = 0.5 * STRAY;
/// What a path that is hardly an arc takes from it, against one that is an arc exactly: of two looks that show as many
/// marks, the clearer one counts (judgement).
const BLURRED_ARC: f64 = 0.2;
/// Change of the distance from a still thing, over the motion, up to which it is the hinge though the arc's centre is
/// elsewhere on the line towards that centre: the plane of the swing is turned, and the arc an ellipse (judgement).
const HINGE_STRETCH: f64 = 0.1;
/// How many times as large as all of its parts together a thing is that they are parts of, and how far from its middle
/// they lie, in its radii (judgement).
const PARTS_TIMES: f64 = 2.0;
const PARTS_REACH: f64 = 1.1;
/// By how much of it their travel differs from its own at most (judgement).
const PARTS_TRAVEL: f64 = 0.2;
/// Motion of one thing against another, as a share of how far both move, below which they do not turn about each other (judgement).
pub const LEAST_TURN: f64 = 0.02;
/// The same in pixels: as much as their own errors, of which a roughly found place has a tenth or two (judgement).
const LEAST_TURN_PX: f64 = 0.3;
/// [`kurtosis`] of normally distributed noise (statistics).
const KURTOSIS_OF_NOISE: f64 = 3.0;
/// Part of its own radius by which a thing that is mostly at rest swings at least (judgement: what covers a thing at its edge shifts it by less).
const LEAST_TRAVEL: f64 = 0.25;
/// The same of what is never at rest: a part of its area that does not show at its size shifts it by so much.
const LEAST_SHIFT: f64 = SAME_AREA / (1.0 - SAME_AREA);
/// Correlation of two paths from which on one moves with the other (judgement: half).
const MOVES_WITH: f64 = 0.5;
/// What a chain whose first mark swings by less than its own radius is worth less: anything else that swings comes first (judgement).
pub const SLIGHT: f64 = 0.5;
/// Marks that are looked for at most (cost).
pub const MOST_MARKS: usize = 12;
/// Share of the frames in which a mark is seen, at least (judgement).
const LEAST_PRESENCE: f64 = 0.4;
/// How much farther a lower mark swings than an upper one, from which on that decides which is which (judgement).
const CLEARLY_FARTHER: f64 = 1.25;

/// The marks, from the hinge down.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    pub marks: Vec<usize>,
    pub arc: Option<Arc>,
    pub hinge_marked: bool,
    /// How clear it is: the marks that are seen, less what else of their look swings.
    pub worth: f64,
}

impl Chain {
    /// Its marks go as anything that swings does, more likely than not: spots of a texture that are taken for one thing do not.
    pub fn is_steady(&self, things: &[TrackedObject]) -> bool {
        let moving = || self.marks.iter().map(|i| &things[*i]).filter(|thing| thing.moves);
        moving().map(|thing| thing.steadiness).sum::<f64>() > 0.5 * moving().count() as f64
    }

    /// Whether a hung body may move so that does not swing steadily: a chain of links, or one link that turns over.
    pub fn may_tumble(&self, things: &[TrackedObject]) -> bool {
        let mut moving = self.marks.iter().map(|i| &things[*i]).filter(|thing| thing.moves);
        match (moving.next(), moving.next()) {
            (Some(only), None) => self.arc.is_some_and(|arc| arc.span_rad(&only.places_px()) > std::f64::consts::PI),
            (_, next) => next.is_some(),
        }
    }
}

/// The chains that the looks show, the best one first, and before it that which other looks add to.
pub fn chains(things: &[TrackedObject], names: &[String]) -> Vec<Chain> {
    let hued = |hue: u8| names[usize::from(hue)].starts_with('#');
    // what is darker or lighter on a thing of a hue, or of its own kind, is printed on it or shines on it
    let bears =
        |bearer: u8, hue: u8| !hued(hue) && (hued(bearer) || names[usize::from(bearer)] == names[usize::from(hue)]);
    let of_one = |hue: u8| {
        let is_part = |marks: &[usize]| are_parts(things, marks, &|bearer| bears(bearer.hue, hue));
        of_look(things, &|t| t.hue == hue, hued(hue), &is_part)
    };
    let mut chains: Vec<Chain> = (0..names.len() as u8).filter_map(of_one).collect();
    chains.sort_by(|a, b| b.worth.total_cmp(&a.worth));
    // marks of several colours: what swings with the chain and is like its marks
    let coloured = of_look(things, &|t| hued(t.hue), true, &|_| false);
    let wins = |c: &Chain| chains.first().is_some_and(|best| (c.marks.len(), c.worth) > (best.marks.len(), best.worth));
    if let Some(coloured) = coloured.filter(wins) {
        chains.insert(0, coloured);
    }
    chains
}

/// The best of them.
pub fn longest(things: &[TrackedObject], names: &[String]) -> Option<Chain> {
    chains(things, names).into_iter().next()
}

/// The chain that things of the marks' hues form.
pub fn of_hues(things: &[TrackedObject], belongs: &dyn Fn(&TrackedObject) -> bool) -> Option<Chain> {
    of_look(things, belongs, true, &|_| false)
}

fn of_look(
    things: &[TrackedObject],
    belongs: &dyn Fn(&TrackedObject) -> bool,
    hued: bool,
    is_part: &dyn Fn(&[usize]) -> bool,
) -> Option<Chain> {
    let mut movers: Vec<usize> = (0..things.len())
        .filter(|i| belongs(&things[*i]) && things[*i].moves && things[*i].presence > LEAST_PRESENCE)
        .collect();
    movers.sort_by(|a, b| things[*b].presence.total_cmp(&things[*a].presence));
    let movers = distinct(things, &movers);
    let crowd = movers.len();
    // every mover may be the one that the others are like; the largest set that hangs from something counts
    let sets = movers.iter().filter_map(|first| {
        let marks = without_shadows(things, without_covered(things, rigid_set(things, &movers, *first)));
        let [likely, by_picture] = orders(things, marks);
        let hung = match hangs(things, &likely) {
            Some(arc) => Some((likely, arc)),
            None => hangs_against(things, &by_picture).map(|arc| (by_picture, Some(arc))),
        };
        hung.filter(|(marks, _)| !is_part(marks))
    });
    // of two like ones that which swings farther
    let farthest_px = |marks: &[usize]| marks.iter().map(|i| things[*i].travel_px).fold(0.0, f64::max);
    let slight = |marks: &[usize]| if is_slight(&things[marks[0]]) { SLIGHT } else { 0.0 };
    let worth = |marks: &[usize]| value(things, marks) - slight(marks);
    let (mut marks, arc) =
        sets.max_by(|(a, _), (b, _)| worth(a).total_cmp(&worth(b)).then(farthest_px(a).total_cmp(&farthest_px(b))))?;
    let slight = slight(&marks);
    let mut hinge_marked = false;
    let blurred = arc.map_or(0.0, |arc| arc.residual_px / most_off_arc_px(&things[marks[0]]));
    if let Some(arc) = arc
        && let Some(hinge) = hinge(things, belongs, &arc, marks[0])
    {
        marks.insert(0, hinge);
        hinge_marked = true;
    }
    // a hue tells a mark from what is printed on it or shines on it
    let strays = crowd.saturating_sub(marks.len()) as f64;
    let hued = if hued { 0.5 } else { 0.0 };
    let worth = value(things, &marks) + hued - slight - STRAY * strays - BLURRED_ARC * blurred;
    Some(Chain { marks, arc, hinge_marked, worth })
}

/// All of them lie within the outline of one thing that is much larger, and move as it does: they are its shades, or its
/// edges.
fn are_parts(things: &[TrackedObject], marks: &[usize], bears: &dyn Fn(&TrackedObject) -> bool) -> bool {
    let area_px2: f64 = marks.iter().map(|i| things[*i].area_px2).sum();
    let holds = |whole: &TrackedObject, i: &usize| {
        let part = &things[*i];
        let lies_within = whole.distance_px(part).is_some_and(|d| d < PARTS_REACH * whole.radius_px());
        let moves_alike = (part.travel_px / whole.travel_px - 1.0).abs() < PARTS_TRAVEL;
        lies_within && moves_alike && part.stretch(whole) < MOST_STRETCH
    };
    let mut wholes = things.iter().filter(|t| t.moves && t.presence > LEAST_PRESENCE && bears(t));
    wholes.any(|whole| whole.area_px2 > PARTS_TIMES * area_px2 && marks.iter().all(|i| holds(whole, i)))
}

/// The circle on which the first mark swings; `Some(None)` where its path is so flat that it shows no centre. What
/// hangs from a fixed point has no other path.
fn hangs(things: &[TrackedObject], marks: &[usize]) -> Option<Option<Arc>> {
    let first = &things[*marks.first()?];
    let path = first.places_px();
    let most_px = most_off_arc_px(first);
    match Arc::of(&path, first.radius_px()) {
        Some(arc) => (arc.residual_px < most_px).then_some(Some(arc)),
        None => (off_line_px(&path) < most_px).then_some(None),
    }
}

/// How far a thing's path may lie off a circle; its places were looked at roughly.
fn most_off_arc_px(thing: &TrackedObject) -> f64 {
    ROUGH_PX.hypot(MOST_OFF_ARC * thing.travel_px)
}

/// The same of marks in the picture's order, of which an upper one swings farther: two links that swing in opposite phase, and so at one frequency.
fn hangs_against(things: &[TrackedObject], marks: &[usize]) -> Option<Arc> {
    let first = &things[*marks.first()?];
    let together = |i: &usize| things[*i].correlation(first).abs() > MOVES_WITH;
    hangs(things, marks)?.filter(|arc| shows_centre(arc, first) && marks.iter().all(together))
}

/// A still thing that something covers from time to time seems to move as well: by no more than its area changes for; or mostly in the middle of its way, where what
/// swings seldom is until it has decayed, by less than its radius, about no clear centre or about a point within itself, or by less than a quarter of its radius.
fn is_covered(thing: &TrackedObject) -> bool {
    let travel = thing.travel_px / thing.radius_px();
    if !thing.moves_whole || travel < LEAST_SHIFT {
        return true;
    }
    let path = thing.places_px();
    let shows = || Arc::of(&path, thing.radius_px()).is_some_and(|arc| shows_centre(&arc, thing));
    is_slight(thing) && kurtosis(&path) > KURTOSIS_OF_NOISE && (travel < LEAST_TRAVEL || !shows())
}

/// A thing's path shows where it hangs, and not within itself.
fn shows_centre(arc: &Arc, thing: &TrackedObject) -> bool {
    arc.sd_px[0].max(arc.sd_px[1]) < arc.radius_px && arc.radius_px > thing.radius_px()
}

/// The things without those that may only be covered now and then: all, where the one that moves farthest may be; otherwise those that do not move as that one does.
/// The upper mark of a strip moves little, but with the lower one.
fn without_covered(things: &[TrackedObject], mut marks: Vec<usize>) -> Vec<usize> {
    let farthest = marks.iter().copied().max_by(|a, b| things[*a].travel_px.total_cmp(&things[*b].travel_px));
    let Some(farthest) = farthest.map(|i| &things[i]).filter(|thing| !is_covered(thing)) else { return Vec::new() };
    let moves_with = |thing: &TrackedObject| thing.moves_whole && thing.correlation(farthest).abs() > MOVES_WITH;
    marks.retain(|i| !is_covered(&things[*i]) || moves_with(&things[*i]));
    marks
}

/// It moves by less than its own radius.
fn is_slight(thing: &TrackedObject) -> bool {
    thing.travel_px <= thing.radius_px()
}

/// Fourth moment along the longer axis over the square of the second: 1.5 of an even swing, up to 3 of one that falls to
/// an eighth, 3 of noise, more of what mostly rests.
fn kurtosis(points: &[[f64; 2]]) -> f64 {
    let n = points.len().max(1) as f64;
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let moment = |axis: usize, power: i32| points.iter().map(|p| (p[axis] - mean[axis]).powi(power)).sum::<f64>() / n;
    let axis = usize::from(moment(1, 2) > moment(0, 2));
    moment(axis, 4) / moment(axis, 2).powi(2).max(f64::MIN_POSITIVE)
}

/// It swings by itself as a mark does.
pub fn hangs_alone(thing: &TrackedObject) -> bool {
    thing.presence > LEAST_PRESENCE && !is_covered(thing) && hangs(std::slice::from_ref(thing), &[0]).is_some()
}

/// Root mean square distance of points from the straight line through them.
fn off_line_px(points: &[[f64; 2]]) -> f64 {
    let n = points.len().max(1) as f64;
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let moment = |i: usize, j: usize| points.iter().map(|p| (p[i] - mean[i]) * (p[j] - mean[j])).sum::<f64>() / n;
    let (xx, yy, xy) = (moment(0, 0), moment(1, 1), moment(0, 1));
    (0.5 * (xx + yy) - (0.25 * (xx - yy).powi(2) + xy * xy).sqrt()).max(0.0).sqrt()
}

/// More marks are better, seen in every frame, whose past foretells them.
fn value(things: &[TrackedObject], marks: &[usize]) -> f64 {
    marks.iter().map(|i| things[*i].presence * things[*i].steadiness).sum()
}

/// Of things in one place, such as one mark seen by two looks, the first. And of things that are hardly seen side by
/// side: one is the other, found again.
fn distinct(things: &[TrackedObject], movers: &[usize]) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    for i in movers {
        let width = things[*i].area_px2.sqrt();
        let doubled = |k: &usize| {
            let other = things[*k].area_px2.sqrt();
            !things[*i].is_seen_beside(&things[*k])
                || things[*i].distance_px(&things[*k]).is_none_or(|d| d < 0.6 * width.max(other))
        };
        if !kept.iter().any(doubled) {
            kept.push(*i);
        }
    }
    kept
}

/// The things that are like one of them, each keeping its distance from another.
fn rigid_set(things: &[TrackedObject], movers: &[usize], first: usize) -> Vec<usize> {
    let mut set = vec![first];
    let like = |i: usize| (things[i].area_px2 / things[first].area_px2).ln().abs() < MOST_UNLIKE;
    loop {
        let next = movers
            .iter()
            .copied()
            .filter(|i| !set.contains(i) && like(*i))
            .find(|i| set.iter().any(|k| things[*i].stretch(&things[*k]) < MOST_STRETCH));
        match next {
            Some(next) if set.len() < MOST_MARKS => set.push(next),
            _ => return set,
        }
    }
}

/// Of things that move as one and never turn about each other, such as a ball and its shadow, the one whose path is the
/// clearer: there is no link between them that has an angle.
fn without_shadows(things: &[TrackedObject], mut marks: Vec<usize>) -> Vec<usize> {
    let off_arc_px = |i: &usize| {
        let path = things[*i].places_px();
        Arc::of(&path, things[*i].radius_px()).map_or_else(|| off_line_px(&path), |arc| arc.residual_px)
    };
    marks.sort_by(|a, b| off_arc_px(a).total_cmp(&off_arc_px(b)));
    let mut kept: Vec<usize> = Vec::new();
    for i in marks {
        let turns = |k: &usize| {
            let (one, other) = (&things[i], &things[*k]);
            let against = one.moves_against(other);
            against > LEAST_TURN && against * one.travel_px.max(other.travel_px) > LEAST_TURN_PX
        };
        if kept.iter().all(turns) {
            kept.push(i);
        }
    }
    kept
}

/// From the hinge down, the likelier order first: what swings farther is lower, and what is lower in the picture where both swing alike; or by the picture alone, as links
/// that swing against each other may let the upper mark swing farther.
fn orders(things: &[TrackedObject], mut marks: Vec<usize>) -> [Vec<usize>; 2] {
    let lowest = |i: usize| {
        let mut y: Vec<f64> = things[i].path.iter().flatten().map(|p| p[1]).collect();
        y.sort_unstable_by(f64::total_cmp);
        y.get(y.len() * 19 / 20).copied().unwrap_or(0.0)
    };
    marks.sort_by(|a, b| lowest(*a).total_cmp(&lowest(*b)));
    let by_picture = marks.clone();
    // insertion, so that pairs that swing alike keep their order in the picture
    for i in 1..marks.len() {
        for k in (1..=i).rev() {
            if things[marks[k - 1]].travel_px > CLEARLY_FARTHER * things[marks[k]].travel_px {
                marks.swap(k - 1, k);
            }
        }
    }
    [marks, by_picture]
}

/// The still thing at the centre of the first mark's arc; or on the line to it, where most things like it that stand still are: of a patterned wall some always lie there.
fn hinge(things: &[TrackedObject], belongs: &dyn Fn(&TrackedObject) -> bool, arc: &Arc, first: usize) -> Option<usize> {
    let off = |i: &usize| arc.off_centre(things[*i].place_px());
    let middle = things[first].place_px();
    let is_on_line = |i: &usize| arc.is_on_line(things[*i].place_px(), middle);
    let stretch = |i: &usize| things[*i].stretch(&things[first]);
    let is_like = |i: &usize| {
        let thing = &things[*i];
        let still = thing.travel_px < 0.1 * things[first].travel_px;
        let like = (thing.area_px2 / things[first].area_px2).ln().abs() < MOST_UNLIKE;
        *i != first && belongs(thing) && thing.presence > LEAST_PRESENCE && still && like
    };
    let alike: Vec<usize> = (0..things.len()).filter(is_like).collect();
    let on_line = alike.iter().filter(|i| is_on_line(i)).count();
    let is_hinge = |i: &usize| {
        let by_line = 2 * on_line >= alike.len() && is_on_line(i) && stretch(i) < HINGE_STRETCH;
        stretch(i) < MOST_STRETCH && (off(i) < 1.0 || by_line)
    };
    alike.iter().copied().filter(is_hinge).min_by(|a, b| off(a).total_cmp(&off(b)))
}

#[cfg(test)]
mod tests {
    use super::super::steadiness::{STILL, steadiness};
    use super::*;

    fn thing(hue: u8, path: impl Fn(f64) -> [f64; 2], moves: bool) -> TrackedObject {
        let path: Vec<Option<[f64; 2]>> = (0..300).map(|i| Some(path(0.05 * f64::from(i)))).collect();
        let x: Vec<f64> = path.iter().flatten().map(|p| p[0]).collect();
        let travel_px = 0.5 * (x.iter().copied().fold(f64::MIN, f64::max) - x.iter().copied().fold(f64::MAX, f64::min));
        let steadiness = if moves { steadiness(&path) } else { STILL };
        TrackedObject { hue, presence: 1.0, area_px2: 300.0, travel_px, moves, moves_whole: moves, steadiness, path }
    }

    fn joint(t: f64) -> [f64; 2] {
        let theta: f64 = 0.4 * (3.0 * t).sin();
        [400.0 + 200.0 * theta.sin(), 50.0 + 200.0 * theta.cos()]
    }

    fn tip(t: f64) -> [f64; 2] {
        let theta: f64 = 0.5 * (3.0 * t).sin() + 0.1 * (8.0 * t).cos();
        [joint(t)[0] + 180.0 * theta.sin(), joint(t)[1] + 180.0 * theta.cos()]
    }

    #[test]
    fn the_chain_runs_from_the_hinge_down_and_leaves_the_knob() {
        let knob = thing(0, |_| [700.0, 90.0], false);
        let things = [thing(0, tip, true), knob, thing(0, joint, true), thing(0, |_| [400.0, 50.0], false)];
        let chain = longest(&things, &["#c01010".to_owned()]).unwrap();
        assert_eq!((chain.marks, chain.hinge_marked), (vec![3, 2, 0], true));
    }

    #[test]
    fn of_a_patterned_wall_no_thing_is_the_hinge_because_it_lies_on_the_line() {
        let pattern = |k: usize| {
            let place = [40.0 + 90.0 * (k % 9) as f64, 110.0 + 45.0 * (k / 9) as f64];
            thing(0, move |_| place, false)
        };
        let mut things: Vec<TrackedObject> = (0..18).map(pattern).collect();
        things.push(thing(0, joint, true));
        let chain = longest(&things, &["#c01010".to_owned()]).unwrap();
        assert_eq!((chain.marks, chain.hinge_marked), (vec![18], false));
    }

    #[test]
    fn one_thing_that_goes_round_may_tumble_and_one_that_walks_past_may_not() {
        let names = ["#c01010".to_owned()];
        let round = |t: f64| [400.0 + 150.0 * (1.3 * t).sin(), 300.0 + 150.0 * (1.3 * t).cos()];
        let things = [thing(0, round, true)];
        assert!(longest(&things, &names).unwrap().may_tumble(&things));
        let walks = |t: f64| [40.0 + 50.0 * t, 200.0 + 0.02 * t * t];
        let things = [thing(0, walks, true)];
        assert!(longest(&things, &names).is_none_or(|chain| !chain.may_tumble(&things)));
        let both = [thing(0, tip, true), thing(0, joint, true)];
        assert!(longest(&both, &names).unwrap().may_tumble(&both));
    }

    #[test]
    fn marks_of_two_colours_make_one_chain_and_an_unmarked_hinge_is_the_centre() {
        let things = [thing(0, tip, true), thing(1, joint, true)];
        let chain = longest(&things, &["#c01010".to_owned(), "#10c010".to_owned()]).unwrap();
        assert_eq!((chain.marks.clone(), chain.hinge_marked), (vec![1, 0], false));
        let centre = chain.arc.unwrap().centre_px;
        assert!((centre[0] - 400.0).abs() < 0.1 && (centre[1] - 50.0).abs() < 0.1, "{centre:?}");
    }

    #[test]
    fn two_spots_that_keep_their_distance_but_swing_about_nothing_are_no_chain() {
        let jumps = |t: f64| (7.0 * (13.0 * t).sin() * (3.0 * t).cos(), 6.0 * (29.0 * t).sin());
        let things = [
            thing(0, |t| [390.0 + jumps(t).0, 420.0 + jumps(t).1], true),
            thing(0, |t| [810.0 + jumps(t).0, 520.0 + jumps(t).1], true),
        ];
        assert!(longest(&things, &["#c0b090".to_owned()]).is_none());
    }

    #[test]
    fn a_single_thing_that_shifts_within_its_own_outline_about_no_clear_centre_is_no_mark() {
        let names = ["dark".to_owned()];
        let rocks = |size_px: f64| {
            let path = move |t: f64| [90.0 + size_px * (3.0 * t).sin(), 190.0 + 0.003 * (9.0 * t).cos()];
            longest(&[thing(0, path, true)], &names)
        };
        // an area of 300 px² has a radius of 9.8 px
        assert!(rocks(1.0).is_none());
        assert!(rocks(2.0).is_some() && rocks(4.0).is_some(), "an even swing of less than its radius");
        for size_px in [2.0, 4.0] {
            let covered = |t: f64| [90.0 + size_px * (3.0 * t).sin().powi(9), 190.0 + 0.003 * (9.0 * t).cos()];
            assert!(longest(&[thing(0, covered, true)], &names).is_none(), "mostly at rest");
        }
        let swings = |t: f64| {
            let theta: f64 = 0.2 * (3.0 * t).sin();
            [400.0 + 40.0 * theta.sin(), 50.0 + 40.0 * theta.cos()]
        };
        assert!(longest(&[thing(0, swings, true)], &names).is_some());
    }

    #[test]
    fn still_things_that_are_covered_at_their_edges_are_no_chain() {
        let names = ["#c83424".to_owned()];
        // something passes before each once in a swing
        let covered = |x: f64, by_px: f64| move |t: f64| [x + by_px * (3.0 * t + x).sin().powi(9), 190.0 + 0.4 * x];
        let chain = |by_px: f64| {
            let things: Vec<TrackedObject> =
                [100.0, 240.0, 410.0].iter().map(|x| thing(0, covered(*x, by_px), true)).collect();
            longest(&things, &names)
        };
        // of a radius of 9.8 px
        assert!(chain(1.0).is_none() && chain(4.0).is_none());
    }

    #[test]
    fn an_upper_mark_that_has_moved_little_and_come_to_rest_stays_in_its_chain() {
        let upper = |t: f64| {
            let theta: f64 = 0.025 * (-0.2 * t).exp() * (3.0 * t).sin();
            [400.0 + 200.0 * theta.sin(), 50.0 + 200.0 * theta.cos()]
        };
        let lower = move |t: f64| {
            let theta: f64 = 0.3 * (-0.2 * t).exp() * (3.0 * t).sin();
            [upper(t)[0] + 180.0 * theta.sin(), upper(t)[1] + 180.0 * theta.cos()]
        };
        let things = [thing(0, lower, true), thing(0, upper, true)];
        assert!(is_covered(&things[1]), "by itself it might be a thing that is covered");
        assert_eq!(longest(&things, &["#c83424".to_owned()]).unwrap().marks, [1, 0]);
    }

    #[test]
    fn an_upper_mark_may_swing_farther_than_the_one_below_it() {
        // links that swing against each other
        let lower = |t: f64| {
            let theta: f64 = -0.56 * (3.0 * t).sin();
            [joint(t)[0] + 220.0 * theta.sin(), joint(t)[1] + 220.0 * theta.cos()]
        };
        let things = [thing(0, lower, true), thing(0, joint, true)];
        assert!(things[1].travel_px > CLEARLY_FARTHER * things[0].travel_px);
        assert_eq!(longest(&things, &["#c83424".to_owned()]).unwrap().marks, [1, 0]);
    }

    #[test]
    fn spots_at_the_edge_of_a_swinging_ball_are_parts_of_it() {
        let beside = |dx: f64, dy: f64| {
            move |t: f64| {
                let (sin, cos) = (0.4 * (3.0 * t).sin()).sin_cos();
                [joint(t)[0] + dx * cos + dy * sin, joint(t)[1] + dy * cos - dx * sin]
            }
        };
        let mut things = vec![TrackedObject { area_px2: 2900.0, ..thing(0, joint, true) }];
        for (dx, dy) in [(26.0, 0.0), (-26.0, 0.0), (0.0, 26.0), (0.0, -26.0)] {
            things.push(TrackedObject { area_px2: 200.0, ..thing(1, beside(dx, dy), true) });
        }
        let names = |ball: &str| [ball.to_owned(), "dark".to_owned()];
        assert_eq!(longest(&things, &names("dark")).unwrap().marks, [0]);
        assert_eq!(longest(&things, &names("#20a040")).unwrap().marks, [0]);
        // a wall behind them does not move as they do
        things[0] = TrackedObject { area_px2: 2900.0, ..thing(0, |t| [joint(0.3 * t)[0], 240.0], true) };
        assert_eq!(longest(&things, &names("#d0c0a0")).unwrap().marks.len(), 4);
        // dark marks on a light plate are marks
        things[0] = TrackedObject { area_px2: 2900.0, ..thing(0, joint, true) };
        assert_eq!(longest(&things, &names("light")).unwrap().marks.len(), 4);
    }

    #[test]
    fn one_mark_followed_in_two_pieces_is_not_two_marks() {
        let mut pieces = [thing(1, tip, true), thing(1, tip, true)];
        for i in 0..300 {
            if i < 140 {
                pieces[0].path[i] = None
            } else if i >= 150 {
                pieces[1].path[i] = None
            }
        }
        // while both are seen, one of them is its gloss
        pieces[1].path[140..150].iter_mut().flatten().for_each(|p| p[0] += 30.0);
        pieces[0].presence = 0.53;
        pieces[1].presence = 0.5;
        let [first, second] = pieces;
        let things = [thing(1, joint, true), first, second, thing(0, joint, true), thing(0, tip, true)];
        let chain = longest(&things, &["#c01010".to_owned(), "light".to_owned()]).unwrap();
        assert_eq!(chain.marks, [3, 4]);
    }

    #[test]
    fn the_shadow_of_a_ball_is_no_joint() {
        let shadow = |t: f64| [joint(t)[0] + 80.0 + 0.3 * (50.0 * t).sin(), joint(t)[1] + 50.0];
        let names = ["dark".to_owned()];
        let things = [thing(0, shadow, true), thing(0, joint, true)];
        assert_eq!(longest(&things, &names).unwrap().marks, [1]);
    }

    #[test]
    fn a_ball_that_goes_up_and_down_on_a_straight_line_is_a_mark() {
        let bounces = thing(0, |t| [400.0, 300.0 + 50.0 * (4.0 * t).sin()], true);
        let bounces = TrackedObject { travel_px: 50.0, ..bounces };
        assert_eq!(longest(&[bounces], &["#20a040".to_owned()]).unwrap().arc, None);
    }

    #[test]
    fn of_two_like_pendulums_the_one_that_swings_farther_is_followed() {
        let other = |t: f64| {
            [700.0 + 60.0 * (3.3 * t).sin(), 60.0 + (200f64.powi(2) - (60.0 * (3.3 * t).sin()).powi(2)).sqrt()]
        };
        for turned in [false, true] {
            let mut things = vec![thing(0, joint, true), thing(0, other, true)];
            if turned {
                things.reverse()
            }
            let chain = longest(&things, &["#20a040".to_owned()]).unwrap();
            assert_eq!(chain.marks, [usize::from(turned)]);
        }
    }

    #[test]
    fn what_only_drifts_is_no_mark() {
        let things = [thing(0, |t| [100.0 + 7.0 * (t * 1.7).sin() * t, 80.0 + 60.0 * (t * 2.9).cos()], true)];
        assert!(longest(&things, &["dark".to_owned()]).is_none());
    }
}
