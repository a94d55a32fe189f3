use freeswing::video::*;
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let workers: usize = std::env::args().nth(2).unwrap().parse().unwrap();
    let mut c = Container::open(path.as_ref()).unwrap();
    println!("{:?}", c.info);
    let mut n = 0u64;
    let mut sum = 0.0;
    let d = decode_in_order(&mut c, workers, &|f| (f.t_s, f.picture.y(10, 10)), &mut |(t, y)| { n += 1; sum += t + y; Ok(()) }).unwrap();
    println!("{n} {sum} {d:?}");
}
