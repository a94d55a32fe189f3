//! The seconds of one fit of a table, without the program's start and the reading of files: `cargo bench --bench fit -- ANGLES CONFIG`.
//! Prints one line of JSON, the median of seven. Free are K, C and the hinge's viscous damper, as in `scipy_fit.py`; see `fit.sh`.

use std::path::Path;
use std::time::Instant;

use freeswing::experiment::Experiment;
use freeswing::fit::{Record, fit};
use freeswing::model::Parameter;
use freeswing::series::AngleSeries;

const FREE: [Parameter; 3] = [Parameter::JointStiffness, Parameter::JointDamping, Parameter::HingeViscous];

fn main() {
    let files: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let [angles, config] = &files[..] else {
        println!("skipped: give a table of angles and an experiment file, as benches/fit.sh does");
        return;
    };
    let experiment = Experiment::read(Path::new(config)).expect("the experiment");
    let record = Record::of(&AngleSeries::read(Path::new(angles)).expect("the table"), 2).expect("two angles");
    let mut seconds: Vec<f64> = (0..7)
        .map(|_| {
            let begun = Instant::now();
            let fit = fit(std::slice::from_ref(&record), &experiment, &FREE).expect("a fit");
            assert_eq!(fit.estimates.len(), FREE.len());
            begun.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    println!("{{\"seconds\": {:.4}}}", seconds[3]);
}
