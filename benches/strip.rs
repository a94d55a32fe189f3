//! The strip: at rest far from straight, its modes, and what `freeswing force` does for one power.

use divan::{Bencher, black_box};
use freeswing::model::strip::load::{Dead, Free};
use freeswing::model::strip::{Mesh, Rest, Strip};

fn main() {
    divan::main();
}

/// Kapton 1 mil of the paper.
fn kapton() -> Strip {
    Strip::hung(0.2, 1.8034e-3, 1.706_985_8e-7, 9.80665)
}

#[divan::bench(args = [20, 40, 100])]
fn rest_under_its_weight_sideways(bencher: Bencher, elements: usize) {
    let strip = kapton().clamped();
    let mesh = Mesh::of(&strip, elements);
    let load = Dead { per_length_n_m: [0.0177, 0.0], ..Dead::default() };
    bencher.bench(|| Rest::of(black_box(&strip), &mesh, &load));
}

#[divan::bench(args = [20, 40, 100])]
fn modes(bencher: Bencher, elements: usize) {
    let strip = kapton();
    let rest = Rest::of(&strip, &Mesh::of(&strip, elements), &Free).expect("a strip hangs");
    bencher.bench(|| black_box(&rest).vibration());
}
