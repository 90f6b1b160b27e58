//! Interfaces in three dimensions: two tangential directions.
//!
//! Goal        friction that is alike in all directions along the interface.
//! Set-up      one point, normal traction and both slips led.
//! Law         coulomb_joint.
//! Asserts     closed forms, the law in two dimensions, mistakes at their place.

use crate::driver::{attempt, follow};
use approx::assert_relative_eq;
use tests::words::edited;
use tests::words::rows_of;

const K_T: f64 = 4e5;
const PHI: f64 = 30.0;

fn joint(hypothesis: &str, psi: f64) -> String {
    format!(
        "law = 'coulomb_joint'\nhypothesis = '{hypothesis}'\n[parameters]\n\
         normal_stiffness = 1e6\nshear_stiffness = {K_T:?}\ncohesion = 5\nfriction_angle = {PHI}\n\
         dilatancy_angle = {psi}\n[initial]\ntraction = {{ n = -100 }}\n"
    )
}

/// Strength under 100 kPa.
fn strength() -> f64 {
    5.0 + 100.0 * PHI.to_radians().tan()
}

#[test]
fn friction_points_along_the_slip() {
    for angle in [0.0_f64, 0.3, 1.2, 2.0, 4.0] {
        let (sin, cos) = angle.sin_cos();
        let run = follow(&format!(
            "{}[[segment]]\nincrements = 10\ncontrol = {{ n = {{ traction = -100 }}, \
             t = {{ jump = {:?} }}, s = {{ jump = {:?} }} }}",
            joint("interface_3d", 0.0),
            2e-3 * cos,
            2e-3 * sin
        ));
        let size = strength();
        assert_relative_eq!(run.at(10, "traction_t"), size * cos, epsilon = 1e-9 * size);
        assert_relative_eq!(run.at(10, "traction_s"), size * sin, epsilon = 1e-9 * size);
        // What is not elastic is plastic slip.
        let slip = 2e-3 - size / K_T;
        assert_relative_eq!(run.at(10, "plastic_slip"), slip, max_relative = 1e-9);
    }
}

/// While the slip w goes on in a new direction m, at the angle θ₀ to the friction, the joint yields.
/// With e the direction of τ, dτ/dw = K_t (m − (m·e) e). Therefore θ' = −(K_t/|τ|) sin θ and tan θ/2 =
/// tan θ₀/2 · e^(−K_t w/|τ|).
#[test]
fn friction_turns_after_the_slip() {
    let length = strength() / K_T;
    let exact = |w: f64| 2.0 * (f64::exp(-w / length)).atan();
    let error = |increments: usize| {
        let run = follow(&format!(
            "{}[[segment]]\nincrements = 10\ncontrol = {{ t = {{ jump = 1e-3 }} }}\n\
             [[segment]]\nincrements = {increments}\ncontrol = {{ t = {{ jump = 1e-3 }}, \
             s = {{ jump = {:?} }} }}",
            joint("interface_3d", 0.0),
            2.0 * length
        ));
        let row = 10 + increments;
        let [t, s] = ["traction_t", "traction_s"].map(|column| run.at(row, column));
        assert_relative_eq!(t.hypot(s), strength(), max_relative = 1e-9);
        // From the new direction, s: at first 90°.
        (t.atan2(s) - exact(2.0 * length)).abs()
    };
    let errors = [error(200), error(400), error(800)];
    // Backward Euler is of first order.
    for pair in errors.windows(2) {
        assert_relative_eq!(pair[1] / pair[0], 0.5, epsilon = 0.01);
    }
    assert!(errors[2] < 1e-3, "{errors:?}");
}

/// Constant normal stiffness with dilation: the same states along any direction.
#[test]
fn all_directions_are_alike() {
    let path = |hypothesis: &str, slips: &[(&str, f64)]| {
        let control = |reach: f64| -> String {
            let led = slips.iter();
            let led = led.map(|(name, part)| format!("{name} = {{ jump = {:?} }}", reach * part));
            format!(", {}", led.collect::<Vec<_>>().join(", "))
        };
        // Out, back over the start, opened and closed again.
        follow(&format!(
            "{}[[segment]]\nincrements = 20\ncontrol = {{ n = {{ stiffness = 1e4 }}{} }}\n\
             [[segment]]\nincrements = 20\ncontrol = {{ n = {{ stiffness = 1e4 }}{} }}\n\
             [[segment]]\nincrements = 3\ncontrol = {{ n = {{ jump = 2e-3 }}{} }}\n\
             [[segment]]\nincrements = 7\ncontrol = {{ n = {{ jump = -1e-4 }}{} }}",
            joint(hypothesis, 8.0),
            control(3e-3),
            control(-1e-3),
            control(-1e-3),
            control(2e-3)
        ))
    };
    let plane = path("interface_2d", &[("t", 1.0)]);
    let along = path("interface_3d", &[("t", 1.0), ("s", 0.0)]);
    let across = path("interface_3d", &[("t", 0.0), ("s", 1.0)]);
    let askew = path("interface_3d", &[("t", 0.6), ("s", -0.8)]);
    assert!(plane.at(43, "gap") > 0.0, "it opens");
    assert!(plane.at(50, "traction_n") < 0.0, "it closes");
    for row in 0..=50 {
        for column in ["traction_n", "jump_n", "plastic_slip", "gap", "broken"] {
            let expected = plane.at(row, column);
            for run in [&along, &across, &askew] {
                assert_relative_eq!(run.at(row, column), expected, epsilon = 1e-9);
            }
        }
        // Without the second slip, to the last bit that stress control leaves.
        let shear = plane.at(row, "traction_t");
        assert_relative_eq!(along.at(row, "traction_t"), shear, epsilon = 1e-9);
        assert_relative_eq!(along.at(row, "traction_s"), 0.0, epsilon = 1e-12);
        assert_relative_eq!(across.at(row, "traction_s"), shear, epsilon = 1e-9);
        assert_relative_eq!(askew.at(row, "traction_t"), 0.6 * shear, epsilon = 1e-9);
        assert_relative_eq!(askew.at(row, "traction_s"), -0.8 * shear, epsilon = 1e-9);
    }
}

#[test]
fn mistakes_are_told_at_their_place() {
    let driver = |hypothesis: &str, control: &str| {
        let start = joint(hypothesis, 0.0);
        format!("{start}[[segment]]\nincrements = 1\ncontrol = {{ {control} }}")
    };
    let three = driver("interface_3d", "");
    let two = driver("interface_2d", "s = { jump = 1e-3 }");
    let strain = driver("interface_3d", "s = { strain = 1e-3 }");
    let stress = edited(&three, &["traction = => stress ="]);
    let mepi = edited(&three, &["coulomb_joint => mepi"]);
    for ([said, words], text) in rows_of(
        "
there is no component `s` under interface_2d | components: n, t
component `s` cannot be controlled by `strain` under interface_3d | jump, traction, stiffness
under interface_3d the initial state is a traction | components n, t, s
interface_3d | interface_2d
",
    )
    .into_iter()
    .zip([two, strain, stress, mepi])
    {
        let run = attempt(&text);
        let message = format!("{} {:?}", run.error(), run.error());
        for words in [said, words] {
            assert!(message.contains(words), "{message}");
        }
    }
}
