//! Behaviours of MFront's generic interface as laws: small strains, and cohesive zones.
//!
//! The library describes itself by symbols, which are read from its file. A law is called as its
//! behaviour, parameters and internal variables as MFront names them. Material properties and
//! external state variables are parameters here, constant in a run; MFront's own parameters are
//! too, with their defaults.
//!
//! MFront's components are Kelvin–Mandel: shear strain γ/√2, shear stress √2 τ. Internal variables
//! that are tensors stay in them.

use super::symbols::Symbols;
use super::{Foreign, ForeignLaws, Refusal, each_point};
use crate::Error;
use crate::call::{Batch, End, Operator, Request, Start};
use crate::description::{
    Bounds, FormulationDescription, InternalVariable, LawDescription, ParameterDescription, or,
};
use crate::instance::{Answer, Instance, Source};
use crate::library::mfront::{Behaviour, Point, Sizes};
use crate::process::library_bytes::{Image, hexadecimal_sha256};
use abi::Hypothesis;
use abi::raw;
use std::f64::consts::SQRT_2;
use std::path::PathBuf;
use std::sync::Arc;

/// Temperature where a behaviour asks for one and the file gives none, K.
const TEMPERATURE: f64 = 293.15;
/// Version of the interface that is understood.
const API_VERSION: u16 = 1;
/// Requests, in the first entry of the operator.
const NO_OPERATOR: f64 = 0.0;
const ELASTIC_OPERATOR: f64 = 1.0;
const CONSISTENT_OPERATOR: f64 = 4.0;

/// Describes the behaviours of a library. Nothing of it runs.
///
/// # Errors
/// [`Error::Library`] if it cannot be read or has no behaviour.
pub(super) fn open(foreign: &Foreign, image: &Image) -> Result<ForeignLaws, Error> {
    let path = &foreign.library;
    let fault = |why: String| Error::library(format!("library {} {why}", path.display()));
    let bytes =
        text::file::read_library(path).map_err(|why| fault(format!("cannot be read: {why}")))?;
    if hexadecimal_sha256(&bytes) != image.sha256 {
        return Err(fault("was changed while it was read".to_owned()));
    }
    let symbols = Symbols::read(&bytes).map_err(fault)?;
    let names = symbols.before("_mfront_mkt");
    if names.is_empty() {
        return Err(fault(
            "has no behaviour of MFront's generic interface (no symbol `…_mfront_mkt`)".to_owned(),
        ));
    }
    let laws = names.into_iter().map(|name| {
        let reader = Reader {
            symbols: &symbols,
            name,
        };
        let (law, slots, formulations) = reader.describe();
        let source: Arc<dyn Source> = Arc::new(Mfront {
            library: path.clone(),
            sha256: image.sha256.clone(),
            name: name.to_owned(),
            slots,
            formulations,
        });
        (law, source)
    });
    Ok(ForeignLaws {
        laws: laws.collect(),
        ..ForeignLaws::default()
    })
}

/// Descriptions of the behaviours in the bytes of a library.
pub(super) fn describe(bytes: &[u8]) -> Result<Vec<LawDescription>, String> {
    let symbols = Symbols::read(bytes)?;
    let names = symbols.before("_mfront_mkt").into_iter();
    let reader = |name| Reader {
        symbols: &symbols,
        name,
    };
    Ok(names.map(|name| reader(name).describe().0).collect())
}

/// The counterpart of one of our parameters.
#[derive(Clone, Debug, PartialEq)]
enum Slot {
    Property,
    External,
    /// A parameter of MFront, with its name and the bits of its default.
    Parameter(String, u64),
}

/// A formulation there.
#[derive(Clone, Debug)]
struct Modelling {
    /// MFront's name of it.
    name: &'static str,
    /// What sets its parameters.
    setter: String,
}

/// Our hypotheses, and MFront's, for strains and for cohesive zones.
const STRAINS: [(Hypothesis, &str); 3] = [
    (Hypothesis::PlaneStrain, "PlaneStrain"),
    (Hypothesis::Axisymmetric, "Axisymmetrical"),
    (Hypothesis::ThreeD, "Tridimensional"),
];
const ZONES: [(Hypothesis, &str); 2] = [
    (Hypothesis::Interface2d, "PlaneStrain"),
    (Hypothesis::Interface3d, "Tridimensional"),
];

/// The symbols of one behaviour.
struct Reader<'a> {
    symbols: &'a Symbols<'a>,
    name: &'a str,
}

impl Reader<'_> {
    /// The symbol of the behaviour under a hypothesis, else that of the behaviour.
    fn symbol(&self, modelling: &str, what: &str) -> String {
        let special = format!("{}_{modelling}_{what}", self.name);
        if self.symbols.has(&special) {
            special
        } else {
            format!("{}_{what}", self.name)
        }
    }

    fn number(&self, modelling: &str, what: &str) -> u16 {
        let symbol = self.symbol(modelling, what);
        self.symbols.number(&symbol).unwrap_or(0)
    }

    /// Names, and types if they are there (else all are scalars).
    fn variables(&self, modelling: &str, what: &str) -> Option<Vec<(String, i32)>> {
        let n = self.number(modelling, &format!("n{what}"));
        let names = self.symbols.texts(&self.symbol(modelling, what), n)?;
        let types = self.symbol(modelling, &format!("{what}Types"));
        let types = self.symbols.integers(&types, n);
        let types = types.unwrap_or_else(|| vec![0; names.len()]);
        Some(names.into_iter().zip(types).collect())
    }

    /// Gradient and force, of which there must be one each.
    fn fits(&self, modelling: &str, gradient: &str, force: &str) -> bool {
        let one = |what: &str, name: &str| {
            self.variables(modelling, what)
                .is_some_and(|v| v.len() == 1 && v[0].0 == name)
        };
        one("Gradients", gradient) && one("ThermodynamicForces", force)
    }

    fn text(&self, what: &str) -> String {
        let symbol = format!("{}_{what}", self.name);
        let text = self.symbols.text(&symbol).unwrap_or_default();
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    fn describe(&self) -> (LawDescription, Vec<Slot>, Vec<Modelling>) {
        let mut parameters = Vec::new();
        let mut slots = Vec::new();
        let mut formulations = Vec::new();
        let mut modellings = Vec::new();
        let mut why = None;
        match self.hypotheses() {
            Err(reason) => why = Some(reason),
            Ok(hypotheses) => {
                for (hypothesis, name) in hypotheses {
                    match self.formulation(hypothesis, name, formulations.len() as u32) {
                        Ok((formulation, its_slots, its_parameters)) => {
                            if formulations.is_empty() {
                                (slots, parameters) = (its_slots, its_parameters);
                            } else if its_slots != slots {
                                // One list of parameters is all a law has.
                                continue;
                            }
                            modellings.push(Modelling {
                                name,
                                setter: self.symbol(name, "setParameter"),
                            });
                            formulations.push(formulation);
                        }
                        Err(reason) => why = Some(reason),
                    }
                }
            }
        }
        let doc = match why.filter(|_| formulations.is_empty()) {
            Some(why) => format!("This host cannot use it: {why}."),
            None => or(self.text("description"), "A behaviour made with MFront."),
        };
        let law = LawDescription {
            id: self.name.to_owned(),
            name: self.name.to_owned(),
            version: or(self.text("build_id"), "unknown"),
            author: self.text("author"),
            licence: String::new(),
            doc,
            references: self.text("src"),
            parameters,
            formulations,
        };
        (law.completed(), slots, modellings)
    }

    /// The hypotheses under which there is a function.
    fn hypotheses(&self) -> Result<Vec<(Hypothesis, &'static str)>, String> {
        let version = self.number("", "api_version");
        if version != API_VERSION {
            return Err(format!("version {version} of the interface"));
        }
        let kind = (
            self.number("", "BehaviourType"),
            self.number("", "BehaviourKinematic"),
        );
        let all: &[_] = match kind {
            (1, 1) => &STRAINS,
            (3, 2) => &ZONES,
            (2, _) => return Err("finite strains".to_owned()),
            _ => return Err("neither of small strains nor a cohesive zone".to_owned()),
        };
        if self.number("", "SymmetryType") != 0 {
            return Err("orthotropic, and there are no axes of the material".to_owned());
        }
        let (gradient, force) = match kind {
            (1, _) => ("Strain", "Stress"),
            _ => ("OpeningDisplacement", "CohesiveForce"),
        };
        let found: Vec<_> = all
            .iter()
            .filter(|(_, name)| {
                self.symbols.has(&format!("{}_{name}", self.name))
                    && self.fits(name, gradient, force)
            })
            .copied()
            .collect();
        if found.is_empty() {
            return Err("none of the hypotheses of this host".to_owned());
        }
        Ok(found)
    }

    fn formulation(
        &self,
        hypothesis: Hypothesis,
        modelling: &str,
        index: u32,
    ) -> Result<(FormulationDescription, Vec<Slot>, Vec<ParameterDescription>), String> {
        let (slots, parameters) = self.inputs(modelling)?.into_iter().unzip();
        let formulation = FormulationDescription {
            hypothesis: hypothesis.name(),
            index,
            internal_variables: self.internal_variables(modelling, hypothesis)?,
            ..FormulationDescription::default()
        };
        Ok((formulation, slots, parameters))
    }

    /// Inputs of the behaviour with their slots, in the order of the interface.
    fn inputs(&self, modelling: &str) -> Result<Vec<(Slot, ParameterDescription)>, String> {
        let mut inputs = Vec::new();
        let parameter = |name: &str, default| self.parameter(modelling, name, default);
        if self.number(modelling, "requiresStiffnessTensor") != 0 {
            if self.number("", "ElasticSymmetryType") != 0 {
                return Err("it wants an orthotropic stiffness".to_owned());
            }
            for name in ["YoungModulus", "PoissonRatio"] {
                inputs.push((Slot::Property, parameter(name, None)));
            }
        }
        if self.number(modelling, "requiresThermalExpansionCoefficientTensor") != 0 {
            inputs.push((Slot::Property, parameter("ThermalExpansion", None)));
        }
        for (name, _) in self.listed(modelling, "MaterialProperties", "material properties")? {
            inputs.push((Slot::Property, parameter(&name, None)));
        }
        let removed = format!("{}_TemperatureRemovedFromExternalStateVariables", self.name);
        if self.symbols.number(&removed).unwrap_or(1) != 0 {
            let temperature = parameter("Temperature", Some(TEMPERATURE));
            inputs.push((Slot::External, temperature));
        }
        let external = "external state variables";
        for (name, kind) in self.listed(modelling, "ExternalStateVariables", external)? {
            if kind != 0 {
                return Err(format!("its external state variable {name} is no scalar"));
            }
            let default = (name == "Temperature").then_some(TEMPERATURE);
            inputs.push((Slot::External, parameter(&name, default)));
        }
        for (name, kind) in self.listed(modelling, "Parameters", "parameters")? {
            let default = self.symbol(modelling, &format!("{name}_ParameterDefaultValue"));
            // Whole numbers steer the algorithm.
            if kind == 0 {
                let default = self.symbols.real(&default).filter(|v| !v.is_nan());
                let mut parameter = parameter(&name, default);
                // Not given, it is left as it is.
                parameter.optional = default.is_none();
                let bits = default.unwrap_or(f64::NAN).to_bits();
                inputs.push((Slot::Parameter(name, bits), parameter));
            }
        }
        Ok(inputs)
    }

    /// Names and types of a list of variables.
    fn listed(
        &self,
        modelling: &str,
        list: &str,
        what: &str,
    ) -> Result<Vec<(String, i32)>, String> {
        let variables = self.variables(modelling, list);
        variables.ok_or_else(|| format!("its {what} cannot be read"))
    }

    fn internal_variables(
        &self,
        modelling: &str,
        hypothesis: Hypothesis,
    ) -> Result<Vec<InternalVariable>, String> {
        let mut internal_variables = Vec::new();
        let internal = "internal state variables";
        for (name, kind) in self.listed(modelling, "InternalStateVariables", internal)? {
            let components = components(kind, hypothesis)
                .ok_or_else(|| format!("its internal state variable {name} is of type {kind}"))?;
            internal_variables.extend(components.iter().map(|component| {
                let (id, doc) = match *component {
                    "" => (name.clone(), ""),
                    component => (
                        format!("{name}_{component}"),
                        "Component of a tensor, times √2 if it is a shear.",
                    ),
                };
                InternalVariable {
                    id,
                    doc: doc.to_owned(),
                    ..InternalVariable::default()
                }
            }));
        }
        Ok(internal_variables)
    }

    /// Physical bounds are never left; ordinary ones are those of the law's fit.
    fn parameter(&self, modelling: &str, name: &str, default: Option<f64>) -> ParameterDescription {
        let bound = |which: &str, missing: f64| {
            let symbol = self.symbol(modelling, &format!("{name}_{which}"));
            self.symbols.long_double(&symbol).unwrap_or(missing)
        };
        let bounds = |kind: &str| {
            let lower = bound(&format!("Lower{kind}Bound"), f64::NEG_INFINITY);
            Bounds::closed(lower, bound(&format!("Upper{kind}Bound"), f64::INFINITY))
        };
        ParameterDescription {
            id: name.to_owned(),
            default,
            bounds: bounds("Physical"),
            usual: bounds(""),
            ..ParameterDescription::default()
        }
    }
}

/// Components of a variable of MFront's type, by name; one without a name for a scalar.
fn components(kind: i32, hypothesis: Hypothesis) -> Option<&'static [&'static str]> {
    let in_space = matches!(hypothesis, Hypothesis::ThreeD | Hypothesis::Interface3d);
    match (kind, in_space) {
        (0, _) => Some(&[""]),
        (1, false) => Some(&["11", "22", "33", "12"]),
        (1, true) => Some(&["11", "22", "33", "12", "13", "23"]),
        (2, false) => Some(&["1", "2"]),
        (2, true) => Some(&["1", "2", "3"]),
        (3, false) => Some(&["11", "22", "33", "12", "21"]),
        (3, true) => Some(&["11", "22", "33", "12", "21", "13", "31", "23", "32"]),
        _ => None,
    }
}

/// A behaviour.
#[derive(Debug)]
struct Mfront {
    library: PathBuf,
    sha256: String,
    name: String,
    slots: Vec<Slot>,
    formulations: Vec<Modelling>,
}

// The interface asks for functions that may be called by several threads.
impl Source for Mfront {
    fn create(
        &self,
        hypothesis: Hypothesis,
        formulation: &FormulationDescription,
        parameters: &[f64],
    ) -> Result<Box<dyn Instance>, Answer> {
        let modelling = &self.formulations[formulation.index as usize];
        let (mut properties, mut external, mut set) = (Vec::new(), Vec::new(), Vec::new());
        for (slot, &value) in self.slots.iter().zip(parameters) {
            match slot {
                Slot::Property => properties.push(value),
                Slot::External => external.push(value),
                Slot::Parameter(_, default) if value.is_nan() || value.to_bits() == *default => {}
                Slot::Parameter(name, _) => set.push((name.as_str(), value)),
            }
        }
        let function = format!("{}_{}", self.name, modelling.name);
        let open =
            |image| Behaviour::open(&self.library, image, &function, &modelling.setter, &set);
        let behaviour = Image::again(&self.library, &self.sha256).and_then(open);
        let n = hypothesis.n_components();
        Ok(Box::new(Material {
            behaviour: behaviour.map_err(|why| (raw::PILUM_E_INTERNAL, why))?,
            sizes: Sizes {
                n,
                n_states: formulation.internal_variables.len(),
                n_properties: properties.len(),
                n_external: external.len(),
            },
            shear: if hypothesis.is_interface() { n } else { 3 },
            properties,
            external,
        }))
    }
}

/// A behaviour with its parameters fixed.
#[derive(Debug)]
struct Material {
    behaviour: Behaviour,
    sizes: Sizes,
    /// The first component that carries √2.
    shear: usize,
    properties: Vec<f64>,
    external: Vec<f64>,
}

impl Instance for Material {
    fn call(&self, request: Request, batch: Batch<'_, '_>) -> Option<Answer> {
        let Request::Update(operator) = request else {
            return None;
        };
        let Sizes { n, n_states, .. } = self.sizes;
        let mut point = Point {
            gradients: [vec![0.0; n], vec![0.0; n]],
            forces: [vec![0.0; n], vec![0.0; n]],
            states: [vec![0.0; n_states], vec![0.0; n_states]],
            properties: self.properties.clone(),
            external: self.external.clone(),
            k: vec![0.0; n * n],
            dt: 0.0,
            rdt: 1.0,
        };
        let sizes = (n, n_states, operator.n_entries(n));
        Some(each_point(sizes, batch, |start, end| {
            self.update(&mut point, operator, start, end)
        }))
    }
}

impl Material {
    /// √2 of a shear, 1 of the others.
    fn root(&self, component: usize) -> f64 {
        if component < self.shear { 1.0 } else { SQRT_2 }
    }

    fn update(
        &self,
        point: &mut Point,
        operator: Operator,
        start: &Start<'_>,
        end: &mut End<'_>,
    ) -> Result<(), Refusal> {
        let request = match operator {
            Operator::None => NO_OPERATOR,
            Operator::Elastic => ELASTIC_OPERATOR,
            Operator::Consistent => CONSISTENT_OPERATOR,
        };
        let unreliable = self.ask(point, start, request)?;
        for (i, to) in end.flux.0.iter_mut().enumerate() {
            *to = point.forces[1][i] / self.root(i);
        }
        end.state.copy_from_slice(&point.states[1]);
        let n = self.sizes.n;
        for (place, to) in end.operator.iter_mut().enumerate() {
            *to = point.k[place] / (self.root(place / n) * self.root(place % n));
        }
        unreliable
    }

    /// One call, from fresh arguments. `Ok(Err(…))`: done, but inaccurate.
    fn ask(
        &self,
        point: &mut Point,
        start: &Start<'_>,
        request: f64,
    ) -> Result<Result<(), Refusal>, Refusal> {
        for i in 0..self.sizes.n {
            let root = self.root(i);
            point.gradients[0][i] = start.gradient.0[i] / root;
            point.gradients[1][i] = start.gradient_end.0[i] / root;
            let force = start.flux.0[i] * root;
            (point.forces[0][i], point.forces[1][i]) = (force, force);
        }
        for states in &mut point.states {
            states.copy_from_slice(start.state);
        }
        point.properties.copy_from_slice(&self.properties);
        point.external.copy_from_slice(&self.external);
        point.k.fill(0.0);
        point.k[0] = request;
        point.dt = start.time_increment;
        point.rdt = 1.0;
        let (verdict, message) = self.behaviour.call(self.sizes, point);
        let said = |what: &str| match message.as_str() {
            "" => what.to_owned(),
            message => format!("{what}: {message}"),
        };
        match verdict {
            1 => Ok(Ok(())),
            0 => Ok(Err(Refusal::error(
                raw::PILUM_OK_UNRELIABLE,
                said("the behaviour calls its result inaccurate"),
            ))),
            _ => Err(Refusal {
                status: raw::PILUM_CUT_STEP,
                factor: if point.rdt > 0.0 && point.rdt < 1.0 {
                    point.rdt
                } else {
                    f64::NAN
                },
                message: said("the behaviour cannot follow the increment"),
            }),
        }
    }
}
