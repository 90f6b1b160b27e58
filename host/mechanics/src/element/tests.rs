//! Elements against fields whose strains, forces and volumes are known by hand.

mod shape;

use super::kind::{Elements, Points};
use super::reference::Reference;
use super::*;
use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;

fn assert_close(a: [f64; 4], b: [f64; 4]) {
    for (a, b) in a.iter().zip(b) {
        assert_relative_eq!(*a, b, epsilon = 1e-14);
    }
}

#[test]
fn facets_along_the_coordinates_carry_the_global_shear_stress() {
    let stress = [1.0, 2.0, 3.0, 4.0];
    let vertical = Axes::of_facet([0.0, -2.0]);
    assert_close(vertical.stress_from_global(stress), [2.0, 1.0, 3.0, 4.0]);
    let horizontal = Axes::of_facet([-1.0, 0.0]);
    assert_close(horizontal.stress_from_global(stress), stress);
}

#[test]
fn an_inclined_facet_follows_equation_1_of_the_paper() {
    let alpha: f64 = 0.3;
    let (s, c) = alpha.sin_cos();
    let [s11, s22, s12] = [1.0, 2.0, 4.0];
    let local = Axes::of_facet([c, s]).stress_from_global([s11, s22, 3.0, s12]);
    assert_relative_eq!(
        local[1],
        s * s * s11 + c * c * s22 - 2.0 * s * c * s12,
        epsilon = 1e-14
    );
    let tau = -s * c * s11 + s * c * s22 + (c * c - s * s) * s12;
    assert_relative_eq!(local[3], tau, epsilon = 1e-14);
}

#[test]
fn turning_a_stress_there_and_back_changes_nothing() {
    let axes = Axes::of_facet([0.6, 0.8]);
    let stress = [1.0, -2.0, 3.0, 4.0];
    assert_close(
        axes.stress_to_global(axes.stress_from_global(stress)),
        stress,
    );
}

/// Straight sides between these corners, nodes in their middles.
fn with_middles<const C: usize, const N: usize>(
    coordinates: &mut Vec<[f64; 2]>,
    elements: &[[usize; C]],
) -> Vec<[usize; N]> {
    let mut middles = std::collections::HashMap::new();
    let mut with_middles = |corners: &[usize; C]| {
        std::array::from_fn(|i| {
            if i < C {
                return corners[i];
            }
            let (a, b) = (corners[i - C], corners[(i - C + 1) % C]);
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let [p, q] = [coordinates[a], coordinates[b]];
                coordinates.push([0, 1].map(|c| f64::midpoint(p[c], q[c])));
                coordinates.len() - 1
            })
        })
    };
    elements.iter().map(&mut with_middles).collect()
}

/// Elements of a kind, all with these axes and points.
fn build<N: AsRef<[usize]>>(
    kind: &Kind,
    analysis: Analysis,
    coordinates: &[[f64; 2]],
    nodes: &[N],
    axes: Axes,
    points: Points,
) -> Result<Box<dyn Kinematics>, BadShape> {
    let nodes: Vec<&[usize]> = nodes.iter().map(AsRef::as_ref).collect();
    (kind.build)(Elements {
        analysis,
        coordinates,
        axes: vec![axes; nodes.len()],
        nodes: &nodes,
        points: &|_| points,
    })
}

/// The rectangle from (1, 0) to (3, 2) in elements around a corner that lies off its centre.
struct Patch {
    coordinates: Vec<[f64; 2]>,
    elements: Box<dyn Kinematics>,
}

const CENTRE: [f64; 2] = [1.8, 1.3];

fn patch_of_quads(kind: &Kind, analysis: Analysis, axes: Axes, rule: (usize, usize)) -> Patch {
    let mut coordinates = vec![
        [1.0, 0.0],
        [2.2, 0.0],
        [3.0, 0.0],
        [1.0, 0.9],
        CENTRE,
        [3.0, 0.7],
        [1.0, 2.0],
        [1.7, 2.0],
        [3.0, 2.0],
    ];
    let corners = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]];
    let nodes: Vec<[usize; 8]> = with_middles(&mut coordinates, &corners);
    let mut nodes: Vec<Vec<usize>> = nodes.iter().map(|nodes| nodes.to_vec()).collect();
    if kind == &QUAD9 {
        for own in &mut nodes {
            let middle = [0, 1].map(|c| own[..4].iter().map(|&n| 0.25 * coordinates[n][c]).sum());
            own.push(coordinates.len());
            coordinates.push(middle);
        }
    }
    let points = Points::at(rule.0, rule.1);
    let elements = build(kind, analysis, &coordinates, &nodes, axes, points).unwrap();
    Patch {
        coordinates,
        elements,
    }
}

fn patch_of_triangles(analysis: Analysis, axes: Axes, n_points: usize) -> Patch {
    let mut coordinates = vec![[1.0, 0.0], [3.0, 0.0], [3.0, 2.0], [1.0, 2.0], CENTRE];
    let corners = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
    let nodes: Vec<[usize; 6]> = with_middles(&mut coordinates, &corners);
    let points = Points::at(n_points, 1);
    let elements = build(&TRI6, analysis, &coordinates, &nodes, axes, points).unwrap();
    Patch {
        coordinates,
        elements,
    }
}

/// Patches of all elements and rules.
fn patches(analysis: Analysis, axes: Axes) -> Vec<Patch> {
    let quads = [(2, 2), (3, 3)].map(|rule| patch_of_quads(&QUAD8, analysis, axes, rule));
    let nine = patch_of_quads(&QUAD9, analysis, axes, (3, 3));
    let triangles = [3, 6, 7].map(|n| patch_of_triangles(analysis, axes, n));
    quads.into_iter().chain([nine]).chain(triangles).collect()
}

impl Patch {
    fn displacement(&self, field: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<f64> {
        self.coordinates.iter().flat_map(|&at| field(at)).collect()
    }

    fn strains(&self, displacement: &[f64]) -> Vec<f64> {
        let mut strains = vec![0.0; 4 * self.elements.n_points()];
        self.elements.add_gradients(displacement, &mut strains);
        strains
    }

    fn forces(&self, stress: &[f64]) -> Vec<f64> {
        let mut force = vec![0.0; 2 * self.coordinates.len()];
        self.elements.add_forces(stress, &mut force);
        force
    }

    /// Stiffness of an element whose points all have this tangent.
    fn stiffness(&self, element: usize, tangent: &[f64; 16]) -> DMatrix<f64> {
        let n = 2 * self.elements.nodes(element).len();
        let mut stiffness = vec![0.0; n * n];
        let tangents = tangent.repeat(self.elements.points_of(0).len());
        self.elements.stiffness(element, &tangents, &mut stiffness);
        DMatrix::from_row_slice(n, n, &stiffness)
    }
}

const ANALYSES: [Analysis; 2] = [Analysis::PlaneStrain, Analysis::Axisymmetric];

/// Linear elasticity with λ = 2 and μ = 3.
#[rustfmt::skip]
const ELASTIC: [f64; 16] = [
    8.0, 2.0, 2.0, 0.0,
    2.0, 8.0, 2.0, 0.0,
    2.0, 2.0, 8.0, 0.0,
    0.0, 0.0, 0.0, 3.0,
];

#[test]
fn a_linear_displacement_gives_its_strain_everywhere() {
    for patch in patches(Analysis::PlaneStrain, Axes::GLOBAL) {
        let u = patch.displacement(|[x, y]| [0.5 + 2.0 * x - 3.0 * y, 1.0 - x + 4.0 * y]);
        for strain in patch.strains(&u).chunks_exact(4) {
            assert_close(strain.try_into().unwrap(), [2.0, 4.0, 0.0, -4.0]);
        }
    }
    for patch in patches(Analysis::Axisymmetric, Axes::GLOBAL) {
        let u = patch.displacement(|[r, z]| [2.0 * r, 1.0 - r + 4.0 * z]);
        for strain in patch.strains(&u).chunks_exact(4) {
            assert_close(strain.try_into().unwrap(), [2.0, 4.0, 2.0, -1.0]);
        }
    }
}

#[test]
fn rigid_motions_give_no_strain_and_no_force() {
    let turned = Axes::of_facet([0.8, 0.6]);
    for axes in [Axes::GLOBAL, turned] {
        for patch in patches(Analysis::PlaneStrain, axes) {
            let u = patch.displacement(|[x, y]| [0.3 - 0.7 * y, -0.2 + 0.7 * x]);
            for strain in patch.strains(&u) {
                assert_relative_eq!(strain, 0.0, epsilon = 1e-14);
            }
            for element in 0..4 {
                let nodes = patch.elements.nodes(element);
                let own = nodes
                    .iter()
                    .flat_map(|&node| [u[2 * node], u[2 * node + 1]]);
                let own = DVector::from_vec(own.collect());
                let force = patch.stiffness(element, &ELASTIC) * own;
                assert!(force.amax() < 1e-12, "{:e}", force.amax());
            }
        }
        for patch in patches(Analysis::Axisymmetric, axes) {
            let u = patch.displacement(|_| [0.0, 1.0]);
            for strain in patch.strains(&u) {
                assert_relative_eq!(strain, 0.0, epsilon = 1e-14);
            }
        }
    }
}

/// In plane strain no node inside is loaded; on the boundary Σ f y is the integral of the stress.
#[test]
fn a_constant_stress_is_in_equilibrium() {
    for patch in patches(Analysis::PlaneStrain, Axes::GLOBAL) {
        let stress = [5.0, -2.0, 1.0, 3.0].repeat(patch.elements.n_points());
        let forces = patch.forces(&stress);
        let mut first_moment = [0.0; 2];
        for (&[x, y], force) in patch.coordinates.iter().zip(forces.chunks_exact(2)) {
            let inside = x > 1.0 && x < 3.0 && y > 0.0 && y < 2.0;
            assert!(
                !inside || force.iter().all(|f| f.abs() < 1e-13),
                "{force:?}"
            );
            for c in 0..2 {
                first_moment[c] += force[c] * y;
            }
        }
        // ∫ (σ₁₂, σ₂₂) over an area of 4.
        assert_relative_eq!(first_moment[0], 3.0 * 4.0, max_relative = 1e-13);
        assert_relative_eq!(first_moment[1], -2.0 * 4.0, max_relative = 1e-13);
    }
}

#[test]
fn areas_and_volumes_are_exact() {
    for analysis in ANALYSES {
        for patch in patches(analysis, Axes::GLOBAL) {
            let sum: f64 = (0..patch.elements.n_points())
                .map(|point| patch.elements.weight(point))
                .sum();
            // The rectangle is 2 by 2, its centroid at r = 2.
            let exact = match analysis {
                Analysis::PlaneStrain => 4.0,
                Analysis::Axisymmetric => 2.0 * PI * 2.0 * 4.0,
            };
            assert_relative_eq!(sum, exact, max_relative = 1e-14);
            let areas = (0..4).map(|element| patch.elements.length(element).powi(2));
            assert_relative_eq!(areas.sum::<f64>(), 4.0, max_relative = 1e-14);
        }
    }
}

#[test]
fn stiffness_is_symmetric_and_resists_all_but_rigid_motions() {
    let turned = Axes::of_facet([0.8, 0.6]);
    for (analysis, rigid) in [(Analysis::PlaneStrain, 3), (Analysis::Axisymmetric, 1)] {
        for axes in [Axes::GLOBAL, turned] {
            // Quads with 2 × 2 points have another mode without strain.
            for patch in patches(analysis, axes).into_iter().skip(1) {
                for element in 0..4 {
                    let stiffness = patch.stiffness(element, &ELASTIC);
                    let skew = (&stiffness - stiffness.transpose()).amax();
                    assert!(skew < 1e-13 * stiffness.amax(), "{skew:e}");
                    let values = stiffness.symmetric_eigenvalues();
                    let small = values.iter().filter(|v| v.abs() < 1e-12 * values.amax());
                    assert_eq!(small.count(), rigid);
                    assert!(values.min() > -1e-12 * values.amax());
                }
            }
        }
    }
}

/// K u are the forces of the stress D ε(u), whatever the axes.
#[test]
fn stiffness_strain_and_forces_agree() {
    let tangent: [f64; 16] = std::array::from_fn(|i| ((7 * i) % 11) as f64 - 3.0);
    for analysis in ANALYSES {
        for patch in patches(analysis, Axes::of_facet([0.8, 0.6])) {
            let u = patch.displacement(|[x, y]| [(3.0 * x + y).sin(), (x - 2.0 * y).cos()]);
            let stress: Vec<f64> = patch
                .strains(&u)
                .chunks_exact(4)
                .flat_map(|e| -> [f64; 4] {
                    std::array::from_fn(|i| (0..4).map(|j| tangent[4 * i + j] * e[j]).sum())
                })
                .collect();
            let mut forces = patch.forces(&stress);
            for element in 0..4 {
                let nodes = patch.elements.nodes(element);
                let dofs: Vec<usize> = nodes.iter().flat_map(|&n| [2 * n, 2 * n + 1]).collect();
                let own = DVector::from_iterator(dofs.len(), dofs.iter().map(|&dof| u[dof]));
                let force = patch.stiffness(element, &tangent) * own;
                for (&dof, force) in dofs.iter().zip(&force) {
                    forces[dof] -= force;
                }
            }
            for rest in forces {
                assert_relative_eq!(rest, 0.0, epsilon = 1e-10);
            }
        }
    }
}

#[test]
fn elements_turned_inside_out_are_refused() {
    let new = |nodes: [usize; 6]| {
        let (analysis, points) = (Analysis::PlaneStrain, Points::at(3, 1));
        build(&TRI6, analysis, TRI6.places, &[nodes], Axes::GLOBAL, points)
    };
    assert!(new([0, 1, 2, 3, 4, 5]).is_ok());
    assert_eq!(
        new([0, 2, 1, 5, 4, 3]).unwrap_err(),
        BadShape { element: 0 }
    );
}

/// A disc of radius 1 as triangles around its centre, their third side a parabola through three
/// points of the circle: its area misses that of the circle by O(h⁴).
#[test]
fn curved_triangles_have_the_area_of_a_disc() {
    let area = |n: usize| {
        let angle = 2.0 * PI / n as f64;
        let on_circle = |k: f64| [(k * angle).cos(), (k * angle).sin()];
        let (mut coordinates, mut nodes) = (Vec::new(), Vec::new());
        for k in 0..n {
            let [a, b, middle] = [0.0, 1.0, 0.5].map(|part| on_circle(k as f64 + part));
            let first = coordinates.len();
            let halved = |p: [f64; 2]| p.map(|x| 0.5 * x);
            coordinates.extend([[0.0; 2], a, b, halved(a), middle, halved(b)]);
            nodes.push(std::array::from_fn::<usize, 6, _>(|i| first + i));
        }
        let (analysis, points) = (Analysis::PlaneStrain, Points::at(3, 1));
        let disc = build(&TRI6, analysis, &coordinates, &nodes, Axes::GLOBAL, points).unwrap();
        let weights = (0..disc.n_points()).map(|point| disc.weight(point));
        // Triangle and parabola.
        let (s, c) = (0.5 * angle).sin_cos();
        let exact = n as f64 * (s * c + 4.0 / 3.0 * s * (1.0 - c));
        let sum = weights.sum::<f64>();
        assert_relative_eq!(sum, exact, max_relative = 1e-14);
        sum
    };
    let errors = [8, 16, 32].map(|n| (area(n) - PI).abs());
    assert!(errors[0] < 1e-2);
    for pair in errors.windows(2) {
        assert_relative_eq!(pair[0] / pair[1], 16.0, max_relative = 0.05);
    }
}

/// Facets of one straight line at 45° have the same axes, whatever rounding makes of their coordinates.
#[test]
fn facets_of_a_straight_line_have_the_same_axes() {
    for slope in [1.0, -1.0] {
        let at = |i: i32| [0.1 * f64::from(i), 0.3 + slope * 0.1 * f64::from(i)];
        for (start, end) in (0..40).map(|i| (at(i), at(i + 1))) {
            let axes = Axes::of_facet([end[0] - start[0], end[1] - start[1]]);
            let first = Axes::of_facet([1.0, slope]);
            for (own, other) in [(axes.along, first.along), (axes.across, first.across)] {
                let product = own[0] * other[0] + own[1] * other[1];
                assert!((product - 1.0).abs() < 1e-12, "{start:?}: {axes:?}");
            }
        }
    }
}

/// A zero-thickness element from the axis outward. With r = L s its shape functions have the moments
/// ∫ N s ds = 0, 1/6, 1/3 and ∫ N s² ds = −1/60, 3/20, 1/5 (axis, outer end, middle), and the axis's own
/// ∫ N² s ds = 1/60.
#[test]
fn an_interface_on_the_axis_carries_a_linear_traction_and_holds_the_node_there() {
    use super::Joint6;
    use crate::mesh::Joint;
    use crate::problem::Integration;
    let length = 0.4;
    let places = [[0.0, 1.0], [length, 1.0], [0.5 * length, 1.0]];
    let coordinates: Vec<[f64; 2]> = places.into_iter().chain(places).collect();
    let joint = Joint {
        minus: [0, 1, 2],
        plus: [3, 4, 5],
        group: 0,
    };
    let element = Joint6::new(
        Analysis::Axisymmetric,
        &coordinates,
        &[joint],
        Integration::Nodes,
    );
    let (a, b) = (-3.0, 40.0);
    let traction = |r: f64| a + b * r;
    let flux = (0..3).flat_map(|point| [traction(element.position(point)[0]), 0.0]);
    let mut force = vec![0.0; 12];
    element.add_forces(&flux.collect::<Vec<_>>(), &mut force);
    let turn = 2.0 * std::f64::consts::PI * length * length;
    let moments = [(0.0, -1.0 / 60.0), (1.0 / 6.0, 0.15), (1.0 / 3.0, 0.2)];
    for (node, (constant, linear)) in moments.into_iter().enumerate() {
        let exact = turn * (a * constant + b * length * linear);
        assert_relative_eq!(
            force[2 * (node + 3) + 1],
            exact,
            max_relative = 1e-13,
            epsilon = 1e-14
        );
        assert_relative_eq!(
            force[2 * node + 1],
            -exact,
            max_relative = 1e-13,
            epsilon = 1e-14
        );
    }
    let mut stiffness = vec![0.0; 144];
    element.stiffness(0, &[1.0, 0.0, 0.0, 1.0].repeat(3), &mut stiffness);
    assert_relative_eq!(stiffness[12 * 7 + 7], turn / 60.0, max_relative = 1e-12);
    // Away from the axis its points are its nodes.
    let moved: Vec<[f64; 2]> = coordinates.iter().map(|[r, z]| [r + 1.0, *z]).collect();
    let element = Joint6::new(Analysis::Axisymmetric, &moved, &[joint], Integration::Nodes);
    let radii = [0, 1, 2].map(|point| element.position(point)[0]);
    assert_relative_eq!(radii[..], [1.0, 1.4, 1.2][..], max_relative = 1e-15);
}

/// A quad around (2, 1) whose first and third side, and whose others, are bowed by parts of their lengths.
fn bowed([across, up]: [f64; 2]) -> [[f64; 2]; 8] {
    let corners = [[1.2, 0.1], [3.0, 0.0], [2.8, 2.0], [1.0, 1.7]];
    std::array::from_fn(|i| {
        if i < 4 {
            return corners[i];
        }
        let [a, b] = [corners[i - 4], corners[(i - 3) % 4]];
        let by = if i % 2 == 0 { across } else { up };
        let across = [a[1] - b[1], b[0] - a[0]];
        std::array::from_fn(|c| f64::midpoint(a[c], b[c]) + by * across[c])
    })
}

/// Also with three points along bent sides the nodal forces of a linear stress are exact, so ground at rest stays at
/// rest.
#[test]
fn bent_quads_carry_a_linear_stress() {
    for (bows, n) in [
        ([0.1, 0.0], (3, 2)),
        ([0.0, -0.1], (2, 3)),
        ([0.1, 0.05], (3, 3)),
    ] {
        let coordinates = bowed(bows);
        let nodes = [0, 1, 2, 3, 4, 5, 6, 7];
        assert_eq!(quad8::bent(&coordinates), [n.0 == 3, n.1 == 3]);
        for analysis in ANALYSES {
            let forces = |strains, along| {
                let points = Points { along, strains };
                let quad = build(
                    &QUAD8,
                    analysis,
                    &coordinates,
                    &[nodes],
                    Axes::GLOBAL,
                    points,
                );
                let quad = quad.unwrap();
                let stress = |point| {
                    let [x, y] = quad.position(point);
                    let at = |a: f64, b: f64, c: f64| a + b * x + c * y;
                    [
                        at(5.0, 1.0, -7.0),
                        at(-2.0, 3.0, 9.0),
                        at(1.0, -4.0, 2.0),
                        at(3.0, 6.0, -5.0),
                    ]
                };
                let stress: Vec<f64> = (0..quad.n_points()).flat_map(stress).collect();
                let mut force = vec![0.0; 16];
                quad.add_forces(&stress, &mut force);
                force
            };
            let exact = forces(Strains::AtPoints, [4, 4]);
            let found = forces(Strains::ProjectedLinearVolume, [n.0, n.1]);
            for (found, exact) in found.iter().zip(&exact) {
                assert_relative_eq!(found, exact, epsilon = 1e-11);
            }
        }
    }
    assert_eq!(quad8::bent(&bowed([0.009, -0.009])), [false; 2]);
}

/// Nodes do not integrate N t r where all three grow along a side, nor anything on a curve; where the radius is the
/// same, or none exists, they do.
#[test]
fn tractions_that_are_gathered_at_nodes_have_exact_nodal_forces() {
    use super::Joint6;
    use crate::mesh::Joint;
    use crate::problem::Integration;
    let joint = Joint {
        minus: [0, 1, 2],
        plus: [3, 4, 5],
        group: 0,
    };
    let stress = |[x, y]: [f64; 2], axes: &Axes| {
        let [_, normal, _, shear] =
            axes.stress_from_global([3.0 + x, 5.0 - 2.0 * y, 0.0, 1.0 + 0.5 * x - y]);
        [normal, shear]
    };
    let of = |analysis, places: [[f64; 2]; 3], integration| {
        let coordinates: Vec<[f64; 2]> = places.into_iter().chain(places).collect();
        Joint6::new(analysis, &coordinates, &[joint], integration)
    };
    let forces = |element: &Joint6, flux: &[f64]| {
        let mut force = vec![0.0; 12];
        element.add_forces(flux, &mut force);
        force
    };
    let at_points = |element: &Joint6| -> Vec<f64> {
        let points = 0..element.n_points();
        points
            .flat_map(|point| stress(element.position(point), &element.axes_at(point)))
            .collect()
    };
    let (s, c) = 0.2_f64.sin_cos();
    let (s_2, c_2) = 0.4_f64.sin_cos();
    let inclined = [[1.0, 0.0], [1.6, 1.0], [1.3, 0.5]];
    let arc = [[1.0, 0.0], [c_2, s_2], [c, s]];
    let upright = [[1.0, 0.0], [1.0, 1.0], [1.0, 0.5]];
    for (analysis, places, is_exact) in [
        (Analysis::PlaneStrain, inclined, true),
        (Analysis::Axisymmetric, upright, true),
        (Analysis::Axisymmetric, inclined, false),
        (Analysis::PlaneStrain, arc, false),
    ] {
        let nodal = of(analysis, places, Integration::Nodes);
        let gathered = nodal.gathered(0, &stress);
        assert_eq!(gathered.is_none(), is_exact, "{analysis:?} {places:?}");
        let flux = gathered.map_or_else(|| at_points(&nodal), Vec::into_flattened);
        // Three Gauss points: to the fifth degree, which is all there is here.
        let gauss = of(analysis, places, Integration::Full);
        let exact = forces(&gauss, &at_points(&gauss));
        for (found, exact) in forces(&nodal, &flux).iter().zip(exact) {
            assert_relative_eq!(*found, exact, epsilon = 1e-12);
        }
    }
    // Axes at the nodes of an arc are those of the circle.
    let nodal = of(Analysis::PlaneStrain, arc, Integration::Nodes);
    for point in 0..3 {
        let [x, y] = nodal.position(point);
        let across = nodal.axes_at(point).across;
        assert_relative_eq!(x * across[0] + y * across[1], 1.0, epsilon = 1e-14);
    }
}
