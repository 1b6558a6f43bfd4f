//! What PETSc prints, as a text.

use super::library::{open, running};
use super::{Session, ffi};
use std::cell::RefCell;
use std::ffi::{c_char, c_void};

thread_local! {
    static CAUGHT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// The longest text of one print statement in bytes; a longer one is cut. PETSc prints line by line, and the longest line of `-help`
/// for `hertz-sphere` with hypre has 402 bytes.
const LONGEST: usize = 1 << 16;

/// Run `action`, and return its result and PETSc's output meanwhile, which is not shown.
///
/// ```
/// use winkler::petsc::{Ksp, Session, printed};
/// let session = Session::start(&["-help".to_owned()])?;
/// let (read, text) = printed(&session, || Ksp::new(&session, "up_")?.set_from_options());
/// assert!(read.is_ok() && text.contains("-up_ksp_rtol"));
/// # Ok::<(), winkler::error::Error>(())
/// ```
pub fn printed<T>(_session: &Session, action: impl FnOnce() -> T) -> (T, String) {
    /// A guard that restores PETSc's own printer, also when `action` panics.
    struct Restore(*mut ffi::Printf, ffi::Printf);
    impl Drop for Restore {
        fn drop(&mut self) {
            // SAFETY: as below.
            unsafe { *self.0 = self.1 };
        }
    }
    CAUGHT.take();
    // SAFETY: the variable has this type; the thread of the session alone uses PETSc, so nobody reads the hook meanwhile.
    let hook = running().and_then(|petsc| unsafe { petsc.address::<*mut ffi::Printf>("PetscVFPrintf") });
    // SAFETY: as above; without PETSc the action itself returns the error
    let restore = hook.ok().map(|hook| unsafe {
        let before = Restore(hook, *hook);
        *hook = append;
        before
    });
    let result = action();
    drop(restore);
    (result, String::from_utf8_lossy(&CAUGHT.take()).into_owned())
}

/// The printer of PETSc while [`printed`] runs.
unsafe extern "C" fn append(_file: *mut c_void, format: *const c_char, list: *mut c_void) -> ffi::PetscErrorCode {
    let mut text = vec![0_u8; LONGEST];
    let mut length = 0;
    // SAFETY: PETSc writes at most `LONGEST` bytes with the final zero byte; format and list are passed on from PETSc.
    let code = unsafe {
        let Ok(print) = open().and_then(|petsc| petsc.address::<ffi::Format>("PetscVSNPrintf")) else {
            return Default::default();
        };
        print(text.as_mut_ptr().cast(), LONGEST, format, &mut length, list)
    };
    let end = text.iter().position(|byte| *byte == 0).unwrap_or(0);
    CAUGHT.with_borrow_mut(|caught| caught.extend_from_slice(&text[..end]));
    code
}
