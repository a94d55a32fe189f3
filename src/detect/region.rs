//! Where a picture may hold a mark: rectangles of chroma samples, found by a coarse scan.

use super::component::{BLOCK, HueAxis};
use crate::video::Picture;

/// Chroma rows of one block of the scan.
const BLOCK_ROWS: usize = 16;
/// Only every second chroma row is scanned: a mark is taller than that.
const SCAN_STEP: usize = 2;

/// Samples around a hit block, or around what is above the threshold: a mark that ends in the next block is whole, and mending its outline does not meet
/// the region's edge.
pub(super) const MARGIN: usize = 6;

/// A rectangle of chroma samples: left, top, right, bottom (exclusive).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Region {
    pub left: usize,
    pub top: usize,
    pub right: usize,
    pub bottom: usize,
}

/// Rectangles around everything that the scan hits, none touching another.
pub(super) fn regions(picture: &Picture<'_>, axis: HueAxis, threshold: i16) -> Vec<Region> {
    let (width, height) = picture.layout.chroma_size();
    let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK_ROWS));
    let mut hit = vec![false; columns * rows];
    for y in (0..height).step_by(SCAN_STEP) {
        axis.mark_hits(picture, y, threshold, &mut hit[y / BLOCK_ROWS * columns..][..columns]);
    }
    let mut regions: Vec<Region> = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            if hit[row * columns + column] {
                let grown = Region {
                    left: (column * BLOCK).saturating_sub(MARGIN),
                    top: (row * BLOCK_ROWS).saturating_sub(MARGIN),
                    right: ((column + 1) * BLOCK + MARGIN).min(width),
                    bottom: ((row + 1) * BLOCK_ROWS + MARGIN).min(height),
                };
                merge(&mut regions, grown);
            }
        }
    }
    regions
}

/// Adds a rectangle, uniting it with every one it touches.
fn merge(regions: &mut Vec<Region>, mut region: Region) {
    while let Some(i) = regions.iter().position(|r| {
        r.left <= region.right && region.left <= r.right && r.top <= region.bottom && region.top <= r.bottom
    }) {
        let other = regions.swap_remove(i);
        region = Region {
            left: region.left.min(other.left),
            top: region.top.min(other.top),
            right: region.right.max(other.right),
            bottom: region.bottom.max(other.bottom),
        };
    }
    regions.push(region);
}
