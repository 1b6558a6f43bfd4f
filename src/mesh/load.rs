//! The way from the scene's mesh source to a mesh: by Gmsh, from the cache, or from a file.

use super::cache::{self, Workshop, file_name, folders};
use super::gmsh::{Gmsh, Task};
use super::msh::Maker;
use super::script::{Script, quoted};
use super::{Mesh, abaqus, foreign, msh};
use crate::error::{Error, Located, Place, Result};
use crate::file::{Digested, digest, digest_of_bytes, with_unix_lines};
use crate::interrupt::Interrupt;
use crate::problem::{Guard, MeshSource, Order};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// A mesh and its origin.
#[derive(Debug, Clone)]
pub struct Loaded<const D: usize> {
    /// The mesh.
    pub mesh: Mesh<D>,
    /// Where the mesh came from.
    pub origin: Origin,
    /// The `.msh` file that was read: the user's own, or the one in the cache. It is empty for arrays.
    pub file: PathBuf,
    /// SHA-256 of the contents of the file; empty for arrays.
    pub digest: String,
    /// The reason, in words, why the mesh cannot be taken from the cache, if there is one.
    pub unkept: Option<String>,
    /// What of the file was left out, or is not as the user may think.
    pub notes: Vec<String>,
}

/// The origin of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
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
            let mesh = super::arrays::mesh(arrays, order)?;
            Ok(Loaded {
                mesh,
                origin: Origin::File,
                file: PathBuf::new(),
                digest: String::new(),
                unkept: None,
                notes: Vec::new(),
            })
        }
    }?;
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
            let mesh = msh::read(path, Box::new(&mut source), Maker::User)?;
            Loaded {
                mesh,
                origin: Origin::File,
                file: path.clone(),
                digest: source.digest(),
                unkept: None,
                notes: Vec::new(),
            }
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
    let make = |_: &Path, made: &Path| std::fs::write(made, &bytes).map_err(|cause| Error::file(made, "write", &cause));
    let place = |cache: &Path| cache.join(&name);
    let loaded = made_anew(&name, &folders(), |file| read_converted(path, file), make, place)?;
    Ok(Loaded { origin: Origin::File, notes, ..loaded })
}

/// Return a mesh of another program, or of Gmsh's format 4.0, as Gmsh converts it.
fn converted<const D: usize>(file: &Located<PathBuf>, bytes: &[u8], interrupt: &Interrupt) -> Result<Loaded<D>> {
    let path = &file.value;
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    let name = file_name(("converted", ending, digest_of_bytes(bytes)), path);
    let parse = |file: &mut Digested<File>| read_converted(path, file);
    let guard = &Guard::default();
    let make = |gmsh: &Gmsh, work: &Path, made: &Path| {
        let script = &foreign::mesh(file, bytes, work)?;
        let task =
            Task { script, shown: path, set: &[], is_mesh: true, dimension: D, order: Order::P1, guard, interrupt };
        gmsh.run(&task, made, work)
    };
    kept((path, &name), None, &folders(), parse, make).map_err(|error| error.at(&file.place))
}

/// Read a mesh that was made from the file of another program.
fn read_converted<const D: usize>(path: &Path, file: &mut Digested<File>) -> Result<Mesh<D>> {
    msh::read(path, Box::new(file), Maker::Other).map_err(|error| match error.advice() {
        // Advice for scripts does not help with such a file.
        Some(advice) if !advice.contains("Physical") => error,
        _ => error.help(format!("see what Gmsh makes of it: gmsh {}", path.display())),
    })
}

/// Return the mesh `name` from the cache, which is in one of `folders`, or make it from `path`. Only the latter takes Gmsh.
///
/// `make` gets Gmsh, a folder to work in and the path of the file that it must write there. `unkept` gives a reason why the name does
/// not identify all that the mesh is made from; then the mesh is always made anew.
fn kept<const D: usize>(
    (path, name): (&Path, &str),
    unkept: Option<String>,
    folders: &[PathBuf],
    mut parse: impl FnMut(&mut Digested<File>) -> Result<Mesh<D>>,
    make: impl FnOnce(&Gmsh, &Path, &Path) -> Result<()>,
) -> Result<Loaded<D>> {
    let gmsh = Gmsh::find();
    let candidates = |folder: &PathBuf| match &gmsh {
        Some(gmsh) => vec![cache::made_by(folder, name, &gmsh.identity())],
        None => cache::made_by_any(folder, name),
    };
    // A file of the cache that cannot be read or is damaged counts as absent.
    for cached in folders.iter().filter(|_| unkept.is_none()).flat_map(candidates) {
        if let Some((mesh, digest)) = cache::open(&cached).and_then(|file| digested(file, &mut parse).ok()) {
            return Ok(Loaded { mesh, origin: Origin::Cache, file: cached, digest, unkept, notes: Vec::new() });
        }
    }
    let gmsh = gmsh.ok_or_else(|| unkept.iter().fold(Gmsh::missing(path), Error::because))?;
    let place = |cache: &Path| cache::made_by(cache, name, &gmsh.identity());
    let loaded = made_anew(name, folders, parse, |work, made| make(&gmsh, work, made), place)?;
    Ok(Loaded { unkept, ..loaded })
}

/// Return a mesh and the digest of its file.
fn digested<const D: usize>(
    file: File,
    parse: &mut impl FnMut(&mut Digested<File>) -> Result<Mesh<D>>,
) -> Result<(Mesh<D>, String)> {
    let mut source = Digested::new(file);
    parse(&mut source).map(|mesh| (mesh, source.digest()))
}

/// Make the mesh `name` and put it into the cache, at the `place` in its folder. `make` gets a folder to work in and the path of the
/// file that it must write there.
fn made_anew<const D: usize>(
    name: &str,
    folders: &[PathBuf],
    mut parse: impl FnMut(&mut Digested<File>) -> Result<Mesh<D>>,
    make: impl FnOnce(&Path, &Path) -> Result<()>,
    place: impl FnOnce(&Path) -> PathBuf,
) -> Result<Loaded<D>> {
    let workshop = Workshop::open(folders)?;
    let made = workshop.path().join(name);
    let open = || File::open(&made).map_err(|cause| Error::file(&made, "read", &cause));
    let mesh = make(workshop.path(), &made).and_then(|()| digested(open()?, &mut parse));
    // A file that is cut short because the disk is full is not the script's fault.
    let (mesh, digest) = mesh.map_err(|error| workshop.blame(error))?;
    let file = workshop.publish(&made, place)?;
    Ok(Loaded { mesh, origin: Origin::Gmsh, file, digest, unkept: None, notes: Vec::new() })
}

/// Return a digest of all that the mesh of a scene is made from: the contents of its files, numbers, and Gmsh. Return `None` if
/// the mesh depends on more, or if a file cannot be read.
pub fn made_from(source: &MeshSource, dimension: usize, order: Order) -> Option<String> {
    match source {
        MeshSource::Geo { file, set, sizes, guard, .. } => {
            let script = script(&file.value).ok()?;
            let known = script.inputs.unknown.is_none();
            let gmsh = Gmsh::find().map(|gmsh| gmsh.identity()).unwrap_or_default();
            let name = key(&file.value, &script, dimension, order, (set, sizes.as_deref(), guard));
            known.then(|| format!("{name} {gmsh}"))
        }
        MeshSource::Msh { file } => {
            let bytes = crate::file::read(&file.value).ok()?;
            if foreign::is_input_file(&file.value) {
                // Other files may be included.
                let converted = abaqus::convert(&file.value, &with_unix_lines(bytes), dimension).ok()?;
                return Some(digest_of_bytes(&converted.mesh));
            }
            match foreign::is_mesh(&file.value, &bytes) {
                true => Some(digest(&(Gmsh::find()?.identity(), digest_of_bytes(&bytes)))),
                false => Some(digest_of_bytes(&bytes)),
            }
        }
        MeshSource::Arrays(_) => None,
    }
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

/// Mesh a script on one rank.
#[cfg(test)]
pub(super) fn from_script<const D: usize>(
    file: &Located<PathBuf>,
    numbers: (&[(String, f64)], &[Place]),
    sizes: Option<&str>,
    order: Order,
    guard: (&Guard, &Interrupt),
    folders: &[PathBuf],
) -> Result<Loaded<D>> {
    meshed(file, numbers, sizes, order, guard, folders)
}

/// Mesh a script, with the cache in one of `folders`. `set` holds the numbers to set in it. `places` holds their places in the
/// scene, where these differ from that of the script.
fn meshed<const D: usize>(
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
                Some(super::sizes::script(&Located::new(own.clone(), file.place.clone()), &script, view, work)?)
            }
            None => ended(&own, &script, work)?,
        };
        let script = sized.as_deref().unwrap_or(&own);
        gmsh.run(&Task { script, shown: path, set, is_mesh: false, dimension: D, order, guard, interrupt }, made, work)
    };
    kept((path, &name), unkept, folders, |file| checked(path, file, order), make)
}

/// Return the path of a script in the folder `work` that includes the one at `path`, or `None` if the last line of that script
/// is ended.
fn ended(path: &Path, script: &Script, work: &Path) -> Result<Option<PathBuf>> {
    if script.is_ended() {
        return Ok(None);
    }
    let whole = std::path::absolute(path).map_err(|cause| Error::file(path, "find", &cause))?;
    let made = work.join("ended.geo");
    let text = format!("Include {};\n", quoted(&whole)?);
    std::fs::write(&made, text).map_err(|cause| Error::file(&made, "write", &cause)).map(|()| Some(made))
}

/// Keep the final sizes of an adaptation in the cache. `purpose` identifies all that the mesh was made for, scene and error.
///
/// # Errors
/// The cache cannot be written.
pub fn keep_final(purpose: &str, sizes: &str) -> Result<()> {
    let workshop = Workshop::open(&folders())?;
    let name = final_name(purpose);
    let made = workshop.path().join(&name);
    std::fs::write(&made, sizes).map_err(|cause| Error::file(&made, "write", &cause))?;
    workshop.publish(&made, |cache| cache.join(&name)).map(|_| ())
}

/// Return the final sizes of an earlier adaptation for the same `purpose`.
pub fn recall_final(purpose: &str) -> Option<String> {
    let name = final_name(purpose);
    folders().iter().find_map(|folder| std::io::read_to_string(cache::open(&folder.join(&name))?).ok())
}

fn final_name(purpose: &str) -> String {
    file_name(purpose, Path::new("sizes")) + ".pos"
}

/// Return the mesh in a file that Gmsh made from a script, provided that it has the requested order.
fn checked<const D: usize>(path: &Path, file: &mut Digested<File>, order: Order) -> Result<Mesh<D>> {
    let mesh: Mesh<D> = msh::read(path, Box::new(file), Maker::Script)?;
    if mesh.order == order {
        return Ok(mesh);
    }
    let error = Error::mesh(path, None, "Gmsh made a mesh of another order than the scene asks for");
    Err(error.help("remove `Mesh.ElementOrder` and `SetOrder` from the script"))
}
