//! Blobs → marks: one global optimum a frame, with a gate.

use super::Sighting;
use super::follower::{Follower, GATE, MOST_AREA_COST, NEWCOMER_FRAMES};
use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// What it costs to leave a mark unseen: more than any sighting within its gate.
const MISS: f64 = GATE + MOST_AREA_COST;
/// What it costs to leave a newcomer that is no mark unseen.
const NEWCOMER_MISS: f64 = 6.0;
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
    before: Vec<Vec<Option<f64>>>,
}

/// Predicts every follower to `t_s` and assigns the sightings. The first `marks` rows are marks.
///
/// What is believed of a mark that is not seen spreads until every sighting is near, in its own standard deviations.
/// So a mark that is lost chooses among what those of its hue leave that are still in sight.
pub fn assign_frame(rows: &mut [&mut Follower], marks: usize, sightings: &[Sighting], t_s: f64) -> Assigned {
    for row in rows.iter_mut() {
        row.predict(t_s);
    }
    let young = |i: usize| i >= marks && rows[i].age < NEWCOMER_FRAMES;
    let in_sight = |hue: u8| rows[..marks].iter().any(|row| row.hue == hue && !row.was_lost());
    let lost = |i: usize| i < marks && rows[i].was_lost() && in_sight(rows[i].hue);
    let any_lost = (0..marks).any(lost);
    // what has stood still and is not seen there may be behind a mark
    let hidden = |i: usize| rows[i].stands() && !sightings.iter().any(|sighting| rows[i].is_at_its_place(sighting));
    let waits: Vec<bool> = (0..rows.len()).map(|i| any_lost && (young(i) || lost(i) || hidden(i))).collect();
    let before: Vec<Vec<Option<f64>>> =
        rows.iter().map(|row| sightings.iter().map(|s| row.cost(s)).collect()).collect();
    let mut columns: Vec<Option<usize>> = vec![None; rows.len()];
    for turn in [false, true] {
        let in_turn: Vec<usize> = (0..rows.len()).filter(|i| waits[*i] == turn).collect();
        let free: Vec<bool> = (0..sightings.len()).map(|column| !columns.contains(&Some(column))).collect();
        // a newcomer that is no mark gives way, which is written as a dearer sighting: the sum decides
        let cost = |i: usize, column: usize| {
            let handicap = if young(i) { MISS - NEWCOMER_MISS } else { 0.0 };
            before[i][column].filter(|_| free[column]).map(|cost| cost + handicap)
        };
        let costs: Vec<Vec<Option<f64>>> =
            in_turn.iter().map(|i| (0..sightings.len()).map(|column| cost(*i, column)).collect()).collect();
        for (i, column) in in_turn.into_iter().zip(assign(&costs, MISS)) {
            columns[i] = column;
        }
    }
    Assigned { columns, before }
}

impl Assigned {
    /// Marks that could have been exchanged with another of the same hue at hardly more cost.
    pub fn ambiguous(&self, marks: &[&mut Follower]) -> Vec<bool> {
        let mut ambiguous = vec![false; marks.len()];
        for i in 0..marks.len() {
            for j in i + 1..marks.len() {
                let (Some(a), Some(b)) = (self.columns[i], self.columns[j]) else { continue };
                let exchanged = self.before[i][b].zip(self.before[j][a]).map(|(ib, ja)| ib + ja);
                let kept = self.before[i][a].zip(self.before[j][b]).map(|(ia, jb)| ia + jb);
                // pairs of different hues have no cost
                if exchanged.zip(kept).is_some_and(|(exchanged, kept)| exchanged - kept < CLEAR_MARGIN) {
                    (ambiguous[i], ambiguous[j]) = (true, true);
                }
            }
        }
        ambiguous
    }

    /// Marks whose sighting could as well be another's of the same hue: the ambiguous ones, and those whose rival is
    /// out of sight.
    pub fn doubted(&self, marks: &[&mut Follower]) -> Vec<bool> {
        let mut doubted = self.ambiguous(marks);
        for (i, doubted) in doubted.iter_mut().enumerate() {
            let Some(column) = self.columns[i] else { continue };
            let rivals = || (0..marks.len()).filter(|j| *j != i && marks[*j].hue == marks[i].hue);
            let contested = rivals().filter(|j| self.columns[*j].is_none()).any(|j| self.explains(marks, j, i, column));
            let back_among_lost =
                marks[i].is_long_lost() && rivals().any(|j| self.columns[j].is_none() || marks[j].was_lost());
            *doubted |= contested || back_among_lost;
        }
        doubted
    }

    /// The sighting of mark `i` may as well be of the unseen mark `j`: −2 ln of the ratio of the likelihoods is small.
    fn explains(&self, marks: &[&mut Follower], j: usize, i: usize, column: usize) -> bool {
        let surprise = |row: usize| self.before[row][column].map(|cost| cost + marks[row].ln_spread());
        surprise(j).zip(surprise(i)).is_some_and(|(rival, own)| rival - own < CLEAR_MARGIN)
    }
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
