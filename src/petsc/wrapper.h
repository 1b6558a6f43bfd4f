/* The headers of which build.rs makes declarations, after a check of what this PETSc has. */
#include <petscconf.h>
#include <petscversion.h>
#if PETSC_VERSION_LT(3, 18, 0)
#error "this PETSc is too old: winkler needs 3.18 or newer"
#endif
#if defined(PETSC_USE_COMPLEX)
#error "this PETSc computes with complex numbers: winkler needs one with real numbers"
#endif
#if !defined(PETSC_USE_REAL_DOUBLE)
#error "this PETSc does not compute in double precision, as winkler does"
#endif
#if defined(PETSC_HAVE_MPIUNI)
#error "this PETSc was built without MPI: winkler needs one with MPI"
#endif
#if !defined(PETSC_HAVE_MUMPS)
#error "this PETSc was built without MUMPS: winkler needs one with MUMPS"
#endif
#include <petscksp.h>
#include <dmumps_c.h>
#include <metis.h>
/* Functions that PETSc exports, and declares in private headers; PetscObjectStateIncrease is a macro over them. */
PETSC_EXTERN PetscErrorCode PetscObjectStateGet(PetscObject, PetscObjectState *);
PETSC_EXTERN PetscErrorCode PetscObjectStateSet(PetscObject, PetscObjectState);
typedef MUMPS_INT MumpsInt;
#if defined(PETSC_HAVE_HYPRE)
#define WINKLER_HAS_HYPRE 1
#else
#define WINKLER_HAS_HYPRE 0
#endif
