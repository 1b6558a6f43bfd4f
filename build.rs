//! Find PETSc, MPI, MUMPS, METIS and LAPACK, link them, and generate the Rust declarations of what the binding calls.

use std::env;
use std::path::{Path, PathBuf};
use std::process::exit;

/// The advice of every refusal. Debian's package has real numbers in double precision, MUMPS and hypre.
const ADVICE: &str = "point PETSC_DIR and PETSC_ARCH at a PETSc with real numbers in double precision, MUMPS and hypre, and MPICC at the mpicc of its MPI \
                      (Debian: scripts/setup installs petsc-dev and what else it takes)";

/// Beginnings of the names of libraries that the binding calls directly, among those that PETSc names as its own needs.
const DIRECT: [&str; 8] = ["dmumps", "metis", "openblas", "flexiblas", "mkl", "lapack", "blas", "flapack"];

/// The macros of `mpi.h` that tell one MPI, and its version, from others.
const VERSIONS: [&str; 5] =
    ["I_MPI_NUMVERSION", "MVAPICH2_NUMVERSION", "MPICH_NUMVERSION", "OMPI_MAJOR_VERSION", "OMPI_MINOR_VERSION"];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=src/petsc/wrapper.h");
    for name in ["PETSC_DIR", "PETSC_ARCH", "MPICC", "MPI_PKG_CONFIG", "CRAY_MPICH_DIR"] {
        println!("cargo:rerun-if-env-changed={name}");
    }
    let petsc = link_petsc();
    // found as the crate `mpi` does, so that all headers and libraries belong to one MPI
    let mpi = build_probe_mpi::probe().unwrap_or_else(|_| refuse("MPI was not found"));
    // programs look for the libraries where the build found them, unless LD_LIBRARY_PATH says otherwise
    for folder in petsc.link_paths.iter().chain(&mpi.lib_paths) {
        println!("cargo:rustc-link-arg=-Wl,--enable-new-dtags,-rpath,{}", folder.display());
    }
    // MPI comes first, since a folder of PETSc that holds all packages of a site may hold another MPI
    declare(&[&mpi.include_paths[..], &petsc.include_paths].concat());
}

/// End the build with a sentence; cargo shows the output of a build script that fails.
fn refuse(sentence: &str) -> ! {
    eprintln!("\n{sentence}\n\n{ADVICE}\n");
    exit(1)
}

/// Link PETSc by its pkg-config file, that of PETSC_DIR and PETSC_ARCH if these are set, and the libraries that it uses and the binding calls, too.
fn link_petsc() -> pkg_config::Library {
    if let Some(root) = env::var_os("PETSC_DIR").filter(|root| !root.is_empty()) {
        let folder = Path::new(&root).join(env::var_os("PETSC_ARCH").unwrap_or_default()).join("lib/pkgconfig");
        let mut folders = vec![folder];
        folders.extend(env::var_os("PKG_CONFIG_PATH").iter().flat_map(env::split_paths));
        let joined = env::join_paths(folders).unwrap_or_else(|cause| refuse(&format!("PETSC_DIR: {cause}")));
        // SAFETY: the build script has one thread.
        unsafe { env::set_var("PKG_CONFIG_PATH", joined) };
    }
    let found = |name| pkg_config::Config::new().cargo_metadata(false).probe(name).is_ok();
    // old releases install PETSc.pc only
    let name = if found("petsc") { "petsc" } else { "PETSc" };
    let petsc = pkg_config::Config::new().print_system_libs(true).probe(name);
    let petsc = petsc.unwrap_or_else(|cause| refuse(&format!("PETSc was not found: {cause}")));
    let all = pkg_config::Config::new().statik(true).cargo_metadata(false).probe(name);
    let all = all.map_or(Vec::new(), |all| all.libs);
    let direct = |library: &&String| DIRECT.iter().any(|start| library.starts_with(start));
    all.iter().filter(direct).for_each(|library| println!("cargo:rustc-link-lib={library}"));
    if !all.iter().any(|library| library.starts_with("metis")) {
        println!("cargo:rustc-link-lib=metis");
    }
    petsc
}

/// Return a line of Rust for each of [`VERSIONS`] in these declarations. It does not compile if the crate `mpi` was built with another
/// MPI, as it stays when MPICC changes: cargo builds that crate once.
fn same_mpi(declared: &str) -> String {
    let words = "the crate mpi was built with another MPI: cargo clean -p mpi-sys";
    let is_declared = |name: &&&str| declared.contains(&format!("pub const {name}:"));
    let line = |name: &&str| format!("const _: () = assert!(mpi::ffi::{name} == {name}, \"{words}\");\n");
    VERSIONS.iter().filter(is_declared).map(line).collect()
}

/// Write the declarations to the build folder. `folders` have the headers.
fn declare(folders: &[PathBuf]) {
    let bindings = bindgen::Builder::default()
        .header("src/petsc/wrapper.h")
        .clang_args(folders.iter().map(|folder| format!("-I{}", folder.display())))
        .rust_edition(bindgen::RustEdition::Edition2024)
        .generate_comments(false)
        .layout_tests(false)
        // the type of communicators in the whole crate is that of the `mpi` crate
        .blocklist_type("(MPI_Comm|ompi_communicator_t)")
        .raw_line("use mpi::ffi::MPI_Comm;")
        .allowlist_function("(KSP|PC|Mat|Vec|IS|Petsc)[A-Z].*|METIS_NodeND|dmumps_c")
        .allowlist_type("PCFailedReason|PetscErrorType|MatOption|MumpsInt|idx_t")
        .allowlist_var(format!("PCFailedReasons|WINKLER_HAS_HYPRE|{}", VERSIONS.join("|")))
        .generate()
        .unwrap_or_else(|cause| {
            refuse(&format!("the headers of PETSc, MPI, MUMPS or METIS cannot be used:\n{cause}\nin {folders:?}"))
        });
    let text = bindings.to_string();
    let file = Path::new(&env::var_os("OUT_DIR").unwrap_or_default()).join("petsc.rs");
    std::fs::write(&file, same_mpi(&text) + &text)
        .unwrap_or_else(|cause| refuse(&format!("cannot write {}: {cause}", file.display())));
}
