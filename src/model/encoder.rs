//! An encoder that sits off its shaft's axis, or askew on it.

use crate::experiment::EncoderError;

/// A part of the error of an encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum EncoderShape {
    /// 1.
    Zero,
    /// sin θ.
    Sine,
    /// cos θ.
    Cosine,
    /// sin 2θ.
    Sine2,
    /// cos 2θ.
    Cosine2,
}

impl EncoderShape {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Zero, Self::Sine, Self::Cosine, Self::Sine2, Self::Cosine2];

    /// Its value at an angle.
    pub fn at(self, theta_rad: f64) -> f64 {
        match self {
            Self::Zero => 1.0,
            Self::Sine => theta_rad.sin(),
            Self::Cosine => theta_rad.cos(),
            Self::Sine2 => (2.0 * theta_rad).sin(),
            Self::Cosine2 => (2.0 * theta_rad).cos(),
        }
    }

    /// Its derivative with the angle.
    fn slope(self, theta_rad: f64) -> f64 {
        match self {
            Self::Zero => 0.0,
            Self::Sine => theta_rad.cos(),
            Self::Cosine => -theta_rad.sin(),
            Self::Sine2 => 2.0 * (2.0 * theta_rad).cos(),
            Self::Cosine2 => -2.0 * (2.0 * theta_rad).sin(),
        }
    }
}

/// What is added to the angle of an encoder whose error comes again after one turn of the shaft, and after half a turn:
///
/// ```text
/// e(θ) = z + a₁ sin θ + b₁ cos θ + a₂ sin 2θ + b₂ cos 2θ
/// ```
///
/// A disc whose middle is ε beside the axis, read at radius r from one side, has √(a₁² + b₁²) = ε/r. Two shafts that meet in a Hooke's joint at an angle α have √(a₂² + b₂²) = α²/4,
/// and a magnet above a sensor, beside its middle, errs twice a turn as well. z is its zero: set where the specimen hangs at rest, it makes e(0) = 0.
impl EncoderError {
    /// e(θ) (rad).
    pub fn of_rad(&self, theta_rad: f64) -> f64 {
        EncoderShape::ALL.iter().map(|shape| self.coefficient_rad(*shape) * shape.at(theta_rad)).sum()
    }

    /// de/dθ.
    pub fn slope(&self, theta_rad: f64) -> f64 {
        EncoderShape::ALL.iter().map(|shape| self.coefficient_rad(*shape) * shape.slope(theta_rad)).sum()
    }

    /// The coefficient of a shape.
    pub fn coefficient_rad(&self, shape: EncoderShape) -> f64 {
        match shape {
            EncoderShape::Zero => self.zero_rad,
            EncoderShape::Sine => self.sine_rad,
            EncoderShape::Cosine => self.cosine_rad,
            EncoderShape::Sine2 => self.sine_2_rad,
            EncoderShape::Cosine2 => self.cosine_2_rad,
        }
    }

    /// The same, to be set.
    pub fn coefficient_mut(&mut self, shape: EncoderShape) -> &mut f64 {
        match shape {
            EncoderShape::Zero => &mut self.zero_rad,
            EncoderShape::Sine => &mut self.sine_rad,
            EncoderShape::Cosine => &mut self.cosine_rad,
            EncoderShape::Sine2 => &mut self.sine_2_rad,
            EncoderShape::Cosine2 => &mut self.cosine_2_rad,
        }
    }

    /// The most that the slope can be: below 1, what is read grows with the angle.
    pub fn steepest(&self) -> f64 {
        self.sine_rad.hypot(self.cosine_rad) + 2.0 * self.sine_2_rad.hypot(self.cosine_2_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_beside_its_axis_errs_once_a_turn_and_shafts_that_meet_at_an_angle_twice() {
        // a disc of radius 20 mm, 0.1 mm beside the axis, read from where it turns through at rest
        let (offset, radius, turned): (f64, f64, f64) = (0.1, 20.0, 0.7);
        let of_disc = EncoderError {
            sine_rad: offset / radius * turned.cos(),
            cosine_rad: offset / radius * turned.sin(),
            ..EncoderError::default()
        };
        let read = |theta: f64| {
            // the mark of the disc that stands at the reader, whose direction from the disc's own middle is read
            let middle = [offset * (theta + turned).cos(), offset * (theta + turned).sin()];
            theta - (0.0 - middle[1]).atan2(radius - middle[0])
        };
        // tan φ = cos α tan θ
        let angle: f64 = 0.2;
        let of_shafts = EncoderError { sine_2_rad: -0.25 * angle * angle, ..EncoderError::default() };
        for theta in [-1.2f64, -0.4, 0.3, 1.0, 2.4] {
            let by_disc = read(theta) - theta;
            assert!((by_disc - of_disc.of_rad(theta)).abs() < 2.0 * (offset / radius).powi(2), "{theta}");
            let by_shafts = (angle.cos() * theta.sin()).atan2(theta.cos()) - theta;
            assert!((by_shafts - of_shafts.of_rad(theta)).abs() < angle.powi(4) / 8.0, "{theta}");
        }
    }
}
