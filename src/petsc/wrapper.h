/* The parts of PETSc that build.rs makes Rust declarations of; the functions are listed there. */
#include <petscksp.h>
