//! Input files of Abaqus and CalculiX (`.inp`) in Gmsh's format 2.2, which Debian's Gmsh reads: nodes, elements, and named
//! sets.
//!
//! Element sets become groups of cells or facets, surfaces (`*SURFACE, TYPE=ELEMENT`) groups of facets, and node sets groups of
//! points. Names are written in lower case. Characters that no name can have become `_`. All other keywords are skipped.

use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// A kind of element: Gmsh's number, and the vertices of its faces S1, S2, ... in the order of Abaqus.
struct Kind {
    number: u8,
    nodes: usize,
    dimension: usize,
    faces: &'static [&'static [usize]],
}

const TRIANGLE: &[&[usize]] = &[&[0, 1], &[1, 2], &[2, 0]];
const TRIANGLE_2: &[&[usize]] = &[&[0, 1, 3], &[1, 2, 4], &[2, 0, 5]];
const QUADRANGLE: &[&[usize]] = &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]];
const TETRAHEDRON: &[&[usize]] = &[&[0, 1, 2], &[0, 3, 1], &[1, 3, 2], &[2, 3, 0]];
const TETRAHEDRON_2: &[&[usize]] =
    &[&[0, 1, 2, 4, 5, 6], &[0, 3, 1, 7, 8, 4], &[1, 3, 2, 8, 9, 5], &[2, 3, 0, 9, 7, 6]];
const QUADRANGLE_2: &[&[usize]] = &[&[0, 1, 4], &[1, 2, 5], &[2, 3, 6], &[3, 0, 7]];
const PRISM: &[&[usize]] = &[&[0, 1, 2], &[3, 5, 4], &[0, 3, 4, 1], &[1, 4, 5, 2], &[2, 5, 3, 0]];
const HEXAHEDRON: &[&[usize]] =
    &[&[0, 1, 2, 3], &[4, 7, 6, 5], &[0, 4, 5, 1], &[1, 5, 6, 2], &[2, 6, 7, 3], &[3, 7, 4, 0]];
const PRISM_2: &[&[usize]] = &[
    &[0, 1, 2, 6, 7, 8],
    &[3, 5, 4, 11, 10, 9],
    &[0, 3, 4, 1, 12, 9, 13, 6],
    &[1, 4, 5, 2, 13, 10, 14, 7],
    &[2, 5, 3, 0, 14, 11, 12, 8],
];
const HEXAHEDRON_2: &[&[usize]] = &[
    &[0, 1, 2, 3, 8, 9, 10, 11],
    &[4, 7, 6, 5, 15, 14, 13, 12],
    &[0, 4, 5, 1, 16, 12, 17, 8],
    &[1, 5, 6, 2, 17, 13, 18, 9],
    &[2, 6, 7, 3, 18, 14, 19, 10],
    &[3, 7, 4, 0, 19, 15, 16, 11],
];

/// Return the nodes of an element in the order of Gmsh. `number` is Gmsh's number of its kind.
fn in_gmsh_order(number: u8, nodes: &[u64]) -> Vec<u64> {
    let middles: &[usize] = match number {
        11 => &[4, 5, 6, 7, 9, 8],
        17 => &[8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14],
        18 => &[6, 8, 12, 7, 13, 14, 9, 11, 10],
        _ => return nodes.to_vec(),
    };
    let vertices = &nodes[..nodes.len() - middles.len()];
    vertices.iter().copied().chain(middles.iter().map(|&at| nodes[at])).collect()
}

impl Kind {
    /// Return the kind that a TYPE names, if it can be used.
    fn of(name: &str) -> Option<Kind> {
        let kind = |number, nodes, dimension, faces| Some(Kind { number, nodes, dimension, faces });
        let (family, digits) = match name.find(|c: char| c.is_ascii_digit()) {
            // In C3D8R and M3D4 the number of nodes follows the D.
            _ if name.starts_with("C3D") || name.starts_with("M3D") || name.starts_with("SFM3D") => {
                name.split_at(name.find('D')? + 1)
            }
            Some(at) => name.split_at(at),
            None => return None,
        };
        let nodes: String = digits.chars().take_while(char::is_ascii_digit).collect();
        match (family, nodes.as_str()) {
            ("C3D", "4") => kind(4, 4, 3, TETRAHEDRON),
            ("C3D", "10") => kind(11, 10, 3, TETRAHEDRON_2),
            ("C3D", "6") => kind(6, 6, 3, PRISM),
            ("C3D", "8") => kind(5, 8, 3, HEXAHEDRON),
            ("C3D", "15") => kind(18, 15, 3, PRISM_2),
            ("C3D", "20") => kind(17, 20, 3, HEXAHEDRON_2),
            ("CPS" | "CPE" | "CAX" | "S" | "M3D" | "SFM3D" | "STRI", "3") => kind(2, 3, 2, TRIANGLE),
            ("CPS" | "CPE" | "CAX" | "S" | "M3D" | "SFM3D", "6") | ("STRI", "65") => kind(9, 6, 2, TRIANGLE_2),
            ("CPS" | "CPE" | "CAX" | "S" | "M3D" | "SFM3D", "4") => kind(3, 4, 2, QUADRANGLE),
            ("CPS" | "CPE" | "CAX" | "S" | "M3D" | "SFM3D", "8") => kind(16, 8, 2, QUADRANGLE_2),
            _ => None,
        }
    }

    /// Return Gmsh's type number of a face with this number of nodes.
    fn facet(&self, nodes: usize) -> u8 {
        match (self.dimension, nodes) {
            (2, 2) => 1,
            (2, _) => 8,
            (_, 3) => 2,
            (_, 4) => 3,
            (_, 6) => 9,
            _ => 16,
        }
    }
}

/// An element: the index of its kind, and the tags of its nodes.
type Element = (usize, Vec<u64>);

/// An element with Gmsh's number of its kind, and the tags of its nodes.
type Numbered = (u8, Vec<u64>);

/// The contents of a file.
#[derive(Default)]
struct Model {
    /// Bytes of the file: no set has more members.
    bytes: usize,
    nodes: BTreeMap<u64, [f64; 3]>,
    elements: BTreeMap<u64, Element>,
    kinds: Vec<Kind>,
    /// Elements, nodes, and faces (element, number of the face) by the names of their sets.
    element_sets: BTreeMap<String, Vec<u64>>,
    node_sets: BTreeMap<String, Vec<u64>>,
    surfaces: BTreeMap<String, Vec<(u64, usize)>>,
}

/// The kind of data lines that follow a keyword.
enum Data {
    Nodes(Option<String>),
    Elements { kind: usize, set: Option<String>, open: Vec<u64> },
    Set { name: String, nodes: bool, generate: bool },
    Surface(String),
    Other,
}

/// Return the file in Gmsh's format 2.2.
///
/// # Errors
/// A line is not one of Abaqus. The file has parts or assemblies, or elements of other kinds. A set has members that do not
/// exist. Errors in a line name it.
pub fn convert(path: &Path, text: &str) -> Result<String> {
    let mut model = Model { bytes: text.len(), ..Model::default() };
    let mut data = Data::Other;
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with("**") {
            continue;
        }
        let refuse = |message: String| Error::mesh(path, Some(number + 1), message);
        data = match line.strip_prefix('*') {
            Some(keyword) => model.end(&data).and_then(|()| model.begin(keyword)).map_err(refuse)?,
            None => model.read(data, line).map_err(refuse)?,
        };
    }
    model.end(&data).map_err(|message| Error::mesh(path, None, message))?;
    if model.nodes.is_empty() || model.elements.is_empty() {
        return Err(Error::mesh(path, None, "this file has no nodes or no elements")
            .help("an input file of Abaqus or CalculiX has them under *NODE and *ELEMENT"));
    }
    model.write().map_err(|message| Error::mesh(path, None, message))
}

/// Return a name in the form that groups have.
fn name(word: &str) -> String {
    let small = word.trim().trim_matches('"').to_ascii_lowercase();
    small.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}

fn count<T: std::str::FromStr>(word: &str) -> std::result::Result<T, String> {
    word.trim().parse().map_err(|_| format!("`{}` is no number", word.trim()))
}

type TextResult<T> = std::result::Result<T, String>;

impl Model {
    /// Start a keyword: return the kind of its data lines.
    fn begin(&mut self, line: &str) -> TextResult<Data> {
        let mut words = line.split(',').map(str::trim);
        let keyword = words.next().unwrap_or_default().to_ascii_uppercase();
        let options: Vec<(String, String)> = words
            .map(|word| word.split_once('=').unwrap_or((word, "")))
            .map(|(key, value)| (key.trim().to_ascii_uppercase(), value.trim().to_owned()))
            .collect();
        let option = |key: &str| options.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str());
        let set = |key: &str| option(key).map(name).ok_or_else(|| format!("*{keyword} has no {key}"));
        Ok(match keyword.as_str() {
            "NODE" => Data::Nodes(option("NSET").map(name)),
            "ELEMENT" => {
                let kind = option("TYPE").unwrap_or_default().to_ascii_uppercase();
                let known = Kind::of(&kind).ok_or_else(|| {
                    format!(
                        "elements of type `{kind}` cannot be used: solids of order 1 and 2 of CPS, CPE, CAX and C3D can"
                    )
                })?;
                self.kinds.push(known);
                Data::Elements { kind: self.kinds.len() - 1, set: option("ELSET").map(name), open: Vec::new() }
            }
            "NSET" | "ELSET" => {
                let generate = option("GENERATE").is_some();
                Data::Set { name: set(&keyword)?, nodes: keyword == "NSET", generate }
            }
            "SURFACE" if option("TYPE").is_none_or(|kind| kind.eq_ignore_ascii_case("ELEMENT")) => {
                Data::Surface(set("NAME")?)
            }
            "PART" | "INSTANCE" | "ASSEMBLY" | "INCLUDE" | "NGEN" | "ELGEN" => {
                return Err(format!(
                    "*{keyword} is not read: write a flat file of *NODE, *ELEMENT and sets (in Abaqus/CAE: do not use parts and \
                     assemblies in input files)"
                ));
            }
            _ => Data::Other,
        })
    }

    /// Check that no element is left open where its data lines end.
    fn end(&self, data: &Data) -> TextResult<()> {
        match data {
            Data::Elements { kind, open, .. } if !open.is_empty() => self.check_count(*kind, open),
            _ => Ok(()),
        }
    }

    /// Check the number of nodes behind the tag of an element.
    fn check_count(&self, kind: usize, open: &[u64]) -> TextResult<()> {
        let nodes = self.kinds[kind].nodes;
        match open.len() == nodes + 1 {
            true => Ok(()),
            false => Err(format!("an element has {nodes} nodes here, not {}", open.len() - 1)),
        }
    }

    /// Read a data line.
    fn read(&mut self, data: Data, line: &str) -> TextResult<Data> {
        let continues = line.ends_with(',');
        let words: Vec<&str> = line.trim_end_matches(',').split(',').map(str::trim).collect();
        match data {
            Data::Nodes(set) => {
                let tag = count(words[0])?;
                let mut x = [0.0; 3];
                for (x, word) in x.iter_mut().zip(&words[1..]) {
                    *x = if word.is_empty() { 0.0 } else { count(word)? };
                }
                self.nodes.insert(tag, x);
                set.iter().for_each(|set| self.node_sets.entry(set.clone()).or_default().push(tag));
                Ok(Data::Nodes(set))
            }
            Data::Elements { kind, set, mut open } => {
                for word in &words {
                    open.push(count(word)?);
                }
                if open.len() < self.kinds[kind].nodes + 1 && continues {
                    return Ok(Data::Elements { kind, set, open });
                }
                self.check_count(kind, &open)?;
                let tag = open.remove(0);
                set.iter().for_each(|set| self.element_sets.entry(set.clone()).or_default().push(tag));
                if self.elements.insert(tag, (kind, open)).is_some() {
                    return Err(format!("the element {tag} stands twice"));
                }
                Ok(Data::Elements { kind, set, open: Vec::new() })
            }
            Data::Set { name: set, nodes, generate } => {
                let sets = if nodes { &mut self.node_sets } else { &mut self.element_sets };
                let mut members = Vec::new();
                if generate {
                    members = generated(&set, &words, self.bytes)?;
                } else {
                    for word in words.iter().filter(|word| !word.is_empty()) {
                        match word.parse() {
                            Ok(tag) => members.push(tag),
                            Err(_) => members.extend(sets.get(&name(word)).ok_or(format!("there is no set `{word}`"))?),
                        }
                    }
                }
                sets.entry(set.clone()).or_default().extend(members);
                Ok(Data::Set { name: set, nodes, generate })
            }
            Data::Surface(surface) => {
                let face = words.get(1).and_then(|word| word.strip_prefix(['S', 's'])?.parse::<usize>().ok());
                let Some(face) = face.filter(|face| (1..=6).contains(face)) else {
                    return Err(format!("`{line}` is no face of elements such as `12, S1`"));
                };
                let one = words[0].parse().map(|tag| vec![tag]).ok();
                let all = one.or_else(|| self.element_sets.get(&name(words[0])).cloned());
                let all = all.ok_or_else(|| format!("there is no element set `{}`", words[0]))?;
                self.surfaces.entry(surface.clone()).or_default().extend(all.into_iter().map(|tag| (tag, face)));
                Ok(Data::Surface(surface))
            }
            Data::Other => Ok(Data::Other),
        }
    }

    /// Return the mesh in Gmsh's format 2.2. Each group is a physical one on an entity of its own, so an element of several
    /// groups is written once for each.
    fn write(&self) -> TextResult<String> {
        let mut groups = self.element_groups()?;
        groups.extend(self.facet_groups()?);
        let points = |nodes: &[u64]| nodes.iter().map(|&node| (15, vec![node])).collect();
        groups.extend(self.node_sets.iter().map(|(set, nodes)| Written {
            dimension: 0,
            name: set,
            elements: points(nodes),
        }));
        groups.retain(|group| !group.elements.is_empty());
        let mut text = String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n");
        write_names(&groups, &mut text);
        let _ = writeln!(text, "$Nodes\n{}", self.nodes.len());
        for (tag, [x, y, z]) in &self.nodes {
            let _ = writeln!(text, "{tag} {x:?} {y:?} {z:?}");
        }
        text.push_str("$EndNodes\n");
        self.write_elements(&groups, &mut text)?;
        Ok(text)
    }

    /// Return the groups of element sets.
    fn element_groups(&self) -> TextResult<Vec<Written<'_>>> {
        let mut groups = Vec::new();
        for (set, tags) in &self.element_sets {
            let mut of_dimension: BTreeMap<usize, Vec<Numbered>> = BTreeMap::new();
            for tag in tags {
                let (kind, nodes) = self
                    .elements
                    .get(tag)
                    .ok_or_else(|| format!("`{set}` has an element {tag}, which is not there"))?;
                let kind = &self.kinds[*kind];
                let nodes = in_gmsh_order(kind.number, nodes);
                of_dimension.entry(kind.dimension).or_default().push((kind.number, nodes));
            }
            if of_dimension.len() > 1 {
                return Err(format!("the element set `{set}` has elements of several dimensions"));
            }
            let written = |(dimension, elements)| Written { dimension, name: set, elements };
            groups.extend(of_dimension.into_iter().map(written));
        }
        Ok(groups)
    }

    /// Return the groups of surfaces, whose elements are faces of cells.
    fn facet_groups(&self) -> TextResult<Vec<Written<'_>>> {
        let mut groups = Vec::new();
        for (surface, faces) in &self.surfaces {
            let mut group = Written { dimension: 0, name: surface, elements: Vec::new() };
            for &(tag, face) in faces {
                let (kind, nodes) = self
                    .elements
                    .get(&tag)
                    .ok_or_else(|| format!("`{surface}` has a face of element {tag}, which is not there"))?;
                let kind = &self.kinds[*kind];
                let face = kind
                    .faces
                    .get(face - 1)
                    .ok_or_else(|| format!("element {tag} in `{surface}` has no face S{face}"))?;
                group.dimension = kind.dimension - 1;
                group.elements.push((kind.facet(face.len()), face.iter().map(|&at| nodes[at]).collect()));
            }
            groups.push(group);
        }
        Ok(groups)
    }

    /// Write the elements of all groups. Those of group k have the physical and elementary tag k + 1.
    fn write_elements(&self, groups: &[Written], text: &mut String) -> TextResult<()> {
        let total: usize = groups.iter().map(|group| group.elements.len()).sum();
        let _ = writeln!(text, "$Elements\n{total}");
        let mut number = 0;
        for (tag, group) in (1..).zip(groups) {
            for (kind, nodes) in &group.elements {
                number += 1;
                let _ = write!(text, "{number} {kind} 2 {tag} {tag}");
                for node in nodes {
                    if !self.nodes.contains_key(node) {
                        return Err(format!("an element of `{}` has the node {node}, which is not there", group.name));
                    }
                    let _ = write!(text, " {node}");
                }
                text.push('\n');
            }
        }
        text.push_str("$EndElements\n");
        Ok(())
    }
}

/// Return the members of the set that a data line `first, last, step` generates. A file of so many `bytes` has no more of them.
fn generated(set: &str, words: &[&str], bytes: usize) -> TextResult<Vec<u64>> {
    let [first, last] = [count::<u64>(words[0])?, count(words.get(1).copied().unwrap_or_default())?];
    let step = words.get(2).filter(|word| !word.is_empty()).map_or(Ok(1), |word| count::<usize>(word))?.max(1);
    match last.saturating_sub(first) / step as u64 >= bytes as u64 {
        true => Err(format!("the set `{set}` has more members, from {first} to {last}, than the file has bytes")),
        false => Ok((first..=last).step_by(step).collect()),
    }
}

/// A group in the form in which it is written.
struct Written<'a> {
    dimension: usize,
    name: &'a str,
    elements: Vec<Numbered>,
}

/// Write the names of groups. If an element set and a node set have the same name, that of the node set gets a suffix.
fn write_names(groups: &[Written], text: &mut String) {
    let mut used: Vec<&str> = groups.iter().map(|group| group.name).collect();
    used.sort_unstable();
    let is_twice = |name: &str| used.windows(2).any(|pair| pair[0] == name && pair[1] == name);
    let _ = writeln!(text, "$PhysicalNames\n{}", groups.len());
    for (tag, Written { dimension, name, .. }) in (1..).zip(groups) {
        let suffix = if *dimension == 0 && is_twice(name) { "_nodes" } else { "" };
        let _ = writeln!(text, "{dimension} {tag} \"{name}{suffix}\"");
    }
    text.push_str("$EndPhysicalNames\n");
}
