//! Reader of the `.vtu` files of a run: XML with arrays in base64, compressed by zlib or not. It trusts nothing in them: sizes and counts
//! must agree with each other before anything is allocated for them, and blocks with their check sums.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use quick_xml::events::{BytesStart, Event};
use std::collections::HashMap;
use std::io::Read;

/// What is wrong with a file, in words.
type Said<T> = Result<T, String>;

/// A grid, or the files that have its parts.
pub enum Content {
    /// Parts in the file itself.
    Pieces(Vec<Piece>),
    /// Names of files beside a `.pvtu`.
    Sources(Vec<String>),
}

/// Points and cells with values at the points.
#[derive(Debug, Default, PartialEq)]
pub struct Piece {
    /// Points.
    pub points: Vec<[f64; 3]>,
    /// Kind of each cell by VTK's number, and its points.
    pub cells: Vec<(u8, Vec<usize>)>,
    /// Arrays at the points by name, point by point.
    pub at_points: HashMap<String, Vec<f64>>,
}

/// Numbers of an array.
enum Numbers {
    Real(Vec<f64>),
    Whole(Vec<u64>),
}

/// How the arrays of a file are encoded.
#[derive(Clone, Copy)]
struct Encoding {
    is_big: bool,
    /// Bytes of a size.
    size: usize,
    is_compressed: bool,
}

/// An array and where it stands.
struct Array {
    section: String,
    name: String,
    numbers: Numbers,
}

/// A piece that is being read.
struct Open {
    points: usize,
    cells: usize,
    arrays: Vec<Array>,
}

/// Reads a `.vtu` or `.pvtu` file.
///
/// # Errors
/// What is wrong with it.
pub fn read(bytes: &[u8]) -> Said<Content> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is no text")?;
    let mut reader = quick_xml::Reader::from_str(text);
    let (mut encoding, mut open, mut array) = (None::<Encoding>, None::<Open>, None::<HashMap<String, String>>);
    let (mut pieces, mut sources, mut sections, mut has_ended) = (Vec::new(), Vec::new(), Vec::<String>::new(), false);
    loop {
        match reader.read_event().map_err(|cause| cause.to_string())? {
            Event::Eof if has_ended => break,
            Event::Eof => return Err("it ends too early".to_owned()),
            Event::Start(tag) => {
                let (name, attributes) = (name_of(&tag), attributes(&tag)?);
                match name.as_str() {
                    "VTKFile" => encoding = Some(encoding_of(&attributes)?),
                    "Piece" => {
                        let count = |key: &str| number(&attributes, key);
                        open = Some(Open {
                            points: count("NumberOfPoints")?,
                            cells: count("NumberOfCells")?,
                            arrays: Vec::new(),
                        });
                    }
                    "DataArray" => array = Some(attributes),
                    _ => {}
                }
                sections.push(name);
            }
            Event::Empty(tag) if name_of(&tag) == "Piece" => {
                sources.extend(attributes(&tag)?.remove("Source"));
            }
            Event::Text(data) => {
                if let (Some(open), Some(attributes), Some(encoding)) = (&mut open, array.take(), encoding) {
                    let section = sections.iter().rev().nth(1).cloned().unwrap_or_default();
                    let name = attributes.get("Name").cloned().unwrap_or_default();
                    let numbers =
                        numbers(&attributes, &data, encoding).map_err(|what| format!("array `{name}`: {what}"))?;
                    open.arrays.push(Array { section, name, numbers });
                }
            }
            Event::End(tag) => {
                sections.pop();
                match tag.name().as_ref() {
                    b"Piece" => pieces.push(open.take().ok_or("a piece ends that has not begun")?.close()?),
                    b"DataArray" => array = None,
                    b"VTKFile" => has_ended = true,
                    _ => {}
                }
            }
            _ => {}
        }
    }
    match (pieces.is_empty(), sources.is_empty()) {
        (false, true) => Ok(Content::Pieces(pieces)),
        (true, false) => Ok(Content::Sources(sources)),
        _ => Err("it has no piece of an unstructured grid".to_owned()),
    }
}

fn name_of(tag: &BytesStart) -> String {
    String::from_utf8_lossy(tag.name().as_ref()).into_owned()
}

fn attributes(tag: &BytesStart) -> Said<HashMap<String, String>> {
    let attribute = |one: Result<quick_xml::events::attributes::Attribute, _>| {
        let one = one.map_err(|cause: quick_xml::events::attributes::AttrError| cause.to_string())?;
        let value = one.unescape_value().map_err(|cause| cause.to_string())?.into_owned();
        Ok((String::from_utf8_lossy(one.key.as_ref()).into_owned(), value))
    };
    tag.attributes().map(attribute).collect()
}

fn number(attributes: &HashMap<String, String>, key: &str) -> Said<usize> {
    attributes.get(key).and_then(|text| text.parse().ok()).ok_or_else(|| format!("a piece has no `{key}`"))
}

fn encoding_of(attributes: &HashMap<String, String>) -> Said<Encoding> {
    let text = |key: &str| attributes.get(key).map_or("", String::as_str);
    let size = match text("header_type") {
        "UInt64" => 8,
        "UInt32" | "" => 4,
        other => return Err(format!("sizes are of the type `{other}`")),
    };
    let is_compressed = match text("compressor") {
        "" => false,
        "vtkZLibDataCompressor" => true,
        other => return Err(format!("it is compressed by `{other}`, which is not read")),
    };
    let is_big = match text("byte_order") {
        "LittleEndian" => false,
        "BigEndian" => true,
        other => return Err(format!("its order of bytes is `{other}`")),
    };
    Ok(Encoding { is_big, size, is_compressed })
}

/// The numbers of an array.
fn numbers(attributes: &HashMap<String, String>, data: &[u8], encoding: Encoding) -> Said<Numbers> {
    let text = |key: &str| attributes.get(key).map_or("", String::as_str);
    if text("format") != "binary" {
        return Err(format!("its format is `{}`, not `binary`", text("format")));
    }
    let bytes = bytes(data.trim_ascii(), encoding)?;
    let whole = |size: usize| split(&bytes, size, encoding.is_big).map(Numbers::Whole);
    match text("type") {
        "UInt8" => whole(1),
        "UInt32" | "Int32" => whole(4),
        "UInt64" | "Int64" => whole(8),
        "Float64" => Ok(Numbers::Real(split(&bytes, 8, encoding.is_big)?.into_iter().map(f64::from_bits).collect())),
        "Float32" => {
            let bits = split(&bytes, 4, encoding.is_big)?;
            Ok(Numbers::Real(bits.into_iter().map(|bits| f64::from(f32::from_bits(bits as u32))).collect()))
        }
        other => Err(format!("its numbers are of the type `{other}`")),
    }
}

/// Numbers of so many bytes each.
fn split(bytes: &[u8], size: usize, is_big: bool) -> Said<Vec<u64>> {
    if !bytes.len().is_multiple_of(size) {
        return Err("it ends within a number".to_owned());
    }
    let value = |chunk: &[u8]| {
        let join = |all: u64, byte: &u8| all << 8 | u64::from(*byte);
        if is_big { chunk.iter().fold(0, join) } else { chunk.iter().rev().fold(0, join) }
    };
    Ok(bytes.chunks_exact(size).map(value).collect())
}

/// The bytes of an array: its sizes in base64, then what it has.
fn bytes(data: &[u8], encoding: Encoding) -> Said<Vec<u8>> {
    let decode = |text: &[u8]| STANDARD.decode(text).map_err(|cause| format!("no base64: {cause}"));
    let Encoding { is_big, size, is_compressed } = encoding;
    let short = || "it is shorter than it says".to_owned();
    if !is_compressed {
        let all = decode(data)?;
        let (head, rest) = all.split_at_checked(size).ok_or_else(short)?;
        return match split(head, size, is_big)?[0] == rest.len() as u64 {
            true => Ok(rest.to_vec()),
            false => Err("it has not as many bytes as it says".to_owned()),
        };
    }
    // three sizes at least stand in front, in an encoding of their own: the first one, which counts the blocks, then all
    let encoded = |bytes: usize| bytes.div_ceil(3).checked_mul(4);
    let first = encoded(size).and_then(|length| data.get(..length)).ok_or_else(short)?;
    let count = split(decode(first)?.get(..size).ok_or_else(short)?, size, is_big)?[0];
    let head = usize::try_from(count).ok().and_then(|count| count.checked_add(3)?.checked_mul(size));
    let head_length = head.and_then(encoded).filter(|&length| length <= data.len()).ok_or_else(short)?;
    let sizes = split(&decode(&data[..head_length])?, size, is_big)?;
    let [_, block, last, compressed @ ..] = &sizes[..] else { return Err(short()) };
    let mut rest = &decode(&data[head_length..])?[..];
    let mut all = Vec::new();
    for (k, &length) in compressed.iter().enumerate() {
        let (packed, after) =
            usize::try_from(length).ok().and_then(|length| rest.split_at_checked(length)).ok_or_else(short)?;
        let before = all.len() as u64;
        // no more than a block, whatever it claims
        let mut blocks = ZlibDecoder::new(packed).take(block.saturating_add(1));
        blocks.read_to_end(&mut all).map_err(|cause| format!("a block is damaged: {cause}"))?;
        let found = all.len() as u64 - before;
        let is_last = k + 1 == compressed.len();
        let fits = if is_last { found == *last || (*last == 0 && found == *block) } else { found == *block };
        if !fits || blocks.into_inner().total_in() != length {
            return Err("a block has not as many bytes as it says".to_owned());
        }
        rest = after;
    }
    if rest.is_empty() { Ok(all) } else { Err("it is longer than it says".to_owned()) }
}

impl Open {
    /// The piece, if all its counts agree.
    fn close(self) -> Said<Piece> {
        let Self { points: count, cells, arrays } = self;
        let (mut piece, mut lists, mut coordinates) = (Piece::default(), HashMap::new(), None);
        for Array { section, name, numbers } in arrays {
            match (section.as_str(), numbers) {
                ("Points", Numbers::Real(values)) => coordinates = Some(values),
                ("Cells", Numbers::Whole(values)) => drop(lists.insert(name, values)),
                ("PointData", Numbers::Real(values)) => {
                    if count == 0 || !values.len().is_multiple_of(count) || values.is_empty() {
                        return Err(format!("array `{name}` has {} values for {count} points", values.len()));
                    }
                    if values.iter().any(|value| value.is_infinite()) {
                        return Err(format!("array `{name}` has a value that is not finite"));
                    }
                    piece.at_points.insert(name, values);
                }
                _ => {}
            }
        }
        let coordinates = coordinates.filter(|x| Some(x.len()) == count.checked_mul(3));
        let coordinates = coordinates.ok_or_else(|| format!("it has not the {count} points that it says"))?;
        if !coordinates.iter().all(|x| x.is_finite()) {
            return Err("a coordinate is not finite".to_owned());
        }
        piece.points = coordinates.as_chunks().0.to_vec();
        let mut list = |name: &str| lists.remove(name).ok_or_else(|| format!("it has no {name} of cells"));
        let (nodes, ends, kinds) = (list("connectivity")?, list("offsets")?, list("types")?);
        if ends.len() != cells || kinds.len() != cells || ends.last().copied().unwrap_or(0) != nodes.len() as u64 {
            return Err(format!("it has not the {cells} cells that it says"));
        }
        let mut start = 0;
        for (&kind, &end) in kinds.iter().zip(&ends) {
            let nodes = nodes.get(start..end as usize).ok_or("a cell ends before it begins")?;
            let cell: Option<Vec<usize>> =
                nodes.iter().map(|&node| usize::try_from(node).ok().filter(|&node| node < count)).collect();
            piece.cells.push((kind as u8, cell.ok_or("a cell has a point that is not there")?));
            start = end as usize;
        }
        Ok(piece)
    }
}
