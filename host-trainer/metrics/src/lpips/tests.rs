use std::path::{Path, PathBuf};

use super::test_network::noise;
use super::*;

fn image(seed: u32, width_px: u32, height_px: u32) -> Image {
    let mut draw = noise(seed);
    let rgb = (0..width_px * height_px * 3).map(|_| (draw() * 127.0 + 128.0) as u8).collect();
    Image { width_px, height_px, rgb }
}

#[test]
fn an_image_is_at_distance_0_from_itself_and_further_from_any_other() {
    let lpips = Lpips::narrow(InputRange::ZeroToOne);
    let (a, b) = (image(1, 35, 18), image(2, 35, 18));
    assert_eq!(lpips.distance(&a, &a, None).unwrap(), 0.0);
    let d = lpips.distance(&a, &b, None).unwrap();
    assert!(d > 1e-3, "{d}");
    assert_eq!(d, lpips.distance(&b, &a, None).unwrap(), "from either side");
}

#[test]
fn one_thread_and_three_give_the_same_bits() {
    let lpips = Lpips::narrow(InputRange::MinusOneToOne);
    let (a, b) = (image(1, 61, 40), image(2, 61, 40));
    let on = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| lpips.distance(&a, &b, None).unwrap())
    };
    assert_eq!(on(1).to_bits(), on(3).to_bits());
}

#[test]
fn differences_where_no_pixel_counts_change_nothing() {
    let lpips = Lpips::narrow(InputRange::ZeroToOne);
    let (truth, mut drawn) = (image(1, 20, 20), image(2, 20, 20));
    let mut mask = Mask { width_px: 20, height_px: 20, valid: (0..400).map(|i| i % 20 < 12).collect() };
    for (i, pixel) in drawn.rgb.chunks_exact_mut(3).enumerate().filter(|(i, _)| mask.valid[*i]) {
        pixel.copy_from_slice(&truth.rgb[3 * i..][..3]);
    }
    assert_eq!(lpips.distance(&drawn, &truth, Some(&mask)).unwrap(), 0.0);
    assert!(lpips.distance(&drawn, &truth, None).unwrap() > 0.0);
    mask.valid.fill(false);
    assert!(lpips.distance(&drawn, &truth, Some(&mask)).unwrap().is_nan(), "nothing to compare");
}

#[test]
fn images_too_small_to_be_pooled_four_times_are_refused() {
    let lpips = Lpips::narrow(InputRange::ZeroToOne);
    let error = lpips.distance(&image(1, 40, 15), &image(2, 40, 15), None).unwrap_err();
    assert!(error.to_string().contains("40×15"), "{error}");
    assert!(lpips.distance(&image(1, 16, 16), &image(2, 16, 16), None).is_ok());
}

/// The folder of weights and images, or `None` after saying what is skipped.
fn folder() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("POCKETSPLAT_DATA").map_or(beside, PathBuf::from).join("lpips");
    if folder.is_dir() {
        return Some(folder);
    }
    use std::io::Write as _;
    // Not `eprintln!`, which a test that passes keeps to itself.
    let _ = writeln!(
        std::io::stderr(),
        "SKIPPED: published values of LPIPS: no weights at {}; set POCKETSPLAT_DATA to a folder that has lpips/",
        folder.display()
    );
    None
}

fn read(path: &Path) -> Image {
    let rgb = ::image::open(path).unwrap().into_rgb8();
    Image { width_px: rgb.width(), height_px: rgb.height(), rgb: rgb.into_raw() }
}

#[test]
fn the_published_weights_give_the_published_values() {
    let Some(folder) = folder() else { return };
    let between = |range: InputRange, a: &str, b: &str| {
        let lpips = Lpips::read(&folder.join("lpips_v0.1_vgg_f16.safetensors"), range).unwrap();
        lpips.distance(&read(&folder.join(a)), &read(&folder.join(b)), None).unwrap()
    };
    use InputRange::{MinusOneToOne, ZeroToOne};
    for (range, a, b, published) in [
        (MinusOneToOne, "ex_ref.png", "ex_p0.png", 0.5686),
        (MinusOneToOne, "ex_ref.png", "ex_p1.png", 0.4217),
        (MinusOneToOne, "apple.png", "pear.png", 0.6571),
        (ZeroToOne, "ex_ref.png", "ex_p0.png", 0.5692),
        (ZeroToOne, "apple.png", "pear.png", 0.6111),
    ] {
        let found = between(range, a, b);
        println!("{a} to {b}, input in {range}: {found:.5}, published {published}");
        assert!((found - published).abs() < 2e-4, "{a} to {b}, input in {range}: {found}, not {published}");
    }
}
