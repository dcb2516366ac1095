//! `rfm mesh --simplify`: fewer triangles, within the promised distance of the surface.

use serde_json::Value;

use crate::tool::{rfm, rfm_reading, root};

fn number(document: &Value, key: &str) -> f64 {
    document[key].as_f64().unwrap_or_else(|| panic!("no number `{key}` in {document}"))
}

fn simplified(solid: &str, flags: &[&str]) -> Value {
    let file = format!("examples/{solid}.rfm");
    rfm(root(), &[&["mesh", &file, "-s", solid, "--json"], flags].concat()).expect(0).json()
}

#[test]
#[ignore = "long"]
fn the_measured_error_is_within_the_one_asked_for() {
    for (solid, cells, error, most) in [
        ("pawn", "96", "2 mm", 0.1),
        ("pawn", "96", "0.5%", 0.05),
        ("bishop", "48", "0.004", 0.2),
        ("cube", "32", "1e-6", 0.01),
    ] {
        let flags = ["--cells", cells, "--method", "dc", "--simplify", error, "--quality"];
        let found = simplified(solid, &flags);
        println!(
            "{solid} {error}: {} → {} triangles, {:.2e} of {:.2e}",
            found["simplified_from"],
            found["triangles"],
            number(&found, "simplify_error"),
            number(&found, "simplify_tolerance")
        );
        assert!(number(&found, "simplify_error") <= number(&found, "simplify_tolerance"), "{found}");
        assert_eq!(number(&found, "simplify_error"), number(&found["quality"], "hausdorff"));
        assert!(number(&found, "triangles") < most * number(&found, "simplified_from"), "{found}");
        assert_eq!(
            (&found["closed"], &found["manifold"], &found["euler"]),
            (&true.into(), &true.into(), &2.into())
        );
        assert_eq!(found["quality"]["flipped"], 0, "{found}");
        // vertices stay on the surface
        assert!(number(&found, "max_distance") < 1e-9, "{found}");
    }
}

#[test]
fn an_error_that_the_mesh_itself_exceeds_is_admitted() {
    for (method, helps) in [("mc", true), ("dc", false)] {
        let flags = ["mesh", "examples/pawn.rfm", "--cells", "32", "--simplify", "0.1mm", "--json"];
        let outcome = rfm(root(), &[&flags[..], &["--method", method]].concat()).expect(0);
        // nobody is told to use the method that they use
        assert_eq!(outcome.stderr.contains("--method dc"), helps, "{}", outcome.stderr);
        assert!(outcome.stderr.contains("so all triangles are kept"), "{}", outcome.stderr);
        let found = outcome.json();
        assert!(number(&found, "simplify_error") > 1e-4 && found["closed"] == true, "{found}");
        assert_eq!(found["triangles"], found["simplified_from"], "{found}");
    }
    // there is nothing to simplify and nothing to measure
    let empty = b"rfm 1\nsolid s = sphere(1) and sphere(1).move([3, 0, 0])";
    let outcome = rfm_reading(root(), &["mesh", "-", "--simplify", "1%", "--json"], empty).expect(1);
    assert_eq!(outcome.json()["triangles"], 0);
    for wrong in ["0", "-1", "3kg", "0%", "nan"] {
        let outcome = rfm(root(), &["mesh", "examples/pawn.rfm", "--simplify", wrong, "--json"]).expect(2);
        assert!(outcome.stdout.is_empty() && outcome.stderr.contains("--simplify"), "{}", outcome.stderr);
    }
}
