//! 8-node quads: solids, and thin layers in their own axes.

use super::shape::{gauss, quad_shape};
use super::{Axes, Kinematics, depth};
use crate::case::Analysis;
use nalgebra::{SMatrix, SVector};

/// 8-node quads of one group.
#[derive(Debug)]
pub struct Quad8 {
    nodes: Vec<[usize; 8]>,
    axes: Vec<Axes>,
    points_per_element: usize,
    points: Vec<Point>,
}

/// An integration point. With displacement components u₁, u₂ along the element's axes:
/// ε₁₁ = Σ a u₁, ε₂₂ = Σ b u₂, γ₁₂ = Σ (b u₁ + a u₂), ε₃₃ = Σ h u_r.
#[derive(Clone, Debug)]
struct Point {
    /// ∂N/∂x₁.
    a: [f64; 8],
    /// ∂N/∂x₂.
    b: [f64; 8],
    /// N/r; zero in plane strain.
    h: [f64; 8],
    weight: f64,
    position: [f64; 2],
}

/// An element that is turned inside out or has no area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BadShape {
    /// Number of the element within the group.
    pub element: usize,
}

impl Quad8 {
    /// Elements with `rule.0` × `rule.1` Gauss points along their first and second direction
    /// (from node 1 to node 2, from node 1 to node 4), in the given axes.
    ///
    /// # Errors
    /// An element whose Jacobian is not positive.
    pub fn new(
        analysis: Analysis,
        coordinates: &[[f64; 2]],
        nodes: Vec<[usize; 8]>,
        axes: Vec<Axes>,
        rule: impl Fn(usize) -> (usize, usize),
    ) -> Result<Self, BadShape> {
        let mut points = Vec::new();
        let mut points_per_element = 0;
        for (element, nodes) in nodes.iter().enumerate() {
            let corners = nodes.map(|n| coordinates[n]);
            let (n_xi, n_eta) = rule(element);
            points_per_element = n_xi * n_eta;
            let ((xi, w_xi), (eta, w_eta)) = (gauss(n_xi), gauss(n_eta));
            for (eta, w_eta) in eta.iter().zip(w_eta) {
                for (xi, w_xi) in xi.iter().zip(w_xi) {
                    let point = Point::new(analysis, &corners, &axes[element], *xi, *eta)
                        .ok_or(BadShape { element })?;
                    points.push(Point {
                        weight: point.weight * w_xi * w_eta,
                        ..point
                    });
                }
            }
        }
        Ok(Self {
            nodes,
            axes,
            points_per_element,
            points,
        })
    }

    /// Points of an element.
    fn points_of(&self, element: usize) -> &[Point] {
        &self.points[element * self.points_per_element..][..self.points_per_element]
    }
}

impl Point {
    /// `None` if the Jacobian is not positive.
    fn new(
        analysis: Analysis,
        corners: &[[f64; 2]; 8],
        axes: &Axes,
        xi: f64,
        eta: f64,
    ) -> Option<Self> {
        let (n, [d_xi, d_eta]) = quad_shape(xi, eta);
        let sum = |f: &[f64; 8], c: usize| -> f64 { (0..8).map(|i| f[i] * corners[i][c]).sum() };
        let position = [sum(&n, 0), sum(&n, 1)];
        // J = ∂(x, y)/∂(ξ, η)
        let (x_xi, y_xi, x_eta, y_eta) =
            (sum(&d_xi, 0), sum(&d_xi, 1), sum(&d_eta, 0), sum(&d_eta, 1));
        let determinant = x_xi * y_eta - y_xi * x_eta;
        if determinant.is_nan() || determinant <= 0.0 {
            return None;
        }
        let gradient = |i: usize| {
            [
                (y_eta * d_xi[i] - y_xi * d_eta[i]) / determinant,
                (x_xi * d_eta[i] - x_eta * d_xi[i]) / determinant,
            ]
        };
        let along = |v: [f64; 2], i: usize| {
            let g = gradient(i);
            v[0] * g[0] + v[1] * g[1]
        };
        let hoop = |i: usize| match analysis {
            Analysis::Axisymmetric => n[i] / position[0],
            Analysis::PlaneStrain => 0.0,
        };
        Some(Self {
            a: std::array::from_fn(|i| along(axes.along, i)),
            b: std::array::from_fn(|i| along(axes.across, i)),
            h: std::array::from_fn(hoop),
            weight: determinant * depth(analysis, position[0]),
            position,
        })
    }

    /// The matrix B of this point: strains from displacements along the element's axes.
    fn b(&self, axes: &Axes) -> SMatrix<f64, 4, 16> {
        let mut b = SMatrix::zeros();
        for i in 0..8 {
            b[(0, 2 * i)] = self.a[i];
            b[(1, 2 * i + 1)] = self.b[i];
            b[(2, 2 * i)] = self.h[i] * axes.along[0];
            b[(2, 2 * i + 1)] = self.h[i] * axes.across[0];
            b[(3, 2 * i)] = self.b[i];
            b[(3, 2 * i + 1)] = self.a[i];
        }
        b
    }
}

impl Kinematics for Quad8 {
    fn n_elements(&self) -> usize {
        self.nodes.len()
    }

    fn points_per_element(&self) -> usize {
        self.points_per_element
    }

    fn n_components(&self) -> usize {
        4
    }

    fn nodes(&self, element: usize) -> &[usize] {
        &self.nodes[element]
    }

    fn position(&self, point: usize) -> [f64; 2] {
        self.points[point].position
    }

    fn weight(&self, point: usize) -> f64 {
        self.points[point].weight
    }

    fn axes(&self, element: usize) -> Axes {
        self.axes[element]
    }

    fn add_gradients(&self, displacement: &[f64], out: &mut [f64]) {
        let mut strains = out.chunks_exact_mut(4);
        for (element, (nodes, axes)) in self.nodes.iter().zip(&self.axes).enumerate() {
            let u = nodes.map(|n| [displacement[2 * n], displacement[2 * n + 1]]);
            let u_1 = u.map(|u| axes.along[0] * u[0] + axes.along[1] * u[1]);
            let u_2 = u.map(|u| axes.across[0] * u[0] + axes.across[1] * u[1]);
            for (point, strain) in self.points_of(element).iter().zip(&mut strains) {
                for i in 0..8 {
                    strain[0] += point.a[i] * u_1[i];
                    strain[1] += point.b[i] * u_2[i];
                    strain[2] += point.h[i] * u[i][0];
                    strain[3] += point.b[i] * u_1[i] + point.a[i] * u_2[i];
                }
            }
        }
    }

    fn add_forces(&self, flux: &[f64], force: &mut [f64]) {
        let mut stresses = flux.chunks_exact(4);
        for (element, (nodes, axes)) in self.nodes.iter().zip(&self.axes).enumerate() {
            for (point, s) in self.points_of(element).iter().zip(&mut stresses) {
                let w = point.weight;
                for i in 0..8 {
                    let f_1 = w * (point.a[i] * s[0] + point.b[i] * s[3]);
                    let f_2 = w * (point.b[i] * s[1] + point.a[i] * s[3]);
                    let f_r = w * point.h[i] * s[2];
                    force[2 * nodes[i]] += axes.along[0] * f_1 + axes.across[0] * f_2 + f_r;
                    force[2 * nodes[i] + 1] += axes.along[1] * f_1 + axes.across[1] * f_2;
                }
            }
        }
    }

    fn stiffness(&self, element: usize, tangent: &[f64], out: &mut [f64]) {
        let axes = &self.axes[element];
        let mut k = SMatrix::<f64, 16, 16>::zeros();
        for (point, tangent) in self.points_of(element).iter().zip(tangent.chunks_exact(16)) {
            let b = point.b(axes);
            let d = SMatrix::<f64, 4, 4>::from_row_slice(tangent);
            k += b.tr_mul(&(d * b * point.weight));
        }
        if *axes != Axes::GLOBAL {
            k = to_global(&k, axes);
        }
        for (row, out) in out.chunks_exact_mut(16).enumerate() {
            for (column, out) in out.iter_mut().enumerate() {
                *out = k[(row, column)];
            }
        }
    }
}

/// Turns every 2 × 2 block from the element's axes to the global ones: Rᵀ k R.
fn to_global(k: &SMatrix<f64, 16, 16>, axes: &Axes) -> SMatrix<f64, 16, 16> {
    let r = SMatrix::<f64, 2, 2>::from_rows(&[
        SVector::from(axes.along).transpose(),
        SVector::from(axes.across).transpose(),
    ]);
    let mut out = SMatrix::<f64, 16, 16>::zeros();
    for i in (0..16).step_by(2) {
        for j in (0..16).step_by(2) {
            let block = r.tr_mul(&k.fixed_view::<2, 2>(i, j)) * r;
            out.fixed_view_mut::<2, 2>(i, j).copy_from(&block);
        }
    }
    out
}
