//! Laws of interfaces made from laws of solids: a zone of constant thickness between two sides that
//! move against each other.
//!
//! Components of the solid are those of a layer: 11 along it, 22 normal to it, 33 out of plane.
//! With the jump (u_n, u_t) over a zone of thickness d
//!
//! | strain | stress |
//! |---|---|
//! | ε₂₂ = u_n/d, γ₁₂ = u_t/d | σ₂₂ and σ₁₂ are the traction (n, t) |
//! | all others 0 | all others are internal variables of the zone, behind those of the law |
//!
//! and the operator is that of the solid, rows and columns 22 and 12, divided by d.

use crate::call::{Batch, End, Operator, Request, Start, Strided};
use crate::description::{FormulationDescription, InternalVariable, LawDescription};
use crate::instance::{Answer, Instance, Source};
use abi::Hypothesis;
use abi::raw;
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::sync::Arc;

/// Places of the components that an interface has, n and t, among those of a solid.
const OF_INTERFACE: [usize; 2] = [1, 3];
/// Places of the others.
const OF_ZONE: [usize; 4] = [0, 2, 4, 5];
/// Those that the initial stress is written to.
const LATERAL: [usize; 2] = [0, 2];

/// Least thickness, m: that of a sheet of clay mineral. Displacements of 1 m are rounded to 1.1e-16 m,
/// and jumps are differences of them: over less than this, round-off alone strains the zone by more
/// than 1e-7, a ten-thousandth of what soil yields at.
const LEAST: f64 = 1e-9;
/// From the asperities of a smooth wall to a shear zone in gravel, m.
const USUAL: [f64; 2] = [1e-4, 0.5];

/// A zone of an interface that a law of solids fills.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShearZone {
    /// Thickness, m; at least 1e-9.
    pub thickness: f64,
    /// Stress along the zone and out of plane over the normal traction, at the start.
    pub lateral_ratio: f64,
}

impl ShearZone {
    /// The key whose value does not fit, and why.
    pub fn fault(self) -> Option<(&'static str, String)> {
        let Self {
            thickness,
            lateral_ratio,
        } = self;
        if !(thickness > 0.0 && thickness.is_finite()) {
            let why = format!("`thickness`: {thickness} m is outside (0, ∞)");
            return Some(("thickness", why));
        }
        if thickness < LEAST {
            let why = format!(
                "`thickness`: {thickness:e} m is below {LEAST:e} m: rounding displacements of 1 m strains \
                 so thin a zone by {:.1e}",
                0.5 * f64::EPSILON / thickness
            );
            return Some(("thickness", why));
        }
        if !(lateral_ratio >= 0.0 && lateral_ratio.is_finite()) {
            let why = format!("`lateral_ratio`: {lateral_ratio} is outside [0, ∞)");
            return Some(("lateral_ratio", why));
        }
        None
    }
}

impl ShearZone {
    /// Warnings about implausible values.
    pub(crate) fn implausible(self, law: &str) -> Option<String> {
        let [least, most] = USUAL;
        let thickness = self.thickness;
        let about = if thickness < least {
            "slip up to the strength is in proportion to it"
        } else if thickness > most {
            "are millimetres meant?"
        } else {
            return None;
        };
        let number = if thickness < 1e-3 {
            format!("{thickness:e}")
        } else {
            thickness.to_string()
        };
        Some(format!(
            "law `{law}`: thickness = {number} m of its shear zone is outside its usual range [{least:e}, \
             {most}]: {about}"
        ))
    }
}

/// Hypothesis in which a zone evaluates its law: all strains along the zone and out of plane are 0, so that the
/// hypotheses differ by their components only.
fn hypothesis(law: &LawDescription) -> Option<Hypothesis> {
    let solids = [
        Hypothesis::PlaneStrain,
        Hypothesis::Axisymmetric,
        Hypothesis::ThreeD,
    ];
    let mut solids = solids.into_iter();
    solids.find(|hypothesis| law.formulation(*hypothesis).is_some())
}

/// Stresses of the zone that are no tractions.
fn variables(hypothesis: Hypothesis) -> impl Iterator<Item = InternalVariable> {
    let components = hypothesis.components();
    let places = OF_ZONE
        .into_iter()
        .filter(|place| *place < components.len());
    places.map(|place| {
        let component = components[place];
        InternalVariable {
            id: format!("zone_stress_{component}"),
            symbol: format!("σ_{component}"),
            unit: "kPa".to_owned(),
            doc: format!("Stress {component} of the zone: 1 along it, 2 normal, 3 out of plane"),
            initial_value: 0.0,
            output_only: false,
        }
    })
}

impl ShearZone {
    /// The law of an interface that a law of solids makes in this zone. It has its id, parameters and internal variables,
    /// and the zone's stresses.
    ///
    /// # Errors
    /// The law is not for solids, or the zone does not fit; in words.
    pub(crate) fn filled_with(
        self,
        law: &LawDescription,
        source: &Arc<dyn Source>,
    ) -> Result<(LawDescription, Arc<dyn Source>), String> {
        if let Some((_, why)) = self.fault() {
            return Err(why);
        }
        let id = &law.id;
        let solid = hypothesis(law).and_then(|h| Some((h, law.formulation(h)?)));
        let Some((solid, formulation)) = solid else {
            return Err(format!(
                "a shear zone is made from a law of solids; law `{id}` is made for {}",
                law.hypotheses()
            ));
        };
        let mut inner = formulation.internal_variables.iter();
        let own: Vec<String> = variables(solid).map(|variable| variable.id).collect();
        let taken = inner.find_map(|variable| own.iter().find(|own| **own == variable.id));
        if let Some(taken) = taken {
            return Err(format!(
                "law `{id}` has an internal variable `{taken}`, as the zone calls one of its own stresses"
            ));
        }
        let inner = formulation.internal_variables.iter().cloned();
        let of_interface = FormulationDescription {
            hypothesis: Hypothesis::Interface2d.name(),
            linear: false,
            local_axes: false,
            internal_variables: inner.chain(variables(solid)).collect(),
            ..formulation.clone()
        };
        let description = LawDescription {
            name: format!("Shear zone of {}", law.name),
            formulations: vec![of_interface],
            ..law.clone()
        };
        let filled = FilledZone {
            zone: self,
            solid,
            formulation: formulation.clone(),
            source: Arc::clone(source),
        };
        Ok((description, Arc::new(filled)))
    }
}

/// A zone with its law of solids.
#[derive(Debug)]
struct FilledZone {
    zone: ShearZone,
    /// The hypothesis under which the law is called.
    solid: Hypothesis,
    formulation: FormulationDescription,
    source: Arc<dyn Source>,
}

impl Source for FilledZone {
    fn create(
        &self,
        _: Hypothesis,
        _: &FormulationDescription,
        parameters: &[f64],
    ) -> Result<Box<dyn Instance>, Answer> {
        let law = self
            .source
            .create(self.solid, &self.formulation, parameters)?;
        Ok(Box::new(ZoneInstance {
            zone: self.zone,
            law,
            n: self.solid.n_components(),
            n_states: self.formulation.internal_variables.len(),
        }))
    }

    fn is_called_here(&self) -> bool {
        false
    }
}

/// A zone whose law has its parameters.
#[derive(Debug)]
struct ZoneInstance {
    zone: ShearZone,
    law: Box<dyn Instance>,
    /// Components of the law.
    n: usize,
    /// Internal variables of the law.
    n_states: usize,
}

/// Arguments of the law for a batch of the zone. Each thread keeps its own from call to call, so
/// that a call allocates nothing once the largest batch has been seen.
#[derive(Debug, Default)]
struct Room {
    strain: Vec<f64>,
    strain_end: Vec<f64>,
    stress: Vec<f64>,
    stress_end: Vec<f64>,
    state: Vec<f64>,
    state_end: Vec<f64>,
    operator: Vec<f64>,
}

thread_local! {
    static ROOM: RefCell<Room> = RefCell::default();
}

/// Values that nobody has written yet.
fn unwritten(values: &mut Vec<f64>, n: usize) -> &mut [f64] {
    values.clear();
    values.resize(n, f64::NAN);
    values
}

impl Instance for ZoneInstance {
    fn call(&self, request: Request, batch: Batch<'_, '_>) -> Option<Answer> {
        ROOM.with_borrow_mut(|room| match request {
            Request::InitialState => Some(self.init_state(room, batch)),
            Request::Update(operator) => self.integrate(room, operator, batch),
        })
    }

    fn take_overwritten(&self) -> Vec<String> {
        self.law.take_overwritten()
    }
}

impl ZoneInstance {
    /// Places of the zone's own variables among the components.
    fn own(&self) -> impl Iterator<Item = usize> {
        let n = self.n;
        OF_ZONE.into_iter().filter(move |place| *place < n)
    }

    /// Number of internal variables of the law and of the zone.
    fn n_all(&self) -> usize {
        self.n_states + self.own().count()
    }

    /// Internal variables of the law for the whole stress, and that stress.
    fn init_state(&self, room: &mut Room, (start, end, outcomes): Batch<'_, '_>) -> Answer {
        let (n, n_states, points) = (self.n, self.n_states, start.n_points);
        let n_all = self.n_all();
        let stress = unwritten(&mut room.stress, points * n);
        let state = unwritten(&mut room.state_end, points * n_states);
        for (i, stress) in stress.chunks_exact_mut(n).enumerate() {
            stress.fill(0.0);
            for (c, place) in OF_INTERFACE.into_iter().enumerate() {
                stress[place] = value(start.flux, i, c);
            }
            for place in LATERAL {
                stress[place] = self.zone.lateral_ratio * stress[OF_INTERFACE[0]];
            }
            let (law, own) = end.state[i * n_all..][..n_all].split_at_mut(n_states);
            state[i * n_states..][..n_states].copy_from_slice(law);
            for (own, place) in own.iter_mut().zip(self.own()) {
                *own = stress[place];
            }
        }
        let inner = Start {
            flux: (stress, Strided::rows(n)),
            ..*start
        };
        let mut inner_end = End::of_state(&mut *state);
        let batch = (&inner, &mut inner_end, &mut *outcomes);
        let answer = self.law.call(Request::InitialState, batch);
        let Some(answer) = answer else {
            outcomes.status.fill(raw::PILUM_OK);
            return (raw::PILUM_OK, String::new());
        };
        for i in 0..points {
            let law = &mut end.state[i * n_all..][..n_states];
            law.copy_from_slice(&state[i * n_states..][..n_states]);
        }
        answer
    }

    /// Strains of all points from their jumps.
    fn strain(&self, jump: (&[f64], Strided), strain: &mut [f64]) {
        strain.fill(0.0);
        for (i, strain) in strain.chunks_exact_mut(self.n).enumerate() {
            for (c, place) in OF_INTERFACE.into_iter().enumerate() {
                strain[place] = value(jump, i, c) / self.zone.thickness;
            }
        }
    }

    /// Stresses and internal variables of the law, from tractions and all variables.
    fn start_of_law(&self, start: &Start<'_>, stress: &mut [f64], state: &mut [f64]) {
        let (n, n_states, n_all) = (self.n, self.n_states, self.n_all());
        for (i, stress) in stress.chunks_exact_mut(n).enumerate() {
            let (law, own) = start.state[i * n_all..][..n_all].split_at(n_states);
            state[i * n_states..][..n_states].copy_from_slice(law);
            for (c, place) in OF_INTERFACE.into_iter().enumerate() {
                stress[place] = value(start.flux, i, c);
            }
            for (own, place) in own.iter().zip(self.own()) {
                stress[place] = *own;
            }
        }
    }

    /// The same back.
    fn end_of_zone(&self, end: &mut End<'_>, stress: &[f64], state: &[f64]) {
        let (n, n_states, n_all) = (self.n, self.n_states, self.n_all());
        let (flux, place) = &mut end.flux;
        for (i, stress) in stress.chunks_exact(n).enumerate() {
            let (law, own) = end.state[i * n_all..][..n_all].split_at_mut(n_states);
            law.copy_from_slice(&state[i * n_states..][..n_states]);
            for (own, place) in own.iter_mut().zip(self.own()) {
                *own = stress[place];
            }
            for (c, of_solid) in OF_INTERFACE.into_iter().enumerate() {
                flux[place.at(i, c)] = stress[of_solid];
            }
        }
    }

    fn operator_of_zone(&self, solid: &[f64], zone: &mut [f64]) {
        let n = self.n;
        let entries = zone.chunks_exact_mut(OF_INTERFACE.len().pow(2));
        for (entries, solid) in entries.zip(solid.chunks_exact(n * n)) {
            let places = OF_INTERFACE
                .into_iter()
                .flat_map(|row| OF_INTERFACE.map(|column| row * n + column));
            for (entry, of_solid) in entries.iter_mut().zip(places) {
                *entry = solid[of_solid] / self.zone.thickness;
            }
        }
    }

    fn integrate(
        &self,
        room: &mut Room,
        operator: Operator,
        (start, end, outcomes): Batch<'_, '_>,
    ) -> Option<Answer> {
        let (n, n_states, points) = (self.n, self.n_states, start.n_points);
        let rows = Strided::rows(n);
        let strain = unwritten(&mut room.strain, points * n);
        let strain_end = unwritten(&mut room.strain_end, points * n);
        self.strain(start.gradient, strain);
        self.strain(start.gradient_end, strain_end);
        let stress = unwritten(&mut room.stress, points * n);
        let state = unwritten(&mut room.state, points * n_states);
        self.start_of_law(start, stress, state);
        let stress_end = unwritten(&mut room.stress_end, points * n);
        let state_end = unwritten(&mut room.state_end, points * n_states);
        let matrix = unwritten(&mut room.operator, points * operator.n_entries(n));
        let inner = Start {
            gradient: (strain, rows),
            gradient_end: (strain_end, rows),
            flux: (stress, rows),
            state,
            ..*start
        };
        let mut inner_end = End {
            flux: (&mut *stress_end, rows),
            state: &mut *state_end,
            operator: &mut *matrix,
        };
        let batch = (&inner, &mut inner_end, outcomes);
        let answer = self.law.call(Request::Update(operator), batch);
        self.end_of_zone(end, stress_end, state_end);
        if operator != Operator::None {
            self.operator_of_zone(matrix, end.operator);
        }
        answer
    }
}

/// Component `c` of a point.
fn value((values, place): (&[f64], Strided), point: usize, c: usize) -> f64 {
    values[place.at(point, c)]
}
