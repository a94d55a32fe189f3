//! What stands still: the median of pictures spread over a recording, in which a mark that moves is elsewhere.

use std::ops::Range;

use crate::video::OwnedPicture;

/// Pictures below which a mark may be at one place in half of them.
const LEAST_PICTURES: usize = 5;
/// Samples of a plane whose medians are found together.
const STRETCH: usize = 4096;

/// The median of pictures of one size; of an even number of pictures the upper one of the two in the middle. `None` of too few.
pub fn scene(pictures: &[OwnedPicture]) -> Option<OwnedPicture> {
    let layout = pictures.first()?.layout;
    if pictures.len() < LEAST_PICTURES || pictures.iter().any(|picture| picture.layout != layout) {
        return None;
    }
    let planes = [0, 1, 2].map(|plane| {
        let planes: Vec<&[u8]> = pictures.iter().map(|picture| picture.planes[plane].as_slice()).collect();
        if layout.bits > 8 { median_plane_of_words(&planes) } else { median_plane(&planes) }
    });
    Some(OwnedPicture { layout, planes })
}

/// The median over planes of every sample.
pub(super) fn median_plane(planes: &[&[u8]]) -> Vec<u8> {
    let length = planes.first().map_or(0, |plane| plane.len());
    (0..length).step_by(STRETCH).flat_map(|at| medians(planes, at..(at + STRETCH).min(length))).collect()
}

/// The same of samples of two bytes.
fn median_plane_of_words(planes: &[&[u8]]) -> Vec<u8> {
    let length = planes.first().map_or(0, |plane| plane.len());
    let median = |at: usize| {
        let mut words: Vec<[u8; 2]> = planes.iter().map(|plane| [plane[at], plane[at + 1]]).collect();
        words.sort_unstable_by_key(|word| u16::from_le_bytes(*word));
        words[words.len() / 2]
    };
    (0..length).step_by(2).flat_map(median).collect()
}

/// The median over the planes of every sample in a range.
fn medians(planes: &[&[u8]], range: Range<usize>) -> Vec<u8> {
    let mut sorted: Vec<Vec<u8>> = planes.iter().map(|plane| plane[range.clone()].to_vec()).collect();
    // sorted by exchanging neighbours, all samples at once: plain loops over bytes, which the compiler turns into vector instructions
    for last in (1..sorted.len()).rev() {
        for at in 0..last {
            let (lower, upper) = sorted.split_at_mut(at + 1);
            for (a, b) in lower[at].iter_mut().zip(&mut upper[0]) {
                (*a, *b) = ((*a).min(*b), (*a).max(*b));
            }
        }
    }
    sorted.swap_remove(planes.len() / 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::video::Layout;

    #[test]
    fn what_passes_is_not_in_the_scene_with_one_byte_or_two() {
        for bits in [8, 10] {
            let layout = Layout::subsampled(40, 4, bits);
            let picture = |n: usize| {
                let mut picture = OwnedPicture::black(layout);
                for at in 0..160 {
                    let passes = (8 * n..8 * n + 8).contains(&(at % 40));
                    picture.set(0, at, if passes { 235 } else { 20 + (at % 40) as u16 } << (bits - 8));
                }
                picture
            };
            let pictures: Vec<OwnedPicture> = (0..5).map(picture).collect();
            let still = scene(&pictures).unwrap();
            let view = still.view();
            assert!((0..40).all(|x| view.luma.code(view.wide(), x, 2) == (20 + x as u16) << (bits - 8)), "{bits}");
            assert!(scene(&pictures[..4]).is_none());
        }
    }
}
