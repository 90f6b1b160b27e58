//! Elements of the plane with any number of nodes: solids, and thin layers in their own axes.
#![expect(
    clippy::inline_always,
    reason = "only what is inlined is compiled for the processor's own vector instructions"
)]

use super::kind::{Elements, Points};
use super::reference::{Functions, Reference, RulePoint};
use super::{Axes, Kinematics, depth, projection};
use crate::problem::Analysis;
use algebra::threads;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Elements that one thread takes at a time.
const PIECE: usize = 256;
/// Parts of the degrees of freedom that forces are added up in at the same time.
const PARTS: usize = 4;
/// Most integration points of an element.
const MOST_POINTS: usize = 9;

/// Elements of N nodes of one group.
#[derive(Debug)]
pub(super) struct Solid<const N: usize> {
    nodes: Vec<[usize; N]>,
    axes: Vec<Axes>,
    lengths: Vec<f64>,
    /// ∫ N dV of every element.
    volumes: Vec<[f64; N]>,
    has_linear_volume: bool,
    points_per_element: usize,
    /// Those of the elements of a piece together, piece after piece.
    points: Vec<Vec<Point<N>>>,
}

/// A point where the law is evaluated. With displacement components u₁, u₂ along the element's axes:
/// ε₁₁ = Σ a u₁, ε₂₂ = Σ b u₂, γ₁₂ = Σ (b u₁ + a u₂), ε₃₃ = Σ h u_r.
#[derive(Clone, Debug)]
pub(super) struct Point<const N: usize> {
    /// ∂N/∂x₁.
    pub(super) a: [f64; N],
    /// ∂N/∂x₂.
    pub(super) b: [f64; N],
    /// N/r; zero in plane strain.
    pub(super) h: [f64; N],
    pub(super) weight: f64,
    pub(super) position: [f64; 2],
}

/// What becomes of an element's strains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strains {
    /// Those at the points.
    AtPoints,
    /// Those at the points, with a volume strain that is linear in the coordinates.
    LinearVolume,
    /// Their projection on as many functions as there are points (`projection.rs`).
    Projected,
    /// The same, with a volume strain that is linear in the coordinates: of quads with more points along bent sides.
    ProjectedLinearVolume,
}

/// An element that is turned inside out or has no area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BadShape {
    /// Number of the element within the group.
    pub element: usize,
}

/// What follows from the nodes of one element.
struct Geometry<const N: usize> {
    points: Vec<Point<N>>,
    /// ∫ N dV.
    volumes: [f64; N],
    length: f64,
}

impl<const N: usize> Solid<N> {
    /// Elements that are described by a reference.
    ///
    /// # Errors
    /// An element whose Jacobian is not positive.
    pub(super) fn of_reference(
        reference: &Reference<N>,
        elements: Elements<'_>,
    ) -> Result<Self, BadShape> {
        let Elements {
            analysis,
            coordinates,
            nodes,
            axes,
            points,
        } = elements;
        let of_element = |nodes: &&[usize]| std::array::from_fn(|i| nodes[i]);
        let nodes: Vec<[usize; N]> = nodes.iter().map(of_element).collect();
        let first = (!nodes.is_empty()).then(|| points(0));
        let points_per_element = first.map_or(0, |first| (reference.rule)(first.along).len());
        let strains = first.map(|first| first.strains);
        let geometry = |element: usize| -> Result<Geometry<N>, BadShape> {
            let places = nodes[element].map(|n| coordinates[n]);
            Geometry::new(
                reference,
                analysis,
                &places,
                &axes[element],
                points(element),
            )
            .ok_or(BadShape { element })
        };
        let elements: Vec<usize> = (0..nodes.len()).collect();
        let pieces = threads::map(elements.chunks(PIECE), |elements| {
            let mut points = Vec::with_capacity(elements.len() * points_per_element);
            let mut sizes = Vec::with_capacity(elements.len());
            for &element in elements {
                let geometry = geometry(element)?;
                debug_assert_eq!(geometry.points.len(), points_per_element);
                points.extend(geometry.points);
                sizes.push((geometry.volumes, geometry.length));
            }
            Ok((points, sizes))
        });
        let pieces: Vec<_> = pieces.into_iter().collect::<Result<_, BadShape>>()?;
        let (points, sizes): (Vec<_>, Vec<_>) = pieces.into_iter().unzip();
        let (volumes, lengths) = sizes.into_iter().flatten().unzip();
        Ok(Self {
            nodes,
            axes,
            lengths,
            volumes,
            has_linear_volume: matches!(
                strains,
                Some(Strains::LinearVolume | Strains::ProjectedLinearVolume)
            ),
            points_per_element,
            points,
        })
    }

    /// Points of an element.
    fn own(&self, element: usize) -> &[Point<N>] {
        let start = element % PIECE * self.points_per_element;
        &self.points[element / PIECE][start..start + self.points_per_element]
    }

    fn point(&self, point: usize) -> &Point<N> {
        let (element, at) = self.place_of(point);
        &self.own(element)[at]
    }
}

impl<const N: usize> Geometry<N> {
    /// `None` if a Jacobian is not positive.
    fn new(
        reference: &Reference<N>,
        analysis: Analysis,
        places: &[[f64; 2]; N],
        axes: &Axes,
        Points { along, strains }: Points,
    ) -> Option<Self> {
        if !reference.is_regular(places) {
            return None;
        }
        let rule = (reference.rule)(along);
        let at = |points: &[RulePoint]| -> Option<Vec<Point<N>>> {
            let point = |&RulePoint { at, weights }: &RulePoint| {
                let shape = (reference.shape)(at);
                let point = Point::new(analysis, places, axes, shape)?;
                Some(Point {
                    weight: point.weight * weights[0] * weights[1],
                    ..point
                })
            };
            points.iter().map(point).collect()
        };
        let is_projected = matches!(strains, Strains::Projected | Strains::ProjectedLinearVolume);
        let is_curved = is_projected && reference.is_curved(places);
        let exact = if is_curved {
            (reference.exact_curved)()
        } else {
            (reference.exact)()
        };
        let fine = at(&exact)?;
        let mut own = if rule == exact {
            fine.clone()
        } else {
            at(&rule)?
        };
        if is_projected {
            let functions = reference.functions.as_ref()?;
            if is_curved {
                let basis = |rule: &[RulePoint], points: &[Point<N>]| {
                    let beyond_linear = |at| (functions.beyond_linear)(along, at);
                    projection::basis(rule, points, beyond_linear)
                };
                let (at_own, at_fine) = (basis(&rule, &own), basis(&exact, &fine));
                let values = projection::cardinal(&at_own, &at_fine)?;
                projection::project(&mut own, &fine, |q, fine| values[fine][q])?;
            } else {
                let value =
                    |q: usize, fine: usize| (functions.function)(rule[q].at, exact[fine].at);
                projection::project(&mut own, &fine, value)?;
            }
        }
        let volume = |i: usize| {
            let weights = exact.iter().zip(&fine);
            weights
                .map(|(at, point)| (reference.shape)(at.at).0[i] * point.weight)
                .sum()
        };
        Some(Self {
            volumes: std::array::from_fn(volume),
            length: (reference.area)(places).sqrt(),
            points: own,
        })
    }
}

/// Adds forces of elements to those of the degrees of freedom from the `first` on. Elements share nodes: their forces
/// are added in one order, whoever computed them and whoever adds them.
fn add_up<const N: usize>(
    first: usize,
    nodes: &[[usize; N]],
    forces: &[[[f64; 2]; N]],
    to: &mut [f64],
) {
    for (nodes, forces) in nodes.iter().zip(forces) {
        for (node, f) in nodes.iter().zip(forces) {
            // Those before the first wrap around.
            let at = (2 * node).wrapping_sub(first);
            if let Some([x, y]) = to.get_mut(at..at.wrapping_add(2)) {
                *x += f[0];
                *y += f[1];
            }
        }
    }
}

impl<const N: usize> Point<N> {
    /// `None` if the Jacobian is not positive.
    fn new(
        analysis: Analysis,
        places: &[[f64; 2]; N],
        axes: &Axes,
        (n, [d_xi, d_eta]): Functions<N>,
    ) -> Option<Self> {
        let sum = |f: &[f64; N], c: usize| -> f64 { (0..N).map(|i| f[i] * places[i][c]).sum() };
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
}

impl<const N: usize> Kinematics for Solid<N> {
    fn n_elements(&self) -> usize {
        self.nodes.len()
    }

    fn n_points(&self) -> usize {
        self.nodes.len() * self.points_per_element
    }

    fn points_of(&self, element: usize) -> Range<usize> {
        element * self.points_per_element..(element + 1) * self.points_per_element
    }

    fn place_of(&self, point: usize) -> (usize, usize) {
        let n = self.points_per_element;
        (point / n, point % n)
    }

    fn n_components(&self) -> usize {
        4
    }

    fn nodes(&self, element: usize) -> &[usize] {
        &self.nodes[element]
    }

    fn position(&self, point: usize) -> [f64; 2] {
        self.point(point).position
    }

    fn weight(&self, point: usize) -> f64 {
        self.point(point).weight
    }

    fn volumes(&self, element: usize) -> &[f64] {
        &self.volumes[element]
    }

    fn length(&self, element: usize) -> f64 {
        self.lengths[element]
    }

    fn axes(&self, element: usize) -> Axes {
        self.axes[element]
    }

    fn add_gradients(&self, displacement: &[f64], out: &mut [f64]) {
        let per_element = 4 * self.points_per_element;
        let piece = |(number, out): (usize, &mut [f64])| {
            let elements = self;
            let first = number * PIECE;
            Arch::new().dispatch(Gradients {
                elements,
                first,
                displacement,
                out,
            });
        };
        if self.nodes.len() > PIECE {
            threads::each(out.chunks_mut(PIECE * per_element).enumerate(), piece);
        } else {
            piece((0, out));
        }
    }

    fn add_forces(&self, flux: &[f64], force: &mut [f64]) {
        let per_element = 4 * self.points_per_element;
        let forces_of = |(number, flux): (usize, &[f64])| {
            let elements = self;
            let first = number * PIECE;
            Arch::new().dispatch(Forces {
                elements,
                first,
                flux,
            })
        };
        if self.nodes.len() <= PIECE {
            return add_up(0, &self.nodes, &forces_of((0, flux)), force);
        }
        let pieces = flux
            .chunks(PIECE * per_element)
            .zip(self.nodes.chunks(PIECE));
        let of_pieces = threads::map(pieces.enumerate(), |(number, (flux, nodes))| {
            let all = || nodes.iter().flatten().map(|node| 2 * node);
            let span = all().min()..all().max().map(|last| last + 2);
            (nodes, forces_of((number, flux)), span)
        });
        let per_part = 2 * (force.len() / 2).div_ceil(PARTS).max(1);
        let parts = force.chunks_mut(per_part).enumerate();
        threads::each(parts, |(part, force)| {
            let (first, end) = (part * per_part, part * per_part + force.len());
            for (nodes, forces, span) in &of_pieces {
                if span.start < Some(end) && span.end > Some(first) {
                    add_up(first, nodes, forces, force);
                }
            }
        });
    }

    fn only(&self, elements: &[usize]) -> Option<Box<dyn Kinematics>> {
        let of_piece = |elements: &[usize]| {
            let points = elements.iter().flat_map(|&element| self.own(element));
            points.cloned().collect()
        };
        Some(Box::new(Self {
            nodes: elements.iter().map(|&e| self.nodes[e]).collect(),
            axes: elements.iter().map(|&e| self.axes[e]).collect(),
            lengths: elements.iter().map(|&e| self.lengths[e]).collect(),
            volumes: elements.iter().map(|&e| self.volumes[e]).collect(),
            has_linear_volume: self.has_linear_volume,
            points_per_element: self.points_per_element,
            points: elements.chunks(PIECE).map(of_piece).collect(),
        }))
    }

    fn stiffness(&self, element: usize, tangent: &[f64], out: &mut [f64]) {
        if self.has_linear_volume {
            let (points, axes) = (self.own(element), &self.axes[element]);
            return projection::linear_volume_stiffness(points, axes, tangent, out);
        }
        let elements = self;
        Arch::new().dispatch(Stiffness {
            elements,
            element,
            tangent,
            out,
        });
    }
}

/// Strains of consecutive elements, compiled for the processor's own vector instructions.
struct Gradients<'a, const N: usize> {
    elements: &'a Solid<N>,
    first: usize,
    displacement: &'a [f64],
    out: &'a mut [f64],
}

impl<const N: usize> WithSimd for Gradients<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let per_element = 4 * self.elements.points_per_element;
        let (elements, u) = (self.elements, self.displacement);
        for (element, out) in (self.first..).zip(self.out.chunks_exact_mut(per_element)) {
            if elements.has_linear_volume {
                let mut strains = vec![0.0; per_element];
                elements.element_gradients(element, u, &mut strains);
                projection::linear_volume_strain(elements.own(element), &mut strains);
                let both = out.iter_mut().zip(strains);
                both.for_each(|(out, strain)| *out += strain);
            } else {
                elements.element_gradients(element, u, out);
            }
        }
    }
}

/// Nodal forces of consecutive elements, likewise.
struct Forces<'a, const N: usize> {
    elements: &'a Solid<N>,
    first: usize,
    flux: &'a [f64],
}

impl<const N: usize> WithSimd for Forces<'_, N> {
    type Output = Vec<[[f64; 2]; N]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let fluxes = self.flux.chunks_exact(4 * self.elements.points_per_element);
        let mut forces = Vec::with_capacity(fluxes.len());
        for (element, flux) in (self.first..).zip(fluxes) {
            if self.elements.has_linear_volume {
                let mut flux = flux.to_vec();
                projection::linear_volume_stress(self.elements.own(element), &mut flux);
                forces.push(self.elements.element_forces(element, &flux));
            } else {
                forces.push(self.elements.element_forces(element, flux));
            }
        }
        forces
    }
}

/// Stiffness of one element, likewise.
struct Stiffness<'a, const N: usize> {
    elements: &'a Solid<N>,
    element: usize,
    tangent: &'a [f64],
    out: &'a mut [f64],
}

impl<const N: usize> WithSimd for Stiffness<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.elements
            .element_stiffness(self.element, self.tangent, self.out);
    }
}

/// Σ u v: the second half of the products is added to the first, until one is left.
#[inline(always)]
fn dot<const N: usize>(u: &[f64; N], v: &[f64; N]) -> f64 {
    let mut p: [f64; N] = std::array::from_fn(|i| u[i] * v[i]);
    let mut n = N;
    while n > 1 {
        let half = n.div_ceil(2);
        for i in 0..n - half {
            p[i] += p[i + half];
        }
        n = half;
    }
    p[0]
}

/// The arithmetic of one element, inlined into what is compiled for the processor.
impl<const N: usize> Solid<N> {
    #[inline(always)]
    fn element_gradients(&self, element: usize, displacement: &[f64], strains: &mut [f64]) {
        let (nodes, axes) = (&self.nodes[element], &self.axes[element]);
        let u_r: [f64; N] = std::array::from_fn(|i| displacement[2 * nodes[i]]);
        let u_z: [f64; N] = std::array::from_fn(|i| displacement[2 * nodes[i] + 1]);
        let turned = |axis: [f64; 2]| -> [f64; N] {
            std::array::from_fn(|i| axis[0] * u_r[i] + axis[1] * u_z[i])
        };
        let (u_1, u_2) = (turned(axes.along), turned(axes.across));
        for (point, strain) in self.own(element).iter().zip(strains.chunks_exact_mut(4)) {
            strain[0] += dot(&point.a, &u_1);
            strain[1] += dot(&point.b, &u_2);
            strain[2] += dot(&point.h, &u_r);
            strain[3] += dot(&point.b, &u_1) + dot(&point.a, &u_2);
        }
    }

    /// Nodal forces in global axes.
    #[inline(always)]
    fn element_forces(&self, element: usize, flux: &[f64]) -> [[f64; 2]; N] {
        let axes = &self.axes[element];
        let (mut f_1, mut f_2, mut f_r) = ([0.0; N], [0.0; N], [0.0; N]);
        for (point, s) in self.own(element).iter().zip(flux.chunks_exact(4)) {
            let s: [f64; 4] = std::array::from_fn(|c| point.weight * s[c]);
            for i in 0..N {
                f_1[i] += point.a[i] * s[0] + point.b[i] * s[3];
                f_2[i] += point.b[i] * s[1] + point.a[i] * s[3];
                f_r[i] += point.h[i] * s[2];
            }
        }
        std::array::from_fn(|i| {
            [
                axes.along[0] * f_1[i] + axes.across[0] * f_2[i] + f_r[i],
                axes.along[1] * f_1[i] + axes.across[1] * f_2[i],
            ]
        })
    }

    /// Σ Bᵀ D B w, by blocks. With displacements u₁, u₂ along the element's axes, column i of B is (a, 0, h e₁, b) for
    /// u₁ and (0, b, h e₂, a) for u₂; e is the radial direction in these axes.
    #[inline(always)]
    fn element_stiffness(&self, element: usize, tangent: &[f64], out: &mut [f64]) {
        let axes = &self.axes[element];
        let radial = [axes.along[0], axes.across[0]];
        let points = self.own(element);
        // D B w of every point: by component, for u₁ and u₂.
        let mut db = [[[[0.0; N]; 4]; 2]; MOST_POINTS];
        for ((point, d), db) in points.iter().zip(tangent.chunks_exact(16)).zip(&mut db) {
            let (w, [on_1, on_2]) = (point.weight, db);
            for c in 0..4 {
                let d: [f64; 4] = std::array::from_fn(|e| w * d[4 * c + e]);
                let hoop = [d[2] * radial[0], d[2] * radial[1]];
                for j in 0..N {
                    on_1[c][j] = d[0] * point.a[j] + hoop[0] * point.h[j] + d[3] * point.b[j];
                    on_2[c][j] = d[1] * point.b[j] + hoop[1] * point.h[j] + d[3] * point.a[j];
                }
            }
        }
        for i in 0..N {
            // Rows of u₁ and u₂ of node i.
            let mut k = [[[0.0; N]; 2]; 2];
            for (point, db) in points.iter().zip(&db) {
                let (a, b) = (point.a[i], point.b[i]);
                let h = [point.h[i] * radial[0], point.h[i] * radial[1]];
                for (column, d) in db.iter().enumerate() {
                    for j in 0..N {
                        k[0][column][j] += a * d[0][j] + h[0] * d[2][j] + b * d[3][j];
                        k[1][column][j] += b * d[1][j] + h[1] * d[2][j] + a * d[3][j];
                    }
                }
            }
            let rows = &mut out[4 * N * i..4 * N * (i + 1)];
            write_rows(&k, axes, rows);
        }
    }
}

/// The rows of a node in an element's stiffness, from those along the element's axes.
#[inline(always)]
fn write_rows<const N: usize>(k: &[[[f64; N]; 2]; 2], axes: &Axes, rows: &mut [f64]) {
    if *axes == Axes::GLOBAL {
        for j in 0..N {
            for c in 0..2 {
                rows[2 * j + c] = k[0][c][j];
                rows[2 * N + 2 * j + c] = k[1][c][j];
            }
        }
        return;
    }
    // Rᵀ k R, with the axes as rows of R.
    let r = [axes.along, axes.across];
    for j in 0..N {
        for c in 0..2 {
            for e in 0..2 {
                rows[2 * N * c + 2 * j + e] = (0..2)
                    .map(|p| r[p][c] * (k[p][0][j] * r[0][e] + k[p][1][j] * r[1][e]))
                    .sum();
            }
        }
    }
}
