//! Sections of formats 2.0 to 2.2.

use super::{Element, Encoding, Fault, Kind, MOST_NODES, Reader};

impl Reader<'_> {
    /// A number of things that is in a line of text in any encoding.
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

    /// Nodes, and perhaps with each the entity that it is on and its parameters there.
    pub(super) fn nodes_2(&mut self, with_parameters: bool) -> Result<(), Fault> {
        let (numbers, bytes) = if with_parameters { (6, 36) } else { (4, 28) };
        let n = self.count_in_text("the number of nodes", numbers, bytes)?;
        for _ in 0..n {
            let cursor = &mut self.contents.cursor;
            let place = cursor.at();
            let number = cursor.natural("the number of a node")?;
            let at = self.coordinates()?;
            if with_parameters {
                let cursor = &mut self.contents.cursor;
                let dimension = cursor.integer("the dimension of a node's entity")?;
                cursor.integer("the number of a node's entity")?;
                // On a curve or surface.
                for _ in 0..if (1..=2).contains(&dimension) {
                    dimension
                } else {
                    0
                } {
                    cursor.real("a parameter of a node")?;
                }
            }
            self.add_node(number, at, place)?;
        }
        Ok(())
    }

    pub(super) fn elements_2(&mut self) -> Result<(), Fault> {
        let all = self.count_in_text("the number of elements", 3, 8)?;
        let is_text = self.contents.cursor.encoding == Encoding::Text;
        let mut left = all;
        while left > 0 {
            // A block of elements of one type; in text every element says its own type.
            let place = self.contents.cursor.at();
            let (number, kind, n);
            if is_text {
                number = Some(self.contents.cursor.natural("the number of an element")?);
                kind = self.kind()?;
                n = 1;
            } else {
                number = None;
                kind = self.kind()?;
                let at = self.contents.cursor.at();
                n = self
                    .contents
                    .cursor
                    .natural("the number of elements of a block")? as usize;
                if n == 0 || n > left {
                    let message = format!("a block has {n} elements, expected 1 to {left}");
                    return Err(self.contents.cursor.fault(at, &message));
                }
            }
            let at = self.contents.cursor.at();
            let n_tags = self.contents.cursor.natural("the number of tags")?;
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
                    None => self.contents.cursor.natural("the number of an element")?,
                };
                self.element_2(kind, number, n_tags, place)?;
            }
            left -= n;
        }
        Ok(())
    }

    /// Tags and nodes of an element. The first tag is its physical group, or 0.
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
        let mut nodes = [0; MOST_NODES];
        for node in &mut nodes[..kind.n_nodes()] {
            *node = self.contents.cursor.natural("a node of an element")?;
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
