//! `rfm explain WORD` and `rfm explain words`: the words of the language, the keys of scenes, the methods and the
//! messages, from their declarations.

use rfm::diagnostic::explanations;
use rfm::lower::vocabulary;
use rfm::sph::Method;

use super::{
    keys,
    words::{self, ITEMS, SIGNS, Signature},
};

/// What `rfm explain words` prints begins so.
const HEAD: &str = "# The words of the language, one by one

`rfm explain words` prints this page from the declarations of the words, and `rfm explain WORD` a part of it. Formulas, examples
and what fields mean are on the [page of words](README.md); the keys that belong to one method are with the
[methods](../src/sph/methods/README.md). The messages about files come last.
";

/// All words and keys as a page of Markdown.
pub(in crate::cli) fn all() -> String {
    let mut page = HEAD.to_string();
    page += "\n## What begins an item\n\n";
    for (word, about) in ITEMS {
        page += &entry(word, about);
    }
    page += "\n## Between them\n\n";
    for (word, about) in SIGNS {
        page += &entry(word, about);
    }
    page += "\n## Functions\n\n";
    for function in sorted(words::functions()) {
        page += &entry(&function.label(), &function.about);
    }
    page += "\n## Methods of shapes\n\n";
    for method in sorted(words::methods()) {
        page += &entry(&format!(".{}", method.label()), &method.about);
    }
    for block in keys::blocks() {
        let title = block.map_or("Keys of a scene".to_string(), |block| format!("Keys of `{block}`"));
        page += &format!("\n## {title}\n\n");
        let own = Method::default().info().keys;
        let of_methods =
            |key: &&str| own.iter().any(|own| own.name == *key && Some(own.block.name()) == block);
        let keys = vocabulary::keys(block, Method::default());
        for key in keys.into_iter().filter(|key| !of_methods(key)) {
            page += &entry(key, &keys::about(block, key, Some(Method::default())));
        }
    }
    page += "\n## Methods\n\n";
    for method in Method::all() {
        page += &entry(method.name(), method.info().title);
    }
    page += "\n## Messages\n\n`rfm explain CODE` says more: why it is told, and what to do. `--deny CODE` makes an error of a warning.\n\n";
    for (code, about) in messages() {
        page += &entry(code, &about);
    }
    page
}

/// The codes of messages, and the first sentence about each.
pub(in crate::cli) fn messages() -> impl Iterator<Item = (&'static str, String)> {
    explanations().map(|(code, text)| (code, first_sentence(text)))
}

/// The first sentence of an explanation, on one line.
fn first_sentence(text: &str) -> String {
    let words = text.split_whitespace();
    let mut sentence: Vec<&str> = Vec::new();
    for word in words {
        sentence.push(word);
        if word.ends_with('.') && word.chars().filter(|c| *c == '.').count() == 1 {
            break;
        }
    }
    sentence.join(" ")
}

/// What is known of one word: functions, methods and keys of this name, and what begins items. `None` if
/// there are none.
pub(in crate::cli) fn of(word: &str) -> Option<String> {
    let word = word.trim_start_matches('.');
    let mut found = String::new();
    let is_it = |signature: &Signature| signature.name == word;
    for (_, about) in ITEMS.iter().chain(&SIGNS).filter(|(name, _)| *name == word) {
        found += &entry(word, about);
    }
    for function in words::functions().into_iter().filter(is_it) {
        found += &entry(&function.label(), &function.about);
    }
    for method in words::methods().into_iter().filter(is_it) {
        found += &entry(&format!("shape.{}", method.label()), &method.about);
    }
    for block in keys::blocks() {
        let methods = Method::all();
        let mut told: Vec<(String, Vec<&str>)> = Vec::new();
        for method in methods {
            if !vocabulary::keys(block, method).contains(&word) {
                continue;
            }
            let about = keys::about(block, word, Some(method));
            match told.iter_mut().find(|(known, _)| *known == about) {
                Some((_, methods)) => methods.push(method.name()),
                None => told.push((about, vec![method.name()])),
            }
        }
        for (about, methods) in told {
            let block = block.unwrap_or("scene");
            let with = if methods.len() == Method::all().len() {
                String::new()
            } else {
                format!(", {}", methods.join(", "))
            };
            found += &entry(&format!("{word} (key of `{block}`{with})"), &about);
        }
    }
    (!found.is_empty()).then_some(found)
}

/// Every word that [`of`] knows.
pub(in crate::cli) fn names() -> Vec<String> {
    let signatures = words::functions().into_iter().chain(words::methods()).map(|signature| signature.name);
    let keys = keys::blocks().flat_map(|block| {
        Method::all().into_iter().flat_map(move |method| vocabulary::keys(block, method)).map(String::from)
    });
    let mut names: Vec<String> = ITEMS
        .iter()
        .chain(&SIGNS)
        .map(|(word, _)| (*word).to_string())
        .chain(signatures)
        .chain(keys)
        .collect();
    names.sort();
    names.dedup();
    names
}

fn sorted(mut signatures: Vec<Signature>) -> Vec<Signature> {
    signatures.sort_by(|a, b| (a.name.to_lowercase(), &a.name).cmp(&(b.name.to_lowercase(), &b.name)));
    signatures.dedup();
    signatures
}

/// A word with its meaning, as an item of a list.
fn entry(word: &str, about: &str) -> String {
    let about = about.split_whitespace().collect::<Vec<_>>().join(" ");
    let code = if word.contains('`') { word.to_string() } else { format!("`{word}`") };
    if about.is_empty() { format!("- {code}\n") } else { format!("- {code}: {about}\n") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_has_an_entry() {
        for name in names() {
            let found = of(&name).unwrap_or_else(|| panic!("{name} is not explained"));
            assert!(found.lines().all(|line| line.contains(": ")), "{found}");
        }
        assert_eq!((of("spheroid"), of("")), (None, None));
        let spacing = of("spacing").unwrap();
        assert!(spacing.contains("key of `fluid`") && spacing.contains("in m"), "{spacing}");
        assert!(of(".twist").unwrap().contains("shape.twist(turns)"));
    }
}
