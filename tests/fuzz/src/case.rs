//! Case files: keys, bases, variants; meshes; laws, loads, probes and figures of small ones.

use crate::ways_in;
use crate::{shown, source};
use runs::run::check;

/// Larger meshes are read alone: building one that may be asked for takes a second.
const MOST_ELEMENTS: usize = 400;
/// Variants that are looked at.
const MOST_VARIANTS: usize = 4;

pub(super) fn read(data: &[u8]) {
    let Some(source) = source(data) else { return };
    // An adapter opens whatever library is named.
    let opens_libraries = source.text().contains("adapter");
    let Some(cases) = shown(ways_in::case(source)) else {
        return;
    };
    for case in cases.iter().take(MOST_VARIANTS) {
        assert!(!case.default_folder().as_os_str().is_empty(), "no folder");
        if ways_in::elements(case) > MOST_ELEMENTS {
            continue;
        }
        let Some(mesh) = shown(ways_in::mesh(case)) else {
            continue;
        };
        let n = mesh.nodes.len();
        let solids = mesh.solids.iter().flat_map(|solid| solid.nodes().to_vec());
        let joints = mesh.joints.iter().flat_map(|j| [j.minus, j.plus]);
        assert!(
            solids.chain(joints.flatten()).all(|node| node < n),
            "an element without a node"
        );
        if !opens_libraries {
            shown(check(case));
        }
    }
}
