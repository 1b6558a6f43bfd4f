//! The sections of Gmsh's format 2.2, and a writer of that format.
//!
//! Each element has its physical group, and the number of an entity of the geometry besides. Other programs write one
//! number for all entities, so that groups are those of the physical tags alone. Entities are groups in a dimension
//! without physical groups. An element of several groups stands in the file once for each of them.

use super::Mesh;
use super::builder::{MeshBuilder, kind_of};
use super::scan::{Flaw, Scanner};
use super::simplex::{ElementType, LINE, POINT, TRIANGLE};
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
) -> std::result::Result<(), Flaw> {
    let Element { number, kind, nodes, .. } = element;
    let mut key = nodes.clone();
    key.sort_unstable();
    if !known.insert((group, key)) {
        return Ok(());
    }
    mesh.check_type(*kind, &[group])?;
    mesh.element(*kind, *number, nodes, &[group])
}

/// A mesh to be written: nodes by their numbers, and groups of elements.
#[derive(Default)]
pub struct Contents {
    /// Dimension and name of each group. Its tag is its place, from 1.
    pub groups: Vec<(usize, String)>,
    pub nodes: Vec<(u64, [f64; 3])>,
    /// Number, type, group and nodes of each element, as many times as it has groups.
    pub elements: Vec<(u64, i32, usize, Vec<u64>)>,
}

impl Contents {
    /// Return the contents of a mesh in the plane. Each element is written once for each of its groups.
    pub fn of(mesh: &Mesh<2>) -> Self {
        let nodes = (1..).zip(mesh.points.iter().map(|&x| mesh.in_scene(x))).collect();
        let mut contents = Self { nodes, ..Self::default() };
        for (tag, group) in (1..).zip(mesh.groups.iter()) {
            contents.groups.push((group.dimension, group.name.clone()));
            let kind = ElementType::number([&POINT, &LINE, &TRIANGLE][group.dimension], group.stride);
            for simplex in group.simplices() {
                let number = contents.elements.len() as u64 + 1;
                let mut nodes: Vec<u64> = simplex.iter().map(|&node| u64::from(node) + 1).collect();
                if group.dimension == 2 {
                    // Gmsh has the third edge as 20
                    nodes[2 * mesh.order.degree() + 1..].reverse();
                }
                contents.elements.push((number, kind, tag, nodes));
            }
        }
        contents
    }

    /// Return the file as text.
    pub fn written(&self) -> String {
        let mut text = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{}\n", self.groups.len());
        // writing to a String cannot fail
        for ((dimension, name), tag) in self.groups.iter().zip(1..) {
            let _ = writeln!(text, "{dimension} {tag} \"{name}\"");
        }
        let _ = write!(text, "$EndPhysicalNames\n$Nodes\n{}\n", self.nodes.len());
        for (tag, [x, y, z]) in &self.nodes {
            let _ = writeln!(text, "{tag} {x:?} {y:?} {z:?}");
        }
        let _ = write!(text, "$EndNodes\n$Elements\n{}\n", self.elements.len());
        for (number, kind, group, nodes) in &self.elements {
            let _ = write!(text, "{number} {kind} 2 {group} {group}");
            nodes.iter().for_each(|node| {
                let _ = write!(text, " {node}");
            });
            text.push('\n');
        }
        text + "$EndElements\n"
    }
}
