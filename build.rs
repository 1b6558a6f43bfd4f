//! Find PETSc, its MUMPS and its MPI, refuse unsuitable ones, and generate the Rust declarations of the functions that the binding calls.

use std::env;
use std::ffi::{CStr, OsStr, c_void};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::exit;

#[path = "src/petsc/requirements.rs"]
mod requirements;

/// All functions of PETSc that the binding calls. Other functions are not declared.
const FUNCTIONS: &[&str] = &[
    "ISCreateGeneral",
    "ISDestroy",
    "ISGetIndices",
    "ISGetLocalSize",
    "ISRestoreIndices",
    "ISSort",
    "KSPBuildSolution",
    "KSPComputeExtremeSingularValues",
    "KSPCreate",
    "KSPDestroy",
    "KSPGetAndClearConvergenceTest",
    "KSPGetComputeSingularValues",
    "KSPGetConvergedReason",
    "KSPGetInitialGuessNonzero",
    "KSPGetIterationNumber",
    "KSPGetPC",
    "KSPGetResidualNorm",
    "KSPGetReusePreconditioner",
    "KSPGetTolerances",
    "KSPGetType",
    "KSPSetComputeSingularValues",
    "KSPSetConvergenceTest",
    "KSPSetErrorIfNotConverged",
    "KSPSetFromOptions",
    "KSPSetOperators",
    "KSPSetOptionsPrefix",
    "KSPSetPC",
    "KSPSetReusePreconditioner",
    "KSPSetTolerances",
    "KSPSetType",
    "KSPSetUp",
    "KSPSetUpOnBlocks",
    "KSPSolve",
    "KSPView",
    "MatCreate",
    "MatCreateMPIAIJWithSplitArrays",
    "MatCreateSeqAIJWithArrays",
    "MatCreateSubMatrix",
    "MatDestroy",
    "MatIncreaseOverlap",
    "MatMPIAIJGetSeqAIJ",
    "MatMPIAIJSetPreallocationCSR",
    "MatMult",
    "MatMultTranspose",
    "MatMumpsGetInfog",
    "MatMumpsSetIcntl",
    "MatNullSpaceCreate",
    "MatNullSpaceDestroy",
    "MatSeqAIJGetArray",
    "MatSeqAIJRestoreArray",
    "MatSeqAIJSetPreallocationCSR",
    "MatSetBlockSize",
    "MatSetBlockSizes",
    "MatSetNearNullSpace",
    "MatSetOption",
    "MatSetOptionsPrefix",
    "MatSetSizes",
    "MatSetType",
    "MatViewFromOptions",
    "PCApply",
    "PCCreate",
    "PCDestroy",
    "PCFactorGetMatSolverType",
    "PCFactorGetMatrix",
    "PCFactorSetMatSolverType",
    "PCFactorSetUpMatSolverType",
    "PCGetFailedReason",
    "PCGetOperators",
    "PCGetType",
    "PCMGGetLevels",
    "PCMGGetSmoother",
    "PCMGSetGalerkin",
    "PCMGSetInterpolation",
    "PCMGSetLevels",
    "PCReset",
    "PCSetOperators",
    "PCSetType",
    "PCSetUp",
    "PCShellGetContext",
    "PCShellSetApply",
    "PCShellSetContext",
    "PCShellSetName",
    "PCShellSetView",
    "PCView",
    "PetscContainerCreate",
    "PetscContainerDestroy",
    "PetscContainerSetPointer",
    "PetscContainerSetUserDestroy",
    "PetscErrorMessage",
    "PetscFinalize",
    "PetscGetVersionNumber",
    "PetscInitialize",
    "PetscLogStageGetId",
    "PetscLogStagePop",
    "PetscLogStagePush",
    "PetscLogStageRegister",
    "PetscObjectCompose",
    "PetscObjectDereference",
    "PetscObjectReference",
    "PetscObjectStateGet",
    "PetscObjectStateSet",
    "PetscOptionsClearValue",
    "PetscOptionsFindPair",
    "PetscOptionsGetAll",
    "PetscOptionsLeftGet",
    "PetscOptionsLeftRestore",
    "PetscOptionsSetValue",
    "PetscOptionsUsed",
    "PetscPushErrorHandler",
    "PetscViewerASCIIGetStdout",
    "VecCreateMPI",
    "VecCreateMPIWithArray",
    "VecCreateSeq",
    "VecCreateSeqWithArray",
    "VecDestroy",
    "VecGetArray",
    "VecGetArrayRead",
    "VecGetLocalSize",
    "VecPlaceArray",
    "VecResetArray",
    "VecRestoreArray",
    "VecRestoreArrayRead",
    "VecSetBlockSize",
];

/// End the build with a sentence; cargo shows the output of a build script that fails.
fn refuse(sentence: &str) -> ! {
    eprintln!("\n{sentence}\n");
    exit(1)
}

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=src/petsc/wrapper.h");
    println!("cargo:rerun-if-changed=src/petsc/requirements.rs");
    println!("cargo:rerun-if-env-changed=PETSC_DIR");
    println!("cargo:rerun-if-env-changed=PETSC_ARCH");
    println!("cargo:rerun-if-env-changed=MUMPS_DIR");
    for name in ["MPICC", "MPI_PKG_CONFIG", "CRAY_MPICH_DIR"] {
        println!("cargo:rerun-if-env-changed={name}");
    }

    let petsc = find();
    for header in ["petscconf.h", "petscversion.h"] {
        let Some(path) = petsc.include_paths.iter().map(|folder| folder.join(header)).find(|path| path.exists()) else {
            refuse(&format!("{header} of PETSc is missing from {:?}: {}", petsc.include_paths, requirements::ADVICE));
        };
        println!("cargo:rerun-if-changed={}", path.display());
        let text = std::fs::read_to_string(&path)
            .unwrap_or_else(|cause| refuse(&format!("cannot read {}: {cause}", path.display())));
        let checked = match header {
            "petscconf.h" => requirements::check_config(&text),
            _ => requirements::check_version(&text),
        };
        if header == "petscconf.h" && requirements::has_hypre(&text) {
            println!("cargo:rustc-env=WINKLER_HAS_HYPRE=1");
        }
        if let Err(sentence) = checked {
            refuse(&format!("{}: {sentence}", path.display()));
        }
    }
    let library = library(&petsc);
    println!("cargo:rustc-env=WINKLER_PETSC_LIBRARY={}", library.display());
    beside(&library);
    let mumps = mumps_header(&petsc.include_paths);
    let mpi = mpi();
    // MPI comes first, since a folder of PETSc that holds all packages of a site may hold another MPI.
    declare(&[&mpi.include_paths[..], &petsc.include_paths, &mumps].concat(), &mpi);
}

/// Return the shared library of PETSc, under the name that programs link (`libpetsc.so.3.18`).
///
/// It is not linked, but opened when a run first needs PETSc: it brings a hundred libraries, whose loading takes longer than a small scene.
fn library(petsc: &pkg_config::Library) -> PathBuf {
    let name = petsc.libs.iter().find(|name| name.starts_with("petsc"));
    let plain = format!("lib{}{}", name.map_or("petsc", String::as_str), env::consts::DLL_SUFFIX);
    let folder = petsc.link_paths.iter().find(|folder| folder.join(&plain).exists());
    let Some(file) = folder.map(|folder| folder.join(&plain)) else {
        refuse(&format!("{plain} is not in {:?}: winkler needs PETSc as a shared library", petsc.link_paths));
    };
    let (target, start) = (file.canonicalize().ok(), format!("{plain}."));
    // Debian's folder of PETSc is one of links that come with the headers; programs run without these.
    let folder = target.as_ref().and_then(|target: &PathBuf| target.parent()).or(folder.map(PathBuf::as_path));
    let versions = folder.and_then(|folder| folder.read_dir().ok()).into_iter().flatten().flatten();
    let versions = versions.map(|entry| entry.path()).filter(|path| {
        let named = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(&start));
        named && path.canonicalize().ok() == target
    });
    versions.min_by_key(|path| path.as_os_str().len()).unwrap_or(file)
}

/// Name the files that have MUMPS and METIS for this PETSc, by the loader's own search: no other ones may come into a process with PETSc.
///
/// Libraries that only compute nodes have may be missing here. The program then looks for MUMPS in PETSc's own file.
fn beside(petsc: &Path) {
    // SAFETY: initialisers of libraries run as in any program that links them. They stay loaded until the end of this process.
    let opened = unsafe { libloading::Library::new(petsc) };
    let file = |function: &CStr| file_of(opened.as_ref().ok()?, function);
    if let Err(cause) = &opened {
        println!("cargo:warning={} cannot be opened here: {cause}", petsc.display());
    }
    let mumps = file(c"dmumps_c");
    if opened.is_ok() && mumps.is_none() {
        refuse(&format!(
            "{} has no dmumps_c: winkler needs PETSc with MUMPS as a shared library, or inside it",
            petsc.display()
        ));
    }
    println!("cargo:rustc-env=WINKLER_MUMPS_LIBRARY={}", mumps.as_deref().unwrap_or(petsc).display());
    // SCOTCH has functions of METIS, but not this one
    if let Some(metis) = file(c"METIS_Free") {
        println!("cargo:rustc-env=WINKLER_METIS_LIBRARY={}", metis.display());
    }
    std::mem::forget(opened);
}

/// Return the file of a function in a library or those that it needs, as the loader names it.
fn file_of(library: &libloading::Library, function: &CStr) -> Option<PathBuf> {
    // SAFETY: the address is not used as a function.
    let address = *unsafe { library.get::<*mut c_void>(function.to_bytes_with_nul()) }.ok()?;
    // SAFETY: plain C data, which dladdr fills with pointers to texts that live as long as the library is loaded.
    let name = unsafe {
        let mut found: libc::Dl_info = std::mem::zeroed();
        let known = libc::dladdr(address, &mut found) != 0 && !found.dli_fname.is_null();
        known.then(|| CStr::from_ptr(found.dli_fname))
    }?;
    Some(PathBuf::from(OsStr::from_bytes(name.to_bytes())))
}

/// Return the folder of MUMPS' header: that of MUMPS_DIR, one that PETSc names, one that the compiler is told of, or the system's.
///
/// MUMPS is called directly, since PETSc does not return its Schur complement in full.
fn mumps_header(petsc: &[PathBuf]) -> Vec<PathBuf> {
    let own = env::var_os("MUMPS_DIR").filter(|root| !root.is_empty()).map(PathBuf::from);
    let told: Vec<PathBuf> = ["CPATH", "C_INCLUDE_PATH"]
        .iter()
        .filter_map(env::var_os)
        .flat_map(|paths| env::split_paths(&paths).collect::<Vec<_>>())
        .collect();
    let folders = own.iter().map(|root| root.join("include")).chain(petsc.iter().cloned()).chain(told);
    let Some(folder) = folders.chain(["/usr/include".into()]).find(|folder| folder.join("dmumps_c.h").exists()) else {
        refuse(
            "dmumps_c.h of MUMPS was not found: `apt-get install libmumps-dev`, or point MUMPS_DIR at the folder of the \
             MUMPS that PETSc uses",
        );
    };
    vec![folder]
}

/// Find PETSc by its pkg-config file: that of PETSC_DIR and PETSC_ARCH if these are set, otherwise that of the system.
fn find() -> pkg_config::Library {
    if let Some(root) = env::var_os("PETSC_DIR").filter(|root| !root.is_empty()).map(PathBuf::from) {
        let build = root.join(env::var_os("PETSC_ARCH").unwrap_or_default());
        let folder = build.join("lib/pkgconfig");
        if !folder.exists() {
            refuse(&format!(
                "PETSC_DIR and PETSC_ARCH point at {}, which has no lib/pkgconfig: correct or unset them",
                build.display()
            ));
        }
        let mut folders = vec![folder];
        folders.extend(env::var_os("PKG_CONFIG_PATH").iter().flat_map(env::split_paths));
        let joined = env::join_paths(folders).unwrap_or_else(|cause| refuse(&format!("PETSC_DIR: {cause}")));
        // SAFETY: the build script has one thread.
        unsafe { env::set_var("PKG_CONFIG_PATH", joined) };
    }
    // old releases install PETSc.pc only, and newer ones both names
    let found = ["PETSc", "petsc"].map(|name| pkg_config::Config::new().cargo_metadata(false).probe(name));
    let name = match found {
        [Ok(_), _] => "PETSc",
        [_, Ok(_)] => "petsc",
        [Err(cause), _] => refuse(&format!("{cause}\n\nPETSc was not found: {}", requirements::ADVICE)),
    };
    let probed = pkg_config::Config::new().cargo_metadata(false).print_system_libs(true).probe(name);
    probed.unwrap_or_else(|cause| refuse(&format!("PETSc was not found: {cause}")))
}

/// Find MPI as the crate `mpi` does, so that all headers and libraries belong to one MPI. Programs look for its library where the build
/// found it, unless LD_LIBRARY_PATH says otherwise.
fn mpi() -> build_probe_mpi::Library {
    let mpi = build_probe_mpi::probe().unwrap_or_else(|_| {
        refuse("MPI was not found: put the `mpicc` of PETSc's MPI into $PATH, or name it in MPICC (Debian: libopenmpi-dev)")
    });
    for folder in &mpi.lib_paths {
        println!("cargo:rustc-link-arg=-Wl,--enable-new-dtags,-rpath,{}", folder.display());
    }
    mpi
}

/// The macros of `mpi.h` that tell one MPI, and its version, from others.
const VERSIONS: [&str; 5] =
    ["I_MPI_NUMVERSION", "MVAPICH2_NUMVERSION", "MPICH_NUMVERSION", "OMPI_MAJOR_VERSION", "OMPI_MINOR_VERSION"];

/// Return a line of Rust for each of [`VERSIONS`] in these declarations. It does not compile if the crate `mpi` was built with another
/// MPI, as it stays when MPICC changes: cargo builds that crate once.
fn same_mpi(declared: &str) -> String {
    let words = "the crate mpi was built with another MPI: cargo clean -p mpi-sys";
    let is_declared = |name: &&&str| declared.contains(&format!("pub const {name}:"));
    let line = |name: &&str| format!("const _: () = assert!(mpi::ffi::{name} == {name}, \"{words}\");\n");
    VERSIONS.iter().filter(is_declared).map(line).collect()
}

/// End the build because the headers cannot be read. `said` is what clang says about them.
fn refuse_headers(said: &str, folders: &[PathBuf], mpi: &build_probe_mpi::Library) -> ! {
    let Some(mix) = requirements::mix_of_mpi(said) else {
        refuse(&format!(
            "the headers of PETSc, MPI or MUMPS cannot be read: {said}; that takes libclang with the headers of a compiler (Debian: libclang-dev)"
        ));
    };
    let used = mpi.mpicc.as_ref().map_or("pkg-config".to_owned(), |mpicc| format!("`{mpicc} -show`"));
    refuse(&format!(
        "{mix}\n\nThe MPI of {used} and PETSc do not belong together: name the mpicc of PETSc's MPI in MPICC, \
         or point PETSC_DIR at a PETSc that was built with this MPI. Searched for headers: {folders:?}"
    ))
}

/// Write the declarations to the build folder.
///
/// `petsc.rs` has the functions of PETSc as fields of `Library`, which are looked up when its file is opened. `mumps.rs` has the struct of MUMPS.
fn declare(folders: &[PathBuf], mpi: &build_probe_mpi::Library) {
    let common = || {
        bindgen::Builder::default()
            .clang_args(folders.iter().map(|folder| format!("-I{}", folder.display())))
            .rust_edition(bindgen::RustEdition::Edition2024)
            .generate_comments(false)
            .layout_tests(false)
    };
    let mut library = common()
        .header("src/petsc/wrapper.h")
        // the type of communicators in the whole crate is that of the `mpi` crate
        .blocklist_type("(MPI_Comm|ompi_communicator_t)")
        .raw_line("use mpi::ffi::MPI_Comm;")
        .allowlist_type("(KSPConvergedReason|MatOption|MatReuse|PetscCopyMode|PCFailedReason|PetscErrorType|PetscBool)")
        .allowlist_var(VERSIONS.join("|"))
        .dynamic_library_name("Library")
        .dynamic_link_require_all(true);
    for function in FUNCTIONS {
        library = library.allowlist_function(function);
    }
    let mumps = common()
        .header_contents("mumps.h", "#include <dmumps_c.h>\ntypedef MUMPS_INT MumpsInt;\n")
        .allowlist_type("DMUMPS_STRUC_C|MumpsInt")
        .allowlist_var("MUMPS_VERSION");
    for (builder, file) in [(library, "petsc.rs"), (mumps, "mumps.rs")] {
        let bindings = builder.generate().unwrap_or_else(|cause| refuse_headers(&cause.to_string(), folders, mpi));
        let text = bindings.to_string();
        let file = Path::new(&env::var_os("OUT_DIR").unwrap_or_default()).join(file);
        std::fs::write(&file, same_mpi(&text) + &text)
            .unwrap_or_else(|cause| refuse(&format!("cannot write {}: {cause}", file.display())));
    }
}
