//! Erosion and dilation over 3×3 samples. What lies beyond the edge does not count.

/// Erodes `times` times: what is narrower than 2 · `times` + 1 samples goes.
pub fn erode<T: Copy + Ord>(samples: &mut [T], width: usize, times: usize) {
    (0..times).for_each(|_| slide(samples, width, T::min));
}

/// Dilates `times` times: a gap narrower than 2 · `times` + 1 samples closes.
pub fn dilate<T: Copy + Ord>(samples: &mut [T], width: usize, times: usize) {
    (0..times).for_each(|_| slide(samples, width, T::max));
}

/// Replaces every sample by the extreme of its 3×3 neighbourhood.
fn slide<T: Copy>(samples: &mut [T], width: usize, extreme: impl Fn(T, T) -> T) {
    if width == 0 || samples.is_empty() {
        return;
    }
    // plain loops over slices, along the row and then down, which the compiler turns into vector instructions
    let mut across = samples.to_vec();
    for (out, row) in across.chunks_exact_mut(width).zip(samples.chunks_exact(width)) {
        for (out, right) in out.iter_mut().zip(&row[1..]) {
            *out = extreme(*out, *right);
        }
        for (out, left) in out[1..].iter_mut().zip(row) {
            *out = extreme(*out, *left);
        }
    }
    samples.copy_from_slice(&across);
    let rows = samples.len() / width;
    for y in 0..rows {
        let out = &mut samples[y * width..(y + 1) * width];
        for neighbour in [y.checked_sub(1), Some(y + 1).filter(|y| *y < rows)].into_iter().flatten() {
            let beside = &across[neighbour * width..(neighbour + 1) * width];
            for (out, other) in out.iter_mut().zip(beside) {
                *out = extreme(*out, *other);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[rustfmt::skip]
    const LINE_AND_SQUARE: [u8; 35] = [
        0, 1, 0, 0, 0, 0, 0,
        0, 1, 0, 1, 1, 1, 0,
        0, 1, 0, 1, 1, 1, 0,
        0, 1, 0, 1, 1, 1, 0,
        0, 1, 0, 0, 0, 0, 0,
    ];

    #[test]
    fn opening_takes_a_line_and_leaves_a_square() {
        let mut samples = LINE_AND_SQUARE;
        erode(&mut samples, 7, 1);
        dilate(&mut samples, 7, 1);
        #[rustfmt::skip]
        assert_eq!(samples, [
            0, 0, 0, 0, 0, 0, 0,
            0, 0, 0, 1, 1, 1, 0,
            0, 0, 0, 1, 1, 1, 0,
            0, 0, 0, 1, 1, 1, 0,
            0, 0, 0, 0, 0, 0, 0,
        ]);
    }

    #[test]
    fn beyond_the_edge_nothing_counts() {
        let mut full = [5i16; 6];
        erode(&mut full, 3, 2);
        dilate(&mut full, 3, 2);
        assert_eq!(full, [5; 6]);
        let mut corner = [7, 0, 0, 0, 0, 0];
        dilate(&mut corner, 3, 1);
        assert_eq!(corner, [7, 7, 0, 7, 7, 0]);
    }
}
