//! What of a bundle fits into how much memory: prints the plan for each of several budgets.
//!
//! ```sh
//! cargo run -p pocketsplat-core --example plan_budget -- [BUNDLE.psb [BYTES…]]
//! ```

use std::error::Error;

use pocketsplat_core::{Budget, Bundle, DecodeError, Plan};

/// The bundle of the format's description: three anchors, planned where no other bundle is given.
const EXAMPLE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/bundle/example.psb"));

/// Scratch memory of devices, bytes, where the command line names none.
const DEVICES_BYTES: [usize; 5] = [4 * 1024, 6_850, 8 * 1024, 64 * 1024, 192 * 1024];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let bytes = arguments.next().map_or(Ok(EXAMPLE.to_vec()), std::fs::read)?;
    let given = arguments.map(|bytes| bytes.parse()).collect::<Result<Vec<usize>, _>>()?;
    let budgets = if given.is_empty() { DEVICES_BYTES.to_vec() } else { given };

    let bundle = Bundle::parse(&bytes)?;
    let [width_px, height_px] = [bundle.header().preview.width_px, bundle.header().preview.height_px];
    println!("{width_px}×{height_px} pixels, {} anchors in {} tiers", bundle.header().n_anchors, bundle.n_tiers());
    for ram_bytes in budgets {
        match bundle.plan(&Budget::for_frame(width_px, height_px).in_bytes(ram_bytes)) {
            Ok(plan) => println!("{ram_bytes:>8} bytes: {}", described(&plan)),
            // The error names the bytes that would do.
            Err(error @ DecodeError::BudgetTooSmall { .. }) => println!("{ram_bytes:>8} bytes: {error}"),
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

/// What a plan draws, and how.
fn described(plan: &Plan) -> String {
    let anchors = match (plan.is_baked(), plan.is_resident()) {
        (true, _) => "Gaussians evaluated once",
        (false, true) => "anchors in memory",
        (false, false) => "anchors decoded in every frame",
    };
    format!(
        "{} of scratch, {:.0} % of the anchors left out, {anchors}, {} strips, {} splats at once",
        plan.scratch_len(),
        100.0 * plan.pruning_rate(),
        plan.n_strips(),
        plan.max_splats()
    )
}
