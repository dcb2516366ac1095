//! Splits what all walls do to a particle among the obstacles.

use glam::{DMat3, DVec3};
use smallvec::SmallVec;

use super::{
    boundary::{Boundary, FLUSH},
    corner::{Corner, Seen},
    coverage::{Coverage, is_positive_definite},
    friction::WallDrag,
    layers::Wall,
    symmetric::Symmetric,
};
use crate::field::{Face, Faces, Part, surface_face};
use crate::geom::Aabb;
use crate::sph::scales::Slip;

/// Part of a force that walls share in directions in which none of them acts.
const BESIDE: f64 = 1e-3;

/// Distance behind a face, over the support radius, at which a place is tested for being in its wall: less
/// than the thickness of any wall.
const BEHIND: f64 = 0.02;

/// Two faces count as parallel if the cosine of the angle between them is less than 1 by at most this: some
/// ten degrees.
const PARALLEL: f64 = 0.015;

/// What all walls together do to a particle.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::sph) struct Pushed {
    /// The acceleration by pressure, m/s².
    pub by_pressure: DVec3,
    /// The factor, m²/s², with which ∇λ of all walls is part of that. What is left completes forces at walls.
    pub factor: f64,
    /// ∇λ of all walls, 1/m.
    pub gradient: DVec3,
    /// The acceleration by friction, m/s².
    pub by_friction: DVec3,
    /// The velocity of the particle, m/s, and the kinematic viscosity, m²/s, with which walls rub on it; zero
    /// without friction.
    pub velocity: DVec3,
    pub viscosity: f64,
    /// How the fluid turns around the particle, 1/s, and the couple that walls exert on it by friction, m²/s²; zero
    /// if its viscous forces act along lines.
    pub spin: DVec3,
    pub couple: DVec3,
}

impl Pushed {
    /// Whether walls do nothing.
    pub fn is_nothing(&self) -> bool {
        let Self { by_pressure, factor, by_friction, couple, .. } = *self;
        (by_pressure, factor, by_friction, couple) == (DVec3::ZERO, 0.0, DVec3::ZERO, DVec3::ZERO)
    }
}

/// The part of one obstacle in that, m/s² and m²/s².
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::sph) struct Share {
    pub by_pressure: DVec3,
    pub by_friction: DVec3,
    pub couple: DVec3,
}

impl From<Pushed> for Share {
    /// All of it.
    fn from(Pushed { by_pressure, by_friction, couple, .. }: Pushed) -> Self {
        Self { by_pressure, by_friction, couple }
    }
}

/// What moves near a particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::sph) enum NearMotion {
    Nothing,
    /// One obstacle, and no other wall is near.
    Alone(usize),
    /// An obstacle, and other walls are near, which may move too.
    BesideOthers(usize),
}

/// A wall near a particle.
struct Near {
    /// Its number; `None` for the box.
    obstacle: Option<usize>,
    /// What it takes of the kernel.
    part: f64,
    /// ∇λ, 1/m.
    gradient: DVec3,
    /// K = ∫ y ⊗ ∇W.
    moment: DMat3,
    /// Whether the fluid sticks to it. The friction is that of such walls alone.
    sticks: bool,
    /// Its friction, were it alone.
    friction: WallDrag,
    /// Its faces, with those in which it ends behind them; none for the box.
    faces: Faces,
}

/// A face of a wall near a particle.
struct Facing {
    /// The wall, by its place among those near the particle.
    wall: usize,
    face: Face,
    /// How far behind the face the wall ends, m; infinite where it is as thick as a kernel is wide.
    thickness: f64,
}

impl Facing {
    /// Adds to what its wall takes, `times` times, what it would take of the kernel of a particle at a
    /// distance, m.
    fn press(&self, wall: &Wall, distance: f64, times: f64, near: &mut Near) {
        let behind =
            |distance: f64| Seen::of(&Coverage::<(), ()>::of_face(wall, &Face { distance, ..self.face }));
        near.add(&behind(distance), times);
        near.add(&behind(distance + self.thickness), -times);
    }
}

impl Boundary {
    /// Divides what walls do to a particle among the obstacles near it, and returns the share of each.
    ///
    /// Each wall presses as if it were alone, with p·∇λ of its own; in a corner as [`Corner`] says. Together
    /// the walls press less, because they overlap in a corner. The difference acts along them: it is what the
    /// mirror image in one wall lacks behind the other. Where walls do not overlap, as at a ball above a
    /// floor, the rest is the error of the closed forms of bent faces, and acts along the normals.
    ///
    /// The force that completes pressures is divided by the walls' K. A mirror image holds up the fluid
    /// beside its wall, and is pressed down as much at its end in the corner, so that along a wall all adds
    /// up to nothing. (Divided by the normals, the floor of a vessel had to hold up the images too, and bore
    /// 10 % less than the water on it with ten spacings from wall to wall.)
    ///
    /// Each wall to which the fluid sticks rubs as if it were alone, and so do walls on both sides of a narrow
    /// gap, which rub against each other. What is left, because walls overlap in a corner or the velocity bends
    /// towards them, is divided among them by the directions along them. All shares, that of the box included, add
    /// up to the whole, except for couples, which each wall exerts as if it were alone.
    pub fn divide(&self, wall: &Wall, p: DVec3, pushed: &Pushed, mut tell: impl FnMut(usize, Share)) {
        let mut near = self.near(wall, p);
        if let [] | [_] = &near[..] {
            if let Some(obstacle) = near.first().and_then(|only| only.obstacle) {
                tell(obstacle, (*pushed).into());
            }
            return;
        }
        let alone: SmallVec<[f64; 4]> = near.iter().map(|near| near.part).collect();
        let in_corner = self.press_in_corners(wall, p, &mut near);
        let rubbed: SmallVec<[[DVec3; 2]; 4]> = near
            .iter()
            .zip(&alone)
            .map(|(near, alone)| [near.rub(pushed), near.couple(pushed)].map(|rub| near.part / alone * rub))
            .collect();
        // that of strongly bent faces, and of thin walls, may have no share to give along their normals
        for near in near.iter_mut().filter(|near| !is_positive_definite(&near.moment)) {
            near.moment = near.part * DMat3::IDENTITY;
        }
        let Pushed { by_pressure, factor, gradient, by_friction, .. } = *pushed;
        let sum = |weight: fn(&Near) -> DMat3, of: fn(&Near) -> bool| {
            near.iter().filter(|near| of(near)).fold(DMat3::ZERO, |all, near| all + weight(near))
        };
        let completed = solved(sum(|near| near.moment, |_| true), by_pressure - factor * gradient);
        let share = if in_corner { Near::along } else { Near::across };
        let pressed = |near: &Near| factor * near.gradient + near.moment * completed;
        let left = solved(sum(share, |_| true), by_pressure - near.iter().map(pressed).sum::<DVec3>());
        let rubs = near.iter().any(|near| near.sticks && near.part > 0.0);
        let bent = by_friction - rubbed.iter().map(|[rub, _]| *rub).sum::<DVec3>();
        let bent = if rubs { solved(sum(Near::along, |near| near.sticks), bent) } else { DVec3::ZERO };
        for (near, [rubbed, couple]) in near.iter().zip(rubbed) {
            let Some(obstacle) = near.obstacle else { continue };
            let by_friction = if near.sticks { rubbed + near.along() * bent } else { DVec3::ZERO };
            tell(obstacle, Share { by_pressure: pressed(near) + share(near) * left, by_friction, couple });
        }
    }

    /// The moving obstacles that are nearer to a place than h, m.
    pub fn moving_near(&self, p: DVec3, h: f64) -> NearMotion {
        let place = Aabb::new(p, p);
        let is_near = |k: &usize| !self.field(*k).is_far(&place, h);
        let mut moving = self.broad_phase.at(p).filter(|k| self.obstacles[*k].moves()).filter(is_near);
        let Some(first) = moving.next() else { return NearMotion::Nothing };
        let in_the_open = self.domain.union(&place.grown(h)) == self.domain;
        let is_alone = in_the_open && !self.broad_phase.at(p).filter(|k| *k != first).any(|k| is_near(&k));
        if is_alone { NearMotion::Alone(first) } else { NearMotion::BesideOthers(first) }
    }

    /// The faces near a particle, with the numbers of their walls, except for those behind another wall,
    /// which takes over their part: a floor of the box below a slab that lies on it, or one of the faces of
    /// two walls that overlap.
    fn seen(&self, wall: &Wall, p: DVec3, near: &mut [Near]) -> Vec<Facing> {
        let of = |k: usize| self.faces_of(wall, p, &near[k]).into_iter().map(move |face| (k, face));
        let faces: Vec<(usize, Face)> = (0..near.len()).flat_map(of).collect();
        let thickness = |&(k, face): &(usize, Face)| {
            let own = faces.iter().filter(|&&(other, _)| other == k).map(|(_, other)| other);
            let backs = own.filter(|other| face.normal.dot(other.normal) < PARALLEL - 1.0);
            let depths = backs.map(|back| -back.distance - face.distance).filter(|depth| *depth > 0.0);
            depths.fold(f64::INFINITY, f64::min)
        };
        let deep = BEHIND * wall.h;
        let behind = |&(k, face): &(usize, Face)| {
            let at = |depth: f64| p - (face.distance + depth) * face.normal;
            let hides = |&&(other, before): &&(usize, Face)| {
                let nearer = face.distance - before.distance;
                // where both lie in one plane it is that of an obstacle, or that of the first one
                let is_first = (near[other].obstacle.is_some(), k) > (near[k].obstacle.is_some(), other);
                let is_before = nearer > deep || (nearer > -deep && is_first);
                let is_parallel = || face.normal.dot(before.normal) > 1.0 - PARALLEL;
                let touches = || nearer < deep || self.is_in(&near[other], at(-deep));
                let begins = || self.is_in(&near[other], p - (before.distance + deep) * before.normal);
                other != k
                    && is_before
                    && is_parallel()
                    && self.is_in(&near[k], at(deep))
                    && begins()
                    && touches()
            };
            faces.iter().find(hides).map(|&(other, _)| other)
        };
        let hidden: Vec<Option<usize>> = faces.iter().map(behind).collect();
        let is_seen = |k: usize| {
            let mut own = faces.iter().zip(&hidden).filter(|((other, _), _)| *other == k);
            own.any(|((_, face), hidden)| hidden.is_none() && face.distance > -deep)
        };
        for ((k, face), hidden) in faces.iter().zip(&hidden) {
            let &Some(other) = hidden else { continue };
            // the fluid feels the friction of what it cannot reach, too
            near[other].sticks |= near[*k].sticks;
            if is_seen(*k) {
                let taken = Coverage::<(), ()>::of_face(wall, face);
                near[*k].add(&Seen::of(&taken), -1.0);
                near[*k].part = (near[*k].part - taken.part).max(0.0);
            } else {
                (near[*k].gradient, near[*k].moment, near[*k].part) = (DVec3::ZERO, DMat3::ZERO, 0.0);
            }
        }
        let shown = faces.iter().zip(hidden).filter(|(_, hidden)| hidden.is_none()).map(|(face, _)| face);
        shown.map(|found| Facing { wall: found.0, face: found.1, thickness: thickness(found) }).collect()
    }

    /// Lets each wall press as it does in the corners that it has with others. Returns whether there are any.
    fn press_in_corners(&self, wall: &Wall, p: DVec3, near: &mut [Near]) -> bool {
        let faces = self.seen(wall, p, near);
        let deep = BEHIND * wall.h;
        // whether the particle presses on a face itself, and the distances of its images that do; `None` if
        // it is in no corner
        let mut presses: Vec<Option<(bool, SmallVec<[f64; 4]>)>> = vec![None; faces.len()];
        for (n, one) in faces.iter().enumerate() {
            for (m, other) in faces.iter().enumerate().skip(n + 1).filter(|(_, other)| other.wall != one.wall)
            {
                let (i, j) = (one.wall, other.wall);
                let Some(corner) = Corner::of(&one.face, &other.face, wall.h) else { continue };
                let lies_in = |k: usize, depth: [f64; 2]| self.is_in(&near[k], p + corner.edge(depth));
                // both faces begin at the edge, and there is no gap between the walls
                let begin = lies_in(i, [deep, -deep]) && lies_in(j, [-deep, deep]);
                // an obstacle that ends in a wall of the box is assumed to continue behind it
                let beside = 2.0 * FLUSH * wall.h;
                let is_box = |k: usize| near[k].obstacle.is_none();
                let go_on = [
                    lies_in(i, [deep, if is_box(j) { -beside } else { deep }]),
                    lies_in(j, [if is_box(i) { -beside } else { deep }, deep]),
                ];
                if !begin || go_on == [false; 2] {
                    continue;
                }
                for (on, at) in [n, m].into_iter().enumerate() {
                    let facing = &faces[at];
                    if !go_on[on] {
                        let strength = wall.strength(facing.face.distance / wall.h);
                        near[facing.wall].add(&corner.behind_both(wall.h), strength);
                        // a thin wall extends as far as it is thick
                        let mut behind = [one.face, other.face];
                        behind[on].distance += facing.thickness;
                        if facing.thickness < wall.h
                            && let Some(corner) = Corner::of(&behind[0], &behind[1], wall.h)
                        {
                            near[facing.wall].add(&corner.behind_both(wall.h), -strength);
                        }
                    }
                    let [own, image] = corner.pressing(on);
                    let (itself, images) = presses[at].get_or_insert_with(|| (true, SmallVec::new()));
                    *itself &= own.is_some();
                    images.extend(image);
                }
            }
        }
        for (facing, presses) in faces.iter().zip(&presses) {
            let Some((itself, images)) = presses else { continue };
            let near = &mut near[facing.wall];
            if !itself {
                facing.press(wall, facing.face.distance, -1.0, near);
            }
            for &distance in images {
                facing.press(wall, distance, 1.0, near);
            }
        }
        presses.iter().any(Option::is_some)
    }

    /// Whether a place lies in a wall.
    fn is_in(&self, near: &Near, q: DVec3) -> bool {
        match near.obstacle {
            Some(k) => self.field(k).omega(q) > 0.0,
            None => !self.domain.contains(q),
        }
    }

    /// The faces of a wall near a particle.
    fn faces_of(&self, wall: &Wall, p: DVec3, near: &Near) -> SmallVec<[Face; 6]> {
        if near.obstacle.is_none() {
            let [to_low, to_high] = [p - self.domain.min, self.domain.max - p];
            let axes = DVec3::AXES.into_iter();
            let faces = axes.flat_map(|n| [(n, to_low.dot(n)), (-n, to_high.dot(n))]);
            let reached = faces.filter(|(_, distance)| *distance < wall.h);
            return reached
                .map(|(normal, distance)| Face { distance, normal, mean_curvature: 0.0 })
                .collect();
        };
        let faces = near.faces.iter().filter_map(|part| match part {
            Part::Face(face) => Some(*face),
            Part::All(_) | Part::Any(_) => None,
        });
        faces.filter(|face| !self.ends_at_box(p, face, wall.h)).collect()
    }

    /// The walls within reach of a particle that at least one wall is near.
    fn near(&self, wall: &Wall, p: DVec3) -> SmallVec<[Near; 4]> {
        let near = |obstacle: Option<usize>, coverage: &Coverage<WallDrag>, faces: Faces| {
            let slip = obstacle.map_or(self.slip, |k| self.obstacles[k].slip);
            let Coverage { part, friction, .. } = *coverage;
            let Seen { gradient, moment } = Seen::of(&coverage.without_friction());
            Near { obstacle, part, gradient, moment, sticks: slip == Slip::No, friction, faces }
        };
        let mut found: SmallVec<[Near; 4]> = SmallVec::new();
        // walls behind obstacles are found by their faces below
        let of_box = self.of_whole_box::<WallDrag, ()>(wall, p);
        if of_box.part > 0.0 {
            found.push(near(None, &of_box, Faces::new()));
        }
        if found.is_empty() && self.obstacles.len() == 1 {
            found.push(near(Some(0), &Coverage::default(), Faces::new()));
            return found;
        }
        let place = Aabb::new(p, p);
        for k in self.broad_phase.at(p) {
            if self.field(k).is_far(&place, wall.h) {
                continue;
            }
            let faces = self.faces_before(wall, p, k);
            let coverage = Coverage::<WallDrag>::default().or(&self.of_faces(wall, p, faces.clone(), k));
            if coverage.part > 0.0 {
                found.push(near(Some(k), &coverage, faces));
            }
        }
        found
    }

    /// The faces of an obstacle near a particle. Where it ends behind one of them within the support radius,
    /// as a thin plate does, the face in which it ends is listed with it; and where it has a face across the fluid as
    /// well, as a narrow channel does, that is listed, because a formula such as `y*(b - y)` tells the nearest alone.
    fn faces_before(&self, wall: &Wall, p: DVec3, k: usize) -> Faces {
        let mut told = Faces::new();
        self.field(k).faces(p, wall.h, &mut told);
        let mut faces = Faces::new();
        for part in &told {
            if let Part::Face(front) = part
                && let Some(across) = self.across_from(wall, p, (front, &told), k)
            {
                faces.push(Part::Any(2));
                faces.push(Part::Face(across));
            }
            if let Part::Face(front) = part
                && let Some(back) = self.back_of(wall, p, front, k)
            {
                faces.push(Part::All(2));
                faces.push(Part::Face(back));
            }
            faces.push(*part);
        }
        faces
    }

    /// The face of an obstacle across the fluid from another one of it, within the support radius; `None` if there is none,
    /// or if it is told anyway.
    fn across_from(&self, wall: &Wall, p: DVec3, (front, told): (&Face, &Faces), k: usize) -> Option<Face> {
        let deep = BEHIND * wall.h;
        if front.distance < -deep || front.distance >= wall.h {
            return None;
        }
        let way = 0.5 * wall.h;
        let mut there = Faces::new();
        self.field(k).faces(p + way * front.normal, wall.h, &mut there);
        let seen = there.iter().filter_map(|part| match part {
            Part::Face(face) => {
                let looks_here = front.normal.dot(face.normal) < PARALLEL - 1.0;
                looks_here.then_some(Face { distance: face.distance + way, ..*face })
            }
            Part::All(_) | Part::Any(_) => None,
        });
        let is_within = |face: &Face| face.distance > -deep && face.distance < wall.h;
        let across = seen.filter(is_within).min_by(|a, b| a.distance.total_cmp(&b.distance))?;
        let is_told = told.iter().any(|part| match part {
            Part::Face(face) => face.normal.dot(across.normal) > 1.0 - PARALLEL,
            Part::All(_) | Part::Any(_) => false,
        });
        let begins = || self.field(k).omega(p + (across.distance + deep) * front.normal) >= 0.0;
        (!is_told && begins()).then_some(across)
    }

    /// The face in which an obstacle ends behind another one that is before a particle; `None` if that is not
    /// within the support radius.
    fn back_of(&self, wall: &Wall, p: DVec3, front: &Face, k: usize) -> Option<Face> {
        if front.distance < -BEHIND * wall.h || front.distance >= wall.h {
            return None;
        }
        let beyond = p - (front.distance + wall.h) * front.normal;
        let mut there = Faces::new();
        self.field(k).faces(beyond, wall.h, &mut there);
        // to ask for ω would take longer where a solid has hundreds of parts
        if surface_face(&there).is_none_or(|surface| surface.distance <= 0.0) {
            return None;
        }
        let backs = there.iter().filter_map(|part| match part {
            Part::Face(back) => {
                let looks_back = front.normal.dot(back.normal) < PARALLEL - 1.0;
                (looks_back && back.distance >= 0.0).then_some(back)
            }
            Part::All(_) | Part::Any(_) => None,
        });
        let back = backs.min_by(|a, b| a.distance.total_cmp(&b.distance))?;
        Some(Face { distance: back.distance - wall.h - front.distance, ..*back })
    }
}

impl Seen {
    fn of(coverage: &Coverage) -> Self {
        let moment = coverage.part * DMat3::IDENTITY + coverage.spread.to_matrix();
        Self { gradient: coverage.gradient, moment }
    }
}

/// The solution x of A·x = b; zero if A has no inverse, as where nothing is left of any wall.
fn solved(a: DMat3, b: DVec3) -> DVec3 {
    let x = a.inverse() * b;
    if x.is_finite() { x } else { DVec3::ZERO }
}

impl Near {
    /// Adds a part of a wall the given number of times.
    fn add(&mut self, seen: &Seen, times: f64) {
        self.gradient += times * seen.gradient;
        self.moment += times * seen.moment;
    }

    /// The acceleration by its friction, m/s², were it alone and the velocity of the fluid not bent.
    fn rub(&self, Pushed { velocity, viscosity, .. }: &Pushed) -> DVec3 {
        self.friction.rub(*velocity, *viscosity)
    }

    /// The couple that it exerts by friction, m²/s², were it alone.
    fn couple(&self, Pushed { velocity, viscosity, spin, .. }: &Pushed) -> DVec3 {
        self.friction.couple(*velocity, *spin, *viscosity)
    }

    /// λ·(n⊗n), and a little in all directions.
    fn across(&self) -> DMat3 {
        self.part * (self.square_of_normal() + BESIDE * DMat3::IDENTITY)
    }

    /// λ·(1 − n⊗n), and a little in all directions.
    fn along(&self) -> DMat3 {
        self.part * ((1.0 + BESIDE) * DMat3::IDENTITY - self.square_of_normal())
    }

    fn square_of_normal(&self) -> DMat3 {
        Symmetric::square(self.gradient.normalize_or_zero()).to_matrix()
    }
}

#[cfg(test)]
mod tests;
