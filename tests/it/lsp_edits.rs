//! What `rfm lsp` has an editor write, and what the editor writes: completions, other names, parts of a text.

use serde_json::{Value, json};

use crate::lsp::{Editor, URI};

/// The item of a completion with a label.
fn offered(editor: &mut Editor, label: &str, line: u32, character: u32) -> Value {
    let items = editor.at("completion", line, character);
    let found = items.as_array().unwrap().iter().find(|item| item["label"] == label);
    found.unwrap_or_else(|| panic!("no {label} in {items}")).clone()
}

fn range(line: u32, start: usize, end: usize) -> Value {
    json!({ "start": { "line": line, "character": start }, "end": { "line": line, "character": end } })
}

/// `|` is the cursor, and `_` stand on both sides of what is replaced.
#[test]
fn a_completion_replaces_the_word_at_the_cursor() {
    for (marked, label, written) in [
        ("let 𝛼 = _sph|_", "sphere", "sphere"),
        ("let 𝛼 = _sp|h_(1)", "sphere", "sphere"),
        ("let 𝛼 = _|_", "sphere", "sphere"),
        ("let 𝛼 = _|_box()", "sphere", "sphere"),
        ("let 𝛼 = 2*_ωb|a_ + 1", "sphere", "sphere"),
        // exponents and numbers are no words
        ("let 𝛼 = x²_|_", "and", "and"),
        ("let 𝛼 = 12_|_", "or", "or"),
        ("let 𝛼 = cylinder(_r|_, 1)", "r =", "r = "),
        ("let 𝛼 = sphere(1)._mo|_", "move", "move"),
    ] {
        let text = marked.replace(['_', '|'], "");
        for (encoding, is_utf16) in [("utf-16", true), ("utf-8", false)] {
            let before = |mark: char, from: usize| {
                let at = from + marked[from..].find(mark).unwrap();
                let part = marked[..at].replace(['_', '|'], "");
                (if is_utf16 { part.encode_utf16().count() } else { part.len() }, at + 1)
            };
            let ((start, after), (cursor, _)) = (before('_', 0), before('|', 0));
            let (end, _) = before('_', after);
            let mut editor = Editor::new(&[encoding]);
            editor.open(&format!("rfm 1\n{text}\n"));
            let item = offered(&mut editor, label, 1, cursor as u32);
            let edit = json!({ "newText": written, "range": range(1, start, end) });
            assert_eq!(item["textEdit"], edit, "{marked} in {encoding}");
            assert!(item["insertText"].is_null(), "{item}");
            editor.end();
        }
    }
}

/// An editor that can asks its user whether the rest of a word stays.
#[test]
fn a_completion_leaves_the_choice() {
    let text = json!({ "completion": { "completionItem": { "insertReplaceSupport": true } } });
    let mut editor = Editor::able(&[], text);
    editor.open("rfm 1\nlet a = sph(1)\n");
    let item = offered(&mut editor, "sphere", 1, 10);
    let edit = json!({ "newText": "sphere", "insert": range(1, 8, 10), "replace": range(1, 8, 11) });
    assert_eq!(item["textEdit"], edit);
    editor.end();
}

#[test]
fn parts_of_a_text_are_changed() {
    for (encoding, after) in [("utf-16", 6), ("utf-8", 8)] {
        let mut editor = Editor::new(&[encoding]);
        editor.open("rfm 1\nlet 𝛼 = 1\nsolid s = spere(𝛼)\n");
        let changes = json!([
            { "range": range(1, 4, after), "text": "bb" },
            { "range": range(2, 10, 15), "text": "sphere" },
            { "range": range(2, 17, 17 + after - 4), "text": "bb" },
        ]);
        let file = json!({ "uri": URI, "version": 2 });
        editor.tell("textDocument/didChange", json!({ "textDocument": file, "contentChanges": changes }));
        assert!(editor.hover(2, 6).contains("solid s = sphere(bb)"), "{encoding}: {}", editor.hover(2, 6));
        assert!(editor.hover(1, 5).contains("let bb = 1"), "{encoding}");
        editor.end();
    }
}

/// A function is a method if its first parameter is called `shape`: another name for that is another meaning.
#[test]
fn a_name_that_makes_a_method_is_kept() {
    let text = "rfm 1
fn twin(shape, by) = shape or shape.move([by, 0, 0])
fn pair(shape) = shape or shape.move([0, 3, 0])
fn wide(form, by) = form or form.move([by, 0, 0])
solid s = pair(sphere(1).twin(3)) or wide(sphere(0.5), 9)
";
    let mut editor = Editor::new(&[]);
    assert!(editor.open(text).is_empty());
    let mut rename = |line: u32, word: &str, name: &str| {
        let character = text.lines().nth(line as usize).unwrap().find(word).unwrap();
        let position = json!({ "line": line, "character": character });
        let file = json!({ "uri": URI });
        let asked = json!({ "textDocument": file, "position": position, "newName": name });
        editor.ask("textDocument/rename", asked)
    };
    for (line, word, name, why) in [
        (
            1,
            "shape",
            "body",
            "`twin` is called as a method, and is one as its first parameter is called `shape`",
        ),
        (1, "shape.move", "body", "`twin` is called as a method"),
        (3, "form", "shape", "`wide` would become a method: its first parameter would be called `shape`"),
        (1, "twin", "move", "`move` is a method of all shapes"),
        (2, "pair", "mirror", "`mirror` is a method of all shapes"),
    ] {
        let refused = rename(line, word, name);
        assert_eq!(refused["code"], -32602, "{word} -> {name}: {refused}");
        assert!(refused["message"].as_str().unwrap().contains(why), "{refused}");
    }
    // what nothing calls as a method, and what is no first parameter
    for (line, word, name, places) in [
        (2, "shape", "body", 3),
        (1, "by", "far", 2),
        (3, "form", "body", 3),
        (1, "twin", "two", 2),
        (3, "wide", "mirror", 2),
        (1, "shape", "shape", 3),
    ] {
        let edits = rename(line, word, name);
        let edits = edits["changes"][URI].as_array().unwrap_or_else(|| panic!("{word} -> {name}: {edits}"));
        assert_eq!(edits.len(), places, "{word} -> {name}");
    }
    editor.end();
}
