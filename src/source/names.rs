//! Which names a file may use.

use super::{Param, SourceError};

/// Words that some target language keeps for itself or defines, C, C++, CUDA, Rust, WGSL and GLSL ES among them, and
/// names that the functions of a file use.
const TAKEN: &str = "I abstract active alias alignas alignof and and_eq array as asm asm_fragment assert async atomic attribute \
    auto await become bitand bitor bool box break bvec2 bvec3 bvec4 case cast catch centroid char char16_t \
    char32_t char8_t class co_await co_return co_yield coherent column_major common compile compile_fragment \
    compl complex concept const const_assert const_cast consteval constexpr constinit continue continuing \
    crate debugger decltype default delete demote demote_to_helper diagnostic discard do double dvec2 dvec3 \
    dvec4 dyn dynamic_cast else enable enum errno explicit export extends extern external f16 f32 f64 \
    fallthrough false far filter final finally fixed flat float fn for friend from fvec2 fvec3 fvec4 fxgroup \
    gen get goto groupshared half highp hvec2 hvec3 hvec4 i i32 i386 i64 if imaginary impl implements import \
    in inline inout input instanceof int interface invariant isampler2D isampler3D ivec2 ivec3 ivec4 layout \
    let linux long loop lowp macro macro_rules main mat2 mat3 mat4 match math math_errhandling mediump meta mod module move \
    mut mutable n namespace near new nil noexcept noinline nointerpolation non_coherent noncoherent \
    noperspective noreturn not not_eq null nullptr of operator or or_eq out output override p package packoffset \
    partition pass patch pixelfragment precise precision premerge priv private protected ptr pub public \
    readonly ref regardless register reinterpret_cast require requires resource restrict return sample \
    sampler sampler2D sampler3D samplerCube self Self set shared short signed sizeof small smooth snorm static \
    static_assert static_cast std stderr stdin stdout struct subroutine super superp switch t target template texture this \
    thread_local throw trait true try type typedef typeid typename typeof u u32 u64 uint uniform union unix \
    unless unorm unsafe unsigned unsized usampler2D usampler3D use using uvec2 uvec3 uvec4 var varying vec \
    vec2 vec3 vec4 virtual void volatile wchar_t wgsl where while with writeonly x xor xor_eq y yield z";

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
        } else if is_taken(own) {
            format!("{own}_param")
        } else {
            own.to_string()
        };
        fields.push(if fields.contains(&name) { format!("{name}_{i}") } else { name });
    }
    fields
}

/// Whether a name may mean something else in some language. Two capitals or more, as in NULL and M_PI, may be a macro of C.
fn is_taken(name: &str) -> bool {
    let letters = || name.chars().filter(char::is_ascii_alphabetic);
    let is_like_macro = letters().count() > 1 && letters().all(|letter| letter.is_ascii_uppercase());
    is_like_macro || TAKEN.split_whitespace().any(|word| word == name)
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
        for taken in [
            "module", "NULL", "M_PI", "vec3", "Self", "linux", "mat4", "std", "shared", "I", "stdin",
            "stdout", "stderr",
        ] {
            let param = Param { name: taken.into(), value: 1.0, doc: None };
            assert_eq!(fields(&[param]), [format!("{taken}_param")]);
        }
        for own in ["R", "Re", "height", "R_2"] {
            let param = Param { name: own.into(), value: 1.0, doc: None };
            assert_eq!(fields(&[param]), [own]);
        }
    }
}
