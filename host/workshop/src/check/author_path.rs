//! The author's own path: the increments of a driver file are what the checks are made with.

use super::points::at_rest;
use super::specimen::{Specimen, create_form};
use super::{Found, Subject, Verdict, failed, routine, skipped, warned};
use crate::Error;
use input::driver::Driver;
use law::foreign::Foreign;
use law::probe::PointStart;
use law::{LoadedLaw, Opener};
use std::path::Path;

/// The drivers of a file, one for each variant.
///
/// # Errors
/// As those of [`Driver::read_unlocked`].
pub(super) fn read(opener: &Opener, path: &Path) -> Result<Vec<Driver>, Error> {
    Driver::read_unlocked(opener, path)
}

/// Whether the driver can be read (a warning, if not) and leads a law of the library.
pub(super) fn driver_fits(subject: &Subject) -> Found {
    let Some(path) = &subject.driver else {
        return Ok(String::new());
    };
    let drivers = read(&subject.opener, path).map_err(|why| warned(why.to_string()))?;
    let canonical = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    for driver in &drivers {
        let law = driver.point().law();
        let library = law.library();
        if law.loaded().shear_zone().is_some() {
            return Err(failed(format!(
                "{} leads a law that fills a shear zone; checks are of laws as they are: a driver \
                 without `adapter = \"shear_zone\"` leads it",
                path.display()
            )));
        }
        let route = library.foreign().map(|foreign| foreign.adapter.name());
        if route.is_some() != routine::is_one(&subject.path) {
            return Err(failed(match route {
                Some(name) => format!(
                    "{} leads `{}` by `adapter = \"{name}\"`, and the library keeps the contract too: \
                     without an adapter it is checked",
                    path.display(),
                    law.description().id
                ),
                None => format!("{} leads a law without an adapter", path.display()),
            }));
        }
        if canonical(library.path()) != canonical(&subject.path) {
            return Err(failed(format!(
                "{} leads `{}` of library {}, not a law of {}",
                path.display(),
                law.description().id,
                library.path().display(),
                subject.path.display()
            )));
        }
    }
    Ok(String::new())
}

/// Whether the law follows the author's path at all, if there is one. Its response along it is the only one checked.
///
/// # Errors
/// A failure, with what the law says.
pub(super) fn is_followed(subject: &Subject) -> Result<(), Verdict> {
    let Some(path) = &subject.driver else {
        return Ok(());
    };
    for driver in read(&subject.opener, path).map_err(|why| failed(why.to_string()))? {
        let mut n_rows = 0;
        if let Err(why) = driver.run(|_| n_rows += 1)
            && n_rows < 2
        {
            return Err(failed(format!(
                "{}: no increment was done: {why}",
                path.display()
            )));
        }
    }
    Ok(())
}

/// The library as the driver names it, if that is made for another program.
pub(super) fn foreign(opener: &Opener, path: &Path) -> Option<Foreign> {
    let drivers = read(opener, path).ok()?;
    let library = drivers.first()?.point().law().library();
    library.foreign().cloned()
}

impl Subject {
    /// The laws of the driver, with its parameters and the increments of its path; one for each
    /// variant, and for each length of increments in time.
    pub(super) fn led_specimens(&self) -> Result<Vec<Specimen>, Verdict> {
        let Some(path) = &self.driver else {
            return Ok(Vec::new());
        };
        let drivers = read(&self.opener, path).map_err(|why| failed(why.to_string()))?;
        let mut specimens = Vec::new();
        for driver in &drivers {
            specimens.extend(self.of_driver(driver)?);
        }
        if specimens.is_empty() {
            return Err(skipped(format!(
                "{}: no increment was done",
                path.display()
            )));
        }
        Ok(specimens)
    }

    /// The law of a driver, called in this process.
    fn loaded(&self, driver: &Driver) -> Result<LoadedLaw, Verdict> {
        let loaded = driver.point().law().loaded();
        if loaded.library().foreign().is_none() {
            return Ok(loaded.clone());
        }
        // That of the driver may be in a worker.
        let id = &loaded.description().id;
        let mut laws = self.laws()?.into_iter();
        laws.find(|law| law.description().id == *id)
            .ok_or_else(|| failed(format!("the library has no law `{id}`")))
    }

    fn of_driver(&self, driver: &Driver) -> Result<Vec<Specimen>, Verdict> {
        let point = driver.point();
        let segments = point.segments().iter();
        let times: Vec<f64> = segments
            .flat_map(|segment| {
                std::iter::repeat_n(
                    segment.length() / segment.increments as f64,
                    segment.increments,
                )
            })
            .collect();
        let mut courses: Vec<(f64, Vec<PointStart>)> = Vec::new();
        let mut last: Option<PointStart> = None;
        // How far it comes is for `pilum point` to say.
        let _ = driver.run(|row| {
            if let Some(mut start) = last.take() {
                start.gradient1 = row.gradient.to_vec();
                let time = times.get(row.increment - 1).copied().unwrap_or(1.0);
                match courses
                    .iter_mut()
                    .find(|(other, _)| other.to_bits() == time.to_bits())
                {
                    Some((_, course)) => course.push(start),
                    None => courses.push((time, vec![start])),
                }
            }
            last = Some(at_rest(row.gradient, row.flux, row.internal));
        });
        let law = point.law();
        let loaded = self.loaded(driver)?;
        let mut specimens = Vec::new();
        for (time_increment, course) in courses {
            let formulation = law.formulation().clone();
            let values = law.parameters().to_vec();
            let form = create_form(&formulation, law.hypothesis(), &values);
            let Some(probe) = loaded.probe(&form)?.probe else {
                return Err(failed(format!(
                    "`create` refuses the parameters of {}",
                    driver.path().display()
                )));
            };
            let formulation = (formulation, law.hypothesis());
            specimens.push(Specimen {
                course: Some(course),
                time_increment,
                ..Specimen::of(loaded.clone(), formulation, values, probe)
            });
        }
        Ok(specimens)
    }
}
