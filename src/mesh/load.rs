//! The way from the scene's mesh source to a mesh: by Gmsh, from the cache, from a file, or from arrays.

use super::builder::MeshProducer;
use super::cache::{self, Cache};
use super::gmsh::{Algorithm, Gmsh, MeshingTask, is_of_hxt};
use super::msh;
use super::script::{self, Script, quoted};
use super::{Mesh, abaqus, arrays, digits, foreign, msh2};
use crate::error::{Error, Located, Result};
use crate::file::{Digested, digest, digest_of_bytes, write};
use crate::interrupt::Interrupt;
use crate::problem::mesh::{AdaptedMesh, is_shape};
use crate::problem::{GmshSource, Guard, MeshSource, Order};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

/// A mesh and its origin.
#[derive(Debug, Clone)]
pub struct Loaded<const D: usize> {
    pub mesh: Mesh<D>,
    /// Where the mesh came from.
    pub origin: MeshOrigin,
    /// The file that was read: the user's own, or the one in the cache. It is empty for arrays.
    pub file: PathBuf,
    /// SHA-256 of the contents of the file; empty for arrays.
    pub digest: String,
    /// Whether Gmsh was to take its default algorithm for tetrahedra instead of HXT.
    pub without_hxt: bool,
    /// What of the file was left out, or is not as the user may think.
    pub notes: Vec<String>,
}

/// The origin of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshOrigin {
    /// The mesh file that the scene names, or arrays.
    File,
    /// The cache: Gmsh meshed the same script with the same numbers before.
    Cache,
    /// Gmsh, in this run.
    Gmsh,
}

/// Load the mesh of a scene for bodies of these orders, unless a signal ends it. Bodies of order `None` get the
/// [`Mesh::default_order`].
///
/// Gmsh meshes a `.geo` script with the highest order, unless the cache has the result. A mesh file of another order
/// serves, too: without the points inside its edges for order 1, and with straight edges if its own order is 1. Folded
/// cells become straight ([`Mesh::straightened`]).
///
/// # Errors
/// A file cannot be read, or the script does not take a number. Gmsh is missing or fails. The mesh is not one of named
/// simplices in `D` dimensions (see [`parse`](super::parse)), or its order is too low. A signal arrives.
pub fn load<const D: usize>(source: &MeshSource, orders: &[Option<Order>], interrupt: &Interrupt) -> Result<Loaded<D>> {
    let highest = |own: Order| orders.iter().map(|order| order.unwrap_or(own)).max().unwrap_or(own);
    let mut loaded = match source {
        MeshSource::Geo(source) => {
            if let (true, Some((name, _))) = (is_shape(&source.file), source.set.first()) {
                return Err(Error::scene(&name.place, "numbers for a shape of another program, which has none")
                    .help("give sizes of elements by mesh = { geo = \"...\", size = 0.1 }, or a script (.geo) that merges the file"));
            }
            let order = highest(Order::default());
            let mut made: Loaded<D> = Meshing { source, order, interrupt }.mesh(&Cache::of_user()?)?;
            made.mesh.default_order = Order::default();
            Ok(made)
        }
        MeshSource::Msh { file } => from_file(file, highest, interrupt),
        MeshSource::Arrays(arrays) => Ok(Loaded {
            mesh: arrays::mesh(arrays, highest(arrays.order))?,
            origin: MeshOrigin::File,
            file: PathBuf::new(),
            digest: String::new(),
            without_hxt: false,
            notes: Vec::new(),
        }),
    }?;
    loaded.mesh.uncertainty = digits::uncertainty(&loaded.mesh.points);
    loaded.mesh.straighten();
    Ok(loaded)
}

/// Return the files that a mesh is read from or made of, as far as they are there.
pub fn files(source: &MeshSource) -> Vec<PathBuf> {
    match source {
        MeshSource::Geo(GmshSource { file, .. }) => {
            Script::read(&file.value).map_or_else(|_| vec![file.value.clone()], |script| script.paths)
        }
        MeshSource::Msh { file } => vec![file.value.clone()],
        MeshSource::Arrays(_) => Vec::new(),
    }
}

/// Number of bytes at the start of a file that show its kind.
const START: u64 = 1000;

/// Read a mesh file. Its mesh becomes one of the order that `highest` returns for the order of the file.
fn from_file<const D: usize>(
    file: &Located<PathBuf>,
    highest: impl Fn(Order) -> Order,
    interrupt: &Interrupt,
) -> Result<Loaded<D>> {
    let path = &file.value;
    let mut start = Vec::new();
    let source = crate::file::open(path).map_err(|error| error.at(&file.place))?;
    let read = source.take(START).read_to_end(&mut start);
    read.map_err(|cause| Error::file(path, "read", &cause).at(&file.place))?;
    let whole = || crate::file::read(path).map_err(|error| error.at(&file.place));
    let mut loaded = match foreign::is_mesh(path, &start) {
        true if foreign::is_input_file(path) => {
            let (mesh, notes) = abaqus::read::<D>(path, &whole()?).map_err(|error| error.at(&file.place))?;
            // files that the file includes count, too
            let digest = digest(&(mesh.points.as_flattened(), &mesh.groups[..]));
            Loaded { mesh, origin: MeshOrigin::File, file: path.clone(), digest, without_hxt: false, notes }
        }
        true => converted(file, &whole()?, interrupt)?,
        false => read_file(path, path, MeshProducer::User, MeshOrigin::File)?,
    };
    loaded.mesh = match (loaded.mesh.order, highest(loaded.mesh.order)) {
        (own, Order::P1) if own > Order::P1 => loaded.mesh.lower_order(),
        (Order::P1, order) if order > Order::P1 => loaded.mesh.higher_order(Order::P2),
        _ => loaded.mesh,
    };
    Ok(loaded)
}

/// Move vertices of the boundaries of a mesh in the plane, in its file. `shown` is the file that the user named.
fn move_vertices(shown: &Path, file: &Path, places: &[[f64; 3]]) -> Result<()> {
    let mut mesh: Mesh<2> = read_file(shown, file, MeshProducer::Script, MeshOrigin::Gmsh)?.mesh;
    mesh.move_vertices_to(places);
    write(file, msh2::written(&mesh))
}

/// Read a `.msh` file. `shown` is the file that the user named.
fn read_file<const D: usize>(shown: &Path, file: &Path, maker: MeshProducer, origin: MeshOrigin) -> Result<Loaded<D>> {
    let mut source = Digested::new(File::open(file).map_err(|cause| Error::file(file, "read", &cause))?);
    let mesh = msh::read(shown, &mut BufReader::with_capacity(WINDOW, &mut source), maker)?;
    let digest = source.digest();
    Ok(Loaded { mesh, origin, file: file.to_owned(), digest, without_hxt: false, notes: Vec::new() })
}

/// Bytes that are read at a time.
const WINDOW: usize = 1 << 18;

/// Return the contents of a mesh file as a `.msh` file: those of a deck of Abaqus or CalculiX are converted.
///
/// # Errors
/// The file cannot be read, or is no mesh.
pub fn as_msh<const D: usize>(file: &Path) -> Result<Vec<u8>> {
    let bytes = crate::file::read(file)?;
    if foreign::is_input_file(file) {
        let (mesh, _) = abaqus::read::<D>(file, &bytes)?;
        Ok(msh2::written(&mesh).into_bytes())
    } else {
        Ok(bytes)
    }
}

/// Return a mesh of another program, or of Gmsh's format 4.0, as Gmsh converts it.
fn converted<const D: usize>(file: &Located<PathBuf>, bytes: &[u8], interrupt: &Interrupt) -> Result<Loaded<D>> {
    let path = &file.value;
    let name = cache::name(
        ("converted", path.extension().unwrap_or_default().to_string_lossy(), digest_of_bytes(bytes)),
        path,
    );
    let wanted = Wanted { path, name, order: None, is_kept: true };
    let loaded = wanted.find_or_make(&Cache::of_user()?, |gmsh, work, made| {
        let script = &foreign::copied(file, bytes, work)?;
        let guard = &Guard::default();
        let task = MeshingTask {
            script,
            shown: path,
            set: &[],
            is_mesh: true,
            dimension: D,
            order: Order::P1,
            algorithm: Algorithm::Default,
            guard,
            interrupt,
        };
        gmsh.run(&task, made, work)
    });
    loaded.map_err(|error| error.at(&file.place))
}

/// A mesh that Gmsh makes of a file, unless the cache has it.
struct Wanted<'a> {
    /// The file that the user named.
    path: &'a Path,
    /// What its name in the cache begins with.
    name: String,
    /// The order that the mesh of a script must have; the mesh of another program has none.
    order: Option<Order>,
    /// Whether the name identifies all that the mesh is made from. Otherwise it is always made anew.
    is_kept: bool,
}

impl Wanted<'_> {
    /// Return the mesh from the cache, or make it. `make` gets Gmsh, a folder to work in and the path of the file that
    /// it must write there.
    fn find_or_make<const D: usize>(
        &self,
        cache: &Cache,
        make: impl FnOnce(&Gmsh, &Path, &Path) -> Result<()>,
    ) -> Result<Loaded<D>> {
        self.find(cache).map_or_else(|| self.make(&Gmsh::found(self.path)?, cache, make), Ok)
    }

    /// Make the mesh.
    fn make<const D: usize>(
        &self,
        gmsh: &Gmsh,
        cache: &Cache,
        make: impl FnOnce(&Gmsh, &Path, &Path) -> Result<()>,
    ) -> Result<Loaded<D>> {
        let name = self.made_by(gmsh);
        let loaded = cache.make(&name, |work, made| {
            make(gmsh, work, made)?;
            self.read(made, MeshOrigin::Gmsh)
        })?;
        Ok(Loaded { file: cache.file(&name), ..loaded })
    }

    /// Return the mesh from the cache, if it is there. A file of the cache that cannot be read or is damaged counts as
    /// absent.
    fn find<const D: usize>(&self, cache: &Cache) -> Option<Loaded<D>> {
        let known = match Gmsh::find() {
            Some(gmsh) => vec![cache.file(&self.made_by(&gmsh))],
            None => cache.all(&self.name),
        };
        known.iter().filter(|_| self.is_kept).find_map(|file| self.read(file, MeshOrigin::Cache).ok())
    }

    /// Return the name in the cache of the mesh that this Gmsh makes.
    fn made_by(&self, gmsh: &Gmsh) -> String {
        format!("{}{:.16}.msh", self.name, digest(&gmsh.identity()))
    }

    /// Read a file that was made.
    fn read<const D: usize>(&self, file: &Path, origin: MeshOrigin) -> Result<Loaded<D>> {
        let maker = if self.order.is_some() { MeshProducer::Script } else { MeshProducer::Other };
        let loaded: Loaded<D> = read_file(self.path, file, maker, origin).map_err(|error| match error.advice() {
            // Advice for scripts does not help with a file of another program.
            advice if self.order.is_none() && advice.is_none_or(|advice| advice.contains("Physical")) => {
                error.help(format!("see what Gmsh makes of it: gmsh {}", self.path.display()))
            }
            Some(advice) if is_shape(self.path) && advice.contains("Physical") => {
                let [whole, rim] = if D == 3 { ["solid", "faces"] } else { ["face", "edges"] };
                error.help(format!(
                    "the file has {rim} without a {whole}: export the bodies as {whole}s, or merge it in a script (.geo) that makes them"
                ))
            }
            _ => error,
        })?;
        if self.order.is_some_and(|order| loaded.mesh.order != order) {
            let error = Error::mesh(self.path, None, "Gmsh made a mesh of another order than the scene asks for");
            return Err(error.help("remove `Mesh.ElementOrder` and `SetOrder` from the script"));
        }
        Ok(loaded)
    }
}

/// A script or shape to mesh.
pub(super) struct Meshing<'a> {
    pub source: &'a GmshSource,
    pub order: Order,
    pub interrupt: &'a Interrupt,
}

impl Meshing<'_> {
    /// Return the mesh from a cache, or by Gmsh. Tetrahedra are by HXT if it makes the same mesh in every run or the
    /// scene gives it threads, and if it does not fail.
    pub fn mesh<const D: usize>(&self, cache: &Cache) -> Result<Loaded<D>> {
        let GmshSource { file, set, guard, .. } = self.source;
        let script = Script::read(&file.value).map_err(|error| error.at(&file.place))?;
        set.iter().try_for_each(|(name, _)| script.check(name, &file.value))?;
        let digests: Vec<String> = script.files.iter().map(|bytes| digest_of_bytes(bytes)).collect();
        let wanted = |algorithm| self.wanted::<D>(algorithm, &script, &digests);
        let [hxt, default] = [Algorithm::Hxt, Algorithm::Default].map(wanted);
        let is_in_space = D == 3;
        if let Some(loaded) = default.find(cache) {
            return Ok(Loaded { without_hxt: is_in_space, ..loaded });
        }
        if let Some(loaded) = hxt.find(cache).filter(|_| is_in_space) {
            return Ok(loaded);
        }
        let gmsh = Gmsh::found(&file.value)?;
        if is_in_space && (guard.threads.is_some() || gmsh.has_steady_hxt()) {
            match hxt.make(&gmsh, cache, |gmsh, work, made| self.run::<D>(gmsh, Algorithm::Hxt, &script, work, made)) {
                Err(error) if is_of_hxt(&error) => {}
                made => return made,
            }
        }
        let loaded = default
            .make(&gmsh, cache, |gmsh, work, made| self.run::<D>(gmsh, Algorithm::Default, &script, work, made))?;
        Ok(Loaded { without_hxt: is_in_space, ..loaded })
    }

    /// Return what to look for in the cache. `digests` are those of the files of the script.
    fn wanted<const D: usize>(&self, algorithm: Algorithm, script: &Script, digests: &[String]) -> Wanted<'_> {
        let GmshSource { file, set, adapted, guard } = self.source;
        let asked = (D, self.order.degree(), (algorithm, guard.threads), guard.size, set, adapted.as_deref());
        let name = cache::name((asked, digests, script.is_ended()), &file.value);
        Wanted { path: &file.value, name, order: Some(self.order), is_kept: !script.may_change }
    }

    /// Mesh the script into the file `made`, with the folder `work` to work in.
    fn run<const D: usize>(
        &self,
        gmsh: &Gmsh,
        algorithm: Algorithm,
        script: &Script,
        work: &Path,
        made: &Path,
    ) -> Result<()> {
        let Self { source: GmshSource { file, set, adapted, guard }, order, interrupt } = *self;
        let (script, shown) = (&self.written::<D>(script, work)?, &file.value);
        let task = MeshingTask { script, shown, set, is_mesh: false, dimension: D, order, algorithm, guard, interrupt };
        gmsh.run(&task, made, work)?;
        match adapted.as_deref() {
            Some(AdaptedMesh { vertices, .. }) if !vertices.is_empty() => move_vertices(shown, made, vertices),
            _ => Ok(()),
        }
    }

    /// Return the path of the script for Gmsh: the user's own, or one in the folder `work` that loads a shape, follows
    /// sizes, or includes a script whose last line is not ended.
    fn written<const D: usize>(&self, script: &Script, work: &Path) -> Result<PathBuf> {
        let GmshSource { file, adapted, guard, .. } = self.source;
        let path = &file.value;
        let own =
            if is_shape(path) { foreign::script(path, &script.files[0], D, guard.size, work)? } else { path.clone() };
        match adapted {
            Some(adapted) => script::sized(&Located::new(own, file.place.clone()), script, &adapted.sizes, work),
            None if script.is_ended() || own != *path => Ok(own),
            None => {
                let whole = std::path::absolute(path).map_err(|cause| Error::file(path, "find", &cause))?;
                let made = work.join("ended.geo");
                write(&made, format!("Include {};\n", quoted(&whole)?)).map(|()| made)
            }
        }
    }
}
