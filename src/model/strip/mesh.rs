//! The strip cut into elements, and integrals along it.
//!
//! An element of length h carries κ = a + b(2ξ − 1), 0 ≤ ξ ≤ 1, so that θ = θₑ + h(aξ + b(ξ² − ξ)) and its lower end has θₑ + ha. The freedoms are
//! (θ(0), a₁, b₁, a₂, b₂, …): each turns everything below it, which is what makes the sums here short.

use nalgebra::{DMatrix, DVector};

use super::Strip;

/// Gauss's points of an element, and their weights, on 0 ≤ ξ ≤ 1.
const POINTS: [f64; 4] =
    [0.069_431_844_202_973_71, 0.330_009_478_207_571_87, 0.669_990_521_792_428_1, 0.930_568_155_797_026_3];
const WEIGHTS: [f64; 4] =
    [0.173_927_422_568_726_93, 0.326_072_577_431_273_07, 0.326_072_577_431_273_07, 0.173_927_422_568_726_93];

/// Points of an element.
pub const POINTS_EACH: usize = POINTS.len();

/// Freedoms of the curvature of an element.
const FREEDOMS_EACH: usize = 2;

/// Elements and points of a strip.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    nodes_m: Vec<f64>,
    /// ∫₀^{ξᵢ} of Lagrange's polynomial j: a function's integral up to point i from its values at the points.
    upto: [[f64; POINTS_EACH]; POINTS_EACH],
}

impl Mesh {
    /// Elements where nothing else is said.
    pub const ELEMENTS: usize = 40;
    /// A boundary layer has died away after so many of its lengths: e⁻¹² is 6·10⁻⁶.
    const LAYERS: f64 = 12.0;

    /// A mesh of which half the elements lie where a thin boundary layer is, at the support or, of a hinged strip, at the free end.
    pub fn of(strip: &Strip, elements: usize) -> Self {
        let length_m = strip.length_m;
        let half = elements / 2;
        let part = |from_m: f64, until_m: f64, count: usize| {
            let step_m = (until_m - from_m) / count as f64;
            (0..count).map(move |k| from_m + step_m * k as f64)
        };
        let layer_m = strip.boundary_layer_m();
        let fine_m = if layer_m > 0.0 { (Self::LAYERS * layer_m).min(0.5 * length_m) } else { 0.5 * length_m };
        let nodes_m = part(0.0, fine_m, half).chain(part(fine_m, length_m, elements - half)).chain([length_m]);
        Self::at(nodes_m.collect())
    }

    /// A mesh of equal elements.
    pub fn uniform(length_m: f64, elements: usize) -> Self {
        Self::at((0..=elements).map(|k| length_m * k as f64 / elements as f64).collect())
    }

    fn at(nodes_m: Vec<f64>) -> Self {
        Self { nodes_m, upto: integrals_upto_points() }
    }

    /// Elements.
    pub fn elements(&self) -> usize {
        self.nodes_m.len() - 1
    }

    /// Freedoms: θ(0), and two of the curvature an element.
    pub fn freedoms(&self) -> usize {
        1 + FREEDOMS_EACH * self.elements()
    }

    /// Points.
    pub fn points(&self) -> usize {
        POINTS_EACH * self.elements()
    }

    /// L.
    pub fn length_m(&self) -> f64 {
        self.nodes_m[self.elements()]
    }

    fn size_m(&self, element: usize) -> f64 {
        self.nodes_m[element + 1] - self.nodes_m[element]
    }

    /// s of a point.
    pub fn s_m(&self, point: usize) -> f64 {
        let element = point / POINTS_EACH;
        self.nodes_m[element] + self.size_m(element) * POINTS[point % POINTS_EACH]
    }

    /// Weight of a point in an integral along the strip.
    pub fn weight_m(&self, point: usize) -> f64 {
        self.size_m(point / POINTS_EACH) * WEIGHTS[point % POINTS_EACH]
    }

    /// θ at the points.
    pub fn angles(&self, freedoms: &[f64]) -> Vec<f64> {
        let mut angle = freedoms[0];
        let mut angles = Vec::with_capacity(self.points());
        for (element, curvature) in freedoms[1..].chunks_exact(FREEDOMS_EACH).enumerate() {
            let h = self.size_m(element);
            angles.extend(POINTS.map(|xi| angle + h * (curvature[0] * xi + curvature[1] * (xi * xi - xi))));
            angle += h * curvature[0];
        }
        angles
    }

    /// κ at the points.
    pub fn curvatures(&self, freedoms: &[f64]) -> Vec<f64> {
        let of_element = |of: &[f64]| POINTS.map(|xi| of[0] + of[1] * (2.0 * xi - 1.0));
        freedoms[1..].chunks_exact(FREEDOMS_EACH).flat_map(of_element).collect()
    }

    /// θ at any place.
    pub fn angle_at(&self, freedoms: &[f64], s_m: f64) -> f64 {
        let mut angle = freedoms[0];
        for (element, curvature) in freedoms[1..].chunks_exact(FREEDOMS_EACH).enumerate() {
            let h = self.size_m(element);
            let xi = ((s_m - self.nodes_m[element]) / h).min(1.0);
            if xi <= 0.0 {
                break;
            }
            angle += h * (curvature[0] * xi + curvature[1] * (xi * xi - xi));
        }
        angle
    }

    /// ∫₀ˢ of a function of θ, at any place: each element's share by its points.
    pub fn integral_upto(&self, freedoms: &[f64], s_m: f64, of: impl Fn(f64) -> f64) -> f64 {
        self.integral_of_place(s_m, |s_m| of(self.angle_at(freedoms, s_m)))
    }

    /// ∫₀ˢ cos θ δθ ds, at any place: how far a small turn moves it along x.
    pub fn integral_of_turn(&self, freedoms: &[f64], turn: &[f64], s_m: f64) -> f64 {
        self.integral_of_place(s_m, |s_m| self.angle_at(freedoms, s_m).cos() * self.angle_at(turn, s_m))
    }

    fn integral_of_place(&self, s_m: f64, of: impl Fn(f64) -> f64) -> f64 {
        let mut sum = 0.0;
        for element in 0..self.elements() {
            let from_m = self.nodes_m[element];
            let reach_m = (s_m - from_m).min(self.size_m(element));
            if reach_m <= 0.0 {
                break;
            }
            sum += reach_m * POINTS.into_iter().zip(WEIGHTS).map(|(xi, w)| w * of(from_m + xi * reach_m)).sum::<f64>();
        }
        sum
    }

    /// ∫₀^{s} of a function given at the points, up to each of them.
    pub fn integrals(&self, values: &[f64]) -> Vec<f64> {
        let mut start = 0.0;
        let mut integrals = Vec::with_capacity(values.len());
        for (element, of) in values.chunks_exact(POINTS_EACH).enumerate() {
            let h = self.size_m(element);
            integrals.extend(self.upto.map(|row| start + h * dot(&row, of)));
            start += h * dot(&WEIGHTS, of);
        }
        integrals
    }

    /// A function given at the points, between them or beyond the last: by Lagrange's polynomials of the element.
    pub fn interpolated(&self, values: &[f64], s_m: f64) -> f64 {
        let element = self.nodes_m.partition_point(|node| *node <= s_m).clamp(1, self.elements()) - 1;
        let xi = (s_m - self.nodes_m[element]) / self.size_m(element);
        (0..POINTS_EACH).map(|j| lagrange(j, xi) * values[element * POINTS_EACH + j]).sum()
    }

    /// The adjoint of [`Mesh::integrals`]: Σ_q wᵧ Aᵧᵣ fᵧ, what acts below each point r, times that point's weight.
    pub fn below(&self, values: &[f64]) -> Vec<f64> {
        let mut below = vec![0.0; values.len()];
        let mut later = 0.0;
        for element in (0..self.elements()).rev() {
            let h = self.size_m(element);
            let of = &values[element * POINTS_EACH..][..POINTS_EACH];
            for r in 0..POINTS_EACH {
                let own: f64 = (0..POINTS_EACH).map(|q| WEIGHTS[q] * self.upto[q][r] * of[q]).sum();
                below[element * POINTS_EACH + r] = h * (h * own + WEIGHTS[r] * later);
            }
            later += h * dot(&WEIGHTS, of);
        }
        below
    }

    /// Σᵣ cᵣ ∂θᵣ/∂q.
    pub fn along_freedoms(&self, at_points: &[f64]) -> DVector<f64> {
        let mut along = DVector::zeros(self.freedoms());
        let mut later = 0.0;
        for element in (0..self.elements()).rev() {
            let h = self.size_m(element);
            let of = &at_points[element * POINTS_EACH..][..POINTS_EACH];
            let first = 1 + FREEDOMS_EACH * element;
            along[first] = h * (moment(of, |xi| xi) + later);
            along[first + 1] = h * moment(of, |xi| xi * xi - xi);
            later += of.iter().sum::<f64>();
        }
        along[0] = later;
        along
    }

    /// Σᵣ cᵣ ∂κᵣ/∂q.
    pub fn along_curvatures(&self, at_points: &[f64]) -> DVector<f64> {
        let mut along = DVector::zeros(self.freedoms());
        for (element, of) in at_points.chunks_exact(POINTS_EACH).enumerate() {
            let first = 1 + FREEDOMS_EACH * element;
            along[first] = of.iter().sum();
            along[first + 1] = moment(of, |xi| 2.0 * xi - 1.0);
        }
        along
    }

    /// Adds Σᵣ cᵣ (∂κᵣ/∂q)(∂κᵣ/∂q)ᵀ.
    pub fn add_of_curvatures(&self, at_points: &[f64], matrix: &mut DMatrix<f64>) {
        for (element, of) in at_points.chunks_exact(POINTS_EACH).enumerate() {
            let (a, b) = (1 + FREEDOMS_EACH * element, 2 + FREEDOMS_EACH * element);
            let mixed = moment(of, |xi| 2.0 * xi - 1.0);
            matrix[(a, a)] += of.iter().sum::<f64>();
            matrix[(a, b)] += mixed;
            matrix[(b, a)] += mixed;
            matrix[(b, b)] += moment(of, |xi| (2.0 * xi - 1.0).powi(2));
        }
    }

    /// Adds Σᵣ cᵣ (∂θᵣ/∂q)(∂θᵣ/∂q)ᵀ. What a freedom does to all points below its element is one number, so a row needs one sum.
    pub fn add_of_angles(&self, at_points: &[f64], matrix: &mut DMatrix<f64>) {
        let ends = self.turned_below();
        let mut later = 0.0;
        for element in (0..self.elements()).rev() {
            let h = self.size_m(element);
            let of = &at_points[element * POINTS_EACH..][..POINTS_EACH];
            let (a, b) = (1 + FREEDOMS_EACH * element, 2 + FREEDOMS_EACH * element);
            let with_above = [h * (moment(of, |xi| xi) + later), h * moment(of, |xi| xi * xi - xi)];
            for (row, share) in [a, b].into_iter().zip(with_above) {
                for (column, end) in ends[..a].iter().enumerate() {
                    matrix[(row, column)] += share * end;
                    matrix[(column, row)] += share * end;
                }
            }
            let mixed = h * h * moment(of, |xi| xi * (xi * xi - xi));
            matrix[(a, a)] += h * h * (moment(of, |xi| xi * xi) + later);
            matrix[(a, b)] += mixed;
            matrix[(b, a)] += mixed;
            matrix[(b, b)] += h * h * moment(of, |xi| (xi * xi - xi).powi(2));
            later += of.iter().sum::<f64>();
        }
        matrix[(0, 0)] += later;
    }

    /// What each freedom turns all that lies below its own element by.
    fn turned_below(&self) -> Vec<f64> {
        std::iter::once(1.0).chain((0..self.elements()).flat_map(|element| [self.size_m(element), 0.0])).collect()
    }

    /// ∂θ/∂q at the points: points × freedoms.
    pub fn angle_derivatives(&self) -> DMatrix<f64> {
        self.integral_derivatives(None)
    }

    /// ∂/∂q of ∫₀ˢ F(θ) ds at the points, with F′(θ) given there: points × freedoms.
    pub fn displacement_derivatives(&self, slope: &[f64]) -> DMatrix<f64> {
        self.integral_derivatives(Some(slope))
    }

    /// ∂θ/∂q, or its integral with a weight.
    fn integral_derivatives(&self, weight: Option<&[f64]>) -> DMatrix<f64> {
        let mut derivatives = DMatrix::zeros(self.points(), self.freedoms());
        let ends = self.turned_below();
        let mut column = vec![0.0; self.points()];
        for freedom in 0..self.freedoms() {
            let element = freedom.saturating_sub(1) / FREEDOMS_EACH;
            let (start, h) = (element * POINTS_EACH, self.size_m(element));
            column[..start].fill(0.0);
            column[start..].fill(ends[freedom]);
            if freedom > 0 {
                let own: fn(f64) -> f64 = if (freedom - 1) % FREEDOMS_EACH == 0 { |xi| xi } else { |xi| xi * xi - xi };
                for (value, xi) in column[start..].iter_mut().zip(POINTS) {
                    *value = h * own(xi);
                }
            }
            match weight {
                None => derivatives.column_mut(freedom).copy_from_slice(&column),
                Some(weight) => {
                    column.iter_mut().zip(weight).for_each(|(value, weight)| *value *= weight);
                    derivatives.column_mut(freedom).copy_from_slice(&self.integrals(&column));
                }
            }
        }
        derivatives
    }
}

fn dot(a: &[f64; POINTS_EACH], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Σ cᵢ f(ξᵢ) over an element.
fn moment(of: &[f64], shape: impl Fn(f64) -> f64) -> f64 {
    of.iter().zip(POINTS).map(|(value, xi)| value * shape(xi)).sum()
}

/// ℓⱼ, which is one at a point and zero at the others.
fn lagrange(j: usize, xi: f64) -> f64 {
    (0..POINTS_EACH).filter(|k| *k != j).map(|k| (xi - POINTS[k]) / (POINTS[j] - POINTS[k])).product()
}

/// ∫₀^{ξᵢ} ℓⱼ dξ with Lagrange's polynomials ℓⱼ through the points.
fn integrals_upto_points() -> [[f64; POINTS_EACH]; POINTS_EACH] {
    // four points are exact up to the seventh power, ℓⱼ is a cubic
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            POINTS[i] * POINTS.into_iter().zip(WEIGHTS).map(|(xi, w)| w * lagrange(j, POINTS[i] * xi)).sum::<f64>()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh() -> (Mesh, DVector<f64>) {
        let mesh = Mesh::at(vec![0.0, 0.02, 0.07, 0.1, 0.2]);
        let freedoms = DVector::from_fn(mesh.freedoms(), |i, _| (1.0 + 1.7 * i as f64).sin());
        (mesh, freedoms)
    }

    #[test]
    fn sums_along_the_freedoms_are_those_of_the_derivatives() {
        let (mesh, _) = mesh();
        let at = DVector::from_fn(mesh.points(), |i, _| (0.3 + i as f64).cos());
        let derivatives = mesh.angle_derivatives();
        assert!((mesh.along_freedoms(at.as_slice()) - derivatives.tr_mul(&at)).amax() < 1e-14);
        let mut matrix = DMatrix::zeros(mesh.freedoms(), mesh.freedoms());
        mesh.add_of_angles(at.as_slice(), &mut matrix);
        let whole = derivatives.transpose() * DMatrix::from_diagonal(&at) * &derivatives;
        assert!((matrix - whole).amax() < 1e-14);
    }

    #[test]
    fn what_acts_below_is_the_adjoint_of_the_integral() {
        let (mesh, _) = mesh();
        let force = DVector::from_fn(mesh.points(), |i, _| (0.9 * i as f64).sin());
        let turn = DVector::from_fn(mesh.points(), |i, _| (0.2 + 0.4 * i as f64).cos());
        let weights = DVector::from_fn(mesh.points(), |i, _| mesh.weight_m(i));
        let work = DVector::from_vec(mesh.integrals(turn.as_slice())).component_mul(&weights).dot(&force);
        let adjoint = DVector::from_vec(mesh.below(force.as_slice())).dot(&turn);
        assert!((work - adjoint).abs() < 1e-15 + 1e-13 * work.abs());
    }

    #[test]
    fn derivatives_of_displacements_are_those_of_their_differences() {
        let (mesh, freedoms) = mesh();
        let x = |freedoms: &DVector<f64>| -> DVector<f64> {
            let sines: Vec<f64> = mesh.angles(freedoms.as_slice()).iter().map(|a| a.sin()).collect();
            DVector::from_vec(mesh.integrals(&sines))
        };
        let cosines: Vec<f64> = mesh.angles(freedoms.as_slice()).iter().map(|a| a.cos()).collect();
        let derivatives = mesh.displacement_derivatives(&cosines);
        for k in 0..mesh.freedoms() {
            let mut moved = [freedoms.clone(), freedoms.clone()];
            moved[0][k] += 1e-5;
            moved[1][k] -= 1e-5;
            let difference = (x(&moved[0]) - x(&moved[1])) / 2e-5;
            assert!((difference - derivatives.column(k)).amax() < 1e-10, "freedom {k}");
        }
    }

    #[test]
    fn angles_and_integrals_at_a_place_are_those_at_the_points() {
        let (mesh, freedoms) = mesh();
        let freedoms = freedoms.as_slice();
        let angles = mesh.angles(freedoms);
        let sines: Vec<f64> = angles.iter().map(|a| a.sin()).collect();
        let x_m = mesh.integrals(&sines);
        for point in 0..mesh.points() {
            assert!((mesh.angle_at(freedoms, mesh.s_m(point)) - angles[point]).abs() < 1e-14);
            assert!((mesh.integral_upto(freedoms, mesh.s_m(point), f64::sin) - x_m[point]).abs() < 1e-6);
        }
    }
}
