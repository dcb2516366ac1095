//! Reads how the pictures of a run are drawn.

use glam::DVec3;

use super::super::lowering::Lowering;
use super::declaration::declare_keys;
use super::{Block, Opening, Picture};
use crate::diagnostic::{Code, Diagnostic};
use crate::geom::{self, Aabb};
use crate::quantity::Dimension;
use crate::syntax::ast::{Comparison, Expr, ExprKind};

const AXES: [&str; 3] = ["x", "y", "z"];
const CUT_HELP: &str =
    "write `cut: y <= 0.5` for the part of the obstacles that is taken away, `cut: auto` or `cut: none`";

declare_keys! {
    /// Keys of a picture.
    mod keys {
        CAMERA = "camera", Vector(Dimension::NONE), Text("from the front, right and above"),
            "the direction from the scene to the eye, of any length";
        LOOK_AT = "look_at", Vector(Dimension::LENGTH), Text("the middle of the box"),
            "the place in the middle of the picture";
        ZOOM = "zoom", Number(Dimension::NONE, Bound::Positive), Is(1.0),
            "how many times as large as if the whole box were seen, 0.05 … 20";
        PROJECTION = "projection", Words(&["perspective", "parallel"]), Text("perspective"),
            "whether what is nearer is larger, or lines stay parallel, so that lengths across the view can be measured";
        CUT = "cut", Words(&["auto", "none"]), Text("auto"),
            "the part of the obstacles that is taken away: `y <= 0.5`, `auto` or `none`";
        FASTEST = "fastest", Number(Dimension::SPEED, Bound::Positive), Text("from the speeds that are expected, or at the end of a run from those of its frames if they differ much"),
            "the speed that has the last of the colours, so that pictures of several runs compare";
        HIDE = "hide", Other, Text("none"),
            "obstacles that are not drawn, by their names";
        GLASS = "glass", Other, Text("none"),
            "obstacles that are drawn clear, by their names";
    }
}

impl<'a> Lowering<'a> {
    /// Reads the block `picture` of a scene with these bodies in this box, if the box is known.
    pub(super) fn picture(
        &mut self,
        scene: &Block<'a>,
        bodies: &[&str],
        domain: Option<Aabb>,
    ) -> Option<Picture> {
        let Some((_, entries, span)) = scene.blocks("picture").next() else {
            return Some(Picture::default());
        };
        let block = self.block(entries, "a picture", span, keys::ALL, &[]);
        let camera = self.camera(&block)?;
        let look_at = self.stated_vector(&block, &keys::LOOK_AT)?;
        if let (Some(at), Some(domain), Some((_, value))) =
            (look_at, domain, block.setting(keys::LOOK_AT.name))
            && !domain.contains(at)
        {
            let message = "the place to look at lies outside of the box, where nothing is drawn";
            self.report(
                Diagnostic::warning(Code::PICTURE_ASIDE, value.span, message)
                    .help(format!("the middle of the box is {}", domain.centre().map(geom::significant))),
            );
        }
        let zoom = self.zoom(&block)?;
        let parallel = self.word_key(&block, &keys::PROJECTION, &[false, true], false)?;
        let cut = match block.setting(keys::CUT.name) {
            Some((_, value)) => self.opening(value)?,
            None => Opening::default(),
        };
        let fastest = self.stated_number(&block, &keys::FASTEST)?;
        let hide = self.obstacles(&block, keys::HIDE.name, bodies)?;
        let glass = self.obstacles(&block, keys::GLASS.name, bodies)?;
        Some(Picture { camera, look_at, zoom, parallel, cut, fastest, hide, glass })
    }

    /// Reads the names of obstacles: one, or a list of them.
    fn obstacles(&mut self, block: &Block<'_>, key: &str, bodies: &[&str]) -> Option<Vec<String>> {
        let Some((_, value)) = block.setting(key) else { return Some(Vec::new()) };
        let names = match &value.kind {
            ExprKind::Vector(names) => names.as_slice(),
            _ => std::slice::from_ref(value),
        };
        let name = |name: &Expr| {
            let found = self.one_of(name, key, bodies, "obstacle of this scene")?;
            Some(bodies[found].to_string())
        };
        names.iter().map(name).collect()
    }

    /// Reads the direction to the eye. The outer option is `None` if it is wrong, which is reported; the
    /// inner one if it is not stated.
    fn camera(&mut self, block: &Block<'_>) -> Option<Option<DVec3>> {
        let Some((_, value)) = block.setting(keys::CAMERA.name) else { return Some(None) };
        let help = "it is the direction from the scene to the eye: write `camera: [0, -1, 0.5]`";
        if let ExprKind::Number(_) | ExprKind::Quantity { .. } = value.kind {
            let message = "`camera` is a vector `[x, y, z]`, found a number";
            self.report(Diagnostic::error(Code::WRONG_TYPE, value.span, message).help(help));
            return None;
        }
        let camera = self.vector_key(block, &keys::CAMERA)?;
        if camera == DVec3::ZERO {
            let message = "`camera` must have a length, found [0, 0, 0]";
            self.report(Diagnostic::error(Code::OUT_OF_RANGE, value.span, message).help(help));
            return None;
        }
        Some(Some(camera))
    }

    /// Reads how large the picture is. The outer option is `None` if it is wrong, which is reported; the
    /// inner one if it is not stated.
    fn zoom(&mut self, block: &Block<'_>) -> Option<Option<f64>> {
        let Some((_, value)) = block.setting(keys::ZOOM.name) else { return Some(None) };
        let zoom = self.quantity_expr(value, Dimension::NONE, keys::ZOOM.name)?;
        if Picture::ZOOMS.contains(&zoom) {
            return Some(Some(zoom));
        }
        let (least, most) = (Picture::ZOOMS.start(), Picture::ZOOMS.end());
        let message = format!("`zoom` must be from {least} to {most}, found {zoom}");
        let help = "it is how many times as large as if the whole box were seen: write `zoom: 2`";
        self.report(Diagnostic::error(Code::OUT_OF_RANGE, value.span, message).help(help));
        None
    }

    /// Reads what is taken away of obstacles: a word, or a comparison of one coordinate with a number.
    fn opening(&mut self, value: &Expr) -> Option<Opening> {
        match &value.kind {
            ExprKind::Name(word) if word == "auto" => return Some(Opening::Automatic),
            ExprKind::Name(word) if word == "none" => return Some(Opening::None),
            ExprKind::Compare { first, rest } => {
                if let [(comparison, _, second)] = &rest[..]
                    && let Some(less) = is_less(*comparison)
                {
                    let (axis, number, below) = match (axis(first), axis(second)) {
                        (Some(axis), None) => (axis, second, less),
                        (None, Some(axis)) => (axis, &**first, !less),
                        (Some(_), Some(_)) | (None, None) => return self.no_opening(value),
                    };
                    let at = self.quantity_expr(number, Dimension::LENGTH, keys::CUT.name)?;
                    return if at.is_finite() {
                        Some(Opening::Half { axis, at, below })
                    } else {
                        self.no_opening(value)
                    };
                }
            }
            _ => {}
        }
        self.no_opening(value)
    }

    fn no_opening(&mut self, value: &Expr) -> Option<Opening> {
        self.report(Diagnostic::error(Code::SCENE_KEY, value.span, "unknown value of `cut`").help(CUT_HELP));
        None
    }
}

/// The number of the coordinate that a name stands for.
fn axis(expr: &Expr) -> Option<usize> {
    match &expr.kind {
        ExprKind::Name(name) => AXES.iter().position(|axis| axis == name),
        _ => None,
    }
}

/// Whether the left side is the smaller one; `None` for signs that are no inequality.
fn is_less(comparison: Comparison) -> Option<bool> {
    match comparison {
        Comparison::LessEqual | Comparison::Less => Some(true),
        Comparison::GreaterEqual | Comparison::Greater => Some(false),
        Comparison::Equal | Comparison::NotEqual => None,
    }
}
