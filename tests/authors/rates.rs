//! Sensitivities of a law to its parameters, along a path.
//!
//! Goal        rates that a law gives through dual numbers, carried from increment to increment,
//!             are the derivatives of what it ends with, by every parameter and the initial stress.
//! Set-up      `fixtures/sensitive_joint`, compressed, sheared to and fro into slip, with dilatancy.
//! Asserts     within 1e-7 of central differences of whole paths; the flag; `pilum check`.

use crate::program::pilum;
use abi::Hypothesis;
use law::probe::{CreateForm, Form, PointRates, PointStart, Probe};
use law::{LoadedLaw, SearchPath};

/// `K_n`, `K_100`, n, c, φ, ψ.
const VALUES: [f64; 6] = [2e5, 1e5, 0.5, 3.0, 30.0, 4.0];
const TRACTION: [f64; 2] = [-80.0, 5.0];

fn probe(law: &LoadedLaw, values: &[f64]) -> Probe {
    let form = CreateForm {
        formulation: 0,
        values: Some(values),
        n_values: values.len(),
        message: Some(200),
        more_host: 0,
        host_minor: abi::raw::PILUM_ABI_MINOR,
        hypothesis: abi::Hypothesis::Interface2d,
        n_states: 2,
        lacks_tangent: false,
    };
    law.probe(&form).unwrap().probe.unwrap()
}

/// Jumps at the ends of increments: shear to and fro, a little closing and opening.
fn path() -> Vec<[f64; 2]> {
    (1..=40)
        .map(|k| {
            let t = f64::from(k) / 10.0;
            [-2e-5 * (1.7 * t).sin(), 1.2e-3 * (1.9 * t).sin()]
        })
        .collect()
}

/// Traction and internal variables after the path.
fn end(law: &LoadedLaw, values: &[f64], traction: [f64; 2]) -> Vec<f64> {
    let probe = probe(law, values);
    let start = probe
        .init_state(&[traction.to_vec()], &Form::of(0))
        .unwrap();
    let mut state = start.unwrap().points[0].state.clone();
    let (mut jump, mut flux) = ([0.0; 2], traction.to_vec());
    for to in path() {
        let point = PointStart {
            gradient0: jump.to_vec(),
            gradient1: to.to_vec(),
            flux0: flux,
            state0: state,
        };
        let answer = probe.integrate(&[point], &Form::of(abi::raw::PILUM_REQ_FLUX));
        let one = answer.unwrap().points.remove(0);
        assert_eq!(one.status, abi::raw::PILUM_OK);
        (jump, flux, state) = (to, one.flux, one.state);
    }
    flux.into_iter().chain(state).collect()
}

/// Rates of the same, for these rates of parameters and initial traction.
fn end_rates(law: &LoadedLaw, parameter: &[f64], initial: [f64; 2]) -> Vec<f64> {
    let probe = probe(law, &VALUES);
    let nothing = |flux0: Vec<f64>, state0: Vec<f64>| PointRates {
        gradient0: vec![0.0; 2],
        gradient1: vec![0.0; 2],
        flux0,
        state0,
    };
    let start = PointStart {
        gradient0: Vec::new(),
        gradient1: Vec::new(),
        flux0: TRACTION.to_vec(),
        state0: Vec::new(),
    };
    let given = nothing(initial.to_vec(), vec![0.0; 2]);
    let first = probe.initial_rates(&[start], &[given], parameter);
    let (answer, mut rates) = first.unwrap().unwrap();
    let mut state = answer.points[0].state.clone();
    let mut state_rate = rates.remove(0).1;
    let (mut jump, mut flux, mut flux_rate) = ([0.0; 2], TRACTION.to_vec(), initial.to_vec());
    for to in path() {
        let point = PointStart {
            gradient0: jump.to_vec(),
            gradient1: to.to_vec(),
            flux0: flux,
            state0: state,
        };
        let given = nothing(flux_rate, state_rate);
        let (mut answer, mut rates) = probe.rates(&[point], &[given], parameter).unwrap();
        let one = answer.points.remove(0);
        assert_eq!(one.status, abi::raw::PILUM_OK);
        (jump, flux, state) = (to, one.flux, one.state);
        (flux_rate, state_rate) = rates.remove(0);
    }
    flux_rate.into_iter().chain(state_rate).collect()
}

#[test]
fn sensitivities_follow_a_path() {
    let law = SearchPath::new(&[]).law("sensitive_joint").unwrap();
    let formulation = law.description().formulation(Hypothesis::Interface2d);
    assert!(formulation.unwrap().rates);
    let slipped = end(&law, &VALUES, TRACTION)[2];
    assert!(slipped > 1e-3, "it slips: {slipped}");
    let mut worst = 0.0_f64;
    let mut compare = |what: &str, found: &[f64], above: &[f64], below: &[f64], step: f64| {
        for k in 0..4 {
            let difference = (above[k] - below[k]) / (2.0 * step);
            // What differences can tell: a step moves the value by this much.
            let scale = found[k].abs().max(above[k].abs() / step * 1e-6);
            let error = (found[k] - difference).abs() / scale;
            assert!(error < 1e-7, "{what}, {k}: {} and {difference}", found[k]);
            worst = worst.max(error);
        }
    };
    for p in 0..VALUES.len() {
        let mut direction = [0.0; 6];
        direction[p] = 1.0;
        let found = end_rates(&law, &direction, [0.0; 2]);
        let step = 3e-6 * VALUES[p];
        let moved = |sign: f64| {
            let mut values = VALUES;
            values[p] += sign * step;
            end(&law, &values, TRACTION)
        };
        compare(
            &format!("parameter {p}"),
            &found,
            &moved(1.0),
            &moved(-1.0),
            step,
        );
        assert!(found.iter().any(|rate| *rate != 0.0), "parameter {p}");
    }
    let found = end_rates(&law, &[0.0; 6], [1.0, 0.0]);
    let moved = |sign: f64| end(&law, &VALUES, [TRACTION[0] + sign * 1e-4, TRACTION[1]]);
    compare("pressure", &found, &moved(1.0), &moved(-1.0), 1e-4);
    println!("largest error {worst:.1e}");
}

#[test]
fn a_law_by_duals_passes_the_checks() {
    let law = SearchPath::new(&[]).law("sensitive_joint").unwrap();
    let file = law.library().path().to_str().unwrap();
    let folder = tempfile::TempDir::new().unwrap();
    let outcome = pilum(folder.path(), &["check", file]).ended(0);
    let line = outcome
        .stdout
        .lines()
        .find(|line| line.contains("rates-match-differences"));
    assert!(line.unwrap().contains("passed"), "{}", outcome.stdout);
    let page = pilum(folder.path(), &["laws", "sensitive_joint"]);
    page.prints("; rates");
}
