//! Parameters, stresses and increments at the ends of their ranges.

use super::*;
use approx::assert_relative_eq;

/// Random parameters and walks: finite, on or inside the surface, compressive, never gaining slip
/// backwards.
#[test]
fn stays_admissible_on_random_walks() {
    let mut random = Random(3);
    let (mut updates, mut cuts) = (0_u32, 0_u32);
    for _ in 0..3000 {
        let (common, beyond) = random_parameters(&mut random);
        let p = mepi_softening::Parameters {
            common,
            softening: beyond,
            scheme: IMPLICIT,
        };
        let law = softening(p);
        let sigma_ni = random.decades(1e-6, 1e6);
        let truth = Truth::softening(p, sigma_ni);
        let mut walker = Walker::new(&law, sigma_ni);
        for _ in 0..40 {
            let size = random.decades(1e-3, 1e3) * sigma_ni;
            let du = [
                random.between(-0.3, 0.5) * size / truth.k_n(),
                random.between(-1.0, 1.0) * size / truth.k_t(),
            ];
            updates += 1;
            let end = match walker.respond(du, Tangent::Consistent) {
                Ok(end) => end,
                Err(Failure::CutStep { factor, .. }) => {
                    assert!(factor > 0.0 && factor < 1.0);
                    cuts += 1;
                    continue;
                }
                Err(other) => panic!("{other:?}"),
            };
            let finite = end.traction.iter().chain(end.tangent.iter().flatten());
            assert!(finite.into_iter().all(|v| v.is_finite()), "{end:?}");
            let (start, state) = (walker.state, end.state);
            assert!(state.gap.is_finite() && state.plastic_contraction.is_finite());
            assert!(state.plastic_slip >= start.plastic_slip);
            assert_eq!(state.sigma_ni, start.sigma_ni);
            let (sigma, tau) = (-end.traction[0], end.traction[1].abs());
            assert!(sigma >= 0.0 && state.gap >= 0.0);
            if state.gap > 0.0 {
                assert_eq!([sigma, tau], [0.0; 2]);
            }
            // F ≤ 0; at the jump the surface is the one above.
            let mu = if state.plastic_slip == p.softening.u_tp && p.softening.is_published() {
                p.common.mu_p
            } else {
                truth.mu(state.plastic_slip)
            };
            assert!(tau <= mu * sigma * (1.0 + 1e-9), "{p:?} {start:?} {end:?}");
            let before = walker.dissipation;
            walker.step(du);
            // With the stress at the end, an increment across the jump may count too little.
            let jumped = p.softening.is_published()
                && start.plastic_slip < p.softening.u_tp
                && state.plastic_slip > p.softening.u_tp;
            let spent = walker.dissipation - before;
            assert!(
                jumped || spent >= -1e-13 * sigma * state.plastic_slip,
                "{spent}"
            );
        }
    }
    println!("{cuts} of {updates} updates ask for a smaller step");
    assert!(cuts * 1000 < updates);
}

#[test]
fn scales_with_stress_and_length() {
    // σ, p_0 by s and u, t, u_tp by l leave the equations as they are.
    for p in [FONTAINEBLEAU, published(SILICA)] {
        for (s, l) in [(1e-8, 1.0), (1e4, 1e-3), (1e4, 1e6)] {
            let c = p.common;
            let scaled = mepi_softening::Parameters {
                common: Common {
                    k_n: c.k_n * (100.0_f64 * s).powf(-c.n) * s / l,
                    k_t: c.k_t * (100.0_f64 * s).powf(-c.n) * s / l,
                    t: c.t * l,
                    p_0: c.p_0 * s,
                    ..c
                },
                softening: SofteningParameters {
                    u_tp: p.softening.u_tp * l,
                    ..p.softening
                },
                ..p
            };
            let plain = mepi_softening::Parameters {
                common: Common {
                    k_n: c.k_n * 100.0_f64.powf(-c.n),
                    k_t: c.k_t * 100.0_f64.powf(-c.n),
                    ..c
                },
                ..p
            };
            let (one, other) = (softening(plain), softening(scaled));
            let mut a = Walker::new(&one, 100.0);
            let mut b = Walker::new(&other, 100.0 * s);
            for i in 0..200 {
                let du = [1e-7, if i % 60 < 40 { 3e-5 } else { -3e-5 }];
                a.step(du);
                b.step(du.map(|d| d * l));
                assert_relative_eq!(a.sigma() * s, b.sigma(), max_relative = 1e-9);
                assert_relative_eq!(a.tau() * s, b.tau(), max_relative = 1e-9);
            }
        }
    }
}

#[test]
fn a_zero_increment_changes_nothing() {
    let law = softening(SILICA);
    let mut walker = Walker::new(&law, 100.0);
    for i in 0..500 {
        walker.step([0.0, if i % 200 < 120 { 5e-6 } else { -5e-6 }]);
        let end = walker.respond([0.0; 2], Tangent::None).unwrap();
        assert_eq!(end.traction, walker.traction);
        assert_eq!(end.state, walker.state);
    }
}

#[test]
fn works_without_an_elastic_range() {
    // μ_0 = 0: slip from the first touch of shear, in both directions, at any size.
    let law = mepi(TABLE_2);
    for du in [1e-15, -1e-12, 1e-9, -1e-6, 1e-3, -1.0] {
        let mut walker = Walker::new(&law, 100.0);
        walker.step([0.0, du]);
        assert!(walker.tau() * du > 0.0);
        assert!(walker.state.plastic_slip > 0.0);
        let mu = Truth::hardening(TABLE_2, 100.0).mu(walker.state.plastic_slip);
        assert_relative_eq!(
            walker.tau().abs(),
            mu * walker.sigma(),
            max_relative = 1e-12
        );
    }
    let mut walker = Walker::new(&law, 100.0);
    walker.step([1e-6, 0.0]);
    assert_eq!(walker.tau(), 0.0);
    assert_eq!(walker.state.plastic_slip, 0.0);
}

#[test]
fn a_reversal_in_one_increment_equals_the_mirrored_path() {
    let law = softening(FONTAINEBLEAU);
    let (mut a, mut b) = (Walker::new(&law, 50.0), Walker::new(&law, 50.0));
    for du in [1e-3, -2e-3, 5e-4, -5e-3] {
        a.step([0.0, du]);
        b.step([0.0, -du]);
        assert_eq!(a.tau(), -b.tau());
        assert_eq!(a.sigma(), b.sigma());
        assert_eq!(a.state, b.state);
    }
}

#[test]
fn refuses_internal_variables_that_make_no_sense() {
    let law = mepi(TABLE_4);
    let mut walker = Walker::new(&law, 100.0);
    let good = walker.state;
    for state in [
        State {
            sigma_ni: 0.0,
            ..good
        },
        State {
            plastic_slip: -1e-9,
            ..good
        },
    ] {
        walker.state = state;
        let end = walker.respond([0.0, 1e-4], Tangent::None);
        assert!(matches!(end, Err(Failure::Domain(_))));
    }
}

/// μ_0 = 0 and an infinite trial stress make 0 · ∞ of the strength: no number, and no opening either.
#[test]
fn an_elastic_predictor_beyond_the_range_of_numbers_is_refused() {
    let law = softening(FONTAINEBLEAU);
    let walker = Walker::new(&law, 100.0);
    for du in [[1e304, 0.0], [0.0, 1e304], [1e304, -1e304], [-1e304, 1e304]] {
        let end = walker.respond(du, Tangent::Consistent);
        assert!(matches!(end, Err(Failure::Numeric(_))), "{du:?}: {end:?}");
    }
}
