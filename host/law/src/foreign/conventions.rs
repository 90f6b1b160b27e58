//! What laws of each route into the program mean by their numbers.

use std::fmt::Write as _;

/// Conventions of a route. The adapter translates; who writes or reads such a routine needs them.
#[derive(Clone, Copy, Debug)]
pub struct Route {
    /// Name.
    pub name: &'static str,
    /// Key in a file.
    pub key: &'static str,
    /// What, and how.
    pub conventions: &'static [(&'static str, &'static str)],
}

/// All routes by which laws come in.
pub const ROUTES: &[Route] = &[
    Route {
        name: "pilum",
        key: "law = \"ID\"",
        conventions: &[
            (
                "order",
                "11 22 33 12 (13 23); axisymmetric r z θ rz; interfaces n t (s)",
            ),
            ("sign", "tension and opening positive"),
            ("shear strain", "γ = 2 ε"),
            ("tangent", "row-major, dσ/dε at the end of the increment"),
            ("strains", "totals at start and end"),
            ("stress, state", "start is read, end is written"),
            ("smaller step", "status CUT_STEP with a factor"),
        ],
    },
    Route {
        name: "umat",
        key: "adapter = \"umat\", library = \"PATH\", law = \"ID\"",
        conventions: &[
            (
                "order",
                "11 22 33 12 (13 23); axisymmetric r z θ rz; interfaces n t (s)",
            ),
            ("sign", "tension and opening positive"),
            ("shear strain", "γ = 2 ε in STRAN, DSTRAN and DDSDDE"),
            (
                "tangent",
                "DDSDDE column-major, unsymmetric is kept, at the end of the increment",
            ),
            ("strains", "STRAN at the start, DSTRAN the increment"),
            (
                "stress, state",
                "STRESS, STATEV hold the start and are overwritten by the end",
            ),
            (
                "time",
                "TIME(1) of the phase, TIME(2) of all, both at the start of the increment",
            ),
            ("smaller step", "PNEWDT below 1"),
        ],
    },
    Route {
        name: "mfront",
        key: "adapter = \"mfront\", library = \"PATH\", law = \"BEHAVIOUR\"",
        conventions: &[
            (
                "order",
                "11 22 33 12 (13 23); axisymmetric r z θ rz; cohesive zones n t (s)",
            ),
            ("sign", "tension and opening positive"),
            ("shear", "strain γ / √2, stress √2 τ (Kelvin–Mandel)"),
            ("tangent", "row-major, at the end of the increment"),
            ("strains", "totals at start and end"),
            ("stress, state", "start is read, end is written"),
            (
                "parameters",
                "material properties and external state variables, constant; its own by setParameter",
            ),
            ("smaller step", "return value −1, factor in rdt"),
        ],
    },
    Route {
        name: "udsm",
        key: "adapter = \"udsm\", library = \"PATH\", law = \"MODEL\"",
        conventions: &[
            ("order", "xx yy zz xy yz zx; axisymmetric r z θ rz"),
            ("sign", "tension positive"),
            ("shear strain", "γ = 2 ε in dEps and D"),
            (
                "tangent",
                "D of task 3 after task 2, column-major unless `tangent_order` says otherwise",
            ),
            (
                "strains",
                "dEps(1:6) the increment, dEps(7:12) the total at the start",
            ),
            (
                "stress, state",
                "Sig0, StVar0 are read, Sig, StVar written; task 1 writes StVar0",
            ),
            ("smaller step", "iAbort other than 0 in task 2"),
        ],
    },
];

/// The routes as `pilum laws` prints them.
pub fn text() -> String {
    let mut text = String::from("conventions\n");
    for route in ROUTES {
        let _ = writeln!(text, "  {} ({})", route.name, route.key);
        for (what, how) in route.conventions {
            let _ = writeln!(text, "    {what:16}{how}");
        }
    }
    text
}
