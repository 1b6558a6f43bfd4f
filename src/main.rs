//! The `winkler` program.

use winkler::petsc::{Heap, keep_apart, leave};

/// Running out of memory ends a run with a message and its code.
#[global_allocator]
static HEAP: Heap = Heap;

fn main() {
    keep_apart();
    leave(winkler::cli::run(std::env::args_os().collect()));
}
