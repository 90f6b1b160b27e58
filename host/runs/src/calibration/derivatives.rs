//! Derivatives of what tests compute by parameters, as the search counts.

use super::model::{Model, Subject};
use super::rates;
use crate::Error;
use crate::experiment::Rows;
use results::point_figure::drawable;

/// Sides from which differences are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sides {
    /// Both, as far as bounds and the law let.
    Both,
    /// The first that has an answer.
    One,
}

impl Model {
    /// Derivatives of what a test computes at its measured points by one parameter: central differences,
    /// one-sided at bounds and where a side has no answer; `None` where neither has.
    ///
    /// # Errors
    /// As [`Model::computed`].
    pub(super) fn difference(
        &mut self,
        test: usize,
        parameter: usize,
        (counted, here): (&[f64], &[f64]),
        wanted: Sides,
    ) -> Result<Option<Vec<f64>>, Error> {
        let [lower, upper] = self.parameters[parameter].counted_bounds();
        let mut sides = Vec::new();
        for sign in [1.0, -1.0] {
            let mut place = counted.to_vec();
            place[parameter] += sign * self.difference;
            if (lower..=upper).contains(&place[parameter])
                && let Ok(there) = self.computed(test, &place)?
            {
                sides.push((place[parameter], there));
            }
            if wanted == Sides::One && !sides.is_empty() {
                break;
            }
        }
        let (a, b) = match sides.as_slice() {
            [(a, above), (b, below)] => ((*a, above.as_slice()), (*b, below.as_slice())),
            [(a, side)] => ((*a, side.as_slice()), (counted[parameter], here)),
            _ => return Ok(None),
        };
        let pairs = a.1.iter().zip(b.1);
        Ok(Some(pairs.map(|(x, y)| (x - y) / (a.0 - b.0)).collect()))
    }

    /// Derivatives of what a test computes at all measured points: a column for each parameter, `None`
    /// where absent to be had.
    ///
    /// # Errors
    /// As [`Model::computed`].
    pub(super) fn gradients(
        &mut self,
        test: usize,
        counted: &[f64],
        parameters: &[usize],
    ) -> Result<Vec<Option<Vec<f64>>>, Error> {
        let n = self.tests[test].n_points();
        let here = self.computed(test, counted)?;
        let mut columns = Vec::new();
        for &parameter in parameters {
            columns.push(match &here {
                _ if !self.tests[test].has(parameter) => Some(vec![0.0; n]),
                Ok(here) => self.difference(test, parameter, (counted, here), Sides::Both)?,
                Err(_) => None,
            });
        }
        Ok(columns)
    }

    /// The same of its residuals, from the rates of its law; `None` if it gives none, or an increment took
    /// several steps.
    ///
    /// # Errors
    /// As [`Model::computed`].
    pub(super) fn derivatives_by_law(
        &mut self,
        test: usize,
        counted: &[f64],
        parameters: &[usize],
    ) -> Result<Option<Vec<Vec<f64>>>, Error> {
        self.tests[test].is_by_law = false;
        if !matches!(&self.tests[test].subject, Subject::Driver(driver) if rates::are_given(driver))
        {
            return Ok(None);
        }
        self.stop.check("the calibration")?;
        let columns = self.once(test, counted, parameters, |model| {
            let columns = model.followed(test, counted, parameters);
            Ok(columns.ok_or_else(|| "no rates".to_owned()))
        })?;
        // What is kept depends neither on noise and weights, nor on how parameters are counted.
        let of_test = &self.tests[test];
        let values = self.values(counted);
        let weighed = |(&parameter, mut column): (&usize, Vec<f64>)| {
            let slope = self.parameters[parameter].slope(values[parameter]);
            for derivative in &mut column {
                *derivative *= slope;
            }
            of_test.weighed(&column)
        };
        let weighed = columns
            .ok()
            .map(|all| parameters.iter().zip(all).map(weighed).collect());
        self.tests[test].is_by_law = weighed.is_some();
        Ok(weighed)
    }

    /// Derivatives of what a test computes at its measured points by the values of parameters, followed through its
    /// driver.
    fn followed(
        &self,
        test: usize,
        counted: &[f64],
        parameters: &[usize],
    ) -> Option<Vec<Vec<f64>>> {
        let values = self.values(counted);
        let Ok(Subject::Driver(driver)) = self.tests[test].with(&values) else {
            return None;
        };
        let targets = &self.tests[test].targets;
        let declared = &driver.point().law().description().parameters;
        let number = |parameter: usize| {
            let (.., id) = targets.iter().find(|(p, ..)| *p == parameter)?;
            declared.iter().position(|p| p.id == *id)
        };
        let own: Vec<usize> = parameters.iter().filter_map(|&p| number(p)).collect();
        let Ok(Some(followed)) = rates::follow(&driver, &own) else {
            return None;
        };
        let rows = Rows {
            names: drawable(driver.point()),
            stretches: followed.stretches,
            ..Rows::default()
        };
        let mut of_own = followed.derivatives.into_iter();
        let mut columns = Vec::new();
        for &parameter in parameters {
            let mut column = vec![0.0; self.tests[test].n_points()];
            if number(parameter).is_some()
                && let Some(of_rows) = of_own.next()
            {
                column.clear();
                for curve in &self.tests[test].curves {
                    let Ok(derivatives) = curve.derivatives(&rows, &of_rows, &values) else {
                        return None;
                    };
                    column.extend(derivatives);
                }
            }
            columns.push(column);
        }
        Some(columns)
    }
}
