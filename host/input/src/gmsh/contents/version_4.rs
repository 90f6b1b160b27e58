//! Sections of formats 4.1 and 4.0.
//!
//! They differ little. 4.0 omits the largest and smallest numbers, names the entity of a block before its dimension,
//! and gives the box of a point two corners. It has the number of a node next to its coordinates, and writes numbers of
//! nodes and elements in 4 bytes.

use super::{Element, Fault, MOST_NODES, Reader, Version};

impl Reader<'_> {
    fn is_new(&self) -> bool {
        self.version == Version::FourOne
    }

    /// The smallest and the largest number of all nodes or elements.
    fn skip_range(&mut self, of: &str) -> Result<(), Fault> {
        if self.is_new() {
            for which in ["smallest", "largest"] {
                let what = format!("the {which} number of {of}");
                self.contents.cursor.size(&what)?;
            }
        }
        Ok(())
    }

    /// Dimension and number of a block's entity.
    fn entity(&mut self) -> Result<(i64, i64), Fault> {
        let mut words = ["the dimension of an entity", "the number of an entity"];
        if !self.is_new() {
            words.reverse();
        }
        let cursor = &mut self.contents.cursor;
        let (first, second) = (cursor.integer(words[0])?, cursor.integer(words[1])?);
        Ok(if self.is_new() {
            (first, second)
        } else {
            (second, first)
        })
    }

    /// The number of a node or an element.
    fn number(&mut self, what: &str) -> Result<u64, Fault> {
        if self.is_new() {
            self.contents.cursor.size(what)
        } else {
            self.contents.cursor.natural(what)
        }
    }

    /// Parts of the geometry, of which only the physical groups matter.
    pub(super) fn entities(&mut self) -> Result<(), Fault> {
        let is_new = self.is_new();
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
                for _ in 0..if dimension == 0 && is_new { 3 } else { 6 } {
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

    pub(super) fn nodes_4(&mut self) -> Result<(), Fault> {
        // Number and coordinates.
        let bytes = if self.is_new() { 32 } else { 28 };
        let cursor = &mut self.contents.cursor;
        let blocks = cursor.count("the number of blocks of nodes", 4, 20)?;
        let at = cursor.at();
        let all = cursor.count("the number of nodes", 4, bytes)?;
        self.skip_range("a node")?;
        let mut numbers = Vec::new();
        let mut sum = 0;
        for _ in 0..blocks {
            let (dimension, _) = self.entity()?;
            let cursor = &mut self.contents.cursor;
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
            let n = cursor.count("the number of nodes of a block", 4, bytes)?;
            sum += n;
            // In format 4.1 all numbers come first.
            numbers.clear();
            for _ in 0..if self.is_new() { n } else { 0 } {
                let place = self.contents.cursor.at();
                numbers.push((self.number("the number of a node")?, place));
            }
            for row in 0..n {
                let (number, place) = if let Some(known) = numbers.get(row) {
                    *known
                } else {
                    let place = self.contents.cursor.at();
                    (self.number("the number of a node")?, place)
                };
                let at = self.coordinates()?;
                for _ in 0..parameters {
                    self.contents.cursor.real("a parameter of a node")?;
                }
                self.add_node(number, at, place)?;
            }
        }
        self.check_sum(at, "nodes", all, sum)
    }

    pub(super) fn elements_4(&mut self) -> Result<(), Fault> {
        // Each number.
        let bytes = if self.is_new() { 8 } else { 4 };
        let cursor = &mut self.contents.cursor;
        let blocks = cursor.count("the number of blocks of elements", 4, 20)?;
        let at = cursor.at();
        let all = cursor.count("the number of elements", 2, 2 * bytes)?;
        self.skip_range("an element")?;
        let mut sum = 0;
        for _ in 0..blocks {
            let at = self.contents.cursor.at();
            let (dimension, entity) = self.entity()?;
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
            let what = "the number of elements of a block";
            let n = cursor.count(what, numbers, bytes * numbers)?;
            sum += n;
            for _ in 0..n {
                let place = self.contents.cursor.at();
                let number = self.number("the number of an element")?;
                let mut nodes = [0; MOST_NODES];
                for node in &mut nodes[..kind.n_nodes()] {
                    *node = self.number("a node of an element")?;
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
}
