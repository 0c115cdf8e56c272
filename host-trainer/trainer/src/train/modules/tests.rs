//! The gradients of the modules, in a whole step.

use pocketsplat_kernels::finite_difference::assert_piecewise_gradient;
use pocketsplat_kernels::ops::rate::noise::Stream;
use pocketsplat_kernels::scene::ModelShape;
use pocketsplat_kernels::step::coding::Coding;
use pocketsplat_kernels::step::example::{flatten, gradients, scene, shapes, step_with};
use pocketsplat_kernels::step::{Loss, LossWeights, Phase, StepInfo};

use super::{Detail, Distribution, Modules, Pruning};

/// Every module with a gradient of its own, weighed so that a wrong one shows.
fn modules() -> Vec<Modules> {
    let distribution = Some(Distribution { divergence: 0.05, spread: 0.07 });
    let pruning = Some(Pruning { weight: 0.3, ..Pruning::default() });
    let detail = Some(Detail { hidden: 5, weight: 0.5 });
    vec![
        Modules { distribution, ..Modules::default() },
        Modules { pruning, ..Modules::default() },
        Modules { detail, ..Modules::default() },
        Modules { distribution, rdo: None, pruning, detail },
    ]
}

#[test]
fn a_step_with_modules_agrees_with_finite_differences() {
    let stream = Stream::of_run(5);
    let at = StepInfo { iteration: 80, iterations: 100, phase: Phase::Raw, scaled: true, stream };
    for (seed, modules) in (71..).zip(modules()) {
        let shape = ModelShape { view_colour: false, view_geometry: false, ..modules.shape(shapes()[0]) };
        let mut scene = scene(seed, shape);
        let terms = modules.terms();
        let loss = Loss { modules: Some((&terms, &at)), ..Loss::plain(LossWeights::default()) };
        let (report, workspace) = step_with(&scene, &Coding::Raw, &loss);
        assert!(
            report.loss != step_with(&scene, &Coding::Raw, &Loss::plain(LossWeights::default())).0.loss,
            "{modules:?} adds nothing"
        );
        let analytic = gradients(&scene, &workspace);
        let x: Vec<f64> = flatten(&mut scene).into_iter().map(|p| *p).collect();
        assert_piecewise_gradient("step", &x, &analytic, |x| {
            let mut moved = scene.clone();
            for (p, v) in flatten(&mut moved).into_iter().zip(x) {
                *p = *v;
            }
            step_with(&moved, &Coding::Raw, &loss).0.loss
        });
    }
}
