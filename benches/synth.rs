//! How fast frames are rendered: 1280×720, the default camera, the swing at its fastest.

use freeswing::experiment::Experiment;
use freeswing::synth::Recording;

fn main() {
    divan::main();
}

#[divan::bench]
fn one_frame_on_one_core(bencher: divan::Bencher) {
    let mut experiment = Experiment::default();
    experiment.render.duration_s = 2.0;
    let recording = Recording::of(&experiment).expect("the default experiment renders");
    let mut next = 0;
    bencher.bench_local(|| {
        next = (next + 1) % recording.len();
        recording.frame(next)
    });
}

#[divan::bench(sample_count = 10)]
fn sixty_frames_on_all_cores(bencher: divan::Bencher) {
    let mut experiment = Experiment::default();
    experiment.render.duration_s = 2.0;
    let recording = Recording::of(&experiment).expect("the default experiment renders");
    bencher.bench_local(|| recording.frames().count());
}
