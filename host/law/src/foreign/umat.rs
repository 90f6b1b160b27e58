//! Abaqus user subroutines `UMAT` as laws.
//!
//! A point gets a fresh block of [guarded](super::guarded) arguments; after the call every word that is no
//! output must be what it was.

use super::guarded::{Argument, Block as Guarded, Blocks, Kind, Role};
use super::sidecar::Sidecar;
use super::{Externals, Foreign, ForeignLaws, Order, Refusal, each_point, time_of_call};
use crate::Error;
use crate::call::{Batch, End, Operator, Request, Start};
use crate::description::FormulationDescription;
use crate::instance::{Answer, Instance, Source};
use crate::library::routine::{N_UMAT, Umat as Routine};
use crate::process::library_bytes::Image;
use abi::Hypothesis;
use abi::raw;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Names by which compilers know the routine, in the order in which they are looked for.
pub const SYMBOLS: [&str; 4] = ["umat_", "umat", "UMAT", "UMAT_"];
/// Characters of CMNAME.
const N_CMNAME: usize = 80;
/// Words of PREDEF and DPRED: no predefined fields, but room to read.
const N_FIELDS: usize = 8;

/// The arguments in their order.
#[rustfmt::skip]
#[expect(dead_code, reason = "some are the same in all calls, and zero")]
#[derive(Clone, Copy, Debug)]
enum A {
    Stress, Statev, Ddsdde, Sse, Spd, Scd, Rpl, Ddsddt, Drplde, Drpldt, Stran, Dstran, Time, Dtime,
    Temp, Dtemp, Predef, Dpred, Cmname, Ndi, Nshr, Ntens, Nstatv, Props, Nprops, Coords, Drot,
    Pnewdt, Celent, Dfgrd0, Dfgrd1, Noel, Npt, Layer, Kspt, Jstep, Kinc,
}

impl From<A> for usize {
    fn from(argument: A) -> Self {
        argument as Self
    }
}

type Block = Guarded<N_UMAT>;

use Role::{Array as R, Copy as C, Fixed as F, Output as O};

/// Name, kind and role.
#[rustfmt::skip]
static ARGUMENTS: [Argument; N_UMAT] = [
    ("STRESS", Kind::Real, R), ("STATEV", Kind::Real, R), ("DDSDDE", Kind::Real, R),
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

impl Source for Umat {
    fn is_serial(&self) -> bool {
        // What is recorded is one call.
        !self.sidecar.is_thread_safe || self.record.is_some()
    }

    fn create(
        &self,
        hypothesis: Hypothesis,
        formulation: &FormulationDescription,
        parameters: &[f64],
    ) -> Result<Box<dyn Instance>, Answer> {
        let names: Vec<&str> = match &self.sidecar.symbol {
            Some(name) => vec![name],
            None => SYMBOLS.to_vec(),
        };
        let open = |image| Routine::open(&self.library, image, &names, self.traps);
        let routine = Image::again(&self.library, &self.sha256).and_then(open);
        let sizes = Sizes {
            n: hypothesis.n_components(),
            n_tens: self.sidecar.ntens[formulation.index as usize],
            n_normal: if hypothesis.is_interface() { 1 } else { 3 },
            n_states: formulation.internal_variables.len(),
            n_props: parameters.len(),
        };
        let template = template(sizes, &self.sidecar.cmname, parameters);
        Ok(Box::new(Material {
            routine: routine.map_err(|why| (raw::PILUM_E_INTERNAL, why))?,
            blocks: Blocks::new(template, self.is_serial()),
            sizes,
            order: self.sidecar.order,
            time_dependent: formulation.time_dependent,
            record: self.record.clone(),
            records_once: self.records_once,
            is_recorded: AtomicBool::new(self.record.is_none()),
        }))
    }
}

/// Numbers of components.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    /// Components of the hypothesis.
    n: usize,
    /// Components of the call: NTENS.
    n_tens: usize,
    /// NDI.
    n_normal: usize,
    n_states: usize,
    n_props: usize,
}

/// Data common to all calls of a material.
fn template(sizes: Sizes, cmname: &str, parameters: &[f64]) -> Block {
    let n = sizes.n_tens;
    let mut entries = [1; N_UMAT];
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
    let mut block = Block::new(&ARGUMENTS, entries);
    block.set_text(A::Cmname, &format!("{cmname:<N_CMNAME$}"));
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

/// All arguments as TOML.
fn text(block: &Block, title: &str) -> String {
    let mut text = format!("[{title}]\n");
    for (i, (name, kind, _)) in ARGUMENTS.iter().enumerate() {
        let (words, n) = block.entries(i);
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
struct Material {
    routine: Routine,
    blocks: Blocks<N_UMAT>,
    sizes: Sizes,
    /// How DDSDDE is in memory.
    order: Order,
    /// Its response depends on the time.
    time_dependent: bool,
    record: Option<PathBuf>,
    records_once: bool,
    is_recorded: AtomicBool,
}

impl Instance for Material {
    fn call(&self, request: Request, batch: Batch<'_, '_>) -> Option<Answer> {
        let Request::Update(operator) = request else {
            return None;
        };
        let n = self.sizes.n;
        let sizes = (n, self.sizes.n_states, operator.n_entries(n));
        Some(self.blocks.with(|block| {
            each_point(sizes, batch, |start, end| {
                self.update(block, operator, start, end)
            })
        }))
    }

    fn put_beside(&self, gap: Option<usize>, value: Option<f64>) -> Option<String> {
        self.blocks.put_beside(gap, value)
    }

    fn take_overwritten(&self) -> Vec<String> {
        self.blocks.take_overwritten()
    }
}

impl Material {
    fn update(
        &self,
        block: &mut Block,
        operator: Operator,
        start: &Start<'_>,
        end: &mut End<'_>,
    ) -> Result<(), Refusal> {
        let ends = start.gradient.0.iter().zip(start.gradient_end.0);
        let increment: Vec<f64> = ends.map(|(start, end)| end - start).collect();
        self.ask(block, start, &increment)?;
        let Sizes { n, n_tens, .. } = self.sizes;
        let is_at_rest = increment.iter().all(|v| *v == 0.0);
        block.finite(&[A::Stress, A::Statev, A::Ddsdde], is_at_rest)?;
        if let Some(stress) = block.out_of_plane(A::Stress, n..n_tens) {
            return Err(Refusal::error(
                raw::PILUM_E_UNSUPPORTED,
                format!("a stress 13 or 23 of {stress:e} arises, which a plane problem lacks"),
            ));
        }
        let flux = end.flux.0.iter_mut();
        flux.zip(block.reals(A::Stress)).for_each(|(to, v)| *to = v);
        let state = end.state.iter_mut();
        state
            .zip(block.reals(A::Statev))
            .for_each(|(to, v)| *to = v);
        match operator {
            Operator::None => return Ok(()),
            Operator::Consistent => {}
            Operator::Elastic => self.ask(block, start, &vec![0.0; n])?,
        }
        let places: Vec<usize> = (0..n).collect();
        block.read_matrix(A::Ddsdde, self.order, &places, end.operator);
        Ok(())
    }

    /// Fresh arguments.
    fn fill(&self, block: &mut Block, start: &Start<'_>, increment: &[f64]) {
        block.refresh(self.blocks.template());
        let site = start.site(0);
        block.set(A::Stress, start.flux.0);
        block.set(A::Statev, start.state);
        block.set(A::Stran, start.gradient.0);
        block.set(A::Dstran, increment);
        block.set(A::Time, &[start.time - start.moment.step_start, start.time]);
        block.set(A::Dtime, &[time_of_call(start, self.time_dependent)]);
        block.set(A::Coords, &site.position);
        block.set(A::Celent, &[site.length]);
        block.set_integers(A::Noel, &[site.element as i32]);
        block.set_integers(A::Npt, &[site.point as i32]);
        // A static procedure of small strains.
        block.set_integers(A::Jstep, &[start.moment.step as i32, 1, 0, 0]);
        block.set_integers(A::Kinc, &[start.moment.increment as i32]);
        block.hand_over();
    }

    /// One call, from fresh arguments.
    fn ask(&self, block: &mut Block, start: &Start<'_>, increment: &[f64]) -> Result<(), Refusal> {
        self.fill(block, start, increment);
        let recorded = self.record.as_ref().filter(|file| {
            increment.iter().any(|v| *v != 0.0)
                && !self.is_recorded.swap(true, Ordering::Relaxed)
                && !(self.records_once && file.exists())
        });
        let given = recorded.map(|_| text(block, "before"));
        if let (Some(path), Some(given)) = (recorded, &given) {
            // What a routine is given, even if it never returns.
            record(path, given, None)?;
        }
        self.routine.call(&mut block.words, &block.at, N_CMNAME);
        // Known before anything else fails: a damaged block is not used again.
        let returned = self.blocks.returned(block);
        if let (Some(path), Some(given)) = (recorded, &given) {
            record(path, given, Some(block))?;
        }
        returned?;
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
fn record(path: &Path, before: &str, after: Option<&Block>) -> Result<(), Refusal> {
    let all = format!(
        "# All arguments of one call of a UMAT, in their order; matrices column by column.\n\n{before}\n{}",
        after.map_or_else(
            || "# The routine has not returned.\n".to_owned(),
            |after| text(after, "after")
        )
    );
    std::fs::write(path, all).map_err(|why| {
        let message = format!("`record`: {} cannot be written: {why}", path.display());
        Refusal::error(raw::PILUM_E_INTERNAL, message)
    })
}
