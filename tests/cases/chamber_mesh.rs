//! De Gennaro & Frank, Fig. 14: the chamber on other meshes.
//!
//! Goal      independence of the mesh, away from head and toe.
//! Geometry, boundary, laws: cases/chamber_mesh/README.md.
//! Asserts   nodes of mesh 2; agreement of meshes 1 and 2; convergence under refinement; a soft
//!           element that relieves the toe.

use crate::variant::finished;
use tests::tolerance::close;

const CASE: &str = "chamber_mesh";

#[test]
fn meshes_1_and_2_nearly_coincide() {
    let [one, two] = ["mesh_1", "mesh_2"].map(|v| finished(CASE, v));
    let mesh = &two.summary["mesh"];
    assert_eq!(mesh["nodes"], 405);
    assert_eq!(mesh["elements"], 120);
    assert_eq!(one.summary["mesh"]["nodes"], 629);
    // Measured: 4.4 %, 4.7 %, 2.7 %.
    for (probe, tolerance) in [("tau_shaft", 0.05), ("sigma_n_shaft", 0.055), ("q_t", 0.05)] {
        let [a, b] = [&one, &two].map(|run| run.probe("loading", probe));
        let largest = a.last().unwrap();
        for (a, b) in a.iter().zip(b) {
            close(probe, *a, b, tolerance * largest);
        }
    }
}

#[test]
fn refinement_changes_the_shaft_little_and_the_toe_more() {
    let [one, fine] = ["mesh_1", "mesh_1_by_2"].map(|v| finished(CASE, v));
    assert_eq!(fine.summary["mesh"]["nodes"], 2281);
    let change = |probe| fine.end("loading", probe) / one.end("loading", probe) - 1.0;
    assert!(change("tau_shaft").abs() < 0.006 && change("sigma_n_shaft").abs() < 0.006);
    // Displacement elements are too stiff: loads fall.
    assert!(change("q_t") < 0.0 && change("q_t") > -0.04);
    assert!(change("q_p") < 0.0 && change("q_p") > -0.07);
}

#[test]
fn refined_by_2_4_and_8_the_loads_converge() {
    let runs = ["mesh_1", "mesh_1_by_2", "mesh_1_by_4", "mesh_1_by_8"].map(|v| finished(CASE, v));
    assert_eq!(runs[3].summary["mesh"]["nodes"], 33_739);
    let steps = |probe| -> Vec<f64> {
        let ends: Vec<f64> = runs.iter().map(|run| run.end("loading", probe)).collect();
        ends.windows(2).map(|pair| pair[0] - pair[1]).collect()
    };
    // The singular corner slows the loads down, it does not stop them.
    for probe in ["q_t", "q_p"] {
        let [first, second, third] = steps(probe)[..] else {
            panic!("three refinements")
        };
        assert!(first > 0.0 && second > 0.0 && third > 0.0);
        assert!(second < 0.5 * first && third < 0.65 * second, "{probe}");
    }
    let last = steps("tau_shaft")[2] / runs[3].end("loading", "tau_shaft");
    assert!(last.abs() < 1e-3, "{last}");
}

#[test]
fn a_soft_element_relieves_the_toe_and_nothing_else() {
    let [stiff, soft] = ["stiff_end", "soft_end"].map(|v| finished(CASE, v));
    let ratio = |probe| soft.end("loading", probe) / stiff.end("loading", probe);
    assert!(ratio("sigma_n_toe") < 0.75, "{}", ratio("sigma_n_toe"));
    assert!((ratio("sigma_n_low") - 1.0).abs() < 0.01 && (ratio("tau_shaft") - 1.0).abs() < 0.015);
}
