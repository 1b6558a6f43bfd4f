//! The sections of Gmsh's format 2.2, and a writer of that format.
//!
//! Each element has its physical group, and the number of an entity of the geometry besides. Other programs write one
//! number for all entities, so that groups are those of the physical tags alone. Entities are groups in a dimension
//! without physical groups. An element of several groups stands in the file once for each of them.

use super::builder::{MeshBuilder, kind_of};
use super::scan::{ScanError, Scanner};
use super::simplex::{ElementType, LINE, POINT, TETRAHEDRON, TRIANGLE};
use super::{Group, Mesh};
use crate::error::Result;
use std::collections::HashSet;
use std::fmt::Write;

/// Read the line with the number of entries of a section.
fn count(scan: &mut Scanner) -> Result<usize> {
    scan.line()?.parse().map_err(|_| scan.damaged("the number of entries should stand here"))
}

/// Read the number of a node or an element.
fn number(scan: &mut Scanner) -> Result<u64> {
    if !scan.binary {
        return scan.size();
    }
    let number = scan.int()?;
    let is_none = |_| scan.damaged(format!("{number} is no number of a node or an element"));
    u64::try_from(number).map_err(is_none)
}

/// Read `$Nodes`.
pub fn read_nodes<const D: usize>(scan: &mut Scanner, mesh: &mut MeshBuilder<D>) -> Result<()> {
    for _ in 0..count(scan)? {
        scan.begin(28)?;
        let tag = number(scan)?;
        let x = [scan.real()?, scan.real()?, scan.real()?];
        scan.end()?;
        scan.place(mesh.node(tag, x))?;
    }
    scan.place(mesh.number_nodes())
}

/// An element of the file.
struct Element {
    number: u64,
    kind: ElementType,
    /// Its physical tag, 0 without a group.
    physical: i32,
    /// Number of its entity.
    entity: i32,
    /// Its nodes, by their numbers.
    nodes: Vec<u64>,
}

/// Read `$Elements`. In binary files several elements of a type follow one head.
pub fn read_elements<const D: usize>(scan: &mut Scanner, mesh: &mut MeshBuilder<D>) -> Result<()> {
    let mut left = count(scan)?;
    let (mut known, mut without) = (HashSet::new(), Vec::new());
    while left > 0 {
        scan.begin(12)?;
        let (mut followers, mut head) = (1, [0; 2]);
        if scan.binary {
            head[0] = scan.int()?;
            followers = usize::try_from(scan.int()?).unwrap_or(0);
            head[1] = scan.int()?;
        }
        if !(1..=left).contains(&followers) {
            return Err(scan.damaged(format!("{followers} elements follow here, and {left} are left")));
        }
        for _ in 0..followers {
            let element = read_element(scan, head)?;
            match element.physical {
                0 => without.push(element),
                physical => {
                    let group = mesh.group(element.kind.shape.dimension, physical);
                    let added = group.and_then(|group| add(mesh, &element, group, &mut known));
                    scan.place(added)?;
                }
            }
        }
        left -= followers;
    }
    let by_entity: Vec<bool> = (0..4).map(|dimension| mesh.groups_by_entity(dimension)).collect();
    for element in without.iter().filter(|element| by_entity[element.kind.shape.dimension]) {
        let group = mesh.group(element.kind.shape.dimension, element.entity);
        let added = group.and_then(|group| add(mesh, element, group, &mut known));
        scan.place(added)?;
    }
    Ok(())
}

/// Read an element, whose type and number of tags are in the `head` of a binary file. The first tag is that of the
/// physical group, the second one is that of the entity. Partitions follow.
fn read_element(scan: &mut Scanner, [kind, tags]: [i32; 2]) -> Result<Element> {
    let mut head = [kind, tags];
    let mut element = 0;
    if !scan.binary {
        element = number(scan)?;
        head = [scan.int()?, scan.int()?];
    }
    let kind = scan.place(kind_of(head[0]))?;
    let tags = usize::try_from(head[1]).unwrap_or(0);
    if scan.binary {
        scan.begin(4 * (1 + kind.nodes) + 4 * tags.min(1 << 16))?;
        element = number(scan)?;
    }
    let mut own = [0; 2];
    for tag in 0..tags {
        let value = scan.int()?;
        own.iter_mut().skip(tag).take(1).for_each(|own| *own = value);
    }
    let nodes = (0..kind.nodes).map(|_| number(scan)).collect::<Result<_>>()?;
    scan.end()?;
    Ok(Element { number: element, kind, physical: own[0], entity: own[1], nodes })
}

/// Add an element to a group, unless the group has one on these nodes: a set is a set.
fn add<const D: usize>(
    mesh: &mut MeshBuilder<D>,
    element: &Element,
    group: usize,
    known: &mut HashSet<(usize, Vec<u64>)>,
) -> std::result::Result<(), ScanError> {
    let Element { number, kind, nodes, .. } = element;
    let mut key = nodes.clone();
    key.sort_unstable();
    if !known.insert((group, key)) {
        return Ok(());
    }
    mesh.check_type(*kind, &[group])?;
    mesh.element(*kind, *number, nodes, &[group])
}

/// Return a mesh as a text file. Each element stands once for each of its groups, whose tag is its place.
pub fn written<const D: usize>(mesh: &Mesh<D>) -> String {
    let mut text = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{}\n", mesh.groups.len());
    // writing to a String cannot fail
    for (tag, group) in (1..).zip(mesh.groups.iter()) {
        let _ = writeln!(text, "{} {tag} \"{}\"", group.dimension, group.name);
    }
    let _ = write!(text, "$EndPhysicalNames\n$Nodes\n{}\n", mesh.points.len());
    for (tag, x) in (1..).zip(&mesh.points) {
        let [x, y, z] = mesh.in_scene(*x);
        let _ = writeln!(text, "{tag} {x:?} {y:?} {z:?}");
    }
    let count: usize = mesh.groups.iter().map(Group::len).sum();
    let _ = write!(text, "$EndNodes\n$Elements\n{count}\n");
    let mut number = 0;
    for (tag, group) in (1..).zip(mesh.groups.iter()) {
        let shape = [&POINT, &LINE, &TRIANGLE, &TETRAHEDRON][group.dimension];
        let kind = ElementType::number(shape, group.stride);
        for simplex in group.simplices() {
            number += 1;
            let _ = write!(text, "{number} {kind} 2 {tag} {tag}");
            let mut nodes = simplex.to_vec();
            // the reader's change of the order is its own inverse
            ElementType::of(kind).iter().for_each(|kind| kind.reorder(&mut nodes));
            nodes.iter().for_each(|node| {
                let _ = write!(text, " {}", node + 1);
            });
            text.push('\n');
        }
    }
    text + "$EndElements\n"
}
