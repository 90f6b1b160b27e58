//! MEPI with parameters at their ends, led by jumps: every increment against [`mepi_step`].
//!
//! Paths     shear at constant volume; shear with compression; reversals; to σ_n = 0, beyond, and back
//!           with shear; shear that opens and closes in one increment each.
//! Lengths   hundredth to ten thousand times the slip that mobilises the friction.
//! Agrees    every increment of the path, from the state that the law left at its start.

use crate::matrix::{Family, Verdict};
use crate::mepi_step::{Mepi, Peak, State, check};
use crate::point::{Point, law, reason};
use abi::Hypothesis;
use tests::words::paths_of;

/// Table IV of De Gennaro & Frank, with the p_0 that makes it dilate.
pub(crate) const TABLE_4: Mepi = Mepi {
    k_n: 0.86e5,
    k_t: 0.37e5,
    n: 0.55,
    mu_0: 0.27,
    mu_p: 0.7,
    mu_c0: 0.46,
    a: 0.008,
    c_0: 40.0,
    t: 2e-3,
    p_0: 100.0,
    peak: None,
};

/// Table I, Fontainebleau sand.
pub(crate) const FONTAINEBLEAU: Mepi = Mepi {
    mu_0: 0.0,
    mu_p: 0.78,
    mu_c0: 0.67,
    a: 0.000_45,
    c_0: 0.05,
    p_0: 1.0,
    peak: Some(Peak {
        mu_r: 0.7,
        a_0: 4.0,
        u_tp: 1.4e-3,
        published: false,
    }),
    ..TABLE_4
};

/// Table I, silica sand.
pub(crate) const SILICA: Mepi = Mepi {
    k_n: 6e6,
    k_t: 1e6,
    n: 0.0,
    mu_0: 0.0,
    mu_p: 0.81,
    mu_c0: 0.49,
    a: 0.000_06,
    c_0: 0.05,
    t: 6e-3,
    p_0: 1.0,
    peak: Some(Peak {
        mu_r: 0.6,
        a_0: 12.0,
        u_tp: 4.3e-4,
        published: false,
    }),
};

/// With the jump of μ at the peak.
pub(crate) fn published(p: Mepi) -> Mepi {
    Mepi {
        peak: p.peak.map(|peak| Peak {
            published: true,
            ..peak
        }),
        ..p
    }
}

/// A set of parameters moved to ends of their ranges, one or two at a time, and σ_ni.
pub(crate) fn extremes(base: Mepi) -> Vec<(String, Mepi, f64)> {
    let mut all = vec![("as published".to_owned(), base, 100.0)];
    let mut add = |what: String, p: Mepi| all.push((what, p, 100.0));
    add("μ_0 = 0".into(), Mepi { mu_0: 0.0, ..base });
    add(
        "μ_0 = μ_p".into(),
        Mepi {
            mu_0: base.mu_p,
            ..base
        },
    );
    add("μ_c0 = 0".into(), Mepi { mu_c0: 0.0, ..base });
    add(
        "μ_c0 = μ_p".into(),
        Mepi {
            mu_c0: base.mu_p,
            ..base
        },
    );
    add("μ_p small".into(), {
        let f = 1e-6;
        let peak = base.peak.map(|q| Peak {
            mu_r: f * q.mu_r,
            ..q
        });
        let (mu_0, mu_p, mu_c0) = (f * base.mu_0, f * base.mu_p, f * base.mu_c0);
        Mepi {
            mu_0,
            mu_p,
            mu_c0,
            peak,
            ..base
        }
    });
    add("μ_p = 50".into(), Mepi { mu_p: 50.0, ..base });
    for a in [1e-12, 1e-6, 1.0, 1e6, 1e12] {
        add(format!("A = {a:e}"), Mepi { a, ..base });
    }
    for c_0 in [0.0, 1e-12, 1e3, 1e12, 1e200] {
        add(format!("C_0 = {c_0:e}"), Mepi { c_0, ..base });
    }
    // A layer of L = 50 mm: K_t t = G and K_n t = M stay.
    for decade in 0..=6 {
        let t = 0.05 / 10_f64.powi(decade);
        let (k_n, k_t) = (base.k_n * base.t / t, base.k_t * base.t / t);
        add(
            format!("L/t = 1e{decade}"),
            Mepi {
                k_n,
                k_t,
                t,
                ..base
            },
        );
    }
    for ratio in [1e-8, 1e-4, 4.0 / 3.0, 1e4, 1e8] {
        let k_n = ratio * base.k_t;
        add(format!("K_n/K_t = {ratio:e}"), Mepi { k_n, ..base });
    }
    for p_0 in [1e-6, 1e6] {
        add(format!("p_0 = {p_0:e}"), Mepi { p_0, ..base });
    }
    add("N = 2".into(), Mepi { n: 2.0, ..base });
    if let Some(peak) = base.peak {
        let mut with = |what: String, peak: Peak| {
            add(
                what,
                Mepi {
                    peak: Some(peak),
                    ..base
                },
            );
        };
        for a_0 in [0.0, 1e-6, 1e3, 1e6, 1e200] {
            with(format!("A_0 = {a_0:e}"), Peak { a_0, ..peak });
        }
        for u_tp in [0.0, 1e-12, 1e3] {
            with(format!("u_tp = {u_tp:e}"), Peak { u_tp, ..peak });
        }
        for mu_r in [0.0, base.mu_p] {
            with(format!("μ_r = {mu_r}"), Peak { mu_r, ..peak });
        }
    }
    for sigma in [1e-6, 1e6] {
        all.push((format!("σ_ni = {sigma:e}"), base, sigma));
    }
    all
}

/// A point of the law: its variables are ξ, σ_ni, the gap and the plastic contraction.
fn state(flux: &[f64], state: &[f64]) -> State {
    State {
        sigma: -flux[0],
        tau: flux[1],
        xi: state[0],
        gap: state[2],
        contraction: state[3],
    }
}

/// Paths in units of the elastic compression and of a slip: contraction and slip of each segment.
const PATHS: &str = "
constant volume | 0 1
compression and shear | 0.5 1; 2 -1
reversals | 0 1; 0 -2; 0 1.5; 0 -0.5
zero and back | -0.9 0.3; -1 0.3; -1 0.5; 1 -0.5; 2.5 0; 0 1
opens at once | -3 1; 4 -2; -0.5 1; 0.5 1
barely open | -1 0; -1e-9 0.1; 1e-9 0; 1e-3 1e-3; 1 1
";

fn follow(p: &Mepi, sigma_ni: f64, path: &[[f64; 2]], slip: f64, increments: u32) -> Verdict {
    let built = p.with_values(&[], |values| law(p.id(), Hypothesis::Interface2d, values));
    let law = match built {
        Ok(law) => law,
        Err(why) => return Verdict::Refused(why),
    };
    let mut point = match Point::new(law, &[-sigma_ni, 0.0]) {
        Ok(point) => point,
        Err(why) => return Verdict::Refused(reason(&why)),
    };
    let constants = p.at(sigma_ni);
    let each = 1.0 / f64::from(increments);
    for [contraction, shear] in path {
        let increment = [
            -contraction * sigma_ni / constants.k_n * each,
            shear * slip * each,
        ];
        for _ in 0..increments {
            let verdict = point.advance(&increment, |flux, internal, piece, end| {
                let (start, end) = (state(flux, internal), state(&end.flux, &end.state));
                check(&constants, &start, [-piece[0], piece[1]], &end)
                    .map_err(|what| format!("{what}; from {start:?} by {piece:?} to {end:?}"))
            });
            if verdict != Verdict::Agrees {
                return verdict;
            }
        }
    }
    Verdict::Agrees
}

pub(crate) fn families() -> Vec<Family> {
    let mut plain = Family::new("MEPI, led by jumps", "first root by scan, double-double");
    let mut softening = Family::new("the same with a peak", "first root by scan, double-double");
    let bases = [
        ("Table IV", TABLE_4),
        ("Fontainebleau", FONTAINEBLEAU),
        ("silica", SILICA),
        ("Fontainebleau, published", published(FONTAINEBLEAU)),
        ("silica, published", published(SILICA)),
    ];
    let paths = paths_of(PATHS);
    for (base, p) in bases {
        for (number, (what, p, sigma)) in extremes(p).into_iter().enumerate() {
            let constants = p.at(sigma);
            // Slip that mobilises the friction.
            let unit = constants.slip_scale
                + p.mu_p * sigma / constants.k_t
                + p.peak.map_or(0.0, |peak| peak.u_tp);
            for (i, (path, segments)) in paths.iter().enumerate() {
                for (j, length) in [1e-2, 1.0, 1e4].into_iter().enumerate() {
                    // Half of all combinations, each length and path with one increment and more.
                    if (number + i + j) % 2 == 1 {
                        continue;
                    }
                    let increments = [1, 4, 9][(number + i) % 3];
                    let verdict = follow(&p, sigma, segments, length * unit, increments);
                    let name = format!("{base}, {what}: {path} by {length:e}, {increments}");
                    let family = if p.peak.is_some() {
                        &mut softening
                    } else {
                        &mut plain
                    };
                    family.add(name, verdict);
                }
            }
        }
    }
    vec![plain, softening, overflowing()]
}

/// Parameters whose products come close to the ends of the range of numbers. Without the paths whose
/// increments lose contact at slips below the decades that the reference scans.
fn overflowing() -> Family {
    let mut family = Family::new(
        "MEPI, parameters 10^±300",
        "first root by scan, double-double",
    );
    for p in [TABLE_4, FONTAINEBLEAU] {
        for value in [1e-300, 1e-160, 1e160, 1e300] {
            let peak = |change: fn(&mut Peak, f64)| {
                let mut q = p.peak;
                if let Some(q) = &mut q {
                    change(q, value);
                }
                Mepi { peak: q, ..p }
            };
            let changed = [
                ("k_n", Mepi { k_n: value, ..p }),
                ("k_t", Mepi { k_t: value, ..p }),
                ("A", Mepi { a: value, ..p }),
                ("C_0", Mepi { c_0: value, ..p }),
                ("t", Mepi { t: value, ..p }),
                ("p_0", Mepi { p_0: value, ..p }),
                ("A_0", peak(|q, v| q.a_0 = v)),
                ("u_tp", peak(|q, v| q.u_tp = v)),
            ];
            for (what, p) in changed {
                let slip = p.mu_p * 100.0 / p.at(100.0).k_t;
                for (path, segments) in &paths_of(PATHS)[..4] {
                    let verdict = follow(&p, 100.0, segments, 2.0 * slip, 2);
                    family.add(format!("{what} = {value:e}: {path}"), verdict);
                }
            }
        }
    }
    family
}
