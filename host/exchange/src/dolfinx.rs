//! Input of DOLFINx: a script that reads `model.json`, computes with `pilum.Law`, and writes the file that Kratos' does.

use mechanics::mesh::Mesh;

/// The middle of a straight side lies off the middle of its ends by at most this part of it.
const STRAIGHT: f64 = 1e-9;

pub(crate) fn files() -> Vec<(String, String)> {
    vec![(
        "run_dolfinx.py".to_owned(),
        include_str!("run_dolfinx.py").to_owned(),
    )]
}

/// The first property of a group's elements that DOLFINx meshes here cannot have: other kinds, or curved sides.
pub(crate) fn unknown(mesh: &Mesh, group: usize) -> Option<&'static str> {
    let n_nodes = mesh.solids.first().map_or(0, |solid| solid.nodes().len());
    let own = || mesh.solids.iter().filter(|solid| solid.group == group);
    let mut sides = own().flat_map(mechanics::mesh::Solid::edges);
    if own().any(|solid| solid.nodes().len() != n_nodes) {
        Some("an element of another kind than the first of the mesh")
    } else if sides.any(|side| mesh.off_middle(side).iter().any(|off| *off > STRAIGHT)) {
        Some("an element with curved sides")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mechanics::mesh::Solid;

    #[test]
    fn elements_of_one_kind_with_straight_sides_are_known() {
        let mut mesh = Mesh::grid(&[0.0, 1.0, 3.0], &[0.0, 1.0], |column, _| column);
        assert_eq!([0, 1].map(|group| unknown(&mesh, group)), [None, None]);
        let middle = mesh.solids[1].nodes()[4];
        mesh.nodes[middle][1] -= 0.01;
        let curved = Some("an element with curved sides");
        assert_eq!([0, 1].map(|group| unknown(&mesh, group)), [None, curved]);
        let nodes = [0, 1, 2, 5, 6, 4].map(|node| mesh.solids[1].nodes()[node]);
        mesh.solids[1] = Solid::triangle(nodes, 1);
        assert!(unknown(&mesh, 1).is_some_and(|what| what.contains("another kind")));
    }
}
