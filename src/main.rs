//! The `winkler` program.

use winkler::petsc::{Heap, keep_apart, leave};

/// The allocator, which ends a run that is out of memory with a message and an exit code.
#[global_allocator]
static HEAP: Heap = Heap;

fn main() {
    keep_apart();
    leave(winkler::cli::run(std::env::args_os().collect()));
}
