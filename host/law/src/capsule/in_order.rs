//! The values of a capsule, which have names in the file, in the order of a law.

use super::{Capsule, Named, PointPart, Values};
use crate::call::PointStart;
use crate::description::{FormulationDescription, words};
use crate::{Error, Law, PointCall, Request};
use abi::Hypothesis;
use text::suggestion;

impl Capsule {
    /// Points of the batch, and those that were called for before, in the order of this law's values.
    ///
    /// # Errors
    /// A name that the law does not know, or that is missing.
    pub fn batch(
        &self,
        hypothesis: Hypothesis,
        formulation: &FormulationDescription,
    ) -> Result<[Vec<PointStart>; 2], Error> {
        let law = (hypothesis, formulation);
        let all = |parts: &[PointPart], key: &str| -> Result<Vec<PointStart>, Error> {
            let parts = parts.iter();
            let point =
                |part: &PointPart| self.point(law, (&part.start, &part.end), [key, key], false);
            parts.map(point).collect()
        };
        let mut points = Vec::new();
        if !self.start.flux().is_empty() {
            let first = (&self.start, &self.end);
            points.push(self.point(law, first, ["start", "end"], false)?);
        }
        points.extend(all(&self.more, "point")?);
        Ok([points, all(&self.before, "before")?])
    }

    /// A point in the order of a law's values. `keys` lead to its start and end; what is left out stays so unless
    /// `is_whole`.
    fn point(
        &self,
        (hypothesis, formulation): (Hypothesis, &FormulationDescription),
        (start, end): (&Values, &Values),
        keys: [&str; 2],
        is_whole: bool,
    ) -> Result<PointStart, Error> {
        let (gradient, flux) = words(hypothesis);
        let in_order = |values: &Named, names: &[&str], keys: &[&str], what: &str| {
            if values.is_empty() && !is_whole {
                return Ok(Vec::new());
            }
            self.in_order(values, names.iter().copied(), keys, what)
        };
        let components = hypothesis.components();
        let variables = formulation.internal_variables.iter();
        let ids: Vec<&str> = variables.map(|v| v.id.as_str()).collect();
        let [at_start, at_end] = keys;
        Ok(PointStart {
            gradient0: in_order(
                start.gradient(),
                components,
                &[at_start, gradient],
                gradient,
            )?,
            gradient1: in_order(end.gradient(), components, &[at_end, gradient], gradient)?,
            flux0: in_order(start.flux(), components, &[at_start, flux], flux)?,
            state0: in_order(
                &start.internal,
                &ids,
                &[at_start, "internal"],
                "internal variable",
            )?,
        })
    }

    /// The values of a table in the order of some names. `keys`: what leads to the table.
    ///
    /// # Errors
    /// The name that is missing, or too much.
    pub fn in_order<'a>(
        &self,
        values: &Named,
        names: impl Iterator<Item = &'a str> + Clone,
        keys: &[&str],
        what: &str,
    ) -> Result<Vec<f64>, Error> {
        if let Some(other) = values.keys().find(|key| !names.clone().any(|n| n == *key)) {
            let keys = [keys, &[other]].concat();
            let names: Vec<&str> = names.collect();
            let message = format!("law `{}` has no {what} `{other}`", self.law.id);
            return Err(self
                .error(&keys, message)
                .with_hint(&suggestion(other, names)));
        }
        names
            .map(|name| {
                let value = values.get(name).copied();
                value.ok_or_else(|| self.error(keys, format!("the {what} `{name}` is missing")))
            })
            .collect()
    }

    /// The call, with its values in the order of this law.
    ///
    /// # Errors
    /// A name that the law does not know, or that is missing.
    pub fn point_call(&self, law: &Law) -> Result<PointCall, Error> {
        let request = self.request().ok_or_else(|| {
            let message = format!("there is no request `{}`", self.call.request);
            self.error(&["call", "request"], message)
        })?;
        let is_whole = request != Request::InitialState;
        let law = (law.hypothesis(), law.formulation());
        let part = (&self.start, &self.end);
        Ok(PointCall {
            request,
            start: self.point(law, part, ["start", "end"], is_whole)?,
            time: self.call.time,
            time_increment: self.call.time_increment,
            moment: self.call.moment.unwrap_or_default(),
            site: self.call.site.unwrap_or_default(),
        })
    }
}
