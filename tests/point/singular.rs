//! Equilibrium where the tangent of the free components is singular.
//!
//! Goal        a solution is found wherever there is one, and none where absent.
//! Set-up      strain paths with random directions; then the same end with some stresses prescribed.
//! Law         mohr_coulomb with and without cohesion, dilatancy and tension cut-off; elastic.
//! Asserts     every prescribed stress is met; stresses beyond strength give exit code 2.

use crate::driver::{attempt, follow};

/// Numbers in [−1, 1) from a linear congruential generator.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

const COMPONENTS: [&str; 4] = ["11", "22", "33", "12"];

#[test]
fn stresses_of_random_strain_paths_are_found_again() {
    let laws = [
        "cohesion = 10\nfriction_angle = 36.5\ndilatancy_angle = 12\n",
        "cohesion = 10\nfriction_angle = 36.5\ndilatancy_angle = 36.5\n",
        "cohesion = 0\nfriction_angle = 30\ndilatancy_angle = 0\n",
        "cohesion = 40\nfriction_angle = 0\ndilatancy_angle = 0\n",
        "cohesion = 10\nfriction_angle = 36.5\ndilatancy_angle = 12\ntensile_strength = 4\n",
    ];
    let mut random = Random(7);
    for number in 0..200 {
        let law = laws[number % laws.len()];
        let head = format!(
            "law = 'mohr_coulomb'\nhypothesis = 'axisymmetric'\n[parameters]\n\
             young_modulus = 34e3\npoisson_ratio = 0.3\n{law}[initial]\n\
             stress = {{ 11 = -100, 22 = -100, 33 = -100 }}\n"
        );
        let size = 10_f64.powf(-3.5 + 2.0 * random.next());
        let mut strain = || -> [f64; 4] { std::array::from_fn(|_| size * random.next()) };
        let (first, second) = (strain(), strain());
        let led = |end: &[f64; 4]| -> Vec<String> {
            let pairs = COMPONENTS.iter().zip(end);
            pairs
                .map(|(c, e)| format!("{c} = {{ strain = {e:e} }}"))
                .collect()
        };
        let start = format!(
            "[[segment]]\nincrements = 5\ncontrol = {{ {} }}\n[[segment]]\nincrements = 1\n",
            led(&first).join(", ")
        );
        let truth = follow(&format!(
            "{head}{start}control = {{ {} }}",
            led(&second).join(", ")
        ));
        let mut controls = led(&second);
        for (i, c) in COMPONENTS.iter().enumerate() {
            if random.next() < 0.0 {
                let stress = truth.last(&format!("stress_{c}"));
                controls[i] = format!("{c} = {{ stress = {stress:e} }}");
            }
        }
        let text = format!("{head}{start}control = {{ {} }}", controls.join(", "));
        let run = follow(&text);
        let scale = COMPONENTS.map(|c| run.last(&format!("stress_{c}")).abs());
        let scale = scale.into_iter().fold(100.0, f64::max);
        for (control, c) in controls.iter().zip(COMPONENTS) {
            if control.contains("stress") {
                let name = format!("stress_{c}");
                let error = run.last(&name) - truth.last(&name);
                assert!(
                    error.abs() <= 1e-9 * scale,
                    "{name} off by {error:e}\n{text}"
                );
            }
        }
    }
}

#[test]
fn nearly_equal_stresses_on_an_edge_are_kept_apart() {
    // 22 and 33 differ by 0.002 kPa: the edge between their faces is a trap for Newton's method.
    let run = follow(
        "law = 'mohr_coulomb'\nhypothesis = 'axisymmetric'\n[parameters]\nyoung_modulus = 34e3\n\
         poisson_ratio = 0.3\ncohesion = 10\nfriction_angle = 36.5\ndilatancy_angle = 12\n[initial]\n\
         stress = { 11 = -100, 22 = -100, 33 = -100 }\n[[segment]]\nincrements = 10\ncontrol = \
         { 11 = { strain = 0.01 }, 22 = { stress = -50.002 }, 33 = { stress = -50 } }",
    );
    assert!((run.last("stress_22") - run.last("stress_33") + 0.002).abs() < 1e-8);
    let calls: f64 = run.column("iterations").iter().sum();
    assert!(calls < 500.0, "{calls} calls");
}

#[test]
fn the_apex_itself_can_be_held() {
    let apex = 10.0 / 36.5_f64.to_radians().tan();
    let run = follow(&format!(
        "law = 'mohr_coulomb'\nhypothesis = 'axisymmetric'\n[parameters]\nyoung_modulus = 34e3\n\
         poisson_ratio = 0.3\ncohesion = 10\nfriction_angle = 36.5\ndilatancy_angle = 12\n[initial]\n\
         stress = {{ 11 = -10, 22 = -10, 33 = -10 }}\n[[segment]]\nincrements = 10\n\
         control = {{ 11 = {{ stress = {apex} }}, 22 = {{ stress = {apex} }}, 33 = {{ stress = {apex} }} }}\n\
         [[segment]]\nincrements = 10\ncontrol = {{ 22 = {{ strain = 0.01 }} }}"
    ));
    for component in ["stress_11", "stress_22", "stress_33"] {
        assert!((run.last(component) - apex).abs() < 1e-8);
    }
}

#[test]
fn stresses_beyond_strength_have_no_equilibrium() {
    for control in [
        "22 = { stress = -500 }",
        "12 = { stress = 200 }",
        "11 = { stress = 20 }, 22 = { stress = 20 }, 33 = { stress = 20 }",
        "11 = { stress = -100 }, 22 = { stress = 0 }, 33 = { stress = -150 }",
    ] {
        let run = attempt(&format!(
            "law = 'mohr_coulomb'\nhypothesis = 'axisymmetric'\n[parameters]\n\
             young_modulus = 34e3\npoisson_ratio = 0.3\ncohesion = 10\nfriction_angle = 36.5\n\
             dilatancy_angle = 12\n[initial]\nstress = {{ 11 = -100, 22 = -100, 33 = -100 }}\n\
             [[segment]]\nincrements = 10\ncontrol = {{ {control} }}"
        ));
        assert_eq!(run.error().exit_code(), 2, "{control}");
        assert!(run.increments() < 10);
    }
}

#[test]
fn tiny_and_huge_stresses_are_met_to_the_same_number_of_digits() {
    for stress in [1e-9, 1e-3, 1e6, 1e12] {
        let run = follow(&format!(
            "law = 'elastic'\nhypothesis = '3d'\n[parameters]\nyoung_modulus = 34e3\n\
             poisson_ratio = 0.3\n[[segment]]\nincrements = 3\ncontrol = {{ 22 = {{ stress = {stress} }} }}"
        ));
        let error = run.last("stress_22") / stress - 1.0;
        assert!(error.abs() < 1e-12, "{stress}: {error:e}");
    }
}
