//! Does a result depend on what came first in its process, or on what the process was told of its surroundings?

use crate::check::random::Random;
use crate::check::specimen::{Function, Specimen, is_finite, is_success};
use crate::check::{Found, Subject, Verdict, skipped};
use crate::replay::probed::{self, shown};
use law::capsule::Capsule;
use law::probe::{PointEnd, PointStart, call_log};

use super::UPDATE;

/// Points of a law that are called for in another process.
const N: usize = 12;
/// Environment variables, with other values than usual.
const VARIABLES: [(&str, &str); 6] = [
    ("HOME", "/nonexistent/home"),
    ("LANG", "tr_TR.UTF-8"),
    ("LC_ALL", "tr_TR.UTF-8"),
    ("TZ", "Pacific/Kiritimati"),
    ("USER", "somebody"),
    ("LOGNAME", "somebody"),
];

/// A point whose results are others in another process: its number, and what it gives here and there.
type Difference = (usize, [String; 2]);

/// A law, some points of it, and what it makes of them in this process.
struct Here<'a> {
    specimen: &'a Specimen,
    function: Function,
    starts: Vec<PointStart>,
    ends: Vec<PointEnd>,
}

impl<'a> Here<'a> {
    fn of(
        specimen: &'a Specimen,
        function: Function,
        starts: &[PointStart],
    ) -> Result<Self, Verdict> {
        let form = specimen.form(UPDATE);
        let sound = |(_, end): &(PointStart, PointEnd)| is_success(end.status) && is_finite(end);
        let ends = specimen.ask(function, starts, &form)?;
        let pairs = starts.iter().cloned().zip(ends).filter(sound);
        let (starts, ends) = pairs.unzip();
        Ok(Self {
            specimen,
            function,
            starts,
            ends,
        })
    }

    /// The first difference in a process that does nothing else, with these variables of its environment.
    fn afresh(
        &self,
        variables: &[(&'static str, &'static str)],
    ) -> Result<Option<Difference>, Verdict> {
        let specimen = self.specimen;
        let (function, points) = match self.function {
            Function::Integrate => (call_log::Function::Integrate, self.starts.clone()),
            Function::InitState => (call_log::Function::InitState, fluxes(&self.starts)),
        };
        let form = specimen.form(if self.function == Function::InitState {
            0
        } else {
            UPDATE
        });
        let capsule = Capsule::of_probe(
            &specimen.law,
            &specimen.formulation,
            (specimen.hypothesis, &specimen.values),
            (function, form),
            &points,
            &[],
        );
        let capsule = capsule.ok_or_else(|| skipped("the library has no place"))?;
        let there = probed::afresh(&capsule, variables)
            .map_err(|why| skipped(format!("there is no other process: {why}")))?;
        let here = self.ends.iter().map(shown);
        let there = match there {
            Ok(there) if there.len() == self.ends.len() => there,
            Ok(_) => return Err(skipped("what it prints cannot be told from its results")),
            // It gives no results there.
            Err(words) => vec![words; self.ends.len()],
        };
        let mut pairs = here
            .zip(there)
            .map(|(here, there)| [here, there])
            .enumerate();
        Ok(pairs.find(|(_, [here, there])| here != there))
    }

    /// The failure of a difference.
    fn differs(&self, (i, [here, there]): Difference, when: &str, kept: &str) -> Verdict {
        let start = &self.starts[i];
        let why = format!(
            "`{}` gives {here}; {when} {there}: {kept}, at {}",
            self.function.name(),
            self.specimen.at(start)
        );
        if self.function == Function::InitState {
            let flux = std::slice::from_ref(&start.flux0);
            return self
                .specimen
                .fails_to_start(flux, &self.specimen.form(0), &[], why);
        }
        self.specimen.fails_at(start, why)
    }
}

/// Points that have fluxes alone.
fn fluxes(starts: &[PointStart]) -> Vec<PointStart> {
    let of_flux = |start: &PointStart| PointStart {
        gradient0: Vec::new(),
        gradient1: Vec::new(),
        flux0: start.flux0.clone(),
        state0: Vec::new(),
    };
    starts.iter().map(of_flux).collect()
}

pub(super) fn independent_of_first_instance(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "first instance");
    let specimens = subject.specimens(2, &mut random)?;
    if specimens.len() < 2 {
        return Err(skipped(
            "there is one set of parameters, and nothing comes before it",
        ));
    }
    // All of them are called before any is compared.
    let mut all = Vec::new();
    for specimen in &specimens {
        all.push((specimen, specimen.points(N, &mut random)?));
    }
    let mut n = 0;
    for (specimen, starts) in &all[1..] {
        for function in Function::BOTH {
            let here = Here::of(specimen, function, starts)?;
            n += here.ends.len();
            if here.ends.is_empty() {
                continue;
            }
            if let Some(difference) = here.afresh(&[])? {
                let kept = "something is kept of the instance that came first (`static`, `SAVE`)";
                return Err(here.differs(
                    difference,
                    "as the first instance of a process it gives",
                    kept,
                ));
            }
        }
    }
    Ok(format!("{n} points"))
}

pub(super) fn independent_of_environment(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "environment");
    let mut n = 0;
    for specimen in &subject.specimens(1, &mut random)? {
        let starts = specimen.points(N, &mut random)?;
        for function in Function::BOTH {
            let here = Here::of(specimen, function, &starts)?;
            n += here.ends.len();
            if here.ends.is_empty() {
                continue;
            }
            let Some(difference) = here.afresh(&VARIABLES)? else {
                continue;
            };
            let mut names = Vec::new();
            for one in VARIABLES {
                if here.afresh(&[one])?.is_some() {
                    names.push(one.0);
                }
            }
            if names.is_empty() {
                names = VARIABLES.map(|(name, _)| name).to_vec();
            }
            let when = format!("with another {} it gives", names.join(", "));
            return Err(here.differs(difference, &when, "a variable of the environment is read"));
        }
    }
    Ok(format!("{n} points"))
}
