//! De Gennaro & Frank, Figs 9 to 11: the pile is pushed into elastic sand.
//!
//! Goal      mobilisation, distributions along the shaft, lateral pressure, displacements.
//! Geometry, boundary, laws: cases/chamber_loading/README.md.
//! Asserts   order and shape of the curves; `K_l` at the end; balance of loads; uniform friction on
//!           the shaft, concentration at the toe; displacements that concentrate at the pile.

use crate::variant::{Run, assert_close, finished};
use std::f64::consts::PI;

const CASE: &str = "chamber_loading";

fn loading(run: &Run, probe: &str) -> Vec<f64> {
    run.probe("loading", probe)
}

#[test]
fn lateral_pressure_falls_a_little_then_rises_to_the_papers_value() {
    let run = finished(CASE, "dilating");
    // At half the shaft's length: 1.378, after the swap 1.374, least 1.369 at 0.3 mm, 1.436 at 5 mm.
    let middle = loading(&run, "k_l_middle");
    let start = run.end("confinement", "k_l_middle");
    let least = middle.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(least < start && least > start - 0.03, "{start} {least}");
    assert!(middle[9..].windows(2).all(|pair| pair[1] > pair[0]));
    // The paper's 1.55, with a head displacement of 10 mm.
    assert_close(run.end("loading", "k_l"), 1.55, 0.01, "K_l at 10 mm");
    assert_close(loading(&run, "k_l")[49], 1.456, 0.001, "K_l at 5 mm");
}

#[test]
fn without_dilation_lateral_pressure_falls_first_and_stays_lower() {
    let run = finished(CASE, "not_dilating");
    let (k_l, start) = (loading(&run, "k_l"), run.end("confinement", "k_l"));
    assert!(k_l[..5].iter().all(|&k| k < start && k > start - 0.05));
    let dilating = loading(&finished(CASE, "dilating"), "k_l");
    // What dilation adds is complete after 1 mm and stays: 0.049 there, 0.051 at 10 mm.
    assert!(
        k_l.iter()
            .zip(&dilating)
            .all(|(not, dilating)| not < dilating)
    );
    let added = |i: usize| dilating[i] - k_l[i];
    assert_close(added(9), added(99), 0.05, "what dilation adds");
}

#[test]
fn lateral_pressure_depends_on_dilation_more_than_on_displacement() {
    let at_5_mm = |variant| loading(&finished(CASE, variant), "k_l")[49];
    // Half of C_0, or twice p_0, give the paper's 1.55 at half the displacement.
    assert_close(at_5_mm("c_0_20"), 1.55, 0.01, "C_0 = 20");
    assert_close(at_5_mm("p_0_200"), 1.55, 0.01, "p_0 = 200 kPa");
}

#[test]
fn loads_are_ordered_and_balance() {
    let run = finished(CASE, "dilating");
    let [total, toe, shaft] = ["q_t", "q_p", "q_s"].map(|name| loading(&run, name));
    for load in [&total, &toe, &shaft] {
        assert!(load.windows(2).all(|pair| pair[1] > pair[0]));
    }
    // The shaft is mobilised within 1 mm, the toe never (elastic sand): it grows in proportion.
    assert!(shaft[9] > 0.85 * shaft[99]);
    assert_close(toe[99] - toe[49], 50.0 * (toe[99] - toe[98]), 0.01, "toe");
    // Q_s from the mean friction on the interface's middle surface; its points do not weigh its
    // ends, where the friction is highest, as forces do, and the pile's shaft lies 1 mm within.
    let from_friction = run.end("loading", "tau_mean") * 2.0 * PI * 0.010 * 0.5;
    assert_close(shaft[99], from_friction, 0.15, "Q_s");
}

#[test]
fn friction_is_uniform_along_the_shaft_and_high_at_the_toe() {
    let run = finished(CASE, "dilating");
    let (shaft, mean) = (loading(&run, "tau_shaft"), loading(&run, "tau_mean"));
    assert_close(
        shaft[19],
        mean[19],
        0.05,
        "on the sleeve and over the shaft, 2 mm",
    );
    // Elastic sand under a sharp toe: the lowest element gains without end.
    let (toe, middle) = (loading(&run, "sigma_n_toe"), loading(&run, "k_l_middle"));
    assert!(toe[49] > 1.5 * 100.0 * middle[49]);
    assert!(toe[99] > 2.0 * 100.0 * middle[99]);
}

#[test]
fn displacements_concentrate_at_the_pile() {
    let run = finished(CASE, "dilating");
    let [near, middle, far] = ["w_12_mm", "w_42_mm", "w_104_mm"].map(|name| loading(&run, name));
    let head = loading(&run, "w_t");
    // Settlement decays with the distance, and its share of the head's falls: 0.53, 0.26, 0.09.
    assert!((0..100).all(|i| near[i] > middle[i] && middle[i] > far[i]));
    let share = |i: usize| near[i] / head[i];
    assert!(share(1) > 1.8 * share(9) && share(9) > 1.8 * share(99));
    assert!(share(99) < 0.1);
    // Expansion under the toe's edge throughout, beside the shaft at first; compression comes
    // from the wall and reaches the shaft after 4 to 5 mm.
    let [toe, shaft, wall] = ["u_toe", "u_shaft", "u_wall"].map(|name| loading(&run, name));
    assert!(toe.iter().all(|&u| u > 0.0) && wall.iter().all(|&u| u < 0.0));
    assert!(shaft[..39].iter().all(|&u| u > 0.0) && shaft[49..].iter().all(|&u| u < 0.0));
}
