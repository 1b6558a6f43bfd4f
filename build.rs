//! Find PETSc, its MUMPS and its MPI, refuse unsuitable ones, and generate the Rust declarations of the functions that the binding calls.

use std::env;
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
    "MatCreateSubMatrices",
    "MatCreateSubMatrix",
    "MatDestroy",
    "MatDestroySubMatrices",
    "MatGetRow",
    "MatIncreaseOverlap",
    "MatMPIAIJGetSeqAIJ",
    "MatMPIAIJSetPreallocationCSR",
    "MatMult",
    "MatMultTranspose",
    "MatMumpsGetInfog",
    "MatMumpsSetIcntl",
    "MatNullSpaceCreate",
    "MatNullSpaceDestroy",
    "MatRestoreRow",
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
    "VecScatterBegin",
    "VecScatterCreate",
    "VecScatterDestroy",
    "VecScatterEnd",
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
        if let Err(sentence) = checked {
            refuse(&format!("{}: {sentence}", path.display()));
        }
    }
    println!("cargo:rustc-env=WINKLER_PETSC_LIBRARY={}", library(&petsc).display());
    let mumps = mumps(&petsc.include_paths);
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

/// Link MUMPS itself, whose Schur complement PETSc does not return in full, and return the folder of its header.
fn mumps(petsc: &[PathBuf]) -> Vec<PathBuf> {
    let own = env::var_os("MUMPS_DIR").filter(|root| !root.is_empty()).map(PathBuf::from);
    let folders = own.iter().map(|root| root.join("include")).chain(petsc.iter().cloned());
    let Some(folder) = folders.chain(["/usr/include".into()]).find(|folder| folder.join("dmumps_c.h").exists()) else {
        refuse("dmumps_c.h of MUMPS was not found: `apt-get install libmumps-dev`, or point MUMPS_DIR at its folder");
    };
    if let Some(root) = own {
        println!("cargo:rustc-link-search=native={}", root.join("lib").display());
        println!("cargo:rustc-link-arg=-Wl,-rpath,{}", root.join("lib").display());
    }
    println!("cargo:rustc-link-lib=dmumps");
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
/// `petsc.rs` has the functions of PETSc as fields of `Library`, which are looked up when its file is opened. `mumps.rs` has the function of
/// MUMPS, which is linked.
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
        .allowlist_type("(InsertMode|KSPConvergedReason|MatOption|MatReuse|PetscCopyMode|PCFailedReason|PetscErrorType|PetscBool|ScatterMode)")
        .allowlist_var(VERSIONS.join("|"))
        .dynamic_library_name("Library")
        .dynamic_link_require_all(true);
    for function in FUNCTIONS {
        library = library.allowlist_function(function);
    }
    let mumps = common().header_contents("mumps.h", "#include <dmumps_c.h>").allowlist_function("dmumps_c");
    for (builder, file) in [(library, "petsc.rs"), (mumps, "mumps.rs")] {
        let bindings = builder.generate().unwrap_or_else(|cause| refuse_headers(&cause.to_string(), folders, mpi));
        let text = bindings.to_string();
        let file = Path::new(&env::var_os("OUT_DIR").unwrap_or_default()).join(file);
        std::fs::write(&file, same_mpi(&text) + &text)
            .unwrap_or_else(|cause| refuse(&format!("cannot write {}: {cause}", file.display())));
    }
}
