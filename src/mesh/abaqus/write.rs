//! Groups as a mesh in Gmsh's format 4.1.

use super::groups::Group;
use super::model::Model;
use crate::mesh::contents::{Contents, Element};

/// Gmsh's number of the type of points.
const POINT: i32 = 15;

/// Return the bytes of the mesh. Each group is a physical one on an entity of its own, so that an element of several groups is written
/// once for each.
pub fn mesh(model: &Model, groups: &[Group]) -> Vec<u8> {
    let mut contents =
        Contents { nodes: model.nodes.iter().map(|(tag, node)| (*tag, node.x)).collect(), ..Contents::default() };
    for (tag, Group { dimension, name, elements, points }) in (1..).zip(groups) {
        contents.names.push(format!("{dimension} {tag} \"{name}\""));
        let element =
            |number: u64, kind: i32, nodes: Vec<u64>| Element { number, kind, entity: 0, groups: vec![tag], nodes };
        let cells =
            elements.iter().map(|(number, (kind, nodes))| element(*number, kind.number().into(), nodes.clone()));
        contents.elements.extend(cells.chain(points.iter().map(|node| element(*node, POINT, vec![*node]))));
    }
    contents.written()
}
