//! Random paths from random initial states.

use super::{CLAY, DENSE, Path, size_of};
use crate::small_law::SmallParameters;
use crate::soil::{Soil, SoilParameters};
use crate::spectral::Principal;
use crate::step::{Increment, Point};
use crate::{HardeningSoil, HardeningSoilSmall};
use abi::{ContinuumLaw, Tangent};
use walk::Random;

/// Six increments on two ways, from stresses with random overconsolidation. Every end is within the strength, and
/// no tangent is stiffer than elasticity times `stiffest`. Returns how often a law asked for a smaller increment.
fn sweep<L: ContinuumLaw>(
    paths: u32,
    stiffest: f64,
    new: impl Fn(SoilParameters) -> (L, Soil),
) -> u32 {
    let (mut random, mut cuts) = (Random(1), 0);
    for n in 0..paths {
        let base = if n % 2 == 0 { DENSE } else { CLAY };
        let p = SoilParameters {
            ocr: if n % 3 == 0 {
                20.0
            } else {
                random.between(1.0, 4.0)
            },
            m: [0.0, 0.5, 0.7, 1.0][n as usize / 2 % 4],
            ..base
        };
        let (law, soil) = new(p);
        let s = 10_f64.powf(random.between(-1.0, 3.0));
        let k = random.between(0.4, 2.0);
        let third = s * random.between(k.min(1.0), k.max(1.0));
        let mut path = Path::new(&law, [s, s * k, third]);
        for _ in 0..2 {
            let size = 10_f64.powf(random.between(-5.0, -2.5));
            let increment: [f64; 6] = std::array::from_fn(|_| size * random.between(-1.0, 1.0));
            for _ in 0..3 {
                follow(&mut path, &increment, [2.0, stiffest], &mut cuts);
                let values = Principal::of(&path.stress).values;
                let (q, q_f) = (values[0] - values[2], soil.q_f(values[2]).0);
                assert!(q <= q_f + 1e-9 * (values[0].abs() + 1.0), "{n}: {values:?}");
            }
        }
    }
    cuts
}

#[test]
fn random_paths_succeed() {
    const PATHS: u32 = 10_000;
    let cuts = sweep(PATHS, 10.0, |p| {
        let law = HardeningSoil::new(p).unwrap();
        let soil = law.soil;
        (law, soil)
    });
    assert!(cuts < PATHS / 500, "{cuts} cuts");
}

/// The stiffness at small strains depends on the direction of the increment: of a small one it changes fast.
#[test]
fn random_paths_with_small_strains_succeed() {
    const PATHS: u32 = 4_000;
    let cuts = sweep(PATHS, 1e4, |soil| {
        let parameters = SmallParameters {
            soil,
            g_0_ref: 1.3 * soil.e_ur_ref,
            gamma_07: 1.5e-4,
        };
        let law = HardeningSoilSmall::new(parameters).unwrap();
        let soil = law.soil;
        (law, soil)
    });
    assert!(cuts < PATHS / 500, "{cuts} cuts");
}

/// An increment, in halves where the law asks for it, as a host does.
fn follow<L: ContinuumLaw>(
    path: &mut Path<'_, L>,
    increment: &[f64; 6],
    [halvings, stiffest]: [f64; 2],
    cuts: &mut u32,
) {
    match path.try_update(increment, Tangent::Consistent) {
        Ok(end) => {
            let elastic = |path: &Path<'_, L>| {
                let zero = path.try_update(&[0.0; 6], Tangent::Elastic).unwrap();
                size_of(&zero.tangent)
            };
            let before = (path.stress, elastic(path));
            path.accept(increment, &end);
            let stiffness = before.1.max(elastic(path));
            let size = size_of(&end.tangent);
            assert!(
                size < stiffest * stiffness,
                "{size:e} {stiffness:e} {:?} {increment:?} {:?}",
                before.0,
                path.stress
            );
        }
        Err(failure) => {
            *cuts += 1;
            assert!(
                halvings > 0.0,
                "{failure:?} {:?} {increment:?}",
                path.stress
            );
            let half = increment.map(|e| 0.5 * e);
            follow(path, &half, [halvings - 1.0, stiffest], cuts);
            follow(path, &half, [halvings - 1.0, stiffest], cuts);
        }
    }
}

/// A step of the plane is one of space: to the last digit in the same axes; in others, whose principal values differ by
/// round-off, to 1e-8. Near the apex several returns may exist, and round-off then chooses: in three of these steps.
#[test]
fn plane_and_space_agree() {
    const PATHS: u32 = 20_000;
    let (mut random, mut apart) = (Random(7), 0);
    for n in 0..PATHS {
        let base = if n % 2 == 0 { DENSE } else { CLAY };
        let p = SoilParameters {
            ocr: random.between(1.0, 4.0),
            m: [0.0, 0.5, 0.7, 1.0][n as usize / 2 % 4],
            cohesion: 20.0,
            k_0_nc: f64::NAN,
            e_oed_ref: 0.7 * base.e_oed_ref,
            tensile_strength: [f64::NAN, 2.0, 0.0][n as usize % 3],
            ..base
        };
        let soil = HardeningSoil::new(p).unwrap().soil;
        let s = 10_f64.powf(random.between(-1.0, 2.5));
        let [k, third] = [0; 2].map(|_| random.between(0.5, 1.5));
        let stress = [s, s * k, s * third, 0.2 * s];
        let values = Principal::of(&stress).values;
        let [p_p, gamma] = soil.start(&values);
        let stiffness = 3.0 * soil.stiffness(values[0]).0;
        let mut at = Point { stress, p_p, gamma };
        for _ in 0..3 {
            let size = 10_f64.powf(random.between(-5.0, -2.0));
            let strain: [f64; 4] = std::array::from_fn(|_| size * random.between(-1.0, 1.0));
            for _ in 0..2 {
                let Some(plane) = end(&soil, &at, strain, |x| x) else {
                    assert!(end(&soil, &at, strain, in_space).is_none());
                    break;
                };
                let space = end(&soil, &at, strain, in_space).unwrap();
                let expected = in_space(plane.stress);
                let same = |i: usize| (expected[i] - space.stress[i]).abs() <= 0.0;
                assert!((0..6).all(same), "{n}: {expected:?} {:?}", space.stress);
                let turned = end(&soil, &at, strain, |x| [x[1], x[2], x[0], 0.0, x[3], 0.0]);
                let off = turned.map_or(f64::INFINITY, |turned| {
                    let back = [2, 0, 1, 4].map(|i| turned.stress[i]);
                    largest(std::array::from_fn(|i| plane.stress[i] - back[i]))
                });
                apart += u32::from(off > 1e-8 * largest(plane.stress).max(stiffness * size));
                at = plane;
            }
        }
    }
    assert!(apart <= 3, "{apart}");
}

fn in_space(x: [f64; 4]) -> [f64; 6] {
    [x[0], x[1], x[2], x[3], 0.0, 0.0]
}

fn largest(x: [f64; 4]) -> f64 {
    x.iter().fold(0.0, |most, x| x.abs().max(most))
}

/// The end of a step of the plane, seen in other components.
fn end<const N: usize>(
    soil: &Soil,
    start: &Point<4>,
    strain: [f64; 4],
    seen: impl Fn([f64; 4]) -> [f64; N],
) -> Option<Point<N>> {
    let start = Point {
        stress: seen(start.stress),
        p_p: start.p_p,
        gamma: start.gamma,
    };
    let end = soil.carry(start, &Increment::of(seen(strain)), false);
    end.ok().map(|(end, _)| end)
}
