//! The fit of a stage: the parameters of a group fitted to the tests, from several starts.

use super::coordinates::spread;
use super::derivatives::Sides;
use super::least_squares::{Minimum, Problem, Settings, minimise};
use super::model::Model;
use super::profile::{Profile, follow};
use super::stage::{Group, Landing, Stage, known, known_to, optima};
use crate::Error;
use input::calibration::Variance;
use nalgebra::{DMatrix, DVector};

/// Task of a fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wish {
    pub(super) starts: usize,
    pub(super) seed: u64,
    pub(super) variance: Variance,
    pub(super) confidence: f64,
    pub(super) profiles: bool,
}

/// The parameters of a group, some of them held.
pub(super) struct Search<'m> {
    pub(super) model: &'m mut Model,
    pub(super) group: &'m Group,
    /// All parameters of the model; those of the group are put in.
    pub(super) all: Vec<f64>,
    /// The parameters that move, by place in the group.
    pub(super) moving: Vec<usize>,
    /// Differences of a slow test make do with one side.
    pub(super) is_one_sided: bool,
}

impl Search<'_> {
    fn put(&mut self, u: &[f64]) {
        for (&place, &u) in self.moving.iter().zip(u) {
            self.all[self.group.parameters[place]] = u;
        }
    }

    /// Residuals of a test at a place.
    fn of_test(&mut self, test: usize, place: &[f64]) -> Result<Option<Vec<f64>>, Error> {
        let computed = self.model.computed(test, place)?.ok();
        Ok(computed.map(|values| self.model.tests[test].residuals(&values)))
    }

    /// Derivatives of a test's residuals by one parameter.
    fn derivative(&mut self, test: usize, parameter: usize) -> Result<Option<Vec<f64>>, Error> {
        let sides = if self.is_one_sided && self.model.tests[test].is_slow() {
            Sides::One
        } else {
            Sides::Both
        };
        let Ok(here) = self.model.computed(test, &self.all)? else {
            return Ok(None);
        };
        let derivative = self
            .model
            .difference(test, parameter, (&self.all, &here), sides)?;
        Ok(derivative.map(|derivative| self.model.tests[test].weighed(&derivative)))
    }
}

impl Problem for Search<'_> {
    type Error = Error;

    fn residuals(&mut self, u: &[f64]) -> Result<Option<DVector<f64>>, Error> {
        self.put(u);
        let place = self.all.clone();
        let mut all = Vec::new();
        for &test in &self.group.tests {
            match self.of_test(test, &place)? {
                Some(residuals) => all.extend(residuals),
                None => return Ok(None),
            }
        }
        Ok(Some(DVector::from_vec(all)))
    }

    fn jacobian(
        &mut self,
        u: &[f64],
        residuals: &DVector<f64>,
    ) -> Result<Option<DMatrix<f64>>, Error> {
        self.put(u);
        let mut jacobian = DMatrix::zeros(residuals.len(), self.moving.len());
        let mut first = 0;
        for &test in &self.group.tests {
            let n = self.model.tests[test].n_points();
            let moving = self.moving.clone();
            let numbers: Vec<usize> = moving.iter().map(|&p| self.group.parameters[p]).collect();
            let by_law = self.model.derivatives_by_law(test, &self.all, &numbers)?;
            for (column, parameter) in numbers.into_iter().enumerate() {
                if !self.model.tests[test].has(parameter) {
                    continue;
                }
                let derivative = match &by_law {
                    // A law's rates say nothing of how a curve was read.
                    Some(columns) if self.model.parameters[parameter].of_curve.is_none() => {
                        Some(columns[column].clone())
                    }
                    _ => self.derivative(test, parameter)?,
                };
                let Some(derivative) = derivative else {
                    return Ok(None);
                };
                jacobian
                    .view_mut((first, column), (n, 1))
                    .copy_from_slice(&derivative);
            }
            first += n;
        }
        Ok(Some(jacobian))
    }
}

/// So many places are there for each start, should the tests not be computed at the first.
const RESERVE: usize = 4;
/// Most iterations from one start.
const ITERATIONS: usize = 60;
/// Longest step of the search: by a factor of e, or by the width of a range.
const LONGEST: f64 = 1.0;

/// When a search stops: what computed values are known to leaves nothing to look for.
fn settings(model: &Model, group: &Group) -> Settings {
    let exactness = model.exactness_of(&group.tests);
    Settings {
        reduction: 0.1 * exactness,
        step: (1e-2 * exactness.sqrt()).max(1e-9),
        gradient: exactness.sqrt().min(1e-3),
        least: known_to(model, group).derivatives,
        iterations: ITERATIONS,
        longest: LONGEST,
    }
}

/// Fits a group; `values` are all parameters of the model as the search counts, those of the group where
/// it starts. `None` if the tests can be computed at no start.
///
/// # Errors
/// Stopped; a test that cannot be computed for a reason other than the values.
pub(super) fn fit(
    model: &mut Model,
    group: &Group,
    values: &[f64],
    wish: Wish,
    say: &mut dyn FnMut(&str),
) -> Result<Option<Stage>, Error> {
    let own = group.parameters.iter();
    let mut fit = Fit {
        bounds: own.map(|&p| model.parameters[p].counted_bounds()).collect(),
        settings: settings(model, group),
        model,
        group,
        values,
        wish,
        say,
    };
    let (mut landings, found) = fit.starts()?;
    let failures = found.iter().map(|minimum| minimum.failures).sum();
    let Some(mut best) = found.into_iter().min_by(|a, b| a.sum().total_cmp(&b.sum())) else {
        return Ok(None);
    };
    fit.keep_given(&mut best, &landings[0].from)?;
    let (mut is_renewed, mut was_tried) = (false, false);
    let (mut stage, profiles) = loop {
        let stage = known(fit.model, group, &best, &fit.bounds, wish);
        if !wish.profiles {
            break (stage, Vec::new());
        }
        let (profiles, better) = fit.profiles(&stage)?;
        let Some(from) = better.filter(|_| !was_tried) else {
            break (stage, profiles);
        };
        was_tried = true;
        match fit.search(&from, &fit.everything(), values)? {
            Some(minimum) if minimum.sum() < best.sum() => {
                is_renewed = true;
                best = minimum;
            }
            _ => break (stage, profiles),
        }
    };
    stage.profiles = profiles;
    stage.is_renewed = is_renewed;
    stage.failures = failures;
    stage.optima = optima(&stage, &mut landings, wish);
    stage.landings = landings;
    Ok(Some(stage))
}

/// The fit of a group.
struct Fit<'f> {
    model: &'f mut Model,
    group: &'f Group,
    bounds: Vec<[f64; 2]>,
    settings: Settings,
    values: &'f [f64],
    wish: Wish,
    say: &'f mut dyn FnMut(&str),
}

impl Fit<'_> {
    /// All parameters of the group, by place.
    fn everything(&self) -> Vec<usize> {
        (0..self.bounds.len()).collect()
    }

    fn problem(&mut self, moving: &[usize], all: &[f64]) -> Search<'_> {
        Search {
            model: self.model,
            group: self.group,
            all: all.to_vec(),
            moving: moving.to_vec(),
            is_one_sided: true,
        }
    }

    fn search(
        &mut self,
        from: &[f64],
        moving: &[usize],
        all: &[f64],
    ) -> Result<Option<Minimum>, Error> {
        let bounds: Vec<[f64; 2]> = moving.iter().map(|&place| self.bounds[place]).collect();
        let settings = self.settings;
        minimise(&mut self.problem(moving, all), from, &bounds, settings)
    }

    /// Searches from all starts.
    fn starts(&mut self) -> Result<(Vec<Landing>, Vec<Minimum>), Error> {
        let wish = self.wish;
        let own = self.group.parameters.iter();
        let ranges: Vec<[f64; 2]> = own
            .clone()
            .map(|&p| self.model.parameters[p].counted_range())
            .collect();
        // Some places are values that a law refuses: there are others in reserve.
        let others = wish.starts.saturating_sub(1);
        let mut starts = vec![own.map(|&p| self.values[p]).collect::<Vec<f64>>()];
        starts.extend(spread(&ranges, RESERVE * others, wish.seed));
        let mut landings = Vec::new();
        let mut found: Vec<Minimum> = Vec::new();
        for from in starts {
            if found.len() == wish.starts {
                break;
            }
            let minimum = self.search(&from, &self.everything(), self.values)?;
            let start = found.len() + 1;
            let what = format!("{}: start {start} of {}", self.group.name, wish.starts);
            (self.say)(&match &minimum {
                None => format!("{what}: the tests cannot be computed there, another is tried"),
                Some(minimum) => format!(
                    "{what}: sum of squares {:.4e} after {} iterations",
                    minimum.sum(),
                    minimum.iterations
                ),
            });
            landings.push(Landing {
                from,
                to: minimum.as_ref().map(|m| (m.u.clone(), m.sum())),
                iterations: minimum.as_ref().map_or(0, |m| m.iterations),
                end: minimum.as_ref().map(|m| m.end),
                optimum: None,
            });
            found.extend(minimum);
        }
        Ok((landings, found))
    }

    /// What nothing answers to keeps the value that was given, wherever the search happened to start.
    fn keep_given(&mut self, best: &mut Minimum, given: &[f64]) -> Result<(), Error> {
        let mut kept = best.u.clone();
        for (place, column) in best.jacobian.column_iter().enumerate() {
            if column.norm() <= self.settings.least {
                kept[place] = given[place];
            }
        }
        if kept == best.u {
            return Ok(());
        }
        let found = self
            .problem(&self.everything(), self.values)
            .residuals(&kept)?;
        let is_same = |residuals: &DVector<f64>| {
            let change = (residuals.norm_squared() - best.sum()).abs();
            change <= self.settings.reduction * best.sum()
        };
        if let Some(residuals) = found.filter(is_same) {
            (best.u, best.residuals) = (kept, residuals);
        }
        Ok(())
    }

    /// The profiles of all parameters that are seen, and a better place if one led there.
    fn profiles(&mut self, stage: &Stage) -> Result<(Vec<Profile>, Option<Vec<f64>>), Error> {
        let mut profiles = Vec::new();
        let mut better: Option<Vec<f64>> = None;
        for place in self.everything() {
            if !stage.seen[place] {
                profiles.push(Profile::default());
                continue;
            }
            let parameter = &self.model.parameters[self.group.parameters[place]];
            (self.say)(&format!(
                "{}: profile of {}",
                self.group.name, parameter.name
            ));
            let bounds = self.bounds[place];
            let mut others = |value: f64, near: &[f64]| self.others(place, value, near);
            let (profile, lower) = follow(stage, place, bounds, &mut others)?;
            better = better.or(lower);
            profiles.push(profile);
        }
        Ok((profiles, better))
    }

    /// The best of the other parameters for a value of one, looked for from a place nearby: that place, with the sum there.
    fn others(
        &mut self,
        place: usize,
        value: f64,
        near: &[f64],
    ) -> Result<Option<(Vec<f64>, f64)>, Error> {
        let moving: Vec<usize> = (0..near.len()).filter(|&i| i != place).collect();
        let mut all = self.values.to_vec();
        all[self.group.parameters[place]] = value;
        let found = if moving.is_empty() {
            let residuals = self.problem(&[], &all).residuals(&[])?;
            residuals.map(|residuals| (Vec::new(), residuals.norm_squared()))
        } else {
            let from: Vec<f64> = moving.iter().map(|&i| near[i]).collect();
            let minimum = self.search(&from, &moving, &all)?;
            minimum.map(|m| (m.u.clone(), m.sum()))
        };
        Ok(found.map(|(mut u, sum)| {
            u.insert(place, value);
            (u, sum)
        }))
    }
}
