//! `pilum calibrate`: what it finds of parameters that are known.
//!
//! Goal        values and intervals from tests whose truth is known; a report where tests do not tell.
//! Set-up      drivers of interface laws with synthetic scatter; the calibrations in `cases/`.
//! Asserts     true values inside the intervals at the nominal rate; derivatives by a law's rates; standard errors of
//!             closed forms; no interval where nothing is determined; systematic errors reported, honest noise not.
#![allow(
    clippy::unwrap_used,
    clippy::format_push_string,
    clippy::print_stdout,
    reason = "these are tests"
)]

mod cases;
mod coverage;
mod honest;
mod rates;
mod stages;
mod systematic;
mod words;

use input::Error;
use input::calibration::Calibration;
use runs::calibration::{Options, Outcome, calibrate};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Carries out a calibration file in memory.
fn run(file: &Path, settings: &[&str]) -> Result<Outcome, Error> {
    let folder = TempDir::new().unwrap();
    run_in(file, settings, folder.path(), law::Stop::never())
}

/// The same, with what it keeps in a folder, until it is stopped.
fn run_in(
    file: &Path,
    settings: &[&str],
    folder: &Path,
    stop: law::Stop,
) -> Result<Outcome, Error> {
    let settings: Vec<String> = settings.iter().map(|s| (*s).to_owned()).collect();
    let calibration = Calibration::load_with(file, &settings)?.remove(0);
    let options = Options {
        variant: None,
        settings,
        out: None,
        stop,
        opener: law::Opener::default(),
        anew: false,
    };
    calibrate(&calibration, folder, &options, &mut |_| ())
}

/// One of its words has all of these parts, between ` | `.
#[track_caller]
fn says(outcome: &Outcome, parts: &str) {
    let mut words = outcome.words.iter();
    let found = words.any(|word| parts.split(" | ").all(|part| word.contains(part)));
    assert!(found, "{parts}: {:#?}", outcome.words);
}

#[track_caller]
fn does_not_say(outcome: &Outcome, part: &str) {
    let mut words = outcome.words.iter();
    assert!(
        !words.any(|word| word.contains(part)),
        "{:#?}",
        outcome.words
    );
}

/// Two columns that a driver computes, at places along the first.
fn computed(driver: &str, columns: [&str; 2], at: &[f64]) -> Vec<f64> {
    let driver = tests::driver::of_text(driver).unwrap();
    let names = results::point_figure::drawable(driver.point());
    let [x, y] = columns.map(|name| names.iter().position(|other| other == name).unwrap());
    let mut line = Vec::new();
    driver
        .run(|row| {
            let values = results::point_figure::drawn(driver.point(), row);
            line.push((values[x].unwrap(), values[y].unwrap()));
        })
        .unwrap();
    let value = |x: &f64| {
        let pair = line
            .windows(2)
            .find(|pair| (pair[0].0..=pair[1].0).contains(x))
            .unwrap();
        let [(a, f), (b, g)] = [pair[0], pair[1]];
        f + (g - f) * (x - a) / (b - a)
    };
    at.iter().map(value).collect()
}

/// Writes measured points.
fn write_points(folder: &Path, name: &str, points: &[(f64, f64)]) {
    let mut text = "x,y\n".to_owned();
    for (x, y) in points {
        writeln!(text, "{x:e},{y:e}").unwrap();
    }
    fs::write(folder.join(name), text).unwrap();
}

/// The number of a parameter.
fn number(outcome: &Outcome, name: &str) -> usize {
    outcome
        .parameters
        .iter()
        .position(|p| p.name == name)
        .unwrap()
}

/// Whether the interval of a parameter holds a value.
fn holds(outcome: &Outcome, name: &str, value: f64) -> bool {
    let interval = outcome.interval(number(outcome, name)).unwrap();
    interval.ends[0].unwrap() <= value && value <= interval.ends[1].unwrap()
}
