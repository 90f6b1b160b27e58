//! Patch tests: boundary displacements are those of a field whose stress is constant in every
//! group; all integration points must then have that stress.

use crate::nine_nodes::on_nine_nodes;
use crate::setup::{Results, assert_close, grid, run};
use std::fmt::Write;
use tests::tolerance::ROUND_OFF;

/// Round-off of solved equations, with a margin for thin elements: their strains lose the digits
/// that displacements of their two faces have in common.
pub(crate) const PATCH: f64 = 10.0 * ROUND_OFF;

/// Direction of the normal of a layer or a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Normal {
    /// Layers are vertical.
    X,
    /// Layers are horizontal.
    Y,
}

impl Normal {
    /// Both.
    pub(crate) const BOTH: [Self; 2] = [Self::X, Self::Y];

    /// From (along the layer, across it) to (x, y), or back.
    pub(crate) fn turn(self, [along, across]: [f64; 2]) -> [f64; 2] {
        match self {
            Self::X => [across, along],
            Self::Y => [along, across],
        }
    }

    /// From components along, across, out of plane, shear of a layer to 11 22 33 12.
    pub(crate) fn turn_stress(self, [along, across, out, shear]: [f64; 4]) -> [f64; 4] {
        let [s_11, s_22] = self.turn([along, across]);
        [s_11, s_22, out, shear]
    }
}

/// Stress (or traction and jump) that all points of a group must have.
#[derive(Clone, Debug)]
pub(crate) struct Expected {
    group: String,
    values: Vec<(&'static str, f64)>,
    /// References of stresses, tractions and jumps.
    scales: [f64; 2],
    tolerance: f64,
}

impl Expected {
    /// Stress 11 22 33 12 of a solid.
    pub(crate) fn stress(group: &str, stress: [f64; 4]) -> Self {
        let names = ["stress_11", "stress_22", "stress_33", "stress_12"];
        Self {
            group: group.to_owned(),
            values: names.into_iter().zip(stress).collect(),
            scales: [largest(&stress), 0.0],
            tolerance: PATCH,
        }
    }

    /// Traction and jump, normal and tangential.
    pub(crate) fn interface(group: &str, traction: [f64; 2], jump: [f64; 2]) -> Self {
        let names = ["traction_n", "traction_t", "jump_n", "jump_t"];
        let values = [traction[0], traction[1], jump[0], jump[1]];
        Self {
            group: group.to_owned(),
            values: names.into_iter().zip(values).collect(),
            scales: [largest(&traction), largest(&jump)],
            tolerance: PATCH,
        }
    }

    /// Sets what stresses and jumps are compared with where they are zero.
    pub(crate) fn scaled(self, scales: [f64; 2]) -> Self {
        Self { scales, ..self }
    }

    /// Sets another tolerance.
    pub(crate) fn within(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, v| m.max(v.abs()))
}

/// A patch.
pub(crate) struct Patch<'a> {
    /// `plane_strain` or `axisymmetric`.
    pub(crate) analysis: &'a str,
    /// Grid lines.
    pub(crate) x: &'a [f64],
    /// Grid lines.
    pub(crate) y: &'a [f64],
    /// `[[mesh.region]]` entries.
    pub(crate) regions: &'a str,
    /// Lines under `[laws]`.
    pub(crate) laws: &'a str,
    /// Lines under `[groups]`.
    pub(crate) groups: &'a str,
    /// Lines under `[mesh.lines]`.
    pub(crate) lines: &'a str,
    /// `[[phase]]` entries.
    pub(crate) phases: &'a str,
}

impl Patch<'_> {
    /// Runs the patch on quads of 8 and of 9 nodes, and compares every point.
    #[track_caller]
    pub(crate) fn assert(&self, what: &str, expected: &[Expected]) {
        let text = self.text(expected);
        assert_points(&text, what, expected);
        // Reduced integration is not for quads of 9 nodes.
        if !self.groups.contains("\"reduced\"") {
            let folder = tempfile::tempdir().unwrap();
            let text = on_nine_nodes(&text, folder.path());
            assert_points(&text, &format!("{what}, 9 nodes"), expected);
        }
    }

    fn text(&self, expected: &[Expected]) -> String {
        let Self {
            analysis,
            x,
            y,
            regions,
            laws,
            groups,
            lines,
            phases,
        } = self;
        let (columns, rows) = (grid(&x[1..]), grid(&y[1..]));
        let mut probes = String::new();
        for Expected { group, values, .. } in expected {
            for (name, _) in values {
                for reduce in ["min", "max"] {
                    let _ = writeln!(
                        probes,
                        "{group}_{name}_{reduce} = {{ group = \"{group}\", \
                         quantity = \"{name}\", reduce = \"{reduce}\" }}"
                    );
                }
            }
        }
        format!(
            "analysis = \"{analysis}\"\n\
             [mesh]\norigin = [{:?}, {:?}]\ncolumns = {columns}\nrows = {rows}\n{regions}\n\
             [mesh.lines]\n{lines}\n[laws]\n{laws}\n[groups]\n{groups}\n{phases}\n\
             [probes]\n{probes}",
            x[0], y[0]
        )
    }
}

/// Lines for all nodes on the boundary of a grid, and a phase that gives them the displacements
/// of a field.
pub(crate) fn boundary_nodes(
    x: &[f64],
    y: &[f64],
    field: &dyn Fn([f64; 2]) -> [f64; 2],
) -> (String, String) {
    let (fine_x, fine_y) = (with_middles(x), with_middles(y));
    let (mut lines, mut displacements) = (String::new(), String::new());
    let last = [fine_x.len() - 1, fine_y.len() - 1];
    for (i, &x) in fine_x.iter().enumerate() {
        for (j, &y) in fine_y.iter().enumerate() {
            if i == 0 || j == 0 || i == last[0] || j == last[1] {
                let [u_x, u_y] = field([x, y]);
                let _ = writeln!(lines, "node_{i}_{j} = {{ x = {x:?}, y = {y:?} }}");
                let _ = writeln!(
                    displacements,
                    "  {{ line = \"node_{i}_{j}\", x = {u_x:e}, y = {u_y:e} }},"
                );
            }
        }
    }
    let phase = format!(
        "[[phase]]\nname = \"strain\"\nincrements = 1\ndisplacement = [\n{displacements}]\n"
    );
    (lines, phase)
}

fn with_middles(ends: &[f64]) -> Vec<f64> {
    let pairs = ends
        .windows(2)
        .flat_map(|w| [w[0], f64::midpoint(w[0], w[1])]);
    pairs.chain([ends[ends.len() - 1]]).collect()
}

/// Runs a case and compares every point.
#[track_caller]
fn assert_points(text: &str, what: &str, expected: &[Expected]) {
    let finished = run(text);
    for Expected {
        group,
        values,
        scales,
        tolerance,
    } in expected
    {
        for (name, value) in values {
            let scale = scales[usize::from(name.starts_with("jump"))];
            for reduce in ["min", "max"] {
                let found = finished.last(&format!("{group}_{name}_{reduce}"));
                let label = format!("{what}: {reduce} of {name} in {group}");
                assert_close(&label, found, *value, *tolerance, scale);
            }
        }
    }
    assert_eq!(finished.observer.cut_backs, 0, "{what}: cut-backs");
}
