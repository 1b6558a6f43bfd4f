//! Which BLAS the program runs on. The reference one is up to 11 times slower in factorisations, so a run says it.

use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::PathBuf;

/// What `dladdr` fills in.
#[repr(C)]
struct Location {
    file: *const c_char,
    base: *mut c_void,
    symbol: *const c_char,
    address: *mut c_void,
}

unsafe extern "C" {
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
    fn dladdr(address: *const c_void, location: *mut Location) -> c_int;
}

/// File of the library that the name `dgemm_` leads to in this process, with links resolved: of several BLAS in the
/// memory map it is the one in use.
fn file() -> Option<PathBuf> {
    let mut found = Location {
        file: std::ptr::null(),
        base: std::ptr::null_mut(),
        symbol: std::ptr::null(),
        address: std::ptr::null_mut(),
    };
    // SAFETY: a null library means the default search order; dladdr fills `found` with texts that live as long as the
    // library is loaded.
    let file = unsafe {
        let address = dlsym(std::ptr::null_mut(), c"dgemm_".as_ptr());
        if address.is_null() || dladdr(address, &mut found) == 0 || found.file.is_null() {
            return None;
        }
        CStr::from_ptr(found.file)
    };
    let path = PathBuf::from(file.to_string_lossy().into_owned());
    Some(path.canonicalize().unwrap_or(path))
}

/// Name of the BLAS in use: `OpenBLAS`, `MKL`, `BLIS`, `ATLAS`, `Accelerate`, `reference BLAS`, or the file of another
/// one.
pub(super) fn name() -> String {
    match file() {
        Some(path) => name_of(&path.to_string_lossy()),
        None => "unknown BLAS".to_owned(),
    }
}

/// Asks OpenBLAS for a number of threads; false if another BLAS is in use, which keeps its own number.
pub(super) fn set_threads(count: usize) -> bool {
    // SAFETY: the name is looked up in the loaded libraries; OpenBLAS declares it as void (int).
    unsafe {
        let address = dlsym(std::ptr::null_mut(), c"openblas_set_num_threads".as_ptr());
        if address.is_null() {
            return false;
        }
        let set: extern "C" fn(c_int) = std::mem::transmute(address);
        set(count.clamp(1, 1024) as c_int);
    }
    true
}

/// The BLAS that lives in a file, told by its path: Debian's alternatives all end in `libblas.so.3`.
fn name_of(path: &str) -> String {
    let lower = path.to_lowercase();
    let known = [
        ("openblas", "OpenBLAS"),
        ("mkl", "MKL"),
        ("blis", "BLIS"),
        ("atlas", "ATLAS"),
        ("accelerate", "Accelerate"),
        ("veclib", "Accelerate"),
        ("libblas.so", "reference BLAS"),
        ("libblas.dylib", "reference BLAS"),
    ];
    known.iter().find(|(part, _)| lower.contains(part)).map_or_else(|| path.to_owned(), |(_, name)| (*name).to_owned())
}

#[cfg(test)]
mod tests {
    use super::name_of;

    #[test]
    fn the_path_tells_the_blas() {
        let lib = "/usr/lib/x86_64-linux-gnu";
        for (path, name) in [
            ("openblas-pthread/libblas.so.3", "OpenBLAS"),
            ("blas/libblas.so.3.11.0", "reference BLAS"),
            ("blis-serial/libblas.so.3", "BLIS"),
            ("libmkl_rt.so", "MKL"),
        ] {
            assert_eq!(name_of(&format!("{lib}/{path}")), name);
        }
        assert_eq!(name_of("/opt/libsci.so"), "/opt/libsci.so");
    }
}
