//! What the language's own words mean: signatures and one line each.

use rfm::lower::vocabulary;
use rfm::syntax::ast::{Function, Item};

/// A word with its parameters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::cli) struct Signature {
    pub name: String,
    pub parameters: Vec<String>,
    pub about: String,
}

impl Signature {
    /// `name(a, b = 1)`
    pub fn label(&self) -> String {
        format!("{}({})", self.name, self.parameters.join(", "))
    }
}

/// Whether a sign may stand in a word, as the grammar has it: exponents such as `²` may not.
pub(in crate::cli) fn is_of_a_word(c: char) -> bool {
    c.is_alphabetic() || c.is_ascii_digit() || c == '_'
}

/// What begins an item, and what it defines.
pub(in crate::cli) const ITEMS: [(&str, &str); 6] = [
    ("import", "what another file defines: `import \"chess.rfm\" as chess`"),
    ("param", "a number that the command line may set, within its range"),
    ("let", "a name for an expression"),
    ("fn", "a function"),
    ("solid", "a solid: positive inside"),
    ("scene", "what a simulation needs"),
];

/// Words and names that have a meaning of their own between functions.
pub(in crate::cli) const SIGNS: [(&str, &str); 16] = [
    ("x", "the first coordinate of the point, in m"),
    ("y", "the second coordinate of the point, in m"),
    ("z", "the third coordinate of the point, in m; upwards"),
    ("t", "the time, in s"),
    ("pi", "the half circumference of a circle of radius 1"),
    ("and", "what lies in both shapes: a + b − √(a² + b²); comparisons are shapes"),
    ("or", "what lies in one of two shapes: a + b + √(a² + b²)"),
    ("not", "what lies outside of a shape; `a \\ b` is `a and not b`"),
    (
        "any",
        "a fold by `or`: `any i in 0..6: sphere(0.3).move([i, 0, 0])`, or through a list `any p in points: …`",
    ),
    ("all", "a fold by `and`: `all i in 0..6: x*cos(i) + y*sin(i) <= 1`"),
    ("sum", "a fold by `+`: `sum k in 1..4: sin(k*x)/k`"),
    ("product", "a fold by `*`: `product k in 1..4: k`"),
    ("min", "a fold as well: `min p in list: length(p - [x, y, z])`, the smallest of all members"),
    ("max", "a fold as well: `max p in list: p.z`, the largest of all members"),
    (
        "list",
        "a fold that makes a list of its members: `list i in 0..9: [cos(i), sin(i), i/9]`, or of another list, \
         `list p in path: 2*p`",
    ),
    ("if", "a choice: `if closed == 1 then 1 cm else 2 cm`, between numbers, points or shapes"),
];

/// Functions that are no text of the prelude: name, parameters, meaning.
const FUNCTIONS: &[(&str, &str, &str)] = &[
    ("sqrt", "e", "the square root"),
    ("abs", "e", "the absolute value"),
    ("sin", "angle", "the sine; radians unless a unit says otherwise"),
    ("cos", "angle", "the cosine; radians unless a unit says otherwise"),
    ("tan", "angle", "the tangent; radians unless a unit says otherwise"),
    ("asin", "e", "the inverse of the sine, in radians"),
    ("acos", "e", "the inverse of the cosine, in radians"),
    ("atan", "e", "the inverse of the tangent, in radians"),
    ("sinh", "e", "the hyperbolic sine"),
    ("cosh", "e", "the hyperbolic cosine"),
    ("tanh", "e", "the hyperbolic tangent"),
    ("exp", "e", "e to the power of a number"),
    ("ln", "e", "the natural logarithm"),
    ("log2", "e", "the logarithm to base 2"),
    ("log10", "e", "the logarithm to base 10"),
    ("sign", "e", "1, 0 or −1"),
    ("floor", "e", "the next whole number below"),
    ("ceil", "e", "the next whole number above"),
    ("round", "e", "the nearest whole number, the even one of two that are equally near"),
    ("fract", "e", "e − ⌊e⌋"),
    ("mod", "a, b", "a − b·⌊a/b⌋, which has the sign of b"),
    ("step", "edge, e", "1 where e ≥ edge, 0 elsewhere"),
    ("where", "condition, a, b", "the same as `if condition then a else b`"),
    ("atan2", "y, x", "the angle of the point (x, y), in radians"),
    ("pow", "a, b", "a to the power of b"),
    ("min", "a, b, …", "the smallest"),
    ("max", "a, b, …", "the largest"),
    ("hypot", "a, b, c", "√(a² + b² + c²); c may be left out"),
    ("clamp", "e, low, high", "e, but no less than low and no more than high"),
    ("dot", "a, b", "the scalar product of two vectors"),
    ("cross", "a, b", "the vector product"),
    ("length", "v", "the length of a vector"),
    ("random", "seed, i", "a number from 0 to 1 that looks like chance, the same in every run"),
    ("count", "list", "how many members a list has"),
    ("polygon", "corners", "the field of a simple polygon in x and y: `polygon([[0, 0], [1, 0], [0, 1]])`"),
    (
        "mesh",
        "path, unit",
        "the closed surface of an STL, OBJ or PLY file: `mesh(\"part.stl\", 1 mm)`; the unit may be left out",
    ),
    (
        "height_map",
        "path, low, high, scale",
        "the ground below a map of heights: `height_map(\"ground.csv\", [0, 0], [4, 3])`; the scale may be left out",
    ),
    ("points", "path", "the rows of a file of numbers as a list of vectors: `polygon(points(\"wing.csv\"))`"),
    (
        "arc",
        "a, b, c",
        "an arc as a list of points: from a through b to c, or around a centre `arc([0, 0], 1, 0°, 90°)`",
    ),
    (
        "spline",
        "points, tolerance",
        "a smooth curve through points as a list of points, closed if the last is the first; the tolerance may be left out",
    ),
    ("helix", "radius, pitch, turns", "a helix around z, from [radius, 0, 0] upwards, as a list of points"),
    (
        "rounded",
        "points, radius",
        "straight pieces with an arc at each corner as a list of points, closed if the last point is the first",
    ),
    (
        "sweep",
        "path, radius",
        "all points within a radius of a path: `sweep([[0, 0, 0], [1, 0, 0], [1, 1, 0]], 0.1)`",
    ),
    (
        "text",
        "words, height",
        "a line of letters that begins at the origin, as a profile: `text(\"R\", 1).extrude(0, 0.2)`",
    ),
    ("around", "e, outer", "the smaller one of e and the field of a ball around `outer`"),
    (
        "overlapping",
        "a, b",
        "b; an error where the outlines a and b lie beside each other, a question where one is a solid",
    ),
    ("slope", "e", "the length of the gradient, |∇ω|"),
    ("normalise", "e", "ω/√(ω² + |∇ω|²)"),
    ("normalize", "e", "ω/√(ω² + |∇ω|²)"),
    ("positive", "e, what", "e, or an error that names `what` if e is not above zero"),
];

/// Methods that are no text of the prelude: name, meaning.
const METHODS: &[(&str, &str)] = &[
    ("move", "the shape moved by a vector, which may depend on t"),
    ("rotate_x", "the shape turned about the x axis"),
    ("rotate_y", "the shape turned about the y axis"),
    ("rotate_z", "the shape turned about the z axis"),
    ("rotate", "the shape turned about an axis through the origin, or through `about`"),
    ("scale", "the shape made larger, by one factor or by three"),
    ("mirror", "the shape mirrored in the plane with this normal through a point"),
    ("at", "other coordinates in place of x, y and z: `.at([x - 0.3*z, y, z])`"),
    ("turned", "the shape turned about z by an angle that may differ from point to point"),
    ("repeat", "copies on a lattice: `.repeat([dx, dy, dz], [nx, ny, nz])`"),
    (
        "round",
        "arcs of a radius in place of the edges that `and`, `or` and `\\` make; another radius for those that point inwards, or 0",
    ),
    ("offset", "the shape with its faces moved outwards by d; edges stay sharp"),
    ("distance", "the shape by the distances of its parts, joined by min and max"),
];

/// The functions of the language, standard solids among them.
pub(in crate::cli) fn functions() -> Vec<Signature> {
    let builtin = |name: &'static str| {
        let (parameters, about) =
            FUNCTIONS.iter().find(|known| known.0 == name).map_or(("…", ""), |known| (known.1, known.2));
        let parameters = parameters.split(", ").map(String::from).collect();
        Signature { name: name.to_string(), parameters, about: about.to_string() }
    };
    let ast = vocabulary::prelude();
    let standard = ast.items.iter().filter_map(|item| match item {
        Item::Function(function) if function.name.text != "around" => Some(of(function, &ast.text)),
        _ => None,
    });
    vocabulary::builtins().map(builtin).chain(standard).collect()
}

/// The methods of shapes that the language has.
pub(in crate::cli) fn methods() -> Vec<Signature> {
    let builtin = |(name, parameters): (&'static str, Vec<&'static str>)| {
        let about = METHODS.iter().find(|known| known.0 == name).map_or("", |known| known.1);
        let parameters = parameters.iter().map(ToString::to_string).collect();
        Signature { name: name.to_string(), parameters, about: about.to_string() }
    };
    let ast = vocabulary::prelude();
    let standard = ast.items.iter().filter_map(|item| match item {
        Item::Function(function) if function.takes_a_shape() => Some(behind_a_shape(of(function, &ast.text))),
        _ => None,
    });
    vocabulary::methods().map(builtin).chain(standard).collect()
}

/// The signature of a function of a text, with the comment above it.
pub(in crate::cli) fn of(function: &Function, text: &str) -> Signature {
    let parameter = |p: &rfm::syntax::ast::Parameter| {
        let default = p.default.as_ref().and_then(|value| text.get(value.span.range()));
        default.map_or_else(|| p.name.text.clone(), |default| format!("{} = {default}", p.name.text))
    };
    Signature {
        name: function.name.text.clone(),
        parameters: function.parameters.iter().map(parameter).collect(),
        about: comment_above(text, function.name.span.range().start),
    }
}

/// The signature without the shape in front of the dot.
pub(in crate::cli) fn behind_a_shape(mut signature: Signature) -> Signature {
    signature.parameters.remove(0);
    signature
}

/// The lines of comments directly above the line of a byte, without their signs.
pub(in crate::cli) fn comment_above(text: &str, byte: usize) -> String {
    let before = text.get(..byte).unwrap_or("");
    let above = &before[..before.rfind('\n').map_or(0, |at| at + 1)];
    let mut lines: Vec<&str> = Vec::new();
    for line in above.lines().rev() {
        let Some(comment) = line.trim().strip_prefix('#').or_else(|| line.trim().strip_prefix("//")) else {
            break;
        };
        lines.push(comment.trim());
    }
    lines.reverse();
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_of_the_language_is_described() {
        for signature in functions().into_iter().chain(methods()) {
            let takes_any_number = ["min", "max"].contains(&signature.name.as_str());
            assert!(!signature.parameters.contains(&"…".to_string()) || takes_any_number, "{signature:?}");
            let standard = vocabulary::prelude().items.iter().any(|item| item.name().text == signature.name);
            assert!(standard || !signature.about.is_empty(), "{} has no description", signature.name);
        }
        let known: Vec<&str> = vocabulary::builtins().collect();
        for (name, ..) in FUNCTIONS {
            assert!(known.contains(name), "{name} is no function of the language");
        }
    }
}
