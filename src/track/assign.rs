//! Blobs → marks: one global optimum a frame, with a gate.

use super::Sighting;
use super::follower::{Follower, GATE, MOST_AREA_COST};
use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// What it costs to leave a mark unseen: more than any sighting within its gate.
const MISS: f64 = GATE + MOST_AREA_COST;
/// What it costs to leave a newcomer that is no mark unseen.
const YOUNG_MISS: f64 = 6.0;
/// Frames beside all marks of its hue after which something that is no mark counts as furniture. Beside them, for a
/// newcomer that appears while a mark is missed may be that mark.
const YOUNG_FRAMES: u32 = 30;
/// Marks are in doubt where an exchange would cost less than this.
const CLEAR_MARGIN: f64 = 6.0;
/// Cost units in an integer of the assignment.
const RESOLUTION: f64 = 1e4;
/// Costs above this are the same: out of the question.
const IMPOSSIBLE: i64 = 1 << 50;

/// The assignment of rows to columns with the least total cost; a row stays without a column where that costs
/// `miss` or more. `costs[row][column]` is `None` where the pair is out of the gate.
pub fn assign(costs: &[Vec<Option<f64>>], miss: f64) -> Vec<Option<usize>> {
    let rows = costs.len();
    let columns = costs.first().map_or(0, Vec::len);
    if rows == 0 {
        return Vec::new();
    }
    // every row has a column of its own that stands for "not seen"
    let matrix = Matrix::from_fn(rows, columns + rows, |(row, column)| match costs[row].get(column) {
        Some(Some(cost)) => (cost * RESOLUTION) as i64,
        Some(None) => IMPOSSIBLE,
        None if column - columns == row => (miss * RESOLUTION) as i64,
        None => IMPOSSIBLE,
    });
    let (_, chosen) = kuhn_munkres_min(&matrix);
    chosen.into_iter().map(|column| (column < columns).then_some(column)).collect()
}

/// The sightings of a frame, assigned.
pub struct Assigned {
    /// The sighting of every row.
    pub columns: Vec<Option<usize>>,
    /// Cost of every pair before the update.
    pub before: Vec<Vec<Option<f64>>>,
}

/// Predicts every follower to `t_s` and assigns the sightings. The first `marks` rows are marks.
pub fn assign_frame(rows: &mut [&mut Follower], marks: usize, sightings: &[Sighting], t_s: f64) -> Assigned {
    for row in rows.iter_mut() {
        row.predict(t_s);
    }
    let before: Vec<Vec<Option<f64>>> =
        rows.iter().map(|row| sightings.iter().map(|s| row.cost(s)).collect()).collect();
    // a newcomer that is no mark gives way, which is written as a dearer sighting: the sum decides
    let costs: Vec<Vec<Option<f64>>> = before
        .iter()
        .enumerate()
        .map(|(i, row)| {
            let handicap = if i < marks || rows[i].age >= YOUNG_FRAMES { 0.0 } else { MISS - YOUNG_MISS };
            row.iter().map(|c| c.map(|c| c + handicap)).collect()
        })
        .collect();
    Assigned { columns: assign(&costs, MISS), before }
}

/// Marks that could have been exchanged with another of the same hue at hardly more cost.
pub fn ambiguous_rows(
    marks: &[&mut Follower],
    sightings: &[Sighting],
    costs: &[Vec<Option<f64>>],
    columns: &[Option<usize>],
) -> Vec<bool> {
    let mut ambiguous = vec![false; marks.len()];
    for i in 0..marks.len() {
        for j in i + 1..marks.len() {
            let (Some(a), Some(b)) = (columns[i], columns[j]) else { continue };
            if sightings[a].hue != sightings[b].hue {
                continue;
            }
            let (Some(ia), Some(jb), Some(ib), Some(ja)) = (costs[i][a], costs[j][b], costs[i][b], costs[j][a]) else {
                continue;
            };
            if ib + ja - ia - jb < CLEAR_MARGIN {
                ambiguous[i] = true;
                ambiguous[j] = true;
            }
        }
    }
    ambiguous
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_total_is_least_not_each_ones_own() {
        // greedily row 0 would take column 0 and leave row 1 with 100
        let costs = vec![vec![Some(1.0), Some(2.0)], vec![Some(1.5), Some(100.0)]];
        assert_eq!(assign(&costs, 50.0), [Some(1), Some(0)]);
    }

    #[test]
    fn a_pair_outside_the_gate_is_missed() {
        assert_eq!(assign(&[vec![None], vec![Some(3.0)]], 9.0), [None, Some(0)]);
        assert_eq!(assign(&[vec![Some(20.0)]], 9.0), [None]);
        assert_eq!(assign(&[vec![], vec![]], 9.0), [None, None]);
    }
}
