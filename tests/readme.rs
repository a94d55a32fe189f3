//! The README's examples run as they stand. Blocks marked `sh` are run, those marked `shell` are not.

use std::path::{Path, PathBuf};
use std::process::Command;

use assert_cmd::cargo::cargo_bin;

fn examples(text: &str) -> impl Iterator<Item = &str> {
    text.split("```sh\n").skip(1).filter_map(|after| after.split("```").next())
}

#[test]
fn every_example_runs() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    for name in ["videos", "fixtures"] {
        std::os::unix::fs::symlink(root.join(name), folder.path().join(name)).unwrap();
    }
    let binaries = cargo_bin("track").parent().map(PathBuf::from).unwrap();
    let path = format!("{}:{}", binaries.display(), std::env::var("PATH").unwrap());
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let mut count = 0;
    for example in examples(&readme) {
        let mut shell = Command::new("sh");
        shell.current_dir(folder.path()).env("PATH", &path).args(["-e", "-c", example]);
        let output = shell.output().unwrap();
        assert!(output.status.success(), "{example}{}", String::from_utf8_lossy(&output.stderr));
        count += 1;
    }
    assert!(count >= 3, "only {count} examples are marked sh");
    let header = "frame,t_s,m1_x_px,m1_y_px,m2_x_px,m2_y_px,m3_x_px,m3_y_px,theta1_rad,theta2_rad";
    for (table, frames) in [("angles.csv", 750), ("smooth.csv", 750), ("small.csv", 30)] {
        let text = std::fs::read_to_string(folder.path().join(table)).unwrap();
        assert!(text.starts_with(header) && text.lines().count() == frames + 1, "{table}");
    }
}

#[test]
fn the_readme_names_no_missing_file() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let links = readme.split("](").skip(1).filter_map(|after| after.split(')').next());
    for link in links.filter(|l| !l.starts_with("http") && *l != "docs/overlay.png") {
        assert!(root.join(link).exists(), "{link}");
    }
}
