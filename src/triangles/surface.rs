//! Triangles that share their corners, and whether they enclose a solid.

use std::fmt;

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::boxes::Space;
use super::nearest::{Feature, Plane};
use crate::geom::Aabb;

/// Number of holes that are listed.
pub const MOST_LISTED: usize = 4;

/// The most triangles that are taken.
const MOST_TRIANGLES: usize = 1 << 26;

/// A boundary of a surface that is not closed.
#[derive(Debug, Clone, PartialEq)]
pub struct Hole {
    /// How many edges it has.
    pub edges: usize,
    /// The middle of the box around it.
    pub centre: DVec3,
    /// The longest side of that box.
    pub size: f64,
}

/// What keeps triangles from enclosing a solid.
#[derive(Debug, Clone, PartialEq)]
pub enum NotClosed {
    /// There are none, or all have no area.
    Empty,
    /// More triangles than are taken.
    TooMany(usize),
    /// A coordinate is no number, or too large to have a square.
    NotFinite,
    /// Holes, the largest first; the first of them are listed.
    Holes {
        /// How many there are.
        count: usize,
        /// The largest ones.
        largest: Vec<Hole>,
    },
    /// Edges at which two triangles are wound in opposite ways.
    Winding {
        /// How many there are.
        count: usize,
        /// The middle of one.
        at: DVec3,
    },
    /// Edges at which more than two triangles meet.
    Branches {
        /// How many there are.
        count: usize,
        /// The middle of one.
        at: DVec3,
    },
    /// Triangles inside the solid, or inside a hollow of it.
    Overlap {
        /// How many there are.
        count: usize,
        /// The centre of one.
        at: DVec3,
    },
    /// Edges that pass through triangles.
    Crossing {
        /// How many there are.
        count: usize,
        /// Where one does.
        at: DVec3,
    },
}

impl fmt::Display for NotClosed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = |count: usize| if count == 1 { "" } else { "s" };
        match self {
            Self::Empty => f.write_str("it has no triangles with an area"),
            Self::TooMany(count) => write!(f, "it has {count} triangles; at most {MOST_TRIANGLES} are taken"),
            Self::NotFinite => f.write_str("a coordinate is not a finite number of a sensible size"),
            Self::Holes { count, largest } => {
                write!(f, "its surface has {count} hole{}: ", plural(*count))?;
                for (i, hole) in largest.iter().enumerate() {
                    let comma = if i == 0 { "" } else { "; " };
                    let (edges, at) = (hole.edges, place(hole.centre));
                    write!(
                        f,
                        "{comma}one of {edges} edge{}, {:.3} across, at {at}",
                        plural(edges),
                        hole.size
                    )?;
                }
                if *count > largest.len() {
                    write!(f, "; and {} more", count - largest.len())
                } else {
                    Ok(())
                }
            }
            Self::Winding { count, at } => {
                let at = place(*at);
                write!(
                    f,
                    "neighbouring triangles are wound in opposite ways at {count} edge{}, one of them at {at}",
                    plural(*count)
                )
            }
            Self::Branches { count, at } => {
                let at = place(*at);
                write!(
                    f,
                    "more than two triangles meet at {count} edge{}, one of them at {at}",
                    plural(*count)
                )
            }
            Self::Overlap { count, at } => {
                let at = place(*at);
                write!(
                    f,
                    "its surface runs through itself: {count} triangle{} inside it, one of them at {at}",
                    if *count == 1 { " lies" } else { "s lie" }
                )
            }
            Self::Crossing { count, at } => {
                let at = place(*at);
                write!(
                    f,
                    "its surface runs through itself: {count} edge{} through a triangle, one of them at {at}",
                    if *count == 1 { " passes" } else { "s pass" }
                )
            }
        }
    }
}

/// A place to a few digits.
fn place(p: DVec3) -> String {
    let rounded = p.to_array().map(|c| format!("{}", (c * 1e4).round() / 1e4 + 0.0));
    format!("[{}]", rounded.join(", "))
}

/// A closed surface.
pub struct Surface {
    places: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Unit normals; `None` for triangles without an area.
    normals: Vec<Option<DVec3>>,
    /// For the edges of each triangle, the sum of both normals.
    edge_normals: Vec<[DVec3; 3]>,
    /// Whether the sums at the edges and at the corners of a triangle decide the side of a point.
    clear_edges: Vec<[bool; 3]>,
    corner_normals: Vec<DVec3>,
    clear_corners: Vec<bool>,
    pub bounds: Aabb,
    space: Space,
    /// The longest side of the bounds, or the largest coordinate.
    pub size: f64,
}

impl Surface {
    pub fn new(soup: &[[DVec3; 3]]) -> Result<Self, NotClosed> {
        if soup.len() > MOST_TRIANGLES {
            return Err(NotClosed::TooMany(soup.len()));
        }
        if !soup.iter().flatten().all(|corner| corner.abs().cmplt(DVec3::splat(1e100)).all()) {
            return Err(NotClosed::NotFinite);
        }
        let (places, mut triangles) = shared(soup);
        let volume = six_volumes(&places, &triangles);
        if volume < 0.0 {
            triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        let edges = Edges::of(&triangles);
        edges.are_closed(&places, &triangles)?;
        let normals: Vec<Option<DVec3>> =
            triangles.iter().map(|t| Plane::of(t.map(|i| places[i as usize])).map(Plane::normal)).collect();
        if normals.iter().all(Option::is_none) {
            return Err(NotClosed::Empty);
        }
        let mut bounds = Aabb::EMPTY;
        for &[a, b, c] in &triangles {
            for i in [a, b, c] {
                bounds = bounds.union(&Aabb::new(places[i as usize], places[i as usize]));
            }
        }
        let size = bounds.size().max(bounds.min.abs()).max(bounds.max.abs()).max_element();
        let mut surface = Self {
            edge_normals: vec![[DVec3::ZERO; 3]; triangles.len()],
            clear_edges: vec![[true; 3]; triangles.len()],
            corner_normals: vec![DVec3::ZERO; places.len()],
            clear_corners: vec![true; places.len()],
            places,
            triangles,
            normals,
            bounds,
            space: Space::around(&bounds),
            size,
        };
        surface.add_normals(&edges);
        Ok(surface)
    }

    fn add_normals(&mut self, edges: &Edges) {
        let mut fans = vec![0_u32; self.places.len()];
        for t in 0..self.triangles.len() {
            let corners = self.triangles[t];
            let at = self.corners_of(t as u32);
            for k in 0..3 {
                fans[corners[k] as usize] += 1;
                let other = edges.opposite(corners[k], corners[(k + 1) % 3]);
                let both = [Some(t), other].map(|t| t.and_then(|t| self.normals[t]));
                self.edge_normals[t][k] = both.into_iter().flatten().sum();
                self.clear_edges[t][k] = both.iter().all(Option::is_some);
                let corner = corners[k] as usize;
                match self.normals[t] {
                    Some(normal) => {
                        let (u, v) = (at[(k + 1) % 3] - at[k], at[(k + 2) % 3] - at[k]);
                        let angle = u.cross(v).length().atan2(u.dot(v));
                        self.corner_normals[corner] += angle * normal;
                    }
                    None => self.clear_corners[corner] = false,
                }
            }
        }
        // where shells touch in a corner, one walk around it does not meet all of its triangles
        let mut seen = vec![false; self.places.len()];
        for (t, triangle) in self.triangles.iter().enumerate() {
            for (k, &corner) in triangle.iter().enumerate() {
                if !std::mem::replace(&mut seen[corner as usize], true) {
                    let met = edges.walk_around(&self.triangles, t, k);
                    self.clear_corners[corner as usize] &= met == fans[corner as usize];
                }
            }
        }
    }

    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// The space of boxes around its triangles.
    pub fn space(&self) -> &Space {
        &self.space
    }

    /// All corners, and the numbers of those of each triangle.
    pub fn parts(&self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        (self.places.clone(), self.triangles.clone())
    }

    pub fn corners_of(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|i| self.places[i as usize])
    }

    /// The numbers of a triangle's corners.
    pub fn numbers_of(&self, triangle: u32) -> [u32; 3] {
        self.triangles[triangle as usize]
    }

    /// The corner with a number.
    pub fn place(&self, corner: u32) -> DVec3 {
        self.places[corner as usize]
    }

    pub fn normal_of(&self, triangle: u32) -> Option<DVec3> {
        self.normals[triangle as usize]
    }

    /// The normal of a triangle, or one that a point on it may have if it has no area.
    pub fn face_normal(&self, triangle: u32) -> DVec3 {
        self.normals[triangle as usize].unwrap_or(DVec3::Z)
    }

    /// The outward normal or pseudonormal of a part of a triangle, and whether it decides the side of a
    /// point.
    pub fn normal_at(&self, triangle: u32, feature: Feature) -> (DVec3, bool) {
        let t = triangle as usize;
        match feature {
            Feature::Face { normal, .. } => (normal, true),
            Feature::Edge(k) => (self.edge_normals[t][k], self.clear_edges[t][k]),
            Feature::Corner(k) => {
                let corner = self.triangles[t][k] as usize;
                (self.corner_normals[corner], self.clear_corners[corner])
            }
        }
    }
}

/// The corners of triangles, each once, and the triangles by their numbers. Triangles with a corner twice are left out.
fn shared(soup: &[[DVec3; 3]]) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut places: Vec<DVec3> = Vec::with_capacity(soup.len() / 2 + 2);
    let mut numbers: FxHashMap<[u64; 3], u32> = FxHashMap::default();
    numbers.reserve(soup.len() / 2 + 2);
    let mut triangles = Vec::with_capacity(soup.len());
    for corners in soup {
        let triangle = corners.map(|corner| {
            let key = corner.to_array().map(|c| (c + 0.0).to_bits()); // −0 is 0
            *numbers.entry(key).or_insert_with(|| {
                places.push(corner);
                places.len() as u32 - 1
            })
        });
        let [a, b, c] = triangle;
        if a != b && b != c && c != a {
            triangles.push(triangle);
        }
    }
    (places, triangles)
}

/// Six times the volume, about a point of the surface.
fn six_volumes(places: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
    let Some(&origin) = places.first() else { return 0.0 };
    let at = |i: u32| places[i as usize] - origin;
    triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c)))).sum()
}

/// The triangles at each edge, by the corners of the edge in the order in which the triangle has them.
struct Edges(FxHashMap<(u32, u32), Sides>);

/// How many triangles have an edge in one direction, and one of them.
struct Sides {
    count: u32,
    triangle: u32,
}

impl Edges {
    fn of(triangles: &[[u32; 3]]) -> Self {
        let mut edges: FxHashMap<(u32, u32), Sides> = FxHashMap::default();
        edges.reserve(3 * triangles.len());
        for (t, &[a, b, c]) in triangles.iter().enumerate() {
            for edge in [(a, b), (b, c), (c, a)] {
                edges.entry(edge).or_insert(Sides { count: 0, triangle: t as u32 }).count += 1;
            }
        }
        Self(edges)
    }

    fn count(&self, from: u32, to: u32) -> u32 {
        self.0.get(&(from, to)).map_or(0, |sides| sides.count)
    }

    /// The triangle on the other side of an edge.
    fn opposite(&self, from: u32, to: u32) -> Option<usize> {
        self.0.get(&(to, from)).map(|sides| sides.triangle as usize)
    }

    /// How many triangles one meets on a walk around a corner.
    fn walk_around(&self, triangles: &[[u32; 3]], from: usize, corner: usize) -> u32 {
        let centre = triangles[from][corner];
        let (mut t, mut met) = (from, 0);
        loop {
            met += 1;
            let Some(k) = triangles[t].iter().position(|&i| i == centre) else { return met };
            let next = self.opposite(triangles[t][(k + 2) % 3], centre);
            match next {
                Some(next) if next != from && (met as usize) <= triangles.len() => t = next,
                _ => return met,
            }
        }
    }

    fn are_closed(&self, places: &[DVec3], triangles: &[[u32; 3]]) -> Result<(), NotClosed> {
        if triangles.is_empty() {
            return Err(NotClosed::Empty);
        }
        let middle = |(a, b): (u32, u32)| 0.5 * (places[a as usize] + places[b as usize]);
        let mut branches = Vec::new();
        let mut turned = Vec::new();
        let mut open = Vec::new();
        for (&(a, b), sides) in &self.0 {
            let back = self.count(b, a);
            match (sides.count, back) {
                (1, 1) => {}
                (2, 0) => turned.push((a, b)),
                (1, 0) => open.push((a, b)),
                _ => branches.push((a, b)),
            }
        }
        let first = |edges: &mut Vec<(u32, u32)>| {
            edges.sort_unstable();
            edges.first().map_or(DVec3::ZERO, |&edge| middle(edge))
        };
        if !open.is_empty() {
            return Err(holes(open, places));
        }
        if !branches.is_empty() {
            let at = first(&mut branches);
            branches.retain(|&(a, b)| a < b || self.count(b, a) == 0);
            return Err(NotClosed::Branches { count: branches.len(), at });
        }
        if !turned.is_empty() {
            let at = first(&mut turned);
            return Err(NotClosed::Winding { count: turned.len(), at });
        }
        Ok(())
    }
}

/// The boundaries that open edges make up: edges that share corners are of one hole.
fn holes(mut open: Vec<(u32, u32)>, places: &[DVec3]) -> NotClosed {
    open.sort_unstable();
    let mut parent: FxHashMap<u32, u32> = FxHashMap::default();
    fn root(parent: &mut FxHashMap<u32, u32>, mut i: u32) -> u32 {
        while let Some(&up) = parent.get(&i).filter(|&&up| up != i) {
            let above = parent.get(&up).copied().unwrap_or(up);
            parent.insert(i, above);
            i = above;
        }
        i
    }
    for &(a, b) in &open {
        let (a, b) = (root(&mut parent, a), root(&mut parent, b));
        parent.insert(a.max(b), a.min(b));
    }
    let mut found: FxHashMap<u32, (usize, Aabb)> = FxHashMap::default();
    for &(a, b) in &open {
        let (edges, bounds) = found.entry(root(&mut parent, a)).or_insert((0, Aabb::EMPTY));
        *edges += 1;
        for i in [a, b] {
            *bounds = bounds.union(&Aabb::new(places[i as usize], places[i as usize]));
        }
    }
    let mut all: Vec<(u32, Hole)> = found
        .into_iter()
        .map(|(first, (edges, bounds))| {
            (first, Hole { edges, centre: bounds.centre(), size: bounds.size().max_element() })
        })
        .collect();
    all.sort_by(|(i, a), (j, b)| b.size.total_cmp(&a.size).then(i.cmp(j)));
    let count = all.len();
    NotClosed::Holes { count, largest: all.into_iter().take(MOST_LISTED).map(|(_, hole)| hole).collect() }
}
