//! A group of elements with its law: committed and trial state of every integration point.
//!
//! An increment starts from the committed state; every iteration computes the trial state from it,
//! so a failed increment leaves nothing behind.
//!
//! | | |
//! |---|---|
//! | `state` | strains, stresses, internal variables: committed, restored, saved |
//! | `integration` | points carried through the law; stresses and tangents of the elements |
//! | `diagnosis` | what is found out about points that give way, wrong tangents, bonds |
//! | `readings`, `tied_faces` | what others read of a group |

mod diagnosis;
mod integration;
mod readings;
mod state;
mod tied_faces;

pub use diagnosis::{BrokenBond, Deviation, FailureMode, Fault, GroupSplit, Notice, Went};
pub use integration::{LawCalls, LawStart, MadeBy, Origin, PointFailure};
pub use state::{Aside, Bytes, Committed, Excerpted, Field, GroupState};
pub use tied_faces::tied_nodes;

use crate::element::Kinematics;
use crate::problem::{Formulation, InPlane, Material};
use abi::status::Outcome;
use diagnosis::Bond;
use integration::{CallContext, Layer, PointTangents, Pores, Swelling, Varying};
use law::{BatchFailure, Moment, Operator, current_call};

/// Points that one thread takes at a time where little is done with each.
const PER_TASK: usize = 4096;

/// A group of elements.
#[derive(Debug)]
pub struct Group {
    /// Name in the case file.
    pub name: String,
    /// What the elements do.
    pub formulation: Formulation,
    /// The elements.
    pub kinematics: Box<dyn Kinematics>,
    /// Strains (zero thickness: jumps) in axes of the elements, without stress-free ones.
    pub strain: Field,
    /// Stresses (zero thickness: tractions) in axes of the elements.
    pub stress: Field,
    /// Exactly integrated tractions that an interface began with, less those at its points; empty if equal. Elements
    /// carry the difference next to the law's answer, so that ground at rest stays at rest.
    correction: Vec<f64>,
    /// Internal variables of the law.
    pub internal: Field,
    /// The law.
    pub law: Material,
    /// Numbers of step and increment, for laws that ask.
    pub moment: Moment,
    /// Calls of the laws used so far; the last one is that of the current law.
    pub law_calls: Vec<LawCalls>,
    /// It has stiffness, weight and stress.
    pub is_active: bool,
    layer: Option<Layer>,
    /// Pore water that follows the deformation, if it does or did.
    pores: Option<Pores>,
    /// Stress-free strain, if a phase gives it one.
    swelling: Option<Swelling>,
    calls: CallContext,
    tangents: PointTangents,
    /// The trial state is the answer of the law, which starts now, to the committed one over a zero increment.
    is_asked: bool,
    /// What its law started as.
    bond: Bond,
}

impl Group {
    /// A group before the first phase. `stress` is in axes of the elements. `thickness` by
    /// element makes it a thin layer.
    ///
    /// # Errors
    /// The law cannot start from the stress.
    pub fn new(
        name: String,
        formulation: Formulation,
        kinematics: Box<dyn Kinematics>,
        stress: Vec<f64>,
        thickness: Option<(Vec<f64>, InPlane)>,
        law: Material,
    ) -> Result<Self, PointFailure> {
        let n = kinematics.n_points() * kinematics.n_components();
        let layer = thickness.map(|(thickness, in_plane)| {
            Layer::new(thickness, in_plane, kinematics.points_of(0).len())
        });
        let mut group = Self {
            name,
            formulation,
            kinematics,
            strain: Field::new(vec![0.0; n]),
            stress: Field::new(stress),
            correction: Vec::new(),
            internal: Field::default(),
            law: law.clone(),
            moment: Moment::default(),
            law_calls: Vec::new(),
            is_active: true,
            layer,
            pores: None,
            swelling: None,
            calls: CallContext::default(),
            tangents: PointTangents::default(),
            is_asked: false,
            bond: Bond::default(),
        };
        group.start_law(law, None)?;
        Ok(group)
    }

    /// Swaps the law. The stress stays; internal variables stay if the law is the same one (with
    /// other parameters): its id, its library and its variables are the same. Else the new law starts
    /// from the current stress and jumps are counted from here. Initial values that the case file gives
    /// hold in both cases.
    ///
    /// Returns the state that a restarted law does not know.
    ///
    /// # Errors
    /// The law cannot start from the stress.
    pub fn set_law(&mut self, law: Material) -> Result<Option<GroupSplit>, PointFailure> {
        let [old, new] = [&self.law, &law].map(|material| &material.built.law);
        let same = new.description().id == old.description().id;
        let kept = same && new.cannot_go_on_from(old).is_none();
        let parted = if kept { None } else { self.parted(&law) };
        let kept = kept.then(|| std::mem::take(&mut self.internal.committed));
        self.start_law(law, kept)?;
        Ok(parted)
    }

    /// A group that is there from now on, free of strain, with this stress in axes of its elements.
    /// Its law restarts.
    ///
    /// # Errors
    /// The law cannot start from the stress.
    pub fn appear(&mut self, stress: Vec<f64>) -> Result<(), PointFailure> {
        self.is_active = true;
        self.strain.committed.fill(0.0);
        if let Some(swelling) = &mut self.swelling {
            swelling.strain.committed.fill(0.0);
        }
        self.stress = Field::new(stress);
        self.start_law(self.law.clone(), None)
    }

    /// A group that is no longer there: without stress and strain.
    pub fn disappear(&mut self) {
        self.is_active = false;
        self.pores = None;
        self.correction = Vec::new();
        for field in self.fields() {
            field.committed.fill(0.0);
            field.forget_trial();
        }
    }

    fn start_law(&mut self, law: Material, kept: Option<Vec<f64>>) -> Result<(), PointFailure> {
        self.forget_trial();
        self.law = law;
        self.tangents.origin = Origin::default();
        self.prepare_calls()?;
        let starts_anew = kept.is_none();
        let mut internal = match kept {
            Some(kept) => kept,
            None => self.initial_state()?,
        };
        let law = &self.law.built.law;
        for &(number, value) in &self.law.initial {
            let of_points = internal.iter_mut().skip(number).step_by(law.n_states());
            of_points.for_each(|v| *v = value);
        }
        self.internal = Field::new(internal);
        if starts_anew && self.formulation == Formulation::ZeroThickness {
            self.strain.committed.fill(0.0);
        }
        self.bond = if starts_anew {
            self.bond()
        } else {
            Bond::Other
        };
        self.start_tangents(starts_anew)
    }

    /// What calls of the law take that starts now.
    fn prepare_calls(&mut self) -> Result<(), PointFailure> {
        let watched = current_call::name(&format!("group `{}`", self.name));
        let varying = Varying::new(&self.law, &*self.kinematics)
            .map_err(|failure| self.locate(&cannot_build(&failure)))?;
        let law = &self.law.built.law;
        let name = &self.law.name;
        if self.law_calls.last().is_none_or(|calls| calls.law != *name) {
            self.law_calls.push(LawCalls {
                law: name.clone(),
                ..LawCalls::default()
            });
        }
        let sites = if law.asks_for_sites() {
            let points = 0..self.kinematics.n_points();
            points.map(|point| self.site(point)).collect()
        } else {
            Vec::new()
        };
        self.calls = CallContext {
            varying,
            sites,
            watched,
        };
        Ok(())
    }

    /// The tangents of a law that starts now: constant ones, or room for them; elastic stiffnesses of a thin layer.
    fn start_tangents(&mut self, starts_anew: bool) -> Result<(), PointFailure> {
        let law = &self.law.built.law;
        let n = law.n_components();
        let element_n = self.kinematics.n_components();
        let n_points = self.kinematics.n_points();
        let is_uniform = self.calls.varying.is_none() && self.pores.is_none();
        let is_uniform = is_uniform && self.swelling.is_none();
        self.tangents.are_constant = law.formulation().linear && is_uniform && !self.uses_layer();
        if self.tangents.are_constant {
            let one = self
                .operator_of_first_point()
                .map_err(|failure| self.locate(&failure))?;
            let most =
                (0..self.kinematics.n_elements()).map(|e| self.kinematics.points_of(e).len());
            self.tangents.values = one.repeat(most.max().unwrap_or(0));
            return Ok(());
        }
        self.tangents.values = vec![0.0; n_points * element_n * element_n];
        if self.uses_layer() {
            let mut operator = vec![0.0; n_points * n * n];
            let period = (self.moment.step_start, 0.0);
            self.run_law(Operator::Elastic, period, &mut operator)
                .map_err(|failure| self.locate(&failure))?;
            if let Some(layer) = &mut self.layer {
                layer.start(&operator, starts_anew);
            }
            // No state of the group's before it is taken over.
            self.is_asked = true;
        }
        Ok(())
    }

    /// Whether stresses follow strains by one constant matrix.
    pub fn is_linear(&self) -> bool {
        self.tangents.are_constant
    }

    /// Whether a law leaves it linear.
    pub fn is_linear_with(&self, law: &Material) -> bool {
        let law = &law.built.law;
        let is_same_kind = law.n_components() == self.law.built.law.n_components();
        law.formulation().linear && is_same_kind
    }

    /// Whether the law's tangents are symmetric.
    pub fn is_symmetric(&self) -> bool {
        self.law.built.law.formulation().symmetric
    }

    /// Nodes of its elements; most of them several times.
    pub fn nodes(&self) -> impl Iterator<Item = usize> {
        let elements = 0..self.kinematics.n_elements();
        elements.flat_map(|element| self.kinematics.nodes(element).iter().copied())
    }
}

/// A law that cannot be built with the values of an element.
fn cannot_build(failure: &law::BuildFailure) -> BatchFailure {
    BatchFailure {
        point: 0,
        outcome: Outcome::Parameter,
        message: failure.to_string(),
        factor: None,
        claims_success: false,
        call: None,
    }
}
