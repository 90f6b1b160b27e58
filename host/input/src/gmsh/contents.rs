//! What a mesh file says: its sections, read one after the other, in formats 4.1 and 2.2.

use super::cursor::{Cursor, Encoding, Fault};
use super::kind::Kind;
use std::collections::HashMap;

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
    nodes: [u64; 8],
    /// Number of the set of its physical groups.
    set: usize,
    /// Byte of the file.
    pub(super) place: usize,
}

/// A file's format: version and encoding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Version {
    Two,
    Four,
}

/// Sets of physical groups, by what refers to them.
#[derive(Debug, Default)]
struct Sets {
    all: Vec<Vec<i64>>,
    /// Format 4.1: by dimension and number of the part of the geometry.
    of_entity: HashMap<(i64, i64), usize>,
    has_entities: bool,
    /// Format 2.2: by physical group.
    of_group: HashMap<i64, usize>,
}

impl<'a> Contents<'a> {
    /// Reads a file.
    ///
    /// # Errors
    /// What is wrong with it, and where.
    pub(super) fn read(bytes: &'a [u8]) -> Result<Self, Fault> {
        Self::read_by(Cursor::new(bytes))
    }

    /// Reads what arrays were written as.
    ///
    /// # Errors
    /// What is wrong with them, by their rows.
    pub(super) fn read_arrays(bytes: &'a [u8]) -> Result<Self, Fault> {
        let mut cursor = Cursor::new(bytes);
        cursor.is_of_arrays = true;
        Self::read_by(cursor)
    }

    fn read_by(mut cursor: Cursor<'a>) -> Result<Self, Fault> {
        let first = cursor.section();
        if !matches!(&first, Ok(Some(name)) if name == "MeshFormat") {
            let message = "a mesh file of Gmsh begins with `$MeshFormat`, this one does not";
            return Err(cursor.fault(0, message));
        }
        let version = format(&mut cursor)?;
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
        };
        let mut read: Vec<String> = Vec::new();
        loop {
            let at = reader.contents.cursor.at();
            let Some(name) = reader.contents.cursor.section()? else {
                break;
            };
            let is_ours = ["PhysicalNames", "Entities", "Nodes", "Elements"].contains(&&*name);
            if is_ours && read.contains(&name) {
                let message = format!("section `${name}` comes twice");
                return Err(reader.contents.cursor.fault(at, &message));
            }
            match (name.as_str(), version) {
                ("MeshFormat", _) => {
                    let message = "section `$MeshFormat` comes twice";
                    return Err(reader.contents.cursor.fault(at, message));
                }
                ("PartitionedEntities", _) => {
                    let message = "the mesh is in several partitions; save it in one";
                    return Err(reader.contents.cursor.fault(at, message));
                }
                ("PhysicalNames", _) => reader.names()?,
                ("Entities", Version::Four) => reader.entities()?,
                ("Nodes", Version::Four) => reader.nodes_4()?,
                ("Elements", Version::Four) => reader.elements_4()?,
                ("Nodes", Version::Two) => reader.nodes_2()?,
                ("Elements", Version::Two) => reader.elements_2()?,
                _ if name.starts_with("End") => {
                    let message = format!("`${name}` ends no section");
                    return Err(reader.contents.cursor.fault(at, &message));
                }
                _ => {
                    reader.contents.cursor.skip_to_end(&name)?;
                    continue;
                }
            }
            reader.contents.cursor.end(&name)?;
            read.push(name);
        }
        let mut contents = reader.contents;
        contents.sets = reader.sets.all;
        for wanted in ["Nodes", "Elements"] {
            if !read.iter().any(|name| name == wanted) {
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

    /// Nodes of an element, by their place in the file.
    ///
    /// # Errors
    /// There is no such node, or it has one twice.
    pub(super) fn nodes_of(&self, element: &Element) -> Result<[usize; 8], Fault> {
        let mut nodes = [usize::MAX; 8];
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

/// Version and encoding, and the end of their section.
fn format(cursor: &mut Cursor<'_>) -> Result<Version, Fault> {
    let at = cursor.at();
    let number = cursor.real("the version of the format")?;
    let version = if (number - 4.1).abs() < 1e-9 {
        Version::Four
    } else if (number - 2.2).abs() < 1e-9 {
        Version::Two
    } else {
        let message = format!(
            "the format has version {number}; 4.1 and 2.2 are read: set `Mesh.MshFileVersion = 4.1` \
             in Gmsh"
        );
        return Err(cursor.fault(at, &message));
    };
    let at = cursor.at();
    let kind = cursor.integer("0 for ASCII or 1 for binary")?;
    if !(0..=1).contains(&kind) {
        let message = format!("the file's type is {kind}, expected 0 for ASCII or 1 for binary");
        return Err(cursor.fault(at, &message));
    }
    let at = cursor.at();
    let size = cursor.integer("the size of numbers")?;
    if size != 8 {
        let message = format!("numbers of {size} bytes; those of 8 are read");
        return Err(cursor.fault(at, &message));
    }
    if kind == 1 {
        cursor.line();
        let at = cursor.at();
        cursor.encoding = Encoding::Binary { big_endian: false };
        let one = cursor.integer("the number 1")?;
        let big_endian = one == i64::from(1_i32.swap_bytes());
        if one != 1 && !big_endian {
            let message = "expected the number 1 in 4 bytes, which says their order";
            return Err(cursor.fault(at, message));
        }
        cursor.encoding = Encoding::Binary { big_endian };
    }
    cursor.end("MeshFormat")?;
    Ok(version)
}

struct Reader<'a> {
    contents: Contents<'a>,
    sets: Sets,
}

impl Reader<'_> {
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
            let n = cursor.count("the number of names", 3, 0)?;
            for _ in 0..n {
                let at = cursor.at();
                let dimension = cursor.integer("the dimension of a name")?;
                let number = cursor.integer("the number of a physical group")?;
                let dimension = u8::try_from(dimension).ok().filter(|&d| d <= 3);
                let Some(dimension) = dimension else {
                    return Err(cursor.fault(at, "a physical group has a dimension from 0 to 3"));
                };
                let at = cursor.at();
                let quoted = cursor.line();
                let name = quoted
                    .strip_prefix(b"\"")
                    .and_then(|name| name.strip_suffix(b"\""))
                    .and_then(|name| std::str::from_utf8(name).ok());
                let Some(name) = name else {
                    return Err(cursor.fault(at, "expected a name in quotation marks, in UTF-8"));
                };
                let key = (dimension, number.saturating_abs());
                if names.insert(key, name.to_owned()).is_some() {
                    let message = format!("the physical group {number} has two names");
                    return Err(cursor.fault(at, &message));
                }
                named.push((dimension, name.to_owned()));
            }
            Ok(())
        })();
        cursor.encoding = encoding;
        read
    }

    /// Parts of the geometry, of which only the physical groups matter (format 4.1).
    fn entities(&mut self) -> Result<(), Fault> {
        let cursor = &mut self.contents.cursor;
        let mut counts = [0; 4];
        for (dimension, count) in counts.iter_mut().enumerate() {
            // A number, its place or box, and the number of its groups.
            let (numbers, bytes) = if dimension == 0 { (5, 36) } else { (9, 68) };
            *count = cursor.count("a number of entities", numbers, bytes)?;
        }
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                let at = cursor.at();
                let number = cursor.integer("the number of an entity")?;
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    cursor.real("a coordinate of an entity")?;
                }
                let n = cursor.count("the number of physical groups", 1, 4)?;
                let mut groups = Vec::with_capacity(n);
                for _ in 0..n {
                    let group = cursor.integer("a physical group")?;
                    groups.push(group.saturating_abs());
                }
                if dimension > 0 {
                    let n = cursor.count("the number of bounding entities", 1, 4)?;
                    for _ in 0..n {
                        cursor.integer("a bounding entity")?;
                    }
                }
                let set = self.sets.all.len();
                self.sets.all.push(groups);
                let key = (dimension as i64, number);
                if self.sets.of_entity.insert(key, set).is_some() {
                    let message = format!("entity {number} of dimension {dimension} comes twice");
                    return Err(cursor.fault(at, &message));
                }
            }
        }
        self.sets.has_entities = true;
        Ok(())
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

    fn nodes_4(&mut self) -> Result<(), Fault> {
        let cursor = &mut self.contents.cursor;
        let blocks = cursor.count("the number of blocks of nodes", 4, 20)?;
        let at = cursor.at();
        let all = cursor.count("the number of nodes", 4, 32)?;
        cursor.size("the smallest number of a node")?;
        cursor.size("the largest number of a node")?;
        let mut numbers = Vec::new();
        let mut sum = 0;
        for _ in 0..blocks {
            let cursor = &mut self.contents.cursor;
            let dimension = cursor.integer("the dimension of an entity")?;
            cursor.integer("the number of an entity")?;
            let at = cursor.at();
            let parameters = match cursor.integer("0, or 1 for nodes with parameters")? {
                0 => 0,
                1 => dimension.clamp(0, 3),
                other => {
                    let message =
                        format!("expected 0, or 1 for nodes with parameters, not {other}");
                    return Err(cursor.fault(at, &message));
                }
            };
            let n = cursor.count("the number of nodes of a block", 4, 32)?;
            sum += n;
            numbers.clear();
            for _ in 0..n {
                let place = cursor.at();
                numbers.push((cursor.size("the number of a node")?, place));
            }
            for &(number, place) in &numbers {
                let at = self.coordinates()?;
                for _ in 0..parameters {
                    self.contents.cursor.real("a parameter of a node")?;
                }
                self.add_node(number, at, place)?;
            }
        }
        self.check_sum(at, "nodes", all, sum)
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

    fn elements_4(&mut self) -> Result<(), Fault> {
        let cursor = &mut self.contents.cursor;
        let blocks = cursor.count("the number of blocks of elements", 4, 20)?;
        let at = cursor.at();
        let all = cursor.count("the number of elements", 2, 16)?;
        cursor.size("the smallest number of an element")?;
        cursor.size("the largest number of an element")?;
        let mut sum = 0;
        for _ in 0..blocks {
            let cursor = &mut self.contents.cursor;
            let at = cursor.at();
            let dimension = cursor.integer("the dimension of an entity")?;
            let entity = cursor.integer("the number of an entity")?;
            let kind = self.kind()?;
            let cursor = &mut self.contents.cursor;
            if i64::from(kind.dimension()) != dimension {
                let message = format!("elements of another dimension than {dimension}");
                return Err(cursor.fault(at, &message));
            }
            let set = match self.sets.of_entity.get(&(dimension, entity)) {
                Some(&set) => set,
                // Without entities there are no physical groups.
                None if !self.sets.has_entities => usize::MAX,
                None => {
                    let message = format!("there is no entity {entity} of dimension {dimension}");
                    return Err(cursor.fault(at, &message));
                }
            };
            let numbers = 1 + kind.n_nodes();
            let n = cursor.count("the number of elements of a block", numbers, 8 * numbers)?;
            sum += n;
            for _ in 0..n {
                let place = cursor.at();
                let number = cursor.size("the number of an element")?;
                let mut nodes = [0; 8];
                for node in &mut nodes[..kind.n_nodes()] {
                    *node = cursor.size("a node of an element")?;
                }
                self.contents.elements.push(Element {
                    kind,
                    number,
                    nodes,
                    set,
                    place,
                });
            }
        }
        self.check_sum(at, "elements", all, sum)
    }

    /// A number of things that stands in a line of text in any encoding (format 2.2).
    fn count_in_text(&mut self, what: &str, numbers: usize, bytes: usize) -> Result<usize, Fault> {
        let cursor = &mut self.contents.cursor;
        let encoding = std::mem::replace(&mut cursor.encoding, Encoding::Text);
        let at = cursor.at();
        let count = cursor.size(what);
        // Numbers in bytes begin right behind the end of the line.
        if encoding != Encoding::Text {
            cursor.line();
        }
        cursor.encoding = encoding;
        cursor.check_count(at, count?, what, numbers, bytes)
    }

    /// A whole number that is not negative.
    fn natural(&mut self, what: &str) -> Result<u64, Fault> {
        let cursor = &mut self.contents.cursor;
        let at = cursor.at();
        let number = cursor.integer(what)?;
        u64::try_from(number)
            .map_err(|_| cursor.fault(at, &format!("{what} is {number}, expected 0 or more")))
    }

    fn nodes_2(&mut self) -> Result<(), Fault> {
        let n = self.count_in_text("the number of nodes", 4, 28)?;
        for _ in 0..n {
            let place = self.contents.cursor.at();
            let number = self.natural("the number of a node")?;
            let at = self.coordinates()?;
            self.add_node(number, at, place)?;
        }
        Ok(())
    }

    fn elements_2(&mut self) -> Result<(), Fault> {
        let all = self.count_in_text("the number of elements", 3, 8)?;
        let is_text = self.contents.cursor.encoding == Encoding::Text;
        let mut left = all;
        while left > 0 {
            // A block of elements of one type; in text every element says its own type.
            let place = self.contents.cursor.at();
            let (number, kind, n);
            if is_text {
                number = Some(self.natural("the number of an element")?);
                kind = self.kind()?;
                n = 1;
            } else {
                number = None;
                kind = self.kind()?;
                let at = self.contents.cursor.at();
                n = self.natural("the number of elements of a block")? as usize;
                if n == 0 || n > left {
                    let message = format!("a block has {n} elements, expected 1 to {left}");
                    return Err(self.contents.cursor.fault(at, &message));
                }
            }
            let at = self.contents.cursor.at();
            let n_tags = self.natural("the number of tags")?;
            let cursor = &self.contents.cursor;
            let n_tags = cursor.check_count(at, n_tags, "the number of tags", 1, 4)?;
            for _ in 0..n {
                let place = if is_text {
                    place
                } else {
                    self.contents.cursor.at()
                };
                let number = match number {
                    Some(number) => number,
                    None => self.natural("the number of an element")?,
                };
                self.element_2(kind, number, n_tags, place)?;
            }
            left -= n;
        }
        Ok(())
    }

    /// Tags and nodes of an element (format 2.2). The first tag is its physical group, or 0.
    fn element_2(
        &mut self,
        kind: Kind,
        number: u64,
        n_tags: usize,
        place: usize,
    ) -> Result<(), Fault> {
        let mut group = 0;
        for tag in 0..n_tags {
            let value = self.contents.cursor.integer("a tag of an element")?;
            if tag == 0 {
                group = value.saturating_abs();
            }
        }
        let mut nodes = [0; 8];
        for node in &mut nodes[..kind.n_nodes()] {
            *node = self.natural("a node of an element")?;
        }
        let sets = &mut self.sets.all;
        let set = *self.sets.of_group.entry(group).or_insert_with(|| {
            sets.push(if group == 0 { Vec::new() } else { vec![group] });
            sets.len() - 1
        });
        self.contents.elements.push(Element {
            kind,
            number,
            nodes,
            set,
            place,
        });
        Ok(())
    }
}
