use proptest::prelude::*;
use serde_json::json;

use super::{CHUNK_BYTES, account, read, write};
use crate::{Degree, Frame, Gaussians, Notes};

/// A file of JSON and bytes.
fn glb(json: &serde_json::Value, binary: &[u8]) -> Vec<u8> {
    let json = json.to_string().into_bytes();
    let mut file = [b"glTF".as_slice(), &2u32.to_le_bytes(), &0u32.to_le_bytes()].concat();
    for (kind, content) in [(b"JSON", json.as_slice()), (b"BIN\0", binary)] {
        file.extend((content.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(content);
    }
    file
}

/// Two Gaussians of degree 1; rotations are bytes.
fn example() -> (serde_json::Value, Vec<u8>) {
    let floats: [&[f32]; 7] = [
        &[1.0, 2.0, 3.0, -1.0, 0.0, 4.0],
        &[1.0, 0.5, 0.25, 1.0, 1.0, 1.0],
        &[0.5, 1.0],
        &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
        &[1.0; 6],
        &[2.0; 6],
        &[3.0; 6],
    ];
    let mut binary: Vec<u8> = [127u8, 0, 0, 0, 0, 0, 129, 127].to_vec();
    let mut views = vec![json!({"buffer": 0, "byteOffset": 0, "byteLength": 8})];
    let mut accessors =
        vec![json!({"bufferView": 0, "componentType": 5120, "normalized": true, "count": 2, "type": "VEC4"})];
    for values in floats {
        views.push(json!({"buffer": 0, "byteOffset": binary.len(), "byteLength": 4 * values.len()}));
        accessors.push(json!({"bufferView": views.len() - 1, "componentType": 5126, "count": 2}));
        values.iter().for_each(|value| binary.extend(value.to_le_bytes()));
    }
    let of = |name: &str| format!("KHR_gaussian_splatting:{name}");
    let mut attributes = json!({"POSITION": 1});
    for (at, name) in [
        "ROTATION",
        "",
        "SCALE",
        "OPACITY",
        "SH_DEGREE_0_COEF_0",
        "SH_DEGREE_1_COEF_0",
        "SH_DEGREE_1_COEF_1",
        "SH_DEGREE_1_COEF_2",
    ]
    .iter()
    .enumerate()
    .filter(|(_, name)| !name.is_empty())
    {
        attributes[of(name)] = at.into();
    }
    let json = json!({
        "meshes": [{"primitives": [{"attributes": attributes, "extensions": {"KHR_gaussian_splatting": {}}}]}],
        "nodes": [{"mesh": 0}], "bufferViews": views, "accessors": accessors,
    });
    (json, binary)
}

#[test]
fn accessors_are_read() {
    let (json, binary) = example();
    let (gaussians, notes) = read(&glb(&json, &binary)).expect("whole");
    assert_eq!((gaussians.degree, &gaussians.centres), (Degree::One, &vec![[-1.0, -2.0, 3.0], [1.0, 0.0, 4.0]]));
    assert_eq!(gaussians.log_scales[0], [0.0, 0.5f32.ln(), 0.25f32.ln()]);
    // x and z of the rotation turn with the axes: −y·z and −x·y of them are 1.
    assert_eq!(gaussians.rotations, [[0.0, -1.0, -0.0, 0.0], [1.0, -0.0, -0.0, -1.0]]);
    assert_eq!(gaussians.opacity_logits, [0.0, 20.0]);
    assert_eq!(gaussians.harmonics[..4], [[0.1, 0.2, 0.3], [-1.0; 3], [2.0; 3], [-3.0; 3]]);
    assert!(notes.warnings.len() == 1 && notes.warnings[0].starts_with("1 of 2 opacities"), "{notes:?}");
}

#[test]
fn what_is_missing_is_named() {
    let (json, binary) = example();
    let said = |json: &serde_json::Value, binary: &[u8]| read(&glb(json, binary)).expect_err("broken").to_string();
    let mut mesh = json.clone();
    mesh["meshes"][0]["primitives"][0]["extensions"] = json!({});
    assert!(said(&mesh, &binary).contains("a mesh, not Gaussians"));
    let mut packed = json.clone();
    packed["meshes"][0]["primitives"][0]["attributes"] = json!({"POSITION": 1});
    assert!(
        said(&packed, &binary).contains("no attribute `KHR_gaussian_splatting:ROTATION`, as where they are compressed")
    );
    assert!(said(&json, &binary[..binary.len() - 1]).contains("ends outside of the file"));
    let mut many = json.clone();
    many["accessors"][1]["count"] = u64::MAX.into();
    assert!(said(&many, &binary).contains("ends outside of the file"));
    assert!(read(b"glTF\x02\0\0\0").expect_err("cut").to_string().starts_with("is cut off"));
    let mut linear = json.clone();
    linear["meshes"][0]["primitives"][0]["extensions"]["KHR_gaussian_splatting"] =
        json!({"colorSpace": "lin_rec709_display", "kernel": "ellipse"});
    let warnings = read(&glb(&linear, &binary)).expect("whole").1.warnings;
    assert!(warnings.iter().any(|said| said.contains("`colorSpace` is `lin_rec709_display`")), "{warnings:?}");
    assert!(!warnings.iter().any(|said| said.contains("kernel")), "{warnings:?}");
    let mut moved = json;
    moved["nodes"][0]["translation"] = json!([1, 2, 3]);
    assert!(read(&glb(&moved, &binary)).expect("whole").1.warnings[1].contains("move, turn or scale"));
}

/// Largest difference of two lists of rows.
fn apart<const N: usize>(a: &[[f32; N]], b: &[[f32; N]]) -> f32 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn what_is_written_is_read() {
    let frame = Frame { offset: [100.0, 0.0, -3.0], scale: 10.0 };
    for degree in Degree::ALL {
        let mut given = crate::tests::of_degree(degree, 7);
        given.rotations[2] = [0.0; 4];
        for notes in [Notes::default(), Notes { frame, compensation: true, ..Notes::default() }] {
            let (found, read_notes) = read(&write(&given, &notes).expect("fits")).expect("ours");
            assert_eq!(
                (found.degree, read_notes.frame, read_notes.compensation),
                (degree, notes.frame, notes.compensation)
            );
            assert_eq!((&found.centres, &found.harmonics), (&given.centres, &given.harmonics));
            assert!(apart(&found.log_scales, &given.log_scales) < 1e-5);
            let unit = |[w, x, y, z]: [f32; 4]| {
                let length = (w * w + x * x + y * y + z * z).sqrt();
                if length > 0.0 { [w, x, y, z].map(|part| part / length) } else { [1.0, 0.0, 0.0, 0.0] }
            };
            let rotations: Vec<[f32; 4]> = given.rotations.iter().copied().map(unit).collect();
            assert!(apart(&found.rotations, &rotations) < 1e-6);
            for (a, b) in found.opacity_logits.iter().zip(&given.opacity_logits) {
                assert!((a - b).abs() < 1e-4, "{a}, written {b}");
            }
        }
    }
}

#[test]
fn the_file_is_as_gltf_asks_for() {
    let bytes = write(&crate::tests::of_degree(Degree::One, 5), &Notes::default()).expect("fits");
    assert_eq!(
        (&bytes[..4], u32::from_le_bytes(*bytes[8..].first_chunk().unwrap())),
        (b"glTF".as_slice(), bytes.len() as u32)
    );
    let json_bytes = u32::from_le_bytes(*bytes[12..].first_chunk().unwrap()) as usize;
    assert_eq!((json_bytes % 4, &bytes[20 + json_bytes + 4..][..4]), (0, b"BIN\0".as_slice()));
    let json: serde_json::Value = serde_json::from_slice(&bytes[20..20 + json_bytes]).unwrap();
    let primitive = &json["meshes"][0]["primitives"][0];
    assert_eq!((&primitive["mode"], &json["extensionsUsed"]), (&json!(0), &json!(["KHR_gaussian_splatting"])));
    assert_eq!(
        primitive["extensions"]["KHR_gaussian_splatting"],
        json!({"kernel": "ellipse", "colorSpace": "srgb_rec709_display", "projection": "perspective", "sortingMethod": "cameraDistance"})
    );
    assert_eq!(
        primitive["attributes"].as_object().unwrap().len(),
        9,
        "places, fallback colours, and seven attributes of Gaussians"
    );
    let positions = &json["accessors"][primitive["attributes"]["POSITION"].as_u64().unwrap() as usize];
    assert!(
        positions["min"].as_array().unwrap().len() == 3 && positions["max"][0].as_f64() > positions["min"][0].as_f64()
    );
    let views = json["bufferViews"].as_array().unwrap();
    let end = |view: &serde_json::Value| view["byteOffset"].as_u64().unwrap() + view["byteLength"].as_u64().unwrap();
    assert_eq!(
        views.iter().map(end).max(),
        json["buffers"][0]["byteLength"].as_u64(),
        "nothing lies beyond the buffer"
    );
    assert!(views.iter().all(|view| view["byteOffset"].as_u64().unwrap() % 4 == 0));
    assert!(write(&Gaussians::default(), &Notes::default()).is_err(), "an accessor has an element");
}

proptest! {
    #[test]
    fn no_change_of_a_file_panics(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cut in any::<prop::sample::Index>(),
    ) {
        let (json, binary) = example();
        let mut bytes = glb(&json, &binary);
        for (place, value) in changes {
            let place = place.index(bytes.len() - CHUNK_BYTES) + CHUNK_BYTES;
            bytes[place] = value;
        }
        let _ = (read(&bytes), account(&bytes));
        let _ = read(&bytes[..cut.index(bytes.len())]);
    }
}
