//! Inserts zero-thickness elements between the elements of a mesh, by splitting nodes.
//!
//! Lines are sets of edges, straight or curved, closed, with corners, ends and junctions. Around a node the elements
//! form sectors: one leads to the next through edges that are not cut. The first sector keeps the node, every other one
//! gets a copy of it. So a line that ends inside the body leaves its last node single. A line through a node makes two
//! of it, a line that ends on another makes three, and two that cross make four, in whatever order they are inserted.
//!
//! An edge is known by the node in its middle, which belongs to no other edge.

use super::{Joint as Inserted, Line, Mesh, Solid};
use crate::element::increase;
use std::collections::{HashMap, HashSet};
use std::fmt;

/// Position of an edge with this middle node among the nodes of an element.
fn edge_at(element: &Solid, middle: usize) -> Option<[usize; 3]> {
    let (nodes, edges) = (element.nodes(), element.kind().edges.iter());
    edges.copied().find(|&[_, _, at]| nodes[at] == middle)
}

/// Edges along which elements are inserted.
#[derive(Clone, Debug, Default)]
struct Interface {
    /// First end, second end and middle of every edge, in the direction of the line.
    edges: Vec<[usize; 3]>,
    /// Whether a node on the boundary of the mesh, on which the line ends, is split. Where a line
    /// ends inside the mesh its two sides stay joined.
    opens_ends: bool,
}

/// A zero-thickness element. Its normal points to the left of the line's direction: from `right` to
/// `left`. At a closed end both have the same node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Joint {
    /// Number of its interface.
    interface: usize,
    /// First end, second end and middle on the right of the line.
    right: [usize; 3],
    /// The same on the left.
    left: [usize; 3],
}

impl Joint {
    /// Nodes on the near and on the far side, each from the first end to the second. Both axes of the facet, from near
    /// to far and from first to second, then point towards increasing coordinates (see `Axes::of_facet`), whatever the
    /// direction of the line.
    fn near_and_far(&self, coordinates: &[[f64; 2]]) -> [[usize; 3]; 2] {
        let increases = |direction: [f64; 2]| increase(direction) > 0.0;
        let [a, b, _] = self.right.map(|node| coordinates[node]);
        let to_the_left = [a[1] - b[1], b[0] - a[0]];
        let mut sides = if increases(to_the_left) {
            [self.right, self.left]
        } else {
            [self.left, self.right]
        };
        if !increases([b[0] - a[0], b[1] - a[1]]) {
            for side in &mut sides {
                side.swap(0, 1);
            }
        }
        sides
    }
}

/// A mesh with its nodes split.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Split {
    /// By node, the node that it is a copy of; the first are those that there were, themselves.
    original: Vec<usize>,
    /// Elements, in their order.
    elements: Vec<Solid>,
    /// Inserted elements, interface by interface.
    joints: Vec<Joint>,
}

/// Why an element cannot be inserted at an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Fault {
    /// Number of the interface.
    interface: usize,
    /// Number of its edge.
    edge: usize,
    /// The defect.
    reason: Reason,
}

/// What can be wrong with an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// It is not an edge of any element.
    NoEdge,
    /// An element lies on one of its sides only.
    OnBoundary,
    /// This interface has the edge as well, or the same one twice.
    TakenBy(usize),
    /// More than two elements have it, or both on the same side of it.
    Overlapping,
}

/// A line of the mesh along which the elements of a group are inserted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Along {
    /// Name of the line.
    pub line: String,
    /// Number of the group.
    pub group: usize,
    /// Whether an end of the line on the boundary of the mesh is split; inside the mesh its two sides
    /// stay joined at an end.
    pub opens_ends: bool,
}

/// Why elements cannot be inserted along a line.
#[derive(Clone, Debug, PartialEq)]
pub struct CannotInsert {
    /// Which of the lines.
    pub number: usize,
    /// The defect of one of its edges; `None`: there is no such line, or it is a point.
    pub reason: Option<Reason>,
    /// Middle of that edge, m.
    pub at: Option<[f64; 2]>,
}

impl fmt::Display for CannotInsert {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: ", self.number + 1)?;
        match self.reason {
            None => write!(f, "there is no such line, or it is a point"),
            Some(Reason::NoEdge) => write!(f, "no element has a side on it"),
            Some(Reason::OnBoundary) => write!(f, "it lies on the boundary: nothing to split"),
            Some(Reason::TakenBy(other)) => {
                write!(f, "line {} has the same side of an element", other + 1)
            }
            Some(Reason::Overlapping) => {
                write!(f, "elements overlap on it: it does not have two sides")
            }
        }?;
        match self.at {
            Some([x, y]) => write!(f, ", at ({x}, {y})"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for CannotInsert {}

impl Mesh {
    /// Inserts zero-thickness elements along lines of any course, by splitting nodes: with corners,
    /// junctions, closed, or ending inside the mesh. Lines keep their names; their nodes are then
    /// those on both sides. Takes time in proportion to the size of the mesh.
    ///
    /// # Errors
    /// The first line that cannot be taken; the mesh is then as it was.
    pub fn insert_joints(&mut self, along: &[Along]) -> Result<(), CannotInsert> {
        if along.is_empty() {
            return Ok(());
        }
        let mut interfaces = Vec::new();
        for (number, along) in along.iter().enumerate() {
            let line = self.lines.get(&along.line);
            let edges = line.map(|line| self.course(line)).unwrap_or_default();
            if edges.is_empty() {
                return Err(CannotInsert {
                    number,
                    reason: None,
                    at: None,
                });
            }
            interfaces.push(Interface {
                edges,
                opens_ends: along.opens_ends,
            });
        }
        let split = split(self.nodes.len(), &self.solids, &interfaces).map_err(|fault| {
            let [_, _, middle] = interfaces[fault.interface].edges[fault.edge];
            CannotInsert {
                number: fault.interface,
                reason: Some(fault.reason),
                at: self.nodes.get(middle).copied(),
            }
        })?;
        let nodes = split.original.iter().map(|&node| self.nodes[node]);
        self.nodes = nodes.collect();
        self.solids = split.elements;
        for joint in split.joints {
            let [minus, plus] = joint.near_and_far(&self.nodes);
            self.joints.push(Inserted {
                minus,
                plus,
                group: along[joint.interface].group,
            });
        }
        self.add_copies(&split.original);
        Ok(())
    }

    /// Adds nodes that are copies of others to the lines of these. `original`: which node each one was.
    fn add_copies(&mut self, original: &[usize]) {
        let mut copies: HashMap<usize, Vec<usize>> = HashMap::new();
        let copied = original.iter().enumerate();
        for (node, &original) in copied.filter(|&(node, &original)| node != original) {
            copies.entry(original).or_default().push(node);
        }
        for line in self.lines.values_mut() {
            let of = |node| copies.get(&node).into_iter().flatten().copied();
            let known = line.nodes.iter();
            line.nodes = known
                .flat_map(|&node| std::iter::once(node).chain(of(node)))
                .collect();
        }
    }

    /// Edges of a line, each once: ends and middle, as the first element that has it goes round.
    fn course(&self, line: &Line) -> Vec<[usize; 3]> {
        let mut seen = HashSet::new();
        let edges = line.edges.iter().map(|&edge| self.edge(edge));
        edges.filter(|edge| seen.insert(edge[2])).collect()
    }
}

/// Splits the nodes of a mesh of `n_nodes` nodes along interfaces. Takes time in proportion to the
/// size of the mesh.
///
/// # Errors
/// [`Fault`], for the first edge at which there is one.
fn split(n_nodes: usize, elements: &[Solid], interfaces: &[Interface]) -> Result<Split, Fault> {
    let cuts = Cuts::new(interfaces)?;
    let around = elements_around(n_nodes, elements, &cuts);
    let mut result = Split {
        original: (0..n_nodes).collect(),
        elements: elements.to_vec(),
        joints: Vec::new(),
    };
    let sides = sides(elements, interfaces, &around)?;
    for node in nodes_along(n_nodes, interfaces) {
        let here = &around.elements[around.start[node]..around.start[node + 1]];
        if here.is_empty() || cuts.closes(node, interfaces) {
            continue;
        }
        let sector = sectors(node, here, elements, &cuts);
        let mut copies: Vec<usize> = Vec::new();
        for (&element, &sector) in here.iter().zip(&sector) {
            if sector == 0 {
                continue;
            }
            if sector > copies.len() {
                copies.push(result.original.len());
                result.original.push(node);
            }
            for own in result.elements[element].nodes_mut() {
                if *own == node {
                    *own = copies[sector - 1];
                }
            }
        }
    }
    // What the nodes of an edge have become in the element on one side of it.
    let renumbered =
        |(element, places): Side| places.map(|at| result.elements[element].nodes()[at]);
    let mut sides = sides.into_iter();
    for (number, interface) in interfaces.iter().enumerate() {
        for [right, left] in sides.by_ref().take(interface.edges.len()) {
            result.joints.push(Joint {
                interface: number,
                right: renumbered(right),
                left: renumbered(left),
            });
        }
    }
    Ok(result)
}

/// The nodes of interfaces, each once, edge by edge: the end with the smaller number, the other one,
/// the middle. Copies are numbered in this order, so that those of one line lie together.
fn nodes_along(n_nodes: usize, interfaces: &[Interface]) -> Vec<usize> {
    let mut is_known = vec![false; n_nodes];
    let edges = interfaces.iter().flat_map(|interface| &interface.edges);
    let nodes = edges.flat_map(|&[a, b, middle]| [a.min(b), a.max(b), middle]);
    nodes
        .filter(|&node| !std::mem::replace(&mut is_known[node], true))
        .collect()
}

/// The edges that are cut.
struct Cuts {
    /// Interface of an edge, by its middle.
    interface: HashMap<usize, usize>,
    /// By node, how many cut edges end there, and the interface of one of them.
    ends: HashMap<usize, (usize, usize)>,
}

impl Cuts {
    fn new(interfaces: &[Interface]) -> Result<Self, Fault> {
        let mut cuts = Self {
            interface: HashMap::new(),
            ends: HashMap::new(),
        };
        for (number, interface) in interfaces.iter().enumerate() {
            for (edge, &[a, b, middle]) in interface.edges.iter().enumerate() {
                if let Some(other) = cuts.interface.insert(middle, number) {
                    return Err(Fault {
                        interface: number,
                        edge,
                        reason: Reason::TakenBy(other),
                    });
                }
                for end in [a, b] {
                    cuts.ends.entry(end).or_insert((0, number)).0 += 1;
                }
            }
        }
        Ok(cuts)
    }

    /// Nodes of the cut edges.
    fn nodes(&self) -> impl Iterator<Item = usize> {
        self.ends.keys().chain(self.interface.keys()).copied()
    }

    /// Whether a line ends at a node and leaves it single. Inside the mesh there is one sector
    /// around its end anyway.
    fn closes(&self, node: usize, interfaces: &[Interface]) -> bool {
        let end = self.ends.get(&node);
        end.is_some_and(|&(count, interface)| count == 1 && !interfaces[interface].opens_ends)
    }
}

/// Elements around every node on a line, ascending; of other nodes none.
struct Around {
    start: Vec<usize>,
    elements: Vec<usize>,
}

fn elements_around(n_nodes: usize, elements: &[Solid], cuts: &Cuts) -> Around {
    let mut is_on_line = vec![false; n_nodes];
    // A wrong edge may name nodes that there are not.
    for node in cuts.nodes().filter(|&node| node < n_nodes) {
        is_on_line[node] = true;
    }
    let mut start = vec![0; n_nodes + 1];
    let on_lines = |element: &Solid| {
        let nodes = element.nodes().iter().copied();
        nodes.filter(|&node| is_on_line[node]).collect::<Vec<_>>()
    };
    for node in elements.iter().flat_map(on_lines) {
        start[node + 1] += 1;
    }
    for node in 0..n_nodes {
        start[node + 1] += start[node];
    }
    let mut next = start.clone();
    let mut around = vec![0; start[n_nodes]];
    for (number, element) in elements.iter().enumerate() {
        for node in on_lines(element) {
            around[next[node]] = number;
            next[node] += 1;
        }
    }
    Around {
        start,
        elements: around,
    }
}

/// The sector of every element around a node, numbered as they come.
fn sectors(node: usize, around: &[usize], elements: &[Solid], cuts: &Cuts) -> Vec<usize> {
    // Elements on either side of the edges that end here and are not cut.
    let mut beside: HashMap<usize, Vec<usize>> = HashMap::new();
    for (at, &element) in around.iter().enumerate() {
        for [a, b, middle] in elements[element].edges() {
            if (a == node || b == node) && !cuts.interface.contains_key(&middle) {
                beside.entry(middle).or_default().push(at);
            }
        }
    }
    let mut neighbours = vec![Vec::new(); around.len()];
    for sides in beside.values() {
        for pair in sides.windows(2) {
            neighbours[pair[0]].push(pair[1]);
            neighbours[pair[1]].push(pair[0]);
        }
    }
    let mut sector = vec![usize::MAX; around.len()];
    let mut count = 0;
    for first in 0..around.len() {
        if sector[first] != usize::MAX {
            continue;
        }
        let mut todo = vec![first];
        while let Some(at) = todo.pop() {
            if std::mem::replace(&mut sector[at], count) != count {
                let open = neighbours[at].iter().copied();
                todo.extend(open.filter(|&other| sector[other] == usize::MAX));
            }
        }
        count += 1;
    }
    sector
}

/// An element, and the positions of the nodes of one of its edges.
type Side = (usize, [usize; 3]);

/// The elements on the right and on the left of every edge, interface by interface.
fn sides(
    elements: &[Solid],
    interfaces: &[Interface],
    around: &Around,
) -> Result<Vec<[Side; 2]>, Fault> {
    let mut sides = Vec::new();
    for (interface, Interface { edges, .. }) in interfaces.iter().enumerate() {
        for (edge, &[a, b, middle]) in edges.iter().enumerate() {
            let fault = |reason| Fault {
                interface,
                edge,
                reason,
            };
            if middle + 1 >= around.start.len() {
                return Err(fault(Reason::NoEdge));
            }
            let (mut right, mut left) = (None, None);
            for &element in &around.elements[around.start[middle]..around.start[middle + 1]] {
                let Some([from, to, at]) = edge_at(&elements[element], middle) else {
                    return Err(fault(Reason::NoEdge));
                };
                let nodes = elements[element].nodes();
                // Counter-clockwise an element lies on the left of its edges.
                let (side, places) = match [nodes[from], nodes[to]] {
                    ends if ends == [a, b] => (&mut left, [from, to, at]),
                    ends if ends == [b, a] => (&mut right, [to, from, at]),
                    _ => return Err(fault(Reason::NoEdge)),
                };
                if side.replace((element, places)).is_some() {
                    return Err(fault(Reason::Overlapping));
                }
            }
            sides.push(match (right, left) {
                (Some(right), Some(left)) => [right, left],
                (None, None) => return Err(fault(Reason::NoEdge)),
                _ => return Err(fault(Reason::OnBoundary)),
            });
        }
    }
    Ok(sides)
}

#[cfg(test)]
#[path = "insert/tests.rs"]
mod tests;
