//! Choices of a case's solver that have no effect next to others.

use crate::Case;
use mechanics::Settings;
use mechanics::settings::{Control, Method, Tangents};

/// Warning about them, at their table in the file.
pub(crate) fn choices(case: &Case) -> Vec<String> {
    let place = case.source.place(&case.file.solver.span());
    let found = of(case.file.solver.get_ref()).into_iter();
    found.map(|what| format!("{place}: {what}")).collect()
}

fn of(solver: &Settings) -> Vec<String> {
    let mut found = Vec::new();
    let method = solver.method.name();
    if solver.control == Control::Viscous && !solver.method.is_newton() {
        found.push(format!(
            "`control = \"viscous\"` has no effect with `method = \"{method}\"`: viscous control leads on where Newton iterations stand \
             still, with `auto` and `newton`"
        ));
    }
    if solver.tangents == Tangents::Differences && solver.method == Method::InitialStress {
        found.push(format!(
            "`tangents = \"differences\"` has no effect with `method = \"{method}\"`, whose matrix is the elastic stiffness"
        ));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_effect_is_said_and_what_has_is_not() {
        let with = |method, control, tangents| {
            of(&Settings {
                method,
                control,
                tangents,
                ..Settings::default()
            })
        };
        let (viscous, differences) = (Control::Viscous, Tangents::Differences);
        for method in [Method::Auto, Method::Newton] {
            assert!(with(method, viscous, differences).is_empty(), "{method:?}");
        }
        for method in [
            Method::ModifiedNewton,
            Method::InitialStress,
            Method::QuasiNewton,
        ] {
            let said = with(method, viscous, Tangents::Auto);
            assert!(said.len() == 1 && said[0].contains("viscous"), "{said:?}");
            assert!(with(method, Control::Auto, Tangents::Auto).is_empty());
        }
        // Their matrix is made of tangents, renewed seldom.
        assert!(with(Method::ModifiedNewton, Control::Auto, differences).is_empty());
        let said = with(Method::InitialStress, Control::Auto, differences);
        assert!(
            said.len() == 1 && said[0].contains("differences"),
            "{said:?}"
        );
    }
}
