//! What a law makes of the stress it finds at the start of a phase.
//!
//! Goal        stress changed by a swap is reported, and the force that this leaves out of balance is removed in
//!             proportion to the phase's course. In elastic ground one swap ends where two do; in yielding ground
//!             they differ by given amounts. A resumed run has the same bits.
//! Geometry    a square between smooth walls, 1 × 1; a strip on ground; the sliding block.
//!
//! ```text
//!      ↓ ↓ ↓ p
//!   ▷┌───────┐◁
//!   ▷│       │◁
//!   ▷└───────┘◁
//!     ▵  ▵  ▵
//! ```
//!
//! Boundary    u_y = 0 below, u_x = 0 on the sides, p = 80 kPa; the block held where it has slid to.
//! Law         elastic, then mohr_coulomb with φ = 0; coulomb_joint, then one with less friction.
//! Asserts     stresses and displacements against closed forms, EQUILIBRIUM; messages with their numbers.
//!
//! Elastic, ν = 1/4: σ_22 = −p, σ_11 = σ_33 = −p/3, so the mean is −5p/9 and the deviator
//! q = 2p/3 = 53.3 kPa. Tresca with c returns it at the same strain to q = 2c with the same mean:
//! σ_22 = −5p/9 − 4c/3. The rest of p is out of balance. Back under p, q stays 2c, so that the mean
//! goes by as much as σ_22, and the top by that over K.

use crate::setup::{Finished, Results, assert_close, elastic, run};
use crate::sliding_block::{self, Kind, PRESS, coulomb, hold_top, slide};
use input::case::CaseFile;
use input::{Case, Error};
use law::Stop;
use mechanics::Place;
use mechanics::equilibrium::Reuse;
use runs::run::{Observer, Options, run_reusing};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tests::tolerance::EQUILIBRIUM;
use text::{Source, parse};

const P: f64 = 80.0;
const YOUNG: f64 = 1e4;
/// Bulk modulus, with ν = 1/4.
const BULK: f64 = YOUNG / 1.5;

/// σ_22 as Tresca with cohesion c returns it, where q of the stress found is above 2c.
fn returned(mean: f64, c: f64) -> f64 {
    mean - 4.0 / 3.0 * c
}

fn tresca(name: &str, cohesion: f64) -> String {
    format!(
        "{name} = {{ law = \"mohr_coulomb\", parameters = {{ young_modulus = {YOUNG:?}, \
         poisson_ratio = 0.25, cohesion = {cohesion:?}, friction_angle = 0.0, \
         dilatancy_angle = 0.0 }} }}\n"
    )
}

fn text(group: &str, phases: &str) -> String {
    format!(
        r#"
analysis = "plane_strain"
supports = [{{ line = "bottom", fixed = ["y"] }}, {{ line = "left", fixed = ["x"] }}, {{ line = "right", fixed = ["x"] }}]
[mesh]
columns = [{{ n = 1, to = 1.0 }}]
rows = [{{ n = 1, to = 1.0 }}]
region = [{{ group = "ground" }}]
lines = {{ left = {{ x = 0.0 }}, right = {{ x = 1.0 }}, bottom = {{ y = 0.0 }}, top = {{ y = 1.0 }} }}
[laws]
{}{}{}{}
[groups.ground]
formulation = "solid"
integration = "full"
{group}
{phases}
[probes]
top = {{ line = "top", quantity = "displacement_y" }}
s_11 = {{ group = "ground", quantity = "stress_11" }}
s_22 = {{ group = "ground", quantity = "stress_22" }}
"#,
        elastic("stiff", YOUNG, 0.25),
        tresca("strong", 30.0),
        tresca("middling", 25.0),
        tresca("weak", 20.0),
    )
}

const LOAD: &str = "[[phase]]\nname = \"load\"\nincrements = 1\n\
                    pressure = [{ line = \"top\", value = 80.0 }]\n";

fn swap(name: &str, increments: usize, law: &str) -> String {
    format!(
        "[[phase]]\nname = \"{name}\"\nincrements = {increments}\nlaws = {{ ground = \"{law}\" }}\n"
    )
}

fn about_law(finished: &Finished) -> Vec<&String> {
    let warnings = finished.observer.warnings.iter();
    warnings.filter(|w| w.contains("takes over")).collect()
}

#[test]
fn the_force_that_a_swap_frees_is_taken_off_in_proportion_to_the_phase() {
    let phases = LOAD.to_owned() + &swap("swap", 4, "weak");
    let finished = run(&text("law = \"stiff\"", &phases));
    let mean = -5.0 / 9.0 * P;
    let start = returned(mean, 20.0);
    let settled = finished.end_of("load", "top");
    let [s_11, s_22, top] = ["s_11", "s_22", "top"].map(|probe| finished.in_phase("swap", probe));
    for i in 0..4 {
        let part = 0.25 * (i + 1) as f64;
        let expected = start + part * (-P - start);
        assert_close("s_22", s_22[i], expected, EQUILIBRIUM, P);
        assert_close("s_11", s_11[i], expected + 40.0, EQUILIBRIUM, P);
        let moved = part * (-P - start) / BULK;
        assert_close("top", top[i] - settled, moved, EQUILIBRIUM, -settled);
    }
    // |Δσ| = √1.5 (53.3 − 40)·2/3 = 10.887, of √(80² + 2·26.7²) = 88.443.
    let words = about_law(&finished);
    assert_eq!(words.len(), 1, "{words:?}");
    let expected = "phase `swap`: law `weak` takes over group `ground` with stresses up to 12.309 % \
                    different from those it found (10.8866 kPa at element 1, point ";
    assert!(words[0].starts_with(expected), "{}", words[0]);
    assert!(
        words[0].ends_with("9 of 9 points differ), applied gradually over the phase"),
        "{}",
        words[0]
    );
    let kept = finished.summary()["warnings"].to_string();
    assert!(kept.contains("12.309 %"), "{kept}");
    let share = finished.summary()["phases"][1]["out_of_balance"].as_f64();
    assert!(share.unwrap() > 0.05, "{share:?}");
}

#[test]
fn a_swap_ends_where_two_swaps_end() {
    let phases = LOAD.to_owned() + &swap("first", 2, "middling") + &swap("second", 2, "weak");
    let two = run(&text("law = \"stiff\"", &phases));
    assert_eq!(about_law(&two).len(), 2);
    let phases = LOAD.to_owned() + &swap("swap", 2, "weak");
    let one = run(&text("law = \"stiff\"", &phases));
    for (probe, scale) in [("s_11", P), ("s_22", P), ("top", 5e-3)] {
        assert_close(probe, one.last(probe), two.last(probe), EQUILIBRIUM, scale);
    }
    assert_close("s_22", one.last("s_22"), -P, EQUILIBRIUM, P);
}

/// Settlement of a strip whose ground becomes clay of 20 kPa in swaps of this many increments, in one or in two.
fn strip(increments: usize, in_two: bool) -> f64 {
    let law = |name: &str, cohesion: f64| {
        tresca(name, cohesion).replace("poisson_ratio = 0.25", "poisson_ratio = 0.3")
    };
    let (first, weak, swapped) = (
        swap("first", increments, "middling"),
        swap("swap", increments, "weak"),
        elastic("stiff", YOUNG, 0.3) + &law("middling", 25.0) + &law("weak", 20.0),
    );
    let phases = if in_two { first + &weak } else { weak };
    let text = format!(
        r#"
analysis = "plane_strain"
supports = [{{ line = "left", fixed = ["x"] }}, {{ line = "right", fixed = ["x"] }}, {{ line = "bottom", fixed = ["x", "y"] }}]
[mesh]
columns = [{{ n = 4, to = 1.0 }}, {{ n = 6, to = 5.0, ratio = 1.3 }}]
rows = [{{ n = 8, to = 4.0, ratio = 0.85 }}]
region = [{{ group = "ground" }}]
lines = {{ left = {{ x = 0.0 }}, right = {{ x = 5.0 }}, bottom = {{ y = 0.0 }}, strip = {{ y = 4.0, x = [0.0, 1.0] }} }}
[laws]
{swapped}
[groups.ground]
formulation = "solid"
law = "stiff"
unit_weight = 18.0
initial_stress = {{ k_0 = 0.6 }}
[[phase]]
name = "load"
increments = 2
pressure = [{{ line = "strip", value = 95.0 }}]
{phases}
[probes]
settlement = {{ line = "strip", quantity = "displacement_y", scale = -1.0 }}
"#
    );
    run(&text).last("settlement")
}

/// The table of the page on swaps: the effect of increments fades, that of the way stays.
#[test]
fn where_ground_yields_one_swap_and_two_differ_by_their_increments_and_by_the_way() {
    let [coarse, ten, twenty, forty] = [1, 10, 20, 40].map(|n| [strip(n, false), strip(n, true)]);
    let percent = |a: f64, b: f64| 100.0 * (a / b - 1.0);
    let between = |what: &str, value: f64, least: f64, most: f64| {
        assert!(value > least && value < most, "{what}: {value} %");
    };
    let differ = |[one, two]: [f64; 2]| percent(two, one);
    between("one increment", percent(coarse[0], forty[0]), 3.5, 4.0);
    between("ten increments", percent(ten[0], forty[0]), 0.2, 0.5);
    between("two swaps of one increment", differ(coarse), -1.2, -1.0);
    between("two swaps of 20", differ(twenty), 0.38, 0.48);
    between("two swaps of 40", differ(forty), 0.43, 0.53);
}

#[test]
fn a_law_that_returns_what_it_finds_changes_nothing() {
    // q = 53.3 < 2c = 60.
    let phases = LOAD.to_owned() + &swap("swap", 2, "strong");
    let finished = run(&text("law = \"stiff\"", &phases));
    // Two laws of the file are not taken.
    let warnings: Vec<&String> = (finished.observer.warnings.iter())
        .filter(|warning| !warning.starts_with("no group takes the laws"))
        .collect();
    assert!(warnings.is_empty(), "{warnings:?}");
    for probe in ["s_11", "s_22", "top"] {
        let [before, .., after] = finished.history(probe)[..] else {
            panic!("three rows")
        };
        assert_close(probe, after, before, 1e-14, before.abs());
    }
    let share = finished.summary()["phases"][1]["out_of_balance"].as_f64();
    assert!(share.unwrap() < 1e-12, "{share:?}");
}

#[test]
fn an_initial_stress_outside_the_surface_is_returned_likewise() {
    let third = P / 3.0;
    let group = format!(
        "law = \"weak\"\ninitial_stress = {{ 11 = {:?}, 22 = {:?}, 33 = {:?} }}",
        -third, -P, -third
    );
    let finished = run(&text(
        &group,
        &LOAD.replace("increments = 1", "increments = 2"),
    ));
    let start = returned(-5.0 / 9.0 * P, 20.0);
    let s_22 = finished.history("s_22");
    assert_close("half-way", s_22[0], 0.5 * (start - P), EQUILIBRIUM, P);
    assert_close("end", s_22[1], -P, EQUILIBRIUM, P);
    let words = about_law(&finished);
    assert_eq!(words.len(), 1, "{words:?}");
    assert!(words[0].contains("12.309 %"), "{}", words[0]);
}

#[test]
fn an_interface_says_what_becomes_of_its_traction() {
    // Sticks at τ = 60 kPa under 100 kPa; then friction of 25° leaves 46.6 kPa.
    let laws = format!(
        "{}[laws.smooth]\n{}\n",
        coulomb(45.0, 0.0) + "\n",
        coulomb(25.0, 0.0)
    );
    let phases = PRESS.to_owned()
        + &hold_top(&slide("slide", 1, 6e-4, "{ line = \"top\", y = 0.0 }"))
        + "[[phase]]\nname = \"swap\"\nincrements = 1\nlaws = { interface = \"smooth\" }\n";
    for kind in [
        Kind::Joint("nodes"),
        Kind::Layer("mean"),
        Kind::Layer("full"),
    ] {
        let text = sliding_block::text(kind, &laws, &phases);
        let text = text.replace(
            "plastic_slip = { group = \"interface\", quantity = \"plastic_slip\" }\n",
            "",
        );
        let finished = run(&text);
        let words = about_law(&finished);
        assert_eq!(words.len(), 1, "{kind:?}: {:?}", finished.observer.warnings);
        let (_, rest) = words[0].split_once("shear ").unwrap();
        let mut numbers = rest.split([' ', ';']).filter_map(|word| word.parse().ok());
        let [found, left] = [(); 2].map(|()| numbers.next().unwrap());
        let strength = 100.0 * 25.0_f64.to_radians().tan();
        assert_close(&format!("{kind:?}, found"), found, 60.0, 1e-4, 60.0);
        assert_close(&format!("{kind:?}, left"), left, strength, 1e-4, 60.0);
        assert_close(
            &format!("{kind:?}, end"),
            finished.end_of("swap", "tau"),
            strength,
            1e-4,
            60.0,
        );
    }
}

/// Stops after this many increments.
struct Stopping {
    left: usize,
    flag: Arc<AtomicBool>,
}

impl Observer for Stopping {
    fn phase(&mut self, _: &str, _: usize) {}
    fn increment(&mut self, _: &Place, _: usize, _: usize) {
        self.left = self.left.saturating_sub(1);
        self.flag.store(self.left == 0, Ordering::Relaxed);
    }
    fn cut_back(&mut self, _: &Place, _: &str) {}
    fn warning(&mut self, _: &str) {}
    fn stop(&self) -> Stop {
        Stop::flag(Arc::clone(&self.flag))
    }
}

fn run_until(text: &str, folder: &Path, increments: usize) -> Result<(), Error> {
    let source = Source::new("case.toml", text);
    let file: CaseFile = parse(&source)?;
    let case = Case {
        source,
        file,
        variant: None,
        opener: law::Opener::default(),
    };
    let options = Options {
        resume: true,
        checkpoints: Some(Duration::ZERO),
        ..Options::default()
    };
    let mut observer = Stopping {
        left: increments,
        flag: Arc::default(),
    };
    run_reusing(&case, folder, &mut observer, &mut Reuse::default(), options).map(|_| ())
}

#[test]
fn a_run_stopped_after_a_swap_goes_on_to_the_same_bits() {
    let phases = LOAD.to_owned() + &swap("swap", 4, "weak");
    let text = text("law = \"stiff\"", &phases);
    let [straight, stopped] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    run_until(&text, straight.path(), 100).unwrap();
    // Within the phase of the swap.
    let outcome = run_until(&text, stopped.path(), 2);
    assert!(outcome.as_ref().is_err_and(Error::is_stop), "{outcome:?}");
    run_until(&text, stopped.path(), 100).unwrap();
    let [a, b] = [&straight, &stopped]
        .map(|folder| std::fs::read_to_string(folder.path().join("history.csv")).unwrap());
    assert_eq!(a, b);
    assert_eq!(a.lines().count(), 6);
}

/// Round-off in a joint that carries nothing is not reported as a stress changed by a law.
#[test]
fn a_swap_says_nothing_of_stresses_that_are_round_off() {
    let joint = |cohesion: f64| {
        format!(
            "{{ law = \"coulomb_joint\", parameters = {{ normal_stiffness = 1e6, shear_stiffness = 1e6, cohesion = \
             {cohesion:?}, friction_angle = 10.0, dilatancy_angle = 0.0 }} }}"
        )
    };
    let text = format!(
        r#"
analysis = "plane_strain"
supports = [{{ line = "bottom", fixed = ["y"] }}, {{ line = "left", fixed = ["x"] }}]
[mesh]
columns = [{{ n = 2, to = 1.0 }}, {{ n = 2, to = 2.0 }}]
rows = [{{ n = 3, to = 1.0 }}]
region = [{{ group = "soil" }}]
lines = {{ bottom = {{ y = 0.0 }}, top = {{ y = 1.0 }}, left = {{ x = 0.0 }}, seam = {{ x = 1.0 }} }}
[laws]
soil = {{ law = "elastic", parameters = {{ young_modulus = 1e4, poisson_ratio = 0.3 }} }}
first = {}
second = {}
[groups]
soil = {{ formulation = "solid", law = "soil" }}
joint = {{ formulation = "zero_thickness", line = "seam", law = "first" }}
[[phase]]
name = "press"
increments = 3
pressure = [{{ line = "top", value = 77.7 }}]
[[phase]]
name = "swap"
increments = 1
laws = {{ joint = "second" }}
[probes]
normal = {{ group = "joint", quantity = "traction_n", reduce = "min" }}
shear = {{ group = "joint", quantity = "traction_t", reduce = "min" }}
"#,
        joint(100.0),
        joint(0.0)
    );
    let finished = run(&text);
    for probe in ["normal", "shear"] {
        assert!(finished.last(probe).abs() < 1e-10 * 77.7);
    }
    let warnings = &finished.observer.warnings;
    assert!(
        !warnings.iter().any(|w| w.contains("different from")),
        "{warnings:?}"
    );
}
