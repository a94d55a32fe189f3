//! Marks as laboratories have them, and what is said of what is none: the commands as a user types them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use assert_cmd::cargo::CommandCargoExt;
use freeswing::experiment::{Experiment, Rgb};
use freeswing::synth::Recording;
use tempfile::TempDir;

fn scene() -> Experiment {
    let text = include_str!("../fixtures/render/small.toml");
    let mut experiment = Experiment::parse(text, Path::new("small.toml")).unwrap();
    experiment.render.duration_s = 4.0;
    experiment.render.codec.gop = 24;
    experiment
}

/// A folder with one recording.
struct Bench {
    folder: TempDir,
}

impl Bench {
    fn of(experiment: &Experiment) -> Self {
        let folder = tempfile::tempdir().unwrap();
        Recording::of(experiment).unwrap().write(&folder.path().join("swing.mp4"), None, &mut |_| Ok(())).unwrap();
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn freeswing(&self, arguments: &[&str]) -> Output {
        let mut command = Command::cargo_bin("freeswing").unwrap();
        command.current_dir(self.folder.path()).args(arguments).output().unwrap()
    }

    fn track(&self, more: &[&str]) -> Output {
        self.freeswing(&[&["track", "swing.mp4", "--out", "angles.csv"], more].concat())
    }

    /// The recording coded anew by `ffmpeg`, through a filter.
    fn refilmed(&self, filter: &str, crf: &str) {
        let made = Command::new("ffmpeg")
            .args(["-loglevel", "error", "-y", "-i", "swing.mp4", "-vf", filter])
            .args(["-c:v", "libx264", "-crf", crf, "again.mp4"])
            .current_dir(self.folder.path())
            .status();
        assert!(made.unwrap().success());
        std::fs::rename(self.path("again.mp4"), self.path("swing.mp4")).unwrap();
    }

    fn table(&self) -> String {
        std::fs::read_to_string(self.path("angles.csv")).unwrap()
    }
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn done(output: &Output) -> String {
    assert!(output.status.success(), "{}", said(output));
    said(output)
}

fn refused(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(2), "{}", said(output));
    assert_eq!(said(output).trim().lines().count(), 1, "{}", said(output));
    said(output)
}

/// A column of a table, empty fields left out.
fn column(table: &str, name: &str) -> Vec<f64> {
    let index = table.lines().next().unwrap().split(',').position(|c| c == name).unwrap();
    table.lines().skip(1).filter_map(|row| row.split(',').nth(index)?.parse().ok()).collect()
}

#[test]
fn fewer_marks_than_swing_are_said_and_more_are_refused() {
    let bench = Bench::of(&scene());
    assert!(done(&bench.track(&["--markers", "2"])).contains("more thing of the marks' colour moves"));
    let words = refused(&bench.track(&["--markers", "4"]));
    assert!(words.contains("found 3 red marks where 4 are needed") && words.contains("--markers 3"), "{words}");
}

#[test]
fn with_one_colour_as_many_marks_count_as_hang_together() {
    let bench = Bench::of(&scene());
    assert!(done(&bench.track(&["--color", "red"])).contains(" frames, 3 marks, "));
    assert_eq!(column(&bench.table(), "theta2_rad").len(), column(&bench.table(), "t_s").len());
    // the lowest one alone, as a ball on a thread
    assert!(done(&bench.track(&["--color", "red", "--roi", "60,150,200,90"])).contains(" frames, 1 mark, "));
    assert!(!column(&bench.table(), "displacement_px").is_empty());
}

#[test]
fn a_colour_that_is_not_there_is_answered_with_the_one_that_moves_and_with_pictures() {
    let mut plain = scene();
    plain.render.strip_rgb = Rgb([90, 90, 94]);
    let bench = Bench::of(&plain);
    let words = refused(&bench.track(&["--color", "green", "--debug-frames", "steps", "--debug-count", "2"]));
    assert!(words.contains("no green mark") && words.contains("try --color '#"), "{words}");
    assert!(!bench.path("angles.csv").exists());
    assert!(std::fs::read_dir(bench.path("steps")).unwrap().count() >= 8);
}

#[test]
fn a_span_and_a_region_are_all_that_is_measured() {
    let bench = Bench::of(&scene());
    done(&bench.track(&["--from", "1", "--until", "2.5"]));
    let stamps = column(&bench.table(), "t_s");
    assert!(stamps[0] >= 1.0 && *stamps.last().unwrap() <= 2.5 && stamps.len() > 20, "{}", stamps.len());
    let words = refused(&bench.track(&["--roi", "0,0,12,12"]));
    assert!(words.contains("no red mark"), "{words}");
    assert!(refused(&bench.track(&["--roi", "9000,0,12,12"])).contains("lies beside the picture"));
}

#[test]
fn slow_motion_is_measured_in_its_own_time() {
    let bench = Bench::of(&scene());
    done(&bench.track(&[]));
    let played = column(&bench.table(), "t_s");
    let rate_hz = (played.len() - 1) as f64 / (played[played.len() - 1] - played[0]);
    done(&bench.track(&["--true-rate", &format!("{}", 4.0 * rate_hz)]));
    let own = column(&bench.table(), "t_s");
    assert!((own[own.len() - 1] * 4.0 / played[played.len() - 1] - 1.0).abs() < 1e-3);
}

#[test]
fn what_init_writes_is_enough_to_track_and_says_what_is_still_to_be_measured() {
    let bench = Bench::of(&scene());
    let words = done(&bench.freeswing(&["init", "swing.mp4", "--preview", "seen.png"]));
    assert!(words.contains("3 marks"), "{words}");
    assert!(image::open(bench.path("seen.png")).is_ok());
    let file = std::fs::read_to_string(bench.path("experiment.toml")).unwrap();
    assert!(file.contains("link_lengths_m = \"MEASURE\"") && file.contains("centre of the first arc"), "{file}");
    done(&bench.track(&["--config", "experiment.toml"]));
    assert_eq!(column(&bench.table(), "theta2_rad").len(), column(&bench.table(), "t_s").len());
    let words = refused(&bench.freeswing(&["fit", "angles.csv", "--config", "experiment.toml"]));
    assert!(words.contains("specimen.link_lengths_m is still to be measured"), "{words}");
    // frequency and damping need no ruler
    let words = done(&bench.freeswing(&["identify", "angles.csv", "--config", "experiment.toml"]));
    assert!(words.contains("still to be measured") && words.contains("going on without the specimen"), "{words}");
    assert!(refused(&bench.freeswing(&["init", "swing.mp4"])).contains("exists already"));
}

/// A telephone that was held upright writes a picture that lies on its side, where its file does not say so.
#[test]
fn a_recording_that_is_turned_is_told() {
    let bench = Bench::of(&scene());
    let words = done(&bench.freeswing(&["init", "swing.mp4"]));
    assert!(!words.contains("downward direction"), "{words}");
    bench.refilmed("transpose=2", "12");
    let words = done(&bench.freeswing(&["init", "swing.mp4", "--force"]));
    assert!(words.contains("from the picture's downward direction") && words.contains("transpose=1"), "{words}");
    let degrees = words.split_once("lies ").and_then(|(_, rest)| rest.split_once('°')).unwrap().0;
    assert!((80.0..100.0).contains(&degrees.parse::<f64>().unwrap()), "{words}");
}

/// The colour of the command line is that of the marks that the file counts.
#[test]
fn a_colour_of_the_command_line_leaves_the_number_of_marks_to_the_file() {
    let bench = Bench::of(&scene());
    std::fs::write(bench.path("one.toml"), "[rig]\nmarks = [\"blue\"]\npivot_px = [160, 20]\n").unwrap();
    let words = said(&bench.track(&["--config", "one.toml", "--color", "red"]));
    assert!(!words.contains("where 2 are needed"), "{words}");
    assert!(column(&bench.table(), "theta1_rad").len() > 10 && !bench.table().contains("theta2_rad"), "{words}");
}

/// The file states pixels that are a third wider than high: the circle is one in square pixels, and its centre in those of the file.
#[test]
fn pixels_that_are_not_square_have_the_same_pivot() {
    let bench = Bench::of(&scene());
    let pivot = |roi: &str| {
        done(&bench.freeswing(&["init", "swing.mp4", "--force", "--roi", roi]));
        let file = std::fs::read_to_string(bench.path("experiment.toml")).unwrap();
        let of = |key: &str| {
            let line = file.lines().find_map(|line| line.split_once(key)).unwrap_or_else(|| panic!("{file}"));
            let numbers = line.1.split([',', ']']).map(|word| word.trim().parse::<f64>());
            numbers.take(2).collect::<Result<Vec<f64>, _>>().unwrap()
        };
        (of("pivot_px = ["), of("pivot_sd_px = ["))
    };
    let (square, sd) = pivot("0,70,320,170");
    bench.refilmed("scale=240:240,setsar=4/3", "12");
    let (squeezed, _) = pivot("0,70,240,170");
    assert!((squeezed[0] - 0.75 * square[0]).abs() < 1.0, "{square:?} {squeezed:?}");
    assert!((squeezed[1] - square[1]).abs() < 2.0 * sd[1], "{square:?} ± {sd:?}, {squeezed:?}");
}

/// A hand holds what swings for a second: nothing is learnt from that, and it is said what to leave out.
#[test]
fn a_beginning_that_is_held_is_left_out() {
    let bench = Bench::of(&scene());
    bench.refilmed("tpad=start_mode=clone:start_duration=1", "18");
    let words = done(&bench.freeswing(&["init", "swing.mp4"]));
    assert!(words.contains("held still until t = 1."), "{words}");
    let file = std::fs::read_to_string(bench.path("experiment.toml")).unwrap();
    let from_s = file.lines().find_map(|line| line.strip_prefix("from_s = ")).unwrap().parse::<f64>().unwrap();
    assert!((1.0..1.2).contains(&from_s), "{file}");
    let words = done(&bench.track(&["--config", "experiment.toml"]));
    assert!(!words.contains("held") && column(&bench.table(), "t_s")[0] >= from_s, "{words}");
    let words = done(&bench.track(&[]));
    assert!(words.contains("held still until t = 1.") && words.contains("with --from 1."), "{words}");
    let identified = bench.freeswing(&["identify", "angles.csv"]);
    assert!(String::from_utf8_lossy(&identified.stdout).lines().next().unwrap().contains("held still until t = 1."));
}

#[test]
fn a_hinge_below_all_that_swings_is_the_first_mark() {
    let bench = Bench::of(&scene());
    bench.refilmed("vflip", "18");
    let words = done(&bench.track(&[]));
    assert!(!words.contains("px long"), "{words}");
    let standing = column(&bench.table(), "theta1_rad").into_iter().filter(|theta| theta.cos() < 0.0).count();
    assert_eq!(standing, column(&bench.table(), "t_s").len());
}

#[test]
fn of_marks_that_are_alike_there_may_be_fewer_than_the_file_says() {
    let bench = Bench::of(&scene());
    std::fs::write(bench.path("three.toml"), "[rig]\nmarks = [\"red\", \"red\", \"red\"]\n").unwrap();
    done(&bench.track(&["--config", "three.toml", "--markers", "1"]));
    assert!(!column(&bench.table(), "displacement_px").is_empty());
    std::fs::write(bench.path("two.toml"), "[rig]\nmarks = [\"red\", \"green\"]\n").unwrap();
    let words = refused(&bench.track(&["--config", "two.toml", "--markers", "1"]));
    assert!(words.contains("1 marks asked for, 2 colours given"), "{words}");
}

#[test]
fn a_pivot_known_to_some_pixels_makes_all_angles_wrong_alike_and_that_is_said() {
    let bench = Bench::of(&scene());
    let said_of = |sd_px: &str| {
        let rig = format!(
            "[rig]\nmarks = [\"red\", \"red\"]\npivot_px = [160.0, 40.0]\nroi_px = [0.0, 70.0, 320.0, 170.0]\npivot_sd_px = {sd_px}\n"
        );
        std::fs::write(bench.path("rig.toml"), rig).unwrap();
        done(&bench.track(&["--config", "rig.toml"]))
    };
    // 75 px from the pivot to the joint, on the average
    let words = said_of("[0.4, 8.0]");
    assert!(
        words.contains("the standard deviation of the pivot is 0.4 px (x) and 8.0 px (y)") && words.contains("by 10."),
        "{words}"
    );
    // what was said goes with the table
    let identified = done(&bench.freeswing(&["identify", "angles.csv"]));
    assert!(identified.contains("when it was tracked: the standard deviation of the pivot is 0.4 px"), "{identified}");
    assert!(!said_of("[0.01, 0.02]").contains("the pivot is known"));
    std::fs::write(bench.path("rig.toml"), "[rig]\npivot_sd_px = [1.0, 1.0]\n").unwrap();
    assert!(refused(&bench.track(&["--config", "rig.toml"])).contains("rig.pivot_px, which is not given"));
}

#[test]
fn one_mark_alone_gives_its_displacement() {
    let bench = Bench::of(&scene());
    done(&bench.track(&["--markers", "1", "--overlay", "seen.mp4"]));
    let table = bench.table();
    assert!(!column(&table, "displacement_px").is_empty() && !table.contains("theta1_rad"));
}

/// Dark red things behind the strip, which covers and bares them.
fn books() -> String {
    let spines = [
        (70, 60, 18, 150, "781c1c"),
        (92, 50, 16, 160, "6c1a1a"),
        (112, 70, 18, 140, "802020"),
        (134, 55, 14, 120, "701c1c"),
        (152, 80, 15, 140, "7a2020"),
        (171, 60, 16, 150, "6e1818"),
        (190, 40, 18, 170, "7c1e1e"),
        (211, 60, 20, 140, "741c1c"),
        (236, 50, 14, 150, "6a1a1a"),
    ];
    let spine = |(x, y, w, h, rgb)| format!(",drawbox=x={x}:y={y}:w={w}:h={h}:color=0x{rgb}:t=fill");
    spines.into_iter().map(spine).collect()
}

#[test]
fn marks_before_a_shelf_of_books_of_their_colour_are_found() {
    let bench = Bench::of(&scene());
    let filters = format!(
        "[1]format=gbrp{}[b];[0]format=gbrp[a];[a][b]blend=all_mode=lighten:shortest=1,format=yuv420p",
        books()
    );
    let shelf = ["-f", "lavfi", "-i", "color=black:s=320x240:r=30", "-filter_complex", &filters];
    let made = Command::new("ffmpeg")
        .args(["-loglevel", "error", "-y", "-i", "swing.mp4"])
        .args(shelf)
        .args(["-c:v", "libx264", "-crf", "18", "shelf.mp4"])
        .current_dir(bench.folder.path())
        .status();
    assert!(made.unwrap().success());
    done(&bench.track(&[]));
    let alone = bench.table();
    std::fs::rename(bench.path("shelf.mp4"), bench.path("swing.mp4")).unwrap();
    let words = done(&bench.track(&[]));
    assert!(!words.contains("warning"), "{words}");
    for mark in ["m1_x_px", "m2_x_px", "m3_x_px"] {
        let [with, without] = [bench.table(), alone.clone()].map(|table| column(&table, mark));
        assert_eq!(with.len(), without.len());
        assert!(with.iter().zip(&without).all(|(a, b)| (a - b).abs() < 1.5), "{mark}");
    }
}

/// A dark ball on a thread of 300 px that hangs from the lower edge of a dark block, as a clamp looks.
fn ball_under_a_clamp(folder: &Path) {
    let theta = "0.4*cos(5*t)*exp(-0.02*t)";
    let scene = format!(
        "[0]drawbox=x=308:y=10:w=24:h=80:color=black:t=fill[wall];\
         [1]format=rgba,geq=r=20:g=20:b=20:a='if(lte(hypot(X-20,Y-20),18),255,0)'[ball];\
         [wall][ball]overlay=x='300+300*sin({theta})':y='70+300*cos({theta})':format=yuv444"
    );
    let made = Command::new("ffmpeg")
        .args(["-loglevel", "error", "-y", "-f", "lavfi", "-i", "color=c=0xc8c8d0:s=640x440:r=30:d=6"])
        .args(["-f", "lavfi", "-i", "color=c=black:s=40x40:r=30:d=6", "-filter_complex", &scene])
        .args(["-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p", "ball.mp4"])
        .current_dir(folder)
        .status();
    assert!(made.unwrap().success());
}

#[test]
fn a_clamp_above_a_ball_is_not_the_hinge_where_the_arc_has_its_centre_elsewhere() {
    let bench = Bench { folder: tempfile::tempdir().unwrap() };
    ball_under_a_clamp(bench.folder.path());
    let words = done(&bench.freeswing(&["init", "ball.mp4"]));
    assert!(words.contains("no mark shows the hinge") && !words.contains("taken for the hinge"), "{words}");
    let file = std::fs::read_to_string(bench.path("experiment.toml")).unwrap();
    let stated = |key: &str| -> [f64; 2] {
        let line = file.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = [")).unwrap();
        let mut values = line.split(']').next().unwrap().split(", ").map(|value| value.parse().unwrap());
        [values.next().unwrap(), values.next().unwrap()]
    };
    let ([x, y], [sx, sy]) = (stated("pivot_px"), stated("pivot_sd_px"));
    // the ball's middle is half a disc from its picture's corner
    assert!((x - 319.5).abs() < 3.0 * sx && (y - 89.5).abs() < 3.0 * sy && sy < 8.0, "{x} {y} {sx} {sy}");
}
