//! Bad input: one clear line, exit 2, nothing written, nothing overwritten; never a panic.

mod nobody;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

use assert_cmd::cargo::CommandCargoExt;
use freeswing::experiment::{Experiment, MarkColour, Rgb};
use freeswing::synth::Recording;
use nobody::{Nobody, set_mode};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use tempfile::TempDir;

const EARLIER: &str = "an earlier result";

/// Two seconds at 320×240 in five groups of pictures, the index (moov) at the end.
static CLIP: LazyLock<Vec<u8>> = LazyLock::new(|| clip(&scene(), "mp4"));

fn scene() -> Experiment {
    let text = include_str!("../fixtures/render/small.toml");
    let mut experiment = Experiment::parse(text, Path::new("small.toml")).unwrap();
    experiment.render.duration_s = 2.0;
    experiment.render.codec.gop = 12;
    experiment
}

fn clip(experiment: &Experiment, extension: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clip").with_extension(extension);
    Recording::of(experiment).unwrap().write(&path, None, &mut |_| Ok(())).unwrap();
    std::fs::read(path).unwrap()
}

/// What `ffmpeg` makes of the clip, or of nothing, with these arguments.
fn converted(arguments: &[&str], extension: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let (from, to) = (folder.path().join("from.mp4"), folder.path().join("to").with_extension(extension));
    std::fs::write(&from, &*CLIP).unwrap();
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.current_dir(folder.path()).args(["-v", "error", "-y"]).args(arguments).arg(&to);
    assert!(ffmpeg.status().expect("ffmpeg runs").success());
    std::fs::read(to).unwrap()
}

/// A folder with an input and an earlier `angles.csv`.
struct Bench {
    folder: TempDir,
}

impl Bench {
    fn with(name: &str, bytes: &[u8]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("angles.csv"), EARLIER).unwrap();
        std::fs::write(folder.path().join(name), bytes).unwrap();
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Every file and folder with its bytes.
    fn contents(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let entries = std::fs::read_dir(self.folder.path()).unwrap().map(|e| e.unwrap().path());
        entries.map(|path| (path.clone(), std::fs::read(&path).unwrap_or_default())).collect()
    }

    fn command(&self, input: &str, more: &[&str]) -> Command {
        let mut command = Command::cargo_bin("track").unwrap();
        command.current_dir(self.folder.path()).arg(input).args(more);
        if !more.contains(&"--out") {
            command.args(["--out", "angles.csv"]);
        }
        command
    }

    /// Exit 2, one line that names `says`, and the folder as it was.
    #[track_caller]
    fn refuses_with(&self, input: &str, more: &[&str], says: &str) -> String {
        let before = self.contents();
        let output = self.command(input, more).output().unwrap();
        let line = self.one_line_of_refusal(&output);
        assert!(line.contains(says), "{line:?} does not say {says:?}");
        assert_eq!(self.contents(), before, "the folder is not as it was");
        line
    }

    #[track_caller]
    fn one_line_of_refusal(&self, output: &Output) -> String {
        let line = String::from_utf8(output.stderr.clone()).unwrap();
        assert_eq!(output.status.code(), Some(2), "{:?} {line}", output.status);
        assert!(line.starts_with("error: ") && line.matches('\n').count() == 1 && line.ends_with('\n'), "{line:?}");
        assert!(output.stdout.is_empty());
        line
    }

    /// Either refused, or measured with a warning and two files that agree. Says which warnings.
    #[track_caller]
    fn refuses_or_warns(&self, input: &str) -> Vec<String> {
        let before = self.contents();
        let output = self.command(input, &[]).output().unwrap();
        if output.status.code() != Some(0) {
            self.one_line_of_refusal(&output);
            assert_eq!(self.contents(), before, "the folder is not as it was");
            return Vec::new();
        }
        let account = self.account();
        let table = std::fs::read_to_string(self.path("angles.csv")).unwrap();
        assert_eq!(table.lines().count() as u64 - 1, account["time_stamps"]["frames"].as_u64().unwrap());
        assert_eq!(self.contents().len(), before.len() + 1, "only angles.json is new");
        let warnings = account["warnings"].as_array().unwrap().iter().map(|w| w.as_str().unwrap().to_owned());
        let warnings: Vec<String> = warnings.collect();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(
            said.lines().filter(|l| l.starts_with("warning: ")).eq(warnings.iter().map(|w| format!("warning: {w}")))
        );
        warnings
    }

    fn account(&self) -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(self.path("angles.json")).unwrap()).unwrap()
    }
}

#[test]
fn a_file_that_is_not_a_video() {
    let text = Bench::with("notes.txt", b"Remember to record the pendulum.\n");
    text.refuses_with("notes.txt", &[], "notes.txt: not a video");
    Bench::with("empty.mp4", b"").refuses_with("empty.mp4", &[], "empty.mp4: the file is empty");
    Bench::with("zeros.mp4", &[0; 4096]).refuses_with("zeros.mp4", &[], "zeros.mp4: not a video");
}

#[test]
fn a_missing_file_a_folder_a_pipe() {
    let bench = Bench::with("other.txt", b"");
    bench.refuses_with("missing.mp4", &[], "missing.mp4: cannot be read: No such file");
    std::fs::create_dir(bench.path("empty")).unwrap();
    bench.refuses_with("empty", &[], "empty: holds no PNG, JPEG, TIFF, BMP or PNM stills");
    assert!(Command::new("mkfifo").arg(bench.path("pipe.mp4")).status().unwrap().success());
    let output = bench.command("pipe.mp4", &[]).output().unwrap();
    assert!(bench.one_line_of_refusal(&output).contains("pipe.mp4: not a video that can be opened: it is a pipe"));
}

#[test]
fn a_file_that_may_not_be_read() {
    let bench = Bench::with("secret.mp4", &CLIP);
    let track = Command::cargo_bin("track").unwrap().get_program().to_owned();
    let Some(nobody) = Nobody::at(bench.folder.path(), Path::new(&track)) else { return };
    set_mode(&bench.path("secret.mp4"), 0o000);
    let before = bench.contents();
    let line =
        bench.one_line_of_refusal(&nobody.command().args(["secret.mp4", "--out", "angles.csv"]).output().unwrap());
    assert!(line.contains("secret.mp4: cannot be read: Permission denied"), "{line}");
    assert_eq!(bench.contents(), before, "the folder is not as it was");
}

#[test]
fn a_container_without_pictures() {
    let tone = ["-f", "lavfi", "-i", "sine=duration=0.5"];
    for extension in ["wav", "m4a", "mkv"] {
        let name = format!("tone.{extension}");
        let bench = Bench::with(&name, &converted(&tone, extension));
        bench.refuses_with(&name, &[], &format!("{name}: holds no video stream (only audio)"));
    }
}

#[test]
fn a_clip_cut_off_anywhere() {
    let clips = [
        ("late.mp4", CLIP.clone()),
        ("early.mp4", converted(&["-i", "from.mp4", "-c", "copy", "-movflags", "+faststart"], "mp4")),
        ("clip.mkv", converted(&["-i", "from.mp4", "-c", "copy"], "mkv")),
        ("clip.avi", converted(&["-i", "from.mp4", "-c:v", "mjpeg", "-q:v", "3"], "avi")),
    ];
    for (name, whole) in clips {
        let length = whole.len();
        let is_mp4 = name.ends_with("mp4");
        let coarse = (0..40).step_by(if is_mp4 { 1 } else { 3 }).map(|i| length * i / 40);
        let fine = (length - 200..length).step_by(if is_mp4 { 5 } else { 40 });
        let mut silent = Vec::new();
        for cut in coarse.chain(fine).skip(1) {
            let bench = Bench::with(name, &whole[..cut]);
            if bench.refuses_or_warns(name).is_empty() && bench.path("angles.json").exists() {
                silent.push(cut);
            }
        }
        // an AVI's and a Matroska's tail is its index: without it every frame is still there
        let picture_bytes = if name == "early.mp4" { length } else { length * 9 / 10 };
        silent.retain(|cut| *cut < picture_bytes);
        assert!(silent.is_empty(), "{name}, {length} bytes: not a word of the cut at {silent:?}");
    }
}

/// The marks' positions by time stamp, where they were measured.
fn positions_px(table: &str) -> BTreeMap<String, Vec<f64>> {
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let numbers: Option<Vec<f64>> = fields[2..8].iter().map(|f| f.parse().ok()).collect();
        Some((fields[1].to_owned(), numbers?))
    };
    table.lines().skip(1).filter_map(row).collect()
}

#[test]
fn damage_in_the_middle_is_told_and_what_it_spoils_is_left_out() {
    let whole = Bench::with("whole.mp4", &CLIP);
    assert!(whole.refuses_or_warns("whole.mp4").is_empty());
    let right = positions_px(&std::fs::read_to_string(whole.path("angles.csv")).unwrap());
    assert_eq!(right.len(), 60);
    for share in [0.3, 0.5, 0.7] {
        let mut damaged = CLIP.clone();
        let start = (damaged.len() as f64 * share) as usize;
        Xoshiro256PlusPlus::seed_from_u64(7).fill(&mut damaged[start..start + 300]);
        let bench = Bench::with("hit.mp4", &damaged);
        let warnings = bench.refuses_or_warns("hit.mp4");
        assert!(warnings.iter().any(|w| w.contains("the file is damaged")), "{warnings:?}");
        assert!(!bench.account()["damage"]["damaged_frames"].as_array().unwrap().is_empty());
        let measured = positions_px(&std::fs::read_to_string(bench.path("angles.csv")).unwrap());
        assert!(measured.len() >= 40, "only {} frames are left", measured.len());
        for (t_s, position) in &measured {
            let off = position.iter().zip(&right[t_s]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 0.3, "hit at {share}, {t_s} s: {off} px wrong without a word");
        }
    }
}

#[test]
fn random_damage_anywhere_never_panics() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    for name in ["hit.mp4", "hit.mkv", "hit.avi"] {
        let whole = match name {
            "hit.mp4" => CLIP.clone(),
            "hit.mkv" => converted(&["-i", "from.mp4", "-c", "copy"], "mkv"),
            _ => converted(&["-i", "from.mp4", "-c:v", "mpeg4", "-q:v", "3"], "avi"),
        };
        for _ in 0..16 {
            let mut damaged = whole.clone();
            let start = random.random_range(0..damaged.len() - 1);
            let end = (start + random.random_range(1..1500)).min(damaged.len());
            random.fill(&mut damaged[start..end]);
            Bench::with(name, &damaged).refuses_or_warns(name);
        }
    }
}

#[test]
fn pictures_of_impossible_size() {
    // width and height stand 28 bytes after the name of the sample entry
    let entry = CLIP.windows(4).position(|w| w == b"avc1").unwrap();
    let configuration = CLIP.windows(4).position(|w| w == b"avcC").unwrap();
    for [width, height] in [[0u16, 0], [1, 1], [65535, 65535], [320, 65535]] {
        let mut odd = CLIP.clone();
        odd[entry + 28..entry + 30].copy_from_slice(&width.to_be_bytes());
        odd[entry + 30..entry + 32].copy_from_slice(&height.to_be_bytes());
        Bench::with("odd.mp4", &odd).refuses_or_warns("odd.mp4");
        // and without the decoder's own account of the size
        odd[configuration + 4..configuration + 40].fill(0);
        let bench = Bench::with("odd.mp4", &odd);
        bench.refuses_with("odd.mp4", &[], "odd.mp4: ");
    }
    // an uncompressed AVI has no other account of its size: 4 bytes each, after "strf", length and header size
    let raw = converted(&["-i", "from.mp4", "-frames:v", "2", "-c:v", "rawvideo", "-pix_fmt", "yuv420p"], "avi");
    let header = raw.windows(4).position(|w| w == b"strf").unwrap() + 12;
    for side in [0i32, 8, 20_000, i32::MAX] {
        let mut odd = raw.clone();
        odd[header..header + 4].copy_from_slice(&side.to_le_bytes());
        odd[header + 4..header + 8].copy_from_slice(&side.to_le_bytes());
        let line = Bench::with("odd.avi", &odd).refuses_with("odd.avi", &[], "odd.avi: ");
        println!("{side}: {line}");
    }
}

#[test]
fn marks_that_are_not_there() {
    let mut grey = scene();
    grey.render.strip_rgb = Rgb([90, 90, 94]);
    grey.rig.marks = vec![MarkColour { name: "grey".to_owned(), rgb: [150, 150, 150] }; 3];
    Bench::with("grey.mp4", &clip(&grey, "mp4")).refuses_with(
        "grey.mp4",
        &[],
        "grey.mp4: no red mark in any of 60 frames",
    );

    let mut two = scene();
    two.render.strip_rgb = Rgb([90, 90, 94]);
    two.rig.pivot_px = Some(two.render.hinge_px);
    let bench = Bench::with("two.mp4", &clip(&two, "mp4"));
    bench.refuses_with("two.mp4", &[], "two.mp4: found 2 red marks where 3 are needed");
    let colours = ["--color", "red", "--color", "red", "--color", "blue"];
    bench.refuses_with("two.mp4", &colours, "two.mp4: no blue mark in any of 60 frames");
}

#[test]
fn an_output_that_cannot_be_written() {
    let bench = Bench::with("clip.mp4", &CLIP);
    std::fs::create_dir(bench.path("folder")).unwrap();
    for out in ["missing/a.csv", "clip.mp4/a.csv", "folder", "/dev/full"] {
        bench.refuses_with("clip.mp4", &["--out", out], &format!("{out}: cannot be written"));
    }
    std::fs::create_dir(bench.path("b.json")).unwrap();
    bench.refuses_with("clip.mp4", &["--out", "b.csv"], "b.json: cannot be written: it is a folder");
}

#[test]
fn an_output_never_takes_the_place_of_an_input() {
    let bench = Bench::with("clip.mp4", &CLIP);
    std::fs::write(bench.path("rig.toml"), "").unwrap();
    std::fs::hard_link(bench.path("clip.mp4"), bench.path("clip.json")).unwrap();
    std::os::unix::fs::symlink("clip.mp4", bench.path("link.csv")).unwrap();
    bench.refuses_with("clip.mp4", &["--out", "clip.mp4"], "clip.mp4 is an input and would be overwritten");
    bench.refuses_with("clip.mp4", &["--out", "./link.csv"], "link.csv is an input and would be overwritten");
    let overlay = ["--overlay", "clip.mp4"];
    bench.refuses_with("clip.mp4", &overlay, "--overlay: clip.mp4 is an input and would be overwritten");
    let config = ["--config", "rig.toml", "--out", "rig.toml"];
    bench.refuses_with("clip.mp4", &config, "rig.toml is an input and would be overwritten");
    bench.refuses_with("clip.mp4", &["--out", "angles.json"], "--out: angles.json is the name of the account");
}

/// What `freeswing` says in one line when it refuses these words, the folder being as it was.
#[track_caller]
fn refusal(bench: &Bench, words: &str) -> String {
    let before = bench.contents();
    let mut command = Command::cargo_bin("freeswing").unwrap();
    let output = command.current_dir(bench.folder.path()).args(words.split(' ')).output().unwrap();
    let line = bench.one_line_of_refusal(&output);
    assert_eq!(bench.contents(), before, "{words}: the folder is not as it was");
    line
}

#[test]
fn no_command_writes_over_an_input_or_one_output_over_another() {
    let bench = Bench::with("e.toml", b"[specimen]\n");
    std::fs::write(bench.path("b.csv"), EARLIER).unwrap();
    let input = "is an input and would be overwritten; use another name";
    for (words, says) in [
        ("laser b.csv --config e.toml --json b.csv", format!("--json: b.csv {input}")),
        ("laser b.csv --config e.toml --figure a.svg --json ./e.toml", format!("--json: ./e.toml {input}")),
        ("fit angles.csv b.csv --config e.toml --json b.csv", format!("--json: b.csv {input}")),
        ("fit angles.csv --config e.toml --curves angles.csv", format!("--curves: angles.csv {input}")),
        ("diagnose angles.csv --config e.toml --json e.toml", format!("--json: e.toml {input}")),
        ("diagnose angles.csv --config e.toml --map angles.csv", format!("--map: angles.csv {input}")),
        ("modes --config e.toml --json e.toml", format!("--json: e.toml {input}")),
        ("force --config e.toml --json e.toml", format!("--json: e.toml {input}")),
        ("force --config e.toml --trace e.toml", format!("--trace: e.toml {input}")),
        ("simulate --config e.toml --out e.toml", format!("--out: e.toml {input}")),
        ("render --config e.toml --out a.mp4 --truth e.toml", format!("--truth: e.toml {input}")),
        ("identify angles.csv --json angles.csv", format!("--json: angles.csv {input}")),
        ("export angles.csv --out angles.csv", format!("--out: angles.csv {input}")),
        ("init b.csv --force --out b.csv", format!("--out: b.csv {input}")),
        (
            "fit angles.csv --config e.toml --json new.json --curves ./new.json",
            "--curves: ./new.json is what --json writes and would be overwritten; use another name".to_owned(),
        ),
        ("fit angles.csv --config e.toml --json - --curves -", "--curves: - is what --json writes".to_owned()),
    ] {
        let line = refusal(&bench, words);
        assert!(line.contains(&says), "{words}: {line}");
    }
}

#[test]
fn a_folder_that_is_missing_or_is_a_file_is_named() {
    let bench = Bench::with("e.toml", b"[specimen]\n");
    for (words, says) in [
        ("paper --json nope/x.json", "nope/x.json: cannot be written: there is no folder nope;"),
        ("man --out e.toml", "e.toml: cannot be written: it is a file, not a folder;"),
        ("man --out e.toml/man", "e.toml/man: cannot be written: e.toml is a file;"),
    ] {
        let line = refusal(&bench, words);
        assert!(line.contains(says), "{words}: {line}");
    }
}

#[test]
fn words_that_cannot_be_understood_are_one_line_too() {
    let bench = Bench::with("e.toml", b"[specimen]\n");
    for (words, says) in [
        (
            "fit",
            "error: the following required arguments were not provided: --config <FILE>, <ANGLES>...; see --help for all options",
        ),
        ("fitt a.csv", "unrecognized subcommand 'fitt'; "),
        (
            "fit a.csv --confg e.toml",
            "'--confg' found; a similar argument exists: '--config'; see --help for all options",
        ),
        ("run a.mp4 --out x --until dinner", "invalid value 'dinner' for '--until <STAGE>'; [possible values: track, "),
        // a number below zero is answered by the command itself
        ("batch . --out x --jobs -1", "invalid value '-1' for '--jobs <N>': -1 is not in 1..=65535"),
        ("simulate --config e.toml --out x.csv --duration -1", "e.toml: "),
    ] {
        let line = refusal(&bench, words);
        assert!(line.contains(says), "{words}: {line}");
    }
}

#[test]
fn an_interruption_leaves_nothing() {
    let kapton = Path::new(env!("CARGO_MANIFEST_DIR")).join("videos/kapton.mp4");
    for signal in [libc::SIGINT, libc::SIGTERM] {
        let bench = Bench::with("other.txt", b"");
        let before = bench.contents();
        let mut command = bench.command(&kapton.display().to_string(), &[]);
        let child = command.stderr(std::process::Stdio::piped()).stdout(std::process::Stdio::piped()).spawn().unwrap();
        // its temporary files show that it is at work
        while bench.contents().len() == before.len() {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        // SAFETY: the child has not been waited for, so its number is still its own.
        unsafe { libc::kill(libc::pid_t::try_from(child.id()).unwrap(), signal) };
        let line = bench.one_line_of_refusal(&child.wait_with_output().unwrap());
        assert_eq!(line, "error: interrupted; nothing was written\n");
        assert_eq!(bench.contents(), before);
    }
}

#[test]
fn options_that_make_no_sense() {
    let bench = Bench::with("clip.mp4", &CLIP);
    std::fs::write(bench.path("typo.toml"), "[rig]\nmirored = true\n").unwrap();
    std::fs::write(bench.path("broken.toml"), "[rig\n").unwrap();
    std::fs::write(bench.path("colour.toml"), "[rig]\nmarks = [\"crimson\"]\n").unwrap();
    let cases: [(&[&str], &str); 12] = [
        (&["--from", "5", "--until", "2"], "error: --until = 2: must be later than --from = 5"),
        (&["--roi", "0,0,1,1"], "error: --roi: give left, top, width and height"),
        (&["--threshold", "300"], "--threshold: must lie between 0 and 255"),
        (&["--threshold", "nan"], "--threshold: must lie between 0 and 255"),
        (&["--markers", "0"], "--markers: 1 to 12 marks can be followed"),
        (&["--markers", "1000000000"], "--markers: 1 to 12 marks can be followed"),
        (&["--color", "red", "--color", "red", "--markers", "4"], "--markers: 4 marks asked for, 2 colours given"),
        (&["--threads", "0"], "--threads: must be at least 1"),
        (&["--config", "typo.toml"], "typo.toml:2: unknown key `mirored`; the nearest known one is `mirrored`"),
        (&["--config", "broken.toml"], "broken.toml:1: "),
        (&["--config", "colour.toml"], "colour.toml:2: unknown colour `crimson`; use red, green"),
        (&["--config", "none.toml"], "none.toml: cannot be read"),
    ];
    for (more, says) in cases {
        bench.refuses_with("clip.mp4", more, says);
    }
}

#[test]
fn arguments_that_cannot_be_understood() {
    let bench = Bench::with("clip.mp4", &CLIP);
    let cases: [(&[&str], &str); 6] = [
        (&["--pivot", "nonsense"], "give two numbers as X,Y"),
        (&["--pivot", "1,nan"], "give two numbers as X,Y"),
        (&["--color", "crimson"], "unknown colour `crimson`"),
        (&["--color", "#808080"], "is a grey"),
        (&["--thresold", "9"], "--threshold"),
        (&["--markers", "-1"], "'-1'"),
    ];
    for (more, says) in cases {
        bench.refuses_with("clip.mp4", more, says);
    }
}
