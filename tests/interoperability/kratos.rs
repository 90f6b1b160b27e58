//! The unmodified Kratos GeoMechanics with laws of ours, by the entry of Abaqus user materials. Its
//! null pointers are many.

use crate::{BondedPile, KRATOS, assert_close, beside, installed, is_there, last_line, library};
use std::process::Command;

/// As far as both programs carry the iteration.
const AGREEMENT: f64 = 1e-10;

#[test]
fn mohr_coulomb_gives_our_head_force() {
    if !is_there(KRATOS) {
        return;
    }
    // c' = c + σ_0 tan φ stands for the confinement.
    let cohesion = 1.0 + 100.0 * 36.5_f64.to_radians().tan();
    let none = "{ 11 = 0.0, 22 = 0.0, 33 = 0.0, 12 = 0.0 }";
    let here = BondedPile::run(&format!(
        "[laws.soil.parameters]\ncohesion = {cohesion:?}\n\
         [groups.soil]\nintegration = \"reduced\"\ninitial_stress = {none}\n\
         [groups.pile]\nintegration = \"reduced\"\ninitial_stress = {none}\n\
         [[phase]]\nname = \"push\"\npressure = []"
    ));
    let mut command = Command::new(installed(KRATOS));
    command
        .arg(beside("kratos.py"))
        .arg("umat_")
        .arg(library("mohr_coulomb"));
    let parameters = [34e3, 0.3, cohesion, 36.5, 12.0];
    command.arg("10").args(parameters.map(|p| format!("{p:?}")));
    let there: serde_json::Value = serde_json::from_str(&last_line(&mut command)).unwrap();
    let head_force = there["head_force"].as_f64().unwrap();
    assert_close(head_force, here.head_force, AGREEMENT, "head force");
    // With the elastic tangent, as its own law has it, it takes more than eight hundred.
    let iterations = there["iterations"].as_array().unwrap();
    let iterations: u64 = iterations
        .iter()
        .filter_map(serde_json::Value::as_u64)
        .sum();
    assert!(iterations <= 50, "{iterations} iterations");
}
