//! Bulk data of Nastran (`.bdf`, `.nas`) in a form that Gmsh can read.

mod cards;
mod solids;
mod systems;

use crate::error::{Error, Result};
use cards::{Card, cards};
use std::path::Path;

/// Return the bulk data with all grid points in the basic system, and with cards of solids that Gmsh understands. All other lines are
/// those of the file, without empty ones.
///
/// # Errors
/// A card is malformed, or a point lies in a system that is not there or not known. Another file is to be included. The error names the
/// line.
pub fn readable(path: &Path, text: &str) -> Result<String> {
    let lines: Vec<&str> = text.lines().collect();
    let includes = |line: &&str| line.trim_start().get(..8).is_some_and(|word| word.eq_ignore_ascii_case("INCLUDE "));
    if let Some(at) = lines.iter().position(includes) {
        return Err(Error::mesh(path, Some(at + 1), "files that include others are not read")
            .help("put the files together into one"));
    }
    let all = cards(&lines, |name| systems::is_ours(name) || solids::is_ours(name));
    let of = |is_ours: fn(&str) -> bool| all.iter().filter(|card| is_ours(&card.name)).collect::<Vec<&Card>>();
    let mut made: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
    systems::to_basic(path, &of(systems::is_ours), &mut made)?;
    solids::to_small_fields(path, &of(solids::is_ours), &mut made)?;
    made.retain(|line| !line.is_empty());
    Ok(made.join("\n") + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(text: &str) -> String {
        readable(Path::new("a.bdf"), text).unwrap_or_else(|error| error.to_string())
    }

    /// The fields of a quadratic prism in each of the three forms, with and without marks.
    #[test]
    fn fields_are_found_in_all_forms() {
        let wide = |first: &str, fields: &[u32]| {
            format!("{first:<8}{}\n", fields.iter().map(|field| format!("{field:>16}")).collect::<String>())
        };
        let nodes: Vec<u32> = [7, 2].into_iter().chain(11..26).collect();
        let rows: Vec<String> =
            (0..5).map(|k| wide(["CPENTA*", "*"][usize::from(k > 0)], &nodes[4 * k..17.min(4 * k + 4)])).collect();
        let small = |mark: &str| {
            let row = |fields: &[u32]| fields.iter().map(|field| format!("{field:<8}")).collect::<String>();
            format!(
                "CPENTA  {}{mark}\n{mark:<8}{}{mark}\n{mark:<8}{}\n",
                row(&nodes[..8]),
                row(&nodes[8..16]),
                row(&nodes[16..])
            )
        };
        let expected = "CPENTA  7       2       11      12      13      14      15      16      +\n\
                        +       17      18      19      20      21      22      23      24      +\n\
                        +       25      \n$\n";
        for text in [
            rows.concat() + &wide("*", &[]),
            small("+A"),
            small(""),
            "CPENTA,7,2,11,12,13,14,15,16\n,17,18,19,20,21,22,23,24\n,25\n".to_owned(),
            "CPENTA,7,2,11,12,13,14,15,16,+P\n+P,17,18,19,20,21,22,23,24,+Q\n+Q,25\n".to_owned(),
        ] {
            assert_eq!(made(&format!("{text}GRID,1,,0.,0.,0.\n")), format!("{expected}GRID,1,,0.,0.,0.\n"), "{text}");
        }
    }

    #[test]
    fn elements_have_all_mid_edge_nodes_or_none() {
        assert!(
            made("$\nCTRIA6,1,1,1,2,3,4,,6\n").contains("a.bdf:2: CTRIA6: element 1 has some of its mid-edge nodes")
        );
        assert!(made("CTRIA6,1,1,1,2,3,4,x,6\n").contains("`x` is no number"));
        assert!(made("CTRIA6,1,1,1,2,3\n").starts_with("CTRIA3  1 "));
        assert!(made("CQUAD8,1,1,1,2,3,4,,\n,,,0.5\n").starts_with("CQUAD4  1 "));
        let pyramid = made("CPYRAM,1,1,1,2,3,4,5,6\n,7,8,9,10,11,12,13\n");
        let nodes: Vec<&str> = pyramid.split_whitespace().filter(|word| *word != "+").collect();
        assert_eq!(nodes.join(" "), "CHEXA 1 1 1 2 3 4 5 5 5 5 6 7 8 9 10 11 12 13 5 5 5 5 $");
    }
}
