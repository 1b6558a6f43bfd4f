//! Meshes of prescribed sizes: Gmsh follows a field of sizes instead of those in the user's script.

use super::script::{Script, quoted};
use super::tokens::{Token, tokens};
use crate::error::{Error, Located, Result};
use std::path::{Path, PathBuf};

/// Write a script into the folder `work` that meshes another script to a field of sizes, and return its path.
///
/// `field` is a view of Gmsh (`.pos`). Where a point is in none of the view's cells, Gmsh would make cells as large as the
/// part, so the script limits sizes to the largest of the view. Structured meshes cannot follow sizes, so their commands are
/// removed in a copy.
///
/// # Errors
/// A structured script reads other files, which a copy would not find. The folder cannot be written.
pub(super) fn script(file: &Located<PathBuf>, read: &Script, field: &str, work: &Path) -> Result<PathBuf> {
    let write = |name: &str, text: &str| {
        let path = work.join(name);
        std::fs::write(&path, text).map_err(|cause| Error::file(&path, "write", &cause)).map(|()| path)
    };
    let own = read.files.first().map_or(String::new(), |bytes| String::from_utf8_lossy(bytes).into_owned());
    let free = unstructured(&own);
    let mut script = std::path::absolute(&file.value).map_err(|cause| Error::file(&file.value, "find", &cause))?;
    if free != own {
        if read.files.len() > 1 {
            let message = format!("{} makes a structured mesh and reads other files", file.value.display());
            return Err(Error::scene(&file.place, message)
                .help("take `Transfinite` and `Recombine` out of it: such a mesh cannot follow sizes"));
        }
        script = write("free.geo", &free)?;
    }
    let sizes = write("sizes.pos", field)?;
    let text = format!(
        "Include {};\nMesh.MeshSizeExtendFromBoundary = 0;\nMesh.MeshSizeFromPoints = 0;\n\
         Merge {};\nBackground Mesh View[PostProcessing.NbViews - 1];\n\
         Mesh.MeshSizeMax = View[PostProcessing.NbViews - 1].Max;\n",
        quoted(&script)?,
        quoted(&sizes)?
    );
    write("sized.geo", &text)
}

/// Return the script without the commands that ask for structured meshes, from the word to the semicolon.
pub fn unstructured(text: &str) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut from = 0;
    for (span, token) in tokens(text) {
        let structured = matches!(token, Token::Name("Transfinite" | "TransfQuadTri" | "Recombine"));
        if structured && span.start >= from {
            kept.push_str(&text[from..span.start]);
            from = text[span.end..].find(';').map_or(text.len(), |end| span.end + end + 1);
        }
    }
    kept + &text[from..]
}

/// Return a field of sizes on simplices as a view of Gmsh. `corners` holds the corners of all simplices, `stride` of them each,
/// and `sizes` the size at each corner.
pub fn view(stride: usize, corners: &[[f64; 3]], sizes: &[f64]) -> String {
    use std::fmt::Write;
    let mut text = String::from("View \"sizes\" {\n");
    let list = |values: &mut dyn Iterator<Item = f64>| values.map(|v| format!("{v:e}")).collect::<Vec<_>>().join(",");
    for (x, size) in corners.chunks_exact(stride).zip(sizes.chunks_exact(stride)) {
        let at = list(&mut x.iter().flatten().copied());
        let size = list(&mut size.iter().copied());
        // Writing to a String cannot fail.
        let _ = writeln!(text, "S{}({at}){{{size}}};", if stride == 3 { "T" } else { "S" });
    }
    text + "};\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn structured_commands_go_and_nothing_else() {
        let text = "n = 3; // Transfinite;\nTransfinite Curve {1, 2} = n + 1 Using Progression 1.1;\n\
                    Recombine Surface{1};\nPhysical Surface(\"Transfinite;\") = {1};\nmyTransfinite = 2;\n";
        let expected = "n = 3; // Transfinite;\n\n\nPhysical Surface(\"Transfinite;\") = {1};\nmyTransfinite = 2;\n";
        assert_eq!(unstructured(text), expected);
        assert_eq!(unstructured("a = 'x"), "a = 'x");
    }

    #[test]
    fn a_view_has_a_line_for_each_simplex() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(
            view(3, &corners, &[0.5, 0.25, 1.0]),
            "View \"sizes\" {\nST(0e0,0e0,0e0,1e0,0e0,0e0,0e0,1e0,0e0){5e-1,2.5e-1,1e0};\n};\n"
        );
    }
}
