//! What pictures spread over a recording show before it is measured: what moves, whether the camera does, where the
//! chroma samples lie.

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use super::{Camera, Options, Steadying};
use crate::area::Area;
use crate::detect::{Album, Detector, Hue, Shading, ShadingSurvey, Siting, SitingSurvey};
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

/// From which side the marks are lit, learnt by every hue.
pub fn shade(pictures: &[OwnedPicture], hues: &mut [Hue]) -> Result<()> {
    let detector = Detector::new(hues.to_vec());
    let survey = over(pictures, |picture| ShadingSurvey::see(picture, &detector), ShadingSurvey::with)?;
    let shadings = survey.unwrap_or_default().conclude();
    hues.iter_mut().zip(shadings).for_each(|(hue, shading)| hue.shading = shading);
    Ok(())
}

/// Where the chroma samples lie, from the marks.
pub fn siting(pictures: &[OwnedPicture], hues: &[Hue]) -> Result<Option<Siting>> {
    let survey = |hues: Vec<Hue>| {
        let detector = Detector::new(hues);
        over(pictures, |picture| SitingSurvey::see(picture, &detector), SitingSurvey::with)
    };
    let even = |hue: &Hue| Hue { shading: Shading::default(), ..hue.clone() };
    let are_lit = hues.iter().any(|hue| hue.shading != Shading::default());
    let unshaded = if are_lit { survey(hues.iter().map(even).collect())? } else { None };
    Ok(survey(hues.to_vec())?.and_then(|survey| survey.conclude(unshaded.as_ref())))
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
    /// Where it looks in every picture, where its motion is taken out.
    pub shifts: Vec<CameraShift>,
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
    // a shift that its own patches leave open is none
    let shifts = located.iter().flatten().map(|(camera, _)| camera);
    let sure = shifts.filter(|c| c.size_px() > SURE_SHIFT * c.sd_px());
    // one picture alone may have something pass before its patches
    let mut sizes_px: Vec<f64> = sure.map(CameraShift::size_px).collect();
    sizes_px.sort_by(|a, b| b.total_cmp(a));
    let greatest_px = sizes_px.get(1).copied().unwrap_or(0.0);
    // pictures that do not show where the camera looks
    let silent = located.iter().any(Option::is_none);
    let still = CameraShift::default();
    let shifts: Vec<CameraShift> = std::iter::once(still).chain(located.iter().flatten().map(|(c, _)| *c)).collect();
    let agreed: Vec<Vec<bool>> = located.into_iter().flatten().map(|(_, agreed)| agreed).collect();
    let taken_out = match options.steadying {
        Steadying::Always => true,
        Steadying::Never => false,
        // where some picture does not show the background well, no frame is risked for it
        Steadying::WhereNeeded => {
            let moves = greatest_px > CAMERA_MOVES_PX && agreed.len() >= FEWEST_PICTURES;
            !silent && (!points_px.is_empty() || moves)
        }
    };
    background.keep_steady(&agreed);
    let taken_out = taken_out && background.is_usable();
    let greatest_shift_px = if silent { 0.0 } else { greatest_px };
    let camera = Camera { greatest_shift_px, taken_out, ..Camera::default() };
    SurveyedCamera {
        background: taken_out.then_some(background),
        camera,
        // of an undecided picture nothing is known
        shifts: if taken_out && !silent { shifts } else { Vec::new() },
    }
}
