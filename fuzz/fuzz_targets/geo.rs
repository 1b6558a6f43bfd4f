//! Scripts: the judgement of any bytes ends, and the script without structured commands has none left and is judged no worse.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use winkler::internals::mesh::{breach, unstructured};

fuzz_target!(|bytes: &[u8]| {
    let (path, home) = (Path::new("a.geo"), Path::new("/nowhere"));
    let found = breach(path, bytes, home);
    if let Some(found) = &found {
        assert!(found.line >= 1 && found.line <= 1 + bytes.iter().filter(|byte| **byte == b'\n').count());
    }
    let text = String::from_utf8_lossy(bytes);
    let free = unstructured(&text);
    assert!(free.len() <= text.len());
    // what is cut out ends a command, and what follows may begin with another: twice is enough for none
    assert!(unstructured(&free).len() <= free.len());
});
