//! `freeswing render` as a user types it.

use std::path::Path;

use assert_cmd::Command;
use predicates::prelude::*;

fn render(folder: &Path, config: &str, more: &[&str]) -> assert_cmd::assert::Assert {
    Command::cargo_bin("freeswing")
        .unwrap()
        .current_dir(folder)
        .args(["render", "--config", config])
        .args(more)
        .assert()
}

fn folder_with_config(text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("small.toml"), text).unwrap();
    folder
}

const SMALL: &str = include_str!("../fixtures/render/small.toml");

#[test]
fn a_video_and_its_truth_are_made_without_a_word() {
    let folder = folder_with_config(SMALL);
    let more = ["--out", "a.mp4", "--truth", "a.csv", "--frames", "6", "--seed", "9"];
    render(folder.path(), "small.toml", &more).success().stdout("").stderr("");
    let truth = std::fs::read_to_string(folder.path().join("a.csv")).unwrap();
    let header = "frame,t_s,m1_x_px,m1_y_px,m2_x_px,m2_y_px,m3_x_px,m3_y_px,theta1_rad,theta2_rad\n";
    assert!(truth.starts_with(header) && truth.lines().count() == 7, "{truth}");
    assert!(std::fs::metadata(folder.path().join("a.mp4")).unwrap().len() > 1000);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
}

#[test]
fn bad_input_is_one_line_and_exit_2() {
    let folder = folder_with_config(SMALL);
    std::fs::write(folder.path().join("typo.toml"), "[render]\nwidht_px = 64\n").unwrap();
    let one_line = |text: &'static str| predicate::str::contains(text).and(predicate::str::contains("\n").count(1));
    let cases: [(&str, &[&str], &'static str); 7] = [
        ("none.toml", &["--out", "a.mp4"], "none.toml: cannot be read"),
        ("typo.toml", &["--out", "a.mp4"], "unknown key `widht_px`; the nearest known one is `width_px`"),
        ("small.toml", &["--out", "a.wmv"], "unknown extension .wmv; use .mp4, .mov, .mkv or .avi"),
        ("small.toml", &["--out", "missing/a.mp4"], "missing/a.mp4: cannot be written"),
        ("small.toml", &["--out", "a.mp4", "--truth", "missing/a.csv"], "missing/a.csv: cannot be written"),
        ("small.toml", &["--out", "a.mp4", "--frames", "0"], "render.duration_s = 0: not one frame"),
        (
            "small.toml",
            &["--out", "a.mp4", "--truth", "a.mp4"],
            "--truth: a.mp4 is what --out writes and would be overwritten",
        ),
    ];
    for (config, more, text) in cases {
        render(folder.path(), config, more).code(2).stdout("").stderr(one_line(text));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "{text}");
    }
}
