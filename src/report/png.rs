//! SVG → PNG, with letters of our own, so that it looks the same on a computer without fonts.

use std::sync::{Arc, LazyLock};

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{self, Options, Tree, fontdb};

use crate::error::{Error, Result};

/// Latin, Greek and Cyrillic letters of DejaVu Sans.
const LETTERS: &[u8] = include_bytes!("assets/DejaVuSans.subset.ttf");
/// Pixels of the picture for each of the drawing.
const SCALE: f32 = 2.0;

static FONTS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(LETTERS.to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    Arc::new(fonts)
});

/// A drawing as a picture.
///
/// # Errors
/// [`Error::Drawing`] where it is no SVG.
pub fn png(svg: &str) -> Result<Vec<u8>> {
    let failed = |detail: String| Error::Drawing { detail };
    let options = Options { fontdb: Arc::clone(&FONTS), font_family: "DejaVu Sans".to_owned(), ..Options::default() };
    let tree = Tree::from_str(svg, &options).map_err(|e: usvg::Error| failed(e.to_string()))?;
    let size = tree.size().to_int_size();
    let side = |px: u32| (SCALE * px as f32) as u32;
    let mut picture =
        Pixmap::new(side(size.width()), side(size.height())).ok_or_else(|| failed("it is empty".to_owned()))?;
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut picture.as_mut());
    picture.encode_png().map_err(|e| failed(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_drawn_without_any_font_of_the_system() {
        let svg = |words: &str| {
            format!(
                r#"<svg xmlns="http://www.w3.org/2000/svg" width="200" height="40"><text x="4" y="30" font-size="24" font-family="Helvetica, sans-serif">{words}</text></svg>"#
            )
        };
        let dark = |words: &str| {
            let picture = image::load_from_memory(&png(&svg(words)).unwrap()).unwrap().to_rgba8();
            picture.pixels().filter(|p| p.0[3] > 128).count()
        };
        assert_eq!(dark(""), 0);
        // one after the other, so that none hides behind the others
        for letter in ["f", "θ", "ξ", "₁", "−", "·", "±", "é", "я"] {
            assert!(dark(letter) > 20, "{letter}");
        }
        assert_ne!(png(&svg("θ")).unwrap(), png(&svg("ξ")).unwrap());
    }
}
