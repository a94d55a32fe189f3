use freeswing::detect::*;
use freeswing::experiment::MarkColour;
use freeswing::video::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let (lo, hi): (usize, usize) = (a[2].parse().unwrap(), a[3].parse().unwrap());
    let mut c = Container::open(a[1].as_ref()).unwrap();
    let hues: Vec<Hue> = a[4..]
        .iter()
        .map(|s| {
            let (n, t) = s.split_once('=').unwrap();
            Hue { colour: n.parse::<MarkColour>().unwrap(), marks: 1, threshold: t.parse().unwrap(), thin: false }
        })
        .collect();
    let d = Detector::new(hues);
    let mut i = 0;
    decode_in_order(&mut c, 2, &|f| (f.t_s, d.detect(&f.picture).unwrap()), &mut |(t, b)| {
        if i >= lo && i < hi {
            println!("{i} {t:.4}");
            for b in b {
                println!("   hue {} samples {} {:?} bin {:?}", b.hue, b.samples, b.centroid, b.binary_px);
            }
        }
        i += 1;
        Ok(())
    })
    .unwrap();
}
