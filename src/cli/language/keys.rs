//! What the keys of a scene mean, with their units and defaults, and what its methods are.
//!
//! Keys are described where they are declared, by their method or by the reader of their block.

use rfm::lower::vocabulary;
use rfm::sph::{KeyInfo, Method, method_reference};

/// What a key of a block means under a method; empty if there is no such key. `None` is the block of the
/// scene itself, or an unknown method.
pub(in crate::cli) fn about(block: Option<&str>, key: &str, method: Option<Method>) -> String {
    let declared = |method: Method| {
        method.info().keys.into_iter().find(|own| own.name == key && Some(own.block.name()) == block)
    };
    let own = match method {
        Some(method) => declared(method),
        None => Method::all().into_iter().find_map(declared),
    };
    if let Some(KeyInfo { about, unit, accepts, default, .. }) = own {
        let unit = unit.map_or(String::new(), |unit| format!(", in {unit}"));
        return format!("{about}{unit}; accepts {accepts}; by default {default}");
    }
    let declared = vocabulary::blocks().into_iter().find(|(known, _)| *known == block);
    let Some(key) = declared.and_then(|(_, keys)| keys.iter().find(|declared| declared.name == key)) else {
        return String::new();
    };
    let mut words = key.about.to_string();
    if let Some(unit) = key.unit() {
        words += &format!(", in {unit}");
    }
    let words_of_values = vocabulary::words(key.name);
    if !words_of_values.is_empty() && !words_of_values.iter().any(|word| words.contains(word.as_str())) {
        words += &format!("; accepts {}", words_of_values.join(", "));
    }
    if let Some(default) = key.default() {
        words += &format!("; by default {default}");
    }
    words
}

/// The names of all blocks; `None` is the scene itself.
pub(in crate::cli) fn blocks() -> impl Iterator<Item = Option<&'static str>> {
    vocabulary::blocks().into_iter().map(|(name, _)| name)
}

/// What a word that is the value of a key means: so far those of `method`.
pub(in crate::cli) fn about_word(key: &str, word: &str) -> Option<String> {
    if key != "method" {
        return None;
    }
    Some(method_reference(Method::named(word)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_is_described() {
        for block in blocks() {
            for method in Method::all() {
                for key in vocabulary::keys(block, method) {
                    assert!(!about(block, key, Some(method)).is_empty(), "{block:?} {key} of {method:?}");
                }
            }
        }
        assert!(blocks().count() > 10);
    }

    #[test]
    fn a_key_means_what_its_block_and_its_method_say() {
        let method = Method::named("wcsph");
        assert!(about(Some("run"), "until", method).contains("in s; by default 5"));
        assert_ne!(about(Some("truth"), "from", method), about(Some("probe"), "from", method));
        assert!(about(Some("fluid"), "sound_speed", method).contains("in m/s"));
        assert!(about(None, "walls", method).contains("accepts free_slip, no_slip; by default free_slip"));
        assert_eq!(about(Some("fluid"), "sound_speed", Method::named("dfsph")), "");
        assert_eq!(about_word("fill", "below"), None);
        assert!(about_word("method", "dfsph").unwrap().contains("Unless the scene says otherwise"));
    }
}
