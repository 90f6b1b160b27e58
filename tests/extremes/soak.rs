//! A million law calls in cycles: memory does not grow, the stress stays on the surface.
//!
//! Memory is that of a separate process, where no other test runs.

use crate::mepi_paths::{FONTAINEBLEAU, TABLE_4};
use crate::mohr_coulomb::{self, Parameters, Pyramid};
use crate::point::{Point, law};
use abi::Hypothesis;
use law::Operator;
use std::process::Command;

const CALLS: u32 = 1_000_000;

/// Memory of this process that belongs to no file, bytes: pages of programs and libraries come and go as the system
/// sees fit. The page of every platform with `/proc` here is 4 KiB.
fn resident() -> usize {
    let sizes = std::fs::read_to_string("/proc/self/statm").unwrap();
    let pages: Vec<usize> = sizes
        .split_whitespace()
        .map(|size| size.parse().unwrap())
        .collect();
    4096 * (pages[1] - pages[2])
}

#[test]
#[cfg(target_os = "linux")]
fn a_million_calls_leave_memory_and_surface_alone() {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "soak::cycles", "--ignored", "--nocapture"])
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success() && text.contains("1 passed"),
        "{text}{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

/// A point, the amplitude of its cycles, and how far off the surface it is, relative.
struct Cycle {
    point: Point,
    amplitude: Vec<f64>,
    off: Box<dyn Fn(&Point) -> f64>,
}

fn cycles_of_each_law() -> Vec<Cycle> {
    let mut all = vec![];
    for p in [TABLE_4, FONTAINEBLEAU] {
        for scheme in [0.0, 2.0] {
            let built = p.with_values(&[("scheme", scheme)], |values| {
                law(p.id(), Hypothesis::Interface2d, values)
            });
            let constants = p.at(100.0);
            all.push(Cycle {
                point: Point::new(built.unwrap(), &[-100.0, 0.0]).unwrap(),
                amplitude: vec![0.0, 2.0 * p.mu_p * 100.0 / constants.k_t],
                off: Box::new(move |point| {
                    let strength = -constants.friction(point.state[0]) * point.flux[0];
                    (point.flux[1].abs() - strength) / strength.max(f64::MIN_POSITIVE)
                }),
            });
        }
    }
    let joint = [
        ("normal_stiffness", 2e6),
        ("shear_stiffness", 5e5),
        ("cohesion", 5.0),
        ("friction_angle", 30.0),
        ("dilatancy_angle", 0.0),
    ];
    all.push(Cycle {
        point: Point::new(
            law("coulomb_joint", Hypothesis::Interface2d, &joint).unwrap(),
            &[-100.0, 0.0],
        )
        .unwrap(),
        amplitude: vec![1e-6, 4e-4],
        off: Box::new(|point| {
            let strength = 5.0 - point.flux[0] * 30_f64.to_radians().tan();
            (point.flux[1].abs() - strength) / strength
        }),
    });
    for (phi, scheme) in [(30.0, 0.0), (30.0, 2.0), (0.0, 0.0)] {
        let p = Parameters {
            e: 1e5,
            nu: 0.3,
            cohesion: 5.0,
            phi,
            psi: 0.0,
            tensile: None,
        };
        let pyramid = Pyramid::new(p);
        all.push(Cycle {
            point: mohr_coulomb::build(&p, Hypothesis::PlaneStrain, &[("scheme", scheme)]).unwrap(),
            amplitude: vec![2e-4, -2e-4, 0.0, 4e-3],
            off: Box::new(move |point| pyramid.excess(&point.flux)),
        });
    }
    all
}

#[test]
#[ignore = "work for a child"]
fn cycles() {
    let mut all = cycles_of_each_law();
    let n = CALLS / all.len() as u32;
    let mut follow = |calls: u32| {
        let (mut worst, mut on_surface) = (0.0_f64, 0_u32);
        for cycle in &mut all {
            let Cycle {
                point,
                amplitude,
                off,
            } = cycle;
            for call in 0..calls {
                // A cycle of 40 increments, forth and back.
                let sign = if call / 20 % 2 == 0 { 0.05 } else { -0.05 };
                let increment: Vec<f64> = amplitude.iter().map(|a| a * sign).collect();
                let operator = if call % 3 == 0 {
                    Operator::Consistent
                } else {
                    Operator::None
                };
                let end = point.respond(&increment, operator).unwrap();
                (point.flux, point.state) = (end.flux, end.state);
                if call % 97 == 0 {
                    let off = off(point);
                    worst = worst.max(off);
                    on_surface += u32::from(off > -1e-9);
                }
            }
        }
        (worst, on_surface)
    };
    // What is allocated once.
    follow(2000);
    let before = resident();
    let (worst, on_surface) = follow(n);
    let grown = resident().saturating_sub(before);
    println!("{CALLS} calls: {grown} bytes, {worst:e} off the surface, {on_surface} on it");
    assert!(on_surface > 1000, "{on_surface}");
    assert!(worst <= 1e-11, "{worst:e}");
    assert!(grown <= 256 * 1024, "{grown}");
}
