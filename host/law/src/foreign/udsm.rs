//! User-defined soil models of PLAXIS, `User_Mod`, as laws.
//!
//! A library has one model or several. It names them, their parameters and state variables by
//! functions, which run where the models do: in a worker, unless the file says otherwise. All calls
//! have six components; plane problems leave yz and zx at zero.
//!
//! A point gets a fresh block of [guarded](super::guarded) arguments; after the call every word that is no
//! output must be what it was.

use super::guarded::{Argument, Block as Guarded, Blocks, Kind, Role};
use super::sidecar::is_column;
use super::{Externals, Foreign, ForeignLaws, Order, Refusal, each_point, time_of_call};
use crate::call::{Batch, End, Operator, Request, Start};
use crate::description::{
    FormulationDescription, InternalVariable, LawDescription, ParameterDescription, Tangent,
};
use crate::instance::{Answer, Described, Instance, Source};
use crate::library::routine::{N_UDSM, Udsm as Routine};
use crate::process::library_bytes::Image;
use abi::Hypothesis;
use abi::raw;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Entries of Props, Sig0 and dEps, whatever the model.
const N_PROPS: usize = 50;
const N_SIG0: usize = 20;
const N_DEPS: usize = 12;
/// Characters of iPrjDir.
const N_DIR: usize = 255;
/// Components, and the place of each of ours, 11 22 33 12 13 23, among xx yy zz xy yz zx.
const N: usize = 6;
const PLACE: [usize; N] = [0, 1, 2, 3, 5, 4];
/// Most models and state variables that are plausible.
const MOST_MODELS: i32 = 200;
const MOST_STATES: i32 = 1000;

/// Tasks of `User_Mod`.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Task {
    Initialise = 1,
    Stresses = 2,
    Stiffness = 3,
    CountStates = 4,
    Attributes = 5,
    ElasticStiffness = 6,
}

/// The arguments in their order.
#[rustfmt::skip]
#[expect(dead_code, reason = "some are never looked at")]
#[derive(Clone, Copy, Debug)]
enum A {
    IdTask, IMod, IsUndr, IStep, ITer, IEl, Int, X, Y, Z, Time0, DTime, Props, Sig0, Swp0, StVar0,
    DEps, D, BulkW, Sig, Swp, StVar, Ipl, NStat, NonSym, IStrsDep, ITimeDep, ITang, IPrjDir,
    IPrjLen, IAbort,
}

impl From<A> for usize {
    fn from(argument: A) -> Self {
        argument as Self
    }
}

type Block = Guarded<N_UDSM>;

use Kind::{Integer as I, Real as R};
use Role::{Array as W, Copy as C, Fixed as F, Output as O};

/// Name, kind and role.
#[rustfmt::skip]
static ARGUMENTS: [Argument; N_UDSM] = [
    ("IDTask", I, F), ("iMod", I, F), ("IsUndr", I, F), ("iStep", I, F), ("iTer", I, F), ("iEl", I, F),
    ("Int", I, F), ("X", R, C), ("Y", R, C), ("Z", R, C), ("Time0", R, C), ("dTime", R, C),
    ("Props", R, F), ("Sig0", R, C), ("Swp0", R, C), ("StVar0", R, W), ("dEps", R, C), ("D", R, W),
    ("BulkW", R, O), ("Sig", R, W), ("Swp", R, O), ("StVar", R, W), ("ipl", I, O), ("nStat", I, O),
    ("NonSym", I, O), ("iStrsDep", I, O), ("iTimeDep", I, O), ("iTang", I, O), ("iPrjDir", I, F),
    ("iPrjLen", I, F), ("iAbort", I, O),
];

/// Asks a library for its models. Its functions run.
///
/// # Errors
/// What it lacks, in words.
pub(super) fn open(foreign: &Foreign, image: &Image) -> Result<ForeignLaws, String> {
    let traps = foreign.externals == Some(Externals::Trap);
    let routine = open_again(&foreign.library, &image.sha256, traps)?;
    let n_models = routine.n_models().unwrap_or(1);
    if !(1..=MOST_MODELS).contains(&n_models) {
        return Err(format!("it says that it has {n_models} models"));
    }
    let mut laws = Described::new();
    for model in 1..=n_models {
        let law = describe(routine, model)?;
        if laws.iter().any(|(other, _)| other.id == law.id) {
            return Err(format!("two of its models are called `{}`", law.id));
        }
        let udsm = Udsm {
            library: foreign.library.clone(),
            sha256: image.sha256.clone(),
            traps,
            order: foreign.tangent_order.unwrap_or_default(),
            model,
        };
        laws.push((law, Arc::new(udsm)));
    }
    Ok(ForeignLaws {
        laws,
        ..ForeignLaws::default()
    })
}

/// The routine in its own image, of a file that has not changed.
fn open_again(path: &Path, sha256: &str, traps: bool) -> Result<Routine, String> {
    Routine::open(path, Image::again(path, sha256)?, traps)
}

/// What a model says of itself.
fn describe(routine: Routine, model: i32) -> Result<LawDescription, String> {
    let name = routine.model_name(model);
    let name = name.map_or(String::new(), |name| readable(&name));
    let id = identifier(&name, &format!("model_{model}"));
    let parameters = parameters(routine, model, &id)?;
    let internal_variables = state_variables(routine, model, &id)?;
    let attributes = asked(routine, model, Task::Attributes)?;
    let solids = [
        Hypothesis::PlaneStrain,
        Hypothesis::Axisymmetric,
        Hypothesis::ThreeD,
    ];
    let formulations = solids.into_iter().zip(0..);
    let formulation = |(hypothesis, index): (Hypothesis, u32)| FormulationDescription {
        hypothesis: hypothesis.name(),
        index,
        symmetric: attributes.integer(A::NonSym) == 0,
        tangent: if attributes.integer(A::ITang) == 1 {
            Tangent::Consistent
        } else {
            Tangent::Approximate
        },
        time_dependent: attributes.integer(A::ITimeDep) != 0,
        internal_variables: internal_variables.clone(),
        ..FormulationDescription::default()
    };
    let law = LawDescription {
        name,
        id,
        doc: format!("User-defined soil model {model} of its library."),
        parameters,
        formulations: formulations.map(formulation).collect(),
        ..LawDescription::default()
    };
    Ok(law.completed())
}

/// A name or a unit of a parameter or a state variable.
fn said(routine: Routine, function: &str, model: i32, number: i32) -> String {
    let text = routine.name(function, model, number);
    text.map_or(String::new(), |text| readable(&text))
}

fn parameters(
    routine: Routine,
    model: i32,
    law: &str,
) -> Result<Vec<ParameterDescription>, String> {
    let n = routine.count("GetParamCount", model);
    let n = n.unwrap_or(N_PROPS as i32);
    if !(0..=N_PROPS as i32).contains(&n) {
        return Err(format!(
            "model `{law}` says that it has {n} parameters, Props holds {N_PROPS}"
        ));
    }
    let mut parameters: Vec<ParameterDescription> = Vec::new();
    for number in 1..=n {
        let symbol = said(routine, "GetParamName", model, number);
        let id = identifier(&symbol, &format!("prop_{number}"));
        let is_taken = parameters.iter().any(|other| other.id == id);
        parameters.push(ParameterDescription {
            id: numbered(id, is_taken, number),
            doc: format!("Parameter {number}, {symbol}"),
            symbol,
            unit: unit(&said(routine, "GetParamUnit", model, number)),
            ..ParameterDescription::default()
        });
    }
    Ok(parameters)
}

fn state_variables(
    routine: Routine,
    model: i32,
    law: &str,
) -> Result<Vec<InternalVariable>, String> {
    let n = asked(routine, model, Task::CountStates)?.integer(A::NStat);
    if let Some(said) = routine.count("GetStateVarCount", model)
        && said != n
    {
        return Err(format!(
            "model `{law}`: GetStateVarCount says {said} state variables, task 4 says {n}"
        ));
    }
    if !(0..=MOST_STATES).contains(&n) {
        return Err(format!(
            "model `{law}` says by task 4 that it has {n} state variables; 0 to {MOST_STATES} are \
             allowed"
        ));
    }
    let mut variables: Vec<InternalVariable> = Vec::new();
    for number in 1..=n {
        let symbol = said(routine, "GetStateVarName", model, number);
        let mut id = identifier(&symbol, &format!("state_{number}"));
        if is_column(&id) {
            id = format!("state_{id}");
        }
        let is_taken = variables.iter().any(|other| other.id == id);
        variables.push(InternalVariable {
            id: numbered(id, is_taken, number),
            doc: format!("State variable {number}, {symbol}"),
            symbol,
            unit: unit(&said(routine, "GetStateVarUnit", model, number)),
            ..InternalVariable::default()
        });
    }
    Ok(variables)
}

/// The answer to a task that is not about a point.
fn asked(routine: Routine, model: i32, task: Task) -> Result<Block, String> {
    let mut block = template(model, 0, &[]);
    block.set_integers(A::IdTask, &[task as i32]);
    block.hand_over();
    routine.call(&mut block.words, &block.at);
    block.overwritten().map_err(|refusal| refusal.message)?;
    match block.integer(A::IAbort) {
        0 => Ok(block),
        abort => Err(format!("task {} ends with iAbort = {abort}", task as i32)),
    }
}

/// A text as PLAXIS takes it: its length may be in its first character.
fn readable(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|b| *b == 0).filter(|end| *end > 0);
    let bytes = &bytes[..end.unwrap_or(bytes.len())];
    let bytes = bytes.trim_ascii_end();
    let bytes = match bytes.split_first() {
        Some((&length, rest)) if length < b' ' || rest.len() == usize::from(length) => {
            &rest[..rest.len().min(usize::from(length))]
        }
        _ => bytes,
    };
    String::from_utf8_lossy(bytes).trim().to_owned()
}

/// Letters of the font Symbol that PLAXIS writes between `@` and `#`.
#[rustfmt::skip]
const GREEK: [(char, &str); 24] = [
    ('a', "alpha"), ('b', "beta"), ('c', "chi"), ('d', "delta"), ('e', "epsilon"), ('f', "phi"),
    ('g', "gamma"), ('h', "eta"), ('i', "iota"), ('j', "phi"), ('k', "kappa"), ('l', "lambda"),
    ('m', "mu"), ('n', "nu"), ('o', "omicron"), ('p', "pi"), ('q', "theta"), ('r', "rho"),
    ('s', "sigma"), ('t', "tau"), ('u', "upsilon"), ('w', "omega"), ('x', "xi"), ('y', "psi"),
];

/// The id of a name: Greek letters in words, subscripts and what is no letter or digit behind `_`.
fn identifier(name: &str, otherwise: &str) -> String {
    let mut id = String::new();
    let mut is_greek = false;
    for c in name.chars() {
        match c {
            '@' => is_greek = true,
            '#' => is_greek = false,
            _ if is_greek && c.is_ascii_alphabetic() => {
                let lower = c.to_ascii_lowercase();
                let word = GREEK.iter().find(|(letter, _)| *letter == lower);
                let word = word.map_or("zeta", |(_, word)| word);
                if c.is_ascii_uppercase() {
                    id.push(word.as_bytes()[0].to_ascii_uppercase() as char);
                    id.push_str(&word[1..]);
                } else {
                    id.push_str(word);
                }
            }
            _ if c.is_ascii_alphanumeric() => id.push(c),
            _ if !id.is_empty() && !id.ends_with('_') => id.push('_'),
            _ => {}
        }
    }
    let id = id.trim_end_matches('_');
    match id.chars().next() {
        None => otherwise.to_owned(),
        Some(first) if first.is_ascii_digit() => format!("{otherwise}_{id}"),
        Some(_) => id.to_owned(),
    }
}

/// An id that is there already gets its number.
fn numbered(id: String, is_taken: bool, number: i32) -> String {
    if is_taken {
        format!("{id}_{number}")
    } else {
        id
    }
}

/// A unit: F, L stand for those of force and length.
fn unit(text: &str) -> String {
    let text = text.replace(['#', '_'], "");
    text.replace('F', "kN").replace('L', "m")
}

/// A model of a library.
#[derive(Debug)]
struct Udsm {
    library: PathBuf,
    sha256: String,
    /// Traps stand for what it calls and nobody supplies.
    traps: bool,
    order: Order,
    model: i32,
}

impl Source for Udsm {
    fn is_serial(&self) -> bool {
        true
    }

    fn create(
        &self,
        hypothesis: Hypothesis,
        formulation: &FormulationDescription,
        parameters: &[f64],
    ) -> Result<Box<dyn Instance>, Answer> {
        let routine = open_again(&self.library, &self.sha256, self.traps);
        let n_states = formulation.internal_variables.len();
        Ok(Box::new(Material {
            routine: routine.map_err(|why| (raw::PILUM_E_INTERNAL, why))?,
            blocks: Blocks::new(template(self.model, n_states, parameters), true),
            n: hypothesis.n_components(),
            n_states,
            order: self.order,
            time_dependent: formulation.time_dependent,
        }))
    }
}

/// Data common to all calls of a material.
fn template(model: i32, n_states: usize, parameters: &[f64]) -> Block {
    let mut entries = [1; N_UDSM];
    for (argument, count) in [
        (A::Props, N_PROPS),
        (A::Sig0, N_SIG0),
        (A::StVar0, n_states),
        (A::DEps, N_DEPS),
        (A::D, N * N),
        (A::Sig, N),
        (A::StVar, n_states),
        (A::IPrjDir, N_DIR),
    ] {
        entries[argument as usize] = count;
    }
    let mut block = Block::new(&ARGUMENTS, entries);
    block.set(A::Props, parameters);
    block.set_integers(A::IMod, &[model]);
    block.set_integers(A::IStep, &[1]);
    block.set_integers(A::ITer, &[1]);
    block.set_integers(A::NStat, &[n_states as i32]);
    let folder = std::env::current_dir().unwrap_or_default();
    let folder = folder.to_string_lossy();
    let characters: Vec<i32> = folder.bytes().take(N_DIR).map(i32::from).collect();
    block.set_integers(A::IPrjDir, &characters);
    block.set_integers(A::IPrjLen, &[characters.len() as i32]);
    block
}

/// A model with its parameters fixed.
#[derive(Debug)]
struct Material {
    routine: Routine,
    blocks: Blocks<N_UDSM>,
    /// Components of the hypothesis.
    n: usize,
    n_states: usize,
    /// How D is in memory.
    order: Order,
    time_dependent: bool,
}

impl Instance for Material {
    fn call(&self, request: Request, batch: Batch<'_, '_>) -> Option<Answer> {
        let operator = match request {
            Request::InitialState => Operator::None,
            Request::Update(operator) => operator,
        };
        let sizes = (self.n, self.n_states, operator.n_entries(self.n));
        Some(self.blocks.with(|block| {
            each_point(sizes, batch, |start, end| match request {
                Request::InitialState => self.initialise(block, start, end),
                Request::Update(_) => self.update(block, operator, start, end),
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
    /// State variables of a stress: an increment of nothing, as there are no strains and no state.
    fn initialise(
        &self,
        block: &mut Block,
        start: &Start<'_>,
        end: &mut End<'_>,
    ) -> Result<(), Refusal> {
        self.fill(block, start, Task::Initialise);
        self.ask(block)?;
        block.finite(&[A::StVar0], true)?;
        let state = end.state.iter_mut();
        state
            .zip(block.reals(A::StVar0))
            .for_each(|(to, v)| *to = v);
        Ok(())
    }

    fn update(
        &self,
        block: &mut Block,
        operator: Operator,
        start: &Start<'_>,
        end: &mut End<'_>,
    ) -> Result<(), Refusal> {
        let is_at_rest = start.gradient.0 == start.gradient_end.0;
        self.fill(block, start, Task::Stresses);
        self.ask(block)?;
        block.finite(&[A::Sig, A::StVar], is_at_rest)?;
        let stress: Vec<f64> = block.reals(A::Sig).collect();
        let state: Vec<f64> = block.reals(A::StVar).collect();
        let missing = PLACE[self.n..].iter().copied();
        if let Some(stress) = block.out_of_plane(A::Sig, missing) {
            return Err(Refusal::error(
                raw::PILUM_E_UNSUPPORTED,
                format!(
                    "the routine returns a stress yz or zx of {stress:e} for strains without yz and zx, and a \
                     plane problem has none: either its material is not symmetric about the plane, or it does \
                     not keep to the order xx yy zz xy yz zx"
                ),
            ));
        }
        for (to, place) in end.flux.0.iter_mut().zip(PLACE) {
            *to = stress[place];
        }
        end.state.copy_from_slice(&state);
        let task = match operator {
            Operator::None => return Ok(()),
            Operator::Consistent => Task::Stiffness,
            Operator::Elastic => Task::ElasticStiffness,
        };
        self.fill(block, start, task);
        if task == Task::Stiffness {
            // The end that has just been found.
            block.set(A::Sig, &stress);
            block.set(A::StVar, &state);
        }
        self.stiffness(block, task)?;
        block.finite(&[A::D], is_at_rest)?;
        block.read_matrix(A::D, self.order, &PLACE[..self.n], end.operator);
        Ok(())
    }

    /// Has D written, and sees whether it is.
    fn stiffness(&self, block: &mut Block, task: Task) -> Result<(), Refusal> {
        let asked = block.clone();
        self.ask(block)?;
        if block.reals(A::D).any(|entry| entry != 0.0) {
            return Ok(());
        }
        // No stiffness, or no word about it: what is not written shows.
        block.refresh(&asked);
        block.set(A::D, &[f64::NAN; N * N]);
        self.ask(block)?;
        if block.reals(A::D).all(f64::is_nan) {
            let message = format!("the routine leaves D unwritten in task {}", task as i32);
            return Err(Refusal::error(raw::PILUM_E_INTERNAL, message));
        }
        block.refresh(&asked);
        self.ask(block)
    }

    /// Fresh arguments.
    fn fill(&self, block: &mut Block, start: &Start<'_>, task: Task) {
        block.refresh(self.blocks.template());
        let six = |values: &[f64]| {
            let mut six = [0.0; N];
            for (value, place) in values.iter().zip(PLACE) {
                six[place] = *value;
            }
            six
        };
        let (stress, strain) = (six(start.flux.0), six(start.gradient.0));
        let strain_end = six(start.gradient_end.0);
        let site = start.site(0);
        let mut increments = [0.0; N_DEPS];
        for c in 0..N {
            increments[c] = strain_end[c] - strain[c];
            increments[N + c] = strain[c];
        }
        block.set_integers(A::IdTask, &[task as i32]);
        block.set_integers(A::IsUndr, &[i32::from(start.moment.is_undrained)]);
        block.set_integers(A::IStep, &[start.moment.increment as i32]);
        block.set_integers(A::IEl, &[site.element as i32]);
        block.set_integers(A::Int, &[site.point as i32]);
        let [x, y] = site.position;
        block.set(A::X, &[x]);
        block.set(A::Y, &[y]);
        block.set(A::Time0, &[start.time]);
        block.set(A::DTime, &[time_of_call(start, self.time_dependent)]);
        block.set(A::Sig0, &stress);
        block.set(A::StVar0, start.state);
        block.set(A::StVar, start.state);
        block.set(A::DEps, &increments);
        // What is not written shows.
        let sig = if task == Task::Stresses {
            [f64::NAN; N]
        } else {
            stress
        };
        block.set(A::Sig, &sig);
    }

    /// One call.
    fn ask(&self, block: &mut Block) -> Result<(), Refusal> {
        block.hand_over();
        self.routine.call(&mut block.words, &block.at);
        self.blocks.returned(block)?;
        let abort = block.integer(A::IAbort);
        if abort == 0 {
            return Ok(());
        }
        // A routine has no other words for an increment that it cannot follow.
        let task = block.integer(A::IdTask);
        let is_update = task == Task::Stresses as i32;
        Err(Refusal {
            status: if is_update {
                raw::PILUM_CUT_STEP
            } else {
                raw::PILUM_E_INTERNAL
            },
            factor: f64::NAN,
            message: format!("the routine ends task {task} with iAbort = {abort}"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_with_and_without_their_length() {
        assert_eq!(readable(b"\x04c'_x            \0"), "c'_x");
        assert_eq!(readable(b"cohesion        \0"), "cohesion");
        assert_eq!(readable(b"E\0garbage"), "E");
        assert_eq!(readable(b"   \0"), "");
        // 37 is the character %.
        let long = format!("%{}   \0", "x".repeat(37));
        assert_eq!(readable(long.as_bytes()), "x".repeat(37));
    }

    #[test]
    fn ids_are_made_of_markup() {
        for (name, id) in [
            ("E", "E"),
            ("@n#", "nu"),
            ("@f#_cv#", "phi_cv"),
            ("@G#", "Gamma"),
            ("p_0#'", "p_0"),
            ("@z#", "zeta"),
            ("", "prop_3"),
            ("2x", "prop_3_2x"),
            ("e (void ratio)", "e_void_ratio"),
        ] {
            assert_eq!(identifier(name, "prop_3"), id, "{name}");
        }
        assert_eq!(unit("F/L^2#"), "kN/m^2");
        assert_eq!(unit("-"), "-");
    }
}
