//! Frames of committed bundles have the committed checksums, in whatever way they are drawn.

use std::f32::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use pocketsplat_codec::verify::{Trial, plan_variants};
use pocketsplat_core::{
    Budget, Bundle, ByteOrder, Camera, Decoder, MaxSplats, Overflow, PixelFormat, Plan, Rounding, Tile,
};
use pocketsplat_format::bundle::crc32;

const BUNDLES: [(&str, &[u8]); 4] = [
    ("static", include_bytes!("../golden/static.psb")),
    ("context", include_bytes!("../golden/context.psb")),
    ("matte", include_bytes!("../golden/matte.psb")),
    ("isotropic", include_bytes!("../golden/isotropic.psb")),
];
const FRAMES: &str = include_str!("../golden/frames.csv");
const N_VIEWS: u8 = 4;

fn checksum(bundle: &Bundle<'_>, plan: Plan, camera: &Camera) -> u32 {
    let drawn = Trial::run(bundle, plan, camera, 0, 0).unwrap_or_else(|breach| panic!("{breach}: {plan:?}"));
    assert_eq!(drawn.report.splats_dropped, 0, "{plan:?}");
    crc32(&drawn.rgb)
}

/// A frame drawn row of tiles by row of tiles into one of two buffers by turns.
fn in_rows(bundle: &Bundle<'_>, plan: Plan, camera: &Camera, format: PixelFormat) -> Vec<u8> {
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind(bundle, plan, &mut scratch).expect("planned memory");
    let mut drawing = decoder.begin(camera).expect("a sound camera");
    let mut buffers = [0xa5, 0x5a].map(|byte| vec![byte; 16 * usize::from(camera.width_px) * format.bytes_per_pixel()]);
    let mut frame = Vec::new();
    while let Some(row) = drawing.next_tile_row(format, &mut buffers[0]).expect("drawn") {
        frame.extend_from_slice(row.bytes);
        buffers.swap(0, 1);
    }
    frame
}

/// Every residency and number of strips, with memory for all splats and with memory for few, in slabs of depth.
fn plans(bundle: &Bundle<'_>, budget: Budget) -> Vec<Plan> {
    // In slabs without notes of where splats lie, and with them.
    let with_few = [150, 320].into_iter().flat_map(|most| {
        plan_variants(bundle, budget.with_max_splats(MaxSplats::AtMost(most)).with_overflow(Overflow::Slabs))
    });
    plan_variants(bundle, budget).chain(with_few).map(|way| Plan::new(bundle, &way).expect("planned")).collect()
}

#[test]
fn frames_have_the_committed_checksums() {
    let mut found = "bundle,tiers,view,crc32\n".to_owned();
    for (name, bytes) in BUNDLES {
        let bundle = Bundle::parse(bytes).expect("a committed bundle is sound");
        let preview = bundle.header().preview;
        let budget = Budget::for_frame(preview.width_px, preview.height_px).with_max_splats(MaxSplats::Worst);
        for tiers in 1..=bundle.n_tiers() {
            let plans = plans(&bundle, budget.with_tiers(tiers));
            for view in 0..N_VIEWS {
                let camera = preview.orbited(TAU * f32::from(view) / f32::from(N_VIEWS));
                let checksums: Vec<u32> = plans.iter().map(|plan| checksum(&bundle, *plan, &camera)).collect();
                let first = checksums[0];
                for (plan, checksum) in plans.iter().zip(&checksums) {
                    assert_eq!(*checksum, first, "{name}, {tiers} tiers, view {view}: {plan:?}");
                }
                writeln!(found, "{name},{tiers},{view},{first:08x}").expect("a string takes all");
            }
        }
    }
    if std::env::var_os("POCKETSPLAT_BLESS").is_some() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/frames.csv");
        std::fs::write(&path, &found).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        return;
    }
    assert!(
        found == FRAMES,
        "frames are not those of tests/golden/frames.csv, which has\n{FRAMES}but they are\n{found}"
    );
}

#[test]
fn rows_of_tiles_are_the_frames_in_every_format() {
    let packed = [ByteOrder::BigEndian, ByteOrder::LittleEndian]
        .into_iter()
        .flat_map(|order| [Rounding::Nearest, Rounding::Dithered].map(|rounding| PixelFormat::Rgb565(order, rounding)));
    let formats: Vec<PixelFormat> = [PixelFormat::Rgb888].into_iter().chain(packed).collect();
    for (name, bytes) in BUNDLES {
        let bundle = Bundle::parse(bytes).expect("a committed bundle is sound");
        let preview = bundle.header().preview;
        let (width, height) = (preview.width_px, preview.height_px);
        let plans = plans(&bundle, Budget::for_frame(width, height).with_max_splats(MaxSplats::Worst));
        for view in 0..N_VIEWS {
            let camera = preview.orbited(TAU * f32::from(view) / f32::from(N_VIEWS));
            // Every plan draws one view, the first one all of them in every format.
            let of_view = plans.iter().skip(view.into()).step_by(N_VIEWS.into());
            for plan in of_view.chain(&plans[..1]) {
                let drawn = crc32(&in_rows(&bundle, *plan, &camera, PixelFormat::Rgb888));
                let line = format!("{name},{},{view},{drawn:08x}", bundle.n_tiers());
                assert!(
                    FRAMES.lines().any(|golden| golden == line),
                    "not in tests/golden/frames.csv: {line}, {plan:?}"
                );
            }
            let rgb = Trial::run(&bundle, plans[0], &camera, 0, 0).expect("drawn").rgb;
            for format in &formats {
                let mut rgb = rgb.as_chunks::<3>().0.to_vec();
                let frame = Tile::new([0, 0], [width, height], &mut rgb).expect("a frame is a large tile");
                let expected = frame.into_bytes(*format);
                let found = in_rows(&bundle, plans[0], &camera, *format);
                assert!(found == expected, "{name}, view {view}, {format:?}");
            }
        }
    }
}
