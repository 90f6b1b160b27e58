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

use crate::description::{FormulationDescription, InternalVariable, LawDescription};
use crate::law::LawInstance;
use crate::library::{Call, CallFailure, Strided};
use crate::open_library::Origin;
use crate::{Library, LoadedLaw};
use abi::Hypothesis;
use abi::raw::{self, Status};
use serde::Deserialize;
use std::cell::RefCell;
use std::fmt;
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
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
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

/// As a file has it; numbers read back to the same bits.
impl fmt::Display for ShearZone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (thickness, ratio) = (self.thickness, self.lateral_ratio);
        write!(
            f,
            "{{ thickness = {thickness:?}, lateral_ratio = {ratio:?} }}"
        )
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

impl LoadedLaw {
    /// The law of an interface that this law of solids makes in a zone. It has its id, parameters
    /// and internal variables, and the zone's stresses.
    ///
    /// # Errors
    /// The law is not for solids, or the zone does not fit; in words.
    pub fn in_shear_zone(&self, zone: ShearZone) -> Result<Self, String> {
        if let Some((_, why)) = zone.fault() {
            return Err(why);
        }
        let law = self.description();
        let id = &law.id;
        let Some(solid) = hypothesis(law) else {
            return Err(format!(
                "a shear zone is made from a law of solids; law `{id}` is made for {}",
                law.hypotheses()
            ));
        };
        let inner = law.formulation(solid).into_iter();
        let mut inner = inner.flat_map(|formulation| &formulation.internal_variables);
        let own: Vec<String> = variables(solid).map(|variable| variable.id).collect();
        let taken = inner.find_map(|variable| own.iter().find(|own| **own == variable.id));
        if let Some(taken) = taken {
            return Err(format!(
                "law `{id}` has an internal variable `{taken}`, as the zone calls one of its own stresses"
            ));
        }
        let formulation = law.formulation(solid).into_iter();
        let formulation = formulation.map(|solid_formulation| FormulationDescription {
            hypothesis: Hypothesis::Interface2d.name(),
            linear: false,
            local_axes: false,
            internal_variables: solid_formulation
                .internal_variables
                .iter()
                .cloned()
                .chain(variables(solid))
                .collect(),
            ..solid_formulation.clone()
        });
        let description = LawDescription {
            name: format!("Shear zone of {}", law.name),
            formulations: formulation.collect(),
            ..law.clone()
        };
        let own = self.library();
        Ok(Self {
            number: 0,
            library: Arc::new(Library {
                path: own.path.clone(),
                sha256: own.sha256.clone(),
                warnings: own.warnings.clone(),
                stamp: own.stamp,
                laws: vec![(description, Origin::Zone(zone, Box::new(self.clone())))],
                foreign: own.foreign.clone(),
                sidecar: own.sidecar.clone(),
                call_limit: own.call_limit,
            }),
        })
    }

    /// The zone that it fills, if it is the law of one.
    pub fn shear_zone(&self) -> Option<ShearZone> {
        match &self.library.laws[self.number].1 {
            Origin::Zone(zone, _) => Some(*zone),
            _ => None,
        }
    }
}

/// A zone whose law has its parameters.
#[derive(Debug)]
pub(crate) struct ZoneInstance {
    zone: ShearZone,
    law: Box<LawInstance>,
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

impl ZoneInstance {
    /// Fixes the parameters of the law.
    ///
    /// # Errors
    /// Those of the law.
    pub(crate) fn create(
        zone: ShearZone,
        law: &LoadedLaw,
        parameters: &[f64],
    ) -> Result<Self, CallFailure> {
        let description = law.description();
        let solid = hypothesis(description).and_then(|h| Some((h, description.formulation(h)?)));
        let Some((hypothesis, formulation)) = solid else {
            let message = "it is no law of solids".to_owned();
            return Err((raw::PILUM_E_INTERNAL, message));
        };
        Ok(Self {
            zone,
            law: Box::new(law.instance(hypothesis, parameters)?),
            n: hypothesis.n_components(),
            n_states: formulation.internal_variables.len(),
        })
    }

    /// Arguments that the law's routine has overwritten, those that were not told before.
    pub(crate) fn take_overwritten(&self) -> Vec<String> {
        self.law.take_overwritten()
    }

    /// Places of the zone's own variables among the components.
    fn own(&self) -> impl Iterator<Item = usize> {
        let n = self.n;
        OF_ZONE.into_iter().filter(move |place| *place < n)
    }

    /// Initial internal variables: those of the law for the whole stress, and that stress.
    pub(crate) fn init_state(&self, call: Call<'_>) -> (Status, String) {
        ROOM.with_borrow_mut(|room| self.init_state_in(room, call))
    }

    fn init_state_in(&self, room: &mut Room, call: Call<'_>) -> (Status, String) {
        let (n, n_states, points) = (self.n, self.n_states, call.n_points);
        let stress = unwritten(&mut room.stress, points * n);
        let state = unwritten(&mut room.state_end, points * n_states);
        for (i, stress) in stress.chunks_exact_mut(n).enumerate() {
            stress.fill(0.0);
            for (c, place) in OF_INTERFACE.into_iter().enumerate() {
                stress[place] = value(call.flux0, i, c);
            }
            for place in LATERAL {
                stress[place] = self.zone.lateral_ratio * stress[OF_INTERFACE[0]];
            }
            let whole = &mut call.state1[i * call.n_states..][..call.n_states];
            let (law, own) = whole.split_at_mut(n_states);
            state[i * n_states..][..n_states].copy_from_slice(law);
            for (own, place) in own.iter_mut().zip(self.own()) {
                *own = stress[place];
            }
        }
        let inner = Call {
            n_components: n,
            n_states,
            flux0: (stress, Strided::rows(n)),
            state1: &mut *state,
            status: &mut *call.status,
            step_factor: &mut *call.step_factor,
            ..call
        };
        let answer = self.law.init_state(inner);
        let Some(answer) = answer else {
            call.status[..points].fill(raw::PILUM_OK);
            return (raw::PILUM_OK, String::new());
        };
        for i in 0..points {
            let law = &mut call.state1[i * call.n_states..][..n_states];
            law.copy_from_slice(&state[i * n_states..][..n_states]);
        }
        answer
    }

    /// Carries the points over the increment. Returns the most severe status and a message.
    pub(crate) fn integrate(&self, call: Call<'_>) -> (Status, String) {
        ROOM.with_borrow_mut(|room| self.integrate_in(room, call))
    }

    fn integrate_in(&self, room: &mut Room, call: Call<'_>) -> (Status, String) {
        let (n, n_states, points) = (self.n, self.n_states, call.n_points);
        let n_all = call.n_states;
        let wants_operator = call.request & (raw::PILUM_REQ_TANGENT | raw::PILUM_REQ_ELASTIC) != 0;
        let n_operator = if wants_operator { n * n } else { 0 };
        let strain = unwritten(&mut room.strain, points * n);
        let strain_end = unwritten(&mut room.strain_end, points * n);
        for (strain, jump) in [(&mut *strain, call.gradient0), (strain_end, call.gradient1)] {
            strain.fill(0.0);
            let Some(jump) = jump else { continue };
            for (i, strain) in strain.chunks_exact_mut(n).enumerate() {
                for (c, place) in OF_INTERFACE.into_iter().enumerate() {
                    strain[place] = value(jump, i, c) / self.zone.thickness;
                }
            }
        }
        let stress = unwritten(&mut room.stress, points * n);
        let state = unwritten(&mut room.state, points * n_states);
        for (i, stress) in stress.chunks_exact_mut(n).enumerate() {
            let (law, own) = call.state0[i * n_all..][..n_all].split_at(n_states);
            state[i * n_states..][..n_states].copy_from_slice(law);
            for (c, place) in OF_INTERFACE.into_iter().enumerate() {
                stress[place] = value(call.flux0, i, c);
            }
            for (own, place) in own.iter().zip(self.own()) {
                stress[place] = *own;
            }
        }
        let stress_end = unwritten(&mut room.stress_end, points * n);
        let state_end = unwritten(&mut room.state_end, points * n_states);
        let operator = unwritten(&mut room.operator, points * n_operator);
        let rows = Strided::rows(n);
        let answer = self.law.integrate(Call {
            request: call.request,
            n_points: points,
            n_components: n,
            n_states,
            time: call.time,
            time_increment: call.time_increment,
            moment: call.moment,
            sites: call.sites,
            gradient0: Some((&room.strain, rows)),
            gradient1: Some((&room.strain_end, rows)),
            flux0: (stress, rows),
            state0: state,
            flux1: Some((&mut *stress_end, rows)),
            state1: &mut *state_end,
            tangent: &mut *operator,
            status: call.status,
            step_factor: call.step_factor,
        });
        for i in 0..points {
            let stress_end = &stress_end[i * n..][..n];
            let (law, own) = call.state1[i * n_all..][..n_all].split_at_mut(n_states);
            law.copy_from_slice(&state_end[i * n_states..][..n_states]);
            for (own, place) in own.iter_mut().zip(self.own()) {
                *own = stress_end[place];
            }
        }
        if let Some((flux, place)) = call.flux1 {
            for i in 0..points {
                let first = place.offset + i * place.point;
                for (c, of_solid) in OF_INTERFACE.into_iter().enumerate() {
                    flux[first + c * place.component] = stress_end[i * n + of_solid];
                }
            }
        }
        let entries = call.tangent.chunks_exact_mut(OF_INTERFACE.len().pow(2));
        if wants_operator {
            for (entries, solid) in entries.zip(operator.chunks_exact(n * n)) {
                let places = OF_INTERFACE
                    .into_iter()
                    .flat_map(|row| OF_INTERFACE.map(|column| row * n + column));
                for (entry, of_solid) in entries.iter_mut().zip(places) {
                    *entry = solid[of_solid] / self.zone.thickness;
                }
            }
        }
        answer
    }
}

/// Component `c` of a point.
fn value((values, place): (&[f64], Strided), point: usize, c: usize) -> f64 {
    values[place.offset + point * place.point + c * place.component]
}
