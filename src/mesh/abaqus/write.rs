//! Groups as a mesh in Gmsh's format 4.1.

use super::groups::Group;
use super::model::Model;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Return the mesh. Each group is a physical one on an entity of its own with the same number, so that an element of several
/// groups is written once for each.
pub fn mesh(model: &Model, groups: &[Group]) -> String {
    let mut text = String::from("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n");
    let _ = writeln!(text, "$PhysicalNames\n{}", groups.len());
    for (tag, Group { dimension, name, .. }) in (1..).zip(groups) {
        let _ = writeln!(text, "{dimension} {tag} \"{name}\"");
    }
    text.push_str("$EndPhysicalNames\n");
    write_entities(groups, &mut text);
    write_nodes(model, &mut text);
    write_elements(groups, &mut text);
    text
}

fn write_entities(groups: &[Group], text: &mut String) {
    let of = |wanted: usize| (1..).zip(groups).filter(move |(_, group)| group.dimension == wanted).map(|(tag, _)| tag);
    let counts: Vec<String> = (0..=3).map(|dimension| of(dimension).count().to_string()).collect();
    let _ = writeln!(text, "$Entities\n{}", counts.join(" "));
    for dimension in 0..=3 {
        for tag in of(dimension) {
            // The reader needs no box around an entity, and no entities that bound it.
            let _ = match dimension {
                0 => writeln!(text, "{tag} 0 0 0 1 {tag}"),
                _ => writeln!(text, "{tag} 0 0 0 0 0 0 1 {tag} 0"),
            };
        }
    }
    text.push_str("$EndEntities\n");
}

fn write_nodes(model: &Model, text: &mut String) {
    let [least, largest] = [model.nodes.keys().next(), model.nodes.keys().next_back()].map(|tag| *tag.unwrap_or(&0));
    let count = model.nodes.len();
    let _ = writeln!(text, "$Nodes\n1 {count} {least} {largest}\n3 1 0 {count}");
    for tag in model.nodes.keys() {
        let _ = writeln!(text, "{tag}");
    }
    for node in model.nodes.values() {
        let [x, y, z] = node.x;
        let _ = writeln!(text, "{x:?} {y:?} {z:?}");
    }
    text.push_str("$EndNodes\n");
}

/// Elements of one type of Gmsh: the number of each, and its nodes.
type Block<'a> = Vec<(u64, &'a [u64])>;

fn write_elements(groups: &[Group], text: &mut String) {
    let mut blocks: Vec<(usize, usize, u8, Block)> = Vec::new();
    for (tag, group) in (1..).zip(groups) {
        let mut of_type: BTreeMap<u8, Block> = BTreeMap::new();
        for (number, (kind, nodes)) in &group.elements {
            of_type.entry(kind.number()).or_default().push((*number, nodes));
        }
        for node in &group.points {
            of_type.entry(15).or_default().push((*node, std::slice::from_ref(node)));
        }
        blocks.extend(of_type.into_iter().map(|(number, block)| (group.dimension, tag, number, block)));
    }
    let numbers = || blocks.iter().flat_map(|(.., block)| block).map(|(number, _)| *number);
    let (count, [least, largest]) =
        (numbers().count(), [numbers().min(), numbers().max()].map(Option::unwrap_or_default));
    let _ = writeln!(text, "$Elements\n{} {count} {least} {largest}", blocks.len());
    for (dimension, tag, number, block) in blocks {
        let _ = writeln!(text, "{dimension} {tag} {number} {}", block.len());
        for (element, nodes) in block {
            let _ = write!(text, "{element}");
            for node in nodes {
                let _ = write!(text, " {node}");
            }
            text.push('\n');
        }
    }
    text.push_str("$EndElements\n");
}
