//! Stored pixels → displayed pixels: the display matrix of the container, in right-angle turns and mirrorings.

/// A right-angle turn or mirroring, as a signed permutation: x′ = a x + c y, y′ = b x + d y, shifted to start at 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Orientation {
    a: i8,
    b: i8,
    c: i8,
    d: i8,
}

impl Default for Orientation {
    fn default() -> Self {
        Self { a: 1, b: 0, c: 0, d: 1 }
    }
}

impl Orientation {
    /// From the nine 32-bit words of a display matrix (a b u, c d v, x y w); `None` unless it is a right-angle turn.
    pub fn from_display_matrix(bytes: &[u8]) -> Option<Self> {
        let word = |i: usize| Some(i32::from_ne_bytes(bytes.get(4 * i..4 * i + 4)?.try_into().ok()?));
        let sign = |w: i32| -> i8 {
            // 16.16 fixed point; a scale other than one only changes the pixel size, not the direction
            if w.unsigned_abs() < 1 << 10 { 0 } else { w.signum() as i8 }
        };
        let o = Self { a: sign(word(0)?), b: sign(word(1)?), c: sign(word(3)?), d: sign(word(4)?) };
        let upright = o.a != 0 && o.d != 0 && o.b == 0 && o.c == 0;
        let lying = o.b != 0 && o.c != 0 && o.a == 0 && o.d == 0;
        (upright || lying).then_some(o)
    }

    /// Width and height change places.
    pub fn swaps_axes(self) -> bool {
        self.a == 0
    }

    /// Size of the displayed picture.
    pub fn size(self, (width, height): (usize, usize)) -> (usize, usize) {
        if self.swaps_axes() { (height, width) } else { (width, height) }
    }

    /// A vector in stored pixels → the same vector in displayed pixels.
    pub fn turn(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [a, b, c, d] = [self.a, self.b, self.c, self.d].map(f64::from);
        [a * x + c * y, b * x + d * y]
    }

    /// A point in stored pixels → displayed pixels, for a stored picture of `width` × `height`.
    pub fn point(self, p: [f64; 2], (width, height): (usize, usize)) -> [f64; 2] {
        let (right, bottom) = (width as f64 - 1.0, height as f64 - 1.0);
        let [x, y] = self.turn(p);
        let corners = [[0.0, 0.0], [right, 0.0], [0.0, bottom], [right, bottom]].map(|q| self.turn(q));
        let least = |axis: usize| corners.iter().map(|q| q[axis]).fold(f64::INFINITY, f64::min);
        [x - least(0), y - least(1)]
    }

    /// The inverse of [`Orientation::point`].
    pub fn stored_point(self, [x, y]: [f64; 2], size: (usize, usize)) -> [f64; 2] {
        let origin = self.point([0.0, 0.0], size);
        let [a, b, c, d] = [self.a, self.b, self.c, self.d].map(f64::from);
        let (dx, dy) = (x - origin[0], y - origin[1]);
        [a * dx + b * dy, c * dx + d * dy]
    }

    /// Degrees clockwise by which the stored picture is turned for display, for reports; mirrorings report their turn.
    pub fn degrees(self) -> i32 {
        match (self.a, self.b) {
            (1, _) => 0,
            (-1, _) => 180,
            (_, 1) => 90,
            _ => 270,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(a: i32, b: i32, c: i32, d: i32) -> Vec<u8> {
        [a << 16, b << 16, 0, c << 16, d << 16, 0, 0, 0, 1 << 30].iter().flat_map(|w| w.to_ne_bytes()).collect()
    }

    #[test]
    fn a_quarter_turn_moves_the_top_left_corner_to_the_top_right() {
        let o = Orientation::from_display_matrix(&matrix(0, 1, -1, 0)).unwrap();
        assert_eq!(o.size((4, 3)), (3, 4));
        assert_eq!(o.point([0.0, 0.0], (4, 3)), [2.0, 0.0]);
        assert_eq!(o.point([3.0, 0.0], (4, 3)), [2.0, 3.0]);
        assert_eq!(o.degrees(), 90);
        assert_eq!(o.stored_point(o.point([1.0, 2.0], (4, 3)), (4, 3)), [1.0, 2.0]);
    }

    #[test]
    fn a_half_turn_and_a_mirroring_keep_the_size() {
        let half = Orientation::from_display_matrix(&matrix(-1, 0, 0, -1)).unwrap();
        assert_eq!(half.point([0.0, 0.0], (4, 3)), [3.0, 2.0]);
        let flip = Orientation::from_display_matrix(&matrix(-1, 0, 0, 1)).unwrap();
        assert_eq!(flip.point([1.0, 1.0], (4, 3)), [2.0, 1.0]);
    }

    #[test]
    fn an_oblique_matrix_is_not_a_turn() {
        assert_eq!(Orientation::from_display_matrix(&matrix(1, 1, -1, 1)), None);
        assert_eq!(Orientation::from_display_matrix(&[0; 8]), None);
    }
}
