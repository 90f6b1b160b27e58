//! Parts of problems that are posed in memory.
#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "each test program uses a part; tests panic to fail"
)]

use law::{Hypothesis, SearchPath};
use mechanics::mesh::{Along, Solid};
use mechanics::problem::{Axis, Pressure, Support};
use mechanics::{Material, Mesh};

/// A law of this workspace with its values.
pub(crate) fn material(id: &str, hypothesis: Hypothesis, values: &[(&str, f64)]) -> Material {
    let target = std::env::current_exe().unwrap();
    let deps = target.parent().unwrap().to_owned();
    let search = SearchPath::new(&[deps.clone(), deps.parent().unwrap().to_owned()]);
    let values: Vec<_> = values.iter().map(|&(id, v)| (id, v.into())).collect();
    let law = search.law(id).unwrap().with(hypothesis, &values).unwrap();
    Material::new(id, law)
}

pub(crate) fn elastic(hypothesis: Hypothesis, e: f64, nu: f64) -> Material {
    let values = [("young_modulus", e), ("poisson_ratio", nu)];
    material("elastic", hypothesis, &values)
}

/// A Coulomb joint: its two stiffnesses, cohesion, angle of friction; it does not dilate.
pub(crate) fn joint([normal, shear]: [f64; 2], cohesion: f64, friction_angle: f64) -> Material {
    let values = [
        ("normal_stiffness", normal),
        ("shear_stiffness", shear),
        ("cohesion", cohesion),
        ("friction_angle", friction_angle),
        ("dilatancy_angle", 0.0),
    ];
    material("coulomb_joint", Hypothesis::Interface2d, &values)
}

pub(crate) fn held(line: &str, fixed: &[Axis]) -> Support {
    Support {
        line: line.to_owned(),
        fixed: fixed.to_vec(),
    }
}

/// This pressure, kPa, on a line.
pub(crate) fn pressed(line: &str, value: f64) -> Vec<Pressure> {
    let (line, value) = (line.to_owned(), value.into());
    vec![Pressure { line, value }]
}

/// Names all edges with this coordinate.
pub(crate) fn name(mesh: &mut Mesh, line: &str, axis: usize, at: f64) {
    mesh.name_line(line, |edge| {
        edge.iter().all(|node| (node[axis] - at).abs() < 1e-9)
    });
}

/// Names the four sides of a mesh.
pub(crate) fn name_sides(mesh: &mut Mesh) {
    for (axis, names) in [["left", "right"], ["bottom", "top"]].iter().enumerate() {
        let at: Vec<f64> = mesh.nodes.iter().map(|node| node[axis]).collect();
        name(
            mesh,
            names[0],
            axis,
            at.iter().copied().fold(f64::INFINITY, f64::min),
        );
        name(
            mesh,
            names[1],
            axis,
            at.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        );
    }
}

/// Inserts joints along lines, of these groups; ends on the boundary are open.
pub(crate) fn insert_joints(mesh: &mut Mesh, lines: &[(&str, usize)]) {
    let along = |&(line, group): &(&str, usize)| Along {
        line: line.to_owned(),
        group,
        opens_ends: true,
    };
    let all: Vec<Along> = lines.iter().map(along).collect();
    mesh.insert_joints(&all).unwrap();
}

/// Cuts quads into two triangles: along one diagonal, the other, or not at all.
pub(crate) fn cut(mesh: &mut Mesh, diagonal: impl Fn(usize) -> Option<bool>) {
    let quads = std::mem::take(&mut mesh.solids);
    for (number, quad) in quads.into_iter().enumerate() {
        let Some(is_first) = diagonal(number) else {
            mesh.solids.push(quad);
            continue;
        };
        let [a, b, c, d, ab, bc, cd, da] = quad.nodes().try_into().unwrap();
        let middle = mesh.nodes.len();
        let (from, to) = if is_first { (a, c) } else { (b, d) };
        let ends = [from, to].map(|node| mesh.nodes[node]);
        mesh.nodes
            .push([0, 1].map(|i| f64::midpoint(ends[0][i], ends[1][i])));
        let halves = if is_first {
            [[a, b, c, ab, bc, middle], [a, c, d, middle, cd, da]]
        } else {
            [[a, b, d, ab, middle, da], [b, c, d, bc, cd, middle]]
        };
        let halves = halves.map(|nodes| Solid::triangle(nodes, quad.group));
        mesh.solids.extend(halves);
    }
}
