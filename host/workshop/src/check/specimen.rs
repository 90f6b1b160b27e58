//! A law with its parameters: how it is called, and failures of it that can be repeated.

use super::loading_path::{Origin, Step, starts};
use super::points::{fluxes, with_fluxes};
use super::random::Random;
use super::{Verdict, failed, warned};
use abi::Hypothesis;
use abi::raw;
use abi::status::Outcome;
use law::capsule::Capsule;
use law::probe::call_log::Function;
use law::probe::{Answer, CreateForm, Form, PointEnd, PointStart, Probe};
use law::{
    BatchFailure, FormulationDescription, LoadedLaw, Moment, Operator, PointCall, Request, Site,
    hypothesis_named,
};
use std::fmt::Display;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// A call of a routine that is longer than this, in the mean of this many, is a slow one.
pub(super) const LONG: Duration = Duration::from_micros(300);
const TIMED: u32 = 8;
/// Series of them that must all be slow.
const SERIES: usize = 8;
/// The part of an increment's length in time that is next to none.
pub(super) const INSTANT: f64 = 1e-12;

/// A law under one hypothesis with one set of parameters.
#[derive(Debug)]
pub(super) struct Specimen {
    pub(super) law: LoadedLaw,
    pub(super) formulation: FormulationDescription,
    pub(super) hypothesis: Hypothesis,
    pub(super) values: Vec<f64>,
    pub(super) probe: Probe,
    /// The increments of the author's own path, if it is led along one.
    pub(super) course: Option<Vec<PointStart>>,
    /// Length of its increments in time.
    pub(super) time_increment: f64,
    /// Its paths are short: calls take long, or end the process far away.
    pub(super) is_led_near: bool,
    /// What it said when it first called itself defective: later it may say no more than that.
    pub(super) defect: OnceLock<String>,
}

/// The functions of a law that are called for points.
pub(super) const BOTH: [Function; 2] = [Function::Integrate, Function::InitState];

/// A function as the header calls it.
pub(super) fn name(function: Function) -> &'static str {
    match function {
        Function::Create => "create",
        Function::InitState => "init_state",
        Function::Integrate => "integrate",
        Function::Destroy => "destroy",
    }
}

/// Hypotheses a law offers, in the order of its library.
pub(super) fn hypotheses(law: &LoadedLaw) -> Vec<(FormulationDescription, Hypothesis)> {
    let offered = law.description().formulations.iter();
    let known = |f: &FormulationDescription| Some((f.clone(), hypothesis_named(f.hypothesis)?));
    offered.filter_map(known).collect()
}

/// The form of an ordinary `create`.
pub(crate) fn create_form<'a>(
    formulation: &FormulationDescription,
    hypothesis: Hypothesis,
    values: &'a [f64],
) -> CreateForm<'a> {
    CreateForm {
        formulation: formulation.index,
        values: Some(values),
        n_values: values.len(),
        message: Some(512),
        more_host: 0,
        host_minor: raw::PILUM_ABI_MINOR,
        hypothesis,
        n_states: formulation.internal_variables.len(),
        lacks_tangent: formulation.tangent == law::Tangent::None,
    }
}

impl Specimen {
    /// A law with these parameters, led along random paths.
    pub(super) fn of(
        law: LoadedLaw,
        (formulation, hypothesis): (FormulationDescription, Hypothesis),
        values: Vec<f64>,
        probe: Probe,
    ) -> Self {
        Self {
            law,
            formulation,
            hypothesis,
            values,
            probe,
            course: None,
            time_increment: 1.0,
            is_led_near: false,
            defect: OnceLock::new(),
        }
    }

    /// Law, hypothesis and parameters that are not the defaults, for messages.
    pub(super) fn name(&self) -> String {
        let parameters = self.law.description().parameters.iter().zip(&self.values);
        let values: Vec<String> = parameters
            .filter(|(p, value)| !value.is_nan() && p.default != Some(**value))
            .map(|(p, value)| format!("{} = {value}", p.id))
            .collect();
        let with = if values.is_empty() { "" } else { " with " };
        format!(
            "`{}` under {}{with}{}",
            self.law.description().id,
            self.hypothesis.name(),
            values.join(", ")
        )
    }

    /// A failure of this specimen.
    pub(super) fn fails(&self, why: impl Display) -> Verdict {
        failed(format!("{}: {why}", self.name()))
    }

    /// A warning of this specimen.
    pub(super) fn warns(&self, why: impl Display) -> Verdict {
        warned(format!("{}: {why}", self.name()))
    }

    /// A failure of this specimen in a call that can be repeated.
    pub(super) fn fails_for(&self, start: &PointStart, why: impl Display) -> Verdict {
        self.recorded(start, self.fails(why))
    }

    /// The same, with the place of the call at the end of its words.
    pub(super) fn fails_at(&self, start: &PointStart, why: impl Display) -> Verdict {
        self.fails_for(start, format_args!("{why}, at {}", self.at(start)))
    }

    /// A warning of this specimen in a call that can be repeated.
    pub(super) fn warns_for(&self, start: &PointStart, why: impl Display) -> Verdict {
        self.recorded(start, self.warns(why))
    }

    /// The same, with the place of the call at the end of its words.
    pub(super) fn warns_at(&self, start: &PointStart, why: impl Display) -> Verdict {
        self.warns_for(start, format_args!("{why}, at {}", self.at(start)))
    }

    /// A verdict with the call that it is about. Without a capsule the words remain.
    pub(super) fn recorded(&self, start: &PointStart, mut verdict: Verdict) -> Verdict {
        verdict.capsule = self.capsule(start, &verdict.why).map(Box::new);
        verdict
    }

    /// A failure of this specimen in a call of `init_state` for points that carry these fluxes, after
    /// one for others.
    pub(super) fn fails_to_start(
        &self,
        fluxes: &[Vec<f64>],
        form: &Form,
        before: &[Vec<f64>],
        why: impl Display,
    ) -> Verdict {
        let mut verdict = self.fails(why);
        let form = Form {
            request: 0,
            ..*form
        };
        let capsule = Capsule::of_probe(
            &self.law,
            &self.formulation,
            (self.hypothesis, &self.values),
            (Function::InitState, form),
            &with_fluxes(fluxes),
            &with_fluxes(before),
        );
        verdict.capsule = capsule.map(|mut capsule| {
            capsule.outcome.message.clone_from(&verdict.why);
            Box::new(capsule)
        });
        verdict
    }

    /// A failure of one of the functions at a point of a batch, after a call for other points.
    pub(super) fn fails_in(
        &self,
        function: Function,
        (starts, i): (&[PointStart], usize),
        (form, before): (&Form, &[PointStart]),
        why: impl Display,
    ) -> Verdict {
        match function {
            Function::InitState => self.fails_to_start(&fluxes(starts), form, &fluxes(before), why),
            _ => self.fails_for(&starts[i], why),
        }
    }

    fn capsule(&self, start: &PointStart, why: &str) -> Option<Capsule> {
        let law = self.law.build(self.hypothesis, &self.values).ok()?;
        let form = self.form(0);
        // Laws of the contract are called at the time of the form, routines as in a run.
        let (time, moment) = match self.law.library().foreign() {
            Some(_) => form.when(start),
            None => (form.time, Moment::default()),
        };
        let call = PointCall {
            request: Request::Update(Operator::Consistent),
            start: start.clone(),
            time,
            time_increment: self.time_increment,
            moment,
            site: Site::default(),
        };
        let failure = BatchFailure {
            point: 0,
            outcome: Outcome::Ok,
            message: why.to_owned(),
            factor: None,
            claims_success: false,
            call: Some(Box::new(call)),
        };
        Capsule::of(&law, &failure, Vec::new())
    }

    /// The form of an ordinary `create`.
    pub(super) fn create_form(&self) -> CreateForm<'_> {
        create_form(&self.formulation, self.hypothesis, &self.values)
    }

    /// The form of an ordinary call.
    pub(super) fn form(&self, request: u32) -> Form {
        Form {
            time_increment: self.time_increment,
            ..Form::of(request)
        }
    }

    /// An ordinary call.
    pub(super) fn call(&self, starts: &[PointStart], request: u32) -> Result<Answer, Verdict> {
        let answer = self.probe.integrate(starts, &self.form(request))?;
        if answer.status == raw::PILUM_E_INTERNAL {
            self.defect
                .get_or_init(|| answer.text().unwrap_or_default());
        }
        Ok(answer)
    }

    /// A failure of a law that calls itself defective, with what it said when it did so first.
    pub(super) fn fails_as_defective(&self, why: String) -> Verdict {
        match self.defect.get().filter(|said| !why.contains(*said)) {
            Some(said) => self.fails(format!("{why}; at first it said: {said}")),
            None => self.fails(why),
        }
    }

    /// Whether updates that double the flux take longer than they may.
    pub(super) fn takes_long(&self, random: &mut Random) -> Result<bool, Verdict> {
        let Ok(Origin { start, size, .. }) = self.origin(random) else {
            return Ok(false);
        };
        let starts: Vec<PointStart> = (0..TIMED)
            .map(|_| PointStart {
                gradient1: self.direction(size, random),
                ..start.clone()
            })
            .collect();
        // Other work on the machine may hold up one series, hardly all of them.
        for _ in 0..SERIES {
            let began = Instant::now();
            self.call(&starts, raw::PILUM_REQ_FLUX)?;
            if began.elapsed() <= LONG * TIMED {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// A call over increments that take so much longer.
    pub(super) fn lasting(
        &self,
        factor: f64,
        starts: &[PointStart],
        request: u32,
    ) -> Result<Vec<PointEnd>, Verdict> {
        let form = Form {
            time_increment: factor * self.time_increment,
            ..self.form(request)
        };
        Ok(self.probe.integrate(starts, &form)?.points)
    }

    /// Whether the flux depends on how long an increment takes.
    pub(super) fn depends_on_time(&self, steps: &[Step]) -> Result<bool, Verdict> {
        let slower = self.lasting(10.0, &starts(steps), raw::PILUM_REQ_FLUX)?;
        let mut pairs = steps.iter().zip(&slower);
        Ok(pairs.any(|(step, slower)| step.end.flux != slower.flux))
    }

    /// Results of the points by one of the functions; empty if the law lacks it.
    pub(super) fn ask(
        &self,
        function: Function,
        starts: &[PointStart],
        form: &Form,
    ) -> Result<Vec<PointEnd>, Verdict> {
        asked(&self.probe, function, starts, form)
    }

    /// The law with other values of its parameters, if it accepts them.
    pub(super) fn with_values(&self, values: &[f64]) -> Result<Option<Probe>, Verdict> {
        let form = create_form(&self.formulation, self.hypothesis, values);
        let created = self.law.probe(&form)?;
        let is_accepted = created.status == raw::PILUM_OK;
        Ok(created.probe.filter(|_| is_accepted))
    }

    /// Components of the gradient that a path may move: under plane strain, 33 stays zero.
    pub(super) fn is_free(&self, component: usize) -> bool {
        self.hypothesis != Hypothesis::PlaneStrain || component != 2
    }

    /// All of them.
    pub(super) fn free(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.probe.n_components()).filter(|&c| self.is_free(c))
    }
}

/// Results of the points by one of the functions of an instance; empty if the law lacks it.
pub(super) fn asked(
    probe: &Probe,
    function: Function,
    starts: &[PointStart],
    form: &Form,
) -> Result<Vec<PointEnd>, Verdict> {
    let answer = match function {
        Function::InitState => {
            let form = Form {
                request: 0,
                ..*form
            };
            probe.init_state(&fluxes(starts), &form)?
        }
        _ => Some(probe.integrate(starts, form)?),
    };
    Ok(answer.map_or(Vec::new(), |answer| answer.points))
}
