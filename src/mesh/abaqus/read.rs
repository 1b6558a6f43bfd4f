//! From the lines of a file to its contents.

use super::frame::{Coordinates, LocalAxes};
use super::lines::{
    InputLine, Keyword, LineReader, SourceLine, TextResult, coordinates, count, generated, reals, spelled,
};
use super::model::{
    AbaqusElement, AbaqusModel, AbaqusNode, AbaqusSurface, AbaqusType, ElementFace, ElementUse, Label, Set, members,
    normal,
};
use crate::error::Result;
use nalgebra::{Point3, Rotation3, Unit};
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

/// The kind of data lines that follow a keyword.
enum DataLines {
    Nodes { set: Option<String>, coordinates: Coordinates },
    Elements(ElementLines),
    Set { name: String, nodes: bool, generate: bool, shift: u64 },
    Surface(String),
    NodeSurface(String),
    Union(String),
    System(Vec<[f64; 3]>),
    Instance,
    Other,
}

/// Lines of elements of a type.
struct ElementLines {
    name: Rc<str>,
    role: ElementUse,
    set: Option<String>,
    /// An element whose line does not have all its nodes.
    open: Vec<u64>,
    /// Whether that line ends with a comma.
    comma: bool,
}

/// A part or instance that is being read, and what surrounds it.
#[derive(Default)]
struct PartScope {
    /// Beginning of the names of its sets.
    prefix: String,
    /// Number that is added to those of nodes and elements.
    shift: u64,
    /// Axes of `*SYSTEM`.
    frame: LocalAxes,
}

/// A node whose number stands twice with different coordinates.
pub struct Twice {
    pub tag: u64,
    pub lines: [SourceLine; 2],
}

/// A reader of a file, with what it has read so far.
#[derive(Default)]
pub struct Reader {
    pub lines: LineReader,
    pub model: AbaqusModel,
    /// Nodes that stand twice.
    pub twice: Vec<Twice>,
    /// Number of `*TRANSFORM` keywords, which only turn dofs.
    pub transforms: usize,
    /// Number of elements with more nodes than their type has.
    pub longer: usize,
    scope: PartScope,
    /// The rest of the file while a part is read, and the name of the part.
    outer: Option<(String, AbaqusModel)>,
    parts: BTreeMap<String, AbaqusModel>,
    /// Shifts of the instances by name.
    instances: BTreeMap<String, u64>,
    /// Lines behind `*INSTANCE` that place it.
    moves: Vec<Vec<f64>>,
}

/// Return the set of a name, which is made if it is new.
///
/// # Errors
/// Another name becomes the same.
fn entry<'a>(sets: &'a mut BTreeMap<String, Set>, spelling: &str, at: SourceLine) -> TextResult<&'a mut Set> {
    let new = || Set { label: Label { spelling: spelling.to_owned(), at }, ..Set::default() };
    let set = sets.entry(normal(spelling)).or_insert_with(new);
    same(&set.label, spelling)?;
    Ok(set)
}

/// Check that a name is spelled like an earlier one that is the same for the program.
fn same(known: &Label, spelling: &str) -> TextResult<()> {
    if known.spelling == spelling {
        return Ok(());
    }
    let (first, name) = (&known.spelling, normal(spelling));
    Err(format!("`{spelling}` and `{first}` would both be called `{name}` here: rename one of them"))
}

impl Reader {
    /// Read a file and all that it includes.
    ///
    /// # Errors
    /// A line is not one of Abaqus or CalculiX, or it is one that the program does not know and that changes the mesh.
    /// The error names the file and the line.
    pub fn read(path: &Path, bytes: &[u8]) -> Result<Reader> {
        let mut reader = Reader { lines: LineReader::new(path, bytes), ..Reader::default() };
        let (mut data, mut last) = (DataLines::Other, SourceLine::default());
        while let Some((at, line)) = reader.lines.next() {
            last = at;
            match line {
                InputLine::Data(line) => {
                    reader.data(&mut data, &line, at).map_err(|message| reader.lines.refuse(at, message))?;
                }
                InputLine::Keyword(line) => data = reader.keyword(data, &line, at)?,
            }
        }
        reader.end(data).map_err(|message| reader.lines.refuse(last, message))?;
        match (reader.outer.is_some(), reader.scope.prefix.is_empty()) {
            (true, _) => Err(reader.lines.refuse(last, "*END PART is missing")),
            (_, false) => Err(reader.lines.refuse(last, "*END INSTANCE is missing")),
            _ => Ok(reader),
        }
    }

    /// End the data of a keyword and begin those of another one. An included file continues the data before it.
    fn keyword(&mut self, data: DataLines, line: &str, at: SourceLine) -> Result<DataLines> {
        let keyword = Keyword::new(line, at);
        if keyword.name == "INCLUDE" {
            let input = keyword.get("INPUT").ok_or_else(|| self.lines.refuse(at, "*INCLUDE has no INPUT"))?;
            return self.lines.include(input, at).map(|()| data);
        }
        let refuse = |reader: &Self, message: String| reader.lines.refuse(at, message);
        self.end(data).map_err(|message| refuse(self, message))?;
        let data = self.begin(&keyword).map_err(|message| refuse(self, message))?;
        match keyword.get("INPUT").filter(|_| !matches!(data, DataLines::Other)) {
            Some(input) => self.lines.include(input, at).map(|()| data),
            None => Ok(data),
        }
    }

    /// Start a keyword: return the kind of its data lines.
    fn begin(&mut self, keyword: &Keyword) -> TextResult<DataLines> {
        let spelling = |key: &str| keyword.get(key).map(|word| format!("{}{}", self.scope.prefix, spelled(word)));
        let named = |key: &str| spelling(key).ok_or_else(|| format!("*{} has no {key}", keyword.name));
        Ok(match keyword.name.as_str() {
            "NODE" => DataLines::Nodes { set: spelling("NSET"), coordinates: coordinates(keyword)? },
            "ELEMENT" => {
                let name: Rc<str> = keyword.get("TYPE").unwrap_or_default().to_ascii_uppercase().into();
                let role = ElementUse::of(&name);
                if role == ElementUse::Refused {
                    return Err(format!(
                        "elements of type `{name}` cannot be used: triangles, quadrangles, tetrahedra, pyramids, prisms and \
                         hexahedra of order 1 or 2 can, of the families CPS, CPE, CAX and C3D"
                    ));
                }
                DataLines::Elements(ElementLines { name, role, set: spelling("ELSET"), open: Vec::new(), comma: false })
            }
            "NSET" | "ELSET" => self.set(keyword, named(&keyword.name)?)?,
            "SURFACE" => self.surface(keyword, named("NAME")?)?,
            "SOLID SECTION" => {
                self.model.sections.extend(spelling("ELSET").map(|spelling| normal(&spelling)));
                DataLines::Other
            }
            "SYSTEM" => {
                self.scope.frame = LocalAxes::default();
                DataLines::System(Vec::new())
            }
            "TRANSFORM" => {
                self.transforms += 1;
                DataLines::Other
            }
            "PART" | "END PART" | "INSTANCE" | "END INSTANCE" | "END ASSEMBLY" => return self.assembly(keyword),
            "NGEN" | "NFILL" | "NCOPY" | "NMAP" | "ELGEN" | "ELCOPY" => {
                return Err(format!(
                    "*{} is not read: write a file that has every node under *NODE and every element under *ELEMENT",
                    keyword.name
                ));
            }
            _ => DataLines::Other,
        })
    }

    fn set(&mut self, keyword: &Keyword, spelling: String) -> TextResult<DataLines> {
        let shift = match keyword.get("INSTANCE").map(spelled) {
            Some(name) => *self.instances.get(&name).ok_or_else(|| format!("there is no instance `{name}`"))?,
            None => self.scope.shift,
        };
        let nodes = keyword.name == "NSET";
        let AbaqusModel { elements, element_sets, node_sets, .. } = &mut self.model;
        match keyword.get("ELSET").filter(|_| nodes) {
            Some(word) => {
                let name = known(element_sets, &self.scope.prefix, word)?;
                let tags = members(element_sets, &name, elements);
                let tags = tags.map_err(|missing| format!("element {} is not there", missing.tag))?;
                let set = entry(node_sets, &spelling, keyword.at)?;
                set.members.extend(tags.iter().flat_map(|tag| &elements[tag].nodes));
            }
            None => {
                entry(if nodes { node_sets } else { element_sets }, &spelling, keyword.at)?;
            }
        }
        let generate = keyword.get("GENERATE").is_some();
        Ok(DataLines::Set { name: normal(&spelling), nodes, generate, shift })
    }

    fn surface(&mut self, keyword: &Keyword, spelling: String) -> TextResult<DataLines> {
        let name = normal(&spelling);
        let kind = keyword.get("TYPE").unwrap_or("ELEMENT").to_ascii_uppercase();
        let combine = keyword.get("COMBINE").map(str::to_ascii_uppercase);
        if kind == "NODE" {
            entry(&mut self.model.node_sets, &spelling, keyword.at)?;
            return Ok(DataLines::NodeSurface(name));
        }
        if kind != "ELEMENT" || combine.as_deref().is_some_and(|combine| combine != "UNION") {
            let what = combine.map_or(format!("TYPE={kind}"), |combine| format!("COMBINE={combine}"));
            return Err(format!("a surface with {what} is not read: name its faces, as in `12, S1`"));
        }
        let label = Label { spelling: spelling.clone(), at: keyword.at };
        let surface = self.model.surfaces.entry(name.clone());
        let surface = surface.or_insert_with(|| AbaqusSurface { label, ..AbaqusSurface::default() });
        same(&surface.label, &spelling)?;
        Ok(if combine.is_some() { DataLines::Union(name) } else { DataLines::Surface(name) })
    }

    /// Begin or end a part, an instance or an assembly.
    fn assembly(&mut self, keyword: &Keyword) -> TextResult<DataLines> {
        let name = keyword.get("NAME").map(spelled);
        let named = || name.clone().ok_or_else(|| format!("*{} has no NAME", keyword.name));
        self.scope.frame = LocalAxes::default();
        match keyword.name.as_str() {
            "PART" if self.outer.is_some() => return Err("a part stands in another one: *END PART is missing".into()),
            "PART" => self.outer = Some((named()?, std::mem::take(&mut self.model))),
            "END PART" => {
                let (name, outer) = self.outer.take().ok_or("there is no *PART before this line")?;
                self.parts.insert(name, std::mem::replace(&mut self.model, outer));
            }
            "INSTANCE" => {
                let (name, part) = (named()?, keyword.get("PART").map(spelled).ok_or("*INSTANCE has no PART")?);
                let part = self.parts.get(&part).ok_or_else(|| format!("there is no part `{part}`"))?;
                self.scope.shift = self.model.largest();
                self.scope.prefix = format!("{name}.");
                self.model.add(part, &self.scope.prefix, self.scope.shift);
                if self.instances.insert(name, self.scope.shift).is_some() {
                    return Err("this instance stands twice".into());
                }
                self.moves.clear();
                return Ok(DataLines::Instance);
            }
            "END INSTANCE" => self.end_instance(keyword.at)?,
            _ => {}
        }
        Ok(DataLines::Other)
    }

    /// Place an instance. All its elements become a set with its name.
    fn end_instance(&mut self, at: SourceLine) -> TextResult<()> {
        let (shift, moves) = (self.scope.shift, std::mem::take(&mut self.moves));
        let vector = |line: &[f64], from: usize| std::array::from_fn(|c| line.get(from + c).copied().unwrap_or(0.0));
        let translation = moves.first().map_or([0.0; 3], |line| vector(line, 0));
        let rotation = match moves.get(1) {
            Some(line) if line.len() == 7 => {
                let [a, b] = [0, 3].map(|from| Point3::from(vector(line, from)));
                let axis = Unit::try_new(b - a, 1e-300).ok_or("the axis of a rotation is a point")?;
                Some((a, Rotation3::from_axis_angle(&axis, line[6].to_radians())))
            }
            Some(_) => return Err("a rotation has two points of its axis and an angle, seven numbers".into()),
            None => None,
        };
        let frame = LocalAxes::at(translation);
        self.model.place(shift, |x| match rotation {
            Some((a, rotation)) => (a + rotation * (Point3::from(frame.place(x)) - a)).into(),
            None => frame.place(x),
        });
        let name = self.scope.prefix.trim_end_matches('.').to_owned();
        let elements: Vec<u64> = self.model.elements.range(shift.saturating_add(1)..).map(|(tag, _)| *tag).collect();
        let set = entry(&mut self.model.element_sets, &name, at)?;
        set.members.extend(elements);
        self.scope = PartScope { shift: self.model.largest(), ..PartScope::default() };
        Ok(())
    }

    /// End the data lines of a keyword.
    fn end(&mut self, data: DataLines) -> TextResult<()> {
        match data {
            DataLines::Elements(ElementLines { role: ElementUse::Mesh(kind), open, .. }) if !open.is_empty() => {
                check_count(kind, &open)
            }
            _ => Ok(()),
        }
    }

    fn data(&mut self, data: &mut DataLines, line: &str, at: SourceLine) -> TextResult<()> {
        let words: Vec<&str> = line.trim_end_matches(',').split(',').map(str::trim).collect();
        match data {
            DataLines::Nodes { set, coordinates } => self.node(&words, set.as_deref(), *coordinates, at),
            DataLines::Elements(lines) => self.element(lines, &words, !line.ends_with(','), at),
            DataLines::Set { name, nodes, generate, shift } => self.members(name, *nodes, *generate, *shift, &words),
            DataLines::Surface(name) => self.face(name, &words, line),
            DataLines::NodeSurface(name) => self.members(name, true, false, self.scope.shift, &words[..1]),
            DataLines::Union(name) => self.unite(name, &words),
            DataLines::System(points) => self.system(points, &reals(&words)?),
            DataLines::Instance => {
                self.moves.push(reals(&words)?);
                Ok(())
            }
            DataLines::Other => Ok(()),
        }
    }

    fn node(&mut self, words: &[&str], set: Option<&str>, coordinates: Coordinates, at: SourceLine) -> TextResult<()> {
        let tag = count(words[0])?.saturating_add(self.scope.shift);
        let given = reals(&words[1..words.len().min(4)])?;
        let given = std::array::from_fn(|c| given.get(c).copied().unwrap_or(0.0));
        let x = self.scope.frame.place(coordinates.rectangular(given));
        if let Some(old) = self.model.nodes.insert(tag, AbaqusNode { x, at }).filter(|old| old.x != x) {
            self.twice.push(Twice { tag, lines: [old.at, at] });
        }
        if let Some(set) = set {
            entry(&mut self.model.node_sets, set, at)?.members.insert(tag);
        }
        Ok(())
    }

    /// Read an element, or a part of it.
    ///
    /// A line goes on in the next one after a comma. Where the number of nodes is known, it also goes on without a
    /// comma until all nodes are there, as CalculiX reads it; then the lines must have exactly these nodes.
    fn element(&mut self, lines: &mut ElementLines, words: &[&str], ends: bool, at: SourceLine) -> TextResult<()> {
        let ElementLines { name, role, set, open, comma } = lines;
        let before = open.len();
        let kind = if let ElementUse::Mesh(kind) = *role { Some(kind) } else { None };
        if kind.is_none() {
            // The number of nodes is unknown, so that the element ends where its line does not go on.
            open.extend(count(words[0]).ok().filter(|_| open.is_empty()));
        } else {
            open.extend(words.iter().map(|word| count(word)).collect::<TextResult<Vec<u64>>>()?);
        }
        if kind.map_or(!ends, |kind| open.len() <= kind.nodes()) {
            *comma = !ends;
            return Ok(());
        }
        let mut open = std::mem::take(open);
        if let Some(kind) = kind {
            if before > 0 && !*comma && open.len() > kind.nodes() + 1 {
                check_count(kind, &open[..before])?;
            }
            // A beam may have a node more, for its direction.
            self.longer += usize::from(kind.shape.dimension > 1 && open.len() > kind.nodes() + 1);
            open.truncate(kind.nodes() + 1);
            check_count(kind, &open)?;
        }
        let [tag, nodes @ ..] = open.as_slice() else { return Err("an element has no number".into()) };
        let shifted = |tag: &u64| tag.saturating_add(self.scope.shift);
        let (tag, nodes) = (shifted(tag), nodes.iter().map(shifted).collect());
        *comma = false;
        if let Some(set) = set {
            entry(&mut self.model.element_sets, set, at)?.members.insert(tag);
        }
        let element = AbaqusElement { name: name.clone(), kind, nodes, at };
        if let Some(old) = self.model.elements.insert(tag, element) {
            return Err(format!("the element {tag} stands twice, also in {}", self.lines.show(old.at)));
        }
        Ok(())
    }

    fn members(&mut self, name: &str, nodes: bool, generate: bool, shift: u64, words: &[&str]) -> TextResult<()> {
        let sets = if nodes { &mut self.model.node_sets } else { &mut self.model.element_sets };
        let mut others = Vec::new();
        for word in words.iter().filter(|word| !word.is_empty() && !generate) {
            match word.parse::<u64>() {
                Ok(tag) => {
                    let set = sets.get_mut(name).ok_or("there is no such set")?;
                    set.members.insert(tag.saturating_add(shift));
                }
                Err(_) => others.push(known(sets, &self.scope.prefix, word)?),
            }
        }
        let set = sets.get_mut(name).ok_or("there is no such set")?;
        set.sets.extend(others);
        if generate {
            let [first, last, step] = generated(name, words, self.lines.bytes)?;
            set.ranges.insert([first.saturating_add(shift), last.saturating_add(shift), step]);
        }
        Ok(())
    }

    fn face(&mut self, name: &str, words: &[&str], line: &str) -> TextResult<()> {
        let label = words.get(1).map(|word| word.to_ascii_uppercase()).unwrap_or_default();
        let number = label.strip_prefix('S').and_then(|digits| digits.parse::<usize>().ok());
        let face = match (label.as_str(), number) {
            ("", _) => ElementFace::Free,
            ("SPOS" | "SNEG", _) => ElementFace::Itself,
            (_, Some(number @ 1..=6)) => ElementFace::Number(number - 1),
            _ => return Err(format!("`{line}` is no face of elements such as `12, S1`")),
        };
        let one = words[0].parse::<u64>().map(|tag| tag.saturating_add(self.scope.shift));
        let of_set = match one {
            Ok(_) => None,
            Err(_) => Some(known(&self.model.element_sets, &self.scope.prefix, words[0])?),
        };
        let surface = self.model.surfaces.get_mut(name).ok_or("there is no such surface")?;
        surface.faces.extend(one.ok().map(|tag| (tag, face)));
        surface.of_sets.extend(of_set.map(|set| (set, face)));
        Ok(())
    }

    /// Add other surfaces to a surface.
    fn unite(&mut self, name: &str, words: &[&str]) -> TextResult<()> {
        for word in words.iter().filter(|word| !word.is_empty()) {
            let other = normal(&format!("{}{}", self.scope.prefix, spelled(word)));
            let other = self.model.surfaces.get(&other).or_else(|| self.model.surfaces.get(&normal(&spelled(word))));
            let other = other.cloned().ok_or_else(|| format!("there is no surface `{word}`"))?;
            let surface = self.model.surfaces.get_mut(name).ok_or("there is no such surface")?;
            surface.faces.extend(other.faces);
            surface.of_sets.extend(other.of_sets);
        }
        Ok(())
    }

    /// Read a line of `*SYSTEM`: the origin and a point on the first axis; then a point in the plane of the first two
    /// axes.
    fn system(&mut self, points: &mut Vec<[f64; 3]>, numbers: &[f64]) -> TextResult<()> {
        if !matches!(numbers.len(), 3 | 6) {
            return Err("*SYSTEM has three numbers of each point: origin, first axis; then the second axis".into());
        }
        points.extend(numbers.chunks_exact(3).map(|point| [point[0], point[1], point[2]]));
        let frame = match points[..] {
            [origin] => Some(LocalAxes::at(origin)),
            [origin, first] => LocalAxes::about_third(origin, first),
            [origin, first, second] => LocalAxes::by_plane(origin, first, second),
            _ => return Err("*SYSTEM has three points at most".into()),
        };
        self.scope.frame = frame.ok_or("the points of *SYSTEM lie on a line")?;
        Ok(())
    }
}

/// Return the name of a set that a line refers to, within its part or instance or outside.
fn known(sets: &BTreeMap<String, Set>, prefix: &str, word: &str) -> TextResult<String> {
    let [own, outside] = [prefix, ""].map(|prefix| normal(&format!("{prefix}{}", spelled(word))));
    let found = [own, outside].into_iter().find(|name| sets.contains_key(name));
    found.ok_or_else(|| format!("there is no set `{word}`"))
}

/// Check the number of nodes behind the number of an element.
fn check_count(kind: AbaqusType, open: &[u64]) -> TextResult<()> {
    if open.len() == kind.nodes() + 1 {
        Ok(())
    } else {
        Err(format!("an element has {} nodes here, not {}", kind.nodes(), open.len() - 1))
    }
}
