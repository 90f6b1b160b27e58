//! The consistent tangent against central differences of the update.

use super::*;

/// The branch an update ends in, told from its outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Zone {
    Open,
    Elastic,
    Sliding,
    Peak,
}

fn zone(start: &State, end: &InterfaceResponse<State>, u_tp: f64) -> Zone {
    if end.state.gap > 0.0 || end.traction == [0.0; 2] {
        Zone::Open
    } else if end.state.plastic_slip == start.plastic_slip {
        Zone::Elastic
    } else if end.state.plastic_slip == u_tp {
        Zone::Peak
    } else {
        Zone::Sliding
    }
}

/// Compares the tangent with central differences; false where the update fails or changes its
/// branch within the difference.
fn agrees<L: InterfaceLaw<State = State>>(
    law: &L,
    point: InterfacePoint<State>,
    u_tp: f64,
) -> Option<Zone> {
    let end = law.update(&point, Tangent::Consistent).ok()?;
    let here = zone(&point.state, &end, u_tp);
    let elastic = law.update(&point, Tangent::Elastic).ok()?.tangent;
    let scale = elastic[0][0].max(elastic[1][1]);
    let mut best = [[f64::INFINITY; 2]; 2];
    for j in 0..2 {
        let size = point.jump_increment.map(f64::abs);
        let size = size[0].max(size[1]);
        for step in [1e-3, 1e-4, 1e-5, 1e-6, 1e-7].map(|s| s * size) {
            let shifted = |by: f64| {
                let mut moved = point;
                moved.jump_increment[j] += by;
                law.update(&moved, Tangent::None).ok()
            };
            let ends = [-2.0, -1.0, 1.0, 2.0].map(|m| shifted(m * step));
            let [Some(a), Some(b), Some(c), Some(d)] = ends else {
                continue;
            };
            let same = |r: &InterfaceResponse<State>| {
                zone(&point.state, r, u_tp) == here
                    && (r.traction[1] < 0.0) == (end.traction[1] < 0.0)
            };
            if ![a, b, c, d].iter().all(same) {
                continue;
            }
            for i in 0..2 {
                // Fourth-order difference.
                let first = c.traction[i] - b.traction[i];
                let second = d.traction[i] - a.traction[i];
                let difference = (8.0 * first - second) / (12.0 * step);
                let error = (difference - end.tangent[i][j]).abs();
                let size = scale.max(end.tangent[i][j].abs());
                best[i][j] = best[i][j].min(error / size);
            }
        }
    }
    if best.iter().flatten().any(|e| e.is_infinite()) {
        return None;
    }
    for (i, row) in best.iter().enumerate() {
        for (j, error) in row.iter().enumerate() {
            assert!(
                *error < 1e-6,
                "({i}, {j}) off by {error:e} in {here:?}: {point:?}\n{end:?}"
            );
        }
    }
    Some(here)
}

/// A point anywhere in stress space, gap or not, and an increment of any size.
fn random_point(random: &mut Random, k: [f64; 2], slips: &[f64]) -> InterfacePoint<State> {
    let sigma = random.decades(1.0, 1e3);
    let mut state = State {
        plastic_slip: 0.0,
        sigma_ni: 100.0,
        gap: 0.0,
        plastic_contraction: 0.0,
    };
    if random.unit() < 0.8 {
        let slip = slips[(random.unit() * slips.len() as f64) as usize];
        state.plastic_slip = slip * random.between(0.5, 1.5);
    }
    let mut traction = [-sigma, sigma * random.between(-0.8, 0.8)];
    let length = [sigma / k[0], sigma / k[1]];
    let size = random.decades(1e-2, 1e2);
    let mut jump_increment = [
        random.between(-1.0, 1.0) * size * length[0],
        random.between(-1.0, 1.0) * size * length[1],
    ];
    if random.unit() < 0.25 {
        traction = [0.0; 2];
        state.gap = length[0] * random.unit();
        jump_increment[0] = -jump_increment[0].abs();
    }
    InterfacePoint {
        jump: [0.0; 2],
        jump_increment,
        traction,
        state,
        time: 0.0,
        time_increment: 1.0,
        step_time: 0.0,
    }
}

/// Counts what was compared, zone by zone.
fn compare<L: InterfaceLaw<State = State>>(
    law: &L,
    k: [f64; 2],
    slips: &[f64],
    u_tp: f64,
) -> [usize; 4] {
    let mut random = Random(7);
    let mut counted = [0; 4];
    for _ in 0..8000 {
        let point = random_point(&mut random, k, slips);
        if let Some(zone) = agrees(law, point, u_tp) {
            counted[zone as usize] += 1;
        }
    }
    println!("open, elastic, sliding, peak: {counted:?}");
    counted
}

#[test]
fn agrees_with_differences_without_softening() {
    for p in [TABLE_4, TABLE_2] {
        let truth = Truth::hardening(p, 100.0);
        let k = [truth.k_n(), truth.k_t()];
        let counted = compare(&mepi(p), k, &[1e-6, 1e-5, 1e-4, 1e-3], f64::NAN);
        assert!(counted[..3].iter().all(|&n| n > 500), "{counted:?}");
    }
}

#[test]
fn agrees_with_differences_with_softening() {
    for base in [FONTAINEBLEAU, SILICA] {
        for p in [base, published(base)] {
            let truth = Truth::softening(p, 100.0);
            let k = [truth.k_n(), truth.k_t()];
            let slips = [
                0.1 * p.softening.u_tp,
                0.7 * p.softening.u_tp,
                p.softening.u_tp,
                3.0 * p.softening.u_tp,
            ];
            let counted = compare(&softening(p), k, &slips, p.softening.u_tp);
            assert!(counted[..3].iter().all(|&n| n > 500), "{counted:?}");
            if p.softening.is_published() {
                assert!(counted[Zone::Peak as usize] > 10, "{counted:?}");
            }
        }
    }
}

#[test]
fn the_elastic_operator_is_diagonal_in_every_state() {
    let law = mepi(TABLE_4);
    let truth = Truth::hardening(TABLE_4, 100.0);
    let mut walker = Walker::new(&law, 100.0);
    for du in [[0.0, 1e-5], [0.0, 1e-3], [-1e-2, 0.0], [5e-3, 1e-3]] {
        let tangent = walker.respond(du, Tangent::Elastic).unwrap().tangent;
        assert_eq!(tangent, [[truth.k_n(), 0.0], [0.0, truth.k_t()]]);
        walker.step(du);
    }
}
