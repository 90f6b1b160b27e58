//! What a user should know of a mesh that can be computed.

use super::super::twins::twins;
use super::super::words::{counted, list, of_two_kinds};
use super::{Assembly, JOIN, ends_of};
use mechanics::mesh::Mesh;

impl Assembly<'_> {
    /// Says which physical surfaces a case cannot both have.
    pub(super) fn note_shared(&mut self) {
        for (pair, n) in std::mem::take(&mut self.shared) {
            let [low, high] = ends_of(pair[0], pair[1]).map(|group| self.wanted.name(group));
            self.notes.push(format!(
                "physical surfaces `{low}` and `{high}` have {} in common, counted here in `{low}`: a case has only one \
                 of them as a group",
                counted(n, "element", "", "s")
            ));
        }
    }

    /// Says which names of lines and points the case does not use.
    pub(super) fn note_lines(&mut self) {
        let [points, curves, _] = super::super::counts(self.contents);
        let both = curves.iter().filter(|(name, n)| {
            **n > 0 && points.contains_key(*name) && self.wanted.lines.contains(name.as_str())
        });
        self.notes.extend(of_two_kinds(both.map(|(name, _)| name)));
        let unused = |name: &&String| !self.wanted.lines.contains(name.as_str());
        let unused: Vec<&String> = curves.keys().chain(points.keys()).filter(unused).collect();
        if !unused.is_empty() {
            let names = unused.iter().map(|name| format!("`{name}`"));
            let names = list(names);
            self.notes.push(format!(
                "physical curves and points that the case does not use: {names}"
            ));
        }
    }

    /// Says if nodes are at one place without being one: nothing holds elements together there.
    pub(super) fn note_twins(&mut self, mesh: &Mesh) {
        let Some(twins) = twins(mesh) else { return };
        let [x, y] = twins.first;
        let upon = twins.upon.map_or_else(String::new, |pair| {
            let [a, b] = pair.map(|number| self.taken[number].0);
            format!("; {} lie on each other", self.contents.two_elements(a, b))
        });
        self.notes.push(format!(
            "{} where another one is, first at ({x}, {y}): elements are not joined there{upon} ({JOIN})",
            counted(twins.n, "node", " is", "s are")
        ));
    }

    /// Says if a Jacobian is not positive at a node.
    pub(super) fn note_bad_nodes(&mut self, mesh: &Mesh) {
        let solids = mesh.solids.iter().zip(&self.taken);
        let mut bad = solids.filter(|(solid, _)| solid.scaled_jacobian(&mesh.nodes) <= 0.0);
        let Some((_, (first, ..))) = bad.next() else {
            return;
        };
        let first = self.contents.element(first);
        let n = counted(1 + bad.count(), "element", " has", "s have");
        self.notes.push(format!(
            "{n} a Jacobian that is not positive at a node, the first is {first}: strains there are wrong; use smaller \
             elements along curves"
        ));
    }
}
