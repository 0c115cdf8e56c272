//! Frames of committed bundles have the committed checksums, in whatever way they are drawn.

use std::f32::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use pocketsplat_core::bundle::crc32;
use pocketsplat_core::{Budget, Bundle, Camera, MaxSplats, Overflow, Plan};
use pocketsplat_trainer::verify::{Trial, plan_variants};

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

/// Every residency and number of strips, with memory for all splats and with memory for few, in slabs of depth.
fn plans(bundle: &Bundle<'_>, budget: Budget) -> Vec<Plan> {
    let with_few = plan_variants(bundle, budget.with_max_splats(MaxSplats::AtMost(150)).with_overflow(Overflow::Slabs));
    plan_variants(bundle, budget).chain(with_few).map(|way| bundle.plan(&way).expect("planned")).collect()
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
