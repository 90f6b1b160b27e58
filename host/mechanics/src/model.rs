//! From a problem to groups that can be computed: elements, their laws, initial stresses; and all that
//! can be checked before the first increment.

use crate::assembly::Tie;
use crate::check::{self, Cause, Item, Key, Refusal, constraints, plausibility, sign_check};
use crate::element::kind::{Elements, Points};
use crate::element::{Axes, Joint6, Kinematics, Mixed};
use crate::ground::InitialStresses;
use crate::group::{Group, PointFailure};
use crate::mesh::{Mesh, Solid};
use crate::problem::{
    Analysis, Axis, ElementGroup, Formulation, InPlane, InitialStress, Integration, Material,
    Problem,
};
use abi::Hypothesis;
use law::Operator;
use std::collections::{HashMap, HashSet};

/// If one side of a layer is this many times the other, its normal is unambiguous.
const CLEARLY: f64 = 2.0;

/// An effective stress at rest below this part of weight plus pore water, of which it is the difference, counts as
/// zero.
const ROUND_OFF_AT_REST: f64 = 1e-9;

/// A problem with its elements.
#[derive(Debug)]
pub struct Model {
    /// Groups, with the laws of the first phase.
    pub groups: Vec<Group>,
    /// Mid-thickness nodes that follow the two faces of a thin layer.
    pub ties: Vec<Tie>,
    /// For every phase but the first, the groups that take another law.
    pub swaps: Swaps,
    /// Warnings about implausible input.
    pub warnings: Vec<String>,
}

/// Why no model can be made of a problem.
#[derive(Clone, Debug)]
pub enum BuildError {
    /// A part of it does not fit.
    Refused(Box<Refusal>),
    /// A law cannot start from the stress it finds.
    CannotStart(Box<PointFailure>),
}

impl From<Refusal> for BuildError {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(Box::new(refusal))
    }
}

/// The hypothesis that a group's laws are built for. A thin layer takes interface laws and continuum laws, as
/// `is_interface_law` tells.
pub fn hypothesis(
    analysis: Analysis,
    formulation: Formulation,
    is_interface_law: bool,
) -> Hypothesis {
    match (formulation, analysis) {
        (Formulation::ZeroThickness, _) => Hypothesis::Interface2d,
        (Formulation::ThinLayer, _) if is_interface_law => Hypothesis::Interface2d,
        (_, Analysis::Axisymmetric) => Hypothesis::Axisymmetric,
        (_, Analysis::PlaneStrain) => Hypothesis::PlaneStrain,
    }
}

/// Groups that take other laws, by phase.
type Swaps = Vec<Vec<(usize, Material)>>;

/// The laws that groups start with and those that later phases swap them for. A phase's laws hold from it on; the
/// first phase's replace those of the groups at once.
fn materials(problem: &Problem) -> Result<(Vec<Material>, Swaps), Refusal> {
    let mut swaps = vec![Vec::new(); problem.phases.len()];
    let mut first = Vec::new();
    for (number, group) in problem.groups.iter().enumerate() {
        let mut own = None;
        for (phase, input) in problem.phases.iter().enumerate() {
            let swap = input.materials.iter().find(|(of, _)| *of == number);
            let Some((_, material)) = swap else { continue };
            check_law(problem, number, group, material, Some(phase))?;
            if phase == 0 {
                own = Some(material.clone());
            } else {
                swaps[phase].push((number, material.clone()));
            }
        }
        if own.is_none() {
            check_law(problem, number, group, &group.material, None)?;
        }
        first.push(own.unwrap_or_else(|| group.material.clone()));
    }
    Ok((first, swaps))
}

impl Model {
    /// Builds a model and checks everything that can be checked before the first increment.
    ///
    /// # Errors
    /// The part of the problem that does not fit, or the point whose law cannot start.
    pub fn build(problem: &Problem) -> Result<Self, BuildError> {
        check::problem(problem)?;
        let (first, swaps) = materials(problem)?;
        let surroundings = Surroundings::new(problem);
        let initial = InitialStresses::of(problem);
        let mut groups = Vec::new();
        let mut ties = Ties::default();
        for (number, material) in first.into_iter().enumerate() {
            let builder = GroupBuilder {
                problem,
                mesh: &problem.mesh,
                surroundings: &surroundings,
                initial: &initial,
                number,
                group: &problem.groups[number],
            };
            let mut group = builder.build(material, &mut ties)?;
            let mut strains = problem.phases.iter().flat_map(|phase| &phase.strain);
            if strains.any(|(of, _)| *of == number) {
                group.may_swell();
            }
            groups.push(group);
        }
        let ties = ties.ties;
        let mut warnings = constraints::check(problem, &ties)?;
        warnings.extend(plausibility::warnings(problem, &groups, &swaps));
        Ok(Self {
            groups,
            ties,
            swaps,
            warnings,
        })
    }

    /// Refuses thin layers whose stiffnesses, known once a law has started, are impossible.
    ///
    /// # Errors
    /// The material.
    pub fn check_layers(groups: &[Group]) -> Result<(), Refusal> {
        for group in groups {
            if let Some(stiffness) = group.impossible_layer() {
                let item = Item::Material(group.law.name.clone());
                return Err(Refusal::new(item, Cause::ImpossibleLayer(stiffness)));
            }
        }
        Ok(())
    }
}

/// Whether a group can carry a law.
fn check_law(
    problem: &Problem,
    number: usize,
    group: &ElementGroup,
    material: &Material,
    phase: Option<usize>,
) -> Result<(), Refusal> {
    let law = &material.built.law;
    let refuse = |cause| {
        let item = Item::LawOf {
            group: number,
            phase,
        };
        Err(Refusal::new(item, cause))
    };
    let is_interface_law = law.hypothesis() == Hypothesis::Interface2d;
    let needed = hypothesis(problem.analysis, group.formulation, is_interface_law);
    if law.hypothesis() != needed {
        return refuse(Cause::OtherHypothesis {
            material: material.name.clone(),
            built: law.hypothesis().name(),
            needed: needed.name(),
        });
    }
    if law.formulation().local_axes && group.formulation == Formulation::Solid {
        return refuse(Cause::LocalAxes {
            law: law.description().id.clone(),
            group: group.name.clone(),
        });
    }
    match impossible_layer(group, material) {
        Some(stiffness) => refuse(Cause::ImpossibleLayer(stiffness)),
        None => Ok(()),
    }
}

/// A thin layer with K_n ≤ 4/3 K_t has no elasticity along it. Tried out under 100 kPa; a law
/// that cannot start from there is asked again when its phase begins.
fn impossible_layer(group: &ElementGroup, material: &Material) -> Option<[f64; 2]> {
    let elastic = group.in_plane != Some(InPlane::None);
    let law = &material.built.law;
    let applies = group.formulation == Formulation::ThinLayer && elastic;
    if !applies || law.hypothesis() != Hypothesis::Interface2d {
        return None;
    }
    let (_, operator) = law.at_rest(&[-100.0, 0.0], &[], Operator::Elastic).ok()?;
    (operator[0] <= 4.0 / 3.0 * operator[3]).then(|| [operator[0], operator[3]])
}

/// Solids of every group.
struct Surroundings {
    of_group: Vec<Vec<usize>>,
}

impl Surroundings {
    fn new(problem: &Problem) -> Self {
        let mut of_group = vec![Vec::new(); problem.groups.len()];
        for (number, solid) in problem.mesh.solids.iter().enumerate() {
            of_group[solid.group].push(number);
        }
        Self { of_group }
    }
}

/// Ties so far, each degree of freedom once.
#[derive(Default)]
struct Ties {
    ties: Vec<Tie>,
    dofs: HashSet<usize>,
}

/// The parametric direction of a quad across the layer.
#[derive(Clone, Copy, PartialEq)]
enum Across {
    Xi,
    Eta,
}

struct GroupBuilder<'a> {
    problem: &'a Problem,
    mesh: &'a Mesh,
    surroundings: &'a Surroundings,
    initial: &'a InitialStresses<'a>,
    number: usize,
    group: &'a ElementGroup,
}

impl GroupBuilder<'_> {
    fn build(&self, material: Material, ties: &mut Ties) -> Result<Group, BuildError> {
        let name = self.group.name.clone();
        let formulation = self.group.formulation;
        self.refuse_misplaced_keys()?;
        let mut thickness = None;
        let kinematics: Box<dyn Kinematics> = match formulation {
            Formulation::Solid => self.solid()?,
            Formulation::ThinLayer => {
                let in_plane = self.group.in_plane.unwrap_or(InPlane::Elastic);
                let (elements, t) = self.thin_layer(ties)?;
                thickness = Some((t, in_plane));
                elements
            }
            Formulation::ZeroThickness => {
                let joints = self.mesh.joints.iter();
                let joints: Vec<_> = joints.filter(|j| j.group == self.number).copied().collect();
                let rule = self.integration(Integration::Nodes);
                let analysis = self.problem.analysis;
                Box::new(Joint6::new(analysis, &self.mesh.nodes, &joints, rule))
            }
        };
        if kinematics.n_elements() == 0 {
            return Err(self.refuse(Cause::NoElements(name)).into());
        }
        self.refuse_turned_signs(&material)?;
        let stress = self.initial_stress(&*kinematics);
        self.refuse_tension_at_rest(&*kinematics, &stress)?;
        let cannot_start = |failure| BuildError::CannotStart(Box::new(failure));
        let mut group = Group::new(name, formulation, kinematics, stress, thickness, material)
            .map_err(cannot_start)?;
        if formulation == Formulation::ZeroThickness {
            let kinematics = &group.kinematics;
            let traction = |element: usize, at: [f64; 2], axes: &Axes| {
                self.initial_traction(kinematics.nodes(element), at, axes)
            };
            group.correct(group.lost(&group.stress.committed, traction));
        }
        Ok(group)
    }

    /// The group does not fit.
    fn refuse(&self, cause: Cause) -> Refusal {
        Refusal::new(Item::Group(self.number), cause)
    }

    /// A key of the group does not fit.
    fn refuse_key(&self, key: Key, cause: Cause) -> Refusal {
        Refusal::new(Item::GroupKey(self.number, key), cause)
    }

    fn integration(&self, default: Integration) -> Integration {
        self.group.integration.unwrap_or(default)
    }

    /// Keys and values that do not go with the formulation.
    fn refuse_misplaced_keys(&self) -> Result<(), Refusal> {
        let ElementGroup {
            formulation,
            integration,
            normal,
            in_plane,
            ..
        } = self.group;
        let misplaced = |key| Err(self.refuse_key(key, Cause::Misplaced(key, *formulation)));
        if *formulation != Formulation::ThinLayer {
            if normal.is_some() {
                return misplaced(Key::Normal);
            }
            if in_plane.is_some() {
                return misplaced(Key::InPlane);
            }
        }
        let fits = match integration {
            None | Some(Integration::Full | Integration::Reduced) => true,
            Some(Integration::BBar | Integration::Projected) => *formulation == Formulation::Solid,
            Some(Integration::Mean) => *formulation == Formulation::ThinLayer,
            Some(Integration::Nodes) => *formulation == Formulation::ZeroThickness,
        };
        if fits {
            Ok(())
        } else {
            misplaced(Key::Integration)
        }
    }

    fn solids(&self) -> impl Iterator<Item = &Solid> {
        let own = self.surroundings.of_group[self.number].iter();
        own.map(|&number| &self.mesh.solids[number])
    }

    fn bad_shape(&self) -> Refusal {
        self.refuse(Cause::BadShape(self.group.name.clone()))
    }

    /// Integration points of an element.
    fn points(&self, solid: &Solid, integration: Integration) -> Result<Points, Refusal> {
        let places: Vec<[f64; 2]> = solid.nodes().iter().map(|&n| self.mesh.nodes[n]).collect();
        let points = (solid.kind().points)(integration, &places);
        points.ok_or_else(|| {
            let group = self.group.name.clone();
            let cause = Cause::TooFewPoints(group, solid.kind().n_nodes());
            self.refuse_key(Key::Integration, cause)
        })
    }

    /// Elements in global axes, in the order of the mesh.
    fn solid(&self) -> Result<Box<dyn Kinematics>, Refusal> {
        let integration = self.integration(Integration::Projected);
        let element = |solid| Ok((solid, Axes::GLOBAL, self.points(solid, integration)?));
        let elements: Vec<_> = self.solids().map(element).collect::<Result<_, _>>()?;
        self.elements(&elements, |a, b| a == b)
    }

    /// Elements in the order of the mesh, each with its axes and points: runs of one kind each, in which
    /// `are_alike` holds for the points of neighbours.
    fn elements(
        &self,
        elements: &[(&Solid, Axes, Points)],
        are_alike: fn(&Points, &Points) -> bool,
    ) -> Result<Box<dyn Kinematics>, Refusal> {
        let runs = elements
            .chunk_by(|(a, _, of_a), (b, _, of_b)| a.kind() == b.kind() && are_alike(of_a, of_b));
        let of_run = |run: &[(&Solid, Axes, Points)]| {
            let nodes: Vec<&[usize]> = run.iter().map(|(solid, ..)| solid.nodes()).collect();
            let own = Elements {
                analysis: self.problem.analysis,
                coordinates: &self.mesh.nodes,
                nodes: &nodes,
                axes: run.iter().map(|(_, axes, _)| *axes).collect(),
                points: &|element| run[element].2,
            };
            (run[0].0.kind().build)(own).map_err(|_| self.bad_shape())
        };
        let mut parts = runs.map(of_run).collect::<Result<Vec<_>, _>>()?;
        Ok(if parts.len() == 1 {
            parts.remove(0)
        } else {
            Box::new(Mixed::new(parts))
        })
    }

    /// Elements in axes of the layer, and their thickness.
    fn thin_layer(&self, ties: &mut Ties) -> Result<(Box<dyn Kinematics>, Vec<f64>), Refusal> {
        let solids: Vec<&Solid> = self.solids().collect();
        if solids.iter().any(|solid| solid.n_corners() != 4) {
            return Err(self.refuse(Cause::LayerOfTriangles(self.group.name.clone())));
        }
        let integration = self.integration(Integration::Full);
        let (mut elements, mut thickness, mut middles) = (vec![], vec![], vec![]);
        for solid in solids {
            let (direction, t) = self.across(solid.nodes())?;
            let at = |i: usize| self.mesh.nodes[solid.nodes()[i]];
            // Ends of the mid-surface, and the points of the mean over the thickness.
            let (across, [a, b], mean) = match direction {
                Across::Xi => (0, [at(4), at(6)], Points::at(1, 3)),
                Across::Eta => (1, [at(7), at(5)], Points::at(3, 1)),
            };
            let points = match integration {
                Integration::Mean => mean,
                _ => self.points(solid, integration)?,
            };
            let axes = Axes::of_facet([b[0] - a[0], b[1] - a[1]]);
            elements.push((solid, axes, points));
            thickness.push(t);
            let between = solid.kind().between_faces(across).into_iter();
            middles.extend(between.map(|triple| triple.map(|i| solid.nodes()[i])));
        }
        self.refuse_normal_along()?;
        if integration == Integration::Mean {
            tie_middles(&middles, ties);
        }
        let elements = self.elements(&elements, |_, _| true)?;
        Ok((elements, thickness))
    }

    /// Refuses a `normal` in whose direction the layer is longer than along it: clearly so, since a
    /// square is a layer too, and whatever the shape of its elements.
    fn refuse_normal_along(&self) -> Result<(), Refusal> {
        let Some(normal) = self.group.normal else {
            return Ok(());
        };
        for extent in self.extents() {
            let [width, height] = extent;
            let (across, along, other) = match normal {
                Axis::X => (width, height, Axis::Y),
                Axis::Y => (height, width, Axis::X),
            };
            if across > CLEARLY * along {
                let group = self.group.name.clone();
                let cause = Cause::NormalAlong {
                    group,
                    extent,
                    other,
                };
                return Err(self.refuse_key(Key::Normal, cause));
            }
        }
        Ok(())
    }

    /// Width and height of each connected part of the group.
    fn extents(&self) -> Vec<[f64; 2]> {
        let mut of_node: HashMap<usize, usize> = HashMap::new();
        // Lower and upper corner of each part, and the part that it has become one with.
        let mut parts: Vec<([[f64; 2]; 2], usize)> = Vec::new();
        let root = |parts: &[([[f64; 2]; 2], usize)], mut part: usize| {
            while parts[part].1 != part {
                part = parts[part].1;
            }
            part
        };
        for solid in self.solids() {
            let new = parts.len();
            let corners = solid.nodes().iter().map(|&node| self.mesh.nodes[node]);
            let corners: Vec<[f64; 2]> = corners.collect();
            let end = |c: usize, f: fn(f64, f64) -> f64| {
                corners.iter().map(|at| at[c]).fold(corners[0][c], f)
            };
            let lower = [end(0, f64::min), end(1, f64::min)];
            parts.push(([lower, [end(0, f64::max), end(1, f64::max)]], new));
            for &node in solid.nodes() {
                let other = *of_node.entry(node).or_insert(new);
                let (a, b) = (root(&parts, other), root(&parts, new));
                if a != b {
                    let [low, high] = parts[b].0;
                    let into = &mut parts[a].0;
                    for c in 0..2 {
                        into[0][c] = into[0][c].min(low[c]);
                        into[1][c] = into[1][c].max(high[c]);
                    }
                    parts[b].1 = a;
                }
            }
        }
        let own = parts.iter().enumerate();
        own.filter(|(number, (_, root))| number == root)
            .map(|(_, ([low, high], _))| [high[0] - low[0], high[1] - low[1]])
            .collect()
    }

    /// Refuses an initial stress that the law cannot stand, though it stands it with compression as
    /// a negative number.
    fn refuse_turned_signs(&self, material: &Material) -> Result<(), Refusal> {
        let Some(InitialStress::Constant(stress)) = self.group.initial_stress else {
            return Ok(());
        };
        match sign_check::turned(&material.built.law, self.group.formulation, stress) {
            None => Ok(()),
            Some(refusal) => {
                let cause = Cause::TurnedSigns {
                    group: self.group.name.clone(),
                    material: material.name.clone(),
                    refusal,
                };
                Err(self.refuse_key(Key::InitialStress, cause))
            }
        }
    }

    /// The direction across a layer, and the thickness: the distance between its two faces.
    fn across(&self, nodes: &[usize]) -> Result<(Across, f64), Refusal> {
        let at = |i: usize| self.mesh.nodes[nodes[i]];
        let distance = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]).hypot(b[1] - a[1]);
        let (along_xi, along_eta) = (distance(at(7), at(5)), distance(at(4), at(6)));
        match self.group.normal {
            Some(normal) => {
                let xi_is_x = (at(5)[0] - at(7)[0]).abs() >= (at(5)[1] - at(7)[1]).abs();
                let xi = (normal == Axis::X) == xi_is_x;
                Ok(if xi {
                    (Across::Xi, along_xi)
                } else {
                    (Across::Eta, along_eta)
                })
            }
            None if along_xi < 0.8 * along_eta => Ok((Across::Xi, along_xi)),
            None if along_eta < 0.8 * along_xi => Ok((Across::Eta, along_eta)),
            None => Err(self.refuse(Cause::WhichWayAcross {
                group: self.group.name.clone(),
                sides: [along_xi, along_eta],
            })),
        }
    }

    /// Refuses an earth pressure at rest (of solids, so in global axes) that pulls.
    fn refuse_tension_at_rest(
        &self,
        kinematics: &dyn Kinematics,
        stress: &[f64],
    ) -> Result<(), Refusal> {
        if !matches!(self.group.initial_stress, Some(InitialStress::AtRest(_))) {
            return Ok(());
        }
        let refuse = |cause| Err(self.refuse_key(Key::InitialStress, cause));
        for (point, stress) in stress.chunks_exact(kinematics.n_components()).enumerate() {
            let [horizontal, vertical] = [-stress[0], -stress[1]];
            let at = kinematics.position(point);
            // Where nothing is left of the vertical one, there may be less than nothing.
            if vertical <= 0.0 {
                let [above, pore] = self.initial.on_a_plane(self.number, at);
                if above - pore < -ROUND_OFF_AT_REST * (above.abs() + pore) {
                    return refuse(Cause::LiftedAtRest { at, above, pore });
                }
            }
            if horizontal < 0.0 {
                let stress = [horizontal, vertical];
                return refuse(Cause::TensionAtRest { at, stress });
            }
        }
        Ok(())
    }

    /// Initial stress of all points, in axes of the elements.
    fn initial_stress(&self, kinematics: &dyn Kinematics) -> Vec<f64> {
        let mut stress = Vec::with_capacity(kinematics.n_components() * kinematics.n_points());
        for point in 0..kinematics.n_points() {
            let (element, _) = kinematics.place_of(point);
            let (axes, at) = (kinematics.axes_at(point), kinematics.position(point));
            if kinematics.n_components() == 4 {
                let own = self.initial.at(self.number, at).unwrap_or_default();
                stress.extend(axes.stress_from_global(own));
            } else {
                stress.extend(self.initial_traction(kinematics.nodes(element), at, &axes));
            }
        }
        stress
    }

    /// Normal and shear stress with which a zero-thickness element begins at a place of it. Without a given initial
    /// stress it is that of the ground on its two sides, projected on its facet.
    fn initial_traction(&self, nodes: &[usize], at: [f64; 2], axes: &Axes) -> [f64; 2] {
        let found = if self.group.initial_stress.is_some() {
            self.initial.at(self.number, at).unwrap_or_default()
        } else {
            self.initial.beside(self.number, [nodes[2], nodes[5]], at)
        };
        let [_, normal, _, shear] = axes.stress_from_global(found);
        [normal, shear]
    }
}

/// Ties nodes in the middle of a layer's thickness (first) to those on its faces on either side.
fn tie_middles(middles: &[[usize; 3]], ties: &mut Ties) {
    for [middle, a, b] in middles {
        for c in 0..2 {
            let dof = 2 * middle + c;
            if ties.dofs.insert(dof) {
                let masters = [(2 * a + c, 0.5), (2 * b + c, 0.5)];
                ties.ties.push(Tie { dof, masters });
            }
        }
    }
}
