//! Why a problem cannot be computed: what is wrong, and with which part of it.

use crate::problem::{Analysis, Axis, Formulation};
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
    /// The quantity that may end a phase.
    Until(usize),
    /// The strain that a phase gives a group.
    Strain(usize, usize),
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
    NoValue(&'static str, String, Analysis),
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
    /// A phase that may end before its time changes this, which is there at once or not at all.
    UntilBeside(&'static str),
    /// An interface without thickness has no strain.
    StrainOfInterface(String),
    /// Strains of groups under arc-length control.
    StrainUnderArcLength,
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
        /// The `ocr` that gives them, K_0, and the passive ratio of the friction angle beside it, if K_0 exceeds this.
        unloading: Option<[f64; 3]>,
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

/// As data: the words are those of whoever knows where the problem comes from.
impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?} does not fit: {:?}", self.item, self.cause)
    }
}

impl std::error::Error for Refusal {}
