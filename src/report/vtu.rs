//! The reader of the `.vtu` files of a run: XML with arrays in base64, compressed by zlib or not.
//!
//! The reader trusts no file. Sizes and counts must agree with each other before memory is allocated for them, and blocks must agree with
//! their checksums.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use quick_xml::events::{BytesStart, Event};
use std::collections::HashMap;
use std::io::Read;

/// A value, or a description of what is wrong with the file.
type Parsed<T> = Result<T, String>;

/// The attributes of an element by name.
type Attributes = HashMap<String, String>;

/// The content of a file: a grid, or the names of the files with its parts.
pub enum Content {
    /// Pieces in the file itself.
    Pieces(Vec<Piece>),
    /// Names of the files that a `.pvtu` joins, in the same folder.
    Sources(Vec<String>),
}

/// Points and cells with values at the points.
#[derive(Debug, Default, PartialEq)]
pub struct Piece {
    /// Points.
    pub points: Vec<[f64; 3]>,
    /// Type number in VTK and point numbers of each cell.
    pub cells: Vec<(u8, Vec<usize>)>,
    /// Arrays at the points by name; all components of a point stand together.
    pub at_points: HashMap<String, Vec<f64>>,
}

/// The numbers of an array.
enum Numbers {
    Real(Vec<f64>),
    Whole(Vec<u64>),
}

/// The encoding of the arrays of a file.
#[derive(Clone, Copy)]
struct Encoding {
    /// Whether numbers are big-endian.
    is_big: bool,
    /// Bytes of a size in the header of an array.
    size: usize,
    is_compressed: bool,
}

/// An array of a piece.
struct Array {
    /// Name of the element around it, such as `PointData`.
    section: String,
    name: String,
    numbers: Numbers,
}

/// A piece that is being read: its numbers of points and cells, and the arrays so far.
struct OpenPiece {
    points: usize,
    cells: usize,
    arrays: Vec<Array>,
}

/// Read a `.vtu` or `.pvtu` file.
///
/// # Errors
/// A description of what is wrong with the file.
pub fn read(bytes: &[u8]) -> Parsed<Content> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is no text")?;
    let mut reader = quick_xml::Reader::from_str(text);
    let mut document = Document::default();
    loop {
        match reader.read_event().map_err(|cause| cause.to_string())? {
            Event::Eof if document.has_ended => return document.content(),
            Event::Eof => return Err("it ends too early".to_owned()),
            Event::Start(tag) => document.start(&tag)?,
            Event::Empty(tag) if name_of(&tag) == "Piece" => {
                document.sources.extend(attributes(&tag)?.remove("Source"));
            }
            Event::Text(data) => document.text(&data)?,
            Event::End(tag) => document.end(tag.name().as_ref())?,
            _ => {}
        }
    }
}

/// The part of a file that has been read so far.
#[derive(Default)]
struct Document {
    encoding: Option<Encoding>,
    /// Names of the elements around the current position.
    elements: Vec<String>,
    piece: Option<OpenPiece>,
    /// Attributes of the current array, until its data is read.
    array: Option<Attributes>,
    pieces: Vec<Piece>,
    sources: Vec<String>,
    has_ended: bool,
}

impl Document {
    /// Process the start tag of an element.
    fn start(&mut self, tag: &BytesStart) -> Parsed<()> {
        let (name, attributes) = (name_of(tag), attributes(tag)?);
        match name.as_str() {
            "VTKFile" => self.encoding = Some(encoding_of(&attributes)?),
            "Piece" => {
                let count = |key: &str| number(&attributes, key);
                let (points, cells) = (count("NumberOfPoints")?, count("NumberOfCells")?);
                self.piece = Some(OpenPiece { points, cells, arrays: Vec::new() });
            }
            "DataArray" => self.array = Some(attributes),
            _ => {}
        }
        self.elements.push(name);
        Ok(())
    }

    /// Process text, which may be the data of an array.
    fn text(&mut self, data: &[u8]) -> Parsed<()> {
        let (Some(piece), Some(attributes), Some(encoding)) = (&mut self.piece, self.array.take(), self.encoding)
        else {
            return Ok(());
        };
        let section = self.elements.iter().rev().nth(1).cloned().unwrap_or_default();
        let name = attributes.get("Name").cloned().unwrap_or_default();
        let numbers = numbers(&attributes, data, encoding).map_err(|what| format!("array `{name}`: {what}"))?;
        piece.arrays.push(Array { section, name, numbers });
        Ok(())
    }

    /// Process the end tag of an element.
    fn end(&mut self, name: &[u8]) -> Parsed<()> {
        self.elements.pop();
        match name {
            b"Piece" => self.pieces.push(self.piece.take().ok_or("a piece ends that has not begun")?.close()?),
            b"DataArray" => self.array = None,
            b"VTKFile" => self.has_ended = true,
            _ => {}
        }
        Ok(())
    }

    /// Return the content of the whole file.
    fn content(self) -> Parsed<Content> {
        match (self.pieces.is_empty(), self.sources.is_empty()) {
            (false, true) => Ok(Content::Pieces(self.pieces)),
            (true, false) => Ok(Content::Sources(self.sources)),
            _ => Err("it has no piece of an unstructured grid".to_owned()),
        }
    }
}

/// Return the name of an element.
fn name_of(tag: &BytesStart) -> String {
    String::from_utf8_lossy(tag.name().as_ref()).into_owned()
}

/// Return the attributes of an element.
fn attributes(tag: &BytesStart) -> Parsed<Attributes> {
    let attribute = |one: Result<quick_xml::events::attributes::Attribute, _>| {
        let one = one.map_err(|cause: quick_xml::events::attributes::AttrError| cause.to_string())?;
        let value = one.unescape_value().map_err(|cause| cause.to_string())?.into_owned();
        Ok((String::from_utf8_lossy(one.key.as_ref()).into_owned(), value))
    };
    tag.attributes().map(attribute).collect()
}

/// Return the number in an attribute of a piece.
fn number(attributes: &Attributes, key: &str) -> Parsed<usize> {
    attributes.get(key).and_then(|text| text.parse().ok()).ok_or_else(|| format!("a piece has no `{key}`"))
}

/// Return the encoding from the attributes of the root element.
fn encoding_of(attributes: &Attributes) -> Parsed<Encoding> {
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

/// Decode the numbers of an array.
fn numbers(attributes: &Attributes, data: &[u8], encoding: Encoding) -> Parsed<Numbers> {
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

/// Split bytes into numbers of `size` bytes each.
fn split(bytes: &[u8], size: usize, is_big: bool) -> Parsed<Vec<u64>> {
    if !bytes.len().is_multiple_of(size) {
        return Err("it ends within a number".to_owned());
    }
    let value = |chunk: &[u8]| {
        let join = |all: u64, byte: &u8| all << 8 | u64::from(*byte);
        if is_big { chunk.iter().fold(0, join) } else { chunk.iter().rev().fold(0, join) }
    };
    Ok(bytes.chunks_exact(size).map(value).collect())
}

/// Decode the bytes of an array, which follow their sizes.
fn bytes(data: &[u8], encoding: Encoding) -> Parsed<Vec<u8>> {
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
    // The data begins with at least three sizes, which are encoded separately. The first size is the number of blocks, and
    // it tells how long the encoded sizes are.
    let encoded = |bytes: usize| bytes.div_ceil(3).checked_mul(4);
    let first = encoded(size).and_then(|length| data.get(..length)).ok_or_else(short)?;
    let count = split(decode(first)?.get(..size).ok_or_else(short)?, size, is_big)?[0];
    let head = usize::try_from(count).ok().and_then(|count| count.checked_add(3)?.checked_mul(size));
    let head_length = head.and_then(encoded).filter(|&length| length <= data.len()).ok_or_else(short)?;
    let sizes = split(&decode(&data[..head_length])?, size, is_big)?;
    let [_, block, last, compressed @ ..] = &sizes[..] else { return Err(short()) };
    inflate(&decode(&data[head_length..])?, compressed, *block, *last)
}

/// Decompress blocks with these compressed lengths. Each has `block` bytes, and the last one has `last`, or `block` if that is 0.
fn inflate(packed: &[u8], lengths: &[u64], block: u64, last: u64) -> Parsed<Vec<u8>> {
    let (mut rest, mut all) = (packed, Vec::new());
    for (k, &length) in lengths.iter().enumerate() {
        let (packed, after) = usize::try_from(length)
            .ok()
            .and_then(|length| rest.split_at_checked(length))
            .ok_or("it is shorter than it says")?;
        let before = all.len() as u64;
        // at most one byte more than a block is read, whatever the block claims
        let mut blocks = ZlibDecoder::new(packed).take(block.saturating_add(1));
        blocks.read_to_end(&mut all).map_err(|cause| format!("a block is damaged: {cause}"))?;
        let found = all.len() as u64 - before;
        let is_last = k + 1 == lengths.len();
        let fits = if is_last { found == last || (last == 0 && found == block) } else { found == block };
        if !fits || blocks.into_inner().total_in() != length {
            return Err("a block has not as many bytes as it says".to_owned());
        }
        rest = after;
    }
    if rest.is_empty() { Ok(all) } else { Err("it is longer than it says".to_owned()) }
}

impl OpenPiece {
    /// Return the piece, if all its counts agree.
    fn close(self) -> Parsed<Piece> {
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
