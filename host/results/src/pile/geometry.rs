//! The pile in a mesh: its elements, the nodes of its head and base, and the faces of its shaft.

use super::Parts;
use super::rows::{Row, Span, rows};
use crate::ends;
use mechanics::Simulation;
use mechanics::group::Group;
use mechanics::mesh::{Line, Mesh};
use mechanics::problem::{Analysis, Formulation};
use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;

/// Stations closer than this fraction of the pile's length are one.
pub(super) const SAME: f64 = 1e-9;

/// Why there is no such pile.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Misfit {
    /// A group of the pile (by its number in the list) is not of solids.
    NotSolid(usize),
    /// No node of the head belongs to the pile, or no side of its line.
    Head,
    /// A group of the shaft (by its number in the list) is not an interface.
    NotAnInterface(usize),
    /// A group of the shaft does not touch the pile.
    ApartFromShaft(usize),
    /// The base is a group that is not an interface.
    BaseNotAnInterface,
    /// The base does not touch the pile.
    Base,
    /// The base is a line inside the pile.
    BaseInside,
    /// The base is not below the head.
    UpsideDown,
}

/// An element of the shaft or the base, as the pile feels it.
#[derive(Debug)]
pub(super) struct Facet {
    /// Its place in the list.
    pub(super) number: usize,
    /// Number of its group, and within the group.
    pub(super) group: usize,
    pub(super) element: usize,
    /// The pile's nodes on it: two ends and the middle.
    pub(super) nodes: [usize; 3],
    /// For a zero-thickness element, the opposite nodes of the ground.
    pub(super) opposite: Option<[usize; 3]>,
    /// The tangential traction is positive where it holds the pile up (1) or draws it down (−1).
    pub(super) sign: f64,
    /// Lowest and highest z.
    pub(super) z: [f64; 2],
    /// Area, m² over the whole turn.
    pub(super) area: f64,
    /// Element of the pile next to it: group and number within the group.
    pub(super) beside: (usize, usize),
    /// Elements of one colour and group share no node.
    pub(super) colour: usize,
}

/// An element of the pile, seen from the side.
#[derive(Debug)]
struct Body {
    outline: Vec<[f64; 2]>,
    z: [f64; 2],
    /// Volume above its lowest point.
    volume: f64,
}

/// Elements of a group, by its number.
type OfGroup = (usize, Vec<Body>);
/// A side of the head: area, m² (plane strain: m), group and element.
type Side = (f64, usize, usize);

/// The pile within the mesh.
#[derive(Debug)]
pub(super) struct Geometry {
    pub(super) head: Vec<usize>,
    pub(super) base: Vec<usize>,
    pub(super) shaft: Vec<Facet>,
    /// Its shaft from the head down, and the rows of its table.
    pub(super) spans: Vec<Span>,
    pub(super) rows: Vec<Row>,
    /// Nodes of the pile that are neither of head, shaft nor base, with their z.
    pub(super) others: Vec<usize>,
    /// Diameter (plane strain: width) of the base, m.
    pub(super) width: f64,
    /// Sides of the head: area and the pile's element there.
    pub(super) head_sides: Vec<Side>,
    bodies: Vec<OfGroup>,
    pub(super) analysis: Analysis,
}

fn place(mesh: &Mesh, node: usize) -> [u64; 2] {
    // Without the sign of zero.
    mesh.nodes[node].map(|c| (c + 0.0).to_bits())
}

/// Sides of an element: first end, second end, middle.
pub(super) fn sides(nodes: &[usize], is_joint: bool) -> Vec<[usize; 3]> {
    if is_joint {
        return vec![
            [nodes[0], nodes[1], nodes[2]],
            [nodes[3], nodes[4], nodes[5]],
        ];
    }
    let n = nodes.len() / 2;
    (0..n)
        .map(|i| [nodes[i], nodes[(i + 1) % n], nodes[n + i]])
        .collect()
}

fn is_interface(group: &Group) -> bool {
    group.formulation != Formulation::Solid
}

impl Geometry {
    /// # Errors
    /// The mismatch.
    pub(super) fn new(parts: &Parts, simulation: &Simulation) -> Result<Self, Misfit> {
        let problem = simulation.problem();
        let (mesh, groups) = (&problem.mesh, simulation.groups());
        let (own, by_side) = elements(parts, groups)?;
        let of_line = |line: &Line| at_line(mesh, line, &own);
        let line = |name: &str| mesh.lines.get(name);
        let head = line(&parts.head).map(of_line).unwrap_or_default();
        if head.is_empty() {
            return Err(Misfit::Head);
        }
        let facets = |of: &[usize]| facets(problem.analysis, mesh, groups, of, &own, &by_side);
        let shaft = shaft(parts, groups, facets)?;
        let at = |name: &str| line(name).map(of_line);
        let base = base(parts, groups, at, facets, &by_side)?;
        if base.is_empty() {
            return Err(Misfit::Base);
        }
        let (top, bottom) = (extent(mesh, &head, 1)[1], extent(mesh, &base, 1)[0]);
        if top <= bottom {
            return Err(Misfit::UpsideDown);
        }
        let spans = Span::all([top, bottom], &shaft, problem);
        let rows = rows(mesh, &spans, &shaft, [&head, &base]);
        let special = shaft.iter().flat_map(|facet| facet.nodes);
        let special = special.chain(head.iter().chain(&base).copied());
        let special: HashSet<usize> = special.collect();
        let mut others: Vec<usize> = own.difference(&special).copied().collect();
        others.sort_unstable();
        let [left, right] = extent(mesh, &base, 0);
        let width = match problem.analysis {
            Analysis::Axisymmetric => 2.0 * right,
            Analysis::PlaneStrain => right - left,
        };
        let (bodies, head_sides) = bodies(problem.analysis, mesh, groups, &parts.groups, &head);
        if head_sides.is_empty() && line(&parts.head).is_some_and(|line| !line.edges.is_empty()) {
            return Err(Misfit::Head);
        }
        Ok(Self {
            head,
            base,
            shaft,
            spans,
            rows,
            others,
            width,
            head_sides,
            bodies,
            analysis: problem.analysis,
        })
    }

    /// Length, m.
    pub(super) fn length(&self) -> f64 {
        let ends = self.spans.first().zip(self.spans.last());
        ends.map_or(0.0, |(first, last)| first.z[0] - last.z[1])
    }

    /// Weight of a group above z, kN, with unit weights above and below a water level; `bottom`: of all
    /// of it.
    pub(super) fn weight_above(
        &self,
        group: usize,
        z: f64,
        [dry, wet]: [f64; 2],
        level: impl Fn(f64) -> Option<f64>,
    ) -> f64 {
        let bodies = self.bodies.iter().filter(|(of, _)| *of == group);
        let bodies = bodies.flat_map(|(_, bodies)| bodies);
        let weight = |body: &Body| {
            let above = |z: f64| body.volume_above(z, self.analysis);
            let all = above(z);
            if dry.to_bits() == wet.to_bits() || all == 0.0 {
                return dry * all;
            }
            let middle =
                body.outline.iter().map(|at| at[0]).sum::<f64>() / body.outline.len() as f64;
            let dry_part = level(middle).map_or(all, |level| above(z.max(level)));
            dry * dry_part + wet * (all - dry_part)
        };
        bodies.map(weight).sum()
    }
}

impl Body {
    fn new(outline: Vec<[f64; 2]>, analysis: Analysis) -> Self {
        let z = ends(outline.iter().map(|at| at[1]));
        let volume = volume(&outline, analysis);
        Self { outline, z, volume }
    }

    fn volume_above(&self, z: f64, analysis: Analysis) -> f64 {
        if z <= self.z[0] {
            return self.volume;
        }
        if z >= self.z[1] {
            return 0.0;
        }
        let mut kept = Vec::new();
        for (i, &a) in self.outline.iter().enumerate() {
            let b = self.outline[(i + 1) % self.outline.len()];
            if a[1] >= z {
                kept.push(a);
            }
            if (a[1] >= z) != (b[1] >= z) {
                let t = (z - a[1]) / (b[1] - a[1]);
                kept.push([a[0] + t * (b[0] - a[0]), z]);
            }
        }
        volume(&kept, analysis)
    }
}

/// Volume of a polygon, over the whole turn or a metre deep.
fn volume(outline: &[[f64; 2]], analysis: Analysis) -> f64 {
    let pairs = outline.iter().zip(outline.iter().cycle().skip(1));
    let sum: f64 = pairs
        .map(|(a, b)| {
            let cross = a[0] * b[1] - b[0] * a[1];
            match analysis {
                Analysis::PlaneStrain => cross / 2.0,
                Analysis::Axisymmetric => 2.0 * PI * cross * (a[0] + b[0]) / 6.0,
            }
        })
        .sum();
    sum.abs()
}

/// Nodes of the pile at its base.
fn base(
    parts: &Parts,
    groups: &[Group],
    of_line: impl Fn(&str) -> Option<Vec<usize>>,
    facets: impl Fn(&[usize]) -> Vec<Facet>,
    by_side: &HashMap<usize, Vec<(usize, usize)>>,
) -> Result<Vec<usize>, Misfit> {
    match &parts.base {
        super::Base::Group(group) => {
            if !is_interface(&groups[*group]) {
                return Err(Misfit::BaseNotAnInterface);
            }
            let facets = facets(&[*group]);
            let mut nodes: Vec<usize> = facets.iter().flat_map(|f| f.nodes).collect();
            nodes.sort_unstable();
            nodes.dedup();
            Ok(nodes)
        }
        super::Base::Line(name) => {
            let nodes = of_line(name).unwrap_or_default();
            let is_inside = |node: &usize| by_side.get(node).is_some_and(|sides| sides.len() > 1);
            if nodes.iter().any(is_inside) {
                return Err(Misfit::BaseInside);
            }
            Ok(nodes)
        }
    }
}

/// The elements of groups, by group, and the sides of the head: area, group and element.
fn bodies(
    analysis: Analysis,
    mesh: &Mesh,
    groups: &[Group],
    of: &[usize],
    head: &[usize],
) -> (Vec<OfGroup>, Vec<Side>) {
    let on_head: HashSet<usize> = head.iter().copied().collect();
    let mut head_sides = Vec::new();
    let mut bodies = Vec::new();
    for &group in of {
        let kinematics = &groups[group].kinematics;
        let mut of_group = Vec::new();
        for element in 0..kinematics.n_elements() {
            let edges = sides(kinematics.nodes(element), false);
            let outline = edges.iter().flat_map(|[a, _, middle]| [*a, *middle]);
            let outline: Vec<[f64; 2]> = outline.map(|node| mesh.nodes[node]).collect();
            of_group.push(Body::new(outline, analysis));
            for edge in edges {
                if edge.iter().all(|node| on_head.contains(node)) {
                    let [a, b] = [edge[0], edge[1]].map(|node| mesh.nodes[node][0]);
                    let area = match analysis {
                        Analysis::Axisymmetric => PI * (a * a - b * b).abs(),
                        Analysis::PlaneStrain => (a - b).abs(),
                    };
                    head_sides.push((area, group, element));
                }
            }
        }
        bodies.push((group, of_group));
    }
    (bodies, head_sides)
}

/// Nodes of the pile's elements, and an element by the middle of each of its sides.
type Elements = (HashSet<usize>, HashMap<usize, Vec<(usize, usize)>>);

fn elements(parts: &Parts, groups: &[Group]) -> Result<Elements, Misfit> {
    let (mut own, mut by_side) = Elements::default();
    for (number, &group) in parts.groups.iter().enumerate() {
        if is_interface(&groups[group]) {
            return Err(Misfit::NotSolid(number));
        }
        let kinematics = &groups[group].kinematics;
        for element in 0..kinematics.n_elements() {
            own.extend(kinematics.nodes(element));
            for [_, _, middle] in sides(kinematics.nodes(element), false) {
                by_side.entry(middle).or_default().push((group, element));
            }
        }
    }
    Ok((own, by_side))
}

/// Nodes of the pile at a line.
fn at_line(mesh: &Mesh, line: &Line, own: &HashSet<usize>) -> Vec<usize> {
    let places: HashSet<[u64; 2]> = line.nodes.iter().map(|&n| place(mesh, n)).collect();
    let there = own.iter().copied();
    let there = there.filter(|&node| places.contains(&place(mesh, node)));
    let mut nodes: Vec<usize> = there.collect();
    nodes.sort_unstable();
    nodes
}

/// What touches the pile of the interfaces along its shaft.
fn shaft(
    parts: &Parts,
    groups: &[Group],
    facets: impl Fn(&[usize]) -> Vec<Facet>,
) -> Result<Vec<Facet>, Misfit> {
    let of = &parts.shaft;
    if let Some(other) = of.iter().position(|&group| !is_interface(&groups[group])) {
        return Err(Misfit::NotAnInterface(other));
    }
    let shaft = facets(of);
    let touches = |group: &usize| shaft.iter().any(|facet| facet.group == *group);
    match of.iter().position(|group| !touches(group)) {
        Some(apart) => Err(Misfit::ApartFromShaft(apart)),
        None => Ok(shaft),
    }
}

/// Smallest and largest coordinate of nodes, m.
fn extent(mesh: &Mesh, nodes: &[usize], c: usize) -> [f64; 2] {
    ends(nodes.iter().map(|&node| mesh.nodes[node][c]))
}

/// Place of a node from the middle of an element's nodes.
fn off_middle(mesh: &Mesh, nodes: &[usize], node: usize) -> [f64; 2] {
    [0, 1].map(|c| {
        let sum: f64 = nodes.iter().map(|&n| mesh.nodes[n][c]).sum();
        mesh.nodes[node][c] - sum / nodes.len() as f64
    })
}

/// Area of a side between two points, m²; plane strain: per metre.
fn area(analysis: Analysis, ends: [[f64; 2]; 2]) -> f64 {
    let length = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
    length
        * match analysis {
            Analysis::Axisymmetric => PI * (ends[0][0] + ends[1][0]),
            Analysis::PlaneStrain => 1.0,
        }
}

/// The first colour that no element at these nodes has; it is theirs from now on.
fn colour(nodes: &[usize], colours: &mut HashMap<usize, Vec<usize>>) -> usize {
    let taken = nodes.iter().filter_map(|node| colours.get(node));
    let taken: Vec<usize> = taken.flatten().copied().collect();
    let mut all = 0..=taken.len();
    let free = all.find(|colour| !taken.contains(colour));
    let free = free.unwrap_or_default();
    for &node in nodes {
        colours.entry(node).or_default().push(free);
    }
    free
}

/// Elements of interface groups that touch the pile.
fn facets(
    analysis: Analysis,
    mesh: &Mesh,
    groups: &[Group],
    of: &[usize],
    own: &HashSet<usize>,
    by_side: &HashMap<usize, Vec<(usize, usize)>>,
) -> Vec<Facet> {
    let mut facets = Vec::new();
    for &number in of {
        let group = &groups[number];
        let kinematics = &group.kinematics;
        let is_joint = group.formulation == Formulation::ZeroThickness;
        let mut colours: HashMap<usize, Vec<usize>> = HashMap::new();
        for element in 0..kinematics.n_elements() {
            let nodes = kinematics.nodes(element);
            let sides = sides(nodes, is_joint);
            let at_pile = |[a, b, middle]: &&[usize; 3]| {
                [a, b, middle].iter().all(|node| own.contains(*node))
                    && by_side.contains_key(middle)
            };
            let Some(&side) = sides.iter().find(at_pile) else {
                continue;
            };
            let axes = kinematics.axes(element);
            let is_minus = if is_joint {
                side == sides[0]
            } else {
                let off = off_middle(mesh, nodes, side[2]);
                off[0] * axes.across[0] + off[1] * axes.across[1] < 0.0
            };
            let up = if axes.along[1] < 0.0 { -1.0 } else { 1.0 };
            let ends = [side[0], side[1]].map(|node| mesh.nodes[node]);
            facets.push(Facet {
                number: facets.len(),
                group: number,
                element,
                nodes: side,
                opposite: is_joint.then(|| sides[usize::from(is_minus)]),
                sign: if is_minus { up } else { -up },
                z: [ends[0][1].min(ends[1][1]), ends[0][1].max(ends[1][1])],
                area: area(analysis, ends),
                beside: by_side[&side[2]][0],
                colour: colour(nodes, &mut colours),
            });
        }
    }
    facets
}
