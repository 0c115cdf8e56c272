use super::*;
use crate::explicit::test_scenes::{all, at, stand_around};

fn stand(side: Side, above_ground: bool, up: Up) -> Stand {
    let places = (0..4000).map(|i| {
        let t = f64::from(i);
        DVec3::new(1.0, 2.0, 3.0) + DVec3::new(t.sin(), (1.7 * t).cos(), (0.3 * t).sin()) * DVec3::new(1.0, 0.5, 1.5)
    });
    Stand { side, above_ground, up, ..stand_around(&at(places)) }
}

#[test]
fn cameras_around_see_the_whole_bulk() {
    let stand = stand(Side::Around, false, Up::PLUS_Z);
    let (cameras, bulk) = (stand.cameras(64, [80, 60]), &stand.bulk);
    assert_eq!(cameras[..8], stand.cameras(8, [80, 60])[..]);
    for camera in &cameras {
        let [x, y, z] = (camera.rotation * bulk.centre + camera.translation).to_array();
        let (u, v) = (camera.focal_px[0] * x / z + 40.0, camera.focal_px[1] * y / z + 30.0);
        assert!((u - 40.0).abs() < 1e-6 && (v - 30.0).abs() < 1e-6, "({u}, {v})");
        assert!(z > 1.5 * bulk.radius, "outside of it");
        assert!((camera.rotation.determinant() - 1.0).abs() < 1e-9);
    }
    let mean = cameras.iter().map(Camera::centre_world).sum::<DVec3>() / 64.0;
    assert!(mean.distance(bulk.centre) < 0.25 * bulk.radius, "from all sides: {mean}");
}

#[test]
fn every_camera_is_held_upright_and_the_first_is_level_and_has_all_in_its_picture() {
    for name in Up::NAMES {
        let up: Up = name.parse().unwrap();
        for (side, above_ground) in [(Side::Around, false), (Side::Around, true), (Side::Inside, false)] {
            let stand = stand(side, above_ground, up);
            let cameras = stand.cameras(64, [60, 60]);
            for camera in &cameras {
                let [right, down, _] = [0, 1, 2].map(|row| camera.rotation.row(row));
                assert!(right.dot(up.vector()).abs() < 1e-9 && down.dot(up.vector()) <= 1e-9, "{name}: no roll");
                let height = (camera.centre_world() - stand.bulk.centre).dot(up.vector());
                assert!(!above_ground || height > 0.0, "{name}: below the ground");
            }
            let first = &cameras[0];
            assert_eq!(Up::of_cameras([first].into_iter()), Some(up));
            assert!(first.rotation.row(2).dot(up.vector()).abs() < 0.2, "{name}: level");
            if side == Side::Around {
                let half = 30.0 * stand.bulk.radius / (first.centre_world().distance(stand.bulk.centre));
                assert!(first.focal_px[0] / 30.0 * half < 30.0, "{name}: all of it within the picture");
            }
            // A device turns it around the axis that is nearest to its up, through the middle of the bulk.
            for step in 0..8 {
                let turned = stand.turned(f64::from(step) * TAU / 8.0, [60, 60]);
                let middle = turned.rotation * stand.bulk.centre + turned.translation;
                assert!(middle.truncate().length() < 1e-9 && middle.z > 0.0);
                let height = |camera: &Camera| (camera.centre_world() - stand.bulk.centre).dot(up.vector());
                assert!((height(&turned) - height(first)).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn cameras_inside_stand_between_walls_and_outside_of_furniture() {
    let room = all().into_iter().find(|scene| scene.name == "furnished room").unwrap();
    let stand = Stand { side: Side::Inside, ..stand_around(&room.gaussians) };
    let cameras = stand.cameras(65, [80, 60]);
    let nearest = |camera: &Camera| {
        let place = camera.centre_world();
        room.gaussians
            .centres
            .iter()
            .map(|c| DVec3::from(c.map(f64::from)).distance(place))
            .fold(f64::INFINITY, f64::min)
    };
    for camera in &cameras[1..] {
        let away = (camera.centre_world() - stand.bulk.centre).abs();
        assert!(away.cmplt(0.5 * stand.bulk.half_range).all(), "{away}");
        assert!(nearest(camera) > 0.1, "free: {}", camera.centre_world());
    }
    let forward = cameras.iter().map(|c| c.rotation.row(2)).sum::<DVec3>() / 65.0;
    assert!(forward.length() < 0.2, "all around: {forward}");
}

#[test]
fn cameras_are_normalised_as_those_of_captures() {
    let cameras = stand(Side::Around, false, Up::MINUS_Y).cameras(32, [8, 8]);
    let normalisation = normalisation_of(&cameras, None).unwrap();
    let farthest = cameras.iter().map(|c| normalisation.point(c.centre_world()).length()).fold(0.0, f64::max);
    assert!((1.1 * farthest - EXTENT).abs() < 1e-9);
    assert_eq!(normalisation_of(&cameras[..1], None), None);
    assert_eq!(normalisation_of(&[], None), None);
    assert_eq!(normalisation_of(&cameras, Some(DVec3::ONE)).unwrap().centre, DVec3::ONE);
}

#[test]
fn a_tenth_of_cameras_far_away_does_not_move_the_frame() {
    let mut cameras = stand(Side::Around, false, Up::MINUS_Y).cameras(30, [8, 8]);
    let alone = normalisation_of(&cameras, None).unwrap();
    for i in 0..3 {
        let far = cameras[i].clone();
        cameras.push(Camera { translation: far.translation * 1000.0 + 10.0, ..far });
    }
    assert_eq!(normalisation_of(&cameras, None), Some(alone));
}
