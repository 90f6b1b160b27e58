//! The unmodified OpenGeoSys with laws of ours, by MFront's generic interface.

use crate::{
    BondedPile, OPENGEOSYS, assert_close, beside, installed, is_there, last_line, library,
};
use std::process::Command;

/// OpenGeoSys iterates until the displacements change by 1e-12, this program until the residual is 1e-12 of
/// the forces; the rest is a margin for other machines' sums.
const AGREEMENT: f64 = 1e-10;

pub(crate) struct Answer {
    pub(crate) head_force: f64,
    iterations: u64,
    points: Vec<[f64; 6]>,
}

/// Runs `opengeosys.py`, with a law of ours or the program's own.
pub(crate) fn run(analysis: &str, tolerance: &str, law: &str, behaviour: Option<&str>) -> Answer {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(installed("opengeosys/bin/python"));
    command
        .arg(beside("opengeosys.py"))
        .arg(installed(OPENGEOSYS));
    command.arg(folder.path()).args([analysis, tolerance, law]);
    if let Some(behaviour) = behaviour {
        command.arg(library(law)).arg(behaviour);
    }
    let answer: serde_json::Value = serde_json::from_str(&last_line(&mut command)).unwrap();
    let points = answer["points"].as_array().unwrap();
    Answer {
        head_force: answer["head_force"].as_f64().unwrap(),
        iterations: answer["iterations"].as_u64().unwrap(),
        points: points
            .iter()
            .map(|row| std::array::from_fn(|i| row[i].as_f64().unwrap()))
            .collect(),
    }
}

/// Head force and stresses of all points of the soil.
fn assert_agrees(analysis: &str, law: &str, behaviour: &str, changes: &str) {
    let there = run(analysis, "1e-12", law, Some(behaviour));
    let here = BondedPile::run(&format!("analysis = \"{analysis}\"\n{changes}"));
    assert_close(there.head_force, here.head_force, AGREEMENT, "head force");
    let size = here.points.iter().flat_map(|point| &point[2..]);
    let size = size.fold(0.0_f64, |max, stress| max.max(stress.abs()));
    for point in &here.points {
        let distance = |other: &&[f64; 6]| (point[0] - other[0]).hypot(point[1] - other[1]);
        let nearest = there.points.iter();
        let nearest = nearest
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap();
        assert!(distance(&nearest) < 1e-9, "no point at {:?}", &point[..2]);
        for i in 2..6 {
            let difference = (point[i] - nearest[i]).abs();
            assert!(
                difference <= AGREEMENT * size,
                "stress {i} at {:?}: {} there, {} here",
                &point[..2],
                nearest[i],
                point[i]
            );
        }
    }
}

#[test]
fn mohr_coulomb_gives_our_stresses() {
    if !is_there(OPENGEOSYS) {
        return;
    }
    for analysis in ["axisymmetric", "plane_strain"] {
        assert_agrees(analysis, "mohr_coulomb", "MohrCoulomb", "");
    }
}

#[test]
fn elastic_gives_our_stresses() {
    if !is_there(OPENGEOSYS) {
        return;
    }
    let changes = "[groups.soil]\nlaw = \"elastic_soil\"";
    for analysis in ["axisymmetric", "plane_strain"] {
        assert_agrees(analysis, "elastic", "Elastic", changes);
    }
}

#[test]
fn mohr_coulomb_takes_no_more_iterations_than_the_programs_own() {
    if !is_there(OPENGEOSYS) {
        return;
    }
    for analysis in ["axisymmetric", "plane_strain"] {
        let ours = run(analysis, "1e-7", "mohr_coulomb", Some("MohrCoulomb"));
        let own = run(analysis, "1e-7", "mohr_coulomb", None);
        assert!(
            ours.iterations <= own.iterations,
            "{analysis}: {} iterations, {} with its own",
            ours.iterations,
            own.iterations
        );
        // Its surface has rounded edges and apex, inside the exact one.
        assert_close(own.head_force, ours.head_force, 2e-4, analysis);
    }
}
