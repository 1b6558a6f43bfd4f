//! Tests on files that are not valid meshes.

use super::*;

fn message(bytes: &[u8]) -> String {
    parse::<2>(bytes).map(|_| ()).expect_err("this mesh is bad").to_string()
}

/// No byte makes the reader panic or allocate without end. Whatever it accepts satisfies the invariants of a mesh.
#[test]
fn damaged_files_are_meshes_or_errors() {
    for form in [&[][..], &["-bin"], &["-order", "2", "-bin"]] {
        let good = gmsh(SQUARE, &[&["-2", "-setnumber", "n", "1"], form].concat());
        for end in 0..good.len() {
            let read = parse::<2>(&good[..end]);
            // Only the end of line after the last section may be missing.
            assert!(read.is_err() || end + 1 == good.len(), "{end} of {}", good.len());
        }
        for position in 0..good.len() {
            for value in [0, 0xff, b'\n', b'9', b'-', good[position] ^ 0x80, good[position] ^ 1] {
                let mut bad = good.clone();
                bad[position] = value;
                let Ok(mesh) = parse::<2>(&bad) else { continue };
                assert!(mesh.points.iter().flatten().all(|coordinate| coordinate.is_finite()));
                for group in mesh.groups.iter() {
                    assert!(!group.is_empty() && extent(&mesh, group) > 0.0);
                    assert!(group.connectivity.iter().all(|point| (*point as usize) < mesh.points.len()));
                }
            }
        }
    }
}

#[test]
fn bad_meshes_are_refused_by_name_and_line() {
    let square = |more: &str, arguments: &[&str]| gmsh(&format!("{SQUARE}{more}"), arguments);
    for (bytes, expected) in [
        (square("", &["-2", "-format", "msh40"]), "a.msh:2: this is version 4 of the mesh format"),
        (square("", &["-2", "-order", "3"]), "elements of 4 nodes (Gmsh's type 26)"),
        (square("Physical Curve(77) = {3};", &["-2"]), "physical curve 77 has no name"),
        (square("Physical Curve(\"gone\") = {99};", &["-2"]), "the physical curve `gone` has no elements"),
        (square("Physical Curve(\"steel\") = {7};", &["-2"]), "two physical groups are named `steel`"),
        (square("Physical Volume(\"rock\") = {1};", &["-2"]), "group `rock` is made of volumes"),
        (gmsh("Point(1) = {0, 0, 0};\n", &["-2"]), "the mesh has no physical groups"),
        (gmsh("Point(1) = {0, 0, 0}; Physical Point(\"pin\") = {1};\n", &["-2"]), "no physical group holds surfaces"),
        (gmsh(CUBE, &["-3"]), "is made of volumes, but the scene has dimension = 2"),
        (gmsh(&SQUARE.replace("{1, 1, 0}", "{1, 1, 1e-3}"), &["-2"]), "has z = "),
        (gmsh(&SQUARE.replace("{1, 1, 0}", "{1, 1, 1e-3}"), &["-2", "-bin"]), "in $Nodes, at byte "),
        (square("", &["-2", "-part", "2"]), "the mesh is partitioned"),
        (b"solid cube".to_vec(), "a.msh:1: this is not a mesh file of Gmsh"),
        (Vec::new(), "this is not a mesh file of Gmsh"),
    ] {
        let message = message(&bytes);
        assert!(message.contains(expected), "expected {expected}\n{message}");
        assert!(message.contains("help: "), "{message}");
    }
}

const SMALL: &str =
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n0 1 \"pin\"\n2 1 \"body\"\n$EndPhysicalNames
$Entities\n1 0 1 0\n1 0 0 0 1 1 \n1 0 0 0 1 1 0 1 1 0 \n$EndEntities
$Nodes\n1 3 1 3\n2 1 0 3\n1\n2\n3\n0 0 0\n1 0 0\n0 1 0\n$EndNodes
$Elements\n2 2 1 2\n0 1 15 1\n1 1 \n2 1 2 1\n2 1 2 3 \n$EndElements\n";

#[test]
fn small_mistakes_in_text_are_refused_at_their_line() {
    assert_eq!(parse::<2>(SMALL.as_bytes()).unwrap().points.len(), 3);
    for (from, to, expected) in [
        ("2 1 2 3 \n$EndE", "2 1 2 4 \n$EndE", "a.msh:29: element 2 of group `body` uses node 4, which does not exist"),
        ("2 1 2 3 \n$EndE", "2 1 2 2 \n$EndE", "a.msh:29: element 2 of group `body` has zero area"),
        ("2 1 2 3 \n$EndE", "2 1 2\n$EndE", "a.msh:29: this line has too few entries"),
        ("2 1 2 3 \n$EndE", "2 1 2 3 4\n$EndE", "a.msh:29: this line has more entries"),
        ("2 1 2 3 \n$EndE", "2 1 x 3\n$EndE", "a.msh:29: `x` should be a whole number"),
        ("\n1 0 0\n0 1 0\n", "\n1 0 0\n2 1e-13 0\n", "has zero area"),
        ("\n1 0 0\n0 1 0\n", "\n1 0 inf\n0 1 0\n", "a.msh:21: a coordinate is inf"),
        ("\n1 0 0\n0 1 0\n", "\n1 0 0\n0 1 1e-9\n", "a.msh:22: a node of group `body` has z = 0.000000001"),
        ("2 1 2 1\n", "2 7 2 1\n", "a.msh:28: elements of surface 7, which $Entities does not list"),
        ("2 1 2 1\n", "2 1 2 987654321\n", "a.msh:28: the file is too short for a count of 987654321"),
        ("2 2 1 2\n", "2 3 1 2\n", "a.msh:25: $Elements announces 3 elements and holds 2"),
        ("$EndElements\n", "", "`$EndElements` should stand here"),
        ("$EndNodes\n", "$EndNodes\n$Nodes\n", "the section $Nodes stands twice"),
        ("\"body\"", "\"\"", "a.msh:7: physical surface 1 has an empty name"),
        ("2 1 \"body\"", "2 1 body", "a.msh:7: dimension, tag and \"name\""),
        ("0 1 \"pin\"", "2 1 \"pin\"", "two names for physical surface 1"),
    ] {
        let bad = SMALL.replacen(from, to, 1);
        assert_ne!(bad, SMALL, "{from}");
        let message = message(bad.as_bytes());
        assert!(message.contains(expected), "expected {expected}\n{message}");
    }
}

#[test]
fn sections_of_no_use_are_skipped() {
    let more = "$Comments\nmade by hand $End\n$EndComments\n";
    let bytes = [more, SMALL, "$Periodic\n0\n$EndPeriodic\n", more, more].concat();
    assert_eq!(parse::<2>(bytes.as_bytes()).unwrap().points, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
}
