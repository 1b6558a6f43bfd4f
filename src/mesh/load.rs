//! The way from the scene's mesh source to a mesh: by Gmsh, from the cache, from a file, or from arrays.

use super::cache::{self, Workshop, file_name, folders, write};
use super::gmsh::{Gmsh, MeshingTask};
use super::msh::{self, MeshProducer};
use super::script::{Script, quoted};
use super::{Group, Mesh, abaqus, foreign, groups, simplex};
use crate::error::{Error, Located, Place, Result};
use crate::file::{Digested, digest_of_bytes, with_unix_lines};
use crate::interrupt::Interrupt;
use crate::problem::body::plain;
use crate::problem::{GroupArrays, Guard, MeshArrays, MeshSource, Order};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// A mesh and its origin.
#[derive(Debug, Clone)]
pub struct Loaded<const D: usize> {
    pub mesh: Mesh<D>,
    /// Where the mesh came from.
    pub origin: MeshOrigin,
    /// The `.msh` file that was read: the user's own, or the one in the cache. It is empty for arrays.
    pub file: PathBuf,
    /// SHA-256 of the contents of the file; empty for arrays.
    pub digest: String,
    /// The reason, in words, why the mesh cannot be taken from the cache, if there is one.
    pub unkept: Option<String>,
    /// What of the file was left out, or is not as the user may think.
    pub notes: Vec<String>,
}

impl<const D: usize> Loaded<D> {
    fn new(mesh: Mesh<D>, origin: MeshOrigin, file: PathBuf, digest: String) -> Self {
        Self { mesh, origin, file, digest, unkept: None, notes: Vec::new() }
    }
}

/// The origin of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshOrigin {
    /// The `.msh` file that the scene names, or arrays.
    File,
    /// The cache: Gmsh meshed the same script with the same numbers before.
    Cache,
    /// Gmsh, in this run.
    Gmsh,
}

/// Load the mesh of a scene for displacements of an order, unless a signal ends it.
///
/// Gmsh meshes a `.geo` script with that order, unless the cache has the result. A `.msh` file of order 2 serves order 1
/// without its mid-edge points. Folded quadratic cells become straight ([`Mesh::straightened`]).
///
/// # Errors
/// A file cannot be read, or the script does not take a number. Gmsh is missing or fails. The mesh is not one of named
/// simplices in `D` dimensions (see [`parse`](super::parse)), or its order is too low. A signal arrives.
pub fn load<const D: usize>(source: &MeshSource, order: Order, interrupt: &Interrupt) -> Result<Loaded<D>> {
    let mut loaded = match source {
        MeshSource::Geo { file, set, places, sizes, guard } => {
            if let (true, Some(place)) = (foreign::is_shape(&file.value), places.first()) {
                return Err(Error::scene(place, "numbers for a shape of another program, which has none")
                    .help("give sizes of elements by mesh = { geo = \"...\", size = 0.1 }, or a script (.geo) that merges the file"));
            }
            meshed(file, (set, places), sizes.as_deref(), order, (guard, interrupt), &folders())
        }
        MeshSource::Msh { file } => from_file(file, order, interrupt),
        MeshSource::Arrays(arrays) => {
            let mesh = of_arrays(arrays, order)?;
            Ok(Loaded::new(mesh, MeshOrigin::File, PathBuf::new(), String::new()))
        }
    }?;
    loaded.mesh.find_uncertainty();
    loaded.mesh.straighten();
    Ok(loaded)
}

/// Number of bytes at the start of a file that show its kind.
const START: u64 = 1000;

fn from_file<const D: usize>(file: &Located<PathBuf>, order: Order, interrupt: &Interrupt) -> Result<Loaded<D>> {
    let path = &file.value;
    let mut source = crate::file::open(path).map_err(|error| error.at(&file.place))?;
    let mut start = Vec::new();
    let read = source.by_ref().take(START).read_to_end(&mut start);
    read.map_err(|cause| Error::file(path, "read", &cause).at(&file.place))?;
    refuse_old_lines(path, &start)?;
    let mut loaded = match foreign::is_mesh(path, &start) {
        true => {
            let bytes = crate::file::read(path).map_err(|error| error.at(&file.place))?;
            let bytes = with_unix_lines(bytes);
            match foreign::is_input_file(path) {
                true => input_file(path, &bytes).map_err(|error| error.at(&file.place))?,
                false => converted(file, &bytes, interrupt)?,
            }
        }
        false => {
            let mut source = Digested::new(source);
            let mesh = msh::read(path, Box::new(&mut source), MeshProducer::User)?;
            Loaded::new(mesh, MeshOrigin::File, path.clone(), source.digest())
        }
    };
    loaded.mesh = match (loaded.mesh.order, order) {
        (Order::P2, Order::P1) => loaded.mesh.lower_order(),
        (Order::P1, Order::P2) => {
            let help = format!(
                "set `order = 1`, or save it anew: gmsh {} -order 2 -{D} -format msh41 -o new.msh",
                path.display()
            );
            let error = Error::mesh(path, None, "the mesh is of order 1, the scene asks for order 2");
            return Err(error.at(&file.place).help(help));
        }
        _ => loaded.mesh,
    };
    Ok(loaded)
}

/// Refuse text of Gmsh whose line ends Gmsh does not read.
fn refuse_old_lines(path: &Path, start: &[u8]) -> Result<()> {
    let end = start.iter().position(|byte| matches!(byte, b'\r' | b'\n'));
    let is_old_mac = end.is_some_and(|at| start[at] == b'\r' && start.get(at + 1) != Some(&b'\n'));
    match start.starts_with(b"$") && is_old_mac && !foreign::is_mesh(path, start) {
        true => Err(Error::mesh(path, None, "its lines end with carriage returns alone, as on old Macs")
            .help(format!("give them the ends of today: tr '\\r' '\\n' < {} > new.msh", path.display()))),
        false => Ok(()),
    }
}

/// Return the mesh of an input file of Abaqus or CalculiX. The cache keeps it as a mesh file for `winkler mesh -o`; it is made anew
/// in each run.
fn input_file<const D: usize>(path: &Path, bytes: &[u8]) -> Result<Loaded<D>> {
    let abaqus::Converted { mesh: bytes, notes } = abaqus::convert(path, bytes, D)?;
    let name = file_name(("input file", digest_of_bytes(&bytes)), path);
    let loaded = made_anew((path, &name), None, &folders(), |_, made| write(made, &bytes))?;
    Ok(Loaded { origin: MeshOrigin::File, notes, ..loaded })
}

/// Return a mesh of another program, or of Gmsh's format 4.0, as Gmsh converts it.
fn converted<const D: usize>(file: &Located<PathBuf>, bytes: &[u8], interrupt: &Interrupt) -> Result<Loaded<D>> {
    let path = &file.value;
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    let name = file_name(("converted", ending, digest_of_bytes(bytes)), path);
    let guard = &Guard::default();
    let make = |gmsh: &Gmsh, work: &Path, made: &Path| {
        let script = &foreign::mesh(file, bytes, work)?;
        let task = MeshingTask {
            script,
            shown: path,
            set: &[],
            is_mesh: true,
            dimension: D,
            order: Order::P1,
            guard,
            interrupt,
        };
        gmsh.run(&task, made, work)
    };
    kept((path, &name), None, None, &folders(), make).map_err(|error| error.at(&file.place))
}

/// Read a mesh that was made from the file at `path`, and return it with the digest of its file. The mesh of a script must have the
/// requested `order`; that of another program has none.
fn read_made<const D: usize>(path: &Path, order: Option<Order>, file: File) -> Result<(Mesh<D>, String)> {
    let mut source = Digested::new(file);
    let maker = if order.is_some() { MeshProducer::Script } else { MeshProducer::Other };
    let mesh: Mesh<D> = msh::read(path, Box::new(&mut source), maker).map_err(|error| match error.advice() {
        // Advice for scripts does not help with a file of another program.
        advice if order.is_none() && advice.is_none_or(|advice| advice.contains("Physical")) => {
            error.help(format!("see what Gmsh makes of it: gmsh {}", path.display()))
        }
        _ => error,
    })?;
    if order.is_some_and(|order| mesh.order != order) {
        let error = Error::mesh(path, None, "Gmsh made a mesh of another order than the scene asks for");
        return Err(error.help("remove `Mesh.ElementOrder` and `SetOrder` from the script"));
    }
    Ok((mesh, source.digest()))
}

/// Return the mesh `name` from the cache, which is in one of `folders`, or make it from `path`. Only the latter takes Gmsh.
///
/// `make` gets Gmsh, a folder to work in and the path of the file that it must write there. `unkept` gives a reason why the name does
/// not identify all that the mesh is made from; then the mesh is always made anew.
fn kept<const D: usize>(
    (path, name): (&Path, &str),
    order: Option<Order>,
    unkept: Option<String>,
    folders: &[PathBuf],
    make: impl FnOnce(&Gmsh, &Path, &Path) -> Result<()>,
) -> Result<Loaded<D>> {
    let gmsh = Gmsh::find();
    let candidates = |folder: &PathBuf| match &gmsh {
        Some(gmsh) => vec![folder.join(cache::made_by(name, &gmsh.identity()))],
        None => cache::made_by_any(folder, name),
    };
    // A file of the cache that cannot be read or is damaged counts as absent.
    for cached in folders.iter().filter(|_| unkept.is_none()).flat_map(candidates) {
        if let Some((mesh, digest)) = cache::open(&cached).and_then(|file| read_made(path, order, file).ok()) {
            return Ok(Loaded::new(mesh, MeshOrigin::Cache, cached, digest));
        }
    }
    let gmsh = gmsh.ok_or_else(|| unkept.iter().fold(Gmsh::missing(path), Error::because))?;
    let name = cache::made_by(name, &gmsh.identity());
    let loaded = made_anew((path, &name), order, folders, |work, made| make(&gmsh, work, made))?;
    Ok(Loaded { unkept, ..loaded })
}

/// Make the mesh `name` and put it into the cache. `make` gets a folder to work in and the path of the file that it must write there.
fn made_anew<const D: usize>(
    (path, name): (&Path, &str),
    order: Option<Order>,
    folders: &[PathBuf],
    make: impl FnOnce(&Path, &Path) -> Result<()>,
) -> Result<Loaded<D>> {
    let workshop = Workshop::open(folders)?;
    let made = workshop.path().join(name);
    let open = || File::open(&made).map_err(|cause| Error::file(&made, "read", &cause));
    let mesh = make(workshop.path(), &made).and_then(|()| read_made(path, order, open()?));
    // A file that is cut short because the disk is full is not the script's fault.
    let (mesh, digest) = mesh.map_err(|error| workshop.blame(error))?;
    let file = workshop.publish(&made, name)?;
    Ok(Loaded::new(mesh, MeshOrigin::Gmsh, file, digest))
}

/// Read the script, or the shape of another program.
fn script(path: &Path) -> Result<Script> {
    if foreign::is_shape(path) { Script::of_shape(path) } else { Script::read(path) }
}

/// Return the name in the cache of the mesh of a script, with the numbers that are set in it, the sizes to follow, and the
/// limits.
fn key(
    path: &Path,
    script: &Script,
    dimension: usize,
    order: Order,
    (set, sizes, guard): (&[(String, f64)], Option<&str>, &Guard),
) -> String {
    // The algorithm depends on whether a number of threads is given, not on the number.
    let asked = (dimension, order.degree(), guard.threads.is_some(), guard.size, set, sizes);
    let files: Vec<String> = script.files.iter().map(|bytes| digest_of_bytes(bytes)).collect();
    file_name((asked, files, script.is_ended(), script.inputs.environment()), path)
}

/// Mesh a script, with the cache in one of `folders`. `set` holds the numbers to set in it. `places` holds their places in the
/// scene, where these differ from that of the script.
pub(super) fn meshed<const D: usize>(
    file: &Located<PathBuf>,
    (set, places): (&[(String, f64)], &[Place]),
    sizes: Option<&str>,
    order: Order,
    (guard, interrupt): (&Guard, &Interrupt),
    folders: &[PathBuf],
) -> Result<Loaded<D>> {
    let path = &file.value;
    let is_shape = foreign::is_shape(path);
    let script = script(path).map_err(|error| error.at(&file.place))?;
    for (number, (name, _)) in set.iter().enumerate() {
        script.check(name, path, places.get(number).unwrap_or(&file.place))?;
    }
    if !guard.trusted {
        script.judge(file)?;
    }
    let name = key(path, &script, D, order, (set, sizes, guard));
    let unkept = script.inputs.unknown.as_ref();
    let unkept = unkept.map(|word| format!("{} is meshed anew in each run, since it uses `{word}`", path.display()));
    let make = |gmsh: &Gmsh, work: &Path, made: &Path| {
        let own = match is_shape {
            true => foreign::script(path, &script.files[0], D, guard.size, work)?,
            false => path.clone(),
        };
        let sized = match sizes {
            Some(view) => {
                Some(super::script::script(&Located::new(own.clone(), file.place.clone()), &script, view, work)?)
            }
            None => ended(&own, &script, work)?,
        };
        let script = sized.as_deref().unwrap_or(&own);
        gmsh.run(
            &MeshingTask { script, shown: path, set, is_mesh: false, dimension: D, order, guard, interrupt },
            made,
            work,
        )
    };
    kept((path, &name), Some(order), unkept, folders, make)
}

/// Return the path of a script in the folder `work` that includes the one at `path`, or `None` if the last line of that script
/// is ended.
fn ended(path: &Path, script: &Script, work: &Path) -> Result<Option<PathBuf>> {
    if script.is_ended() {
        return Ok(None);
    }
    let whole = std::path::absolute(path).map_err(|cause| Error::file(path, "find", &cause))?;
    let made = work.join("ended.geo");
    write(&made, format!("Include {};\n", quoted(&whole)?)).map(|()| Some(made))
}

/// Name in messages, where meshes from files have their path.
const NAME: &str = "mesh arrays";

/// Return the mesh of these arrays, with cells turned to positive volume. Points keep their numbers.
///
/// # Errors
/// A coordinate is not finite, or a point is off the plane if `D` is 2. A group has no name or no simplices, or two groups have
/// the same name. A group has numbers of points that do not exist, simplices without extent, or a dimension above `D`. `order`
/// is above that of the arrays.
fn of_arrays<const D: usize>(arrays: &MeshArrays, order: Order) -> Result<Mesh<D>> {
    let MeshArrays { points, order: own, groups } = arrays;
    if *own < order {
        return Err(
            refuse_arrays("the mesh is of order 1, the scene asks for order 2").help("give mid-edge points, too")
        );
    }
    let largest = points.iter().flatten().fold(0.0_f64, |size, x| size.max(x.abs()));
    if let Some(number) = points.iter().position(|x| x.iter().any(|x| !x.is_finite())) {
        return Err(refuse_arrays(format!("point {number} has the coordinates {:?}", points[number])));
    }
    if let Some(number) = points.iter().position(|x| D == 2 && x[2].abs() > 1e-12 * largest) {
        let message = format!("point {number} has z = {}, but the scene has dimension 2", points[number][2]);
        return Err(refuse_arrays(message).help("draw plane bodies in the plane z = 0"));
    }
    let groups = groups.iter().map(|group| group_of::<D>(group, points, *own)).collect::<Result<Vec<_>>>()?;
    if let Some(twice) = groups::twice(&groups) {
        return Err(refuse_arrays(format!("two groups are called `{twice}`")));
    }
    let points = points.iter().map(|x| std::array::from_fn(|c| x[c])).collect();
    Ok(Mesh::new(NAME.into(), points, *own, groups.into()))
}

fn group_of<const D: usize>(arrays: &GroupArrays, points: &[[f64; 3]], order: Order) -> Result<Group> {
    let GroupArrays { name, dimension, connectivity } = arrays;
    let (corners, edges) = (dimension + 1, dimension * (dimension + 1) / 2);
    let stride = if order == Order::P1 { corners } else { corners + edges };
    let refuse = |what: String| refuse_arrays(format!("group `{name}` {what}"));
    if name.is_empty() || *dimension > D {
        return Err(refuse(format!("is of dimension {dimension}"))
            .help(format!("groups have names, and dimensions from 0, points, to {D}, cells")));
    }
    if connectivity.is_empty() || connectivity.len() % stride != 0 {
        let count = connectivity.len();
        return Err(refuse(format!("has {count} numbers of points, its simplices have {stride} each"))
            .help("give one number a corner, and for order 2 one a mid-edge point, too"));
    }
    if let Some(number) = connectivity.iter().find(|number| **number as usize >= points.len()) {
        return Err(
            refuse(format!("has point {number}")).help(format!("there are {} points, numbered from 0", points.len()))
        );
    }
    let mut connectivity = connectivity.clone();
    for (index, simplex) in connectivity.chunks_exact_mut(stride).enumerate() {
        if !simplex::turn(simplex, points, *dimension, D) {
            return Err(refuse(format!("has no extent in its simplex {index}, of the points {simplex:?}")));
        }
    }
    let tags = (0..(connectivity.len() / stride) as u64).collect();
    let name = if *dimension == D { plain(name) } else { name.clone() };
    Ok(Group { name, dimension: *dimension, stride, connectivity, tags })
}

fn refuse_arrays(message: impl Into<String>) -> Error {
    Error::mesh(Path::new(NAME), None, message)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Return two triangles of the unit square, with the second one inverted, and its lower side.
    fn square() -> MeshArrays {
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [9.0, 9.0, 0.0]];
        MeshArrays::new(points).group("all", 2, vec![0, 1, 2, 0, 3, 2]).group("low", 1, vec![1, 0])
    }

    #[test]
    fn cells_are_turned_and_points_keep_their_numbers() {
        let mesh = of_arrays::<2>(&square(), Order::P1).expect("a mesh");
        assert_eq!(mesh.group("all").expect("cells").connectivity, [0, 1, 2, 0, 2, 3]);
        assert_eq!(mesh.group("low").expect("a side").connectivity, [1, 0]);
        assert_eq!(mesh.points.len(), 5);
    }

    #[test]
    fn what_is_no_mesh_is_refused() {
        let bad = |change: fn(&mut MeshArrays), order: Order, words: &str| {
            let mut arrays = square();
            change(&mut arrays);
            let error = of_arrays::<2>(&arrays, order).expect_err(words);
            assert!(error.to_string().contains(words), "{error}");
        };
        bad(|a| a.points[2][0] = f64::NAN, Order::P1, "point 2 has the coordinates [NaN");
        bad(|a| a.points[3][2] = 1e-3, Order::P1, "point 3 has z = 0.001");
        bad(|a| a.groups[1].name = "all".into(), Order::P1, "two groups are called `all`");
        bad(|a| a.groups[1].name.clear(), Order::P1, "groups have names");
        bad(|a| a.groups[0].dimension = 3, Order::P1, "`all` is of dimension 3");
        bad(|a| a.groups[0].connectivity.clear(), Order::P1, "0 numbers of points");
        bad(|a| a.groups[0].connectivity.truncate(5), Order::P1, "5 numbers of points, its simplices have 3");
        bad(|a| a.groups[0].connectivity[4] = 7, Order::P1, "has point 7");
        bad(|a| a.groups[0].connectivity[1] = 0, Order::P1, "simplex 0, of the points [0, 0, 2]");
        bad(|_| {}, Order::P2, "the scene asks for order 2");
        bad(|a| a.order = Order::P2, Order::P2, "simplices have 3 each");
    }
}
