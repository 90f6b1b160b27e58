//! Elements: how nodal displacements become strains (or jumps), and stresses (or tractions)
//! nodal forces. Physics of the material is elsewhere.
//!
//! Strains have components 11 22 33 12 with γ = 2ε₁₂, in axes of the element; jumps have normal
//! and tangential components.
//!
//! # Adding a kind of solid elements
//! A file with its [`Kind`], as `quad9` is, and its name in [`Kind::ALL`]: mesh, refinement, recovery, thin layers,
//! readers and writers of files take everything else from there. Two tables elsewhere list numbers of nodes: outlines in
//! the report's `contours.js`, cells in the package's `_mesh.py`. `tests` runs all kinds: patch test, volumes, division;
//! `tests/finite_element/nine_nodes.rs` shows closed forms. Elements that are no displacement elements with Gauss points implement [`Kinematics`].
//!
//! An interface element in addition has the places where it is inserted (`mesh::insert`).

mod joint6;
pub(crate) mod kind;
mod mixed;
mod projection;
mod quad8;
mod quad9;
mod reference;
mod solid;
#[cfg(test)]
mod tests;
mod tri6;

pub use joint6::Joint6;
pub use kind::Kind;
pub use mixed::Mixed;
pub use quad8::QUAD8;
pub use quad9::QUAD9;
pub use reference::{gauss, line_shape};
pub use solid::{BadShape, Strains};
pub use tri6::TRI6;

use crate::problem::Analysis;
use std::ops::Range;

/// Two unit vectors: along the facet (1) and across it (2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// Direction of component 1, along the facet.
    pub along: [f64; 2],
    /// Direction of component 2, across the facet.
    pub across: [f64; 2],
}

/// The component of a direction that says whether coordinates increase along it: the larger one. If
/// both are equal, also within round-off, it is the second one, so that the elements of a straight
/// line agree.
pub(crate) fn increase([x, y]: [f64; 2]) -> f64 {
    const EQUAL: f64 = 1e-6;
    if x.abs() > (1.0 + EQUAL) * y.abs() {
        x
    } else {
        y
    }
}

impl Axes {
    /// The global axes.
    pub const GLOBAL: Self = Self {
        along: [1.0, 0.0],
        across: [0.0, 1.0],
    };

    /// Axes of a facet in this direction. Both point towards increasing coordinates, so that
    /// the shear stress of a horizontal or vertical facet is the global σ₁₂.
    pub fn of_facet(direction: [f64; 2]) -> Self {
        let towards_increase = |v: [f64; 2]| {
            let length = v[0].hypot(v[1]).copysign(increase(v));
            [v[0] / length, v[1] / length]
        };
        Self {
            along: towards_increase(direction),
            across: towards_increase([-direction[1], direction[0]]),
        }
    }

    /// The same axes, turned so that the first one lies along a direction without reversing: for a
    /// curve and its chord.
    #[must_use]
    pub fn turned_along(&self, direction: [f64; 2]) -> Self {
        let length = direction[0].hypot(direction[1]);
        let product = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        let like = |v: [f64; 2], own: [f64; 2]| {
            let length = length.copysign(product(v, own));
            [v[0] / length, v[1] / length]
        };
        Self {
            along: like(direction, self.along),
            across: like([-direction[1], direction[0]], self.across),
        }
    }

    /// Stress components in global axes of a stress in these axes.
    pub fn stress_to_global(&self, s: [f64; 4]) -> [f64; 4] {
        let [m, n] = [self.along, self.across];
        let component = |i: usize, j: usize| {
            m[i] * m[j] * s[0] + n[i] * n[j] * s[1] + (m[i] * n[j] + n[i] * m[j]) * s[3]
        };
        [component(0, 0), component(1, 1), s[2], component(0, 1)]
    }

    /// Stress components in these axes of a stress in global axes.
    pub fn stress_from_global(&self, s: [f64; 4]) -> [f64; 4] {
        let product = |a: [f64; 2], b: [f64; 2]| {
            a[0] * (s[0] * b[0] + s[3] * b[1]) + a[1] * (s[3] * b[0] + s[1] * b[1])
        };
        [
            product(self.along, self.along),
            product(self.across, self.across),
            s[2],
            product(self.along, self.across),
        ]
    }
}

/// Normal and tangential traction at a place, in the axes there.
pub type Traction<'t> = &'t dyn Fn([f64; 2], &Axes) -> [f64; 2];

/// The elements of one group.
pub trait Kinematics: std::fmt::Debug + Send + Sync {
    /// Number of elements.
    fn n_elements(&self) -> usize;
    /// Number of integration points.
    fn n_points(&self) -> usize;
    /// Integration points of an element.
    fn points_of(&self, element: usize) -> Range<usize>;
    /// Element of an integration point, and the point's number within it.
    fn place_of(&self, point: usize) -> (usize, usize);
    /// Components of strain (4) or jump (2).
    fn n_components(&self) -> usize;
    /// Nodes of an element.
    fn nodes(&self, element: usize) -> &[usize];
    /// Coordinates of an integration point.
    fn position(&self, point: usize) -> [f64; 2];
    /// Weight of an integration point: the volume (of an interface: the area) it stands for.
    fn weight(&self, point: usize) -> f64;
    /// Volume of an element shared among its nodes, ∫ N dV; empty for interfaces.
    fn volumes(&self, element: usize) -> &[f64];
    /// Characteristic length of an element: the square root of its area, of an interface its
    /// length.
    fn length(&self, element: usize) -> f64;
    /// Axes of an element.
    fn axes(&self, element: usize) -> Axes;
    /// Axes of an integration point: those of its element, but where that is curved.
    fn axes_at(&self, point: usize) -> Axes {
        self.axes(self.place_of(point).0)
    }
    /// Adds the strains (jumps) of all points under nodal displacements (two per node) to `out`.
    fn add_gradients(&self, displacement: &[f64], out: &mut [f64]);
    /// Adds the nodal forces that balance the stresses (tractions) of all points to `force`.
    fn add_forces(&self, flux: &[f64], force: &mut [f64]);
    /// Tractions at the points of an element whose nodal forces are those of a traction (normal, tangential, by place
    /// and axes there), integrated exactly. `None` where the points integrate whatever is linear exactly, or no such
    /// tractions can be found.
    fn gathered(&self, _element: usize, _traction: Traction<'_>) -> Option<Vec<[f64; 2]>> {
        None
    }
    /// Some of the elements alone, if that can be had.
    fn only(&self, _elements: &[usize]) -> Option<Box<dyn Kinematics>> {
        None
    }
    /// Stiffness of an element from the tangents of its points (row-major), row-major, two
    /// degrees of freedom per node, in global axes. Overwrites `out`.
    fn stiffness(&self, element: usize, tangent: &[f64], out: &mut [f64]);
}

/// Volume per unit of area in the plane.
pub fn depth(analysis: Analysis, x: f64) -> f64 {
    match analysis {
        Analysis::Axisymmetric => 2.0 * std::f64::consts::PI * x,
        Analysis::PlaneStrain => 1.0,
    }
}
