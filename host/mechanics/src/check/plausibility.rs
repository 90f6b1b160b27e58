//! Input that can be computed but is seldom meant, in words and with numbers.

use crate::element::QUAD8;
use crate::ground::beside_joints;
use crate::group::Group;
use crate::mesh::{Mesh, Solid};
use crate::problem::{Drainage, Formulation, Material, Problem, Profile};
use law::ParameterDescription;
use std::collections::{HashMap, HashSet};

/// Strain beyond which geometry can no longer be taken as it was: the Green–Lagrange strain of a
/// stretch is ε + ε²/2, so what is left out reaches ε/2, 10 % of the strain itself.
pub(crate) const LARGE: f64 = 0.2;
/// A water table within this part of an element's height from its edge counts as at the edge.
const ROUNDED: f64 = 1e-9;
/// Largest difference between a layer's thickness and a parameter that stands for it, as a
/// fraction: more than what a rounded number makes.
const SAME_THICKNESS: f64 = 0.01;
/// A body that takes less of a full turn than this about a node has a corner there, radians; half a
/// turn is a straight side.
const CORNER: f64 = 170.0 / 180.0 * std::f64::consts::PI;

/// Heaviest material, and range of ground, kN/m³: steel weighs 77, lead 111; peat about 10, ground rich in ore 30.
const HEAVY: f64 = 90.0;
const GROUND: [f64; 2] = [5.0, 30.0];
/// Extent beyond any site, m.
const VAST: f64 = 1e4;
/// Tolerances above this share of the forces in play are no accuracy.
const LOOSE: f64 = 0.1;

/// Warnings about a model before it runs. `swaps`: the groups that take another law, by
/// phase.
pub(crate) fn warnings(
    problem: &Problem,
    groups: &[Group],
    swaps: &[Vec<(usize, Material)>],
) -> Vec<String> {
    let mesh = &problem.mesh;
    let mut warnings = far(problem);
    warnings.extend(vast(problem));
    warnings.extend(loose(problem));
    warnings.extend(weights(problem));
    warnings.extend(dry_weights(problem));
    warnings.extend(lost(problem));
    warnings.extend(super::peaks::warnings(problem));
    warnings.extend(super::uncovered_loads::warnings(problem));
    warnings.extend(beside_undrained(problem));
    warnings.extend(water_inside(problem));
    for (number, group) in groups.iter().enumerate() {
        match group.formulation {
            Formulation::ThinLayer => {
                warnings.extend(stacked(mesh, group));
                let later = swaps.iter().flatten().filter(|(g, _)| *g == number);
                let laws = std::iter::once(&group.law).chain(later.map(|(_, law)| law));
                let mut seen = HashSet::new();
                for law in laws.filter(|law| seen.insert(&law.name)) {
                    warnings.extend(other_thickness(group, law));
                }
            }
            Formulation::ZeroThickness => warnings.extend(hung(mesh, groups, number)),
            Formulation::Solid if group.is_linear() => {
                warnings.extend(implausible_stiffness(group));
            }
            Formulation::Solid => {}
        }
    }
    warnings
}

/// Whether a water table stands inside an element.
fn is_cut(mesh: &Mesh, solid: &Solid, level: &Profile) -> bool {
    let heights = solid.nodes().iter().map(|&node| {
        let [x, y] = mesh.nodes[node];
        [y, y - level.at(x)]
    });
    let ends = |c: usize| {
        let all = heights.clone().map(|height| height[c]);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], h| {
            [low.min(h), high.max(h)]
        })
    };
    let ([bottom, top], [low, high]) = (ends(0), ends(1));
    let least = ROUNDED * (top - bottom);
    low < -least && high > least
}

/// Phases that change a water table which stands inside elements, before or after.
fn water_inside(problem: &Problem) -> Vec<String> {
    let mesh = &problem.mesh;
    let Some(water) = &problem.water else {
        return Vec::new();
    };
    let mut level = &water.level;
    let mut warnings = Vec::new();
    for (number, phase) in problem.phases.iter().enumerate() {
        let Some(next) = phase.water_level.as_ref().filter(|next| *next != level) else {
            continue;
        };
        let active = problem.active_after(number + 1);
        let wet = |solid: &&Solid| active[solid.group] && problem.groups[solid.group].pore_water;
        let own = mesh.solids.iter().filter(wet);
        let cut = own.filter(|solid| is_cut(mesh, solid, level) || is_cut(mesh, solid, next));
        let cut: Vec<&Solid> = cut.collect();
        if let Some(first) = cut.first() {
            let corners = first.corners();
            let middle = |c: usize| {
                let sum: f64 = corners.iter().map(|&node| mesh.nodes[node][c]).sum();
                sum / corners.len() as f64
            };
            warnings.push(format!(
                "phase `{}` changes a water table that stands inside {} before or after, the first \
                 around ({:.4}, {:.4}): they see its pressure at their integration points, and the settlement \
                 that it causes is off, by up to 1 % where three elements stand over one another, less on \
                 finer meshes. A row of the mesh, or a curve of its file, along the table makes it exact",
                phase.name,
                counted(cut.len(), "element"),
                middle(0),
                middle(1)
            ));
        }
        level = next;
    }
    warnings
}

/// A number of things, by their name in the singular.
fn counted(n: usize, one: &str) -> String {
    format!("{n} {one}{}", if n == 1 { "" } else { "s" })
}

/// Stiffness that no material has, in words. Diamond, the stiffest, has 1.08e9 kPa; jelly has 1 kPa.
pub(crate) fn implausible_stiffness(group: &Group) -> Option<String> {
    const RANGE: [f64; 2] = [1.0, 1.2e9];
    let elements = if group.is_linear() {
        1
    } else {
        group.kinematics.n_elements()
    };
    let largest = (0..elements).flat_map(|element| {
        let tangents = group.element_tangents(element).chunks_exact(16);
        tangents.flat_map(|d| [0, 5, 10, 15].map(|i| d[i]))
    });
    let largest = largest.fold(0.0, f64::max);
    let about = if largest > RANGE[1] {
        "diamond has 1.08e9: are moduli typed in Pa?"
    } else if largest > 0.0 && largest < RANGE[0] {
        "softer than jelly: are moduli typed in MPa or GPa?"
    } else {
        return None;
    };
    Some(format!(
        "group `{}`, law `{}`: its stiffness is {largest:.3e} kPa, {about} Units are kN, m, kPa",
        group.name, group.law.name
    ))
}

/// A mesh that is larger than any site.
fn vast(problem: &Problem) -> Option<String> {
    let nodes = &problem.mesh.nodes;
    let extent = |c: usize| {
        let ends = nodes
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], node| {
                [low.min(node[c]), high.max(node[c])]
            });
        ends[1] - ends[0]
    };
    let [width, height] = [0, 1].map(extent);
    (width.max(height) > VAST).then(|| {
        format!(
            "the mesh is {width} m wide and {height} m high: lengths are in m. `scale = 0.001` in [mesh] reads a file in \
             millimetres"
        )
    })
}

/// A tolerance that leaves a notable part of the loads out of balance.
fn loose(problem: &Problem) -> Option<String> {
    let tolerance = problem.settings.force_tolerance;
    (tolerance > LOOSE).then(|| {
        format!(
            "`force_tolerance` = {tolerance} in [solver]: up to {:.0} % of the {} may be out of balance",
            100.0 * tolerance,
            problem.settings.tolerance_of.words()
        )
    })
}

/// Unit weights that no ground or material has, and saturated ground that is lighter than dry ground or water.
fn weights(problem: &Problem) -> Vec<String> {
    let water = problem.water.as_ref().map(|water| water.unit_weight);
    let mut warnings = Vec::new();
    for group in &problem.groups {
        let is_ground = group.initial_stress.is_some();
        let of_group = [
            ("unit_weight", Some(group.unit_weight)),
            ("saturated_unit_weight", group.saturated_unit_weight),
        ];
        let strange = of_group.into_iter().filter_map(|(key, value)| {
            let why = strange_weight(value?, is_ground)?;
            Some(format!("group `{}`: `{key}` is {why}", group.name))
        });
        let strange: Vec<String> = strange.collect();
        let wet = group.saturated_unit_weight;
        let lighter = wet.filter(|_| strange.is_empty()).and_then(|wet| {
            let than = if wet < group.unit_weight {
                format!("`unit_weight` {}", group.unit_weight)
            } else {
                let water = water.filter(|&water| group.pore_water && wet < water)?;
                format!("{water} of water")
            };
            Some(format!(
                "group `{}`: `saturated_unit_weight` {wet} is less than {than}: it is the weight of ground and \
                 water together, not that under buoyancy",
                group.name
            ))
        });
        warnings.extend(strange.into_iter().chain(lighter));
    }
    // What takes another law, such as concrete, is ground no longer.
    let mut swapped = HashSet::new();
    for phase in &problem.phases {
        swapped.extend(phase.materials.iter().map(|(group, _)| *group));
        for &(group, value) in &phase.unit_weight {
            let is_ground =
                problem.groups[group].initial_stress.is_some() && !swapped.contains(&group);
            if let Some(why) = strange_weight(value, is_ground) {
                let (phase, group) = (&phase.name, &problem.groups[group].name);
                warnings.push(format!(
                    "phase `{phase}`: `unit_weight` of group `{group}` is {why}"
                ));
            }
        }
    }
    warnings
}

/// Ground at or below the water table that has one unit weight only.
fn dry_weights(problem: &Problem) -> Vec<String> {
    let mesh = &problem.mesh;
    let later = problem.phases.iter().map(|phase| &phase.water_level);
    let later = later.flatten();
    let first = problem.water.iter().map(|water| &water.level);
    let levels: Vec<&Profile> = first.chain(later).collect();
    let mut warnings = Vec::new();
    for (number, group) in problem.groups.iter().enumerate() {
        let is_ground = group.initial_stress.is_some() && group.pore_water;
        if !is_ground || group.unit_weight == 0.0 || group.saturated_unit_weight.is_some() {
            continue;
        }
        let own = mesh.solids.iter().filter(|solid| solid.group == number);
        let nodes: Vec<[f64; 2]> = own
            .flat_map(|solid| solid.nodes().iter().map(|&node| mesh.nodes[node]))
            .collect();
        let close = ROUNDED * mesh.longer_side();
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        for level in &levels {
            for [x, y] in &nodes {
                let height = y - level.at(*x);
                ends = [ends[0].min(height), ends[1].max(height)];
            }
        }
        if ends[0] >= -close {
            continue;
        }
        let place = if ends[1] > close {
            "crosses"
        } else {
            "lies below"
        };
        warnings.push(format!(
            "group `{}` {place} the water table and has no `saturated_unit_weight`: its `unit_weight` {} counts below \
             the table too, as that of ground and water together",
            group.name, group.unit_weight
        ));
    }
    warnings
}

/// The value of a unit weight, with what speaks against it, if anything does.
fn strange_weight(value: f64, is_ground: bool) -> Option<String> {
    const WATER: f64 = 9.81;
    let [low, high] = GROUND;
    let is_heavy = value > HEAVY || is_ground && value > high;
    let is_light = is_ground && value > 0.0 && value < low;
    let usual = if is_ground {
        format!("ground has {low} to {high}")
    } else {
        "concrete has 24, steel 77".to_owned()
    };
    let unit = if is_heavy && value >= 100.0 * low {
        format!(
            ": {value} kg/m³ would be {:.1} kN/m³",
            value * WATER / 1000.0
        )
    } else if is_light && value < 0.001 * high {
        format!(": {value} MN/m³ would be {} kN/m³", 1000.0 * value)
    } else {
        String::new()
    };
    (is_heavy || is_light).then(|| format!("{value} kN/m³, {usual}{unit}"))
}

/// Warnings of input for ground that has no effect.
fn lost(problem: &Problem) -> Vec<String> {
    let mut warnings = Vec::new();
    for phase in &problem.phases {
        for &number in &phase.activate {
            let group = &problem.groups[number];
            let is_solid = group.formulation != Formulation::ZeroThickness;
            if is_solid && !group.is_active && group.initial_stress.is_some() {
                warnings.push(format!(
                    "phase `{}` activates group `{}`, which is free of stress as it appears: its \
                     `initial_stress` is not used",
                    phase.name, group.name
                ));
            }
        }
    }
    for (number, phase) in problem.phases.iter().enumerate() {
        let active = problem.active_after(number + 1);
        let lost = |(group, strain): &&(usize, [f64; 3])| {
            !active[*group] && strain.iter().any(|value| *value != 0.0)
        };
        for (group, _) in phase.strain.iter().filter(lost) {
            warnings.push(format!(
                "phase `{}`: `strain` of group `{}` has no effect, since the group is not active. It counts as given: of a \
                 later value only the difference acts",
                phase.name, problem.groups[*group].name
            ));
        }
    }
    for (number, group) in problem.groups.iter().enumerate() {
        let mut phases = problem.phases.iter();
        if !group.is_active && !phases.any(|phase| phase.activate.contains(&number)) {
            warnings.push(format!(
                "group `{}` is never active: no phase has it in `activate`",
                group.name
            ));
        }
    }
    warnings
}

/// Interfaces next to undrained ground: their tractions are effective with respect to hydrostatic pressure only.
fn beside_undrained(problem: &Problem) -> Vec<String> {
    let mesh = &problem.mesh;
    let is_undrained = |number: usize| {
        (0..problem.phases.len())
            .any(|phase| problem.drainage(number, phase) == Drainage::Undrained)
    };
    let undrained: Vec<bool> = (0..problem.groups.len()).map(is_undrained).collect();
    if !undrained.contains(&true) {
        return Vec::new();
    }
    let beside = beside_joints(mesh);
    let mut found: Vec<(usize, usize)> = Vec::new();
    for joint in &mesh.joints {
        let sides = [joint.minus[2], joint.plus[2]].into_iter();
        for solid in sides.filter_map(|face| beside.get(&face)) {
            let pair = (joint.group, mesh.solids[*solid].group);
            if undrained[pair.1] && !found.contains(&pair) {
                found.push(pair);
            }
        }
    }
    let say = |&(joint, ground): &(usize, usize)| {
        format!(
            "interface `{}` stands beside undrained `{}`: excess pore pressure counts as normal stress in it, so \
             friction there should not depend on the normal stress (c = α c_u, friction angle 0)",
            problem.groups[joint].name, problem.groups[ground].name
        )
    };
    found.iter().map(say).collect()
}

/// For every edge of a thin layer, by its middle node: the number of elements for which it is a face of the layer, and
/// the number of all its elements.
fn edges_in_layer(mesh: &Mesh, group: &Group) -> HashMap<usize, (usize, usize)> {
    let mut edges = HashMap::<usize, (usize, usize)>::new();
    for element in 0..group.kinematics.n_elements() {
        let nodes = group.kinematics.nodes(element);
        let along = group.kinematics.axes(element).along;
        let edges_of_quad = QUAD8.edges;
        let reach = edges_of_quad.iter().map(|&[a, b, _]| {
            let [a, b] = [a, b].map(|i| mesh.nodes[nodes[i]]);
            let step = [b[0] - a[0], b[1] - a[1]];
            (step[0] * along[0] + step[1] * along[1]).abs() / step[0].hypot(step[1])
        });
        let reach: Vec<f64> = reach.collect();
        // Faces are the pair of sides that follow the layer.
        let first_pair = reach[0] + reach[2] > reach[1] + reach[3];
        for (number, [_, _, middle]) in edges_of_quad.iter().enumerate() {
            let is_face = (number % 2 == 0) == first_pair;
            let entry = edges.entry(nodes[*middle]).or_default();
            entry.0 += usize::from(is_face);
            entry.1 += 1;
        }
    }
    edges
}

/// Elements of a thin layer that lie upon one another, or do not agree on what is across it.
fn stacked(mesh: &Mesh, group: &Group) -> Option<String> {
    let edges = edges_in_layer(mesh, group);
    let between = |faces: usize| {
        let found = edges.iter().filter(|(_, (f, n))| *n == 2 && *f == faces);
        let mut nodes: Vec<usize> = found.map(|(&node, _)| node).collect();
        nodes.sort_unstable();
        nodes
    };
    let (stacked, turned) = (between(2), between(1));
    let place = |nodes: &[usize]| {
        let [x, y] = mesh.nodes[nodes[0]];
        format!("the first between them at ({x:.6}, {y:.6})")
    };
    let name = &group.name;
    if !turned.is_empty() {
        return Some(format!(
            "group `{name}`: {} of the thin layer's elements stand across their neighbours, {}: their \
             shorter sides lie in different directions. Say `normal = …` for the group",
            turned.len(),
            place(&turned)
        ));
    }
    (!stacked.is_empty()).then(|| {
        format!(
            "group `{name}`: the thin layer is more than one element thick: {} elements lie on \
             another, {}. Each counts as a layer of its own, of its own thickness",
            stacked.len(),
            place(&stacked)
        )
    })
}

/// A parameter of an interface law that stands for the layer's thickness.
fn means_thickness(parameter: &ParameterDescription) -> bool {
    let says_so = || {
        let doc = parameter.doc.to_lowercase();
        let thickness_of = ["thickness of the interface", "thickness of the layer"];
        parameter.id.to_lowercase().contains("thickness")
            || thickness_of.iter().any(|words| doc.contains(words))
    };
    parameter.unit == "m" && says_so()
}

/// A law whose thickness differs from that of the elements.
fn other_thickness(group: &Group, law: &Material) -> Option<String> {
    let built = &law.built;
    if built.law.n_components() != 2 {
        return None;
    }
    let (key, value, what) = if let Some(zone) = built.law.loaded().shear_zone() {
        ("thickness", zone.thickness, "of its shear zone")
    } else {
        let description = built.law.description();
        let declared = description.parameters.iter().zip(&built.parameters);
        let (parameter, used) = declared.into_iter().find(|(p, _)| means_thickness(p))?;
        let doc = parameter.doc.trim_end_matches('.');
        (parameter.id.as_str(), used.value, doc)
    };
    let elements = 0..group.kinematics.n_elements();
    let first = |element| group.kinematics.points_of(element).start;
    let thickness = elements.filter_map(|element| group.thickness(first(element)));
    let off = |t: &f64| (value / t - 1.0).abs();
    let worst = thickness.max_by(|a, b| off(a).total_cmp(&off(b)))?;
    (off(&worst) > SAME_THICKNESS).then(|| {
        format!(
            "group `{}`: law `{}` has {key} = {value} m ({what}), the layer of elements is {worst:.6} m thick",
            group.name, law.name,
        )
    })
}

/// Ends of an interface without thickness inside the mesh, at the corner of a body: the two sides
/// stay joined there, and the body hangs on that node.
fn hung(mesh: &Mesh, groups: &[Group], number: usize) -> Vec<String> {
    // Groups with one law are one body.
    let law = |group: usize| groups[group].law.name.as_str();
    let mut warnings = Vec::new();
    let own = || mesh.joints.iter().filter(|joint| joint.group == number);
    let ends = own().flat_map(|joint| (0..2).map(move |end| (joint.minus[end], joint.plus[end])));
    let tips = ends.filter(|(minus, plus)| minus == plus);
    let mut around: HashMap<usize, Vec<&Solid>> =
        tips.map(|(node, _)| (node, Vec::new())).collect();
    for solid in &mesh.solids {
        for corner in solid.corners() {
            if let Some(solids) = around.get_mut(corner) {
                solids.push(solid);
            }
        }
    }
    for joint in own() {
        for end in (0..2).filter(|&end| joint.minus[end] == joint.plus[end]) {
            let node = joint.minus[end];
            let mut turns: HashMap<&str, f64> = HashMap::new();
            let mut beside: Vec<usize> = Vec::new();
            for solid in around.get(&node).into_iter().flatten() {
                *turns.entry(law(solid.group)).or_default() += angle(mesh, solid, node);
                let middles = [joint.minus[2], joint.plus[2]];
                if middles.iter().any(|middle| solid.nodes().contains(middle)) {
                    beside.push(solid.group);
                }
            }
            // On the outline an end is joined because the case says so.
            let is_inside = turns.values().sum::<f64>() > std::f64::consts::TAU - 1e-6;
            let corner = beside.iter().find(|group| turns[law(**group)] < CORNER);
            if let Some(&corner) = corner.filter(|_| is_inside && turns.len() > 1) {
                let [x, y] = mesh.nodes[node];
                warnings.push(format!(
                    "group `{}` ends inside the mesh at ({x:.6}, {y:.6}), at a corner of group \
                     `{}`: both sides stay joined at that node, which carries what the interface \
                     would not (tension, and more than its friction)",
                    groups[number].name, groups[corner].name
                ));
            }
        }
    }
    warnings
}

/// Angle of an element at one of its corners, radians.
fn angle(mesh: &Mesh, solid: &Solid, node: usize) -> f64 {
    let corners = solid.corners();
    let n = corners.len();
    let own = corners.iter().position(|&n| n == node).unwrap_or_default();
    let at = |i: usize| mesh.nodes[corners[i % n]];
    let side = |to: [f64; 2]| [to[0] - at(own)[0], to[1] - at(own)[1]];
    let (a, b) = (side(at(own + 1)), side(at(own + n - 1)));
    let sine = a[0] * b[1] - a[1] * b[0];
    sine.atan2(a[0] * b[0] + a[1] * b[1]).abs()
}

/// Prescribed displacements far beyond the theory: millimetres may be meant.
fn far(problem: &Problem) -> Vec<String> {
    let side = problem.mesh.longer_side();
    let mut warnings = Vec::new();
    for phase in &problem.phases {
        for input in &phase.displacement {
            let largest = [input.x, input.y].into_iter().flatten();
            let largest = largest.fold(0.0, |m: f64, u| m.max(u.abs()));
            if largest > LARGE * side {
                warnings.push(format!(
                    "phase `{}` moves line `{}` by {largest:.4e} m, the model is {side:.4} m long: beyond \
                     the theory of small displacements; are millimetres meant?",
                    phase.name,
                    input.line,
                ));
            }
        }
    }
    warnings
}
