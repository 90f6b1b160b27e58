//! Writes a model in every format.

use super::*;

/// Writes numbers in an encoding.
pub(super) struct Writer(pub(super) Vec<u8>, pub(super) Bytes);

impl Writer {
    pub(super) fn text(&mut self, text: &str) {
        self.0.extend(text.as_bytes());
    }

    pub(super) fn int(&mut self, n: i64) {
        match self.1 {
            Bytes::Text => self.text(&format!("{n} ")),
            Bytes::Little => self.0.extend((n as i32).to_le_bytes()),
            Bytes::Big => self.0.extend((n as i32).to_be_bytes()),
        }
    }

    pub(super) fn size(&mut self, n: u64) {
        match self.1 {
            Bytes::Text => self.text(&format!("{n} ")),
            Bytes::Little => self.0.extend(n.to_le_bytes()),
            Bytes::Big => self.0.extend(n.to_be_bytes()),
        }
    }

    pub(super) fn reals(&mut self, values: &[f64]) {
        for value in values {
            match self.1 {
                Bytes::Text => self.text(&format!("{value} ")),
                Bytes::Little => self.0.extend(value.to_le_bytes()),
                Bytes::Big => self.0.extend(value.to_be_bytes()),
            }
        }
    }

    pub(super) fn new_line(&mut self) {
        if self.1 == Bytes::Text {
            self.text("\n");
        }
    }

    pub(super) fn end(&mut self, name: &str) {
        if self.1 != Bytes::Text {
            self.text("\n");
        }
        self.text(&format!("$End{name}\n"));
    }
}

impl Model {
    pub(super) fn write(&self, version: f64, bytes: Bytes) -> Vec<u8> {
        let mut w = Writer(Vec::new(), bytes);
        let is_text = bytes == Bytes::Text;
        w.text(&format!(
            "$MeshFormat\n{version} {} 8\n",
            u8::from(!is_text)
        ));
        if !is_text {
            w.int(1);
        }
        w.end("MeshFormat");
        let mut names = format!("$PhysicalNames\n{}\n", self.names.len());
        for (dimension, number, name) in &self.names {
            writeln!(names, "{dimension} {number} \"{name}\"").unwrap();
        }
        w.text(&names);
        w.text("$EndPhysicalNames\n");
        if version >= 4.0 {
            self.write_4(&mut w, version > 4.0);
        } else {
            self.write_2(&mut w);
        }
        w.0
    }

    /// Format 4.1, or 4.0.
    fn write_4(&self, w: &mut Writer, is_new: bool) {
        // The number of a node or element.
        let number = |w: &mut Writer, n: u64| {
            if is_new {
                w.size(n);
            } else {
                w.int(n as i64);
            }
        };
        let entity = |w: &mut Writer, dimension: i64, entity: i64| {
            let both = [dimension, entity];
            w.int(both[usize::from(!is_new)]);
            w.int(both[usize::from(is_new)]);
        };
        w.text("$Entities\n");
        for dimension in 0..4 {
            let own = self.entities.iter().filter(|e| e.0 == dimension);
            w.size(own.count() as u64);
        }
        w.new_line();
        for (dimension, number, groups) in &self.entities {
            w.int((*number).into());
            let is_place = *dimension == 0 && is_new;
            w.reals(&[0.0; 6][..if is_place { 3 } else { 6 }]);
            w.size(groups.len() as u64);
            for group in groups {
                w.int((*group).into());
            }
            if *dimension > 0 {
                w.size(2);
                w.int(1);
                w.int(-2);
            }
            w.new_line();
        }
        w.end("Entities");
        w.text("$Nodes\n");
        // Two blocks, the second of nodes with a parameter.
        let (first, second) = self.nodes.split_at(5);
        for n in &[2, self.nodes.len() as u64, 10, 150][..if is_new { 4 } else { 2 }] {
            w.size(*n);
        }
        w.new_line();
        for (dimension, block) in [(2, first), (1, second)] {
            entity(w, dimension, 1);
            w.int((dimension == 1).into());
            w.size(block.len() as u64);
            w.new_line();
            for (n, _) in block.iter().filter(|_| is_new) {
                number(w, *n);
                w.new_line();
            }
            for (n, at) in block {
                if !is_new {
                    number(w, *n);
                }
                w.reals(at);
                if dimension == 1 {
                    w.reals(&[0.25]);
                }
                w.new_line();
            }
        }
        w.end("Nodes");
        w.text("$Elements\n");
        let n = self.elements.len() as u64;
        for n in &[n, n, 1, n][..if is_new { 4 } else { 2 }] {
            w.size(*n);
        }
        w.new_line();
        for (n, (dimension, own, kind, nodes)) in self.elements.iter().enumerate() {
            entity(w, (*dimension).into(), (*own).into());
            w.int((*kind).into());
            w.size(1);
            w.new_line();
            number(w, n as u64 + 1);
            for node in nodes {
                number(w, *node);
            }
            w.new_line();
        }
        w.end("Elements");
    }

    fn write_2(&self, w: &mut Writer) {
        w.text(&format!("$Nodes\n{}\n", self.nodes.len()));
        for (number, at) in &self.nodes {
            w.int(*number as i64);
            w.reals(at);
            w.new_line();
        }
        w.end("Nodes");
        // An element is written once for each of its groups.
        let mut all = Vec::new();
        for (dimension, entity, kind, nodes) in &self.elements {
            let of = self
                .entities
                .iter()
                .find(|e| (e.0, e.1) == (*dimension, *entity));
            let groups = of.map_or(&[][..], |e| &e.2);
            let or_none = if groups.is_empty() { &[0][..] } else { groups };
            for group in or_none {
                all.push((*kind, *group, *entity, nodes));
            }
        }
        w.text(&format!("$Elements\n{}\n", all.len()));
        for (number, (kind, group, entity, nodes)) in all.into_iter().enumerate() {
            let number = number as i64 + 1;
            if w.1 == Bytes::Text {
                w.int(number);
                w.int(kind.into());
                w.int(2);
            } else {
                w.int(kind.into());
                w.int(1);
                w.int(2);
                w.int(number);
            }
            w.int(group.into());
            w.int(entity.into());
            for node in nodes {
                w.int(*node as i64);
            }
            w.new_line();
        }
        w.end("Elements");
    }
}
