//! A group of elements with its law: committed and trial state of every integration point.
//!
//! An increment starts from the committed state; every iteration computes the trial state from it,
//! so a failed increment leaves nothing behind.

mod breaks;
mod broken_bonds;
mod depth_profile;
mod difference_tangents;
mod elastic_operator;
mod failure_mode;
mod integrate;
mod law_start;
mod point_tangent;
mod probed_elements;
mod saved_state;
mod state;
mod tangent_check;
mod thin_layer;
mod tied_faces;
mod traction_projection;
mod water;

pub use difference_tangents::{Origin, Reason as MadeBy};
pub use failure_mode::FailureMode;
pub use point_tangent::Fault;
pub use probed_elements::Excerpted;
pub use state::GroupState;
pub use tangent_check::{Deviation, Notice, Went};
pub use tied_faces::tied_nodes;

use crate::element::Kinematics;
use crate::problem::{Formulation, InPlane, Material};
use abi::status::Outcome;
use algebra::threads;
use broken_bonds::Bond;
pub use broken_bonds::BrokenBond;
use depth_profile::Varying;
use law::Law;
use law::{BatchFailure, BatchSuccess, End, Moment, Operator, Site, Start, Strided, current_call};
pub use law_start::LawStart;
pub use saved_state::Aside;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use thin_layer::Layer;
use water::Pores;

/// Components of the strain (jump) that a linear law is tried with, and what its stress may be off
/// its tangent's, relative to the largest of both.
const PROBE: [f64; 4] = [1e-4, -5e-5, 2.5e-5, 7.5e-5];
const LINEAR: f64 = 1e-8;

/// Points that one thread takes at a time where little is done with each.
const PER_TASK: usize = 4096;

/// Stresses, and strains, of some points, each with those at the start.
type Both<'v> = ((&'v mut [f64], &'v [f64]), (&'v [f64], &'v [f64]));

/// Copies values of points.
fn copy(from: &[f64], to: &mut [f64]) {
    let pieces = to.chunks_mut(4 * PER_TASK).zip(from.chunks(4 * PER_TASK));
    threads::each(pieces, |(to, from)| to.copy_from_slice(from));
}

/// Values of all points, before and during an increment.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Field {
    /// At the start of the increment.
    pub committed: Vec<f64>,
    /// As of the last iteration; empty before the first one of a phase.
    #[serde(skip)]
    pub trial: Vec<f64>,
}

impl Field {
    fn new(committed: Vec<f64>) -> Self {
        Self {
            committed,
            trial: Vec::new(),
        }
    }

    /// Makes room for a trial state.
    fn begin(&mut self) {
        if self.trial.len() != self.committed.len() {
            self.trial.clone_from(&self.committed);
        }
    }

    fn commit(&mut self) {
        if !self.trial.is_empty() {
            copy(&self.trial, &mut self.committed);
        }
    }

    fn forget_trial(&mut self) {
        self.trial = Vec::new();
    }
}

/// Committed state of a group: strains, stresses, internal variables, jumps of a layer, and pore
/// pressures.
#[derive(Clone, Debug)]
pub struct Committed(Vec<Vec<f64>>);

/// How often a group has called a law, calls included that came to nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LawCalls {
    /// Name of the law in the case: two may have one library and id.
    pub law: String,
    /// Points carried through an increment.
    pub points: u64,
    /// How many of them with an operator, consistent or elastic.
    pub operators: u64,
}

/// Bytes that a group keeps for its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Bytes {
    /// Strains, before and during an increment; of a thin layer also jumps.
    pub strain: usize,
    /// Stresses, before and during an increment.
    pub stress: usize,
    /// Internal variables, before and during an increment.
    pub internal: usize,
    /// Tangents.
    pub tangents: usize,
}

/// A failed point, by element.
#[derive(Clone, Debug, PartialEq)]
pub struct PointFailure {
    /// Name of the group.
    pub group: String,
    /// Name of the law in the case file.
    pub law: String,
    /// Id of the law.
    pub law_id: String,
    /// Element within the group, from 1.
    pub element: usize,
    /// Integration point within the element, from 1.
    pub point: usize,
    /// Coordinates.
    pub position: [f64; 2],
    /// What happened.
    pub failure: BatchFailure,
}

impl std::fmt::Display for PointFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            group,
            law_id,
            element,
            point,
            position: [x, y],
            failure,
            ..
        } = self;
        write!(
            f,
            "law `{law_id}`, group `{group}`, element {element}, point {point} at ({x:.4}, {y:.4}): {}",
            if failure.message.is_empty() {
                "no reason given"
            } else {
                &failure.message
            }
        )
    }
}

/// Faces of an interface that stand apart, or touch without stress, as another law takes over, which
/// is not told of gaps.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupSplit {
    /// Name of the group.
    pub group: String,
    /// Names of the two laws in the case file.
    pub laws: [String; 2],
    /// Points without stress, and all of the group.
    pub points: [usize; 2],
    /// Coordinates of the first of them.
    pub position: [f64; 2],
    /// Largest normal jump among them, m, since the law before took over.
    pub opening: f64,
}

impl std::fmt::Display for GroupSplit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            group,
            laws: [from, to],
            points: [points, all],
            position: [x, y],
            opening,
        } = self;
        write!(
            f,
            "interface `{group}` carries nothing at {points} of {all} points, the first at ({x:.4}, \
             {y:.4}), where law `{to}` takes over from `{from}`"
        )?;
        if *opening > 0.0 {
            write!(f, ", open by up to {opening:.3e} m")?;
        }
        write!(
            f,
            ": a law that starts is not told of gaps, so that faces which stand apart are in contact \
             again as soon as they approach"
        )
    }
}

/// A group of elements.
#[derive(Debug)]
pub struct Group {
    /// Name in the case file.
    pub name: String,
    /// What the elements do.
    pub formulation: Formulation,
    /// The elements.
    pub kinematics: Box<dyn Kinematics>,
    /// Strains (zero thickness: jumps) in axes of the elements.
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
    /// Laws of the elements, if their parameters vary.
    varying: Option<Varying>,
    /// Where the points lie, if the law asks.
    sites: Vec<Site>,
    /// Its name where calls of laws are watched.
    watched: u64,
    /// Tangents of the element, point by point; of a linear law, those of one element only.
    tangent: Vec<f64>,
    tangents_are_constant: bool,
    /// Where tangents come from.
    origin: Origin,
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
            varying: None,
            sites: Vec::new(),
            watched: 0,
            tangent: Vec::new(),
            tangents_are_constant: false,
            origin: Origin::default(),
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

    /// Points of an interface that have moved and carry nothing.
    fn parted(&self, law: &Material) -> Option<GroupSplit> {
        let old = &self.law.built.law;
        if !self.is_active || old.n_components() != 2 {
            return None;
        }
        let place = self.flux_place();
        let jumps = match &self.layer {
            Some(layer) => &layer.jump.committed,
            None => &self.strain.committed,
        };
        let is_parted = |point: usize| {
            let first = place.offset + point * place.point;
            let carried = [0, 1].map(|c| self.stress.committed[first + c * place.component]);
            let jump = &jumps[2 * point..][..2];
            carried.iter().all(|t| *t == 0.0) && jump.iter().any(|u| *u != 0.0)
        };
        let all = self.kinematics.n_points();
        let points: Vec<usize> = (0..all).filter(|&point| is_parted(point)).collect();
        let first = *points.first()?;
        let widest = points.iter().map(|&point| jumps[2 * point]);
        Some(GroupSplit {
            group: self.name.clone(),
            laws: [self.law.name.clone(), law.name.clone()],
            points: [points.len(), all],
            position: self.kinematics.position(first),
            opening: widest.fold(f64::NEG_INFINITY, f64::max),
        })
    }

    /// A group that is there from now on, free of strain, with this stress in axes of its elements.
    /// Its law restarts.
    ///
    /// # Errors
    /// The law cannot start from the stress.
    pub fn appear(&mut self, stress: Vec<f64>) -> Result<(), PointFailure> {
        self.is_active = true;
        self.strain.committed.fill(0.0);
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
        self.origin = Origin::default();
        self.watched = current_call::name(&format!("group `{}`", self.name));
        let law = &self.law.built.law;
        let name = &self.law.name;
        if self.law_calls.last().is_none_or(|calls| calls.law != *name) {
            self.law_calls.push(LawCalls {
                law: name.clone(),
                ..LawCalls::default()
            });
        }
        let n_points = self.kinematics.n_points();
        self.sites = if law.asks_for_sites() {
            (0..n_points).map(|point| self.site(point)).collect()
        } else {
            Vec::new()
        };
        self.varying = Varying::new(&self.law, &*self.kinematics)
            .map_err(|failure| self.locate(&cannot_build(&failure)))?;
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
        let law = &self.law.built.law;
        let n = law.n_components();
        let element_n = self.kinematics.n_components();
        let is_uniform = self.varying.is_none() && self.pores.is_none();
        self.tangents_are_constant = law.formulation().linear && is_uniform && !self.uses_layer();
        if self.tangents_are_constant {
            let one = self
                .operator_of_first_point()
                .map_err(|failure| self.locate(&failure))?;
            let most =
                (0..self.kinematics.n_elements()).map(|e| self.kinematics.points_of(e).len());
            self.tangent = one.repeat(most.max().unwrap_or(0));
            return Ok(());
        }
        self.tangent = vec![0.0; n_points * element_n * element_n];
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

    /// Stresses that the law returns before any deformation.
    fn initial_state(&self) -> Result<Vec<f64>, PointFailure> {
        let place = self.flux_place();
        current_call::of_group(self.watched, 0, self.kinematics.points_of(0).len());
        let mut internal = Vec::new();
        for (points, law) in self.pieces(usize::MAX) {
            let flux = &self.stress.committed[points.start * place.point..points.end * place.point];
            let state = law.initial_state(points.len(), (flux, place));
            internal.extend(state.map_err(|failure| {
                self.locate(&BatchFailure {
                    point: points.start + failure.point,
                    ..failure
                })
            })?);
        }
        Ok(internal)
    }

    /// Consecutive points of one law, at most this many at a time.
    fn pieces(&self, most: usize) -> Vec<(Range<usize>, &Law)> {
        let all = [(0..self.kinematics.n_points(), 0)];
        let runs = self
            .varying
            .as_ref()
            .map_or(&all[..], |varying| &varying.runs);
        let law = |number: usize| match &self.varying {
            Some(varying) => &varying.law(number).law,
            None => &self.law.built.law,
        };
        let pieces = runs.iter().flat_map(|(run, number)| {
            let starts = run.clone().step_by(most.min(run.len().max(1)));
            let end = run.end;
            starts.map(move |start| (start..end.min(start.saturating_add(most)), law(*number)))
        });
        pieces.collect()
    }

    fn site(&self, point: usize) -> Site {
        let (element, within) = self.kinematics.place_of(point);
        Site {
            position: self.kinematics.position(point),
            length: self.kinematics.length(element),
            element: element as u32 + 1,
            point: within as u32 + 1,
        }
    }

    /// Whether stresses follow strains by one constant matrix.
    pub fn is_linear(&self) -> bool {
        self.tangents_are_constant
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

    /// A thin layer whose law is an interface law.
    fn uses_layer(&self) -> bool {
        self.layer.is_some() && self.law.built.law.n_components() == 2
    }

    /// Positions of the law's fluxes within the stresses: all of them, or, of a thin layer with an
    /// interface law, components 22 (normal) and 12 (shear).
    fn flux_place(&self) -> Strided {
        if self.uses_layer() {
            Strided {
                offset: 1,
                point: 4,
                component: 2,
            }
        } else {
            Strided::rows(self.kinematics.n_components())
        }
    }

    /// The first point of a thin layer whose normal and shear stiffness cannot be those of an
    /// elastic layer: (normal, shear).
    pub fn impossible_layer(&self) -> Option<[f64; 2]> {
        self.layer
            .as_ref()
            .filter(|_| self.uses_layer())
            .and_then(Layer::impossible)
    }

    /// Computes the trial state under displacement increments (two per node) since the committed
    /// state, and the tangents if wanted; else those of an earlier evaluation stay.
    ///
    /// # Errors
    /// The worst point.
    pub fn evaluate(
        &mut self,
        increment: &[f64],
        operator: Operator,
        time: f64,
        time_increment: f64,
    ) -> Result<BatchSuccess, PointFailure> {
        self.strain.begin();
        copy(&self.strain.committed, &mut self.strain.trial);
        self.kinematics
            .add_gradients(increment, &mut self.strain.trial);
        self.follow_pores(time, time_increment);
        if self.tangents_are_constant {
            self.evaluate_linear();
            return Ok(BatchSuccess::default());
        }
        if let Some(layer) = self
            .layer
            .as_mut()
            .filter(|_| self.law.built.law.n_components() == 2)
        {
            layer.jumps_from_strains(&self.strain.committed, &self.strain.trial);
        }
        let mut tangent = std::mem::take(&mut self.tangent);
        let result = if self.uses_layer() {
            let mut operators = vec![0.0; self.kinematics.n_points() * 4];
            let result = self.run_with_tangents(operator, (time, time_increment), &mut operators);
            if let (Ok(_), Some(layer)) = (&result, &self.layer) {
                layer.stresses_along(&self.strain, &mut self.stress);
                if operator != Operator::None {
                    layer.tangents(&operators, &mut tangent);
                }
            }
            result
        } else {
            let result = self.run_with_tangents(operator, (time, time_increment), &mut tangent);
            if operator != Operator::None {
                self.stiffen(&mut tangent);
            }
            result
        };
        self.tangent = tangent;
        result.map_err(|failure| self.locate(&failure))
    }

    /// σ = σ₀ + D Δε.
    fn evaluate_linear(&mut self) {
        self.stress.begin();
        let n = self.kinematics.n_components();
        let tangent = &self.tangent;
        let per_task = n * PER_TASK;
        let stresses = self.stress.trial.chunks_mut(per_task);
        let stresses = stresses.zip(self.stress.committed.chunks(per_task));
        let strains = self.strain.trial.chunks(per_task);
        let strains = strains.zip(self.strain.committed.chunks(per_task));
        let of_points = |((stresses, stresses_0), (strains, strains_0)): Both<'_>| {
            let stresses = stresses.chunks_exact_mut(n);
            let stresses = stresses.zip(stresses_0.chunks_exact(n));
            let strains = strains.chunks_exact(n).zip(strains_0.chunks_exact(n));
            for ((stress, stress_0), (strain, strain_0)) in stresses.zip(strains) {
                for i in 0..n {
                    let row = &tangent[i * n..][..n];
                    let change: f64 = (0..n).map(|j| row[j] * (strain[j] - strain_0[j])).sum();
                    stress[i] = stress_0[i] + change;
                }
            }
        };
        threads::each(stresses.zip(strains), of_points);
    }

    /// The constant tangent of a linear law, held against what the law makes of a small strain.
    fn operator_of_first_point(&mut self) -> Result<Vec<f64>, BatchFailure> {
        let law = &self.law.built.law;
        let n = law.n_components();
        let zero = vec![0.0; n];
        let strain: Vec<f64> = PROBE.iter().copied().cycle().take(n).collect();
        let mut flux = vec![0.0; n];
        let mut operator = vec![0.0; n * n];
        let rows = Strided::rows(n);
        law.integrate(
            &Start {
                n_points: 1,
                gradient: (&zero, rows),
                gradient_end: (&strain, rows),
                flux: (&zero, rows),
                state: &[],
                time: 0.0,
                time_increment: 0.0,
                moment: self.moment,
                sites: &[],
            },
            Operator::Consistent,
            End {
                flux: (&mut flux, rows),
                state: &mut [],
                operator: &mut operator,
            },
        )?;
        self.count(1, Operator::Consistent);
        let largest = |v: &[f64]| v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let scale = largest(&operator) * largest(&strain);
        for (i, row) in operator.chunks_exact(n).enumerate() {
            let product: f64 = row.iter().zip(&strain).map(|(d, e)| d * e).sum();
            if (flux[i] - product).abs() > LINEAR * scale {
                return Err(BatchFailure {
                    point: 0,
                    outcome: Outcome::Internal,
                    message: format!(
                        "the law calls itself linear, but a strain of {strain:?} gives stress {} = \
                         {:.6e} where its tangent gives {product:.6e}; `pilum check` says more",
                        i + 1,
                        flux[i]
                    ),
                    factor: None,
                    claims_success: false,
                    call: None,
                });
            }
        }
        Ok(operator)
    }

    fn count(&mut self, n_points: usize, operator: Operator) {
        if let Some(calls) = self.law_calls.last_mut() {
            calls.points += n_points as u64;
            if operator != Operator::None {
                calls.operators += n_points as u64;
            }
        }
    }

    fn locate(&self, failure: &BatchFailure) -> PointFailure {
        let point = failure
            .point
            .min(self.kinematics.n_points().saturating_sub(1));
        let (element, within) = self.kinematics.place_of(point);
        PointFailure {
            group: self.name.clone(),
            law: self.law.name.clone(),
            law_id: self.law.built.law.description().id.clone(),
            element: element + 1,
            point: within + 1,
            position: self.kinematics.position(point),
            failure: BatchFailure {
                // The law counts points of the batch; the element says more.
                message: failure
                    .message
                    .strip_prefix(&format!("point {}: ", failure.point))
                    .unwrap_or(&failure.message)
                    .to_owned(),
                ..failure.clone()
            },
        }
    }

    /// Tangents of an element's points as of the last evaluation.
    pub fn element_tangents(&self, element: usize) -> &[f64] {
        let n = self.kinematics.n_components();
        let points = self.kinematics.points_of(element);
        let first = if self.tangents_are_constant {
            0
        } else {
            points.start
        };
        &self.tangent[first * n * n..(first + points.len()) * n * n]
    }

    /// Tangents of consecutive elements, at least one, where they differ from point to point.
    pub fn tangents_of(&self, elements: Range<usize>) -> &[f64] {
        let n = self.kinematics.n_components();
        let points_of = |element| self.kinematics.points_of(element);
        let (first, end) = (
            points_of(elements.start).start,
            points_of(elements.end - 1).end,
        );
        &self.tangent[first * n * n..end * n * n]
    }

    /// Nodes of its elements; most of them several times.
    pub fn nodes(&self) -> impl Iterator<Item = usize> {
        let elements = 0..self.kinematics.n_elements();
        elements.flat_map(|element| self.kinematics.nodes(element).iter().copied())
    }

    /// The tangents of every element's points, if they are the same at all of them.
    pub fn constant_tangents(&self) -> Option<&[f64]> {
        self.tangents_are_constant.then_some(&self.tangent)
    }

    /// Tangents as of the last evaluation that computed them.
    pub fn tangents(&self) -> &[f64] {
        &self.tangent
    }

    /// Puts tangents back that [`Self::tangents`] gave.
    pub fn put_tangents(&mut self, tangents: Vec<f64>) {
        debug_assert_eq!(tangents.len(), self.tangent.len());
        self.tangent = tangents;
    }

    /// Change of the stresses under displacement increments if the tangents held: D Δε.
    pub fn linear_change(&self, increment: &[f64]) -> Vec<f64> {
        let n = self.kinematics.n_components();
        let mut strain = vec![0.0; self.strain.committed.len()];
        self.kinematics.add_gradients(increment, &mut strain);
        let mut change = vec![0.0; strain.len()];
        let points = strain.chunks_exact(n).zip(change.chunks_exact_mut(n));
        for (point, (strain, change)) in points.enumerate() {
            let (element, within) = self.kinematics.place_of(point);
            let tangent = &self.element_tangents(element)[within * n * n..][..n * n];
            for (change, row) in change.iter_mut().zip(tangent.chunks_exact(n)) {
                *change = row.iter().zip(strain).map(|(d, e)| d * e).sum();
            }
        }
        change
    }

    /// What the group keeps for its points. A trial state as large comes and goes.
    pub fn bytes(&self) -> Bytes {
        let field = |field: &Field| size_of_val(&*field.committed);
        let jumps = self.layer.as_ref().map_or(0, |layer| field(&layer.jump));
        Bytes {
            strain: field(&self.strain) + jumps,
            stress: field(&self.stress),
            internal: field(&self.internal),
            tangents: size_of_val(&*self.tangent),
        }
    }

    /// Makes the trial state the committed one.
    pub fn commit(&mut self) {
        self.fields().for_each(Field::commit);
    }

    /// The committed state of all points, to be restored.
    pub fn committed(&self) -> Committed {
        let jump = self.layer.as_ref().map(|layer| &layer.jump);
        let excess = self.pores.as_ref().map(|pores| &pores.excess);
        let own = [&self.strain, &self.stress, &self.internal];
        let fields = own.into_iter().chain(jump).chain(excess);
        Committed(fields.map(|field| field.committed.clone()).collect())
    }

    /// Takes a committed state back.
    pub fn restore_committed(&mut self, committed: Committed) {
        for (field, committed) in self.fields().zip(committed.0) {
            field.committed = committed;
        }
    }

    /// Gives up the room of the trial state until the next one is computed.
    pub fn forget_trial(&mut self) {
        self.is_asked = false;
        self.fields().for_each(Field::forget_trial);
    }

    fn fields(&mut self) -> impl Iterator<Item = &mut Field> {
        let jump = self.layer.as_mut().map(|layer| &mut layer.jump);
        let excess = self.pores.as_mut().map(|pores| &mut pores.excess);
        let others = [&mut self.strain, &mut self.stress, &mut self.internal];
        others.into_iter().chain(jump).chain(excess)
    }

    /// Thickness at a point of a thin layer.
    pub fn thickness(&self, point: usize) -> Option<f64> {
        self.layer.as_ref().map(|layer| layer.thickness_at(point))
    }

    /// Stress of a point in global axes (committed); `None` for zero-thickness elements.
    pub fn global_stress(&self, point: usize) -> Option<[f64; 4]> {
        let s = self.stress.committed.get(4 * point..4 * point + 4)?;
        let axes = self.kinematics.axes(self.kinematics.place_of(point).0);
        (self.kinematics.n_components() == 4)
            .then(|| axes.stress_to_global([s[0], s[1], s[2], s[3]]))
    }

    /// Stress of an element at a place in it or next to it, in global axes (committed): the plane
    /// that is nearest to the stresses at its points.
    pub fn carried_at(&self, element: usize, at: [f64; 2]) -> [f64; 4] {
        let (points, axes) = (
            self.kinematics.points_of(element),
            self.kinematics.axes(element),
        );
        let carried = self.carried();
        let n = points.len() as f64;
        let mut middle = [0.0; 2];
        let mut mean = [0.0; 4];
        let global = |point: usize| {
            let s = &carried[4 * point..4 * point + 4];
            axes.stress_to_global([s[0], s[1], s[2], s[3]])
        };
        for point in points.clone() {
            let (place, stress) = (self.kinematics.position(point), global(point));
            (0..2).for_each(|c| middle[c] += place[c] / n);
            (0..4).for_each(|c| mean[c] += stress[c] / n);
        }
        let arm = |place: [f64; 2]| [place[0] - middle[0], place[1] - middle[1]];
        // Normal equations of the slopes.
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        let mut with = [[0.0; 2]; 4];
        for point in points {
            let ([x, y], stress) = (arm(self.kinematics.position(point)), global(point));
            (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
            for c in 0..4 {
                with[c][0] += x * (stress[c] - mean[c]);
                with[c][1] += y * (stress[c] - mean[c]);
            }
        }
        let determinant = xx * yy - xy * xy;
        let [x, y] = arm(at);
        std::array::from_fn(|c| {
            if determinant <= 0.0 {
                return mean[c];
            }
            let [a, b] = with[c];
            mean[c] + (x * (yy * a - xy * b) + y * (xx * b - xy * a)) / determinant
        })
    }

    /// Strain of a point in global axes (committed), γ = 2ε; `None` for zero-thickness elements.
    pub fn global_strain(&self, point: usize) -> Option<[f64; 4]> {
        let e = self.strain.committed.get(4 * point..4 * point + 4)?;
        let axes = self.kinematics.axes(self.kinematics.place_of(point).0);
        (self.kinematics.n_components() == 4).then(|| {
            let [e_11, e_22, e_33, e_12] = axes.stress_to_global([e[0], e[1], e[2], e[3] / 2.0]);
            [e_11, e_22, e_33, 2.0 * e_12]
        })
    }

    /// An internal variable of a point (committed); `None` if the law has no variable of this id.
    pub fn internal_variable(&self, point: usize, id: &str) -> Option<f64> {
        let variables = &self.law.built.law.formulation().internal_variables;
        let number = variables.iter().position(|variable| variable.id == id)?;
        self.internal
            .committed
            .get(point * variables.len() + number)
            .copied()
    }

    /// Nodal forces of this group's elements (committed), by degree of freedom.
    pub fn forces(&self, n_dofs: usize) -> Vec<f64> {
        let mut force = vec![0.0; n_dofs];
        self.kinematics.add_forces(&self.carried(), &mut force);
        force
    }

    /// Nodal forces of some of this group's elements (committed), by degree of freedom.
    pub fn forces_of(&self, elements: &[usize], n_dofs: usize) -> Vec<f64> {
        let carried = self.carried();
        let mut force = vec![0.0; n_dofs];
        if let Some(few) = self.kinematics.only(elements) {
            let own = self.places(elements).flat_map(|own| &carried[own]);
            few.add_forces(&own.copied().collect::<Vec<f64>>(), &mut force);
            return force;
        }
        let mut stress = vec![0.0; carried.len()];
        for own in self.places(elements) {
            stress[own.clone()].copy_from_slice(&carried[own]);
        }
        self.kinematics.add_forces(&stress, &mut force);
        force
    }

    /// Force that some of this group's zero-thickness elements exert on the side of smaller coordinates
    /// (committed), kN. At an end that is not doubled the nodal forces of both sides cancel; the
    /// tractions do not.
    pub fn handed_on(&self, elements: &[usize], component: usize) -> f64 {
        let carried = self.carried();
        let of_point = |point: usize| {
            let axes = self.kinematics.axes_at(point);
            let [normal, tangential] = [0, 1].map(|c| carried[2 * point + c]);
            let traction = axes.across[component] * normal + axes.along[component] * tangential;
            self.kinematics.weight(point) * traction
        };
        let of_element = |&element: &usize| {
            self.kinematics
                .points_of(element)
                .map(of_point)
                .sum::<f64>()
        };
        -elements.iter().map(of_element).sum::<f64>()
    }

    /// Jump and traction (normal, tangential) of a point of a thin layer or zero-thickness
    /// element (committed); `None` for solids.
    pub fn jump_and_traction(&self, point: usize) -> Option<([f64; 2], [f64; 2])> {
        match self.formulation {
            Formulation::Solid => None,
            Formulation::ZeroThickness => {
                let pair = |values: &[f64]| [values[2 * point], values[2 * point + 1]];
                Some((pair(&self.strain.committed), pair(&self.stress.committed)))
            }
            Formulation::ThinLayer => {
                let layer = self.layer.as_ref()?;
                let pair = |values: &[f64]| [values[4 * point + 1], values[4 * point + 3]];
                let jump = if self.uses_layer() {
                    [
                        layer.jump.committed[2 * point],
                        layer.jump.committed[2 * point + 1],
                    ]
                } else {
                    pair(&self.strain.committed).map(|strain| strain * layer.thickness_at(point))
                };
                Some((jump, pair(&self.stress.committed)))
            }
        }
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
