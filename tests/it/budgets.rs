//! What `check` does within its budget of time.

use crate::cli::PAWN;
use crate::tool::{rfm, rfm_reading, root};

/// A solid with walls of one and a half cells is measured with the cells that it needs, and a slow solid leaves the
/// others their share of the time.
#[test]
#[ignore = "long"]
fn a_check_gives_each_solid_the_cells_and_the_time_that_it_needs() {
    let text = b"rfm 1\nsolid slow = (noise(40*[x, y, z]) or noise(200*[x, y, z])) and box()\n\
        solid shell = sphere(1) \\ sphere(0.97)\nsolid ball = sphere(1)";
    let outcome = rfm_reading(root(), &["check", "--json", "--budget", "28", "-"], text).expect(0);
    let document = outcome.json();
    let of_unit = 4.0 / 3.0 * std::f64::consts::PI;
    for (number, volume, is_fine) in [(1, of_unit * (1.0 - 0.97_f64.powi(3)), true), (2, of_unit, false)] {
        let solid = &document["solids"][number];
        assert!((solid["volume"].as_f64().unwrap() / volume - 1.0).abs() < 1e-6, "{solid}");
        assert_eq!(solid["resolved"], true, "{solid}");
        assert_eq!(solid["cells"].as_u64().unwrap() > 96, is_fine, "{solid}");
    }
    assert_eq!(document["solids"][0]["name"], "slow");
}

#[test]
fn what_is_not_finished_in_the_time_for_it_is_said() {
    // details in every cell: minutes of work
    let text = "rfm 1\nsolid s = (noise(40*[x, y, z]) or noise(200*[x, y, z])) and box()".as_bytes();
    let outcome = rfm_reading(root(), &["check", "--json", "--budget", "1", "-"], text).expect(0);
    let solid = &outcome.json()["solids"][0];
    assert_eq!(solid["unfinished"], serde_json::json!(["volume", "thin_cells"]), "{solid}");
    assert!(
        solid["bounds"].is_object() && solid["volume"].is_null() && solid["thin_cells"].is_null(),
        "{solid}"
    );
    let outcome = rfm_reading(root(), &["check", "--budget", "1", "-"], text).expect(0);
    assert!(outcome.stdout.contains("not found: its meshes were not finished in time"), "{}", outcome.stdout);
    assert!(outcome.stderr.contains("the search for thin parts of `s` was ended"), "{}", outcome.stderr);

    let outcome = rfm(root(), &["mesh", "--json", "--budget", "0", PAWN, "--cells", "16"]).expect(0);
    let mesh = outcome.json();
    assert!(mesh["thin_cells"].is_null() && mesh["closed"] == true, "{mesh}");
    assert!(outcome.stderr.contains("--budget gives it more time"), "{}", outcome.stderr);
}

#[test]
fn a_budget_below_a_second_is_compared_as_it_is_and_a_missing_volume_is_explained() {
    let ball = "rfm 1\nsolid s = sphere(1)\n".as_bytes();
    let check =
        |budget: &str| rfm_reading(root(), &["check", "--json", "--budget", budget, "-"], ball).expect(0);
    // a few operations take a few milliseconds
    let enough = check("20ms");
    assert!(!enough.stderr.contains("measuring it may take"), "{}", enough.stderr);
    let little = check("1e-6");
    assert!(little.stderr.contains("measuring it may take 0.0"), "{}", little.stderr);
    let why = little.json()["solids"][0]["no_volume"].as_str().unwrap().to_string();
    assert!(why.contains("--budget 0.0"), "{why}");
    let thread = "rfm 1\nsolid s = box([0, 0, 0], [10, 1e-7, 1e-7]).rotate_z(0.5).rotate_x(0.4)\n".as_bytes();
    let solid = rfm_reading(root(), &["check", "--json", "-"], thread).expect(0).json()["solids"][0].clone();
    assert!(
        solid["volume"].is_null() && solid["no_volume"].as_str().unwrap().contains("too thin"),
        "{solid}"
    );
}
