//! The scalar equation: residual, first root, proofs of both.

use super::*;
use crate::hardening::sech_tanh;
use crate::interface::{Constants, Interface};
use crate::return_mapping::{Flow, Increment, Sample};
use abi::substepping::Scheme;

/// An interface with parameters over many decades, and `σ_ni`.
fn random_interface(random: &mut Random) -> (Interface, f64) {
    let (common, softening) = random_parameters(random);
    let softening = (random.unit() < 0.6).then_some(softening);
    let sigma_ni = random.decades(1e-6, 1e6);
    (
        Interface::new(common, softening, Scheme::Implicit).unwrap(),
        sigma_ni,
    )
}

#[test]
fn the_hyperbolic_functions_are_right_at_any_size() {
    for z in [0.0, 1e-300, 1e-9, 0.3, 1.0, 20.0, 300.0_f64] {
        let (sech, tanh) = sech_tanh(z);
        assert!((sech - 1.0 / z.cosh()).abs() <= 4e-16);
        assert!((tanh - z.tanh()).abs() <= 4e-16);
    }
    assert_eq!(sech_tanh(1e308), (0.0, 1.0));
}

#[test]
fn the_bound_used_for_uniqueness_holds() {
    let highest = (0..1_000_000)
        .map(|i| f64::from(i) * 2e-5)
        .map(|z| (z * z.tanh() - 1.0) / z.cosh())
        .fold(0.0, f64::max);
    let bound = crate::interface::STABILISATION_BOUND;
    assert!(highest < bound && highest > 0.999 * bound, "{highest}");
}

/// What g cannot be told from zero by: errors of its terms, of μ and β, and of ξ.
fn round_off(increment: &Increment<'_>, at: &Sample) -> f64 {
    let Constants { K_n, .. } = *increment.constants;
    let hardening = &increment.constants.hardening;
    // Eq. (11) adds numbers of the size of μ_r.
    let mu = at.mu.max(hardening.softening.map_or(0.0, |s| s.mu_r));
    let normal = increment.sigma.abs() + K_n * at.d_lambda * (mu + hardening.mu_c0);
    let resolution = (at.d_lambda + increment.xi) * at.residual_slope.abs();
    4.0 * f64::EPSILON * (increment.tau + mu * normal + resolution)
}

/// g at the same Δλ by a scan that knows nothing of bounds: true if no sign change of g and no
/// tension is found before the flow's end.
fn nothing_before(increment: &Increment<'_>, end: f64) -> bool {
    let leg = increment.first_leg();
    let Constants { K_n, .. } = *increment.constants;
    let last = increment.distance_to_peak().map_or(end, |p| p.min(end));
    (1..1000).all(|i| {
        let fraction = f64::from(i) / 1000.0;
        // Even and geometric spacing.
        [last * fraction, last * 1e-14_f64.powf(fraction)]
            .into_iter()
            .all(|x| {
                if x > end * (1.0 - 1e-9) {
                    return true;
                }
                let sample = increment.sample(&leg, x);
                let noise = round_off(increment, &sample);
                sample.residual > -noise
                    && increment.highest - K_n * sample.contraction >= -1e-12 * increment.highest
            })
    })
}

#[test]
fn finds_the_first_root_to_machine_precision() {
    let mut random = Random(11);
    let mut counted = [0; 4];
    for _ in 0..20_000 {
        let (law, sigma_ni) = random_interface(&mut random);
        let constants = law.constants(sigma_ni);
        let hardening = &constants.hardening;
        let mut xi = 0.0;
        if random.unit() < 0.7 {
            xi = hardening.slip_scale * random.decades(1e-4, 1e4);
        }
        let mu = hardening.friction(hardening.branch(xi), xi).value;
        let sigma = sigma_ni * random.between(-0.3, 2.0);
        let highest = sigma.max(sigma_ni * random.unit());
        let size = random.decades(1e-3, 1e6);
        let increment = Increment {
            constants: &constants,
            xi,
            mu,
            sigma,
            highest,
            tau: (mu * sigma).max(0.0) + sigma_ni * size,
        };
        match increment.flow() {
            Ok(Flow::Slides(end)) => {
                counted[0] += 1;
                let mut leg = increment.first_leg();
                if let Some(peak) = increment.distance_to_peak()
                    && end.d_lambda > peak
                {
                    leg = increment.second_leg(&increment.sample(&leg, peak));
                }
                let end = increment.sample(&leg, end.d_lambda);
                assert!(
                    end.residual.abs() <= round_off(&increment, &end),
                    "{end:?} {increment:?}"
                );
                assert!(
                    nothing_before(&increment, end.d_lambda),
                    "{increment:?} {end:?}"
                );
            }
            Ok(Flow::StopsAtPeak(end)) => {
                counted[1] += 1;
                assert!(
                    nothing_before(&increment, end.d_lambda),
                    "{increment:?} {end:?}"
                );
            }
            Ok(Flow::LosesContact { exhausted }) => {
                counted[2] += 1;
                let end = exhausted.unwrap_or(increment.tau / constants.K_t);
                assert!(nothing_before(&increment, end), "{increment:?} {end:?}");
            }
            Err(failure) => {
                counted[3] += 1;
                assert!(matches!(failure, Failure::CutStep { .. }), "{failure:?}");
            }
        }
    }
    println!("slides, stops, loses contact, cut: {counted:?}");
    assert!(counted[..3].iter().all(|&n| n > 20), "{counted:?}");
    assert!(counted[3] < 20, "{counted:?}");
}

#[test]
fn the_quick_proof_covers_the_published_parameters() {
    for p in [TABLE_4, TABLE_2] {
        let law = mepi(p);
        assert!(law.0.constants(100.0).one_root);
    }
    for p in [FONTAINEBLEAU, SILICA] {
        assert!(softening(p).0.constants(100.0).one_root);
    }
}
