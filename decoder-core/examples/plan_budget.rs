//! What of a bundle fits into how much memory: prints the plan for each of several budgets.
//!
//! ```sh
//! cargo run -p pocketsplat-core --example plan_budget -- [BUNDLE.psb [BYTES|FAST+SLOW…]]
//! ```
//!
//! `FAST+SLOW` are the bytes of two kinds of memory, for instance `65536+8388608`.

use std::error::Error;

use pocketsplat_core::{Budget, Bundle, DecodeError, Plan, Region};

/// The bundle of the format's description: three anchors, planned where no other bundle is given.
const EXAMPLE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/example.psb"));

/// Scratch memory of devices, bytes, where the command line names none.
const DEVICES_BYTES: [usize; 5] = [4 * 1024, 6_850, 8 * 1024, 64 * 1024, 192 * 1024];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let bytes = arguments.next().map_or(Ok(EXAMPLE.to_vec()), std::fs::read)?;
    let given = arguments.map(|bytes| fast_and_slow(&bytes)).collect::<Result<Vec<_>, _>>()?;
    let budgets = if given.is_empty() { DEVICES_BYTES.map(|fast| [fast, 0]).to_vec() } else { given };

    let bundle = Bundle::parse(&bytes)?;
    let [width_px, height_px] = [bundle.header().preview.width_px, bundle.header().preview.height_px];
    println!("{width_px}×{height_px} pixels, {} anchors in {} tiers", bundle.header().n_anchors, bundle.n_tiers());
    for [fast, slow] in budgets {
        match Plan::new(&bundle, &Budget::for_frame(width_px, height_px).in_bytes(fast).with_slow_bytes(slow)) {
            Ok(plan) => println!("{fast:>8} + {slow} bytes: {}", described(&plan)),
            // The error names the bytes that would do.
            Err(error @ DecodeError::BudgetTooSmall { .. }) => println!("{fast:>8} + {slow} bytes: {error}"),
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

/// `65536` or `65536+8388608`.
fn fast_and_slow(bytes: &str) -> Result<[usize; 2], std::num::ParseIntError> {
    let (fast, slow) = bytes.split_once('+').unwrap_or((bytes, "0"));
    Ok([fast.parse()?, slow.parse()?])
}

/// What a plan draws, and how.
fn described(plan: &Plan) -> String {
    let anchors = match (plan.is_baked(), plan.is_resident()) {
        (true, _) => "Gaussians evaluated once",
        (false, true) => "anchors in memory",
        (false, false) => "anchors decoded in every frame",
    };
    let scratch = match plan.slow_scratch_len() {
        0 => format!("{} of scratch", plan.scratch_len()),
        slow => {
            let parts = plan.memory().filter(|memory| memory.region == Region::Slow && memory.n_bytes > 0);
            let parts = parts.map(|memory| format!("{:?} {}", memory.part, memory.n_bytes)).collect::<Vec<_>>();
            format!("{} of fast scratch and {slow} of slow ({})", plan.scratch_len(), parts.join(", "))
        }
    };
    format!(
        "{scratch}, {:.0} % of the anchors left out, {anchors}, {} strips, {} splats at once",
        100.0 * plan.pruning_rate(),
        plan.n_strips(),
        plan.max_splats()
    )
}
