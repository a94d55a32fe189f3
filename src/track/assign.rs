//! Blobs → marks: one global optimum a frame, with a gate.

use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

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
