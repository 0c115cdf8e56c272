//! What a stopwatch is told: every stage that a frame goes through, in order, and no change of the frame by it.

use conformance::bundles::{ALL_CODERS, Coder, measured};
use conformance::frame::{Frame, to_core};
use conformance::scenes::{CASES, cameras};
use pocketsplat_core::{Budget, Bundle, Decoder, Plan, Residency, Stage, Stopwatch, Strips};

/// Remembers the stages.
#[derive(Default)]
struct Log(Vec<Stage>);

impl Stopwatch for Log {
    fn enter(&mut self, stage: Stage) {
        self.0.push(stage);
    }
}

impl Log {
    fn count(&self, stage: Stage) -> usize {
        self.0.iter().filter(|&&s| s == stage).count()
    }
}

#[test]
fn a_frame_goes_through_the_stages_it_needs() {
    let (_, host_camera) = &cameras()[0];
    let camera = to_core(host_camera);
    for coder in ALL_CODERS {
        let bytes = measured(&CASES[0], coder, std::slice::from_ref(host_camera));
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        for (residency, n_strips) in [(Residency::Streamed, 1), (Residency::Streamed, 2), (Residency::Resident, 1)] {
            let budget = Budget::for_frame(camera.width_px, camera.height_px)
                .with_residency(residency)
                .with_strips(Strips::Exactly(n_strips));
            let plan = Plan::new(&bundle, &budget).expect("planned");
            let mut scratch = vec![0; plan.scratch_len()];
            let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("bound");
            let [mut plain, mut watched] = [(); 2].map(|()| Frame::new(camera.width_px, camera.height_px));
            let report = decoder.render(&camera, &mut plain).expect("drawn");
            let mut log = Log::default();
            let watched_report = decoder.render_watched(&camera, &mut watched, &mut log).expect("drawn");
            let case = format!("{coder:?}, {residency:?}, {n_strips} strips");
            assert_eq!((report, &plain), (watched_report, &watched), "{case}: watching changes nothing");

            let n_tiles = usize::from(camera.width_px.div_ceil(16) * camera.height_px.div_ceil(16));
            assert_eq!(log.count(Stage::Output), n_tiles, "{case}: the sink, once a tile");
            let after_blend = log.0.windows(2).filter(|pair| pair == &[Stage::Blend, Stage::Output]);
            assert_eq!(after_blend.count(), n_tiles, "{case}: a tile is blended, then handed over");
            assert_eq!(log.count(Stage::Heads), report.anchors_visible as usize, "{case}: once a visible anchor");
            let decodes = report.anchors_decoded as usize;
            assert!(log.count(Stage::Decode) >= decodes.max(1), "{case}: each decoded anchor, or each record");
            let has_context = coder != Coder::Static && residency == Residency::Streamed;
            assert_eq!(log.0.contains(&Stage::Context), has_context, "{case}: models are computed where they are used");
            let first_sort = log.0.iter().position(|&stage| stage == Stage::Sort).expect("it sorts");
            assert!(!log.0[..first_sort].contains(&Stage::Blend), "{case}: order before blending");
        }
    }
}
