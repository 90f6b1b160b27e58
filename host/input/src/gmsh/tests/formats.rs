//! Older versions of the format, sections that are not always there, and files that are no mesh.

use super::*;

fn text(version: f64) -> String {
    String::from_utf8(model().write(version, Bytes::Text)).unwrap()
}

/// Version 2.0 names a physical group by its number alone, whatever its dimension.
#[test]
fn names_may_have_no_dimension() {
    let mut model = model();
    let numbers = [6, 1, 2, 3, 4, 5];
    for (name, number) in model.names.iter_mut().zip(numbers) {
        name.1 = number;
    }
    let own = [vec![6], vec![1], vec![2], vec![3], vec![], vec![4], vec![5]];
    for (entity, groups) in model.entities.iter_mut().zip(own) {
        entity.2 = groups;
    }
    let expected = read(&model.write(2.2, Bytes::Text), &all()).unwrap();
    let text = String::from_utf8(model.write(2.0, Bytes::Text)).unwrap();
    assert!(text.starts_with("$MeshFormat\n2 0 8\n"), "{text}");
    // With dimensions, as 2.1 writes them, and without.
    let mut bare = text.clone();
    for (dimension, number, name) in &model.names {
        let line = format!("\n{dimension} {number} \"{name}\"\n");
        assert!(bare.contains(&line));
        bare = bare.replace(&line, &format!("\n{number} \"{name}\"\n"));
    }
    for text in [text, bare] {
        assert_eq!(read(text.as_bytes(), &all()).unwrap(), expected);
    }
}

/// `Mesh.SaveParametric` in format 2.2: the entity of each node, and its parameters on a curve or surface.
#[test]
fn nodes_may_have_parameters() {
    let expected = read(&model().write(2.2, Bytes::Text), &all()).unwrap();
    for bytes in [Bytes::Text, Bytes::Little, Bytes::Big] {
        let whole = model().write(2.2, bytes);
        let at = |what: &str| {
            let what = what.as_bytes();
            whole.windows(what.len()).position(|w| w == what).unwrap()
        };
        let mut writer = Writer(whole[..at("$Nodes")].to_vec(), bytes);
        let nodes = model().nodes;
        writer.text(&format!("$ParametricNodes\n{}\n", nodes.len()));
        for (k, (number, place)) in nodes.iter().enumerate() {
            let dimension = k % 4;
            writer.int(*number as i64);
            writer.reals(place);
            writer.int(dimension as i64);
            writer.int(7);
            writer.reals(&[0.25, -3.0][..[0, 1, 2, 0][dimension]]);
            writer.new_line();
        }
        writer.end("ParametricNodes");
        writer.0.extend(&whole[at("$Elements")..]);
        assert_eq!(read(&writer.0, &all()).unwrap(), expected, "{bytes:?}");
        let twice = [&writer.0, &whole[at("$Nodes")..]].concat();
        let why = read(&twice, &all()).unwrap_err();
        assert!(why.contains("section `$Nodes` comes twice"), "{why}");
    }
}

#[test]
fn remarks_may_come_first() {
    let expected = read(text(4.1).as_bytes(), &all()).unwrap();
    let comments = "$Comments\nmade by $hand, 4.1\n$EndComments\n";
    for before in [
        comments.to_owned(),
        format!("\n# a line\n{comments}{comments}"),
    ] {
        let found = read((before + &text(4.1)).as_bytes(), &all());
        assert_eq!(found.unwrap(), expected);
    }
    let why = read(("$Comments\n".to_owned() + &text(4.1)).as_bytes(), &all()).unwrap_err();
    assert!(why.contains("has no `$EndComments`"), "{why}");
}

#[test]
fn what_is_no_mesh_of_today_is_called_what_it_is() {
    let first = "$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n0\n$ENDELM\n";
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
    for (file, says) in [
        (
            first,
            "version 1 of its format, `$NOD`, which is not read: `gmsh old.msh -save -format msh41 -o new.msh`",
        ),
        (pointer, "line 1: the file is a pointer of Git LFS"),
        ("$Nodes\n$EndNodes\n", "begins with `$MeshFormat`"),
        ("", "begins with `$MeshFormat`"),
    ] {
        let why = read(file.as_bytes(), &all()).unwrap_err();
        assert!(why.contains(says), "{why}");
    }
}

/// A name of a curve and of a point is that of the curve.
#[test]
fn a_curve_goes_before_a_point_of_its_name() {
    let mut model = model();
    model.names[0].2 = "bottom";
    for (version, bytes) in FORMATS {
        let bytes = model.write(version, bytes);
        let wanted = wanting(&["left", "right"], &["bottom", "between"]);
        let (mesh, notes) = read(&bytes, &wanted).unwrap();
        assert_eq!(mesh.lines["bottom"].edges, [(0, 0), (1, 0)]);
        assert!(
            notes.contains(
                &"physical curves whose names are also those of points: the curves are taken: `bottom`"
                    .to_owned()
            ),
            "{notes:?}"
        );
    }
    let case = CASE.replace("{ line = \"corner\", fixed = [\"x\"] }", "");
    let place = built_of("both", &case, &model.write(4.1, Bytes::Text)).unwrap();
    assert!(!place.mesh.lines["bottom"].edges.is_empty());
}

/// Format 2.2 has no groups where `Mesh.SaveAll` is set: the names are there, and no element has them.
#[test]
fn a_surface_without_elements_is_told() {
    let mut model = model();
    for entity in &mut model.entities {
        entity.2.clear();
    }
    let why = built_of("empty", CASE, &model.write(2.2, Bytes::Text)).unwrap_err();
    for says in [
        "part.msh has no element in the physical surface `left`",
        "`Mesh.SaveAll = 0`",
    ] {
        assert!(why.contains(says), "{why}");
    }
}
