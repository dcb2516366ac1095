//! Where a body is, from the vertices of two of its meshes.

use glam::{DMat3, DVec3};

use crate::geom::Placement;

/// The motion without deformation that brings points to others, each to within a distance, m; `None` if there is none.
///
/// Three points that lie far apart determine it, so it is as exact as they are.
pub fn pose(from: &[DVec3], to: &[DVec3], tolerance: f64) -> Option<Placement> {
    if from.len() != to.len() {
        return None;
    }
    let Some(&first) = from.first() else { return Some(Placement::IDENTITY) };
    let farthest = |measure: &dyn Fn(DVec3) -> f64| {
        let numbered = from.iter().map(|p| measure(*p)).enumerate();
        numbered.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(number, _)| number)
    };
    let second = farthest(&|p| p.distance_squared(first));
    let along = from[second] - first;
    let third = farthest(&|p| along.cross(p - first).length_squared());
    let placement = match (frame(from, [second, third]), frame(to, [second, third])) {
        (Some(then), Some(now)) => {
            let rotation = now * then.transpose();
            Placement { rotation, translation: to[0] - rotation * first }
        }
        // points on one line, or one point
        _ => Placement { translation: to[0] - first, ..Placement::IDENTITY },
    };
    let is_near = |(from, to): (&DVec3, &DVec3)| placement.apply(*from).distance(*to) <= tolerance;
    from.iter().zip(to).all(is_near).then_some(placement)
}

/// Three directions at right angles, the first from the first of all points towards one, the third across it and
/// another.
fn frame(points: &[DVec3], [second, third]: [usize; 2]) -> Option<DMat3> {
    let along = (points[second] - points[0]).try_normalize()?;
    let across = along.cross(points[third] - points[0]).try_normalize()?;
    Some(DMat3::from_cols(along, across.cross(along), across))
}

/// A placement as numbers: the columns of its rotation, then its translation, m.
pub fn columns(placement: &Placement) -> [f64; 12] {
    let mut numbers = [0.0; 12];
    numbers[..9].copy_from_slice(&placement.rotation.to_cols_array());
    numbers[9..].copy_from_slice(&placement.translation.to_array());
    numbers
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    #[test]
    fn motions_are_found_and_deformations_are_none() {
        let at = |k: usize| DVec3::new((k * k % 7) as f64, (3 * k % 5) as f64, (k % 3) as f64);
        let points: Vec<DVec3> = (0..40).map(at).collect();
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 2.5);
        let truth = Placement { rotation: DMat3::from_quat(turn), translation: DVec3::new(3.0, -1.0, 0.25) };
        let moved: Vec<DVec3> = points.iter().map(|p| truth.apply(*p)).collect();
        let found = pose(&points, &moved, 1e-12).unwrap();
        assert!(points.iter().all(|p| found.apply(*p).distance(truth.apply(*p)) < 1e-13));
        assert_eq!(columns(&found)[9..], found.translation.to_array());

        let mut bent = moved.clone();
        bent[17].x += 1e-6;
        assert!(pose(&points, &bent, 1e-7).is_none() && pose(&points, &bent, 1e-5).is_some());
        // a mirror image is no motion
        let mirrored: Vec<DVec3> = points.iter().map(|p| DVec3::new(-p.x, p.y, p.z)).collect();
        assert!(pose(&points, &mirrored, 1e-3).is_none());
        assert!(pose(&points, &moved[1..], 1.0).is_none());
    }

    #[test]
    fn few_points_are_moved_too() {
        assert_eq!(pose(&[], &[], 0.0), Some(Placement::IDENTITY));
        let moved = pose(&[DVec3::X], &[DVec3::Y], 1e-15).unwrap();
        assert_eq!(moved.apply(DVec3::X), DVec3::Y);
        assert!(pose(&[DVec3::X, DVec3::NAN], &[DVec3::Y, DVec3::NAN], 1.0).is_none());
    }
}
