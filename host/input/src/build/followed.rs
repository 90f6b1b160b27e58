//! Parameters that follow from those of other laws of a case, and from the ground beside an element.

use super::law_shelf::LawShelf;
use crate::Error;
use crate::case::LawInput;
use crate::expression::{Expression, Reference, Wrong};
use crate::ground::ProfileInput;
use crate::material::{ParameterTable, ParameterValue, given, place_failure};
use abi::Hypothesis;
use law::{BuiltLaw, LoadedLaw, Operator, ParameterDescription};
use mechanics::ground::InitialStresses;
use mechanics::model;
use mechanics::problem::{Formulation, Variation};
use std::fmt;
use std::ops::Range;
use std::sync::Arc;
use text::{Spanned, suggestion};

/// Parameters as a law is built with them, and the values of elements where these differ.
type OfGroup = (ParameterTable, Vec<(String, Variation)>);

/// Components 12 and 22 of an elastic operator, row by row.
const SHEAR: usize = 15;
const VERTICAL: usize = 5;

/// An element: its centre, and the effective stress of the ground there before the first phase.
pub(super) type Place = ([f64; 2], [f64; 4]);

/// Why there is no value.
pub(super) enum Without {
    /// It depends on the element, and none was given.
    Place,
    /// The file is wrong.
    Error(Box<Error>),
}

impl<E: Into<Error>> From<E> for Without {
    fn from(error: E) -> Self {
        Self::Error(Box::new(error.into()))
    }
}

/// A value that is asked for: where, by the expression at which place of the file, and the parameters that led there.
#[derive(Clone)]
struct Asked<'p> {
    place: Option<&'p Place>,
    by: Range<usize>,
    chain: Vec<(String, String)>,
}

impl LawShelf<'_> {
    /// The parameters of a law with numbers for expressions, and for values over the height if there is a place.
    ///
    /// # Errors
    /// [`Without::Place`] if there is none and an expression depends on it; what does not fit.
    pub(super) fn valued(
        &self,
        law: &str,
        entry: &LawInput,
        place: Option<&Place>,
    ) -> Result<ParameterTable, Without> {
        let asked = Asked {
            place,
            by: entry.law.span(),
            chain: Vec::new(),
        };
        self.valued_on(law, entry, &asked)
    }

    /// The parameters of a law in a group, by the group's number: with the values of its first element where they
    /// depend on it, and then those of all elements.
    ///
    /// # Errors
    /// An expression refers to a law or parameter that does not exist, or gives no finite number.
    pub(super) fn valued_in(
        &self,
        group: usize,
        law: &str,
        entry: &LawInput,
    ) -> Result<OfGroup, Error> {
        match self.valued(law, entry, None) {
            Ok(table) => return Ok((table, Vec::new())),
            Err(Without::Error(error)) => return Err(*error),
            Err(Without::Place) => {}
        }
        let ground = InitialStresses::new(self.mesh, self.water, self.ground.clone());
        let mut places = ground.of_elements(group);
        if places.is_empty() {
            // A group without elements is refused later.
            places.push(Place::default());
        }
        let at = |place| match self.valued(law, entry, Some(place)) {
            Ok(table) => Ok(table),
            Err(Without::Error(error)) => Err(*error),
            Err(Without::Place) => Err(text::Error::Internal("no place".to_owned()).into()),
        };
        let tables = places.iter().map(at).collect::<Result<Vec<_>, Error>>()?;
        let own = self.tables().parameters(entry);
        let follow = own
            .iter()
            .filter(|(_, own)| own.get_ref().expression().is_some());
        let mut elements = Vec::new();
        for (id, _) in follow {
            let values = tables
                .iter()
                .filter_map(|table| number_of(table, id.get_ref()));
            let values: Vec<f64> = values.collect();
            if values
                .iter()
                .any(|value| value.to_bits() != values[0].to_bits())
            {
                elements.push((id.get_ref().clone(), Variation::Elements(values)));
            }
        }
        let first = tables.into_iter().next().unwrap_or_default();
        Ok((first, elements))
    }

    fn valued_on(
        &self,
        law: &str,
        entry: &LawInput,
        asked: &Asked<'_>,
    ) -> Result<ParameterTable, Without> {
        let mut table = self.tables().parameters(entry);
        for (id, value) in &mut table {
            let follows = match value.get_ref() {
                ParameterValue::Varying(_) => asked.place.is_some(),
                value => value.expression().is_some(),
            };
            if follows {
                let asked = Asked {
                    by: value.span(),
                    ..asked.clone()
                };
                let number = self.parameter(law, id.get_ref(), &asked)?;
                *value.get_mut() = ParameterValue::Number(number);
            }
        }
        Ok(table)
    }

    /// The value of a reference.
    fn referred(&self, reference: &Reference, asked: &Asked<'_>) -> Result<f64, Without> {
        let (law, component) = match reference {
            Reference::Parameter(law, id) => return self.parameter(law, id, asked),
            Reference::ShearModulus(law) => (law, SHEAR),
            Reference::OedometricModulus(law) => (law, VERTICAL),
        };
        self.elastic(law, asked)?
            .get(component)
            .copied()
            .ok_or_else(|| {
                let message = format!("law `{law}` has no elastic operator of ground");
                self.source.error(asked.by.clone(), message).into()
            })
    }

    /// The value of a parameter, given or by default, within its bounds.
    fn parameter(&self, law: &str, id: &str, asked: &Asked<'_>) -> Result<f64, Without> {
        let name = format!("{}.{}", text::key(law), text::key(id));
        let wrong = |at: &Range<usize>, message: String| self.source.error(at.clone(), message);
        let own = (law.to_owned(), id.to_owned());
        if asked.chain.contains(&own) {
            let chain = asked.chain.iter().chain([&own]);
            let chain: Vec<String> = chain.map(|(law, id)| format!("`{law}.{id}`")).collect();
            let message = format!("`{name}` follows from itself: {}", chain.join(" from "));
            return Err(wrong(&asked.by, message).into());
        }
        let entry = self.entry(law, asked.by.clone())?;
        let loaded = self.kept(law, entry)?;
        let declared = self.declared(&loaded, law, id, asked)?;
        let table = self.tables().parameters(entry);
        let written = table.iter().find(|(key, _)| key.get_ref() == id);
        let Some((_, written)) = written else {
            let choice = |number: f64| declared.choices.get(number as usize);
            let message = match declared.default.map(|number| (number, choice(number))) {
                Some((number, None)) => return Ok(number),
                Some((_, Some(label))) => format!("`{name}` is \"{label}\" by default, no number"),
                None => format!("`{name}` has no value: it is left out and has no default"),
            };
            return Err(wrong(&asked.by, message).into());
        };
        let value = self.written(&name, written, own, asked)?;
        if declared.choices.is_empty() && !declared.bounds.contain(value) {
            let unit = &declared.unit;
            let place = asked
                .place
                .map(|([x, y], _)| format!(" at ({x:.4}, {y:.4})"));
            let message = format!(
                "`{name}`: {value} {unit}{} is outside {}",
                place.unwrap_or_default(),
                declared.bounds
            );
            let error = wrong(&written.span(), message);
            return Err(error.label(declared.doc.clone()).into());
        }
        Ok(value)
    }

    /// The value that is written for a parameter, which may follow from others.
    fn written(
        &self,
        name: &str,
        written: &Spanned<ParameterValue>,
        own: (String, String),
        asked: &Asked<'_>,
    ) -> Result<f64, Without> {
        let at = written.span();
        let label = match written.get_ref() {
            ParameterValue::Number(number) => return Ok(*number),
            ParameterValue::Integer(number) => return Ok(*number as f64),
            ParameterValue::Varying(over) => {
                let profile = ProfileInput::Over(over.clone()).read(self.source, at)?;
                let ([_, height], _) = asked.place.ok_or(Without::Place)?;
                return Ok(profile.at(*height));
            }
            ParameterValue::Label(label) => label,
        };
        let wrong = |at: &Range<usize>, message: String| self.source.error(at.clone(), message);
        let Some(text) = Expression::text(label) else {
            let message = format!("`{name}` is \"{label}\", no number");
            return Err(wrong(&asked.by, message).into());
        };
        let parsed = Expression::parse(text);
        let expression = parsed.map_err(|why| self.misread(text, &at, name, &why))?;
        let mut asked = asked.clone();
        asked.chain.push(own);
        asked.by.clone_from(&at);
        let value = expression.value(&mut |reference| self.referred(reference, &asked))?;
        if !value.is_finite() {
            let by = expression.undefined(&mut |reference| self.referred(reference, &asked));
            let by = by.map_or_else(String::new, |call| format!(": {call} is none"));
            let message = format!("`{name}`: the expression gives {value}, no number{by}");
            return Err(wrong(&at, message).into());
        }
        Ok(value)
    }

    /// An error about a text that is no expression.
    fn misread(&self, text: &str, at: &Range<usize>, name: &str, why: &Wrong) -> text::Error {
        let wrong =
            |why: &dyn fmt::Display| self.source.error(at.clone(), format!("`{name}`: {why}"));
        let names = self.file.laws.keys().map(Spanned::get_ref);
        let mut quoted =
            names.filter(|law| law.contains(|c: char| !(c.is_alphanumeric() || c == '_')));
        let after = |law: &String| Some(text.split_once(&format!("{law}."))?.1.trim_start());
        if let Some((law, rest)) = quoted.find_map(|law| Some((law, after(law)?))) {
            let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_'));
            let parameter = &rest[..end.unwrap_or(rest.len())];
            let hint =
                format!("did you mean `\"{law}\".{parameter}`? Names with a hyphen need quotes");
            return wrong(why).hint(hint).into();
        }
        let Wrong::NameAlone(bare) = why else {
            return wrong(why).into();
        };
        let has = |law: &str, entry: &LawInput| {
            let loaded = self.kept(law, entry);
            loaded.is_ok_and(|law| law.description().parameters.iter().any(|p| p.id == *bare))
        };
        let laws = self.file.laws.iter();
        let owners = laws.filter(|(law, entry)| has(law.get_ref(), entry.get_ref()));
        let owners = owners.map(|(law, _)| format!("`{}.{bare}`", text::key(law.get_ref())));
        let owners: Vec<String> = owners.collect();
        if owners.is_empty() {
            return wrong(why).into();
        }
        wrong(&format!("`{bare}` lacks its law: {}", owners.join(" or "))).into()
    }

    fn declared<'l>(
        &self,
        loaded: &'l LoadedLaw,
        law: &str,
        id: &str,
        asked: &Asked<'_>,
    ) -> Result<&'l ParameterDescription, Without> {
        let all = &loaded.description().parameters;
        all.iter()
            .find(|declared| declared.id == id)
            .ok_or_else(|| {
                let message = if all.is_empty() {
                    format!("law `{law}` declares no names of parameters, and so no `{id}`")
                } else {
                    format!("law `{law}` has no parameter `{id}`")
                };
                let known = all.iter().map(|declared| declared.id.as_str());
                let error = self.source.error(asked.by.clone(), message);
                error.hint(suggestion(id, known)).into()
            })
    }

    /// The law of a table, opened once.
    pub(super) fn kept(&self, law: &str, entry: &LawInput) -> Result<LoadedLaw, Error> {
        if let Some(loaded) = self.opened.borrow().get(law) {
            return Ok(loaded.clone());
        }
        let loaded = self.loaded(entry)?;
        self.opened
            .borrow_mut()
            .insert(law.to_owned(), loaded.clone());
        Ok(loaded)
    }

    /// The elastic operator of a law of ground at an element.
    fn elastic(&self, law: &str, asked: &Asked<'_>) -> Result<Vec<f64>, Without> {
        let entry = self.entry(law, asked.by.clone())?;
        let (at, stress) = asked.place.ok_or(Without::Place)?;
        let loaded = self.kept(law, entry)?;
        let hypothesis = self.hypothesis_of_ground();
        if loaded.description().formulation(hypothesis).is_none() {
            let message = format!(
                "law `{law}` is no law of ground here: it is not made for {}",
                hypothesis.name()
            );
            return Err(self.source.error(asked.by.clone(), message).into());
        }
        let table = self.valued_on(law, entry, asked)?;
        let built = self.built(law, (entry, &loaded, &table))?;
        let initial = self.initial(entry, &built.law, law)?;
        let elastic = built.law.at_rest(stress, &initial, Operator::Elastic);
        let (_, operator) = elastic.map_err(|failure| {
            let ([x, y], [s11, s22, s33, s12]) = (at, stress);
            let message = format!(
                "law `{law}` has no elastic operator at ({x:.4}, {y:.4}) under the stresses {s11:.4}, {s22:.4}, \
                 {s33:.4}, {s12:.4} kPa (11, 22, 33, 12): {}",
                failure.message
            );
            self.source.error(asked.by.clone(), message)
        })?;
        Ok(operator)
    }

    fn hypothesis_of_ground(&self) -> Hypothesis {
        model::hypothesis(self.file.analysis, Formulation::Solid, false)
    }

    /// A law of ground with these parameters, each combination once.
    fn built(
        &self,
        law: &str,
        (entry, loaded, table): (&LawInput, &LoadedLaw, &ParameterTable),
    ) -> Result<Arc<BuiltLaw>, Without> {
        let placed = |failure| place_failure(self.source, &entry.law, table, &failure);
        let hypothesis = self.hypothesis_of_ground();
        let (used, _) = loaded.values(&given(table)).map_err(placed)?;
        let bits = used.iter().map(|used| used.value.to_bits()).collect();
        let key = (law.to_owned(), bits);
        if let Some(built) = self.grounds.borrow().get(&key) {
            return Ok(Arc::clone(built));
        }
        let built = Arc::new(loaded.with(hypothesis, &given(table)).map_err(placed)?);
        self.grounds.borrow_mut().insert(key, Arc::clone(&built));
        Ok(built)
    }
}

/// The number that a table gives to a parameter.
fn number_of(table: &ParameterTable, id: &str) -> Option<f64> {
    let mut given = table.iter();
    let (_, value) = given.find(|(key, _)| key.get_ref() == id)?;
    match value.get_ref() {
        ParameterValue::Number(number) => Some(*number),
        _ => None,
    }
}
