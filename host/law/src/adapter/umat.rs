//! Abaqus user subroutines `UMAT` as laws.
//!
//! All arguments of a call stand in one block of words, apart from each other by guard words. A
//! point gets a fresh block; after the call every word that is no output must be what it was.

use super::sidecar::Sidecar;
use super::{
    Externals, Foreign, ForeignInstance, ForeignLaw, ForeignLaws, Order, PointEnd, PointStart,
    Refusal, each_point, time_of_call,
};
use crate::Error;
use crate::image::Image;
use crate::library::umat::{N_ARGUMENTS, Routine};
use crate::library::{Call, CallFailure};
use abi::Hypothesis;
use abi::raw::{self, Status};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Names by which compilers know the routine, in the order in which they are looked for.
pub const SYMBOLS: [&str; 4] = ["umat_", "umat", "UMAT", "UMAT_"];
/// Characters of CMNAME.
const N_CMNAME: usize = 80;
/// Guard words on each side of an argument: a DDSDDE of six components where there is room for
/// four ends 20 words too far.
const N_GUARD: usize = 24;
/// What guard words hold: a signalling NaN. What is read there shows in the results, and what is
/// computed with it and written back shows in the word, since every operation makes it a quiet one.
const GUARD: u64 = 0x7ff4_dead_beef_dead;
/// Words of PREDEF and DPRED: no predefined fields, but room to read.
const N_FIELDS: usize = 8;
/// Stress along the axes that a plane problem lacks, relative to the largest, that is rounding.
const OUT_OF_PLANE: f64 = 1e-9;

/// What an argument consists of.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Real,
    Integer,
    Text,
}

/// The arguments in their order.
#[rustfmt::skip]
#[expect(dead_code, reason = "some are the same in all calls, and zero")]
#[derive(Clone, Copy, Debug)]
enum A {
    Stress, Statev, Ddsdde, Sse, Spd, Scd, Rpl, Ddsddt, Drplde, Drpldt, Stran, Dstran, Time, Dtime,
    Temp, Dtemp, Predef, Dpred, Cmname, Ndi, Nshr, Ntens, Nstatv, Props, Nprops, Coords, Drot,
    Pnewdt, Celent, Dfgrd0, Dfgrd1, Noel, Npt, Layer, Kspt, Jstep, Kinc,
}

/// What a routine may do with an argument.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Role {
    /// Write it.
    Output,
    /// Read it. Abaqus computes it anew for every call, as is done here, so that nobody sees what a
    /// routine leaves there; some use it as their own.
    Copy,
    /// Read it: sizes, names and numbers, and the parameters, which all points share in Abaqus.
    Fixed,
}

use Role::{Copy as C, Fixed as F, Output as O};

/// Name, kind and role.
#[rustfmt::skip]
const ARGUMENTS: [(&str, Kind, Role); N_ARGUMENTS] = [
    ("STRESS", Kind::Real, O), ("STATEV", Kind::Real, O), ("DDSDDE", Kind::Real, O),
    ("SSE", Kind::Real, O), ("SPD", Kind::Real, O), ("SCD", Kind::Real, O),
    ("RPL", Kind::Real, O), ("DDSDDT", Kind::Real, O), ("DRPLDE", Kind::Real, O),
    ("DRPLDT", Kind::Real, O), ("STRAN", Kind::Real, C), ("DSTRAN", Kind::Real, C),
    ("TIME", Kind::Real, C), ("DTIME", Kind::Real, C), ("TEMP", Kind::Real, C),
    ("DTEMP", Kind::Real, C), ("PREDEF", Kind::Real, C), ("DPRED", Kind::Real, C),
    ("CMNAME", Kind::Text, F), ("NDI", Kind::Integer, F), ("NSHR", Kind::Integer, F),
    ("NTENS", Kind::Integer, F), ("NSTATV", Kind::Integer, F),
    ("PROPS", Kind::Real, F), ("NPROPS", Kind::Integer, F),
    ("COORDS", Kind::Real, C), ("DROT", Kind::Real, C), ("PNEWDT", Kind::Real, O),
    ("CELENT", Kind::Real, C), ("DFGRD0", Kind::Real, C), ("DFGRD1", Kind::Real, C),
    ("NOEL", Kind::Integer, F), ("NPT", Kind::Integer, F),
    ("LAYER", Kind::Integer, F), ("KSPT", Kind::Integer, F),
    ("JSTEP", Kind::Integer, F), ("KINC", Kind::Integer, F),
];

/// Describes the law of a library by its sidecar. Nothing of it runs.
///
/// # Errors
/// As [`Sidecar::read`].
pub(super) fn open(foreign: &Foreign, image: &Image) -> Result<ForeignLaws, Error> {
    let sidecar = Sidecar::read(&foreign.library, foreign.sidecar.as_deref())?;
    let (law, sha256) = (sidecar.law.clone(), sidecar.sha256.clone());
    let wishes = sidecar.wishes;
    let umat = Umat {
        library: foreign.library.clone(),
        sha256: image.sha256.clone(),
        record: foreign.record.clone(),
        records_once: foreign.records_once,
        traps: foreign.externals.or(wishes.0) == Some(Externals::Trap),
        sidecar,
    };
    Ok(ForeignLaws {
        laws: vec![(law, Arc::new(umat))],
        sidecar: Some(sha256),
        wishes,
    })
}

/// A library with a UMAT.
#[derive(Debug)]
struct Umat {
    library: PathBuf,
    sha256: String,
    record: Option<PathBuf>,
    records_once: bool,
    /// Traps stand for what it calls and nobody supplies.
    traps: bool,
    sidecar: Sidecar,
}

impl ForeignLaw for Umat {
    fn is_serial(&self) -> bool {
        // What is recorded is one call.
        !self.sidecar.is_thread_safe || self.record.is_some()
    }

    fn create(
        &self,
        hypothesis: Hypothesis,
        parameters: &[f64],
    ) -> Result<Box<dyn ForeignInstance>, CallFailure> {
        let unusable = |why: String| (raw::PILUM_E_INTERNAL, why);
        let formulations = &self.sidecar.law.formulations;
        let number = formulations
            .iter()
            .position(|f| f.hypothesis == hypothesis.name())
            .ok_or_else(|| unusable("the hypothesis is not offered".to_owned()))?;
        let image = Image::read(&self.library).map_err(unusable)?;
        if image.sha256 != self.sha256 {
            return Err(unusable("it was changed".to_owned()));
        }
        let names: Vec<&str> = match &self.sidecar.symbol {
            Some(name) => vec![name],
            None => SYMBOLS.to_vec(),
        };
        let routine = Routine::open(&self.library, image, &names, self.traps).map_err(unusable)?;
        let sizes = Sizes {
            n: hypothesis.n_components(),
            n_tens: self.sidecar.ntens[number],
            n_normal: if hypothesis.is_interface() { 1 } else { 3 },
            n_states: formulations[number].internal_variables.len(),
            n_props: parameters.len(),
        };
        let is_recorded = AtomicBool::new(self.record.is_none());
        Ok(Box::new(Instance {
            routine,
            template: Block::new(sizes, &self.sidecar.cmname, parameters),
            sizes,
            order: self.sidecar.order,
            time_dependent: formulations[number].time_dependent,
            overwritten: AtomicU64::new(0),
            told: AtomicU64::new(0),
            turn: self.is_serial().then(Mutex::default),
            record: self.record.clone(),
            records_once: self.records_once,
            is_recorded,
        }))
    }
}

/// Numbers of components.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    /// Of the hypothesis.
    n: usize,
    /// Of the call: NTENS.
    n_tens: usize,
    /// NDI.
    n_normal: usize,
    n_states: usize,
    n_props: usize,
}

/// Arguments of a call in one block of words.
#[derive(Clone, Debug)]
struct Block {
    words: Vec<u64>,
    /// First word and number of entries of every argument.
    at: [usize; N_ARGUMENTS],
    entries: [usize; N_ARGUMENTS],
}

impl Block {
    /// What all calls of a material have in common.
    fn new(sizes: Sizes, cmname: &str, parameters: &[f64]) -> Self {
        let n = sizes.n_tens;
        let mut entries = [1; N_ARGUMENTS];
        for (argument, count) in [
            (A::Stress, n),
            (A::Statev, sizes.n_states),
            (A::Ddsdde, n * n),
            (A::Ddsddt, n),
            (A::Drplde, n),
            (A::Stran, n),
            (A::Dstran, n),
            (A::Time, 2),
            (A::Predef, N_FIELDS),
            (A::Dpred, N_FIELDS),
            (A::Cmname, N_CMNAME),
            (A::Props, sizes.n_props),
            (A::Coords, 3),
            (A::Drot, 9),
            (A::Dfgrd0, 9),
            (A::Dfgrd1, 9),
            (A::Jstep, 4),
        ] {
            entries[argument as usize] = count;
        }
        let mut at = [0; N_ARGUMENTS];
        let mut end = N_GUARD;
        for (i, (_, kind, _)) in ARGUMENTS.iter().enumerate() {
            at[i] = end;
            end += n_words(*kind, entries[i]) + N_GUARD;
        }
        let mut block = Self {
            words: vec![GUARD; end],
            at,
            entries,
        };
        for (i, (_, kind, _)) in ARGUMENTS.iter().enumerate() {
            let n = n_words(*kind, entries[i]);
            block.words[at[i]..][..n].fill(0);
        }
        let name = format!("{cmname:<N_CMNAME$}");
        let (characters, _) = name.as_bytes().as_chunks::<8>();
        for (word, eight) in block.words[at[A::Cmname as usize]..]
            .iter_mut()
            .zip(characters)
        {
            *word = u64::from_ne_bytes(*eight);
        }
        let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        for matrix in [A::Drot, A::Dfgrd0, A::Dfgrd1] {
            block.set(matrix, &identity);
        }
        block.set(A::Props, parameters);
        block.set(A::Pnewdt, &[1.0]);
        block.set_integers(A::Ndi, &[sizes.n_normal as i32]);
        block.set_integers(A::Nshr, &[(n - sizes.n_normal) as i32]);
        block.set_integers(A::Ntens, &[n as i32]);
        block.set_integers(A::Nstatv, &[sizes.n_states as i32]);
        block.set_integers(A::Nprops, &[sizes.n_props as i32]);
        block.set_integers(A::Layer, &[1]);
        block.set_integers(A::Kspt, &[1]);
        block
    }

    /// Writes the first entries of an argument.
    fn set(&mut self, argument: A, values: &[f64]) {
        let words = &mut self.words[self.at[argument as usize]..];
        for (word, value) in words.iter_mut().zip(values) {
            *word = value.to_bits();
        }
    }

    fn set_integers(&mut self, argument: A, values: &[i32]) {
        let words = &mut self.words[self.at[argument as usize]..];
        for (word, pair) in words.iter_mut().zip(values.chunks(2)) {
            let half = |i: usize| pair.get(i).copied().unwrap_or_default().to_ne_bytes();
            let ([a, b, c, d], [e, f, g, h]) = (half(0), half(1));
            *word = u64::from_ne_bytes([a, b, c, d, e, f, g, h]);
        }
    }

    fn reals(&self, argument: A) -> impl Iterator<Item = f64> {
        let i = argument as usize;
        let words = &self.words[self.at[i]..][..self.entries[i]];
        words.iter().map(|word| f64::from_bits(*word))
    }

    /// The first result that holds a number that is none.
    fn not_finite(&self) -> Option<&'static str> {
        let results = [A::Stress, A::Statev, A::Ddsdde];
        let mut bad = results.into_iter();
        bad.find(|result| self.reals(*result).any(|value| !value.is_finite()))
            .map(|result| ARGUMENTS[result as usize].0)
    }

    /// Which copies a call has written to, by bits.
    ///
    /// # Errors
    /// The first argument that it has written to without right, in words.
    fn overwritten(&self, before: &Self) -> Result<u64, String> {
        let mut copies = 0;
        for (i, (name, kind, role)) in ARGUMENTS.iter().enumerate() {
            let (first, n) = (self.at[i], n_words(*kind, self.entries[i]));
            let differs = |from: usize, to: usize| self.words[from..to] != before.words[from..to];
            if *role != Role::Output && differs(first, first + n) {
                if *role == Role::Fixed {
                    return Err(format!("the routine overwrites {name}, which is an input"));
                }
                copies |= 1 << i;
            }
            let end = first + n;
            let next = ARGUMENTS.get(i + 1).map_or("", |(name, ..)| *name);
            if differs(end, end + N_GUARD / 2) {
                let size = self.entries[i];
                return Err(format!(
                    "the routine writes beyond the end of {name}, which has {size} entries"
                ));
            }
            if differs(end + N_GUARD / 2, end + N_GUARD) {
                return Err(format!(
                    "the routine writes between {name} and {next}, in front of one or beyond the \
                     end of the other"
                ));
            }
            if i == 0 && differs(0, first) {
                return Err(format!("the routine writes in front of {name}"));
            }
        }
        Ok(copies)
    }

    /// All arguments as TOML.
    fn text(&self, title: &str) -> String {
        let mut text = format!("[{title}]\n");
        for (i, (name, kind, _)) in ARGUMENTS.iter().enumerate() {
            let n = self.entries[i];
            let words = &self.words[self.at[i]..][..n_words(*kind, n)];
            let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_ne_bytes()).collect();
            let values: Vec<String> = match kind {
                Kind::Real => words
                    .iter()
                    .map(|word| real(f64::from_bits(*word)))
                    .collect(),
                Kind::Integer => {
                    let (integers, _) = bytes.as_chunks::<4>();
                    let integers = integers.iter().take(n);
                    integers
                        .map(|i| i32::from_ne_bytes(*i).to_string())
                        .collect()
                }
                Kind::Text => {
                    let characters = String::from_utf8_lossy(&bytes).into_owned();
                    let _ = writeln!(text, "{name} = {}", toml::Value::from(characters));
                    continue;
                }
            };
            let _ = writeln!(text, "{name} = [{}]", values.join(", "));
        }
        text
    }
}

fn n_words(kind: Kind, entries: usize) -> usize {
    match kind {
        Kind::Real => entries,
        Kind::Integer => entries.div_ceil(2),
        Kind::Text => entries.div_ceil(8),
    }
}

/// A number that reads back to the same bits.
fn real(value: f64) -> String {
    if value.is_nan() {
        "nan".to_owned()
    } else {
        format!("{value:?}")
    }
}

/// A UMAT with its parameters fixed.
#[derive(Debug)]
struct Instance {
    routine: Routine,
    template: Block,
    sizes: Sizes,
    /// How DDSDDE stands in memory.
    order: Order,
    /// Its response depends on the time.
    time_dependent: bool,
    /// Which of its copies the routine has overwritten, by bits, and which of them have been told.
    overwritten: AtomicU64,
    told: AtomicU64,
    /// Whose turn it is, unless the routine says that it may be called by several threads.
    turn: Option<Mutex<()>>,
    record: Option<PathBuf>,
    records_once: bool,
    is_recorded: AtomicBool,
}

impl ForeignInstance for Instance {
    fn integrate(&self, call: Call<'_>) -> (Status, String) {
        let _turn = self
            .turn
            .as_ref()
            .map(|turn| turn.lock().unwrap_or_else(PoisonError::into_inner));
        let mut block = self.template.clone();
        each_point(call, |start, end| self.update(&mut block, start, end))
    }

    fn take_overwritten(&self) -> Vec<String> {
        let overwritten = self.overwritten.load(Ordering::Relaxed);
        let told = self.told.swap(overwritten, Ordering::Relaxed);
        let new = (0..N_ARGUMENTS).filter(|i| (overwritten & !told) >> i & 1 == 1);
        new.map(|i| ARGUMENTS[i].0.to_owned()).collect()
    }
}

impl Instance {
    fn update(
        &self,
        block: &mut Block,
        start: &PointStart<'_>,
        end: &mut PointEnd<'_>,
    ) -> Result<(), Refusal> {
        let increment: Vec<f64> = start
            .gradient
            .iter()
            .zip(start.gradient_end)
            .map(|(start, end)| end - start)
            .collect();
        self.call(block, start, &increment)?;
        let n = self.sizes.n;
        if let Some(name) = block.not_finite() {
            // A smaller increment may mend it, unless there is none at all.
            let at_rest = increment.iter().all(|v| *v == 0.0);
            return Err(Refusal::error(
                if at_rest {
                    raw::PILUM_E_INTERNAL
                } else {
                    raw::PILUM_E_NUMERIC
                },
                format!(
                    "the routine leaves {name} with values that are not finite{}",
                    if at_rest { ", without any strain" } else { "" }
                ),
            ));
        }
        let rest = block.reals(A::Stress).skip(n);
        let largest = block
            .reals(A::Stress)
            .fold(0.0_f64, |max, v| max.max(v.abs()));
        if let Some(stress) = rest.into_iter().find(|v| v.abs() > OUT_OF_PLANE * largest) {
            return Err(Refusal::error(
                raw::PILUM_E_UNSUPPORTED,
                format!("a stress 13 or 23 of {stress:e} arises, which a plane problem lacks"),
            ));
        }
        for (to, value) in end.flux.iter_mut().zip(block.reals(A::Stress)) {
            *to = value;
        }
        for (to, value) in end.state.iter_mut().zip(block.reals(A::Statev)) {
            *to = value;
        }
        if end.operator.is_empty() {
            return Ok(());
        }
        if start.request & raw::PILUM_REQ_ELASTIC != 0 {
            self.call(block, start, &vec![0.0; n])?;
        }
        let first = block.at[A::Ddsdde as usize];
        for i in 0..n {
            for j in 0..n {
                let entry = match self.order {
                    Order::Columns => i + j * self.sizes.n_tens,
                    Order::Rows => i * self.sizes.n_tens + j,
                };
                end.operator[i * n + j] = f64::from_bits(block.words[first + entry]);
            }
        }
        Ok(())
    }

    /// One call, from fresh arguments.
    fn call(
        &self,
        block: &mut Block,
        start: &PointStart<'_>,
        increment: &[f64],
    ) -> Result<(), Refusal> {
        block.words.copy_from_slice(&self.template.words);
        block.set(A::Stress, start.flux);
        block.set(A::Statev, start.state);
        block.set(A::Stran, start.gradient);
        block.set(A::Dstran, increment);
        block.set(A::Time, &[start.time - start.moment.step_start, start.time]);
        block.set(A::Dtime, &[time_of_call(start, self.time_dependent)]);
        block.set(A::Coords, &start.site.position);
        block.set(A::Celent, &[start.site.length]);
        block.set_integers(A::Noel, &[start.site.element as i32]);
        block.set_integers(A::Npt, &[start.site.point as i32]);
        // A static procedure of small strains.
        block.set_integers(A::Jstep, &[start.moment.step as i32, 1, 0, 0]);
        block.set_integers(A::Kinc, &[start.moment.increment as i32]);
        let before = block.clone();
        let recorded = self.record.as_ref().filter(|file| {
            increment.iter().any(|v| *v != 0.0)
                && !self.is_recorded.swap(true, Ordering::Relaxed)
                && !(self.records_once && file.exists())
        });
        if let Some(path) = recorded {
            // What a routine is given, even if it never returns.
            record(path, &before, None)?;
        }
        self.routine.call(&mut block.words, &block.at, N_CMNAME);
        if let Some(path) = recorded {
            record(path, &before, Some(block))?;
        }
        let overwritten = block
            .overwritten(&before)
            .map_err(|damage| Refusal::error(raw::PILUM_E_INTERNAL, damage))?;
        if overwritten != 0 {
            self.overwritten.fetch_or(overwritten, Ordering::Relaxed);
        }
        let factor = block.reals(A::Pnewdt).next().unwrap_or(1.0);
        if factor >= 1.0 {
            return Ok(());
        }
        if factor > 0.0 {
            return Err(Refusal {
                status: raw::PILUM_CUT_STEP,
                factor,
                message: format!("the routine asks for a smaller increment, PNEWDT = {factor}"),
            });
        }
        Err(Refusal::error(
            raw::PILUM_E_INTERNAL,
            format!(
                "the routine leaves PNEWDT = {factor}; a fraction between 0 and 1 asks for a \
                 smaller increment"
            ),
        ))
    }
}

/// Writes the arguments before a call, and after it once it has returned.
fn record(path: &Path, before: &Block, after: Option<&Block>) -> Result<(), Refusal> {
    let text = format!(
        "# All arguments of one call of a UMAT, in their order; matrices column by column.\n\n{}\n{}",
        before.text("before"),
        after.map_or_else(
            || "# The routine has not returned.\n".to_owned(),
            |after| after.text("after")
        )
    );
    std::fs::write(path, text).map_err(|why| {
        let message = format!("`record`: {} cannot be written: {why}", path.display());
        Refusal::error(raw::PILUM_E_INTERNAL, message)
    })
}
