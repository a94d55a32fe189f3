//! What pictures spread over a recording show before it is measured: what moves, whether the camera does, where the
//! chroma samples lie.

use std::sync::Arc;

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use super::{Camera, Options, Steadying};
use crate::area::Area;
use crate::detect::{
    Album, Blob, Detector, Hue, Mixing, Shading, ShadingSurvey, Siting, SitingSurvey, scene as scene_of,
};
use crate::error::Result;
use crate::experiment::Rig;
use crate::steady::{Background, CameraShift};
use crate::video::{Orientation, OwnedPicture, Picture, Recording, StreamInfo, WHOLE_S};

/// Pictures from which hue, scale, threshold and siting are learnt.
const SAMPLE_PICTURES: usize = 8;
/// Shift between two pictures from which the camera is taken to move, px: ten times what a patch's error is.
const CAMERA_MOVES_PX: f64 = 0.3;
/// Standard deviations beyond which a shift is one, and pictures that must show it.
const SURE_SHIFT: f64 = 5.0;
const FEWEST_PICTURES: usize = 3;

/// Standard deviations of the mean by which marks that are mixed by their light must fit better (the one-standard-error rule of Breiman et al., Classification and
/// Regression Trees, 1984).
const BETTER_MIXING: f64 = 1.0;
/// What is at the same place to this, px, in most pictures stands still.
const AT_REST_PX: f64 = 2.0;
/// Fewest marks that tell how they mix.
const FEWEST_MIXED: usize = 4;

/// The pictures, of the part of the recording that is measured, and their stamps.
pub fn pictures(recording: &Recording, rig: &Rig) -> Result<(Vec<OwnedPicture>, Vec<f64>)> {
    let mut pictures = Vec::new();
    let span_s = rig.span_s();
    recording.sample(SAMPLE_PICTURES, span_s, &mut |frame| pictures.push((frame.picture.to_owned(), frame.t_s)))?;
    if pictures.is_empty() {
        // whether there is such a part turns out when the frames are read
        recording
            .sample(SAMPLE_PICTURES, WHOLE_S, &mut |frame| pictures.push((frame.picture.to_owned(), frame.t_s)))?;
    }
    Ok(pictures.into_iter().unzip())
}

/// Their colours, and what moves.
pub fn album(pictures: &[OwnedPicture], area: &Area, orientation: Orientation) -> Album {
    let mut album = Album::default();
    for picture in pictures {
        album.allow(area.samples(&picture.layout, orientation));
        album.see(&picture.view());
    }
    album.compare();
    album
}

/// A detector of these hues that knows what the pictures show of all of them: from which side marks are lit, how they mix with what is behind them, where the chroma
/// samples lie, and, where the camera stands `still`, what is behind them.
pub fn detector(pictures: &[OwnedPicture], mut hues: Vec<Hue>, still: bool) -> Result<Detector> {
    shade(pictures, &mut hues)?;
    let by = |mixing: Mixing| -> Result<Detector> {
        let siting = siting(pictures, &hues, mixing)?;
        Ok(Detector::new(hues.clone()).with_mixing(mixing).with_siting(siting))
    };
    let detector = by(Mixing::Codes)?;
    let Some(scene) = (if still { scene(pictures, &detector)? } else { None }) else { return Ok(detector) };
    // before one background all around, mixing changes opposite sides alike and pulls no centre
    let detector = if mixing(pictures, &hues)? == Mixing::Light { by(Mixing::Light)? } else { detector };
    Ok(detector.with_scene(Some(scene)))
}

/// From which side the marks are lit, learnt by every hue.
fn shade(pictures: &[OwnedPicture], hues: &mut [Hue]) -> Result<()> {
    let detector = Detector::new(hues.to_vec());
    let survey = over(pictures, |picture| ShadingSurvey::see(picture, &detector), ShadingSurvey::with)?;
    let shadings = survey.unwrap_or_default().conclude();
    hues.iter_mut().zip(shadings).for_each(|(hue, shading)| hue.shading = shading);
    Ok(())
}

/// How the marks mix with what is behind them: as explains better what their edges hold.
fn mixing(pictures: &[OwnedPicture], hues: &[Hue]) -> Result<Mixing> {
    let [codes, light] = [Mixing::Codes, Mixing::Light].map(|mixing| Detector::new(hues.to_vec()).with_mixing(mixing));
    let of_picture = |picture: &Picture<'_>| Ok(vec![(codes.detect(picture)?, light.detect(picture)?)]);
    let seen = over(pictures, of_picture, |a, b| [a, b].concat())?.unwrap_or_default();
    // the edges of what stands still say how sharp the picture is; how light adds up is told by what moves while the shutter is open
    let is_at = |blobs: &[Blob], [x, y]: [f64; 2]| {
        blobs.iter().any(|other| (other.binary_px[0] - x).hypot(other.binary_px[1] - y) < AT_REST_PX)
    };
    let moves = |blob: &Blob| 2 * seen.iter().filter(|(blobs, _)| is_at(blobs, blob.binary_px)).count() <= seen.len();
    let better = |(blob, by_light): (&Blob, &[Blob])| {
        let same = by_light.iter().find(|other| other.has_mask_of(blob))?;
        let [codes, light] = [blob, same].map(|blob| f64::from(blob.centroid.misfit));
        (codes > 0.0 && light > 0.0).then(|| (codes / light).ln())
    };
    let pairs = seen.iter().flat_map(|(by_codes, by_light)| by_codes.iter().map(|blob| (blob, by_light.as_slice())));
    let better: Vec<f64> = pairs.filter(|(blob, _)| moves(blob)).filter_map(better).collect();
    if better.len() < FEWEST_MIXED {
        return Ok(Mixing::default());
    }
    let n = better.len() as f64;
    let mean = better.iter().sum::<f64>() / n;
    let variance = better.iter().map(|own| (own - mean).powi(2)).sum::<f64>() / (n - 1.0);
    Ok(if mean > BETTER_MIXING * (variance / n).sqrt() { Mixing::Light } else { Mixing::Codes })
}

/// Where the chroma samples lie, from the marks.
fn siting(pictures: &[OwnedPicture], hues: &[Hue], mixing: Mixing) -> Result<Option<Siting>> {
    let survey = |hues: Vec<Hue>| {
        let detector = Detector::new(hues).with_mixing(mixing);
        over(pictures, |picture| SitingSurvey::see(picture, &detector), SitingSurvey::with)
    };
    let even = |hue: &Hue| Hue { shading: Shading::default(), ..hue.clone() };
    let are_lit = hues.iter().any(|hue| hue.shading != Shading::default());
    let unshaded = if are_lit { survey(hues.iter().map(even).collect())? } else { None };
    Ok(survey(hues.to_vec())?.and_then(|survey| survey.conclude(unshaded.as_ref())))
}

/// What stands still behind the marks, where the pictures show it and it explains what lies around most marks better than what a single picture shows: a wall of one
/// colour, or a strip that the marks are on, needs no second picture.
fn scene(pictures: &[OwnedPicture], detector: &Detector) -> Result<Option<Arc<OwnedPicture>>> {
    let Some(still) = scene_of(pictures) else { return Ok(None) };
    let still = Arc::new(still);
    let detector = detector.clone().with_scene(Some(Arc::clone(&still)));
    let known = |picture: &Picture<'_>| {
        let blobs = detector.detect(picture)?;
        let known = || blobs.iter().filter_map(|blob| blob.centroid.known_behind);
        Ok([known().filter(|best| *best).count(), known().count()])
    };
    let seen = over(pictures, known, |a, b| [a[0] + b[0], a[1] + b[1]])?;
    Ok(seen.is_some_and(|[known, all]| 2 * known > all).then_some(still))
}

/// What all pictures show, put together; `None` where there is none.
fn over<S: Send>(
    pictures: &[OwnedPicture],
    see: impl Fn(&Picture<'_>) -> Result<S> + Sync,
    with: impl Fn(S, S) -> S,
) -> Result<Option<S>> {
    let seen = pictures.par_iter().map(|picture| see(&picture.view())).collect::<Result<Vec<_>>>()?;
    Ok(seen.into_iter().reduce(with))
}

/// What the pictures show of the camera.
#[derive(Default)]
pub struct SurveyedCamera {
    /// Against what its motion is taken out, where it is.
    pub background: Option<Background>,
    /// How far it moves.
    pub camera: Camera,
    /// Against what it is watched, where nothing is taken out but could be.
    pub watch: Option<Background>,
    /// Most pictures show that it stands still.
    pub still: bool,
    /// Where it looks in every picture, where its motion is taken out.
    pub shifts: Vec<CameraShift>,
}

/// The greatest shift that two pictures show: one alone may have something pass before its patches. A shift that its own patches leave open is none.
pub fn greatest_px<'a>(shifts: impl Iterator<Item = &'a CameraShift>) -> f64 {
    let sure = shifts.filter(|c| c.size_px() > SURE_SHIFT * c.sd_px());
    let mut sizes_px: Vec<f64> = sure.map(CameraShift::size_px).collect();
    sizes_px.sort_by(|a, b| b.total_cmp(a));
    sizes_px.get(1).copied().unwrap_or(0.0)
}

/// Whether that is a camera that moves, of so many pictures.
pub fn moves(greatest_px: f64, pictures: usize) -> bool {
    greatest_px > CAMERA_MOVES_PX && pictures >= FEWEST_PICTURES
}

/// How far the camera moves, and against what it is taken out, where it is.
pub fn camera(pictures: &[OwnedPicture], options: &Options, stream: &StreamInfo) -> SurveyedCamera {
    let Some((first, others)) = pictures.split_first() else { return SurveyedCamera::default() };
    let stored = |p: &[f64; 2]| stream.orientation.stored_point(*p, stream.stored_size_px);
    let points_px: Vec<[f64; 2]> = options.rig.reference_marks.iter().map(stored).collect();
    let mut background = Background::of(&first.view(), &points_px);
    let locate = |picture: &OwnedPicture| {
        let camera = background.locate(&picture.view())?;
        Some((camera, background.agreeing(&picture.view(), &camera)))
    };
    let located: Vec<_> = others.par_iter().map(locate).collect();
    let greatest_px = greatest_px(located.iter().flatten().map(|(camera, _)| camera));
    // pictures that do not show where the camera looks
    let silent = located.iter().any(Option::is_none);
    let still = CameraShift::default();
    let shifts: Vec<CameraShift> = std::iter::once(still).chain(located.iter().flatten().map(|(c, _)| *c)).collect();
    let agreed: Vec<Vec<bool>> = located.into_iter().flatten().map(|(_, agreed)| agreed).collect();
    let taken_out = match options.steadying {
        Steadying::Always => true,
        Steadying::Never => false,
        // where some picture does not show the background well, no frame is risked for it
        Steadying::WhereNeeded => !silent && (!points_px.is_empty() || moves(greatest_px, agreed.len())),
    };
    background.keep_steady(&agreed);
    let is_usable = background.is_usable();
    let taken_out = taken_out && is_usable;
    let is_watched = options.steadying == Steadying::WhereNeeded && !silent && !taken_out && is_usable;
    let greatest_shift_px = if silent { 0.0 } else { greatest_px };
    let camera = Camera { greatest_shift_px, is_told: !silent, taken_out, ..Camera::default() };
    SurveyedCamera {
        watch: is_watched.then(|| background.clone()),
        background: taken_out.then_some(background),
        camera,
        still: !silent && !taken_out && greatest_px <= CAMERA_MOVES_PX,
        // of an undecided picture nothing is known
        shifts: if taken_out && !silent { shifts } else { Vec::new() },
    }
}
