/* The parts of PETSc that build.rs makes Rust declarations of; the functions are listed there. */
#include <petscksp.h>
/* Exported functions whose declarations PETSc keeps among its private headers; PetscObjectStateIncrease is a macro over them. */
PETSC_EXTERN PetscErrorCode PetscObjectStateGet(PetscObject, PetscObjectState *);
PETSC_EXTERN PetscErrorCode PetscObjectStateSet(PetscObject, PetscObjectState);
