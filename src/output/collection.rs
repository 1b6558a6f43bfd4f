//! The `.pvd` collection, with which ParaView opens the files of bodies and contact surfaces over time.

use std::io::{self, Write};

/// An entry of a collection: the file of a body or a contact surface at a time.
pub struct Entry<'a> {
    /// Time.
    pub time: f64,
    /// Number of the body or surface.
    pub part: usize,
    /// Name of the body or surface.
    pub name: &'a str,
    /// File, relative to the collection.
    pub file: String,
}

/// Write the collection that opens the `.vtu` files of all bodies and contact surfaces at once, over time.
///
/// # Errors
/// Those of `out`.
pub fn write_pvd(entries: &[Entry], out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, r#"<?xml version="1.0"?>"#)?;
    writeln!(out, r#"<VTKFile type="Collection" version="1.0">"#)?;
    writeln!(out, "  <Collection>")?;
    for Entry { time, part, name, file } in entries {
        let (file, name) = (escape(file), escape(name));
        writeln!(out, r#"    <DataSet timestep="{time}" group="" part="{part}" name="{name}" file="{file}"/>"#)?;
    }
    writeln!(out, "  </Collection>")?;
    writeln!(out, "</VTKFile>")
}

/// Escape a text for the value of an XML attribute.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_collection_names_every_body() {
        let mut bytes = Vec::new();
        let piece =
            |(part, name, file): (usize, &'static str, &str)| Entry { time: 0.5, part, name, file: file.into() };
        let entries: Vec<_> = [(0, "upper", "upper.vtu"), (1, "a<b", "a_b.vtu")].into_iter().map(piece).collect();
        write_pvd(&entries, &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.contains(r#"timestep="0.5" group="" part="0" name="upper" file="upper.vtu""#));
        assert!(text.contains(r#"part="1" name="a&lt;b" file="a_b.vtu""#), "{text}");
    }
}
