//! Random joints on random walks.

use super::*;
use walk::random;

fn sand(seed: &mut u64) -> Parameters {
    let normal_stiffness = 10_f64.powf(random(seed, 3.0, 9.0));
    // A layer that its springs do not inflate.
    let thinnest = 2e3 / normal_stiffness;
    Parameters {
        normal_stiffness,
        shear_stiffness: 10_f64.powf(random(seed, 3.0, 9.0)),
        critical_friction_angle: random(seed, 5.0, 50.0),
        critical_void_ratio: random(seed, 0.5, 1.5),
        granular_hardness: 10_f64.powf(random(seed, 4.0, 8.0)),
        hardness_exponent: random(seed, 0.1, 1.0),
        peak_exponent: random(seed, 0.0, 5.0),
        dilatancy_exponent: random(seed, 0.0, 8.0),
        hardening_slip: 10_f64.powf(random(seed, -6.0, -1.0)),
        thickness: 10_f64.powf(random(seed, -4.0, 0.0)).max(thinnest),
        initial_void_ratio: random(seed, 0.3, 1.5),
        dilatancy_factor: random(seed, -0.5, 1.5).max(0.0),
        elastic_range: random(seed, 0.001, 0.08),
    }
}

/// Admissible, and the balances of Eq. (1), (6) and (8) by themselves.
fn is_balanced(start: &Walker, end: &Walker, jump: [f64; 2]) {
    let p = &end.law.parameters;
    let [normal, shear] = end.traction;
    let alpha = end.state.back_stress_ratio;
    let limit = -p.elastic_range * normal;
    let outside = (shear + alpha * normal).abs() - limit;
    assert!(outside <= 1e-12 * (shear.abs() - normal), "{end:?}");
    if normal == 0.0 || start.state.gap > 0.0 || alpha == start.state.back_stress_ratio {
        return;
    }
    let elastic = [
        (normal - start.traction[0]) / p.normal_stiffness,
        (shear - start.traction[1]) / p.shear_stiffness,
    ];
    let flowed = jump[1] - elastic[1];
    let (slip, sign) = (flowed.abs(), 1.0_f64.copysign(flowed));
    // What the springs leave of a slip has no digits if it is short.
    let sure = (start.traction[1].abs() + shear.abs()) / p.shear_stiffness + jump[1].abs();
    if slip < 1e-6 * sure {
        return;
    }
    let [peak, neutral] = lines(p, psi(end));
    let first = sign * start.state.back_stress_ratio + p.elastic_range;
    let left = (-slip / p.hardening_slip).exp();
    let mu = peak + (first - peak) * left;
    let found = sign * alpha + p.elastic_range;
    let size = (peak + first.abs()) * (1.0 + sure / p.hardening_slip * 1e-4);
    assert_abs_diff_eq!(found, mu, epsilon = 1e-9 * size);
    let dilation = p.dilatancy_factor
        * ((peak - neutral) * slip + (first - peak) * p.hardening_slip * (1.0 - left));
    let moved = jump[0] - elastic[0];
    let size = (peak + neutral + first.abs()) * (slip + 1e-4 * sure)
        + 1e-4 * ((normal.abs() + start.traction[0].abs()) / p.normal_stiffness + jump[0].abs());
    assert_abs_diff_eq!(moved, dilation, epsilon = 1e-9 * size);
}

/// 0: no contact, 1: elastic, 2: slides one way, 3: the other.
fn kind(start: &Walker, end: &Walker) -> usize {
    let turned = end.state.back_stress_ratio - start.state.back_stress_ratio;
    if end.traction == [0.0; 2] {
        0
    } else if turned == 0.0 {
        1
    } else {
        2 + usize::from(turned > 0.0)
    }
}

/// Compares a column of the tangent with a difference of fourth order; false where its points do not
/// lie in one branch.
fn column_agrees(start: &Walker, jump: [f64; 2], tangent: [[f64; 2]; 2], j: usize) -> bool {
    let mut middle = *start;
    middle.step(jump);
    let by = jump[j].abs() * 1e-4;
    let Some(ends) = start.around(jump, j, by) else {
        return false;
    };
    if !ends.iter().all(|w| kind(start, w) == kind(start, &middle)) {
        return false;
    }
    let tractions = ends.map(|w| w.traction);
    for i in 0..2 {
        let t = tractions.map(|t| t[i]);
        // No Taylor series over a difference that bends.
        let (left, right) = (t[1] - t[0], t[3] - t[2]);
        if (left - right).abs() > 1e-3 * (left.abs() + right.abs()) + 1e-9 {
            return false;
        }
        let difference = (t[0] - 8.0 * t[1] + 8.0 * t[2] - t[3]) / (12.0 * by);
        let size = tangent[i][j].abs() + (10.0 + t[0].abs()) / jump[j].abs();
        assert!(
            (difference - tangent[i][j]).abs() < 1e-5 * size,
            "({i}, {j}) {difference} {} {start:?} {jump:?}",
            tangent[i][j]
        );
    }
    true
}

#[test]
fn stays_admissible_with_an_exact_tangent_on_random_walks() {
    let seed = &mut 11;
    let (mut compared, mut refused) = ([0; 4], 0);
    for _ in 0..800 {
        let p = sand(seed);
        let sigma = random(seed, 0.0, 200.0);
        let mut walker = begin(p, [-sigma, sigma * random(seed, -0.5, 0.5)]);
        for _ in 0..30 {
            let mut jump = [
                random(seed, -150.0, 100.0) / p.normal_stiffness,
                random(seed, -200.0, 200.0) / p.shear_stiffness,
            ];
            // Long slips as well.
            if random(seed, 0.0, 1.0) < 0.3 {
                jump[1] += random(seed, -3.0, 3.0) * p.hardening_slip;
            }
            let start = walker;
            if start.respond(jump, Tangent::Consistent).is_err() {
                refused += 1;
                continue;
            }
            let tangent = walker.step(jump);
            let mut mirror = start;
            mirror.traction[1] = -start.traction[1];
            mirror.state.back_stress_ratio = -start.state.back_stress_ratio;
            mirror.step([jump[0], -jump[1]]);
            assert_eq!(mirror.traction, [walker.traction[0], -walker.traction[1]]);
            assert_eq!(mirror.state.void_ratio, walker.state.void_ratio);
            assert!(walker.traction[0] <= 0.0);
            assert!(walker.state.gap == 0.0 || walker.traction == [0.0; 2]);
            is_balanced(&start, &walker, jump);
            for j in 0..2 {
                if column_agrees(&start, jump, tangent, j) {
                    compared[kind(&start, &walker)] += 1;
                }
            }
        }
    }
    println!("open, elastic, back, forth: {compared:?}, refused: {refused}");
    assert!(compared.iter().all(|&n| n > 200), "{compared:?}");
    assert!(refused < 100, "{refused}");
}

/// Whatever the increment, the end is finite and admissible.
#[test]
fn huge_increments_end_well() {
    let seed = &mut 5;
    for _ in 0..1000 {
        let p = sand(seed);
        let mut walker = begin(p, [-random(seed, 0.0, 200.0), 0.0]);
        for _ in 0..5 {
            let size = 10_f64.powf(random(seed, -6.0, 30.0));
            let jump = [
                random(seed, -1.0, 1.0) * size,
                random(seed, -1.0, 1.0) * size,
            ];
            if let Ok(end) = walker.respond(jump, Tangent::Consistent) {
                let numbers = end.tangent.as_flattened().iter().chain(&end.traction);
                assert!(numbers.into_iter().all(|x| x.is_finite()), "{end:?}");
                assert!(end.traction[0] <= 0.0 && end.state.void_ratio.is_finite());
                walker.step(jump);
            }
        }
    }
}
