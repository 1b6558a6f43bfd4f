//! SVG pictures as PNG. The program brings its own font, as a machine without a display has none.

use super::contact::failed;
use crate::error::Result;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

/// Pixels of the PNG per pixel of the SVG, which makes figures sharp in print at the usual column width of 85 mm.
const SHARP: f32 = 2.0;

/// Return an SVG picture as PNG.
///
/// # Errors
/// [`Kind::File`](crate::error::Kind::File) for a text that is no SVG, and for a picture without or with too many pixels.
pub fn png(svg: &str) -> Result<Vec<u8>> {
    let mut options = Options::default();
    let fonts = options.fontdb_mut();
    fonts.load_font_data(dejavu::sans::regular().to_vec());
    fonts.load_font_data(dejavu::sans::bold().to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    let tree = Tree::from_str(svg, &options).map_err(failed)?;
    let size = tree.size().to_int_size().scale_by(SHARP).ok_or_else(|| failed("it has no size"))?;
    let mut pixels = Pixmap::new(size.width(), size.height()).ok_or_else(|| failed("it has too many pixels"))?;
    resvg::render(&tree, Transform::from_scale(SHARP, SHARP), &mut pixels.as_mut());
    pixels.encode_png().map_err(failed)
}
