//! Surfaces of lattices, whose volume is known, and files that are whole, odd and broken.

use glam::DVec3;

use super::*;
use crate::mesh::{is_closed_manifold, shells};

const SPACING: f64 = 0.05;

/// A cube of n³ particles, each in the middle of its cell.
fn lattice(n: usize, corner: DVec3) -> Vec<DVec3> {
    let cell = |i: usize| DVec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64);
    (0..n * n * n).map(|i| corner + (cell(i) + 0.5) * SPACING).collect()
}

fn volume(mesh: &Mesh) -> f64 {
    shells(mesh).iter().map(|shell| shell.volume).sum()
}

fn advised() -> Reconstruction {
    Reconstruction::of_radius(0.5 * SPACING)
}

/// The density falls from 1 to 0 at the faces of the outermost cells. Edges and corners are rounded off,
/// which removes less of a larger cube.
#[test]
fn a_cube_of_particles_keeps_its_volume() {
    let part = |n: usize| {
        let mesh = advised().mesh(&lattice(n, DVec3::new(100.0, -3.0, 0.0))).unwrap();
        assert!(is_closed_manifold(&mesh));
        assert_eq!(shells(&mesh).len(), 1);
        volume(&mesh) / (n as f64 * SPACING).powi(3)
    };
    let parts = [6, 12, 24].map(part);
    println!("volume over that of the particles: {parts:?}");
    assert!((0.9..1.05).contains(&parts[0]), "{parts:?}");
    assert!((parts[2] - 1.0).abs() < 0.02, "{parts:?}");
}

#[test]
fn the_surface_does_not_depend_on_threads() {
    // wider than one subdomain of 64 cells, so that patches are stitched
    let mut particles = lattice(12, DVec3::ZERO);
    particles.extend(lattice(12, DVec3::new(0.9, 0.2, 0.1)));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| advised().mesh(&particles).unwrap())
    };
    let one = with(1);
    assert!(is_closed_manifold(&one) && shells(&one).len() == 2);
    assert!((1..=8).all(|threads| with(threads) == one));
}

#[test]
fn single_and_coincident_particles_have_a_surface() {
    assert_eq!(advised().mesh(&[]), Ok(Mesh::default()));
    // a single particle has the density of its own kernel only, by which splashsurf divides, so a
    // ball remains
    for particles in [vec![DVec3::ZERO], vec![DVec3::ONE; 2], vec![DVec3::splat(1e6); 3]] {
        let mesh = advised().mesh(&particles).unwrap();
        assert!(is_closed_manifold(&mesh) && volume(&mesh) > 0.0, "{particles:?}");
    }
}

#[test]
fn what_cannot_be_meshed_is_refused() {
    let two = [DVec3::ZERO, DVec3::new(1e30, 0.0, 0.0)];
    assert!(matches!(advised().mesh(&two), Err(SurfaceError::TooWide { .. })));
    let nan = [DVec3::ZERO, DVec3::new(0.0, f64::NAN, 0.0)];
    assert_eq!(advised().mesh(&nan), Err(SurfaceError::NotANumber { index: 1 }));
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(Reconstruction::of_radius(radius).mesh(&two), Err(SurfaceError::Length));
    }
    let fine = Reconstruction { cell: 1e-4, ..advised() };
    assert!(matches!(fine.mesh(&two[..1]), Err(SurfaceError::CellTooSmall { .. })));
    for error in [SurfaceError::Length, SurfaceError::TooWide { extent: 1e30, cell: 0.1 }] {
        assert!(!error.to_string().is_empty());
    }
}

/// Two points are stored in each of the ways.
#[test]
fn arrays_are_read_however_they_are_stored() {
    let expected = vec![DVec3::new(1.0, -2.0, 0.5), DVec3::new(1e-3_f32.into(), 4.0, 1e10)];
    let floats: Vec<f32> = expected.iter().flat_map(|p| p.to_array()).map(|x| x as f32).collect();
    let little = |x: &f32| x.to_le_bytes().to_vec();
    let big = |x: &f32| f64::from(*x).to_be_bytes().to_vec();
    let bytes: Vec<u8> = floats.iter().flat_map(little).collect();
    let wide: Vec<u8> = floats.iter().flat_map(big).collect();
    let file = |attributes: &str, array: &str, behind: &[u8]| {
        let head = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" {attributes}><PolyData>\
             <Piece NumberOfPoints=\"2\"><Points>{array}</Points></Piece></PolyData>"
        );
        let file = [head.as_bytes(), behind, b"</VTKFile>\n"].concat();
        assert_eq!(read_points(&file), Ok(expected.clone()), "{}", String::from_utf8_lossy(&file));
        // cut off anywhere, the file gives an error, and never a panic or other points
        for end in 0..file.len() {
            match read_points(&file[..end]) {
                Ok(points) => assert_eq!(points, expected, "cut at {end}"),
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    };
    let text = floats.iter().map(f32::to_string).collect::<Vec<_>>().join(" ");
    file("", &format!("<DataArray type=\"Float32\" NumberOfComponents=\"3\">{text}</DataArray>"), b"");
    let encode = |bytes: &[u8]| base64::Engine::encode(&base64::prelude::BASE64_STANDARD, bytes);
    let joined = encode(&[&24_u32.to_le_bytes()[..], &bytes].concat());
    let inline =
        |data: &str| format!("<DataArray type=\"Float32\" format=\"binary\">\n {data}\n</DataArray>");
    file("byte_order=\"LittleEndian\"", &inline(&joined), b"");
    // length and data are padded separately
    let apart = encode(&24_u32.to_le_bytes()) + &encode(&bytes);
    file("byte_order=\"LittleEndian\"", &inline(&apart), b"");
    let doubles = "<DataArray type=\"Float64\" format=\"appended\" offset=\"4\"/>";
    let raw = [b"<AppendedData encoding=\"raw\">\n _<&_>", &48_u64.to_be_bytes()[..], &wide].concat();
    file(
        "byte_order=\"BigEndian\" header_type=\"UInt64\"",
        doubles,
        &[&raw[..], b"</AppendedData>"].concat(),
    );
    let behind = format!("<AppendedData encoding=\"base64\">_AAAA{joined}AAAA</AppendedData>");
    file("", "<DataArray type=\"Float32\" format=\"appended\" offset=\"4\"/>", behind.as_bytes());
}

#[test]
fn broken_frames_are_told_apart() {
    let frame = |attributes: &str, piece: &str| {
        let text = format!(
            "<VTKFile type=\"PolyData\" {attributes}><PolyData><Piece {piece}</Piece></PolyData></VTKFile>"
        );
        read_points(text.as_bytes()).unwrap_err()
    };
    let array = |attributes: &str, text: &str| {
        format!("NumberOfPoints=\"1\"><Points><DataArray {attributes}>{text}</DataArray></Points>")
    };
    let three = array("type=\"Float32\"", "1 2 3");
    assert_eq!(
        frame("compressor=\"vtkZLibDataCompressor\"", &three),
        FrameError::Unsupported("compression by vtkZLibDataCompressor".into())
    );
    assert_eq!(frame("", "NumberOfPoints=\"1\">"), FrameError::Missing("positions"));
    assert_eq!(frame("", "><Points/>"), FrameError::Missing("NumberOfPoints"));
    assert_eq!(frame("", &array("type=\"Float32\"", "1 2")), FrameError::Count { expected: 3, found: 2 });
    assert_eq!(frame("", &array("type=\"Float32\"", "1 2 x")), FrameError::Malformed("a number"));
    assert_eq!(
        frame("", &array("type=\"Int32\"", "1 2 3")),
        FrameError::Unsupported("positions of the type Int32".into())
    );
    let appended = array("type=\"Float32\" format=\"appended\" offset=\"0\"", "");
    assert_eq!(frame("", &appended), FrameError::Missing("appended data"));
    for other in [&b"solid pawn"[..], b"<svg/>", b"", b"\xff\xfe", b"<VTKFile type=\"ImageData\"/>"] {
        assert!(matches!(read_points(other), Err(FrameError::NotPolyData(_))));
    }
}

#[test]
fn collections_are_read_in_their_order() {
    let text = "<VTKFile type=\"Collection\"><Collection>\
                <DataSet timestep=\"0\" part=\"0\" file=\"frames/a.vtp\"/>\
                <DataSet timestep=\"0.04\" part=\"0\" file=\"b&amp;c.vtp\"/></Collection></VTKFile>";
    let entry = |time: f64, file: &str| FrameEntry { time, file: file.to_string() };
    assert_eq!(read_collection(text), Ok(vec![entry(0.0, "frames/a.vtp"), entry(0.04, "b&c.vtp")]));
    let broken = text.replace("0.04", "late");
    assert_eq!(read_collection(&broken), Err(CollectionError::Entry { index: 1 }));
    assert!(matches!(read_collection("x"), Err(CollectionError::NotACollection(_))));
    assert!(matches!(read_collection("<VTKFile/>"), Err(CollectionError::NotACollection(_))));
}

#[test]
fn bodies_of_a_mesh_are_numbered_at_their_vertices() {
    let triangle = Mesh::from_triangles(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]);
    let meshes = [triangle.clone(), Mesh::default(), triangle];
    let mut bytes = Vec::new();
    crate::mesh::vtp::write_bodies(&meshes, crate::mesh::LengthUnit::METRE, &mut bytes).unwrap();
    let (points, arrays) = read_arrays(&bytes).unwrap();
    let body = arrays.iter().find(|array| array.name == "body").unwrap();
    assert_eq!((points.len(), &body.values[..]), (6, &[0.0, 0.0, 0.0, 2.0, 2.0, 2.0][..]));
    assert_eq!(read_mesh(&bytes).unwrap().triangles, [[0, 1, 2], [3, 4, 5]]);
}

/// A pool that fills the floor of a box up to its walls, and a drop that touches none.
#[test]
fn walls_hold_the_fluid() {
    let pool: Vec<DVec3> = lattice(16, DVec3::ZERO).into_iter().filter(|p| p.z < 0.4).collect();
    let vessel = Aabb::new(DVec3::ZERO, DVec3::splat(0.8));
    let held = Reconstruction { vessel: Some(vessel), ..advised() };
    let mesh = held.mesh(&pool).unwrap();
    assert!(is_closed_manifold(&mesh));
    assert!(mesh.positions.iter().all(|p| p.clamp(vessel.min, vessel.max) == *p));
    let part = volume(&mesh) / (0.8 * 0.8 * 0.4);
    println!("volume over that of the particles: {part}");
    assert!((part - 1.0).abs() < 0.01, "{part}");
    let level = mesh.positions.iter().map(|p| p.z).fold(0.0, f64::max);
    assert!((level - 0.4).abs() < 0.1 * SPACING, "{level}");

    // its images are there, but it does not touch the floor
    let drop = lattice(6, DVec3::new(0.25, 0.25, 1.3 * SPACING));
    let mesh = held.mesh(&drop).unwrap();
    assert!(is_closed_manifold(&mesh) && shells(&mesh).len() == 1);
    let alone = advised().mesh(&drop).unwrap();
    assert!((volume(&mesh) / volume(&alone) - 1.0).abs() < 0.01);
    assert!(mesh.positions.iter().all(|p| p.z > 0.5 * SPACING));
}
