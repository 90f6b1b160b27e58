//! Why a problem cannot be computed, in the words of a case file: a sentence for each cause, and what the user could
//! do, if that is known.

use mechanics::check::{Cause, JointFault, Key, LONGEST};
use mechanics::problem::{Analysis, Axis, Formulation};
use text::suggestion;

/// Makes a function of a table with one row for each cause: its pattern, a sentence, and a hint, if there is one.
macro_rules! table {
    ($($pattern:pat => ($($words:tt)+) $(hint ($($hint:tt)+))?;)+) => {
        /// The sentence for a cause, and a hint.
        #[allow(clippy::useless_format, reason = "some sentences hold no values")]
        pub(crate) fn words(cause: &Cause) -> (String, Option<String>) {
            match cause {
                $($pattern => (
                    format!($($words)+),
                    None::<String>$(.or_else(|| Some(format!($($hint)+))))?,
                ),)+
            }
        }
    };
}

table! {
    Cause::NoPhase => ("there is no [[phase]]");
    Cause::PhaseWithoutName => ("a phase needs a name");
    Cause::TwoPhases(name) => ("two phases are called `{name}`");
    Cause::Increments(n) => ("`increments` is {n}, expected 1 to 10000000");
    Cause::NoLine { name, known } => ("there is no line `{name}`")
        hint ("{}", suggestion(name, known.iter().map(String::as_str).collect::<Vec<_>>()));
    Cause::NoGroup(number) => ("there is no group with the number {number}");
    Cause::TwoPressures(line) => ("line `{line}` has two pressures in this phase");
    Cause::NoBoundary(line) => ("a pressure needs a boundary, line `{line}` is not");
    Cause::LostPressure(line) => (
        "the pressure on line `{line}` has no effect: its displacement against it is held or prescribed as long as \
         it lasts")
        hint (
        "leave the pressure or the displacement out, or give up a displacement of an earlier phase with `free`; \
         `reaction_…` of the line is what it takes to hold it");
    Cause::NoElements(group) => ("no element belongs to group `{group}`");
    Cause::LayerOfTriangles(group) => (
        "group `{group}` is a thin layer, which is made of quads, and has triangles");
    Cause::TooFewPoints(group, n) => (
        "`integration`: elements of group `{group}` have {n} nodes, and with `reduced` nothing resists some of their \
         motions")
        hint ("choose `projected` or `full`, or elements of 8 nodes");
    Cause::Misplaced(key, formulation) => (
        "{} does not go with the formulation `{}`", name(*key), formulation.name());
    Cause::AtRestInInterface(formulation) => (
        "`initial_stress`: earth pressure at rest (`k_0`, `ocr`, …) is that of `solid` groups, not of the \
         formulation `{}`", formulation.name())
        hint ("{}", instead_of_rest(*formulation));
    Cause::BadShape(group) => (
        "an element of group `{group}` is degenerate or reaches the other side of the axis");
    Cause::NormalAlong { group, extent: [width, height], other } => (
        "`normal`: group `{group}` is {width:.6} by {height:.6} m, its longer side would be its thickness")
        hint (
        "the normal goes across the layer: `normal = \"{}\"`, or leave it out", other.name(Analysis::PlaneStrain));
    Cause::WhichWayAcross { group, sides: [xi, eta] } => (
        "an element of group `{group}` is {xi:.6} by {eta:.6} m: which way is across the layer?")
        hint ("say `normal = \"x\"` or `normal = \"y\"` for the group");
    Cause::TurnedSigns { group, material, refusal } => (
        "`initial_stress` of group `{group}`: law `{material}` cannot stand it: {refusal}")
        hint ("tension is positive: compression is written as a negative number");
    Cause::ImpossibleLayer([k_n, k_t]) => (
        "a thin layer needs K_n > 4/3 K_t for its elasticity along the layer (E* > 0, equation 18): \
         K_n = {k_n:.6e}, K_t = {k_t:.6e} kPa/m")
        hint ("raise the normal stiffness, or set `in_plane = \"none\"` for the group");
    Cause::LocalAxes { law, group } => (
        "law `{law}` works in axes of a layer, the formulation `solid` of group `{group}` has none")
        hint ("use the formulation `thin_layer`");
    Cause::OtherHypothesis { material, built, needed } => (
        "material `{material}` was built for {built}, its group needs {needed}");
    Cause::NoComponents { line, is_free: true } => ("`free` of line `{line}`: `components` is empty");
    Cause::NoComponents { line, is_free: false } => ("`fixed` is empty for line `{line}`");
    Cause::NothingHolds(line, axis) => ("`free` of line `{line}`: nothing holds it in {axis}");
    Cause::FreeForNothing { line, axis, by } => (
        "`free` of line `{line}` has no effect in {axis}: in the same phase `displacement` of line `{by}` \
         prescribes it")
        hint ("leave one of the two out; a displacement stays until a phase frees it");
    Cause::NoValue(what, line, analysis) => ("the {what} of line `{line}` has no value")
        hint ("give `{}`, `{}`, or both", Axis::X.name(*analysis), Axis::Y.name(*analysis));
    Cause::HasSupport { line, at: [x, y], axis } => (
        "the node at ({x}, {y}) of line `{line}` has a support in {axis}")
        hint ("a support holds it at 0 throughout, unless a phase frees it");
    Cause::TwoDisplacements { lines: [line, other], at: [x, y], axis, values: [value, earlier] } => (
        "the node at ({x}, {y}) of line `{line}` gets {value} m in {axis}, and {earlier} m by line `{other}`");
    Cause::Tied { phase, at: [x, y] } => (
        "phase `{phase}`: the node at ({x}, {y}) in the middle of a layer with `integration = \"mean\"` follows the \
         layer's faces and cannot be held alone")
        hint ("hold the nodes on both faces too, or leave this one free");
    Cause::MovesAlike([x, y], [a, b]) => (
        "the node at ({x}, {y}) moves alike with others that are prescribed differently: by {a} and {b} m in this \
         phase, and not to one place; `reset_displacements` in this phase counts both from here");
    Cause::TwoGroups(name) => ("two groups are called `{name}`");
    Cause::GivenTwice(what, group) => ("group `{group}` gets {what} twice in this phase");
    Cause::Setting(name, value, [least, most]) => ("`{name}` is {value:?}, outside [{least:?}, {most:?}]");
    Cause::BadJoint { group, at: [x, y], fault } => (
        "a zero-thickness element of group `{group}` at ({x:.6}, {y:.6}) {}", defect(*fault));
    Cause::FaceGone { interface, solid, at: [x, y] } => (
        "interface `{interface}` is active and the ground on one of its sides, group `{solid}`, is not: nothing \
         holds that side, at ({x:.4}, {y:.4})")
        hint (
        "an interface goes with the ground beside it: `deactivate` has `{interface}` too, or `activate` has it \
         with the ground");
    Cause::NotFinite(what) => ("{what} is not a finite number");
    Cause::OutOfBounds(what, value, bounds) => ("{what} is {value}, expected {bounds}");
    Cause::AlreadySo { group, is_active: true } => ("group `{group}` is already active when this phase starts")
        hint ("an earlier phase activates it, or it lacks `active = false`");
    Cause::AlreadySo { group, is_active: false } => ("group `{group}` is not active when this phase starts");
    Cause::BothWays(group) => ("group `{group}` is activated and deactivated in one phase");
    Cause::NothingThere(phase) => ("no group is active in phase `{phase}`");
    Cause::TwoForces(line) => ("line `{line}` has two forces in this phase");
    Cause::NotThere(line) => ("line `{line}` lies on elements that are not active in this phase");
    Cause::BadTime(time) => (
        "`time` is {time}, expected above 0 and at most {LONGEST:e}: how long the phase takes");
    Cause::BadCourse => ("a `course` leads from [0, 0] to time 1: pairs [time, factor] with rising times");
    Cause::CourseOfArcLength => ("a `course` has a time of its own, arc-length control another");
    Cause::UntilBeside(key) => (
        "`until` may end this phase before its time, and `{key}` would be left half done")
        hint ("give `{key}` a phase of its own before this one");
    Cause::StrainOfInterface(group) => ("group `{group}` has no thickness, and so no strain")
        hint ("give the strain to the ground or the pile beside it");
    Cause::StrainUnderArcLength => (
        "`strain` follows the course of the phase, and arc-length control leads it along another")
        hint ("`control = \"auto\"` in [solver]");
    Cause::NoWater => ("this phase changes the water, and there is none");
    Cause::AtRestOutsideStrength {
        group, material, at: [x, y], stress: [h, v], returned: [r_h, r_v], unloading
    } => (
        "the earth pressure at rest of group `{group}` is outside the strength of law `{material}`: at \
         ({x:.4}, {y:.4}) horizontal {h:.4}, vertical {v:.4} kPa, where the law returns {r_h:.4} and {r_v:.4}")
        hint ("{}", less_at_rest(*unloading));
    Cause::TensionAtRest { at: [x, y], stress: [h, v] } => (
        "the earth pressure at rest is tension: at ({x:.4}, {y:.4}) horizontal {h:.4}, vertical {v:.4} kPa")
        hint ("with much unloading (`ocr`, `pop`) a smaller `poisson_ratio`, or give `k_0` itself");
    Cause::LiftedAtRest { at: [x, y], above, pore } => (
        "the vertical effective stress at rest is tensile at ({x:.4}, {y:.4}): the ground above and the surcharge \
         weigh {above:.4} kPa, the pore pressure is {pore:.4} kPa")
        hint (
        "check the weights of ground in kN/m³ (`saturated_unit_weight` is total, not buoyant), those of the water \
         and its `level`, and the sign of `surcharge` (positive presses down)");
    Cause::UndrainedWithoutWater(group) => (
        "group `{group}` is undrained in some phase and has no water in its pores (`pore_water = false`)");
    Cause::RigidInterface(line) => (
        "line `{line}`, which carries interface elements, would be rigid on both of their faces, and nothing could \
         slip or open there");
    Cause::LostForce(line, axis) => (
        "the force on line `{line}` has no effect in {axis}: the line is held there, or its displacement is \
         prescribed, throughout")
        hint (
        "`free = [{{ line = \"{line}\", components = [\"{axis}\"] }}]` in this phase gives up a support or a displacement \
         of an earlier phase; a displacement of this phase must be left out; `reaction_{axis}` of the line is what it \
         takes to hold it");
    Cause::NoPoreStiffness { group, undrained, drained } => (
        "group `{group}`: `undrained_poisson_ratio` {undrained} does not exceed Poisson's ratio of its law, \
         {drained:.4}, so its pore water would have no stiffness");
    Cause::OtherElements(group, formulation) => (
        "group `{group}` has elements that are not of its formulation `{}`", formulation.name());
    Cause::OutOfRange(what) => ("{what} refers to what there is not");
    Cause::OnInterface(what, line) => (
        "a {what} on line `{line}`, which carries interface elements, would {}", on_faces(what))
        hint ("name a line that belongs to the pile or to the ground alone");
    Cause::Loose { phase, part, axis } => (
        "phase `{phase}`: nothing holds {} {}", loose_part(part.as_ref()), direction(*axis))
        hint ("hold a line with [[supports]], or prescribe its displacement");
}

/// How a sentence names a key of a group.
fn name(key: Key) -> &'static str {
    match key {
        Key::Integration => "this `integration`",
        Key::Normal => "`normal`",
        Key::InPlane => "`in_plane`",
        Key::InitialStress => "`initial_stress`",
        Key::UnitWeight => "`unit_weight`",
        Key::Drainage => "`drainage`",
        Key::UndrainedPoissonRatio => "`undrained_poisson_ratio`",
    }
}

fn less_at_rest(unloading: Option<[f64; 3]>) -> String {
    match unloading {
        Some([ocr, k_0, passive]) => format!(
            "`ocr` = {ocr} gives K_0 = {k_0:.2}, beyond the passive ratio {passive:.2}: reduce `ocr`"
        ),
        None => "choose K_0 between the ratios of active and passive pressure; near the surface some cohesion also helps"
            .to_owned(),
    }
}

fn instead_of_rest(formulation: Formulation) -> &'static str {
    match formulation {
        Formulation::ThinLayer => {
            "give its stresses: `stress_11`, `stress_22`, `stress_33`, each a number or values over the height"
        }
        _ => "leave it out: an interface starts with the stress of the ground beside it",
    }
}

fn defect(fault: JointFault) -> &'static str {
    match fault {
        JointFault::NoLength => "has no length",
        JointFault::Apart => "has faces that are not at the same places",
        JointFault::Turned => "is turned: its minus side has the element of greater coordinates",
        JointFault::OnAxis => "lies along the axis of symmetry, where nothing is on its other side",
    }
}

fn on_faces(what: &str) -> &'static str {
    match what {
        "pressure" => "act on one of their faces only",
        "force" => "act on both of their faces, half of it on each",
        _ => "hold both of their faces, and nothing could slip or open there",
    }
}

fn loose_part(part: Option<&(Vec<String>, [f64; 2])>) -> String {
    let Some((groups, [x, y])) = part else {
        return "the model".to_owned();
    };
    let names: Vec<String> = groups.iter().map(|name| format!("`{name}`")).collect();
    let groups = if names.len() == 1 { "group" } else { "groups" };
    format!(
        "{groups} {} around ({x:.4}, {y:.4}), which touches nothing else,",
        names.join(", ")
    )
}

fn direction(axis: Option<&str>) -> String {
    axis.map_or("against turning".to_owned(), |axis| format!("in {axis}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hints_say_what_to_write() {
        let hint = |cause: &Cause| words(cause).1.unwrap_or_default();
        let gone = Cause::FaceGone {
            interface: "joint".to_owned(),
            solid: "upper".to_owned(),
            at: [0.0, 1.0],
        };
        assert!(hint(&gone).contains("`deactivate` has `joint` too"));
        let lost = Cause::LostForce("head".to_owned(), "z");
        assert!(hint(&lost).starts_with("`free = [{ line = \"head\", components = [\"z\"] }]`"));
        assert_eq!(words(&Cause::NoPhase).1, None);
    }

    #[test]
    fn parts_that_nothing_holds_are_named() {
        let loose = |groups: &[&str], axis| {
            let names = groups.iter().map(|&name| name.to_owned()).collect();
            let cause = Cause::Loose {
                phase: "push".to_owned(),
                part: (!groups.is_empty()).then_some((names, [1.0, 2.0])),
                axis,
            };
            words(&cause).0
        };
        assert_eq!(
            loose(&[], Some("x")),
            "phase `push`: nothing holds the model in x"
        );
        assert_eq!(
            loose(&["a", "b"], None),
            "phase `push`: nothing holds groups `a`, `b` around (1.0000, 2.0000), which touches nothing else, against \
             turning"
        );
    }
}
