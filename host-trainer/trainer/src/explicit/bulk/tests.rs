use super::*;
use crate::explicit::test_scenes::{all, at};
use pocketsplat_kernels::finite_difference::random;

fn cube(seed: u64, n: usize) -> Vec<DVec3> {
    random(seed, 3 * n).chunks_exact(3).map(|v| DVec3::new(v[0], v[1], v[2])).collect()
}

/// Directions all around.
fn directions(n: usize) -> Vec<DVec3> {
    cube(9, n).into_iter().map(DVec3::normalize).collect()
}

#[test]
fn far_floaters_and_a_huge_sky_move_nothing() {
    let place = DVec3::new(3.0, -1.0, 2.0);
    let floaters = (0..40).map(|i| DVec3::splat(100.0 + f64::from(i)));
    let mut gaussians = at(cube(5, 4000).into_iter().map(|p| place + p).chain(floaters));
    for i in 4000..4040 {
        gaussians.log_scales[i] = [6.0; 3];
    }
    let bulk = Bulk::of(&gaussians).unwrap();
    assert!(bulk.centre.distance(place) < 0.15, "{bulk:?}");
    assert!(bulk.radius > 1.3 && bulk.radius < 1.75, "{bulk:?}");
    assert_eq!((bulk.n_apart, bulk.n_strays), (40, 40), "{}", bulk.farthest);
}

#[test]
fn one_stray_decides_nothing() {
    let sound = cube(5, 1500);
    let alone = Bulk::of(&at(sound.iter().copied())).unwrap();
    for out in [1e3, 1e6, 1e12, 1e30] {
        let bulk = Bulk::of(&at(sound.iter().copied().chain([DVec3::X * out]))).unwrap();
        assert_eq!((bulk.n_apart, bulk.n_strays), (alone.n_apart + 1, 1), "{out}");
        assert!(bulk.centre.distance(alone.centre) < 1e-3 && (bulk.radius / alone.radius - 1.0).abs() < 1e-3, "{out}");
        assert!(bulk.is_stray(DVec3::X * out) && !bulk.is_stray(DVec3::ONE));
    }
}

/// The breakdown point is above a tenth of the weight, wherever it is put.
#[test]
fn a_tenth_of_outliers_moves_bulks_little() {
    let mut scenes: Vec<(String, Vec<DVec3>)> = [300, 1500, 6000].map(|n| (format!("cube of {n}"), cube(5, n))).into();
    for scene in all() {
        let places = scene.gaussians.centres.iter().map(|c| DVec3::from(c.map(f64::from))).collect();
        scenes.push((scene.name.to_owned(), places));
    }
    for (name, places) in scenes {
        let alone = Bulk::of(&at(places.iter().copied())).unwrap();
        let n = places.len() / 10;
        let radius = alone.radius;
        let outliers: [(&str, Vec<DVec3>); 6] = [
            (
                "all around, 2 to 10 radii",
                directions(n)
                    .into_iter()
                    .enumerate()
                    .map(|(i, d)| d * radius * (2.0 + 8.0 * i as f64 / n as f64))
                    .collect(),
            ),
            ("all around, 30 radii", directions(n).into_iter().map(|d| d * radius * 30.0).collect()),
            ("all around, 1e6 radii", directions(n).into_iter().map(|d| d * radius * 1e6).collect()),
            ("one clump, 4 radii", cube(7, n).into_iter().map(|p| (DVec3::X * 4.0 + 0.3 * p) * radius).collect()),
            ("one clump, 30 radii", cube(7, n).into_iter().map(|p| (DVec3::Y * 30.0 + p) * radius).collect()),
            ("one point, 1e6 radii", vec![DVec3::new(1e6, 1e6, 0.0) * radius; n]),
        ];
        for (where_, outliers) in outliers {
            let outliers = outliers.into_iter().map(|p| alone.centre + p);
            let bulk = Bulk::of(&at(places.iter().copied().chain(outliers))).unwrap();
            let (moved, wider) = (bulk.centre.distance(alone.centre) / radius, bulk.radius / radius);
            assert!(
                moved < 0.2 && (0.8..1.3).contains(&wider),
                "{name}, {where_}: moved by {moved:.2} radii, {wider:.2} times as wide"
            );
            assert!(bulk.n_apart >= n * 9 / 10, "{name}, {where_}: {} of {n} apart", bulk.n_apart);
        }
    }
}

#[test]
fn parts_of_one_scene_stay_together() {
    // A lamp: most of it is its shade; a thin pole stands on a foot.
    let shade = cube(3, 3000).into_iter().map(|p| p * 0.3 + DVec3::Z * 2.0);
    let pole = (0..200).map(|i| DVec3::Z * (2.0 * f64::from(i) / 200.0));
    let foot = cube(4, 300).into_iter().map(|p| p * DVec3::new(0.4, 0.4, 0.02));
    let lamp = Bulk::of(&at(shade.chain(pole).chain(foot))).unwrap();
    assert!(lamp.n_apart < 40 && (lamp.centre.z - 1.1).abs() < 0.2 && lamp.radius > 1.0, "{lamp:?}");
    // Two things on nothing, side by side.
    let two =
        Bulk::of(&at(cube(3, 1000).into_iter().chain(cube(4, 600).into_iter().map(|p| p + DVec3::X * 6.0)))).unwrap();
    assert!((two.centre.x - 3.0).abs() < 0.3 && two.radius > 3.5 && two.n_apart < 30, "{two:?}");
}

#[test]
fn free_places_are_those_with_nothing_near() {
    let room = all().into_iter().find(|scene| scene.name == "furnished room").unwrap();
    let bulk = Bulk::of(&room.gaussians).unwrap();
    assert!(bulk.is_free(DVec3::new(1.2, 0.3, 1.6)));
    for taken in [DVec3::new(0.0, 0.0, 0.72), DVec3::new(-1.9, 0.9, 1.0), DVec3::new(0.0, 0.0, 2.45)] {
        assert!(!bulk.is_free(taken), "{taken}");
    }
}

#[test]
fn nothing_has_no_bulk() {
    assert_eq!(Bulk::of(&Gaussians::default()), None);
    assert_eq!(Bulk::of(&at([DVec3::ONE; 5])), None);
}
