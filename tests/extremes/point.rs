//! A law behind its library, called at one point.

use crate::matrix::Verdict;
use abi::Hypothesis;
use abi::status::Outcome;
use law::{BatchFailure, End, Law, LoadedLaw, Operator, SearchPath, Start, Strided};
use std::collections::BTreeMap;
use std::sync::Mutex;

/// Values of parameters by id.
pub(crate) type Values<'a> = &'a [(&'a str, f64)];

/// A point that follows a path. Gradients are handed over as increments from 0, so that no digit
/// of an increment is lost in a total.
#[derive(Debug)]
pub(crate) struct Point {
    pub(crate) law: Law,
    pub(crate) flux: Vec<f64>,
    pub(crate) state: Vec<f64>,
}

/// What a law returns.
#[derive(Clone, Debug)]
pub(crate) struct Response {
    pub(crate) flux: Vec<f64>,
    pub(crate) state: Vec<f64>,
    pub(crate) tangent: Vec<f64>,
}

/// Builds a law; what is not named takes its default or is left out.
///
/// # Errors
/// The law's refusal, or a value outside its bounds, in words.
pub(crate) fn law(id: &str, hypothesis: Hypothesis, values: Values<'_>) -> Result<Law, String> {
    static LOADED: Mutex<BTreeMap<String, LoadedLaw>> = Mutex::new(BTreeMap::new());
    let loaded = LOADED
        .lock()
        .unwrap()
        .entry(id.to_owned())
        .or_insert_with(|| SearchPath::new(&[]).law(id).unwrap())
        .clone();
    let parameters = &loaded.description().parameters;
    for (name, _) in values {
        assert!(parameters.iter().any(|p| p.id == *name), "{id}: {name}");
    }
    let mut all = vec![];
    for p in parameters {
        let given = values.iter().rev().find(|(name, _)| *name == p.id);
        let value = given.map_or(p.default.unwrap_or(f64::NAN), |(_, value)| *value);
        if given.is_some() && !value.is_nan() && !p.bounds.contain(value) {
            return Err(format!("{}: {value} is outside {}", p.id, p.bounds));
        }
        all.push(value);
    }
    loaded.build(hypothesis, &all).map_err(|why| why.reason)
}

/// A refusal in a line.
pub(crate) fn reason(failure: &BatchFailure) -> String {
    format!("{:?}: {}", failure.outcome, failure.message)
}

impl Point {
    /// A point that carries this flux.
    pub(crate) fn new(law: Law, flux: &[f64]) -> Result<Self, BatchFailure> {
        let state = law.initial_state(1, (flux, Strided::rows(flux.len())))?;
        Ok(Self {
            law,
            flux: flux.to_vec(),
            state,
        })
    }

    /// The response to an increment; the point stays where it is.
    pub(crate) fn respond(
        &self,
        increment: &[f64],
        operator: Operator,
    ) -> Result<Response, BatchFailure> {
        let n = self.flux.len();
        let rows = Strided::rows(n);
        let wanted = if operator == Operator::None { 0 } else { n * n };
        let mut end = Response {
            flux: vec![0.0; n],
            state: vec![0.0; self.state.len()],
            tangent: vec![0.0; wanted],
        };
        let start = Start {
            n_points: 1,
            gradient: (&vec![0.0; n], rows),
            gradient_end: (increment, rows),
            flux: (&self.flux, rows),
            state: &self.state,
            time: 0.0,
            time_increment: 1.0,
            moment: law::Moment::default(),
            sites: &[],
        };
        let success = self.law.integrate(
            &start,
            operator,
            End {
                flux: (&mut end.flux, rows),
                state: &mut end.state,
                operator: &mut end.tangent,
            },
        )?;
        assert!(success.unreliable.is_none(), "no law here is unreliable");
        Ok(end)
    }

    /// Takes an increment, in smaller ones where the law asks for them. After each, `seen` gets
    /// flux and internal variables at its start, the increment, and the response.
    pub(crate) fn advance(
        &mut self,
        increment: &[f64],
        mut seen: impl FnMut(&[f64], &[f64], &[f64], &Response) -> Result<(), String>,
    ) -> Verdict {
        const CUTS: usize = 60;
        let (mut left, mut part, mut cuts) = (1.0, 1.0, 0);
        while left > 0.0 {
            let piece: Vec<f64> = increment.iter().map(|d| d * part).collect();
            match self.respond(&piece, Operator::Consistent) {
                Ok(end) => {
                    let all = end.flux.iter().chain(&end.state).chain(&end.tangent);
                    if !all.into_iter().all(|v| v.is_finite()) {
                        return Verdict::Silent(format!("not finite: {end:?}"));
                    }
                    if let Err(what) = seen(&self.flux, &self.state, &piece, &end) {
                        return Verdict::Silent(what);
                    }
                    (self.flux, self.state) = (end.flux, end.state);
                    left -= part;
                    part = left.min(2.0 * part);
                }
                Err(failure) if failure.outcome == Outcome::CutStep && cuts < CUTS => {
                    cuts += 1;
                    part *= failure.factor.unwrap_or(0.5).clamp(0.1, 0.9);
                }
                Err(failure) => return Verdict::Refused(reason(&failure)),
            }
        }
        Verdict::Agrees
    }

    /// Takes an increment.
    pub(crate) fn step(&mut self, increment: &[f64]) -> Result<(), BatchFailure> {
        let end = self.respond(increment, Operator::None)?;
        (self.flux, self.state) = (end.flux, end.state);
        Ok(())
    }
}
