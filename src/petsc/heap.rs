//! Memory of the process: one message where it ends, and large arrays that go back to the system.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

/// Let the C library return arrays of a megabyte and more to the system as soon as they are freed.
///
/// By itself the C library soon takes such arrays from its heap, where holes remain. SuperLU_DIST, which PETSc brings, even forbids separate
/// arrays for the whole process when it is loaded, so this is called again then. Without any call of this module the peak memory is larger:
/// 153 MB for 133 (`flange`), 351 for 331 (`groove-held` with n = 128), 676 for 656 (`groove3d` with n = 48 by hypre), 178 for 177
/// (`hertz-sphere` by hypre). A difference in time is not measurable.
pub fn keep_apart() {
    #[cfg(target_env = "gnu")]
    // SAFETY: parameters of the C library, and values that it accepts.
    unsafe {
        // the default of the C library
        libc::mallopt(libc::M_MMAP_MAX, 1 << 16);
        libc::mallopt(libc::M_MMAP_THRESHOLD, 1 << 20);
        libc::mallopt(libc::M_TRIM_THRESHOLD, 2 << 20);
    }
}

/// Let the C library keep freed memory, however large, for the next array, until [`keep_apart`] is called.
///
/// The steps of Newton's method allocate and free the same arrays, and a page that the system provides anew takes 4 us. Without this
/// call factorisations by MUMPS in each step take 4 % more time: 5.59 CPU s for 5.38 (`groove-held` with n = 96, 178 000 page faults for
/// 105 000) and 0.95 for 0.92 (`groove3d` with n = 12), in medians of 9 pairs. The memory is the same.
pub fn keep_at_hand() {
    #[cfg(target_env = "gnu")]
    // SAFETY: as above.
    unsafe {
        libc::mallopt(libc::M_MMAP_MAX, 0);
        libc::mallopt(libc::M_TRIM_THRESHOLD, -1);
    }
}

/// End the process with a code and without the exit handlers of libraries.
///
/// A thread of OpenBLAS that did not get its memory is waited for without end there: with the handlers, 2 of 24 runs of `check` on `patch-3d`
/// with 60 to 300 MB and 1 to 4 threads hung, and none without.
pub fn leave(code: i32) -> ! {
    // an output that is closed cannot be flushed
    let _ = std::io::stdout().flush();
    // SAFETY: a null pointer means all files of the C library; nothing of this program runs after that.
    unsafe {
        super::ffi::fflush(std::ptr::null_mut());
        libc::_exit(code)
    }
}

/// The system's allocator, which ends the process with a message and the exit code of a failed solver where there is no more memory.
///
/// Under `mpiexec` the other ranks end with it. The standard allocator would abort the process, with a signal and without advice.
pub struct Heap;

impl Heap {
    /// Return the memory that the system gave for `bytes`, or end the process if it is null.
    fn checked(memory: *mut u8, bytes: usize) -> *mut u8 {
        static IS_ENDING: AtomicBool = AtomicBool::new(false);
        // the message is printed once, and takes no memory itself
        if memory.is_null() && !IS_ENDING.swap(true, Ordering::SeqCst) {
            eprintln!("error: out of memory: {} MB more were wanted", bytes.div_ceil(1_000_000));
            eprintln!("  = help: take more ranks on more machines, multigrid (--set solver=hypre), or a coarser mesh");
            // SAFETY: it does not return, and runs nothing that might allocate.
            unsafe { libc::_exit(crate::error::Kind::Solver.exit_code()) }
        }
        memory
    }
}

// SAFETY: the system's allocator does all the work.
unsafe impl GlobalAlloc for Heap {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promises are passed on.
        Self::checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promises are passed on.
        Self::checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller's promises are passed on.
        Self::checked(unsafe { System.realloc(memory, layout, size) }, size)
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(memory, layout) }
    }
}
