//! Whoever reads what a command writes may close the pipe early, as `head -1` does: the command ends quietly.

#[allow(dead_code, reason = "only a whole film is wanted of it")]
mod clips;

use std::process::{Command, Stdio};

use assert_cmd::cargo::CommandCargoExt;
use clips::Clip;

#[test]
fn a_reader_that_closes_its_end_is_no_failure() {
    let folder = tempfile::tempdir().unwrap();
    Clip::default().write(&folder.path().join("swing.mp4"));
    let config = "[specimen]\nlink_lengths_m = [0.1, 0.1]\nmass_kg = 0.01\nlength_m = 0.2\nwidth_m = 0.05\n";
    std::fs::write(folder.path().join("rig.toml"), config).unwrap();
    let run = |command: &[&str], closed: bool| {
        let mut child = Command::cargo_bin(command[0]).unwrap();
        child.current_dir(folder.path()).args(&command[1..]).stderr(Stdio::piped()).stdout(Stdio::piped());
        let mut child = child.spawn().unwrap();
        if closed {
            drop(child.stdout.take());
        }
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success() && !said.contains("error"), "{command:?} closed {closed}: {said}");
        output.stdout
    };
    std::fs::write(folder.path().join("angles.csv"), run(&["track", "swing.mp4", "--out", "-"], false)).unwrap();
    for command in [
        &["track", "swing.mp4", "--out", "-"][..],
        &["freeswing", "init", "swing.mp4", "--out", "-"],
        &["freeswing", "identify", "angles.csv"],
        &["freeswing", "identify", "angles.csv", "--json", "-"],
        &["freeswing", "modes", "--config", "rig.toml"],
        &["freeswing", "paper"],
    ] {
        assert!(!run(command, false).is_empty(), "{command:?} wrote nothing");
        run(command, true);
    }
}
