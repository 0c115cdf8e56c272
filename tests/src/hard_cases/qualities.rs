//! Every picture again, of the qualities that are meant for use.

use pocketsplat_codec::bundle::{self, WriteOptions};
use pocketsplat_codec::render::reference::ReferenceScene;
use pocketsplat_core::{Bundle, Quality};
use pocketsplat_kernels::camera::host_camera;

use super::picture::{background, worst_tile};
use super::{Case, Family, Probe, error, pictures};
use crate::difference::{Difference, worse};
use crate::frame::{draw_at, info_for, to_core};

const ANSWER: &str = "\
A lower quality level does what it says: compared with an oracle that draws by the same rules, a channel is off by 3.5 steps at most
at `BALANCED` and by 12 at `DRAFT`.";

const ANALYSIS: &str = "\
All pictures of the families above that have one camera to compare with are drawn at a lower quality and compared with the f64 oracle
that draws by the same rules, in steps of 8 bits. What a level leaves out is its purpose and no error. Errors are

- a contribution at the cut that is drawn here and not there: 2 steps at `BALANCED` and 8 at `DRAFT`, where an exact frame has 1;
- half a step for rounding, and the last splat of an opaque stack as in exact frames.

Together less than 3.5 and 12. Where a whole tile lies at such a jump, as behind a stack of even layers, its mean may be as far off as the light
behind it: 2 and 4.";

/// The worst channel of all pictures, and the worst mean of a tile, against the oracle; steps of 8 bits.
fn worst(quality: Quality) -> [f64; 2] {
    let mut worst = [0.0_f64; 2];
    for case in pictures() {
        let Probe::Picture { picture, .. } = case.probe else { continue };
        let picture = picture();
        if !picture.nearby.is_empty() {
            continue;
        }
        let info = info_for(&picture.camera);
        let written = bundle::write(&picture.scene, &info, &WriteOptions::default()).expect("a scene to be written");
        let bundle = Bundle::parse(&written.bytes).expect("the writer's bundle is sound");
        let camera = to_core(&picture.camera);
        let (frame, _) = draw_at(quality, &bundle, &camera).expect("the worst case is planned for");
        assert!(frame.deliveries.iter().all(|&n| n == 1), "{}: every pixel once", case.name);
        let oracle = ReferenceScene::from_bundle(&bundle).expect("its chunks decode");
        let expected = oracle.render_with(quality, &host_camera(&camera), background());
        let difference = Difference::of(&frame.rgb, &expected, frame.width_px);
        let found = [difference.worst_steps, worst_tile(&frame.rgb, &expected, frame.width_px)];
        if std::env::var_os("POCKETSPLAT_CASE").is_some() {
            println!("{quality:?}, {}: {found:?}", case.name);
        }
        worst = [worse(worst[0], found[0]), worse(worst[1], found[1])];
    }
    worst
}

pub(super) fn family() -> Family {
    const WHAT: &str = "all pictures, against the oracle by the same rules";
    let cases: Vec<Case> = vec![
        error("balanced", WHAT, "worst channel, steps", 3.5, || worst(Quality::BALANCED)[0]),
        error("balanced, tiles", WHAT, "worst tile, steps", 2.0, || worst(Quality::BALANCED)[1]),
        error("draft", WHAT, "worst channel, steps", 12.0, || worst(Quality::DRAFT)[0]),
        error("draft, tiles", WHAT, "worst tile, steps", 4.0, || worst(Quality::DRAFT)[1]),
    ];
    Family { title: "Other qualities", answer: ANSWER, analysis: ANALYSIS, cases }
}
