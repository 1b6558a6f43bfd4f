/* The parts of PETSc and MUMPS that build.rs makes Rust declarations of; the functions are listed there. */
#include <petscksp.h>
#include <dmumps_c.h>
