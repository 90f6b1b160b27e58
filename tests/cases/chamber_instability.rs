//! De Gennaro & Frank, Table IV with p_0 = 1 kPa: an interface that contracts out of contact.
//!
//! Goal      a run that finds no equilibrium stops at the last one and says so
//! Geometry, boundary, laws: cases/chamber_instability/README.md
//! Asserts   exit code 2, results up to the last equilibrium, the point that loses contact; remedies that converge, and what they give

use crate::variant::{finished, run};

const CASE: &str = "chamber_instability";

#[test]
fn without_equilibrium_the_run_stops_at_the_last_one() {
    for variant in [
        "as_printed",
        "small_increments",
        "no_elasticity_along_the_layer",
        "swap_then_push",
    ] {
        let run = run(CASE, variant);
        let error = run.outcome.as_ref().unwrap_err();
        assert_eq!(error.exit_code(), 2, "{variant}: {error}");
        let message = error.to_string();
        assert!(message.contains("phase `loading`, increment 1"));
        assert!(
            message.contains("group `interface`, element 10, point "),
            "{variant}: {message}"
        );
        assert!(
            message.contains("contact opens and closes there"),
            "{variant}: {message}"
        );
        let summary = &run.summary;
        assert_eq!(summary["status"], "no equilibrium");
        assert_eq!(summary["last_equilibrium"]["phase"], "confinement");
        assert_eq!(run.probe("confinement", "k_l").len(), 1);
        assert_eq!(run.probe("loading", "k_l").len(), 0);
    }
}

#[test]
fn remedies_converge_to_nearly_the_same_loss_of_normal_stress() {
    for variant in ["mean", "reduced", "friction_in_confinement"] {
        let run = finished(CASE, variant);
        let k_l = run.probe("loading", "k_l");
        // The interface only contracts: K_l falls from 1.37 to 0.71 … 0.73 within 1.5 mm. Then the
        // toe, which presses elastic sand aside, brings it to 0.75 … 0.78.
        assert!(k_l[..9].windows(2).all(|pair| pair[1] < pair[0]));
        let least = k_l.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(least > 0.69 && least < 0.74, "{variant}: {least}");
        assert!(k_l[49] > 0.74 && k_l[49] < 0.79, "{variant}: {}", k_l[49]);
    }
}
