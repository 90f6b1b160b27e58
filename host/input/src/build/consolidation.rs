//! Overconsolidation that the ground's stress at rest and its law share.

use super::law_shelf::LawShelf;
use crate::Error;
use crate::case::{GroupInput, LawInput};
use crate::ground::{Over, ProfileInput};
use crate::material::{ParameterTable, ParameterValue};
use mechanics::problem::Profile;
use text::Spanned;

impl LawShelf<'_> {
    /// `ocr` and `pop` of the stress at rest of a group that its law declares and the case does not give the law.
    ///
    /// # Errors
    /// The law's own value is another.
    pub(super) fn consolidation(
        &self,
        group: &GroupInput,
        name: &Spanned<String>,
        entry: &LawInput,
        own: &ParameterTable,
    ) -> Result<ParameterTable, Error> {
        let mut handed = ParameterTable::default();
        let Some(stress) = group.initial_stress.as_ref().map(Spanned::get_ref) else {
            return Ok(handed);
        };
        for (key, given) in [("ocr", &stress.ocr), ("pop", &stress.pop)] {
            let Some(given) = given else { continue };
            let law = self.kept(name.get_ref(), entry)?;
            let mut declared = law.description().parameters.iter();
            if !declared.any(|parameter| parameter.id == key) {
                continue;
            }
            let Some((_, other)) = own.iter().find(|(id, _)| id.get_ref() == key) else {
                let value = match given.get_ref().clone() {
                    ProfileInput::Number(number) => ParameterValue::Number(number),
                    ProfileInput::Points(z) => ParameterValue::Varying(Over { z }),
                    ProfileInput::Over(over) => ParameterValue::Varying(over),
                };
                let at = given.span();
                handed.insert(
                    Spanned::new(at.clone(), key.to_owned()),
                    Spanned::new(at, value),
                );
                continue;
            };
            let ground = given.get_ref().read(self.source, given.span())?;
            if self.profile(other)?.as_ref() != Some(&ground) {
                let message = format!(
                    "`{key}` of the ground's stress at rest and `{key}` of its law `{}` are one value, and \
                     here they differ",
                    name.get_ref()
                );
                let error = self.source.error(given.span(), message);
                let error = self
                    .source
                    .mark(error, other.span(), "the law's".to_owned());
                return Err(error
                    .hint(format!("give it here alone: the law takes this `{key}`"))
                    .into());
            }
        }
        Ok(handed)
    }

    /// The numbers of a parameter over the height; `None` if it is no number.
    fn profile(&self, value: &Spanned<ParameterValue>) -> Result<Option<Profile>, Error> {
        let input = match value.get_ref() {
            ParameterValue::Number(number) => ProfileInput::Number(*number),
            ParameterValue::Integer(number) => ProfileInput::Number(*number as f64),
            ParameterValue::Varying(over) => ProfileInput::Over(over.clone()),
            ParameterValue::Label(_) => return Ok(None),
        };
        Ok(Some(input.read(self.source, value.span())?))
    }
}
