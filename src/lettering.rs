//! Words in drawings: the texts of an SVG document become outlines of the one built-in font.
//!
//! Our drawings hold a few words that run from left to right. A glyph for each character, ligatures and
//! kerning are enough for them. Layout for every script would take longer to build than all other parts of
//! the pictures.
//!
//! Invariant: no font of the system is read, so a picture does not depend on the machine.

use std::fmt::Write;
use std::sync::LazyLock;

use resvg::usvg::{Options, Tree};
use roxmltree::{Document, Node};
use ttf_parser::gpos::{PairAdjustment, PositioningSubtable};
use ttf_parser::gsub::SubstitutionSubtable;
use ttf_parser::opentype_layout::{LayoutTable, Lookup};
use ttf_parser::{Face, GlyphId, OutlineBuilder, Tag};

/// Font size that an SVG renderer assumes if no `font-size` is given.
const DEFAULT_SIZE: f64 = 12.0;

/// Reads an SVG document and turns its words into outlines. Letters are placed only by `x`, `y`, `font-size`
/// and `text-anchor` of a text, and by `dx` of the `<tspan>`s in it.
///
/// # Errors
/// Returns what is wrong with the document.
pub(crate) fn tree(svg: &str) -> Result<Tree, String> {
    let document = Document::parse(svg).map_err(|error| error.to_string())?;
    Tree::from_str(&outlined(svg, &document), &Options::default()).map_err(|error| error.to_string())
}

/// Returns the document with a group of paths in place of each text.
fn outlined(svg: &str, document: &Document<'_>) -> String {
    let mut out = String::new();
    let mut copied = 0;
    for text in document.descendants().filter(|node| node.has_tag_name("text")) {
        out.push_str(&svg[copied..text.range().start]);
        copied = text.range().end;
        let _ = write!(out, "<g{}>{}</g>", style(svg, text), paths(svg, text));
    }
    out.push_str(&svg[copied..]);
    out
}

/// Attributes that say how a text is drawn, exactly as the document writes them.
fn style(svg: &str, text: Node<'_, '_>) -> String {
    let places = ["x", "y", "dx", "font-size", "font-weight", "text-anchor"];
    let kept = text.attributes().filter(|attribute| !places.contains(&attribute.name()));
    kept.map(|attribute| format!(" {}", &svg[attribute.range()])).collect()
}

/// Writes a path for each part of a text.
fn paths(svg: &str, text: Node<'_, '_>) -> String {
    let number = |node: Node<'_, '_>, name: &str| node.attribute(name).and_then(|x| x.parse::<f64>().ok());
    let inherited = |name: &str| text.ancestors().find_map(|node| node.attribute(name));
    let size = inherited("font-size").and_then(|size| size.parse().ok()).unwrap_or(DEFAULT_SIZE);
    let scale = size / f64::from(FONT.face.units_per_em());

    let words = |part: Node<'_, '_>| -> String {
        part.descendants().filter(Node::is_text).filter_map(|node| node.text()).collect()
    };
    let parts: Vec<_> = text.children().map(|part| (part, FONT.glyphs(&words(part)))).collect();
    let mut starts = Vec::new();
    let mut width = 0.0;
    for (i, (part, glyphs)) in parts.iter().enumerate() {
        width += number(*part, "dx").unwrap_or(0.0);
        starts.push(width);
        let next = parts.get(i + 1).and_then(|(_, glyphs)| glyphs.first());
        width += scale * FONT.width(glyphs, next);
    }
    let before = match inherited("text-anchor") {
        Some("middle") => 0.5 * width,
        Some("end") => width,
        _ => 0.0,
    };
    let [x, y] = ["x", "y"].map(|name| number(text, name).unwrap_or(0.0));
    let path = |((part, glyphs), start): (&(Node<'_, '_>, Vec<GlyphId>), f64)| {
        let outline = FONT.outline(glyphs, [x - before + start, y], scale);
        format!(r#"<path{} d="{outline}"/>"#, style(svg, *part))
    };
    parts.iter().zip(starts).map(path).collect()
}

/// A closed outline of Bézier curves of third order, each of which begins where the one before ends. Straight
/// pieces are such curves too.
pub(crate) type Contour = Vec<[[f64; 2]; 4]>;

/// The outlines of each glyph of a line of text that begins at the origin, in heights of a capital letter; y points up.
///
/// # Errors
/// Returns the first character that the font does not have.
pub(crate) fn contours(words: &str) -> Result<Vec<Vec<Contour>>, char> {
    if let Some(unknown) = words.chars().find(|c| c.is_control() || FONT.face.glyph_index(*c).is_none()) {
        return Err(unknown);
    }
    let glyphs = FONT.glyphs(words);
    let capital = FONT.face.capital_height().unwrap_or_else(|| FONT.face.ascender());
    let scale = 1.0 / f64::from(capital);
    let mut x = 0.0;
    let mut all = Vec::with_capacity(glyphs.len());
    for (i, &glyph) in glyphs.iter().enumerate() {
        let mut tracer = Tracer { contours: Vec::new(), begin: [0.0; 2], at: [0.0; 2], x, scale };
        FONT.face.outline_glyph(glyph, &mut tracer);
        x += scale * FONT.advance(glyph, glyphs.get(i + 1));
        all.push(tracer.contours);
    }
    Ok(all)
}

/// Built-in font with its rules for adjacent glyphs.
struct Font {
    face: Face<'static>,
    ligatures: Vec<Lookup<'static>>,
    kerning: Vec<Lookup<'static>>,
}

static FONT: LazyLock<Font> = LazyLock::new(|| {
    let face =
        Face::parse(epaint_default_fonts::UBUNTU_LIGHT, 0).expect("the font that is built in is valid");
    Font {
        ligatures: face.tables().gsub.map_or_else(Vec::new, |table| lookups(table, b"liga")),
        kerning: face.tables().gpos.map_or_else(Vec::new, |table| lookups(table, b"kern")),
        face,
    }
});

/// Tables of a feature for Latin script. Text in a script without letters of its own uses them too.
fn lookups(table: LayoutTable<'static>, feature: &[u8; 4]) -> Vec<Lookup<'static>> {
    let script = table.scripts.find(Tag::from_bytes(b"latn"));
    let Some(language) = script.and_then(|script| script.default_language) else { return Vec::new() };
    let features = language.feature_indices.into_iter().filter_map(|index| table.features.get(index));
    let features = features.filter(|found| found.tag == Tag::from_bytes(feature));
    features.flat_map(|found| found.lookup_indices).filter_map(|index| table.lookups.get(index)).collect()
}

impl Font {
    /// Returns a glyph for each character, or the font's box if the character is unknown. Ligatures are
    /// joined.
    fn glyphs(&self, words: &str) -> Vec<GlyphId> {
        let of = |character| self.face.glyph_index(character).unwrap_or_default();
        let mut glyphs: Vec<GlyphId> = words.chars().filter(|c| !c.is_control()).map(of).collect();
        for lookup in &self.ligatures {
            let mut at = 0;
            while at < glyphs.len() {
                if let Some((ligature, others)) = ligature(lookup, &glyphs[at..]) {
                    glyphs.splice(at..=at + others, [ligature]);
                }
                at += 1;
            }
        }
        glyphs
    }

    /// Distance to the next glyph, in units of the font.
    fn advance(&self, glyph: GlyphId, next: Option<&GlyphId>) -> f64 {
        let own = self.face.glyph_hor_advance(glyph).unwrap_or(0);
        let kerning = self.kerning.iter().filter_map(|lookup| kerning(lookup, glyph, *next?));
        f64::from(own) + kerning.map(f64::from).sum::<f64>()
    }

    /// Width of glyphs that stand before `next`, in units of the font.
    fn width(&self, glyphs: &[GlyphId], next: Option<&GlyphId>) -> f64 {
        (0..glyphs.len()).map(|i| self.advance(glyphs[i], glyphs.get(i + 1).or(next))).sum()
    }

    /// Returns the data of an SVG path.
    fn outline(&self, glyphs: &[GlyphId], [x, y]: [f64; 2], scale: f64) -> String {
        let mut pen = Pen { path: String::new(), x, y, scale };
        for (i, &glyph) in glyphs.iter().enumerate() {
            self.face.outline_glyph(glyph, &mut pen);
            pen.x += scale * self.advance(glyph, glyphs.get(i + 1));
        }
        pen.path
    }
}

/// Returns the ligature that begins these glyphs, and how many glyphs it takes after the first.
fn ligature(lookup: &Lookup<'_>, glyphs: &[GlyphId]) -> Option<(GlyphId, usize)> {
    lookup.subtables.into_iter().find_map(|table| {
        let SubstitutionSubtable::Ligature(table) = table else { return None };
        let set = table.ligature_sets.get(table.coverage.get(glyphs[0])?)?;
        let found = set.into_iter().find(|ligature| {
            let others = usize::from(ligature.components.len());
            glyphs
                .get(1..=others)
                .is_some_and(|next| ligature.components.into_iter().eq(next.iter().copied()))
        })?;
        Some((found.glyph, usize::from(found.components.len())))
    })
}

/// Extra width of the first of two glyphs, in units of the font.
fn kerning(lookup: &Lookup<'_>, first: GlyphId, second: GlyphId) -> Option<i16> {
    lookup.subtables.into_iter().find_map(|table| {
        let PositioningSubtable::Pair(table) = table else { return None };
        let covered = table.coverage().get(first)?;
        let (values, _) = match table {
            PairAdjustment::Format1 { sets, .. } => sets.get(covered)?.get(second)?,
            PairAdjustment::Format2 { classes, matrix, .. } => {
                matrix.get((classes.0.get(first), classes.1.get(second)))?
            }
        };
        Some(values.x_advance)
    })
}

/// Draws glyphs on a page whose y points down.
struct Pen {
    path: String,
    /// Position where the present glyph begins.
    x: f64,
    y: f64,
    /// Units of the page in one unit of the font.
    scale: f64,
}

impl Pen {
    fn draw<const N: usize>(&mut self, command: char, points: [(f32, f32); N]) {
        self.path.push(command);
        for (x, y) in points {
            // The rasteriser has single precision only.
            let x = (self.x + self.scale * f64::from(x)) as f32;
            let y = (self.y - self.scale * f64::from(y)) as f32;
            let _ = write!(self.path, "{x} {y} ");
        }
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.draw('M', [(x, y)]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.draw('L', [(x, y)]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.draw('Q', [(x1, y1), (x, y)]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.draw('C', [(x1, y1), (x2, y2), (x, y)]);
    }

    fn close(&mut self) {
        self.path.push('z');
    }
}

/// Collects the outlines of a glyph.
struct Tracer {
    contours: Vec<Contour>,
    begin: [f64; 2],
    at: [f64; 2],
    /// Position where the glyph begins.
    x: f64,
    scale: f64,
}

impl Tracer {
    fn place(&self, x: f32, y: f32) -> [f64; 2] {
        [self.x + self.scale * f64::from(x), self.scale * f64::from(y)]
    }

    fn curve(&mut self, a: [f64; 2], b: [f64; 2], end: [f64; 2]) {
        if let Some(contour) = self.contours.last_mut() {
            contour.push([self.at, a, b, end]);
        }
        self.at = end;
    }

    fn line(&mut self, end: [f64; 2]) {
        let part = |t: f64| between(self.at, end, t);
        self.curve(part(1.0 / 3.0), part(2.0 / 3.0), end);
    }
}

fn between(a: [f64; 2], b: [f64; 2], t: f64) -> [f64; 2] {
    [0, 1].map(|i| a[i] + t * (b[i] - a[i]))
}

impl OutlineBuilder for Tracer {
    fn move_to(&mut self, x: f32, y: f32) {
        self.begin = self.place(x, y);
        self.at = self.begin;
        self.contours.push(Vec::new());
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.line(self.place(x, y));
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (middle, end) = (self.place(x1, y1), self.place(x, y));
        self.curve(between(self.at, middle, 2.0 / 3.0), between(end, middle, 2.0 / 3.0), end);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.curve(self.place(x1, y1), self.place(x2, y2), self.place(x, y));
    }

    fn close(&mut self) {
        if self.at != self.begin {
            self.line(self.begin);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(text: &str) -> String {
        let svg = format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" width="200" height="50" font-size="20">{text}</svg>"#
        );
        assert!(tree(&svg).is_ok());
        outlined(&svg, &Document::parse(&svg).unwrap())
    }

    /// Least and greatest x of a text's outlines.
    fn extent(text: &str) -> (f64, f64) {
        let drawn = drawn(text);
        let data = drawn.split(" d=\"").skip(1).map(|rest| rest.split('"').next().unwrap());
        let numbers =
            data.flat_map(|data| data.split([' ', 'M', 'L', 'Q', 'C', 'z'])).filter(|n| !n.is_empty());
        let x = numbers.step_by(2).map(|x| x.parse::<f64>().unwrap());
        x.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    }

    #[test]
    fn letters_stand_where_their_anchor_says() {
        let anchored = |anchor: &str| extent(&format!(r#"<text x="100" y="20"{anchor}>HOH</text>"#));
        let (start, end) = (anchored(""), anchored(r#" text-anchor="end""#));
        let (low, high) = anchored(r#" text-anchor="middle""#);
        assert!((low + high - 200.0).abs() < 0.01, "{low} {high}");
        assert!(start.0 > 100.0 && start.0 < 103.0 && end.1 < 100.0 && end.1 > 97.0, "{start:?} {end:?}");
    }

    #[test]
    fn pairs_are_kerned_and_ligatures_joined() {
        let width = |words: &str| FONT.width(&FONT.glyphs(words), None);
        assert!(width("AV") < width("A") + width("V"));
        assert_eq!(width("10"), width("1") + width("0"));
        assert_eq!(FONT.glyphs("fi fl").len(), 3);
        assert_eq!(FONT.glyphs("ω > −0.5").len(), 8);
        assert_eq!(FONT.glyphs("\u{5b57}"), [GlyphId(0)]);
    }

    #[test]
    fn styles_stay_and_texts_go() {
        let svg = drawn(
            r##"<text x="3" stroke="#123" y="9">a<tspan fill="#555" dx="9">b &lt; c</tspan></text><path d="M0 0"/>"##,
        );
        assert!(
            !svg.contains("<text") && !svg.contains("tspan") && svg.contains(r#"<path d="M0 0"/>"#),
            "{svg}"
        );
        assert!(
            svg.contains(r##"<g stroke="#123"><path d="M"##) && svg.contains(r##"<path fill="#555" d="M"##),
            "{svg}"
        );
    }
}
