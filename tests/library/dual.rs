//! Numbers that carry their derivatives.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// What the equations need of a number.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    fn of(value: f64) -> Self;
    fn sin_cos(self) -> (Self, Self);
    fn abs(self) -> Self;
}

impl Number for f64 {
    fn of(value: f64) -> Self {
        value
    }

    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }

    fn abs(self) -> Self {
        f64::abs(self)
    }
}

/// Number of derivatives carried.
pub const CARRIED: usize = 8;

/// a + Σ bᵢεᵢ with εᵢεⱼ = 0.
#[derive(Debug, Clone, Copy)]
pub struct Dual {
    pub value: f64,
    pub slopes: [f64; CARRIED],
}

impl Dual {
    /// The variable whose own derivative is number `i`.
    pub fn variable(value: f64, i: usize) -> Self {
        Self { value, slopes: std::array::from_fn(|k| if k == i { 1.0 } else { 0.0 }) }
    }

    /// `value`, with the derivatives `own` × its own + `others` × the other's.
    fn with(self, value: f64, own: f64, other: &Self, others: f64) -> Self {
        Self { value, slopes: std::array::from_fn(|k| own * self.slopes[k] + others * other.slopes[k]) }
    }

    fn scaled(self, value: f64, own: f64) -> Self {
        Self { value, slopes: self.slopes.map(|slope| own * slope) }
    }
}

impl Add for Dual {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.with(self.value + other.value, 1.0, &other, 1.0)
    }
}

impl Sub for Dual {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self.with(self.value - other.value, 1.0, &other, -1.0)
    }
}

impl Mul for Dual {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        self.with(self.value * other.value, other.value, &other, self.value)
    }
}

impl Div for Dual {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let inverse = 1.0 / other.value;
        let value = self.value * inverse;
        self.with(value, inverse, &other, -value * inverse)
    }
}

impl Neg for Dual {
    type Output = Self;

    fn neg(self) -> Self {
        self.scaled(-self.value, -1.0)
    }
}

impl Number for Dual {
    fn of(value: f64) -> Self {
        Self { value, slopes: [0.0; CARRIED] }
    }

    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.scaled(sin, cos), self.scaled(cos, -sin))
    }

    fn abs(self) -> Self {
        if self.value < 0.0 { -self } else { self }
    }
}
