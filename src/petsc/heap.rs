//! Ends of the process: when memory ends, one message and the code of a failing solver in place of an abort.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

/// Has the system take back arrays of a megabyte and more as soon as they are freed, where the C library can: by itself that makes them part of
/// its heap, in which holes stay. SuperLU_DIST, which PETSc brings, forbids such arrays for the whole process when it is loaded: this is said
/// again then.
pub fn keep_apart() {
    #[cfg(target_env = "gnu")]
    // SAFETY: parameters of the C library, and numbers that they take.
    unsafe {
        // the number that the C library has by itself
        libc::mallopt(libc::M_MMAP_MAX, 1 << 16);
        libc::mallopt(libc::M_MMAP_THRESHOLD, 1 << 20);
        libc::mallopt(libc::M_TRIM_THRESHOLD, 2 << 20);
    }
}

/// Has the C library hold what is freed, however large, for the next array: Newton's steps take and give back the same ones, and a page that
/// the system gives anew takes 4 us. Until [`keep_apart`].
pub fn keep_at_hand() {
    #[cfg(target_env = "gnu")]
    // SAFETY: as above.
    unsafe {
        libc::mallopt(libc::M_MMAP_MAX, 0);
        libc::mallopt(libc::M_TRIM_THRESHOLD, -1);
    }
}

/// Gives memory that is free back to the system, before solvers are set up.
pub fn give_back() {
    #[cfg(target_env = "gnu")]
    // SAFETY: the C library walks its own lists.
    unsafe {
        libc::malloc_trim(0)
    };
}

/// Says once that there is no more memory; takes none for that.
fn out_of_memory(wanted: impl std::fmt::Display) -> bool {
    static TOLD: AtomicBool = AtomicBool::new(false);
    let first = !TOLD.swap(true, Ordering::SeqCst);
    if first {
        eprintln!("error: out of memory: {wanted}");
        eprintln!("  = help: take more ranks on more machines, multigrid (--set solver=hypre), or a coarser mesh");
    }
    first
}

/// Ends the process with a code, past what libraries do at an end: a thread of OpenBLAS that was not given its memory is waited for
/// without end there.
pub fn leave(code: i32) -> ! {
    // nothing can be done about an output that is closed
    let _ = std::io::stdout().flush();
    // SAFETY: a null file means all files of the C library; nothing of this program comes after that.
    unsafe {
        super::ffi::fflush(std::ptr::null_mut());
        libc::_exit(code)
    }
}

/// The system's allocator, which ends the process with a message where there is no more memory. Under `mpiexec` the other ranks end
/// with it.
pub struct Heap;

impl Heap {
    fn given(memory: *mut u8, bytes: usize) -> *mut u8 {
        if memory.is_null() && out_of_memory(format_args!("{} MB more were wanted", bytes.div_ceil(1_000_000))) {
            // SAFETY: it returns to nobody, and runs nothing that might want memory.
            unsafe { libc::_exit(crate::error::Kind::Solver.exit_code()) }
        }
        memory
    }
}

// SAFETY: all work is the system allocator's.
unsafe impl GlobalAlloc for Heap {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promises are passed on.
        Self::given(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promises are passed on.
        Self::given(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller's promises are passed on.
        Self::given(unsafe { System.realloc(memory, layout, size) }, size)
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(memory, layout) }
    }
}
