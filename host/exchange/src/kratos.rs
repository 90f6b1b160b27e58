//! Input of Kratos GeoMechanics: a script that reads `model.json`, computes, and writes what [`import`](crate::import())
//! reads.

/// Entry of a law's library that Kratos calls.
pub(crate) const SYMBOL: &str = "umat_";
/// The script's results: step, node, displacements, reactions; both from 0.
pub(crate) const RESULTS: &str = "nodes.csv";

pub(crate) fn files() -> Vec<(String, String)> {
    vec![(
        "run_kratos.py".to_owned(),
        include_str!("run_kratos.py").to_owned(),
    )]
}
