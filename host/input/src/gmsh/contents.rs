//! What a mesh file says: its sections, read one after the other.

mod version_2;
mod version_4;

use super::cursor::{Cursor, Encoding, Fault};
use super::format::{self, Version};
use super::kind::{Kind, MOST_NODES};
use std::collections::HashMap;

/// In place of a node that an element does not have.
pub(super) const NO_NODE: usize = usize::MAX;

/// Sections that are understood; each comes once.
const SECTIONS: [&str; 5] = [
    "MeshFormat",
    "PhysicalNames",
    "Entities",
    "Nodes",
    "Elements",
];

/// What a mesh file says.
#[derive(Debug)]
pub(super) struct Contents<'a> {
    /// The file, for places of what is wrong.
    pub(super) cursor: Cursor<'a>,
    /// Names of physical groups, by dimension and number.
    names: HashMap<(u8, i64), String>,
    /// The same in the order of the file.
    pub(super) named: Vec<(u8, String)>,
    pub(super) nodes: Vec<Node>,
    /// Nodes by the number that the file gives them.
    numbers: HashMap<u64, usize>,
    pub(super) elements: Vec<Element>,
    /// Sets of physical groups that elements are in.
    sets: Vec<Vec<i64>>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) number: u64,
    pub(super) at: [f64; 3],
    /// Byte of the file.
    pub(super) place: usize,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Element {
    pub(super) kind: Kind,
    pub(super) number: u64,
    nodes: [u64; MOST_NODES],
    /// Number of the set of its physical groups.
    set: usize,
    /// Byte of the file.
    pub(super) place: usize,
}

/// Sets of physical groups, by what refers to them.
#[derive(Debug, Default)]
struct Sets {
    all: Vec<Vec<i64>>,
    /// Formats 4: by dimension and number of the part of the geometry.
    of_entity: HashMap<(i64, i64), usize>,
    has_entities: bool,
    /// Formats 2: by physical group.
    of_group: HashMap<i64, usize>,
}

impl<'a> Contents<'a> {
    /// Reads a file; or what arrays were written as.
    ///
    /// # Errors
    /// The defect, and its place; those of arrays by row.
    pub(super) fn read(bytes: &'a [u8], is_of_arrays: bool) -> Result<Self, Fault> {
        let mut cursor = Cursor::new(bytes);
        cursor.is_of_arrays = is_of_arrays;
        let version = format::read(&mut cursor)?;
        let mut reader = Reader {
            contents: Self {
                cursor,
                names: HashMap::new(),
                named: Vec::new(),
                nodes: Vec::new(),
                numbers: HashMap::new(),
                elements: Vec::new(),
                sets: Vec::new(),
            },
            sets: Sets::default(),
            version,
        };
        let read = reader.sections()?;
        let mut contents = reader.contents;
        contents.sets = reader.sets.all;
        for wanted in ["Nodes", "Elements"] {
            if !read.contains(&wanted) {
                let at = contents.cursor.at();
                let message = format!("the file ends without a section `${wanted}`");
                return Err(contents.cursor.fault(at, &message));
            }
        }
        Ok(contents)
    }

    /// A node as those who made the mesh count it.
    pub(super) fn node(&self, number: u64) -> String {
        if self.cursor.is_of_arrays {
            return format!("node {} (from 0)", number.saturating_sub(1));
        }
        format!("node {number}")
    }

    /// An element as those who made the mesh count it: of arrays by its row in its group.
    pub(super) fn element(&self, element: &Element) -> String {
        if !self.cursor.is_of_arrays {
            return format!("element {}", element.number);
        }
        let of_group = self
            .elements
            .iter()
            .filter(|e| Self::set_of(e) == Self::set_of(element));
        let row = of_group.take_while(|e| e.number != element.number).count();
        let name = self.groups_of(element).next().unwrap_or_default();
        format!("cell {row} (from 0) of `{name}`")
    }

    /// Two of them.
    pub(super) fn two_elements(&self, a: &Element, b: &Element) -> String {
        if self.cursor.is_of_arrays {
            return format!("{} and {}", self.element(a), self.element(b));
        }
        format!("elements {} and {}", a.number, b.number)
    }

    /// Names of an element's physical groups: that of one without a name is its number.
    pub(super) fn groups_of(&self, element: &Element) -> impl Iterator<Item = String> {
        let dimension = element.kind.dimension();
        let numbers = self.sets.get(element.set).map_or(&[][..], Vec::as_slice);
        numbers.iter().map(move |number| {
            let name = self.names.get(&(dimension, *number));
            name.cloned().unwrap_or_else(|| number.to_string())
        })
    }

    /// The set of an element's physical groups: elements of one set are in the same groups.
    pub(super) fn set_of(element: &Element) -> (u8, usize) {
        (element.kind.dimension(), element.set)
    }

    /// Nodes of an element, by their place in the file; beyond its own none exists, as [`NO_NODE`].
    ///
    /// # Errors
    /// There is no such node, or it has one twice.
    pub(super) fn nodes_of(&self, element: &Element) -> Result<[usize; MOST_NODES], Fault> {
        let mut nodes = [NO_NODE; MOST_NODES];
        for at in 0..element.kind.n_nodes() {
            let number = element.nodes[at];
            let Some(&node) = self.numbers.get(&number) else {
                let message = format!(
                    "{} has the {}, which is not among the nodes",
                    self.element(element),
                    self.node(number)
                );
                return Err(self.cursor.fault(element.place, &message));
            };
            if nodes[..at].contains(&node) {
                let message = format!(
                    "{} has the {} twice",
                    self.element(element),
                    self.node(number)
                );
                return Err(self.cursor.fault(element.place, &message));
            }
            nodes[at] = node;
        }
        Ok(nodes)
    }
}

struct Reader<'a> {
    contents: Contents<'a>,
    sets: Sets,
    version: Version,
}

impl Reader<'_> {
    /// Reads the sections of the file; returns the names of those that are understood.
    fn sections(&mut self) -> Result<Vec<&'static str>, Fault> {
        let mut read = vec!["MeshFormat"];
        loop {
            let at = self.contents.cursor.at();
            let Some(name) = self.contents.cursor.section()? else {
                break;
            };
            // Nodes may have parameters (formats 2).
            let with_parameters = name == "ParametricNodes" && self.version == Version::Two;
            let what = if with_parameters { "Nodes" } else { &name };
            let ours = SECTIONS.into_iter().find(|ours| *ours == what);
            let refused = if ours.is_some_and(|ours| read.contains(&ours)) {
                Some(format!("section `${what}` comes twice"))
            } else if what == "PartitionedEntities" {
                Some("the mesh is in several partitions; save it in one".to_owned())
            } else {
                name.starts_with("End")
                    .then(|| format!("`${name}` ends no section"))
            };
            if let Some(message) = refused {
                return Err(self.contents.cursor.fault(at, &message));
            }
            match (what, self.version) {
                ("PhysicalNames", _) => self.names()?,
                ("Nodes", Version::Two) => self.nodes_2(with_parameters)?,
                ("Elements", Version::Two) => self.elements_2()?,
                ("Entities", Version::Four | Version::FourOne) => self.entities()?,
                ("Nodes", _) => self.nodes_4()?,
                ("Elements", _) => self.elements_4()?,
                _ => {
                    self.contents.cursor.skip_to_end(&name)?;
                    continue;
                }
            }
            self.contents.cursor.end(&name)?;
            read.extend(ours);
        }
        Ok(read)
    }

    /// Names of physical groups: text in any encoding.
    fn names(&mut self) -> Result<(), Fault> {
        let Contents {
            cursor,
            names,
            named,
            ..
        } = &mut self.contents;
        let encoding = std::mem::replace(&mut cursor.encoding, Encoding::Text);
        let read = (|| {
            for _ in 0..cursor.count("the number of names", 3, 0)? {
                let at = cursor.at();
                // Format 2.0 says no dimension: a name is that of all groups of its number.
                let first = cursor.integer("the dimension of a name")?;
                let (dimensions, number) = if cursor.is_at(b'"') {
                    (0..=3, first)
                } else {
                    let number = cursor.integer("the number of a physical group")?;
                    (first..=first, number)
                };
                if !(0..=3).contains(dimensions.start()) {
                    return Err(cursor.fault(at, "a physical group has a dimension from 0 to 3"));
                }
                let at = cursor.at();
                let quoted = cursor.line();
                let name = quoted
                    .strip_prefix(b"\"")
                    .and_then(|name| name.strip_suffix(b"\""))
                    .and_then(|name| std::str::from_utf8(name).ok());
                let Some(name) = name else {
                    return Err(cursor.fault(at, "expected a name in quotation marks, in UTF-8"));
                };
                let is_of_one = dimensions.start() == dimensions.end();
                for dimension in dimensions {
                    let dimension = dimension as u8;
                    let key = (dimension, number.saturating_abs());
                    if names.insert(key, name.to_owned()).is_some() {
                        let message = format!("the physical group {number} has two names");
                        return Err(cursor.fault(at, &message));
                    }
                    if is_of_one {
                        named.push((dimension, name.to_owned()));
                    }
                }
            }
            Ok(())
        })();
        cursor.encoding = encoding;
        read
    }

    fn add_node(&mut self, number: u64, at: [f64; 3], place: usize) -> Result<(), Fault> {
        let contents = &mut self.contents;
        if contents
            .numbers
            .insert(number, contents.nodes.len())
            .is_some()
        {
            let message = format!("node {number} comes twice");
            return Err(contents.cursor.fault(place, &message));
        }
        if let Some(wrong) = at.iter().find(|at| !at.is_finite()) {
            let message = format!("a coordinate of {} is {wrong}", contents.node(number));
            return Err(contents.cursor.fault(place, &message));
        }
        contents.nodes.push(Node { number, at, place });
        Ok(())
    }

    fn coordinates(&mut self) -> Result<[f64; 3], Fault> {
        let mut at = [0.0; 3];
        for at in &mut at {
            *at = self.contents.cursor.real("a coordinate of a node")?;
        }
        Ok(at)
    }

    fn check_sum(&self, at: usize, what: &str, said: usize, sum: usize) -> Result<(), Fault> {
        if said == sum {
            return Ok(());
        }
        let message = format!("the section has {said} {what}, its blocks have {sum}");
        Err(self.contents.cursor.fault(at, &message))
    }

    fn kind(&mut self) -> Result<Kind, Fault> {
        let cursor = &mut self.contents.cursor;
        let at = cursor.at();
        let number = cursor.integer("the type of an element")?;
        Kind::of(number).map_err(|why| cursor.fault(at, &why))
    }
}
