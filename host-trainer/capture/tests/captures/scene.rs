//! What a capture is taken for follows from its photographs, whatever layout they lie in.

use glam::DVec3;
use image::ExtendedColorType::{Rgb8, Rgba8};
use pocketsplat_capture::dataset::{
    Capture, LoadOptions, LoadReport, PUBLISHED_VOXEL_SIZE, ROOM_VOXEL_SIZE, SceneKind,
};

use crate::exports::{NSVF_MATRIX, write_nsvf, write_record3d};
use crate::fixture::{Fixture, Kind, SIZE_PX, photo};

/// What is photographed.
#[derive(Clone, Copy, Debug)]
enum Shown {
    /// Something everywhere.
    Place,
    /// An object on even paper of this colour, with the noise of a JPEG.
    OnPaper(u8),
    /// The same, its background transparent.
    CutOut,
    /// The same as [`Self::OnPaper`] in a file that has an alpha channel.
    Opaque,
}

fn write_photographs(fixture: &Fixture, shown: Shown) {
    let (width, height) = SIZE_PX;
    for photo in &fixture.photos {
        let pixel = |i: u32| -> Vec<u8> {
            let (x, y) = (i % width, i / width);
            let on_object = (6..18).contains(&x) && (4..12).contains(&y);
            let own = |c: u32| (i * 53 % 251 + 17 * c) as u8;
            let noise = (i % 3) as u8;
            let [r, g, b] = [0, 1, 2].map(|c| match shown {
                Shown::OnPaper(level) if !on_object => level + noise,
                Shown::Opaque if !on_object => 250 + noise,
                _ => own(c),
            });
            match shown {
                Shown::Place | Shown::OnPaper(_) => vec![r, g, b],
                Shown::CutOut => vec![r, g, b, if on_object { 255 } else { 0 }],
                Shown::Opaque => vec![r, g, b, 255],
            }
        };
        let bytes: Vec<u8> = (0..width * height).flat_map(pixel).collect();
        let kind = if matches!(shown, Shown::CutOut | Shown::Opaque) { Rgba8 } else { Rgb8 };
        image::save_buffer(fixture.at("images").join(&photo.name), &bytes, width, height, kind).expect("an image");
    }
}

/// The layouts without points of their own.
const LAYOUTS: [&str; 5] = ["Blender", "COLMAP", "nerfstudio", "NSVF", "Record3D"];

/// Cameras around `target`, in this layout.
fn loaded(layout: &str, target: DVec3, shown: Shown, scene: Option<SceneKind>) -> (Capture, LoadReport) {
    let kind = match layout {
        "Blender" => Kind::Blender,
        "COLMAP" => Kind::ColmapText,
        _ => Kind::Nerfstudio,
    };
    let mut fixture = Fixture::new(kind, 17);
    fixture.photos = (0..17).map(|i| photo(i, target)).collect();
    fixture.points.clear();
    write_photographs(&fixture, shown);
    match layout {
        "NSVF" => write_nsvf(&fixture, NSVF_MATRIX, |_| ""),
        "Record3D" => write_record3d(&fixture, "metadata", "rgbd", 0),
        _ => {
            fixture.write_files();
        }
    }
    let (capture, report) = fixture.load_with(&LoadOptions { scene, ..LoadOptions::default() }).expect("a capture");
    assert_eq!(report.layout.to_string(), layout);
    (capture, report)
}

/// The share of the points that is within `reach` of a place, along each axis.
fn share_within(capture: &Capture, place_world: DVec3, reach_world: f64) -> f64 {
    let place = capture.normalisation.point(place_world);
    let is_within = |point: &&DVec3| (**point - place).abs().max_element() <= reach_world * capture.normalisation.scale;
    capture.points.iter().filter(is_within).count() as f64 / capture.points.len() as f64
}

#[test]
fn photographs_of_a_place_are_a_room_in_every_layout() {
    let reference = loaded("nerfstudio", DVec3::ZERO, Shown::Place, None).0;
    for layout in LAYOUTS {
        let (capture, report) = loaded(layout, DVec3::ZERO, Shown::Place, None);
        assert_eq!((capture.scene, capture.background), (SceneKind::Room, [0.0; 3]), "{report}");
        assert_eq!(capture.suggested_voxel_size(), ROOM_VOXEL_SIZE);
        let apart = capture.points.iter().zip(&reference.points).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(apart < 1e-9, "{layout} starts where nerfstudio does, but for {apart}");
        assert!(share_within(&capture, DVec3::ZERO, 1.5) < 0.7, "points behind, too");
        let says =
            "taken for a room, for the photographs show something up to their borders; --scene object says otherwise";
        assert!(report.to_string().contains(says), "{report}");
    }
}

#[test]
fn an_object_on_nothing_is_one_in_every_layout_with_an_alpha_channel_or_without() {
    for layout in LAYOUTS {
        for (shown, background) in
            [(Shown::OnPaper(250), 251_u8), (Shown::OnPaper(0), 1), (Shown::Opaque, 251), (Shown::CutOut, 0)]
        {
            let (capture, report) = loaded(layout, DVec3::ZERO, shown, None);
            assert_eq!(capture.scene, SceneKind::Object, "{shown:?}: {report}");
            assert_eq!(capture.background, [f32::from(background) / 255.0; 3], "{shown:?}: {report}");
            assert_eq!(capture.suggested_voxel_size(), PUBLISHED_VOXEL_SIZE);
            assert_eq!(share_within(&capture, DVec3::ZERO, 1.3 + 1e-9), 1.0, "the published cube");
            let (_, report) = loaded(layout, DVec3::ZERO, shown, Some(SceneKind::Room));
            assert_eq!((report.scene, report.backdrop, report.because), (SceneKind::Room, None, None), "{layout}");
        }
    }
}

#[test]
fn an_object_elsewhere_starts_where_it_is() {
    let place = DVec3::new(40.0, 3.0, -7.0);
    let (capture, report) = loaded("Blender", place, Shown::CutOut, None);
    assert_eq!(share_within(&capture, place, 1.6), 1.0, "{report}");
    assert!(
        report.to_string().contains("taken for an object on nothing, for 75 % of the pixels are transparent"),
        "{report}"
    );
}
