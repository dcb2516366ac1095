//! Which names a file may use.

use super::{Param, SourceError};

/// Words that some target language keeps for itself, and names that the functions of a file use.
const TAKEN: &str = "alignas alignof and asm auto bool break case catch char class const continue default delete do \
    double else enum explicit export extern false float fn for friend goto half if impl in inline inout input int \
    layout let long loop lowp match mediump highp mod move mut namespace new not operator or out output private \
    protected pub public ref register return self sampler short signed sizeof static struct super switch template \
    this throw trait true try type typedef union unsafe unsigned use uniform using var varying virtual void volatile \
    where while xor x y z t n p u i yield discard precision common partition active filter resource sample smooth \
    flat centroid attribute abstract async await become box dyn final macro override priv typeof unsized crate far \
    near restrict complex noinline cast";

/// The prefix, if all languages accept names that begin with it.
pub(super) fn prefix(given: &str) -> Result<String, SourceError> {
    let fits = is_plain(given) && !given.starts_with("gl_") && !given.ends_with('_');
    fits.then(|| given.to_string()).ok_or_else(|| SourceError::BadPrefix(given.into()))
}

/// The names of params as the fields of a structure: their own where that is possible.
pub(super) fn fields(params: &[Param]) -> Vec<String> {
    let mut fields: Vec<String> = Vec::with_capacity(params.len());
    for (i, param) in params.iter().enumerate() {
        // the param of an imported file has a dot in its name
        let own = param.name.replace('.', "_");
        let own = own.as_str();
        let name = if !is_plain(own) || own.starts_with("gl_") {
            format!("param_{i}")
        } else if TAKEN.split_whitespace().any(|word| word == own) {
            format!("{own}_param")
        } else {
            own.to_string()
        };
        fields.push(if fields.contains(&name) { format!("{name}_{i}") } else { name });
    }
    fields
}

/// ASCII letters, digits and single underscores, a letter first.
fn is_plain(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !name.contains("__")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefixes_are_names_in_every_language() {
        for good in ["pawn", "Pawn_2", "a"] {
            assert_eq!(prefix(good).unwrap(), good);
        }
        for bad in ["", "2a", "a__b", "_a", "ω", "a b", "gl_a", "a-b", "a_"] {
            assert!(prefix(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn params_keep_their_names_where_they_can() {
        let params: Vec<Param> = ["side", "in", "α", "x", "param_2"]
            .iter()
            .map(|name| Param { name: (*name).into(), value: 1.0, doc: None })
            .collect();
        assert_eq!(fields(&params), ["side", "in_param", "param_2", "x_param", "param_2_4"]);
    }
}
