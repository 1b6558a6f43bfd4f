//! A reader of Gmsh's `.msh` 4.1 and 2.2, text and binary, in one pass from front to back. The sections of 2.2 are read
//! in [`super::msh2`].

use super::builder::{MeshBuilder, MeshProducer, kind_of};
use super::scan::Scanner;
use super::simplex::THINGS;
use super::{Mesh, msh2};
use crate::error::{Error, Result};
use std::collections::HashMap;
use std::io::BufRead;
use std::path::Path;

/// Read the bytes of a `.msh` file. Cells are in the order of the file, with the local numbering of [`Mesh`].
///
/// # Errors
/// Those of [`read`].
pub fn parse<const D: usize>(path: &Path, bytes: &[u8], maker: MeshProducer) -> Result<Mesh<D>> {
    let mut bytes = bytes;
    read(path, &mut bytes, maker)
}

/// Read a `.msh` file. `path` stands in messages and is what `maker` made the file from.
///
/// # Errors
/// The file cannot be read, or it is not a mesh of named simplices in `D` dimensions. The latter is a
/// [`Kind::Mesh`](crate::error::Kind) error with the line or section and a way out.
pub fn read<const D: usize>(path: &Path, input: &mut dyn BufRead, maker: MeshProducer) -> Result<Mesh<D>> {
    const { assert!(D == 2 || D == 3) };
    let scan = &mut Scanner::new(path, input, maker != MeshProducer::User);
    let version = read_format(scan)?;
    let is_old = version == Version::Two;
    let mut mesh = MeshBuilder::new(if is_old { MeshProducer::Other } else { maker });
    let mut entities = Entities::new();
    let mut seen: Vec<String> = Vec::new();
    while let Some(section) = scan.next_section()? {
        if !["PhysicalNames", "Entities", "Nodes", "Elements", "PartitionedEntities", "ParametricNodes"]
            .contains(&&*section)
        {
            scan.skip_section()?;
            continue;
        }
        if seen.contains(&section) {
            return Err(scan.damaged(format!("the section ${section} stands twice")));
        }
        let has = |name: &str| seen.iter().any(|seen| seen == name);
        match (section.as_str(), version) {
            ("PhysicalNames", _) => read_names(scan, &mut mesh)?,
            ("Entities", Version::Four) => read_entities(scan, &mut mesh, &mut entities)?,
            ("Nodes", Version::Four) => read_nodes(scan, &mut mesh)?,
            ("Nodes", Version::Two) => msh2::read_nodes(scan, &mut mesh)?,
            ("Elements", Version::Four) if has("Entities") && has("Nodes") => {
                read_elements(scan, &mut mesh, &entities)?
            }
            ("Elements", Version::Two) if has("Nodes") => msh2::read_elements(scan, &mut mesh)?,
            ("PartitionedEntities", _) => {
                let error = scan.error("the mesh is partitioned");
                return Err(error.help("save it in one piece: the program divides it among the ranks itself"));
            }
            _ => return Err(scan.damaged(format!("${section} stands before what it needs"))),
        }
        scan.leave()?;
        seen.push(section);
    }
    if seen.iter().any(|seen| seen == "Elements") {
        mesh.finish(path)
    } else {
        let error = Error::mesh(path, None, "there are no elements");
        Err(error.help("the file was cut short, or nothing was meshed"))
    }
}

/// Versions of the format.
#[derive(Clone, Copy, PartialEq)]
enum Version {
    Four,
    Two,
}

/// Read `$MeshFormat`, which is the first section except for comments.
fn read_format(scan: &mut Scanner) -> Result<Version> {
    loop {
        match scan.next_section() {
            Ok(Some(section)) if section == "MeshFormat" => break,
            Ok(Some(section)) if section == "Comments" => scan.skip_section()?,
            _ => {
                let message = "this is not a mesh file of Gmsh: it does not begin with $MeshFormat";
                return Err(scan.error(message).help(
                    "winkler reads scripts (.geo), meshes (.msh, .unv, .bdf, .inp, .mesh) and shapes (.step, .iges, .brep, .stl) by the \
                     ends of their names: docs/meshes.md has them all",
                ));
            }
        }
    }
    let line = scan.line()?;
    let words: Vec<&str> = line.split_whitespace().collect();
    let (version, is_binary) = match words[..] {
        ["4.1", "0", _] => (Version::Four, false),
        ["4.1", "1", "8"] => (Version::Four, true),
        [version, "0", _] if version.starts_with('2') => (Version::Two, false),
        [version, "1", "8"] if version.starts_with('2') => (Version::Two, true),
        _ => {
            let shown: String = words.first().unwrap_or(&"").chars().take(20).collect();
            let message = format!("this is version {shown} of the mesh format, not 4.1 or 2.2 as text or binary");
            let help = format!("save it as 4.1: gmsh {} -save -format msh41 -o new.msh", scan.path.display());
            return Err(scan.error(message).help(help));
        }
    };
    if is_binary {
        scan.begin_binary()?;
    }
    scan.leave().map(|()| version)
}

/// Read `$PhysicalNames`, which has lines of dimension, tag and quoted name, in binary files too.
fn read_names<const D: usize>(scan: &mut Scanner, mesh: &mut MeshBuilder<D>) -> Result<()> {
    let count = scan.line()?.parse::<usize>();
    let count = count.map_err(|_| scan.damaged("the number of names should stand here"))?;
    for _ in 0..count {
        let line = scan.line()?;
        let entry = line.split_once('"').and_then(|(numbers, name)| {
            let mut numbers = numbers.split_whitespace();
            let dimension = numbers.next()?.parse().ok().filter(|dimension| *dimension <= 3)?;
            Some((dimension, numbers.next()?.parse().ok()?, name.strip_suffix('"')?))
        });
        let Some((dimension, tag, name)) = entry else {
            let message = "dimension, tag and \"name\" of a physical group should stand here";
            return Err(scan.damaged(message));
        };
        let added = mesh.name(dimension, tag, name);
        scan.place(added)?;
    }
    Ok(())
}

/// Indices of the groups of each entity of the geometry, by its dimension and tag.
type Entities = HashMap<(usize, i32), Vec<usize>>;

/// Read `$Entities`, which lists the physical groups of each point, curve, surface and volume of the geometry.
fn read_entities<const D: usize>(scan: &mut Scanner, mesh: &mut MeshBuilder<D>, entities: &mut Entities) -> Result<()> {
    scan.begin(32)?;
    let counts = [scan.count()?, scan.count()?, scan.count()?, scan.count()?];
    scan.end()?;
    for (dimension, count) in counts.into_iter().enumerate() {
        let mut tags = Vec::new();
        for _ in 0..count {
            tags.push(read_entity(scan, dimension, mesh, entities)?);
        }
        if mesh.groups_by_entity(dimension) {
            for tag in tags {
                let group = mesh.group(dimension, tag);
                entities.insert((dimension, tag), vec![scan.place(group)?]);
            }
        }
    }
    Ok(())
}

/// Read an entity and its groups, and return its tag.
fn read_entity<const D: usize>(
    scan: &mut Scanner,
    dimension: usize,
    mesh: &mut MeshBuilder<D>,
    entities: &mut Entities,
) -> Result<i32> {
    // the coordinates of a point, or the corners of the box around the entity
    let numbers = if dimension == 0 { 3 } else { 6 };
    scan.begin(4 + 8 * numbers + 8)?;
    let tag = scan.int()?;
    for _ in 0..numbers {
        scan.real()?;
    }
    let mut members: Vec<usize> = Vec::new();
    let count = scan.count()?;
    scan.append(count, 4)?;
    for _ in 0..count {
        let group = mesh.group(dimension, scan.int()?);
        let group = scan.place(group)?;
        if !members.contains(&group) {
            members.push(group);
        }
    }
    if dimension > 0 {
        scan.append(1, 8)?;
        let count = scan.count()?;
        scan.append(count, 4)?;
        for _ in 0..count {
            scan.int()?;
        }
    }
    scan.end()?;
    match entities.insert((dimension, tag), members) {
        None => Ok(tag),
        Some(_) => Err(scan.damaged(format!("{} {tag} stands twice", THINGS[dimension].to_lowercase()))),
    }
}

/// Read `$Nodes`: in each block first the tags, then the coordinates, perhaps with parameters on the entity.
fn read_nodes<const D: usize>(scan: &mut Scanner, mesh: &mut MeshBuilder<D>) -> Result<()> {
    for _ in 0..read_blocks(scan)? {
        scan.begin(20)?;
        let dimension = scan.int()?;
        scan.int()?;
        let parameters = match (scan.int()?, dimension) {
            (0, _) => 0,
            (1, 0..=3) => dimension as usize,
            _ => return Err(scan.damaged("this is not the head of a block of nodes")),
        };
        let count = scan.count()?;
        scan.end()?;
        let mut tags = Vec::new();
        for _ in 0..count {
            scan.begin(8)?;
            tags.push(scan.size()?);
            scan.end()?;
        }
        for tag in tags {
            scan.begin(8 * (3 + parameters))?;
            let x = [scan.real()?, scan.real()?, scan.real()?];
            for _ in 0..parameters {
                scan.real()?;
            }
            scan.end()?;
            scan.place(mesh.node(tag, x))?;
        }
    }
    scan.place(mesh.number_nodes())
}

/// Read the head of `$Nodes` or `$Elements`, which has the numbers of blocks and of entries, and the least and largest
/// tag. Return the number of blocks.
fn read_blocks(scan: &mut Scanner) -> Result<usize> {
    scan.begin(32)?;
    let blocks = scan.count()?;
    for _ in 0..3 {
        scan.size()?;
    }
    scan.end().map(|()| blocks)
}

/// Read `$Elements`. Elements of entities without groups are skipped.
fn read_elements<const D: usize>(scan: &mut Scanner, mesh: &mut MeshBuilder<D>, entities: &Entities) -> Result<()> {
    let blocks = read_blocks(scan)?;
    let mut nodes = Vec::new();
    for _ in 0..blocks {
        scan.begin(20)?;
        let (dimension, tag, number) = (scan.int()?, scan.int()?, scan.int()?);
        let count = scan.count()?;
        scan.end()?;
        let kind = scan.place(kind_of(number))?;
        // This is checked even in blocks that nobody needs. The block may be one of another dimension whose head is
        // damaged.
        let thing = THINGS[kind.shape.dimension].to_lowercase();
        if kind.shape.dimension as i32 != dimension {
            let message = format!("{} elements in a block of dimension {dimension}", kind.shape.name);
            return Err(scan.damaged(message));
        }
        let Some(groups) = entities.get(&(kind.shape.dimension, tag)) else {
            let message = format!("elements of {thing} {tag}, which $Entities does not list");
            return Err(scan.damaged(message));
        };
        let bytes = 8 * (1 + kind.nodes);
        if groups.is_empty() {
            scan.skip(count, bytes)?;
            continue;
        }
        scan.place(mesh.check_type(kind, groups))?;
        for _ in 0..count {
            scan.begin(bytes)?;
            let element = scan.size()?;
            nodes.clear();
            for _ in 0..kind.nodes {
                nodes.push(scan.size()?);
            }
            scan.end()?;
            scan.place(mesh.element(kind, element, &nodes, groups))?;
        }
    }
    Ok(())
}
