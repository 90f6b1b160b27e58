//! From what a mesh file says to the mesh of a case.

mod notes;

use super::Wanted;
use super::contents::{Contents, Element, Node};
use super::cursor::Fault;
use super::kind::{Kind, MOST_NODES};
use super::words::{Faults, counted, list};
use indexmap::IndexMap;
use mechanics::element;
use mechanics::mesh::{Line, Mesh, Solid};
use mechanics::problem::Analysis;
use std::collections::{HashMap, HashSet};

/// Nodes of a mesh, and their numbers by those of the file.
type Numbered = (Vec<[f64; 2]>, HashMap<usize, usize>);
/// Nodes of an element of the file, by their place in it.
type Nodes = [usize; MOST_NODES];
/// Ends of a side, the smaller one first.
type Ends = [usize; 2];

/// Largest coordinate, m.
const FARTHEST: f64 = 1e9;
/// Lengths within this fraction of the mesh's size count as zero.
pub(super) const NOTHING: f64 = 1e-9;
/// What joins elements that do not fit together.
const JOIN: &str = "`Coherence;` in Gmsh, before the mesh is made, makes one of two curves there; `Coherence Mesh;` joins only \
                    sides with the same ends and middle";

/// A side of an element.
#[derive(Clone, Copy, Debug)]
struct Side {
    /// Its ends, as the first element that has it goes round.
    ends: [usize; 2],
    /// Elements that have it, with the number of their edge.
    owners: [Option<(usize, usize)>; 2],
}

/// The mesh of a case, of a file.
pub(super) struct Assembled {
    pub(super) mesh: Mesh,
    /// For each of its nodes the place in the file, from 0.
    pub(super) kept: Vec<usize>,
    /// For each of its solid elements the number in the file.
    pub(super) numbers: Vec<u64>,
    /// What the user should know.
    pub(super) notes: Vec<String>,
}

/// A mesh in the making.
struct Assembly<'a> {
    contents: &'a Contents<'a>,
    wanted: &'a Wanted<'a>,
    /// Elements of the file that the case has, as those of the mesh; by their nodes in the file.
    own: HashMap<Nodes, usize>,
    /// Those elements, with their nodes in the file and those that are put in, and their groups.
    taken: Vec<(&'a Element, Nodes, usize)>,
    /// Ends of the sides that get a node in their middle; such nodes are counted on from those of the file.
    put_in: Vec<Ends>,
    /// Whether a node of the file belongs to an element that the case leaves out.
    is_outside: Vec<bool>,
    /// Sides of elements that the case leaves out.
    outside: HashSet<Ends>,
    /// Without a case: numbers of elements by two groups that both have them.
    shared: IndexMap<[usize; 2], usize>,
    notes: Vec<String>,
}

/// The mesh of a case.
///
/// # Errors
/// The defect of the file, and its place.
pub(super) fn assemble(contents: &Contents<'_>, wanted: &Wanted<'_>) -> Result<Assembled, Fault> {
    let mut assembly = Assembly {
        contents,
        wanted,
        own: HashMap::new(),
        taken: Vec::new(),
        put_in: Vec::new(),
        is_outside: vec![false; contents.nodes.len()],
        outside: HashSet::new(),
        shared: IndexMap::new(),
        notes: Vec::new(),
    };
    assembly.take_elements()?;
    assembly.note_shared();
    assembly.leave_out()?;
    assembly.put_in_middles();
    let (nodes, number) = assembly.nodes()?;
    let mut mesh = Mesh {
        nodes,
        ..Mesh::default()
    };
    for (element, nodes, group) in &assembly.taken {
        let nodes = nodes.map(|node| number.get(&node).copied().unwrap_or_default());
        let kind = element.kind.solid();
        let solid = kind.map(|kind| turned(kind, &mesh.nodes, nodes, *group));
        mesh.solids.extend(solid);
    }
    let sides = assembly.sides(&mesh)?;
    assembly.lines(&mut mesh, &number, &sides)?;
    if wanted.is_case {
        assembly.note_lines();
    }
    assembly.note_twins(&mesh);
    assembly.note_bad_nodes(&mesh);
    let n_of_file = contents.nodes.len();
    let mut kept: Vec<usize> = number.into_keys().filter(|&n| n < n_of_file).collect();
    kept.sort_unstable();
    Ok(Assembled {
        mesh,
        kept,
        numbers: assembly.taken.iter().map(|(e, ..)| e.number).collect(),
        notes: assembly.notes,
    })
}

impl<'a> Assembly<'a> {
    fn fault<T>(&self, element: &Element, message: &str) -> Result<T, Fault> {
        Err(self.contents.cursor.fault(element.place, message))
    }

    /// The elements that are in groups of the case, in the order of the file.
    fn take_elements(&mut self) -> Result<(), Fault> {
        let contents = self.contents;
        let mut group_of_set: HashMap<(u8, usize), Vec<usize>> = HashMap::new();
        let mut faults = Faults::default();
        for element in contents.elements.iter().filter(|e| e.kind.dimension() == 2) {
            let groups = group_of_set
                .entry(Contents::set_of(element))
                .or_insert_with(|| self.groups_of(element));
            faults.add(self.take(element, groups))?;
        }
        faults.refuse()
    }

    fn take(&mut self, element: &'a Element, groups: &[usize]) -> Result<(), Fault> {
        let contents = self.contents;
        let group = match groups {
            [] => return Ok(()),
            [group] => *group,
            [first, second, ..] => {
                self.in_two_groups(element, [*first, *second])?;
                *first
            }
        };
        let nodes = contents.nodes_of(element)?;
        // Format 2.2 has an element that is in two groups twice.
        let mut key = nodes;
        key.sort_unstable();
        if let Some(&number) = self.own.get(&key) {
            let (other, _, other_group) = self.taken[number];
            if other_group != group {
                self.in_two_groups(element, [other_group, group])?;
                self.taken[number].2 = group.min(other_group);
                return Ok(());
            }
            let both = contents.two_elements(other, element);
            return self.fault(element, &format!("{both} have the same nodes"));
        }
        self.own.insert(key, self.taken.len());
        self.taken.push((element, nodes, group));
        Ok(())
    }

    /// Groups of the case that an element is in, each once, in their order.
    fn groups_of(&self, element: &Element) -> Vec<usize> {
        let names = self.contents.groups_of(element);
        let groups = names.filter_map(|n| self.wanted.groups.get(n.as_str()).copied());
        let mut groups: Vec<usize> = groups.collect();
        groups.sort_unstable();
        groups.dedup();
        groups
    }

    /// Refuses an element in two groups of a case; without a case counts it.
    fn in_two_groups(&mut self, element: &Element, groups: [usize; 2]) -> Result<(), Fault> {
        if !self.wanted.is_case {
            *self.shared.entry(groups).or_default() += 1;
            return Ok(());
        }
        let [first, second] = groups.map(|group| self.wanted.name(group));
        let message = format!(
            "{} is in two groups of the case, `{first}` and `{second}`",
            self.contents.element(element)
        );
        self.fault(element, &message)
    }

    /// Says which elements are left out.
    fn leave_out(&mut self) -> Result<(), Fault> {
        let contents = self.contents;
        let mut left: IndexMap<(u8, usize), (&Element, usize)> = IndexMap::new();
        for element in contents.elements.iter().filter(|e| e.kind.dimension() == 2) {
            let nodes = contents.nodes_of(element)?;
            let mut key = nodes;
            key.sort_unstable();
            if self.own.contains_key(&key) {
                continue;
            }
            for node in &nodes[..element.kind.n_nodes()] {
                self.is_outside[*node] = true;
            }
            self.outside
                .extend(sides(element.kind, &nodes).map(|(ends, _)| ends));
            let entry = left.entry(Contents::set_of(element));
            entry.or_insert((element, 0)).1 += 1;
        }
        let mut names: IndexMap<String, usize> = IndexMap::new();
        let mut nameless = 0;
        for (element, n) in left.into_values() {
            let mut is_nameless = true;
            for name in contents.groups_of(element) {
                *names.entry(name).or_default() += n;
                is_nameless = false;
            }
            if is_nameless {
                nameless += n;
            }
        }
        if !names.is_empty() {
            let listed = names.iter().map(|(name, n)| format!("`{name}` ({n})"));
            self.notes.push(format!(
                "physical surfaces that are no groups of the case are left out, with their elements: \
                 {}",
                list(listed)
            ));
        }
        if nameless > 0 {
            self.notes.push(format!(
                "{} in no physical surface and left out",
                counted(nameless, "element", " is", "s are")
            ));
        }
        Ok(())
    }

    /// Puts nodes in the middles of the sides of elements of first order. Elements share those of their sides, also
    /// with elements of second order.
    fn put_in_middles(&mut self) {
        let n_of_file = self.contents.nodes.len();
        let is_first = |element: &Element| element.kind.is_first_order();
        let taken = self.taken.iter().map(|(element, ..)| element.kind);
        let n_first = taken.filter(|kind| kind.is_first_order()).count();
        if n_first == 0 {
            return;
        }
        self.notes.push(format!(
            "{} of first order: the middles of sides get nodes, straight between the corners \
             (`Mesh.ElementOrder = 2` in Gmsh follows curves)",
            counted(n_first, "element", " is", "s are")
        ));
        let mut known: HashMap<Ends, usize> = HashMap::new();
        for (element, nodes, _) in self.taken.iter().filter(|(e, ..)| !is_first(e)) {
            known.extend(sides(element.kind, nodes).map(|(ends, at)| (ends, nodes[at])));
        }
        for (element, nodes, _) in self.taken.iter_mut().filter(|(e, ..)| is_first(e)) {
            let of_file = *nodes;
            for (ends, at) in sides(element.kind, &of_file) {
                nodes[at] = *known.entry(ends).or_insert_with(|| {
                    self.put_in.push(ends);
                    n_of_file + self.put_in.len() - 1
                });
            }
        }
    }

    /// Place of a node in the plane, m. Lengths up to `nothing` are round-off.
    fn in_plane(&self, node: &Node, nothing: f64) -> Result<[f64; 2], Fault> {
        let (contents, wanted) = (self.contents, self.wanted);
        let [mut x, y, z] = node.at.map(|at| wanted.scale * at);
        let wrong = |message: String| Err(contents.cursor.fault(node.place, &message));
        let name = || contents.node(node.number);
        if [x, y, z].iter().any(|at| at.abs() > FARTHEST) {
            return wrong(format!(
                "{} is at ({x:e}, {y:e}), expected at most {FARTHEST:e} m",
                name()
            ));
        }
        if z.abs() > nothing {
            return wrong(format!(
                "{} is at z = {z}: the mesh does not lie in the plane of x and y (in axisymmetry x is the \
                 radius, y the axis)",
                name()
            ));
        }
        if wanted.analysis == Analysis::Axisymmetric {
            if x < -nothing {
                return wrong(format!(
                    "{} is at x = {x}, across the axis; x is the radius, 0 on the axis",
                    name()
                ));
            }
            // Round-off of Gmsh; what is on the axis is told by 0.
            if x.abs() <= 1e-3 * nothing {
                x = 0.0;
            }
        }
        Ok([x, y])
    }

    /// The nodes of the mesh, and their numbers by those of the file.
    fn nodes(&mut self) -> Result<Numbered, Fault> {
        let (contents, wanted) = (self.contents, self.wanted);
        let mut is_used = vec![false; contents.nodes.len()];
        for (element, nodes, _) in &self.taken {
            for node in &nodes[..element.kind.n_nodes()] {
                is_used[*node] = true;
            }
        }
        let used = || {
            contents
                .nodes
                .iter()
                .zip(&is_used)
                .filter(|(_, used)| **used)
        };
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for (node, _) in used() {
            for c in 0..3 {
                low[c] = low[c].min(wanted.scale * node.at[c]);
                high[c] = high[c].max(wanted.scale * node.at[c]);
            }
        }
        let size = f64::max(high[0] - low[0], high[1] - low[1]);
        let nothing = NOTHING * size;
        let mut nodes = Vec::new();
        let mut number = HashMap::new();
        for (place, node) in contents.nodes.iter().enumerate() {
            if !is_used[place] {
                continue;
            }
            number.insert(place, nodes.len());
            nodes.push(self.in_plane(node, nothing)?);
        }
        for (ends, place) in self.put_in.iter().zip(contents.nodes.len()..) {
            let [p, q] = ends.map(|end| nodes[number[&end]]);
            number.insert(place, nodes.len());
            nodes.push([0, 1].map(|c| f64::midpoint(p[c], q[c])));
        }
        let left_out = is_used.iter().zip(&self.is_outside);
        let left_out = left_out.filter(|(used, outside)| !**used && !**outside);
        let left_out = left_out.count();
        if left_out > 0 {
            self.notes.push(format!(
                "{} to no triangle or quad and left out",
                counted(left_out, "node", " belongs", "s belong")
            ));
        }
        Ok((nodes, number))
    }

    /// Sides of the mesh's elements, by the node in their middle.
    fn sides(&self, mesh: &Mesh) -> Result<Vec<Option<Side>>, Fault> {
        let mut sides: Vec<Option<Side>> = vec![None; mesh.nodes.len()];
        let mut is_corner = vec![false; mesh.nodes.len()];
        let mut faults = Faults::default();
        for (number, solid) in mesh.solids.iter().enumerate() {
            for (edge, [a, b, middle]) in solid.edges().enumerate() {
                is_corner[a] = true;
                let side = &mut sides[middle];
                faults.add(self.add_side(side, (number, edge), [a, b]))?;
            }
        }
        faults.refuse()?;
        let mut corners = sides.iter().zip(&is_corner).filter(|(_, is)| **is);
        match corners.find_map(|(side, _)| side.as_ref()) {
            Some(side) => self.corner_in_the_middle(side),
            None => Ok(sides),
        }
    }

    /// Notes that an element has a side, with these ends, as it goes round.
    fn add_side(
        &self,
        side: &mut Option<Side>,
        owner: (usize, usize),
        [a, b]: [usize; 2],
    ) -> Result<(), Fault> {
        let Some(side) = side else {
            let owners = [Some(owner), None];
            let ends = [a, b];
            *side = Some(Side { ends, owners });
            return Ok(());
        };
        if side.ends == [b, a] && side.owners[1].is_none() {
            side.owners[1] = Some(owner);
            return Ok(());
        }
        let first = side.owners[0].map_or(owner.0, |(first, _)| first);
        let [other, element] = [first, owner.0].map(|number| self.taken[number].0);
        let both = self.contents.two_elements(other, element);
        let message = if side.ends == [b, a] {
            let [third, one] = [element, other].map(|e| self.contents.element(e));
            format!("{third} is the third one on a side of {one}")
        } else if side.ends == [a, b] {
            format!("{both} lie on each other: both are on the same side of an edge")
        } else {
            format!("{both} have the middle of a side in common, but not its ends")
        };
        self.fault(element, &message)
    }

    fn corner_in_the_middle<T>(&self, side: &Side) -> Result<T, Fault> {
        let owner = side.owners[0].map_or(0, |(owner, _)| owner);
        let element = self.taken[owner].0;
        let message = format!(
            "the middle of a side of {} is a corner of another element: the mesh \
             does not fit together there ({JOIN})",
            self.contents.element(element)
        );
        self.fault(element, &message)
    }

    /// Elements of a dimension in physical groups, and the names of these.
    fn named(&self, dimension: u8) -> impl Iterator<Item = (&'a Element, Vec<String>)> {
        let contents = self.contents;
        let elements = contents.elements.iter();
        let own = elements.filter(move |element| element.kind.dimension() == dimension);
        own.map(|element| (element, contents.groups_of(element).collect()))
            .filter(|(_, names): &(_, Vec<String>)| !names.is_empty())
    }

    /// The lines of physical curves, each with its first element.
    fn curves(
        &self,
        number: &HashMap<usize, usize>,
        sides: &[Option<Side>],
    ) -> Result<IndexMap<String, (Line, &'a Element)>, Fault> {
        let contents = self.contents;
        let mut seen: HashSet<(String, usize)> = HashSet::new();
        let mut of_name: IndexMap<String, (Line, &Element)> = IndexMap::new();
        let has_first = contents.elements.iter().any(|e| e.kind == Kind::Line2);
        let of_ends = middles(if has_first { sides } else { &[] });
        for (element, names) in self.named(1) {
            let nodes = contents.nodes_of(element)?;
            let own = nodes.map(|node| number.get(&node).copied());
            let side = side_on(element.kind, own, (sides, &of_ends));
            // Where a surface is left out, its outline is.
            let is_outside = self.outside.contains(&ends_of(nodes[0], nodes[1]));
            for name in names {
                let (line, _) = of_name
                    .entry(name.clone())
                    .or_insert_with(|| (Line::default(), element));
                if let Some((middle, side)) = side {
                    if seen.insert((name, middle)) {
                        line.edges.extend(side.owners.iter().flatten());
                    }
                } else if self.wanted.lines.contains(name.as_str()) && !is_outside {
                    let message = format!(
                        "{} of the physical curve `{name}` is no side of an element of the case's groups",
                        contents.element(element)
                    );
                    return self.fault(element, &message);
                }
            }
        }
        Ok(of_name)
    }

    /// Names the lines and points of the mesh.
    fn lines(
        &self,
        mesh: &mut Mesh,
        number: &HashMap<usize, usize>,
        sides: &[Option<Side>],
    ) -> Result<(), Fault> {
        let mut of_name = self.curves(number, sides)?;
        let mut seen = HashSet::new();
        for (element, names) in self.named(0) {
            let node = number.get(&self.contents.nodes_of(element)?[0]).copied();
            for name in names {
                let new = || (Line::default(), element);
                let (line, first) = of_name.entry(name.clone()).or_insert_with(new);
                // Else the curve of this name is taken.
                if first.kind.dimension() == 0
                    && let Some(node) = node
                    && seen.insert((name, node))
                {
                    line.nodes.push(node);
                }
            }
        }
        for (name, (line, element)) in of_name {
            if !line.edges.is_empty() || !line.nodes.is_empty() {
                mesh.lines.insert(name, line);
            } else if self.wanted.lines.contains(name.as_str()) {
                let message = format!("no element of the case's groups is at `{name}`");
                return self.fault(element, &message);
            }
        }
        Ok(())
    }
}

/// Ends of a side.
fn ends_of(a: usize, b: usize) -> Ends {
    [a.min(b), a.max(b)]
}

/// Sides of a triangle or quad: their ends, and where its nodes have the middle.
fn sides(kind: Kind, nodes: &Nodes) -> impl Iterator<Item = (Ends, usize)> + use<'_> {
    let n = kind.solid().map_or(0, element::Kind::n_corners);
    (0..n).map(move |side| (ends_of(nodes[side], nodes[(side + 1) % n]), n + side))
}

/// Middles of sides, by their ends.
fn middles(sides: &[Option<Side>]) -> HashMap<Ends, usize> {
    let sides = sides.iter().enumerate();
    let known = sides.filter_map(|(at, side)| side.map(|side| (side.ends, at)));
    known.map(|([a, b], at)| (ends_of(a, b), at)).collect()
}

/// The side of the mesh on which an element of a curve lies, and the middle of it.
fn side_on<'s>(
    kind: Kind,
    nodes: [Option<usize>; MOST_NODES],
    (sides, of_ends): (&'s [Option<Side>], &HashMap<Ends, usize>),
) -> Option<(usize, &'s Side)> {
    let ends = ends_of(nodes[0]?, nodes[1]?);
    let of_first_order = || {
        of_ends
            .get(&ends)
            .copied()
            .filter(|_| kind.is_first_order())
    };
    let middle = nodes[2].or_else(of_first_order)?;
    let side = sides[middle].as_ref()?;
    (ends_of(side.ends[0], side.ends[1]) == ends).then_some((middle, side))
}

/// An element of the mesh, its nodes counter-clockwise.
fn turned(kind: &'static element::Kind, at: &[[f64; 2]], nodes: Nodes, group: usize) -> Solid {
    let solid = Solid::new(kind, &nodes, group);
    if solid.area(at) < 0.0 {
        solid.reversed()
    } else {
        solid
    }
}
