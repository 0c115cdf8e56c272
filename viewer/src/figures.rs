//! What the page shows as numbers: each list with its names, so that JavaScript need not know an order.

use pocketsplat_core::{Bundle, Camera, FrameReport, HeadWeights, Plan, Stage};
use pocketsplat_format::bundle::Coder;
use pocketsplat_instructions::{Costs, InstructionSet, terms};

/// Numbers, each with a name; not finite where there is none.
pub type Figures = Vec<(&'static str, f64)>;

/// What a bundle is.
pub(crate) fn of_bundle(bundle: &Bundle<'_>) -> Figures {
    let header = bundle.header();
    let [width, height] = header.training_px;
    let [x, y, z] = header.normalisation_centre;
    let [red, green, blue] = header.background.map(f64::from);
    vec![
        ("nAnchors", bundle.n_anchors().into()),
        ("nTiers", bundle.n_tiers().into()),
        ("widthPx", width.into()),
        ("heightPx", height.into()),
        ("usesContext", flag(matches!(bundle.coder(), Coder::Context(_)))),
        ("backgroundRed", red),
        ("backgroundGreen", green),
        ("backgroundBlue", blue),
        ("centreX", x),
        ("centreY", y),
        ("centreZ", z),
        ("scale", header.normalisation_scale),
    ]
}

/// The scene of the first `tiers` tiers.
pub(crate) fn of_tiers(bundle: &Bundle<'_>, tiers: u8) -> Figures {
    let last = tiers.checked_sub(1);
    let n_anchors = last.and_then(|last| bundle.tier(last)).map_or(0, |tier| tier.n_anchors);
    let measures = last.and_then(|last| bundle.measures(last));
    let psnr_db = measures.and_then(|measures| measures.psnr_db).map_or(f64::NAN, f64::from);
    let all = f64::from(bundle.header().n_anchors.max(1));
    vec![("nAnchors", n_anchors.into()), ("pruningRate", 1.0 - f64::from(n_anchors) / all), ("psnrDb", psnr_db)]
}

/// What a plan does and takes.
pub(crate) fn of_plan(bundle: &Bundle<'_>, plan: &Plan) -> Figures {
    let tier = of_tiers(bundle, plan.n_tiers());
    let mut figures = vec![
        ("scratchBytes", plan.scratch_len() as f64),
        ("nTiers", plan.n_tiers().into()),
        ("nStrips", plan.n_strips().into()),
        ("nSlabs", plan.n_slabs().into()),
        ("maxSplats", plan.max_splats().into()),
        ("isResident", flag(plan.is_resident())),
        ("keepsSums", flag(plan.keeps_sums())),
        ("isBaked", flag(plan.is_baked())),
        ("halfWeights", flag(plan.head_weights() == HeadWeights::F16)),
    ];
    figures.extend(tier);
    figures
}

/// What a frame consisted of, and the instructions that each family of processors would take for it, by stage.
pub(crate) fn of_frame(
    costs: &Costs,
    bundle: &Bundle<'_>,
    plan: &Plan,
    camera: &Camera,
    report: &FrameReport,
) -> Figures {
    let mut figures = vec![
        ("splats", report.splats.into()),
        ("splatsDropped", report.splats_dropped.into()),
        ("maxSplats", report.max_splats.into()),
        ("anchorsVisible", report.anchors_visible.into()),
        ("anchorsDecoded", report.anchors_decoded.into()),
        ("gaussians", report.gaussians.into()),
        ("slabs", report.slabs.into()),
        ("scratchUsed", report.scratch_used.into()),
    ];
    let terms = terms(bundle, plan, report, [camera.width_px, camera.height_px]);
    for set in InstructionSet::ALL {
        figures.extend(stages_of(set).into_iter().zip(costs.predict(set, &terms)));
    }
    figures
}

/// A set as the page and `pocketsplat.js` call it.
#[cfg(not(target_arch = "wasm32"))]
pub(crate) fn name_of(set: InstructionSet) -> &'static str {
    stages_of(set)[0].split('.').next().unwrap_or_default()
}

/// The instructions of each stage on processors of a set, in the order of [`Stage::ALL`].
fn stages_of(set: InstructionSet) -> [&'static str; Stage::ALL.len()] {
    macro_rules! stages {
        ($set:literal) => {
            [
                concat!($set, ".decode"),
                concat!($set, ".context"),
                concat!($set, ".heads"),
                concat!($set, ".project"),
                concat!($set, ".sort"),
                concat!($set, ".blend"),
                concat!($set, ".output"),
            ]
        };
    }
    match set {
        InstructionSet::CortexM => stages!("cortexM"),
        InstructionSet::CortexM0Plus => stages!("cortexM0Plus"),
        InstructionSet::RiscV32 => stages!("riscv32"),
        InstructionSet::RiscV32Fpu => stages!("riscv32Fpu"),
    }
}

fn flag(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}
