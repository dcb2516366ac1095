//! Motion without deformation, read off a formula.
//!
//! A solid that is moved and turned has x, y and z in its formula only through linear functions of them,
//! whose coefficients depend on time: x cos 2πt + y sin 2πt. Each is the distance from a plane, times a
//! factor. If one rotation and one translation bring all of these planes from where they are at the time 0 to
//! where they are now, they bring the solid there. With the velocity v(p) = v₀ + ω × p a plane n·p + o that
//! the solid carries along has n' = ω × n and o' = −n·v₀. This is known of a turning cylinder, too, although
//! its surface stays where it is.

use glam::{DMat3, DQuat, DVec3};

use crate::geom::{Placement, Twist};
use crate::ir::derived::gradient::gradient_and_rate;
use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::interpreter::{Given, Interpreter};
use crate::ir::op::{Binary, Unary};

/// Relative difference between numbers that count as equal.
const SAME: f64 = 1e-10;

/// Rounding of a plane's offset over the length of its normal: planes are found from their values at a distance of one.
const ROUNDED: f64 = 16.0 * f64::EPSILON;

/// Least angle, rad, between planes that count as independent.
const INDEPENDENT: f64 = 1e-3;

/// How a formula depends on the place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Degree {
    Constant,
    Linear,
    Other,
}

impl Degree {
    fn of(expr: Expr, known: &[Self]) -> Self {
        let degree = |node: Node| known[node.index()];
        match expr {
            Expr::Coordinate(Axis::X | Axis::Y | Axis::Z) => Self::Linear,
            Expr::Coordinate(Axis::T) | Expr::Constant(_) | Expr::Parameter(_) | Expr::Uniform(_) => {
                Self::Constant
            }
            Expr::Unary(Unary::Neg, a) => degree(a),
            Expr::Binary(Binary::Add | Binary::Sub, a, b) => degree(a).max(degree(b)),
            Expr::Binary(Binary::Mul, a, b) if degree(a).min(degree(b)) == Self::Constant => {
                degree(a).max(degree(b))
            }
            Expr::Binary(Binary::Div, a, b) if degree(b) == Self::Constant => degree(a),
            Expr::Unary(..) | Expr::Binary(..) | Expr::Lookup(..) => {
                if expr.operands().all(|operand| degree(operand) == Self::Constant) {
                    Self::Constant
                } else {
                    Self::Other
                }
            }
        }
    }
}

/// The linear function p ↦ normal·p + offset.
#[derive(Debug, Clone, Copy)]
struct Plane {
    normal: DVec3,
    offset: f64,
}

/// A formula that may move without deformation.
#[derive(Debug)]
pub struct RigidMotion {
    interpreter: Interpreter,
    /// Their derivatives by time.
    rates: Interpreter,
    count: usize,
    /// The planes at the time 0.
    at_start: Vec<Plane>,
}

impl RigidMotion {
    /// What a formula shows of its motion; `None` if it has no value at the time 0.
    pub fn of(graph: &Graph, root: Node) -> Option<Self> {
        let mut degrees = vec![Degree::Other; root.index() + 1];
        let mut planes = Vec::new();
        let cone = graph.cone(root);
        for &node in &cone {
            degrees[node.index()] = Degree::of(graph.expr(node), &degrees);
        }
        let ends = |node: Node| degrees[node.index()] != Degree::Other;
        let used = cone.iter().filter(|&&node| !ends(node)).flat_map(|&node| graph.expr(node).operands());
        for node in used.chain([root]).filter(|&node| ends(node)) {
            if !planes.contains(&node) && !matches!(graph.expr(node), Expr::Constant(_)) {
                planes.push(node);
            }
        }
        let interpreter = Interpreter::new(graph, &planes);
        let count = planes.len();
        let at_start = planes_at(&interpreter, count, 0.0)?;
        let mut graph = graph.clone();
        let rates: Vec<Node> = planes.iter().map(|&plane| gradient_and_rate(&mut graph, plane)[3]).collect();
        Some(Self { interpreter, rates: Interpreter::new(&graph, &rates), count, at_start })
    }

    /// Where the solid is at a time, s, seen from where it is at the time 0; `None` if it has another shape.
    pub fn placement(&self, time: f64) -> Option<Placement> {
        let now = self.planes(time)?;
        let frame = Frame::of(&self.at_start);
        let rotation = frame.rotation(&now);
        let translation = frame.translation(&self.at_start, &now, rotation);
        let placement = Placement { rotation, translation };
        let is_one = |(start, now): (&Plane, &Plane)| {
            let normal = rotation * start.normal;
            let offset = start.offset - now.normal.dot(translation);
            let length = start.normal.length();
            (normal - now.normal).length() <= SAME * length
                && (offset - now.offset).abs()
                    <= SAME * (start.offset.abs() + now.offset.abs() + length * translation.length())
                        + ROUNDED * length
        };
        let is_turn = (rotation.determinant() - 1.0).abs() < SAME;
        (is_turn && self.at_start.iter().zip(&now).all(is_one)).then_some(placement)
    }

    /// How the solid moves at a time, s; `None` if it is deformed, or if its planes do not determine how it
    /// moves along its surface: those of a half-space, or of a prism without ends that tilts.
    pub fn twist(&self, time: f64) -> Option<Twist> {
        let now = self.planes(time)?;
        let rates = planes_at(&self.rates, self.count, time)?;
        let frame = Frame::of(&now);
        let angular = angular_velocity(&now, &rates)?;
        let is_known = match frame.axes[..] {
            [a, b] => angular.dot(a).abs().max(angular.dot(b).abs()) <= SAME * angular.length(),
            [_, _, _] => true,
            _ => false,
        };
        let mut velocity = DVec3::ZERO;
        for (&(k, length), &axis) in frame.chosen.iter().zip(&frame.axes) {
            let (wanted, normal) = (-rates[k].offset / length, now[k].normal / length);
            velocity += (wanted - normal.dot(velocity)) / normal.dot(axis) * axis;
        }
        let twist = Twist { velocity, angular };
        let (slow, fast) = (SAME * velocity.length(), SAME * angular.length());
        let is_carried = |(plane, rate): (&Plane, &Plane)| {
            let length = plane.normal.length();
            (angular.cross(plane.normal) - rate.normal).length() <= length * fast
                && (rate.offset + plane.normal.dot(velocity)).abs()
                    <= length * slow + plane.offset.abs() * fast + SAME * rate.offset.abs()
        };
        (is_known && now.iter().zip(&rates).all(is_carried)).then_some(twist)
    }

    fn planes(&self, time: f64) -> Option<Vec<Plane>> {
        planes_at(&self.interpreter, self.count, time)
    }
}

/// The linear functions of the place that formulas are at a time, s; `None` where they have no value.
fn planes_at(formulas: &Interpreter, count: usize, time: f64) -> Option<Vec<Plane>> {
    let at = |point: DVec3| {
        let mut values = vec![0.0; count];
        formulas.eval_given(Given { time, ..Given::point(point.to_array()) }, &mut values);
        values
    };
    let [origin, x, y, z] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(at);
    let plane = |k: usize| {
        let offset = origin[k];
        Plane { normal: DVec3::new(x[k], y[k], z[k]) - offset, offset }
    };
    let planes: Vec<_> = (0..count).map(plane).collect();
    planes.iter().all(|plane| plane.normal.is_finite() && plane.offset.is_finite()).then_some(planes)
}

/// ω with n' = ω × n for all planes, by least squares, 1/s; `None` if they are all parallel.
fn angular_velocity(now: &[Plane], rates: &[Plane]) -> Option<DVec3> {
    let (mut matrix, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for (plane, rate) in now.iter().zip(rates) {
        let length = plane.normal.length();
        if length > 0.0 {
            let normal = plane.normal / length;
            let square = DMat3::from_cols(normal.x * normal, normal.y * normal, normal.z * normal);
            matrix += DMat3::IDENTITY - square;
            right += normal.cross(rate.normal / length);
        }
    }
    let size = matrix.col(0).x + matrix.col(1).y + matrix.col(2).z;
    let is_singular = matrix.determinant() <= (INDEPENDENT * size).powi(2) * size;
    (!is_singular).then(|| matrix.inverse() * right)
}

/// Up to three independent planes, made orthonormal one after the other.
struct Frame {
    /// Their numbers, and the lengths of their normals.
    chosen: Vec<(usize, f64)>,
    axes: Vec<DVec3>,
}

impl Frame {
    fn of(planes: &[Plane]) -> Self {
        let mut frame = Self { chosen: Vec::new(), axes: Vec::new() };
        for (k, plane) in planes.iter().enumerate() {
            let length = plane.normal.length();
            let unit = plane.normal / length;
            let rest = frame.axes.iter().fold(unit, |rest, &axis| rest - unit.dot(axis) * axis);
            if length > 0.0 && rest.length() > INDEPENDENT && frame.axes.len() < 3 {
                frame.chosen.push((k, length));
                frame.axes.push(rest.normalize());
            }
        }
        frame
    }

    /// The rotation that brings the axes to where they are among these planes.
    fn rotation(&self, now: &[Plane]) -> DMat3 {
        let there = Self::of(&self.chosen.iter().map(|&(k, _)| now[k]).collect::<Vec<_>>());
        let between = |from: DMat3, to: DMat3| to * from.transpose();
        let completed = |a: DVec3, b: DVec3| DMat3::from_cols(a, b, a.cross(b));
        match (&self.axes[..], &there.axes[..]) {
            ([], _) => DMat3::IDENTITY,
            (&[from], &[to]) => DMat3::from_quat(DQuat::from_rotation_arc(from, to)),
            (&[a, b], &[c, d]) => between(completed(a, b), completed(c, d)),
            (&[a, b, c], &[d, e, f]) => between(DMat3::from_cols(a, b, c), DMat3::from_cols(d, e, f)),
            // planes that have become parallel: no rotation makes them so
            (_, _) => DMat3::ZERO,
        }
    }

    /// The translation, in the directions in which the planes determine it.
    fn translation(&self, start: &[Plane], now: &[Plane], rotation: DMat3) -> DVec3 {
        let mut translation = DVec3::ZERO;
        for (&(k, length), &axis) in self.chosen.iter().zip(&self.axes) {
            let axis = rotation * axis;
            let (wanted, normal) = ((start[k].offset - now[k].offset) / length, now[k].normal / length);
            translation += (wanted - normal.dot(translation)) / normal.dot(axis) * axis;
        }
        translation
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Program, Solid};

    fn solid(text: &str) -> Solid {
        let program = Program::from_source("moving.rfm", format!("rfm 1\nsolid s = {text}")).unwrap();
        program.solid("s").unwrap()
    }

    fn motion(solid: &Solid) -> RigidMotion {
        let (graph, root) = solid.formula();
        RigidMotion::of(graph, root).unwrap()
    }

    /// The solid now is that at the start, moved.
    #[test]
    fn turned_and_moved_solids_are_found() {
        for text in [
            "box([-1,-2,-3],[1,2,3]).move([t, 0, 2*t])",
            "sphere(1).move([0, sin(t), 0])",
            "(cylinder(0.1, 2) or box([0,0,0],[1,0.1,1]).rotate_x(30 deg)).move([1,0,0]).rotate_z(1.5*t).move([0, t^2, 3])",
            "x <= t",
            "x + 2*y <= t and z >= 0",
            "cylinder(1, 2).rotate_y(t).rotate_z(2*t)",
        ] {
            let solid = solid(text);
            let motion = motion(&solid);
            for time in [0.0, 0.3, 1.7, 100.0] {
                let placement = motion.placement(time).unwrap_or_else(|| panic!("{text} at {time}"));
                for p in [DVec3::new(0.3, -0.2, 0.5), DVec3::new(-1.0, 2.0, 0.1)] {
                    let (now, then) = (solid.at(time).omega(p), solid.at(0.0).omega(placement.back(p)));
                    assert!((now - then).abs() < 1e-9 * (1.0 + now.abs()), "{text} at {time}: {now} {then}");
                }
            }
        }
    }

    /// A body that has just set out has moved by less than the rounding of its planes, of which one goes
    /// through the origin.
    #[test]
    fn the_first_steps_of_a_motion_are_found() {
        for speed in [3, 4, 5, 7] {
            let solid = solid(&format!("box([-1,-5,-5],[0,5,5]).move([{speed}*max(t - 0.3, 0), 0, 0])"));
            for time in [0.3, 0.1 + 0.2, 0.3 + 1e-15, 0.3 + 1e-12] {
                assert!(motion(&solid).placement(time).is_some(), "{speed} at {time}");
            }
        }
    }

    /// A point that is carried along has the velocity that the twist says, by central differences.
    #[test]
    fn their_velocity_is_that_of_points_carried_along() {
        for text in [
            "cylinder(0.2, 2).rotate_z(5*t)",
            "sphere(1).rotate([1, 2, -1], 3*t).move([t^2, 0, sin(t)])",
            "box([-1,-2,-3],[1,2,3]).move([0.5, 0, 0]).rotate_y(t^2)",
            "(x^2 + y^2 <= 1).rotate_z(t)",
        ] {
            let solid = solid(text);
            let motion = motion(&solid);
            for time in [0.0, 0.4, 2.3] {
                let twist = motion.twist(time).unwrap_or_else(|| panic!("{text} at {time}"));
                let step = 1e-5;
                let now = motion.placement(time).unwrap();
                let [before, after] = [-step, step].map(|dt| motion.placement(time + dt).unwrap());
                for p in [DVec3::new(0.3, -0.2, 0.5), DVec3::new(-1.0, 2.0, 0.1)] {
                    let start = now.back(p);
                    let there = |place: &Placement| place.rotation * start + place.translation;
                    let expected = (there(&after) - there(&before)) / (2.0 * step);
                    let found = twist.at(p);
                    assert!(found.distance(expected) < 1e-7, "{text} at {time}: {found} {expected}");
                }
            }
        }
        // how these move along their surfaces is unknown
        for text in ["x <= t", "(x^2 + y^2 <= 1).rotate_x(t)", "sphere(1 + t)", "sphere(1) and x <= t"] {
            assert!(motion(&solid(text)).twist(0.5).is_none(), "{text}");
        }
    }

    #[test]
    fn solids_that_change_their_shape_are_not() {
        for text in
            ["sphere(1 + t)", "x^2 + (1 + t)*y^2 + z^2 <= 1", "x <= t or x >= 1", "sphere(1) and x <= t"]
        {
            let motion = motion(&solid(text));
            assert!(motion.placement(0.0).is_some() && motion.placement(0.5).is_none(), "{text}");
        }
    }
}
