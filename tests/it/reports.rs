//! What `rfm report` measures: meshes, and flows whose outcome is known.

use crate::cli::contract;
use crate::tool::{rfm, rfm_reading, root, snapshot};

#[test]
fn reports_measure_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let plot = folder.path().join("meshes.svg").to_str().unwrap().to_string();
    let arguments = ["report", "examples/cube.rfm", "--mesh-cells", "32", "--mesh-plot", &plot, "--json"];
    let outcome = rfm(root(), &arguments).expect(0);
    let document = outcome.json();
    contract(&outcome.stdout, &document, &["schema", "rows", "meshes"]);
    let rows = document["meshes"].as_array().unwrap();
    let methods: Vec<&str> = rows.iter().map(|row| row["method"].as_str().unwrap()).collect();
    assert_eq!(methods, ["mc", "mc", "mc", "mc", "dc", "dc", "dc", "dc"]);
    for row in rows {
        assert!(row["closed"] == true && row["manifold"] == true, "{row}");
        // a cube has plane faces: dual contouring leaves no error at all
        let hausdorff = row["hausdorff"].as_f64().unwrap();
        assert_eq!(row["method"] == "dc", hausdorff < 1e-9, "{row}");
    }
    assert!(rows[3]["order"].as_f64().unwrap() > 0.5, "{}", rows[3]);
    let text = std::fs::read_to_string(&plot).unwrap();
    assert!(text.starts_with("<svg") && text.contains("dual contouring") && text.contains("polyline"));
}

/// Water at rest whose pressure is known, in double precision: the same digits on every processor.
const STILL: &str = "rfm 1
param particles = 64 in 27 .. 1000
let spacing = (0.001/particles)^(1/3)
scene still {
  box   { max: [0.1, 0.1, 0.2] }
  fluid { shape: box([0, 0, 0], [0.1, 0.1, 0.1]), density: 1000, spacing: spacing, start: hydrostatic }
  method: wcsph
  solver { precision: f64 }
  run   { until: 20 ms, save_every: 5 ms }
  truth { pressure: 9810*max(0.1 - z, 0), velocity: [0, 0, 1e-3], front: 0.1, from: 10 ms }
}
";

#[test]
fn reports_measure_flows() {
    let folder = tempfile::tempdir().unwrap();
    let plot = folder.path().join("still.svg").to_str().unwrap().to_string();
    let arguments =
        ["report", "-", "--particles", "64,27", "--methods", "wcsph,dfsph", "--threads", "1", "-o", &plot];
    let text = rfm_reading(root(), &arguments, STILL.as_bytes()).expect(0).stdout;
    // the last two columns of the table are times
    let masked: Vec<String> = text
        .lines()
        .filter(|line| !line.starts_with("plot written"))
        .map(|line| match line.starts_with("wcsph") || line.starts_with("dfsph") {
            true => format!("{} …", &line[..line.len() - " 123456.78 1234567890123.56".len()]),
            false => line.to_string(),
        })
        .collect();
    snapshot("cli", "report of a flow", &masked.join("\n"));
    let picture = std::fs::read_to_string(&plot).unwrap();
    assert!(picture.starts_with("<svg") && picture.contains("dfsph, pressure"), "{picture}");
    // two methods, and three things that are known
    assert_eq!(picture.matches("<polyline").count(), 6);

    let arguments = ["report", "-", "--json", "--particles", "27,64"];
    let outcome = rfm_reading(root(), &arguments, STILL.as_bytes()).expect(0);
    let document = outcome.json();
    contract(&outcome.stdout, &document, &["schema", "scene", "threads", "instants", "rows"]);
    assert_eq!(document["instants"], 3);
    let rows = document["rows"].as_array().unwrap();
    let sizes: Vec<u64> = rows.iter().map(|row| row["particles"].as_u64().unwrap()).collect();
    assert_eq!(sizes, [27, 64]);
    let number = |row: &serde_json::Value, key: &str| row[key].as_f64().unwrap();
    for row in rows {
        assert!(number(row, "cpu_seconds") > 0.0 && number(row, "seconds") > 0.0);
        assert!((number(row, "simulated_seconds") - 0.02).abs() < 1e-9);
        // the water reaches from wall to wall
        assert!(number(row, "front_error") < 0.05, "{row}");
    }
    let fell = number(&rows[0], "pressure_error") / number(&rows[1], "pressure_error");
    let order = fell.ln() / (4f64 / 3.0).ln();
    assert!((number(&rows[1], "pressure_order") - order).abs() < 1e-9, "{}", rows[1]);
    assert!(rows[0]["pressure_order"].is_null());
}

#[test]
fn a_report_says_which_run_failed() {
    // steps of a hundred times what is stable
    let text =
        STILL.replace("until: 20 ms", "dt: 5 ms, until: 200 ms").replace("start: hydrostatic", "jitter: 0.9");
    let outcome = rfm_reading(root(), &["report", "-", "--particles", "216", "--json"], text.as_bytes());
    let outcome = outcome.expect(3);
    assert!(outcome.stderr.contains("wcsph, 216 particles: step "), "{}", outcome.stderr);
    let row = &outcome.json()["rows"][0];
    assert!(row["failure"].is_string() && row["pressure_error"].is_null(), "{row}");

    // two billion steps to the end
    let text = STILL.replace("until: 20 ms", "dt: 1e-11, until: 20 ms");
    let outcome = rfm_reading(root(), &["report", "-", "--particles", "27"], text.as_bytes()).expect(3);
    assert!(
        outcome.stderr.contains("wcsph, 27 particles: step 200: time stands still"),
        "{}",
        outcome.stderr
    );
    let table: Vec<&str> = outcome.stdout.lines().collect();
    assert!(table.len() == 3 && table[2].contains("failed"), "{table:?}");
}
