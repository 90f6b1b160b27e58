//! De Gennaro & Frank, Fig. 12: Mohr–Coulomb sand without cohesion around the pile.
//!
//! Goal      a rigid toe in sand with c = 0 converges to an equilibrium that holds.
//! Geometry, boundary, laws: cases/chamber_soil_law/README.md.
//! Asserts   balance of loads; every stress admissible; `K_l` keeps rising; toe load far below elastic.

use crate::variant::{assert_close, finished};
use std::f64::consts::PI;
use tests::tolerance::{EQUILIBRIUM, ROUND_OFF};

const CASE: &str = "chamber_soil_law";

#[test]
fn loads_balance() {
    for variant in ["elastic", "mohr_coulomb"] {
        let run = finished(CASE, variant);
        let plate = 100.0 * PI * 0.262 * 0.262;
        // While the law is swapped, the head carries what is not yet taken off of the force this frees.
        for phase in ["confinement", "loading"] {
            let fraction = |i: usize| {
                if phase == "confinement" {
                    (i + 1) as f64 / 10.0
                } else {
                    1.0
                }
            };
            let (top, head) = (run.probe(phase, "top"), run.probe(phase, "q_t"));
            for (i, (top, head)) in top.iter().zip(head).enumerate() {
                assert_close(top + head, fraction(i) * plate, EQUILIBRIUM, variant);
            }
        }
    }
}

#[test]
fn every_stress_is_admissible() {
    let run = finished(CASE, "mohr_coulomb");
    let sin_phi = 36.5_f64.to_radians().sin();
    let mut at_yield = 0;
    for phase in ["confinement", "loading"] {
        for point in run.points(phase).iter().filter(|p| p.group == "sand") {
            let [s_11, s_22, s_33, s_12] = point.stress;
            let (centre, radius) = (f64::midpoint(s_11, s_22), ((s_11 - s_22) / 2.0).hypot(s_12));
            let mut s = [centre + radius, centre - radius, s_33];
            s.sort_by(f64::total_cmp);
            // f = ((1 + sin φ) s₁ − (1 − sin φ) s₃)/2 ≤ 0, relative to the largest stress.
            let f = ((1.0 + sin_phi) * s[2] - (1.0 - sin_phi) * s[0]) / 2.0;
            let scale = s[0].abs().max(1e-3);
            assert!(f <= ROUND_OFF * scale, "({}, {}): {f}", point.x, point.y);
            at_yield += usize::from(phase == "loading" && f > -1e-9 * scale);
        }
    }
    assert!(at_yield > 100, "{at_yield} points at yield");
}

#[test]
fn lateral_pressure_keeps_rising() {
    let run = finished(CASE, "mohr_coulomb");
    let sigma = run.probe("loading", "sigma_n_shaft");
    assert!(sigma[4..].windows(2).all(|pair| pair[1] > pair[0]));
    // It does not settle: the last millimetre adds as much as the one from 2 to 3 mm, or more.
    assert!(sigma[49] - sigma[39] > sigma[29] - sigma[19]);
    assert_eq!(run.summary["phases"][2]["cut_backs"], 0);
}

#[test]
fn yielding_sand_carries_less_at_the_toe_and_the_same_on_the_shaft() {
    let [elastic, plastic] = ["elastic", "mohr_coulomb"].map(|v| finished(CASE, v));
    let [q_p_elastic, q_p] = [&elastic, &plastic].map(|run| run.probe("loading", "q_p"));
    assert!((9..50).all(|i| q_p[i] < 0.6 * q_p_elastic[i]));
    assert!(q_p.windows(2).all(|pair| pair[1] > pair[0]));
    // The toe's resistance grows ever more slowly.
    assert!(q_p[49] - q_p[39] < 0.8 * (q_p[19] - q_p[9]));
    let shaft = |run: &crate::variant::Run| run.end("loading", "tau_shaft");
    assert_close(shaft(&plastic), shaft(&elastic), 0.05, "friction at 5 mm");
}
