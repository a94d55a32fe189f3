use super::super::{Detector, Hue, ShadingSurvey};
use crate::experiment::MarkColour;
use crate::video::{Layout, OwnedPicture};

/// A 4:2:0 picture of `colour(x, y)`, each luma pixel the mean of 6×6 points, chroma co-sited to the left.
fn paint(width: usize, height: usize, colour: impl Fn(f64, f64) -> [f64; 3]) -> OwnedPicture {
    let layout = Layout::subsampled(width, height, 8);
    let fine = |x: usize, y: usize| -> [f64; 3] {
        let mut sum = [0.0; 3];
        for i in 0..36 {
            let (u, v) = ((i % 6) as f64, (i / 6) as f64);
            let rgb = colour(x as f64 - 0.5 + (u + 0.5) / 6.0, y as f64 - 0.5 + (v + 0.5) / 6.0);
            let ycc = layout.matrix.ycbcr(rgb);
            (0..3).for_each(|k| sum[k] += ycc[k] / 36.0);
        }
        sum
    };
    let full: Vec<[f64; 3]> = (0..width * height).map(|i| fine(i % width, i / width)).collect();
    let mut picture = OwnedPicture::black(layout);
    for (i, ycc) in full.iter().enumerate() {
        picture.set(0, i, (16.0 + 219.0 * ycc[0]).round() as u16);
    }
    let (cw, ch) = layout.chroma_size();
    for y in 0..ch {
        for x in 0..cw {
            for plane in [1, 2] {
                let at = |dx: i64, row: usize| {
                    let column = (2 * x as i64 + dx).clamp(0, width as i64 - 1) as usize;
                    full[row.min(height - 1) * width + column][plane]
                };
                let mean: f64 =
                    [2 * y, 2 * y + 1].iter().map(|r| at(-1, *r) + 2.0 * at(0, *r) + at(1, *r)).sum::<f64>() / 8.0;
                picture.set(plane, y * cw + x, (128.0 + 224.0 * mean).round() as u16);
            }
        }
    }
    picture
}

/// Largest and mean error over sixteen positions of a red disc of 22 px over `behind`.
fn errors(behind: impl Fn(f64, f64, [f64; 2]) -> [f64; 3]) -> (f64, [f64; 2]) {
    let detector = Detector::new(vec![Hue { colour: MarkColour::red(), marks: 1, threshold: 60.0, ..Hue::default() }]);
    let (mut worst, mut mean) = (0.0f64, [0.0; 2]);
    for k in 0..16 {
        let truth = [40.0 + f64::from(k) * 0.137, 38.0 + f64::from(k * 5 % 16) * 0.131];
        let picture = paint(84, 80, |x, y| {
            let inside = (x - truth[0]).hypot(y - truth[1]) <= 11.0;
            if inside { [0.8, 0.1, 0.1] } else { behind(x, y, truth) }
        });
        let blobs = detector.detect(&picture.view()).unwrap();
        assert_eq!(blobs.len(), 1, "{blobs:?}");
        let c = blobs[0].centroid;
        let error = [c.x_px - truth[0], c.y_px - truth[1]];
        worst = worst.max(error[0].abs()).max(error[1].abs());
        mean = [mean[0] + error[0] / 16.0, mean[1] + error[1] / 16.0];
    }
    (worst, mean)
}

#[test]
fn a_disc_on_white_is_found_to_a_hundredth_of_a_pixel_at_every_phase() {
    let (worst, mean) = errors(|_, _, _| [0.9, 0.9, 0.9]);
    assert!(worst < 0.015 && mean[0].abs() < 0.005 && mean[1].abs() < 0.005, "{worst} {mean:?}");
}

#[test]
fn a_disc_half_on_an_amber_strip_and_half_on_the_dark_is_not_drawn_to_either() {
    let (worst, mean) = errors(|_, y, t| if y < t[1] { [0.77, 0.52, 0.18] } else { [0.12, 0.13, 0.14] });
    assert!(worst < 0.06 && mean[0].abs() < 0.015 && mean[1].abs() < 0.03, "{worst} {mean:?}");
}

#[test]
fn a_background_that_brightens_across_the_mark_does_not_move_it() {
    let (worst, mean) = errors(|x, _, t| [0.5 + 0.005 * (x - t[0]); 3]);
    assert!(worst < 0.05 && mean[0].abs() < 0.04, "{worst} {mean:?}");
}

#[test]
fn a_dark_line_through_the_mark_and_a_distant_object_do_not_move_it() {
    let (worst, mean) = errors(|x, y, t| {
        let on_line = ((x - t[0]) * 0.6 - (y - t[1]) * 0.8).abs() < 0.8 && x > t[0];
        if on_line || x > t[0] + 24.0 { [0.05, 0.05, 0.4] } else { [0.85, 0.85, 0.85] }
    });
    assert!(worst < 0.1 && mean[0].abs() < 0.04, "{worst} {mean:?}");
}

#[test]
fn a_strip_hardly_wider_than_the_mark_and_bent_at_it_does_not_draw_it() {
    for bend_rad in [-0.12f64, 0.0, 0.12] {
        let (worst, mean) = errors(|x, y, t| {
            let turn_rad = if y < t[1] { bend_rad } else { -bend_rad };
            let across = (x - t[0]) * turn_rad.cos() + (y - t[1]) * turn_rad.sin();
            if across.abs() < 12.5 { [0.82; 3] } else { [0.08, 0.08, 0.1] }
        });
        assert!(worst < 0.04 && mean[0].abs() < 0.015 && mean[1].abs() < 0.015, "{bend_rad}: {worst} {mean:?}");
    }
}

/// A green ball of 40 px, lit from the upper left, before a beige wall.
fn ball(truth: [f64; 2]) -> OwnedPicture {
    paint(84, 80, |x, y| {
        let [u, v] = [(x - truth[0]) / 20.0, (y - truth[1]) / 20.0];
        let depth = (1.0 - u * u - v * v).max(0.0).sqrt();
        let light = (0.45 + 0.55 * (-0.45 * u - 0.6 * v + 0.66 * depth).max(0.0)).powf(1.0 / 2.2);
        if u.hypot(v) <= 1.0 { [0.18, 0.6, 0.24].map(|colour| colour * light) } else { [0.78, 0.73, 0.63] }
    })
}

#[test]
fn a_ball_lit_from_one_side_is_not_drawn_to_the_light() {
    let place = |k: u32| [40.0 + f64::from(k) * 0.137, 38.0 + f64::from(k * 5 % 16) * 0.131];
    let hue = Hue { colour: "green".parse().unwrap(), marks: 1, threshold: 40.0, ..Hue::default() };
    let mean_error = |hue: &Hue| {
        let detector = Detector::new(vec![hue.clone()]);
        let mut mean = [0.0; 2];
        for truth in (0..16).map(place) {
            let blobs = detector.detect(&ball(truth).view()).unwrap();
            let c = blobs[0].centroid;
            mean = [mean[0] + (c.x_px - truth[0]) / 16.0, mean[1] + (c.y_px - truth[1]) / 16.0];
        }
        mean[0].hypot(mean[1])
    };
    let detector = Detector::new(vec![hue.clone()]);
    let surveys = (0..16).map(|k| ShadingSurvey::see(&ball(place(k)).view(), &detector).unwrap());
    let shading = surveys.reduce(ShadingSurvey::with).unwrap().conclude()[0];
    let (even, lit) = (mean_error(&hue), mean_error(&Hue { shading, ..hue.clone() }));
    assert!(even > 0.05 && lit < 0.2 * even, "{even} {lit} {shading:?}");
}
