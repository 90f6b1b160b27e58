//! A driver: a law, its start, and its path.

use crate::error::{Cause, Error, Failure, Misuse, Place};
use crate::path::{self, Segment};
use crate::search::Search;
use crate::state::{N_MAX, Point, Vector};
use abi::status::Outcome;
use law::{Law, Stop, Strided, words};

/// Column of the time.
pub const TIME: &str = "time";
/// Relative change of the initial flux that is worth a warning.
const OUTSIDE: f64 = 1e-9;

/// One law at one integration point, its initial state, and the path that leads it from there.
///
/// The gradient starts from 0. See the [crate] for units and signs.
#[derive(Debug)]
pub struct Driver {
    pub(crate) law: Law,
    pub(crate) segments: Vec<Segment>,
    notes: Vec<String>,
    variant: Option<String>,
    flux: Vector,
    internal: Vec<f64>,
    stop: Stop,
}

impl Driver {
    /// A law that starts from a flux (one value for each component of its hypothesis, kPa) with the
    /// internal variables that it gives to it, and is led through segments.
    ///
    /// # Errors
    /// [`Error::Misuse`] if flux or segments do not fit; [`Error::InitialState`] if the law refuses
    /// the flux; [`Error::Failure`] if it breaks down over it.
    pub fn new(law: Law, flux: &[f64], segments: Vec<Segment>) -> Result<Self, Error> {
        path::check(&segments, law.hypothesis())?;
        let n = law.n_components();
        finite(flux, n)?;
        let mut padded = [0.0; N_MAX];
        padded[..n].copy_from_slice(flux);
        let mut driver = Self {
            law,
            segments,
            notes: Vec::new(),
            variant: None,
            flux: padded,
            internal: Vec::new(),
            stop: Stop::never(),
        };
        driver.internal = driver.internal_of_law()?;
        Ok(driver)
    }

    /// Starts from these internal variables, in the law's order, instead of those that it gives.
    ///
    /// # Errors
    /// [`Error::Misuse`]: not as many as the law has, or not finite.
    pub fn set_internal(&mut self, internal: Vec<f64>) -> Result<(), Error> {
        finite(&internal, self.law.n_states())?;
        self.internal = internal;
        Ok(())
    }

    /// Warnings that are known before the first call.
    pub fn set_notes(&mut self, notes: Vec<String>) {
        self.notes = notes;
    }

    /// Tells the driver from others of the same kind: messages begin with the name.
    pub fn set_variant(&mut self, variant: Option<String>) {
        self.variant = variant;
    }

    /// Lets the driver be stopped on its way.
    pub fn stop_on(&mut self, stop: &Stop) {
        self.stop = stop.clone();
    }

    /// Follows the same path in other increments, one number for each segment, at least 1.
    pub fn set_increments(&mut self, increments: &[usize]) {
        for (segment, &increments) in self.segments.iter_mut().zip(increments) {
            segment.increments = increments.max(1);
        }
    }

    /// The law.
    pub fn law(&self) -> &Law {
        &self.law
    }

    /// The path.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The flux that it starts from, by component.
    pub fn flux(&self) -> &[f64] {
        &self.flux[..self.law.n_components()]
    }

    /// The internal variables that it starts from, in the law's order.
    pub fn internal(&self) -> &[f64] {
        &self.internal
    }

    /// What tells it from other drivers.
    pub fn variant(&self) -> Option<&str> {
        self.variant.as_deref()
    }

    /// Who may want it to stop.
    pub fn stop(&self) -> &Stop {
        &self.stop
    }

    /// Increments of each segment.
    pub fn segment_increments(&self) -> Vec<usize> {
        self.segments.iter().map(|s| s.increments).collect()
    }

    /// Number of increments of all segments.
    pub fn n_increments(&self) -> usize {
        self.segments.iter().map(|segment| segment.increments).sum()
    }

    /// Whether its rows say the time: where a segment says how long it takes, and the law has no internal
    /// variable of this name.
    pub fn is_timed(&self) -> bool {
        let variables = &self.law.formulation().internal_variables;
        self.segments.iter().any(|segment| segment.time.is_some())
            && variables.iter().all(|variable| variable.id != TIME)
    }

    /// The value of a parameter of the law, of a choice its number; `None` if there is no such
    /// parameter, or it is left to the law.
    pub fn parameter(&self, id: &str) -> Option<f64> {
        let declared = &self.law.description().parameters;
        let number = declared.iter().position(|p| p.id == id)?;
        let value = *self.law.parameters().get(number)?;
        (!value.is_nan()).then_some(value)
    }

    /// Asks the law for an update of no size from the initial state, as [`Driver::run`] does first.
    ///
    /// # Errors
    /// As [`Driver::run`] before its first increment.
    pub fn check(&self) -> Result<Vec<String>, Error> {
        self.start().map(|(_, _, warnings)| warnings)
    }

    /// The initial state, checked by an update of no size.
    pub(crate) fn start(&self) -> Result<(Point, Search<'_>, Vec<String>), Error> {
        let point = Point {
            gradient: [0.0; N_MAX],
            flux: self.flux,
            internal: self.internal.clone(),
        };
        let mut search = Search::new(&self.law, &point);
        search.stop = self.stop.clone();
        search.moment.step_length = self.length_of_step(0);
        let mut warnings = self.notes.clone();
        let dependence = self.law.time_dependence();
        let depends_on_time = dependence.is_some();
        let says_none = |segment: &Segment| segment.time.is_none();
        let first = self.segments.iter().position(says_none);
        if let (Some(number), Some(by)) = (first, dependence) {
            warnings.push(format!(
                "law `{}`{by} depends on the time, and segment {} says none: each of its increments \
                 takes 1",
                self.law.description().id,
                number + 1
            ));
        }
        let failure = |cause| Error::from(self.failure(Place::Start, cause));
        let answer = search
            .at_rest(&point)
            .map_err(|fatal| failure(Cause::Law(*fatal)))?;
        let Some(returned) = answer else {
            if self.stop.is_asked() {
                return Err(failure(Cause::Stopped));
            }
            let refusal = search.take_obstacle().refusal;
            return Err(self.refused(refusal.map(|refusal| refusal.message).unwrap_or_default()));
        };
        // What a law does in the time of this call is what it is for.
        if !depends_on_time {
            warnings.extend(self.moved(&returned));
        }
        Ok((point, search, warnings))
    }

    /// What to say of an initial flux that an update of no size moves.
    fn moved(&self, returned: &Vector) -> Option<String> {
        let n = self.law.n_components();
        let (given, returned) = (&self.flux[..n], &returned[..n]);
        let scale = self.flux.iter().fold(0.0_f64, |max, v| max.max(v.abs()));
        let mut pairs = returned.iter().zip(given);
        if !pairs.any(|(returned, given)| (returned - given).abs() > OUTSIDE * scale) {
            return None;
        }
        let (id, hypothesis) = (&self.law.description().id, self.law.hypothesis());
        let (_, word) = words(hypothesis);
        let list = |flux: &[f64]| {
            let values = hypothesis.components().iter().zip(flux);
            let values = values.map(|(name, value)| format!("{name} = {value:.6}"));
            values.collect::<Vec<_>>().join(", ")
        };
        let (given, returned) = (list(given), list(returned));
        // Those of other programs are given a time in this call, in which they may creep.
        Some(if self.law.library().foreign().is_some() {
            format!(
                "the initial {word} {given} does not last: law `{id}`, called without any change, \
                 returns {returned}"
            )
        } else {
            format!(
                "the initial {word} {given} lies outside the surface of law `{id}`, which returns it \
                 to {returned}"
            )
        })
    }

    /// The internal variables that the law gives to the initial flux.
    fn internal_of_law(&self) -> Result<Vec<f64>, Error> {
        let flux = (self.flux(), Strided::rows(self.law.n_components()));
        self.law
            .initial_state(1, flux)
            .map_err(|failure| match failure.outcome {
                Outcome::Domain | Outcome::Numeric | Outcome::CutStep => {
                    self.refused(failure.message)
                }
                _ => Error::from(self.failure(Place::Start, Cause::InitialState(failure))),
            })
    }

    fn refused(&self, reason: String) -> Error {
        Error::InitialState {
            law: self.law.description().id.clone(),
            reason,
        }
    }

    pub(crate) fn failure(&self, place: Place, cause: Cause) -> Failure {
        Failure {
            variant: self.variant.clone(),
            place,
            law: self.law.description().id.clone(),
            library: self.law.library().path().to_owned(),
            hypothesis: self.law.hypothesis(),
            cause,
            warnings: Vec::new(),
            is_without_stiffness: false,
            advice: None,
        }
    }
}

/// So many values, all finite.
fn finite(values: &[f64], expected: usize) -> Result<(), Misuse> {
    let given = values.len();
    if given != expected {
        return Err(Misuse::Length { given, expected });
    }
    let infinite = values.iter().find(|value| !value.is_finite());
    infinite.map_or(Ok(()), |value| Err(Misuse::NotFinite(*value)))
}
