//! Input of the IncrementalDriver of A. Niemunis, which lies next to most soil models written as
//! UMATs: `test.inp`, `parameters.inp` and `initialconditions.inp` in one folder.
//!
//! Lines are read as Fortran does: the numbers asked for, separated by blanks or commas, and
//! whatever follows on the line is a remark, unless it is another number. Components are 11 22 33 12 13 23, tension positive,
//! γ = 2ε. Unsupported keywords are refused with their line.

mod lines;
mod restrictions;

use crate::Error;
use crate::driver::Driver;
use crate::material::{ParameterTable, ParameterValue, build_law, find_law};
use abi::Hypothesis;
use law::foreign::Foreign;
use law::{Opener, Pins, SearchPath};
use lines::Lines;
use point::{Control, Frame, N_MAX, Restrictions, Segment, Vector};
use restrictions::restrictions;
use std::f64::consts::TAU;
use std::ops::Range;
use std::path::Path;
use text::{Source, Spanned};

/// Most increments of one file; a slip of the pen beyond.
const MAX_INCREMENTS: usize = 10_000_000;
/// Most stretches of a path that are kept, repeated ones and those of waves written out.
const MAX_SEGMENTS: usize = 200_000;

/// A keyword with its step.
#[derive(Clone, Debug)]
struct Step {
    increments: usize,
    /// Every how many of them a row is written.
    every: usize,
    /// Time of the whole step.
    time: f64,
    frame: Frame,
    /// For every component whether its stress is controlled, and its change over the step.
    linear: [(bool, f64); N_MAX],
    /// Amplitude and phase of every component, of `*CirculatingLoad`.
    harmonic: Option<[(f64, f64); N_MAX]>,
    /// What holds in place of them, of `*ObeyRestrictions`.
    restrictions: Option<Restrictions>,
}

impl Driver {
    /// Reads input of the IncrementalDriver: the test, and the two files next to it. The material is
    /// this UMAT.
    ///
    /// # Errors
    /// A file cannot be read; what is not understood or cannot be done, at its place; the library
    /// cannot be used.
    pub fn read_incremental(opener: &Opener, test: &Path, umat: &Path) -> Result<Self, Error> {
        let source = Source::read(test)?;
        let segments = segments(&source)?;
        let umat = std::path::absolute(umat).unwrap_or_else(|_| umat.to_owned());
        let foreign = Foreign::umat(&umat);
        let library = opener.open_foreign(&foreign, |_| Ok(()))?;
        let id = library.laws().next().map(|law| law.id.clone());
        let id = Spanned::new(0..0, id.unwrap_or_default());
        let search = SearchPath::of(opener, &[]).pinned(Pins::default());
        let loaded = find_law(&source, &search, &id, Some(&foreign))?;
        let ids: Vec<String> = loaded
            .description()
            .parameters
            .iter()
            .map(|p| p.id.clone())
            .collect();

        let parameters_file = Source::read(&test.with_file_name("parameters.inp"))?;
        let (name, parameters) = parameters(&parameters_file, &ids)?;
        let mut built = build_law(
            &parameters_file,
            &loaded,
            &id,
            Hypothesis::ThreeD,
            &parameters,
        )?;
        if !name.eq_ignore_ascii_case(id.get_ref()) {
            built.warnings.push(format!(
                "the material is called `{name}` in {}; the routine is told the name in its \
                 sidecar",
                parameters_file.path().display()
            ));
        }
        let initial = Source::read(&test.with_file_name("initialconditions.inp"))?;
        let (flux, internal) = initial_conditions(&initial, built.law.n_states())?;
        Self::assembled(&source, built, (flux, internal), segments)
    }
}

impl Driver {
    /// Increments of a test; the two files next to it are read for `n` parameters and variables.
    ///
    /// # Errors
    /// At what is not understood or cannot be done.
    pub fn parse_incremental(
        [test, material, initial]: [&Source; 3],
        n: usize,
    ) -> Result<usize, Error> {
        let segments = segments(test)?;
        let ids: Vec<String> = (0..n).map(|i| format!("p{i}")).collect();
        parameters(material, &ids)?;
        initial_conditions(initial, n)?;
        Ok(segments.iter().map(|segment| segment.increments).sum())
    }
}

/// Name of the material, and the parameters in their declared order.
fn parameters(source: &Source, ids: &[String]) -> Result<(String, ParameterTable), Error> {
    let mut lines = Lines::new(source);
    let (_, name) = lines.expect("the name of the material")?;
    let name = name.split('#').next().unwrap_or_default().trim();
    let (at, [n]) = lines.numbers("the number of parameters")?;
    let n = lines.whole(&at, n, "the number of parameters")?;
    if n != ids.len() {
        let message = format!(
            "{n} parameters, the sidecar of the library names {}: {}",
            ids.len(),
            ids.join(", ")
        );
        return lines.refuse(at, message);
    }
    let mut table = ParameterTable::new();
    for id in ids {
        let (at, [value]) = lines.numbers(&format!("the parameter `{id}`"))?;
        table.insert(
            Spanned::new(at.clone(), id.clone()),
            Spanned::new(at, ParameterValue::Number(value)),
        );
    }
    Ok((name.to_owned(), table))
}

/// Stress and internal variables; those that the file lacks are 0.
fn initial_conditions(source: &Source, n_states: usize) -> Result<(Vector, Vec<f64>), Error> {
    let mut lines = Lines::new(source);
    let n = lines.count("the number of stress components")?;
    if n > N_MAX {
        return lines.refuse(
            0..0,
            format!("{n} stress components, at most {N_MAX} are known"),
        );
    }
    let mut stress = [0.0; N_MAX];
    for value in &mut stress[..n] {
        [*value] = lines.numbers("a stress component")?.1;
    }
    let (at, [n]) = lines.numbers("the number of state variables")?;
    let n = lines.whole(&at, n, "the number of state variables")?;
    if n != n_states {
        let message = format!("{n} state variables, the sidecar of the library names {n_states}");
        return lines.refuse(at, message);
    }
    let mut internal = vec![0.0; n];
    for value in &mut internal {
        let Some((at, line)) = lines.next() else {
            break;
        };
        [*value] = lines.numbers_of(&at, line, "a state variable")?;
    }
    Ok((stress, internal))
}

fn segments(source: &Source) -> Result<Vec<Segment>, Error> {
    let mut lines = Lines::new(source);
    // The name of the output file; `--csv` says here where rows go.
    lines.expect("the name of the output file")?;
    let mut steps = Vec::new();
    let (mut total, mut n_segments) = (0, 0_usize);
    while let Some((at, line)) = lines.next() {
        let keyword = keyword(&lines, &at, line)?;
        if keyword == "*End" {
            break;
        }
        let first = steps.len();
        if keyword == "*Repetition" {
            repetition(&mut lines, total, &mut steps)?;
        } else {
            steps.push(step(&mut lines, at.clone(), keyword)?);
        }
        let new = &steps[first..];
        total += new.iter().map(|step| step.increments).sum::<usize>();
        n_segments += new.iter().map(Step::n_segments).sum::<usize>();
        if n_segments > MAX_SEGMENTS {
            let message = format!(
                "more than {MAX_SEGMENTS} steps and increments of waves, repeated ones included"
            );
            return lines.refuse(at, message);
        }
        if total > MAX_INCREMENTS {
            return lines.refuse(at, format!("more than {MAX_INCREMENTS} increments"));
        }
    }
    if steps.is_empty() {
        return lines.refuse(0..0, "the test has no step");
    }
    let numbered = steps.iter().zip(1..);
    Ok(numbered
        .flat_map(|(step, number)| step.segments(number))
        .collect())
}

/// The keyword of a line.
fn keyword<'a>(lines: &Lines<'_>, at: &Range<usize>, line: &'a str) -> Result<&'a str, Error> {
    if line.contains('?') {
        return lines.refuse(
            at.clone(),
            "a condition that ends a step early is not understood here",
        );
    }
    Ok(line.split_whitespace().next().unwrap_or_default())
}

fn refuse_other_keywords(lines: &Lines<'_>, at: Range<usize>, keyword: &str) -> Result<(), Error> {
    let refused = match keyword {
        "*DeformationGradient" => "laws here take small strains, no deformation gradients",
        "*PerturbationsS" | "*PerturbationsE" => {
            "response envelopes start every increment anew, which a path here cannot"
        }
        "*RandomWalk" => "random paths cannot be repeated",
        name if name.starts_with("*ImportFile") => "paths from other files are not read",
        _ => "",
    };
    if !refused.is_empty() {
        return lines.refuse(at, format!("`{keyword}`: {refused}"));
    }
    let known = [
        "*LinearLoad",
        "*CirculatingLoad",
        "*OedometricE1",
        "*OedometricS1",
        "*TriaxialE1",
        "*TriaxialS1",
        "*TriaxialUEq",
        "*TriaxialUq",
        "*PureRelaxation",
        "*PureCreep",
        "*UndrainedCreep",
        "*ObeyRestrictions",
    ];
    if !known.contains(&keyword) {
        let message = format!("`{keyword}` is no keyword of a step");
        let error = lines.source.error(at, message);
        return Err(error.hint(format!("known are {}", known.join(", "))).into());
    }
    Ok(())
}

/// Reads steps and appends them as often as they are repeated. There are `total` increments before them.
fn repetition(lines: &mut Lines<'_>, total: usize, steps: &mut Vec<Step>) -> Result<(), Error> {
    let (at, [n_steps, n_times]) = lines.numbers("number of steps and of repetitions")?;
    let n_steps = lines.whole(&at, n_steps, "the number of steps")?;
    let n_times = lines.whole(&at, n_times, "the number of repetitions")?;
    if n_steps == 0 || n_times == 0 {
        return lines.refuse(at, "at least one step is repeated at least once");
    }
    let mut repeated = Vec::new();
    for _ in 0..n_steps {
        let (at, line) = lines.expect("a step that is repeated")?;
        let name = keyword(lines, &at, line)?;
        repeated.push(step(lines, at, name)?);
    }
    let each: usize = repeated.iter().map(|step| step.increments).sum();
    if each.saturating_mul(n_times).saturating_add(total) > MAX_INCREMENTS {
        return lines.refuse(at, format!("more than {MAX_INCREMENTS} increments"));
    }
    if repeated.len().saturating_mul(n_times) > MAX_SEGMENTS {
        return lines.refuse(at, format!("more than {MAX_SEGMENTS} steps"));
    }
    for _ in 0..n_times {
        steps.extend_from_slice(&repeated);
    }
    Ok(())
}

fn step(lines: &mut Lines<'_>, at: Range<usize>, keyword: &str) -> Result<Step, Error> {
    refuse_other_keywords(lines, at, keyword)?;
    let (at, [increments, _, time], every) = lines.step()?;
    let mut step = Step {
        increments: lines.whole(&at, increments, "the number of increments")?,
        every,
        time,
        frame: Frame::Cartesian,
        linear: [(false, 0.0); N_MAX],
        harmonic: None,
        restrictions: None,
    };
    if step.increments == 0 {
        return lines.refuse(at, "a step has at least one increment");
    } else if time <= 0.0 {
        return lines.refuse(at, format!("a step takes a time above 0, not {time}"));
    }
    match keyword {
        "*LinearLoad" => {
            step.frame = frame(lines)?;
            for component in &mut step.linear {
                let (at, [is_stress, change]) = lines.numbers("0 or 1, and a change")?;
                *component = (flag(lines, &at, is_stress)?, change);
            }
        }
        "*CirculatingLoad" => {
            step.frame = frame(lines)?;
            let mut harmonic = [(0.0, 0.0); N_MAX];
            for (component, wave) in step.linear.iter_mut().zip(&mut harmonic) {
                let (at, [is_stress, amplitude, phase, change]) =
                    lines.numbers("0 or 1, amplitude, phase and change")?;
                *component = (flag(lines, &at, is_stress)?, change);
                *wave = (amplitude, phase);
            }
            step.harmonic = Some(harmonic);
        }
        "*ObeyRestrictions" => step.restrictions = Some(restrictions(lines)?),
        "*PureRelaxation" => {}
        "*PureCreep" => step.linear = [(true, 0.0); N_MAX],
        "*UndrainedCreep" => {
            step.frame = Frame::Roscoe;
            step.linear[1..].fill((true, 0.0));
        }
        test => {
            let (_, [change]) = lines.numbers("the change over the step")?;
            step.of_one_change(test, change);
        }
    }
    Ok(step)
}

fn flag(lines: &Lines<'_>, at: &Range<usize>, value: f64) -> Result<bool, Error> {
    match value {
        0.0 => Ok(false),
        1.0 => Ok(true),
        _ => lines.refuse(at.clone(), "expected 0 (strain) or 1 (stress)"),
    }
}

fn frame(lines: &mut Lines<'_>) -> Result<Frame, Error> {
    let (at, line) = lines.expect("the coordinates")?;
    match line.split_whitespace().next().unwrap_or_default() {
        "*Cartesian" => Ok(Frame::Cartesian),
        "*Roscoe" => Ok(Frame::Roscoe),
        "*RoscoeIsomorph" => Ok(Frame::RoscoeIsomorph),
        "*Rendulic" => Ok(Frame::Rendulic),
        other => lines.refuse(
            at,
            format!("`{other}`: coordinates are *Cartesian, *Roscoe, *RoscoeIsomorph, *Rendulic"),
        ),
    }
}

impl Step {
    /// A test in which one component changes by so much.
    fn of_one_change(&mut self, test: &str, change: f64) {
        // Which components are under stress control, and which one changes.
        let (frame, stress, changed) = match test {
            "*OedometricE1" => (Frame::Cartesian, 0..0, 0),
            "*OedometricS1" => (Frame::Cartesian, 0..1, 0),
            "*TriaxialE1" => (Frame::Cartesian, 1..3, 0),
            "*TriaxialS1" => (Frame::Cartesian, 0..3, 0),
            "*TriaxialUEq" => (Frame::Roscoe, 0..0, 1),
            _ => (Frame::Roscoe, 1..2, 1),
        };
        self.frame = frame;
        for component in &mut self.linear[stress] {
            component.0 = true;
        }
        self.linear[changed].1 = change;
    }

    fn n_segments(&self) -> usize {
        self.harmonic.map_or(1, |_| self.increments)
    }

    /// One segment, or all increments where they are not equal.
    fn segments(&self, number: u32) -> Vec<Segment> {
        let n = self.increments;
        let segment = |increments: usize, first: usize, change: &dyn Fn(usize) -> f64| Segment {
            increments,
            control: std::array::from_fn(|i| {
                if self.linear[i].0 {
                    Control::FluxBy(change(i))
                } else {
                    Control::GradientBy(change(i))
                }
            }),
            step: number,
            first,
            frame: self.frame,
            time: Some(self.time * (increments as f64 / n as f64)),
            restrictions: self.restrictions.clone(),
            every: self.every,
        };
        let Some(harmonic) = &self.harmonic else {
            return vec![segment(n, 0, &|i| self.linear[i].1)];
        };
        // One period in the step; its rate is taken in the middle of the increment.
        let angle = TAU / n as f64;
        (0..n)
            .map(|k| {
                segment(1, k, &|i| {
                    let (amplitude, phase) = harmonic[i];
                    let rate = f64::cos(angle * (k as f64 + 0.5) + phase);
                    angle * amplitude * rate + self.linear[i].1 / n as f64
                })
            })
            .collect()
    }
}
