//! What `rfm report` measures: meshes, and flows whose outcome is known.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;

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

/// What a page shows of itself: its tables, each as rows of cells.
fn tables(page: &str) -> Vec<Vec<Vec<String>>> {
    let cells = |row: &str| -> Vec<String> {
        let cells = row.split("<td").skip(1).map(|cell| cell.split_once('>').unwrap().1);
        cells.map(|cell| cell.split_once("</td>").unwrap().0.to_string()).collect()
    };
    let rows = |table: &str| -> Vec<Vec<String>> {
        let body = table.split_once("<tbody>").unwrap().1.split_once("</tbody>").unwrap().0;
        body.split("<tr>").skip(1).map(cells).collect()
    };
    page.split("<table>").skip(1).map(rows).collect()
}

#[test]
fn a_report_is_one_page_whatever_its_files_hold() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let evil = "</pre><script>alert(1)</script><img src=\"https://example.org/a.png\">";
    let import = "import \"ball.rfm\" as balls\nsolid lens = balls.ball and z <= 0.2\n";
    std::fs::write(here.join("lens & co.rfm"), format!("rfm 1\n# {evil}\n{import}")).unwrap();
    std::fs::write(here.join("ball.rfm"), "rfm 1\nsolid ball = sphere(0.5)\n").unwrap();
    let arguments = ["report", "lens & co.rfm", "--mesh-cells", "24", "--html", "a.html", "--json"];
    let told = rfm(here, &arguments).expect(0).json();
    let page = std::fs::read_to_string(here.join("a.html")).unwrap();
    assert!(page.starts_with("<!doctype html>") && page.trim_end().ends_with("</html>"));
    // the files are shown, and nothing of them is part of the document
    assert!(
        page.contains(
            "&lt;/pre&gt;&lt;script&gt;alert(1)&lt;/script&gt;&lt;img src=&quot;https://example.org"
        )
    );
    assert!(page.contains("solid ball = sphere(0.5)"), "what it imports");
    assert_eq!(page.matches("<h3>").count(), 2, "and no other file");
    assert_eq!(page.matches("<script").count() + page.matches("<link rel=\"style").count(), 0);
    assert_eq!(page.matches("http").count(), 2, "the policy and the comment of the file");
    assert!(page.contains("default-src 'none'"));
    assert!(page.contains("rfm report &#39;lens &amp; co.rfm&#39; --mesh-cells 24 --html a.html --json"));
    // a picture, a slice, and a plot of the programs and one of the meshes
    let images: Vec<&str> =
        page.split(" src=\"data:").skip(1).map(|rest| rest.split_once(';').unwrap().0).collect();
    assert_eq!(images, ["image/png", "image/svg+xml", "image/svg+xml", "image/svg+xml"]);
    // the tables have what the document of the command has
    let [programs, meshes] = &tables(&page)[..] else { panic!("two tables") };
    let rows = |name: &str| told[name].as_array().unwrap().clone();
    assert_eq!((programs.len(), meshes.len()), (rows("rows").len(), rows("meshes").len()));
    for (cells, row) in programs.iter().zip(rows("rows")) {
        assert_eq!(
            (cells[0].as_str(), cells[3].as_str()),
            (row["program"].as_str().unwrap(), row["form"].as_str().unwrap())
        );
    }
    for (cells, row) in meshes.iter().zip(rows("meshes")) {
        assert_eq!(cells[1], row["cells"].to_string());
        assert_eq!(cells[2], row["triangles"].to_string());
    }
    let refused = rfm(here, &["report", "lens & co.rfm", "--html", "a.pdf"]).expect(2);
    assert!(refused.stderr.contains("file .html"), "{}", refused.stderr);
}

/// The file that a link of a page saves.
fn linked(page: &str, name: &str) -> Vec<u8> {
    let start = format!("<a download=\"{name}\" href=\"data:application/octet-stream;base64,");
    let rest = page.split_once(&start).unwrap_or_else(|| panic!("no link to {name}")).1;
    BASE64_STANDARD.decode(rest.split_once('"').unwrap().0).unwrap()
}

#[test]
fn a_page_holds_what_its_report_needs_to_be_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let outline = "x,y\r\n0,0\r\n1,0\r\n0.5,1\r\n";
    std::fs::create_dir(here.join("parts")).unwrap();
    std::fs::write(here.join("parts/outline.csv"), outline).unwrap();
    // more than a page holds
    let many: String =
        (0..32_000_i64).map(|i| format!("0.{:015},0.{:015}\n", i * 7919, i * 104_729)).collect();
    std::fs::write(here.join("many.csv"), format!("x,y\n{many}")).unwrap();
    let text = "rfm 1\r\nlet many = points(\"many.csv\")\r\nsolid tri = polygon(points(\"parts/outline.csv\")).extrude(0, 0.2) and x <= 1 + 0*count(many)\r\n";
    std::fs::write(here.join("tri.rfm"), text).unwrap();
    rfm(here, &["report", "tri.rfm", "--mesh-cells", "24", "--html", "a.html"]).expect(0);
    let page = std::fs::read_to_string(here.join("a.html")).unwrap();
    // the bytes themselves, line ends and all
    assert_eq!(linked(&page, "tri.rfm"), text.as_bytes());
    assert_eq!(linked(&page, "outline.csv"), outline.as_bytes());
    assert!(page.contains(&format!(">parts/outline.csv</a>, {} bytes", outline.len())));
    assert!(page.contains("<li>many.csv, 1.2 MB: too large") && !page.contains("download=\"many.csv\""));
    assert!(page.contains("and 1 that this page does not hold"));
    // made again from them, the page has the same files
    let again = tempfile::tempdir().unwrap();
    std::fs::create_dir(again.path().join("parts")).unwrap();
    for (name, path) in [("tri.rfm", "tri.rfm"), ("outline.csv", "parts/outline.csv")] {
        std::fs::write(again.path().join(path), linked(&page, name)).unwrap();
    }
    std::fs::copy(here.join("many.csv"), again.path().join("many.csv")).unwrap();
    rfm(again.path(), &["report", "tri.rfm", "--mesh-cells", "24", "--html", "a.html"]).expect(0);
    let second = std::fs::read_to_string(again.path().join("a.html")).unwrap();
    assert_eq!(linked(&second, "outline.csv"), outline.as_bytes());
    let errors = |page: &str| {
        tables(page)[1].iter().map(|row| [row[1].clone(), row[2].clone(), row[4].clone()]).collect::<Vec<_>>()
    };
    assert_eq!(errors(&page), errors(&second), "meshes and their errors");
}

#[test]
fn a_report_of_a_flow_is_a_page_too() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("still.rfm"), STILL).unwrap();
    let arguments = ["report", "still.rfm", "--particles", "64,27", "--threads", "1", "--html", "a.html"];
    let text = rfm(folder.path(), &arguments).expect(0).stdout;
    assert!(text.contains("page written to a.html"), "{text}");
    let page = std::fs::read_to_string(folder.path().join("a.html")).unwrap();
    let [runs] = &tables(&page)[..] else { panic!("one table") };
    // the plot, and a picture of the fluid in the finer run
    let images: Vec<&str> =
        page.split(" src=\"data:").skip(1).map(|rest| rest.split_once(';').unwrap().0).collect();
    assert_eq!(images, ["image/svg+xml", "image/png"]);
    let particles = page.split_once("The fluid at ").unwrap().1.split_once(" particles").unwrap().0;
    assert!(particles.ends_with(&format!("wcsph, {}", runs[1][2])), "{particles}");
    let png = page.split_once("data:image/png;base64,").unwrap().1.split_once('"').unwrap().0;
    let file = std::io::Cursor::new(BASE64_STANDARD.decode(png).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    let blue = pixels.chunks(3).filter(|pixel| pixel[2] > pixel[0].saturating_add(40)).count();
    assert!(blue > 2000, "{blue} pixels of water");
    // the same cells as in the table on the terminal
    let printed: Vec<Vec<&str>> = text
        .lines()
        .filter(|line| line.starts_with("wcsph"))
        .map(|line| line.split_whitespace().collect())
        .collect();
    assert_eq!(runs.len(), 2);
    assert_eq!(runs, &printed);
    assert!(page.contains("truth { pressure: 9810*max(0.1 - z, 0)"));
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

/// A plate so thin that coarse cells see nothing of it: what is not there has no figures.
#[test]
fn meshes_without_triangles_have_no_figures() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("plate.rfm"), "rfm 1\nsolid plate = box([0, 0, 0], [1.2345678, 1, 0.003])\n")
        .unwrap();
    let report = |flags: &[&str]| {
        rfm(here, &[&["report", "plate.rfm", "--mesh-cells", "16"], flags].concat()).expect(0)
    };
    let document = report(&["--json"]).json();
    let rows = document["meshes"].as_array().unwrap();
    let empty: Vec<_> = rows.iter().filter(|row| row["triangles"] == 0).collect();
    assert!(!empty.is_empty(), "{document}");
    for row in &empty {
        for figure in
            ["hausdorff", "mesh_to_surface_rms", "volume_error", "normal_error_rms", "flipped", "order"]
        {
            assert!(
                row.as_object().unwrap().contains_key(figure) && row[figure].is_null(),
                "{figure}: {row}"
            );
        }
    }
    assert!(rows.iter().all(|row| row["triangles"] == 0 || row["hausdorff"].is_number()), "{document}");
    let text = report(&["--html", "a.html"]).stdout;
    assert!(text.contains("no triangles: mc with "), "{text}");
    let line = text.lines().find(|line| line.starts_with("mc ")).unwrap();
    assert!(!line.contains("0.00e0") && line.matches('–').count() >= 8, "{line}");
    let page = std::fs::read_to_string(here.join("a.html")).unwrap();
    assert!(page.contains("no triangles: mc with ") && page.contains("<td>–</td>"));
    // numbers as a person reads them
    let (about, _) = page.split_once("</p>").unwrap();
    assert!(!about.contains("00000") && !about.contains("99999"), "{about}");
}
