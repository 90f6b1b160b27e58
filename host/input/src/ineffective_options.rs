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
