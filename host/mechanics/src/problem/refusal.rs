//! Why a problem cannot be computed: what is wrong, and with which part of it.

use super::check::LONGEST;
use super::{Analysis, Axis, Formulation};
use std::fmt;

/// A part of a problem, by number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Item {
    /// All of it.
    Problem,
    /// A group.
    Group(usize),
    /// The value of this key of a group.
    GroupKey(usize, Key),
    /// The law of a group: its own, or that of a phase.
    LawOf {
        /// The group.
        group: usize,
        /// The phase, if it is not the group's own.
        phase: Option<usize>,
    },
    /// A material, by name.
    Material(String),
    /// A support.
    Support(usize),
    /// A phase.
    Phase(usize),
    /// A prescribed displacement of a phase.
    Displacement(usize, usize),
    /// A displacement that a phase frees.
    Free(usize, usize),
    /// A pressure of a phase.
    Pressure(usize, usize),
    /// A force of a phase.
    Force(usize, usize),
    /// A line that a phase makes rigid.
    Rigid(usize, usize),
    /// The course of a phase.
    Course(usize),
    /// The time of a phase.
    Time(usize),
    /// A group that a phase activates or deactivates.
    Activation {
        /// The phase.
        phase: usize,
        /// The group.
        group: usize,
        /// It is activated; else deactivated.
        is_activated: bool,
    },
    /// The unit weight that a phase gives a group.
    UnitWeight(usize, usize),
    /// The drainage that a phase gives a group.
    DrainageOf(usize, usize),
    /// The water, or what a phase makes of it.
    Water(Option<usize>),
}

/// A key of a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// The integration points.
    Integration,
    /// Direction across a layer.
    Normal,
    /// Elasticity along a layer.
    InPlane,
    /// Stress before the first phase.
    InitialStress,
    /// Weight of the ground.
    UnitWeight,
    /// Whether pore water leaves.
    Drainage,
    /// Poisson's ratio of ground whose water does not leave.
    UndrainedPoissonRatio,
}

/// A part of a problem that does not fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// Which.
    pub item: Item,
    /// Why.
    pub cause: Cause,
}

impl Refusal {
    pub(crate) fn new(item: Item, cause: Cause) -> Self {
        Self { item, cause }
    }
}

/// Defect of a zero-thickness element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointFault {
    /// Its ends are one.
    NoLength,
    /// Its faces are not at the same places.
    Apart,
    /// Minus is on the side of greater coordinates.
    Turned,
    /// It lies along the axis of symmetry.
    OnAxis,
}

/// Why a part of a problem does not fit.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// There is no phase.
    NoPhase,
    /// A phase is called nothing.
    PhaseWithoutName,
    /// Two phases have one name.
    TwoPhases(String),
    /// A number of increments that cannot be meant.
    Increments(usize),
    /// There is no such line; there are these.
    NoLine {
        /// The one that was asked for.
        name: String,
        /// Those that there are.
        known: Vec<String>,
    },
    /// An element or a phase names a group that there is not.
    NoGroup(usize),
    /// A line has two pressures in one phase.
    TwoPressures(String),
    /// A line under pressure is no boundary.
    NoBoundary(String),
    /// A pressure acts on nodes that are held against it.
    LostPressure(String),
    /// A group has no elements.
    NoElements(String),
    /// A thin layer has elements that are no quads.
    LayerOfTriangles(String),
    /// Elements of so many nodes need more integration points.
    TooFewPoints(String, usize),
    /// Something that does not go with the formulation.
    Misplaced(Key, Formulation),
    /// Earth pressure at rest in an interface.
    AtRestInInterface(Formulation),
    /// An element is degenerate or reaches the other side of the axis.
    BadShape(String),
    /// A layer whose normal goes along it; sizes in m.
    NormalAlong {
        /// The group.
        group: String,
        /// Extent in x and y.
        extent: [f64; 2],
        /// The other direction.
        other: Axis,
    },
    /// A layer element whose shape does not say which way is across.
    WhichWayAcross {
        /// The group.
        group: String,
        /// Its two sides.
        sides: [f64; 2],
    },
    /// An initial stress that the law stands only with compression negative.
    TurnedSigns {
        /// The group.
        group: String,
        /// Its material.
        material: String,
        /// What the law says.
        refusal: String,
    },
    /// A layer's stiffness K_n ≤ 4/3 K_t, kPa/m.
    ImpossibleLayer([f64; 2]),
    /// A law in axes of a layer for solids.
    LocalAxes {
        /// The law.
        law: String,
        /// The group.
        group: String,
    },
    /// A law that was built for another hypothesis than the group's.
    OtherHypothesis {
        /// The material.
        material: String,
        /// What it was built for.
        built: &'static str,
        /// What the group needs.
        needed: &'static str,
    },
    /// A support, or freed displacements, without components.
    NoComponents {
        /// The line.
        line: String,
        /// A displacement that is freed.
        is_free: bool,
    },
    /// A displacement is freed that nothing holds, in this direction.
    NothingHolds(String, &'static str),
    /// A displacement is freed and prescribed at once.
    FreeForNothing {
        /// The line that is freed.
        line: String,
        /// The direction.
        axis: &'static str,
        /// The line that prescribes it.
        by: String,
    },
    /// A displacement without a value.
    NoValue(String, Analysis),
    /// A displacement where a support holds.
    HasSupport {
        /// The line.
        line: String,
        /// The node.
        at: [f64; 2],
        /// The direction.
        axis: &'static str,
    },
    /// Two displacements of one node.
    TwoDisplacements {
        /// The lines.
        lines: [String; 2],
        /// The node.
        at: [f64; 2],
        /// The direction.
        axis: &'static str,
        /// What they prescribe, m.
        values: [f64; 2],
    },
    /// The middle of a layer with mean strain is held alone.
    Tied {
        /// The phase.
        phase: String,
        /// The node.
        at: [f64; 2],
    },
    /// Displacements that move alike are prescribed to move differently: a node, and two increments, m.
    MovesAlike([f64; 2], [f64; 2]),
    /// Two groups have one name.
    TwoGroups(String),
    /// A phase gives a group this twice.
    GivenTwice(&'static str, String),
    /// A setting outside its bounds: its name, its value, and they.
    Setting(&'static str, f64, [f64; 2]),
    /// A zero-thickness element that cannot be one, and its middle.
    BadJoint {
        /// The group.
        group: String,
        /// Where.
        at: [f64; 2],
        /// The defect.
        fault: JointFault,
    },
    /// An interface is there and the ground on one of its sides is not.
    FaceGone {
        /// The interface.
        interface: String,
        /// The inactive group.
        solid: String,
        /// Where, m.
        at: [f64; 2],
    },
    /// A number that is NaN or infinite.
    NotFinite(&'static str),
    /// A number outside its bounds, and what they are.
    OutOfBounds(&'static str, f64, &'static str),
    /// A group that is there already, or not there, cannot be activated, or deactivated.
    AlreadySo {
        /// The group.
        group: String,
        /// It is there.
        is_active: bool,
    },
    /// A group is activated and deactivated in one phase.
    BothWays(String),
    /// No group is active in a phase.
    NothingThere(String),
    /// A line has two forces in one phase.
    TwoForces(String),
    /// A line lies on elements that are not there.
    NotThere(String),
    /// A phase that takes no time, or none that can be meant.
    BadTime(f64),
    /// A course that does not lead from (0, 0) to time 1.
    BadCourse,
    /// A course under arc-length control, which has its own time.
    CourseOfArcLength,
    /// A phase changes the water of a problem without water.
    NoWater,
    /// Earth pressure at rest that the law cannot carry.
    AtRestOutsideStrength {
        /// The group.
        group: String,
        /// The material.
        material: String,
        /// Where.
        at: [f64; 2],
        /// σ'_h and σ'_v there, compression positive.
        stress: [f64; 2],
        /// What the law makes of them.
        returned: [f64; 2],
    },
    /// Earth pressure at rest that would be tension.
    TensionAtRest {
        /// Where.
        at: [f64; 2],
        /// σ'_h and σ'_v there, compression positive.
        stress: [f64; 2],
    },
    /// Water lifts ground at rest.
    LiftedAtRest {
        /// Where.
        at: [f64; 2],
        /// The overburden, kPa.
        above: f64,
        /// Pressure in the pores, kPa.
        pore: f64,
    },
    /// Undrained ground without water in its pores.
    UndrainedWithoutWater(String),
    /// A rigid line along an interface would tie its two faces.
    RigidInterface(String),
    /// A force on a line that is held against it, and its direction.
    LostForce(String, &'static str),
    /// ν_u of undrained ground does not exceed ν of its law.
    NoPoreStiffness {
        /// The group.
        group: String,
        /// ν_u.
        undrained: f64,
        /// ν of the law.
        drained: f64,
    },
    /// A joint in a group that is not one of zero-thickness elements, or a solid in one that is.
    OtherElements(String, Formulation),
    /// An element or a line refers to what there is not.
    OutOfRange(&'static str),
    /// This (a pressure, force, displacement or support) of a line along which an interface stands: which face is
    /// meant?
    OnInterface(&'static str, String),
    /// A part of the model is not held.
    Loose {
        /// The phase.
        phase: String,
        /// Groups of the part and its middle; `None`: it is the whole model.
        part: Option<(Vec<String>, [f64; 2])>,
        /// The direction, or `None` for a rotation.
        axis: Option<&'static str>,
    },
}

impl Key {
    fn name(self) -> &'static str {
        match self {
            Self::Integration => "this `integration`",
            Self::Normal => "`normal`",
            Self::InPlane => "`in_plane`",
            Self::InitialStress => "`initial_stress`",
            Self::UnitWeight => "`unit_weight`",
            Self::Drainage => "`drainage`",
            Self::UndrainedPoissonRatio => "`undrained_poisson_ratio`",
        }
    }
}

impl fmt::Display for Cause {
    #[expect(clippy::too_many_lines, reason = "one sentence for each")]
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoPhase => write!(f, "there is no [[phase]]"),
            Self::PhaseWithoutName => write!(f, "a phase needs a name"),
            Self::TwoPhases(name) => write!(f, "two phases are called `{name}`"),
            Self::Increments(n) => write!(f, "`increments` is {n}, expected 1 to 10000000"),
            Self::NoLine { name, .. } => write!(f, "there is no line `{name}`"),
            Self::NoGroup(number) => write!(f, "there is no group with the number {number}"),
            Self::TwoPressures(line) => {
                write!(f, "line `{line}` has two pressures in this phase")
            }
            Self::NoBoundary(line) => {
                write!(f, "a pressure needs a boundary, line `{line}` is not")
            }
            Self::LostPressure(line) => write!(
                f,
                "the pressure on line `{line}` has no effect: its displacement against it is held \
                 or prescribed as long as it lasts"
            ),
            Self::NoElements(group) => write!(f, "no element belongs to group `{group}`"),
            Self::LayerOfTriangles(group) => write!(
                f,
                "group `{group}` is a thin layer, which is made of quads, and has triangles"
            ),
            Self::TooFewPoints(group, n) => write!(
                f,
                "`integration`: elements of group `{group}` have {n} nodes, and with `reduced` nothing resists some of \
                 their motions"
            ),
            Self::Misplaced(key, formulation) => write!(
                f,
                "{} does not go with the formulation `{}`",
                key.name(),
                formulation.name()
            ),
            Self::AtRestInInterface(formulation) => write!(
                f,
                "`initial_stress`: earth pressure at rest (`k_0`, `ocr`, …) is that of `solid` groups, not of the \
                 formulation `{}`",
                formulation.name()
            ),
            Self::BadShape(group) => write!(
                f,
                "an element of group `{group}` is degenerate or reaches the other side of the axis"
            ),
            Self::NormalAlong {
                group,
                extent: [width, height],
                ..
            } => write!(
                f,
                "`normal`: group `{group}` is {width:.6} by {height:.6} m, its longer side would be \
                 its thickness"
            ),
            Self::WhichWayAcross {
                group,
                sides: [xi, eta],
            } => write!(
                f,
                "an element of group `{group}` is {xi:.6} by {eta:.6} m: which way is across the \
                 layer?"
            ),
            Self::TurnedSigns {
                group,
                material,
                refusal,
            } => write!(
                f,
                "`initial_stress` of group `{group}`: law `{material}` cannot stand it: {refusal}"
            ),
            Self::ImpossibleLayer([k_n, k_t]) => write!(
                f,
                "a thin layer needs K_n > 4/3 K_t for its elasticity along the layer (E* > 0, \
                 equation 18): K_n = {k_n:.6e}, K_t = {k_t:.6e} kPa/m"
            ),
            Self::LocalAxes { law, group } => write!(
                f,
                "law `{law}` works in axes of a layer, the formulation `solid` of group `{group}` \
                 has none"
            ),
            Self::OtherHypothesis {
                material,
                built,
                needed,
            } => write!(
                f,
                "material `{material}` was built for {built}, its group needs {needed}"
            ),
            Self::NoComponents { line, is_free } => {
                if *is_free {
                    write!(f, "`free` of line `{line}`: `components` is empty")
                } else {
                    write!(f, "`fixed` is empty for line `{line}`")
                }
            }
            Self::NothingHolds(line, axis) => {
                write!(f, "`free` of line `{line}`: nothing holds it in {axis}")
            }
            Self::FreeForNothing { line, axis, by } => write!(
                f,
                "`free` of line `{line}` has no effect in {axis}: in the same phase `displacement` \
                 of line `{by}` prescribes it"
            ),
            Self::NoValue(line, _) => write!(f, "the displacement of line `{line}` has no value"),
            Self::HasSupport {
                line,
                at: [x, y],
                axis,
            } => write!(
                f,
                "the node at ({x}, {y}) of line `{line}` has a support in {axis}"
            ),
            Self::TwoDisplacements {
                lines: [line, other],
                at: [x, y],
                axis,
                values: [value, earlier],
            } => write!(
                f,
                "the node at ({x}, {y}) of line `{line}` gets {value} m in {axis}, and {earlier} m \
                 by line `{other}`"
            ),
            Self::Tied { phase, at: [x, y] } => write!(
                f,
                "phase `{phase}`: the node at ({x}, {y}) in the middle of a layer with \
                 `integration = \"mean\"` follows the layer's faces and cannot be held alone"
            ),
            Self::MovesAlike([x, y], [a, b]) => write!(
                f,
                "the node at ({x}, {y}) moves alike with others that are prescribed differently: by \
                 {a} and {b} m in this phase, and not to one place; `reset_displacements` in this phase counts both from here"
            ),
            Self::TwoGroups(name) => write!(f, "two groups are called `{name}`"),
            Self::GivenTwice(what, group) => {
                write!(f, "group `{group}` gets {what} twice in this phase")
            }
            Self::Setting(name, value, [least, most]) => {
                write!(f, "`{name}` is {value:?}, outside [{least:?}, {most:?}]")
            }
            Self::BadJoint {
                group,
                at: [x, y],
                fault,
            } => write!(
                f,
                "a zero-thickness element of group `{group}` at ({x:.6}, {y:.6}) {}",
                match fault {
                    JointFault::NoLength => "has no length",
                    JointFault::Apart => "has faces that are not at the same places",
                    JointFault::Turned =>
                        "is turned: its minus side has the element of greater coordinates",
                    JointFault::OnAxis =>
                        "lies along the axis of symmetry, where nothing is on its other side",
                }
            ),
            Self::FaceGone {
                interface,
                solid,
                at: [x, y],
            } => write!(
                f,
                "interface `{interface}` is active and the ground on one of its sides, group `{solid}`, \
                 is not: nothing holds that side, at ({x:.4}, {y:.4})"
            ),
            Self::NotFinite(what) => write!(f, "{what} is not a finite number"),
            Self::OutOfBounds(what, value, bounds) => {
                write!(f, "{what} is {value}, expected {bounds}")
            }
            Self::AlreadySo { group, is_active } => write!(
                f,
                "group `{group}` is {} when this phase starts",
                if *is_active {
                    "already active"
                } else {
                    "not active"
                }
            ),
            Self::BothWays(group) => {
                write!(
                    f,
                    "group `{group}` is activated and deactivated in one phase"
                )
            }
            Self::NothingThere(phase) => write!(f, "no group is active in phase `{phase}`"),
            Self::TwoForces(line) => write!(f, "line `{line}` has two forces in this phase"),
            Self::NotThere(line) => {
                write!(
                    f,
                    "line `{line}` lies on elements that are not active in this phase"
                )
            }
            Self::BadTime(time) => write!(
                f,
                "`time` is {time}, expected above 0 and at most {LONGEST:e}: how long the phase takes"
            ),
            Self::BadCourse => write!(
                f,
                "a `course` leads from [0, 0] to time 1: pairs [time, factor] with rising times"
            ),
            Self::CourseOfArcLength => {
                write!(
                    f,
                    "a `course` has a time of its own, arc-length control another"
                )
            }
            Self::NoWater => write!(f, "this phase changes the water, and there is none"),
            Self::AtRestOutsideStrength {
                group,
                material,
                at: [x, y],
                stress: [h, v],
                returned: [r_h, r_v],
            } => write!(
                f,
                "the earth pressure at rest of group `{group}` is outside the strength of law \
                 `{material}`: at ({x:.4}, {y:.4}) horizontal {h:.4}, vertical {v:.4} kPa, where the \
                 law returns {r_h:.4} and {r_v:.4}"
            ),
            Self::TensionAtRest {
                at: [x, y],
                stress: [h, v],
            } => write!(
                f,
                "the earth pressure at rest is tension: at ({x:.4}, {y:.4}) horizontal {h:.4}, vertical \
                 {v:.4} kPa"
            ),
            Self::LiftedAtRest {
                at: [x, y],
                above,
                pore,
            } => write!(
                f,
                "the vertical effective stress at rest is tensile at ({x:.4}, {y:.4}): the ground above and the surcharge weigh \
                 {above:.4} kPa, the pore pressure is {pore:.4} kPa"
            ),
            Self::UndrainedWithoutWater(group) => write!(
                f,
                "group `{group}` is undrained in some phase and has no water in its pores (`pore_water = false`)"
            ),
            Self::RigidInterface(line) => write!(
                f,
                "line `{line}`, which carries interface elements, would be rigid on both of their \
                 faces, and nothing could slip or open there"
            ),
            Self::LostForce(line, axis) => write!(
                f,
                "the force on line `{line}` has no effect in {axis}: the line is held there, or its displacement is prescribed, \
                 throughout"
            ),
            Self::NoPoreStiffness {
                group,
                undrained,
                drained,
            } => write!(
                f,
                "group `{group}`: `undrained_poisson_ratio` {undrained} does not exceed Poisson's ratio of \
                 its law, {drained:.4}, so its pore water would have no stiffness"
            ),
            Self::OtherElements(group, formulation) => write!(
                f,
                "group `{group}` has elements that are not of its formulation `{}`",
                formulation.name()
            ),
            Self::OutOfRange(what) => write!(f, "{what} refers to what there is not"),
            Self::OnInterface(what, line) => write!(
                f,
                "a {what} on line `{line}`, which carries interface elements, would {}",
                match *what {
                    "pressure" => "act on one of their faces only",
                    "force" => "act on both of their faces, half of it on each",
                    _ => "hold both of their faces, and nothing could slip or open there",
                }
            ),
            Self::Loose { phase, part, axis } => {
                write!(f, "phase `{phase}`: nothing holds ")?;
                match part {
                    None => write!(f, "the model ")?,
                    Some((groups, [x, y])) => {
                        let names: Vec<String> =
                            groups.iter().map(|name| format!("`{name}`")).collect();
                        let groups = if names.len() == 1 { "group" } else { "groups" };
                        write!(
                            f,
                            "{groups} {} around ({x:.4}, {y:.4}), which touches nothing else, ",
                            names.join(", ")
                        )?;
                    }
                }
                match axis {
                    Some(axis) => write!(f, "in {axis}"),
                    None => write!(f, "against turning"),
                }
            }
        }
    }
}

impl Cause {
    /// A hint for the user, if one is known.
    pub fn hint(&self) -> Option<String> {
        let hint = match self {
            Self::LostPressure(_) => {
                "leave the pressure or the displacement out, or give the displacement up with `free`; `reaction_…` of \
                 the line is what it takes to hold it"
            }
            Self::FaceGone { interface, .. } => {
                return Some(format!(
                    "an interface goes with the ground beside it: `deactivate` has `{interface}` too, or \
                     `activate` has it with the ground"
                ));
            }
            Self::NormalAlong { other, .. } => {
                let other = other.name(Analysis::PlaneStrain);
                return Some(format!(
                    "the normal goes across the layer: `normal = \"{other}\"`, or leave it out"
                ));
            }
            Self::TooFewPoints(..) => "choose `projected` or `full`, or elements of 8 nodes",
            Self::WhichWayAcross { .. } => "say `normal = \"x\"` or `normal = \"y\"` for the group",
            Self::TurnedSigns { .. } => {
                "tension is positive: compression is written as a negative number"
            }
            Self::ImpossibleLayer(_) => {
                "raise the normal stiffness, or set `in_plane = \"none\"` for the group"
            }
            Self::AtRestInInterface(Formulation::ThinLayer) => {
                "give its stresses: `stress_11`, `stress_22`, `stress_33`, each a number or values over the height"
            }
            Self::AtRestInInterface(_) => {
                "leave it out: an interface starts with the stress of the ground beside it"
            }
            Self::AtRestOutsideStrength { .. } => {
                "choose K_0 between the ratios of active and passive pressure; near the surface some cohesion also helps"
            }
            Self::LiftedAtRest { .. } => {
                "check the weights of ground in kN/m³ (`saturated_unit_weight` is total, not buoyant), those of the water and its `level`, and the sign of `surcharge` (positive presses down)"
            }
            Self::LostForce(line, axis) => {
                return Some(format!(
                    "`free = [{{ line = \"{line}\", components = [\"{axis}\"] }}]` in this phase gives the displacement up; \
                     `reaction_{axis}` of the line is what it takes to hold it"
                ));
            }
            Self::OnInterface(..) => "name a line that belongs to the pile or to the ground alone",
            Self::TensionAtRest { .. } => {
                "with much unloading (`ocr`, `pop`) a smaller `poisson_ratio`, or give `k_0` itself"
            }
            Self::AlreadySo {
                is_active: true, ..
            } => "an earlier phase activates it, or it lacks `active = false`",
            Self::LocalAxes { .. } => "use the formulation `thin_layer`",
            Self::FreeForNothing { .. } => {
                "leave one of the two out; a displacement stays until a phase frees it"
            }
            Self::NoValue(_, analysis) => {
                let [x, y] = [Axis::X, Axis::Y].map(|axis| axis.name(*analysis));
                return Some(format!("give `{x}`, `{y}`, or both"));
            }
            Self::HasSupport { .. } => {
                "a support holds it at 0 throughout, unless a phase frees it"
            }
            Self::Tied { .. } => "hold the nodes on both faces too, or leave this one free",
            Self::Loose { .. } => "hold a line with [[supports]], or prescribe its displacement",
            _ => return None,
        };
        Some(hint.to_owned())
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.cause.fmt(f)
    }
}

impl std::error::Error for Refusal {}
