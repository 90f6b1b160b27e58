//! Input of OpenGeoSys: a project, the mesh, and meshes of the nodes of every boundary condition.

use crate::model::{Group, Held, Load, Model};
use crate::vtu::{self, Data};
use std::fmt::Write;

/// A name in the spelling of MFront: `young_modulus` becomes `YoungModulus`.
pub(crate) fn camel(id: &str) -> String {
    let part = |part: &str| {
        let mut letters = part.chars();
        let first = letters.next().map(|first| first.to_ascii_uppercase());
        first.into_iter().chain(letters).collect::<String>()
    };
    id.split('_').map(part).collect()
}

/// Prefix of the results.
pub(crate) const RESULTS: &str = "result";

pub(crate) fn files(model: &Model) -> Vec<(String, String)> {
    let cells: Vec<(u8, &[usize])> = model
        .elements
        .iter()
        .map(|element| (Model::vtk(element), element.nodes.as_slice()))
        .collect();
    let groups: Vec<usize> = model.elements.iter().map(|element| element.group).collect();
    let bulk = vtu::grid(
        &model.nodes,
        &cells,
        &[],
        &[Data::counts("MaterialIDs", "Int32", &groups)],
    );
    let mut files = vec![
        ("bulk.vtu".to_owned(), bulk),
        ("model.prj".to_owned(), project(model)),
    ];
    for (number, held) in model.held.iter().enumerate() {
        files.push((
            format!("{}.vtu", held_mesh(number, held)),
            points(model, &held.nodes, &[]),
        ));
    }
    for (number, load) in model.loads.iter().enumerate() {
        let fields: Vec<Data> = (0..2)
            .map(|c| {
                let values: Vec<f64> = load.forces.iter().map(|force| force[c]).collect();
                Data::reals(&format!("force_{c}"), &values)
            })
            .collect();
        files.push((
            format!("load_{number}.vtu"),
            points(model, &load.nodes, &fields),
        ));
    }
    files
}

/// A mesh of some nodes alone.
fn points(model: &Model, nodes: &[usize], fields: &[Data]) -> String {
    let places: Vec<[f64; 2]> = nodes.iter().map(|&node| model.nodes[node]).collect();
    let own: Vec<usize> = (0..nodes.len()).collect();
    let cells: Vec<(u8, &[usize])> = own.chunks(1).map(|one| (vtu::VERTEX, one)).collect();
    let mut data = vec![Data::counts("bulk_node_ids", "UInt64", nodes)];
    data.extend_from_slice(fields);
    vtu::grid(&places, &cells, &data, &[])
}

fn held_mesh(number: usize, held: &Held) -> String {
    let plain = held
        .line
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' });
    format!("held_{number}_{}", plain.collect::<String>())
}

fn project(model: &Model) -> String {
    let axial = if model.axisymmetric {
        " axially_symmetric=\"true\""
    } else {
        ""
    };
    let mut meshes = vec!["bulk".to_owned()];
    meshes.extend(
        model
            .held
            .iter()
            .enumerate()
            .map(|(n, held)| held_mesh(n, held)),
    );
    meshes.extend((0..model.loads.len()).map(|n| format!("load_{n}")));
    let line = |name: String| format!("    <mesh{axial}>{name}.vtu</mesh>\n");
    let meshes = meshes.into_iter().map(line).collect::<Vec<_>>().concat();
    let order = if model.groups.first().is_some_and(|group| group.reduced) {
        2
    } else {
        3
    };
    let ids: Vec<String> = (0..model.groups.len()).map(|n| n.to_string()).collect();
    let relations: String = model.groups.iter().enumerate().map(relation).collect();
    let steps = model.steps.len();
    let end = model.steps.last().map_or(1.0, |step| step.time);
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <!-- Units: kN, m, kPa. Nodal forces are of the whole turn, or kN/m. Stress: 11 22 33 12, tension positive. -->\n\
         <OpenGeoSysProject>\n  <meshes>\n{meshes}  </meshes>\n  <processes><process>\n    \
         <name>SD</name><type>SMALL_DEFORMATION</type><integration_order>{order}</integration_order>\n\
         {relations}    <specific_body_force>0 0</specific_body_force>\n    \
         <initial_stress>initial_stress</initial_stress>\n    \
         <process_variables><process_variable>displacement</process_variable></process_variables>\n    \
         <secondary_variables/>\n  </process></processes>\n  \
         <media><medium id=\"{ids}\"><phases><phase><type>Solid</type><properties>\n    \
         <property><name>density</name><type>Constant</type><value>1</value></property>\n  \
         </properties></phase></phases></medium></media>\n  <time_loop>\n    \
         <processes><process ref=\"SD\">\n      <nonlinear_solver>newton</nonlinear_solver>\n      \
         <convergence_criterion><type>DeltaX</type><norm_type>NORM2</norm_type><reltol>1e-10</reltol>\
         <abstol>1e-15</abstol></convergence_criterion>\n      \
         <time_discretization><type>BackwardEuler</type></time_discretization>\n      \
         <time_stepping><type>FixedTimeStepping</type><t_initial>0</t_initial><t_end>{end:?}</t_end>\n        \
         <timesteps>{times}</timesteps></time_stepping>\n    </process></processes>\n    \
         <output><type>VTK</type><prefix>{RESULTS}</prefix><suffix>_{{:timestep}}</suffix>\
         <data_mode>Binary</data_mode><compress_output>false</compress_output>\n      \
         <timesteps><pair><repeat>{steps}</repeat><each_steps>1</each_steps></pair></timesteps>\n      \
         <variables><variable>displacement</variable><variable>NodalForces</variable></variables></output>\n  \
         </time_loop>\n  <parameters>\n{parameters}  </parameters>\n  <curves>\n{curves}  </curves>\n  \
         <process_variables><process_variable>\n    <name>displacement</name><components>2</components>\
         <order>2</order><initial_condition>at_rest</initial_condition>\n    \
         <boundary_conditions>\n{held}    </boundary_conditions>\n    <source_terms>\n{loads}    </source_terms>\n  \
         </process_variable></process_variables>\n  <nonlinear_solvers><nonlinear_solver><name>newton</name>\
         <type>Newton</type><max_iter>100</max_iter><linear_solver>direct</linear_solver></nonlinear_solver>\
         </nonlinear_solvers>\n  <linear_solvers><linear_solver><name>direct</name>\
         <eigen><solver_type>SparseLU</solver_type></eigen></linear_solver></linear_solvers>\n\
         </OpenGeoSysProject>\n",
        ids = ids.join(","),
        times = times(model),
        parameters = parameters(model),
        curves = curves(model),
        held = conditions(model),
        loads = source_terms(&model.loads),
    )
}

fn relation((number, group): (usize, &Group)) -> String {
    let property = |(id, _): (&str, f64)| {
        let name = camel(id);
        format!("\n        <material_property name=\"{name}\" parameter=\"{number}_{id}\"/>")
    };
    let properties = required(group).map(property).collect::<Vec<_>>().concat();
    format!(
        "    <constitutive_relation id=\"{number}\"><type>MFront</type><behaviour>{}</behaviour>\n      \
         <library>{}</library>\n      <material_properties>{properties}\n      </material_properties>\n    \
         </constitutive_relation>\n",
        camel(&group.law),
        escaped(&group.library.display().to_string())
    )
}

/// Material properties: the parameters that cannot be left out.
fn required(group: &Group) -> impl Iterator<Item = (&str, f64)> {
    let required = group.parameters.iter().filter(|p| !p.may_be_left_out);
    required.filter_map(|p| Some((p.id.as_str(), p.value?)))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// Lengths of the steps.
fn times(model: &Model) -> String {
    let mut before = 0.0;
    let pair = |step: &crate::model::Step| {
        let length = step.time - before;
        before = step.time;
        format!("<pair><repeat>1</repeat><delta_t>{length:?}</delta_t></pair>")
    };
    model.steps.iter().map(pair).collect()
}

fn parameters(model: &Model) -> String {
    let constant = |name: &str, values: &[f64]| {
        let (tag, texts) = (
            if values.len() == 1 { "value" } else { "values" },
            reals(values),
        );
        format!(
            "    <parameter><name>{name}</name><type>Constant</type><{tag}>{texts}</{tag}></parameter>\n"
        )
    };
    let mut text = constant("at_rest", &[0.0, 0.0]) + &constant("one", &[1.0]);
    for (number, group) in model.groups.iter().enumerate() {
        for (id, value) in required(group) {
            text += &constant(&format!("{number}_{id}"), &[value]);
        }
    }
    text += "    <parameter><name>initial_stress</name><type>Group</type>\
             <group_id_property>MaterialIDs</group_id_property>\n";
    for (number, group) in model.groups.iter().enumerate() {
        let values = reals(&group.initial_stress);
        let _ = writeln!(
            text,
            "      <index_values><index>{number}</index><values>{values}</values></index_values>"
        );
    }
    text += "    </parameter>\n";
    let mut scaled = |name: &str, of: &str| {
        let _ = writeln!(
            text,
            "    <parameter><name>{name}</name><type>CurveScaled</type><curve>{}</curve>\
             <parameter>{of}</parameter></parameter>",
            name.trim_end_matches("_x").trim_end_matches("_y")
        );
    };
    for (number, held) in model.held.iter().enumerate() {
        scaled(&held_mesh(number, held), "one");
    }
    for number in 0..model.loads.len() {
        for c in ["x", "y"] {
            scaled(
                &format!("load_{number}_{c}"),
                &format!("force_{number}_{c}"),
            );
        }
    }
    for number in 0..model.loads.len() {
        for (c, axis) in ["x", "y"].iter().enumerate() {
            let _ = writeln!(
                text,
                "    <parameter><name>force_{number}_{axis}</name><type>MeshNode</type>\
                 <mesh>load_{number}</mesh><field_name>force_{c}</field_name></parameter>"
            );
        }
    }
    text
}

fn reals(values: &[f64]) -> String {
    let texts: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
    texts.join(" ")
}

/// Courses over the time, from its start.
fn curves(model: &Model) -> String {
    let times: Vec<f64> = std::iter::once(0.0)
        .chain(model.steps.iter().map(|s| s.time))
        .collect();
    let curve = |name: &str, values: &[f64]| {
        format!(
            "    <curve><name>{name}</name><coords>{}</coords><values>{}</values></curve>\n",
            reals(&times),
            reals(values)
        )
    };
    let mut text = String::new();
    for (number, held) in model.held.iter().enumerate() {
        let values: Vec<f64> = std::iter::once(0.0)
            .chain(held.values.iter().copied())
            .collect();
        text += &curve(&held_mesh(number, held), &values);
    }
    for (number, load) in model.loads.iter().enumerate() {
        text += &curve(&format!("load_{number}"), &load.factors);
    }
    text
}

fn conditions(model: &Model) -> String {
    let condition = |(number, held): (usize, &Held)| {
        let name = held_mesh(number, held);
        format!(
            "      <boundary_condition><mesh>{name}</mesh><type>Dirichlet</type>\
             <component>{}</component><parameter>{name}</parameter></boundary_condition>\n",
            held.component
        )
    };
    model.held.iter().enumerate().map(condition).collect()
}

fn source_terms(loads: &[Load]) -> String {
    let mut text = String::new();
    for number in 0..loads.len() {
        for (c, axis) in ["x", "y"].iter().enumerate() {
            let _ = writeln!(
                text,
                "      <source_term><mesh>load_{number}</mesh><type>Nodal</type>\
                 <component>{c}</component><parameter>load_{number}_{axis}</parameter></source_term>"
            );
        }
    }
    text
}
