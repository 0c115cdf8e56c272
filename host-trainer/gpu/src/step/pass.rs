//! One step, by the list of `step/mod.rs`: forward, loss, backward, and what it found.

use std::time::Instant;

use super::super::coding::N_RATE_TOTALS;
use super::super::context::DeviceContext;
use super::super::{Bind, Commands, Gpu, GpuError};
use super::terms::{HIGH_FREQUENCIES, RATE, terms_of};
use super::{GpuImage, GpuStep, SPLATS, UNSOUND};
use pocketsplat_kernels::step::coding::{Coding, RateTerms};
use pocketsplat_kernels::step::{DeviceTerms, Loss, ResidentStep, StageSeconds, StepReport, TargetView};

/// Reads the seconds since the last reading, once the device has come so far; nothing where nobody asked for them.
struct Laps<'g> {
    gpu: &'g Gpu,
    last: Option<Instant>,
}

impl Laps<'_> {
    fn lap(&mut self) -> Result<f64, GpuError> {
        let Some(last) = &mut self.last else { return Ok(0.0) };
        self.gpu.wait()?;
        let now = Instant::now();
        Ok(now.duration_since(std::mem::replace(last, now)).as_secs_f64())
    }
}

impl GpuStep {
    /// From a view to gradients of everything that it shows; waits for numbers that sizes follow from, and for what it found.
    pub(super) fn step_with(
        &mut self,
        target: &TargetView<'_, f32>,
        loss: &Loss<'_, f32>,
        coding: &Coding<'_, f32>,
        limit: f32,
    ) -> Result<ResidentStep<f32>, GpuError> {
        self.write_heads(coding)?;
        let Self { gpu, images, anchors, scene, .. } = self;
        let (gpu, scene) = (gpu.clone(), scene.as_ref().expect("loaded before"));
        let mut laps = Laps { gpu: &gpu, last: self.times_stages.then(Instant::now) };
        let mut stages = StageSeconds::default();
        let camera = target.camera;
        self.size_px = camera.size_px;
        let n = anchors.look(&gpu, scene, camera, loss.pruned_share)?;
        let n_slots = n * scene.shape.n_offsets;
        images.splats.fit(&gpu, n_slots)?;
        images.footprints.fit(&gpu, n_slots)?;

        let (visible, values) = (anchors.visible(), &anchors.values);
        match coding {
            Coding::Raw => {}
            Coding::Noise { stream, steps } => {
                let mut commands = Commands::new(&gpu);
                self.coding.noise(&gpu, &mut commands, scene, visible, values, (*stream, *steps))?;
                commands.submit()?;
            }
            Coding::Context { stream, rate, .. } | Coding::Integers { stream, rate, .. } => {
                self.coding.forward(&gpu, scene, visible, values, *stream, rate)?;
            }
        }
        stages.context = laps.lap()?;
        let mut commands = Commands::new(&gpu);
        anchors.forward(&gpu, &mut commands, scene, camera, &images.splats, &images.footprints)?;
        commands.submit()?;
        stages.anchors = laps.lap()?;
        let n_pairs = images.build(camera.size_px)?;
        stages.tiles = laps.lap()?;
        let mut commands = Commands::new(&gpu);
        images.rasterise(&mut commands, target.background)?;
        commands.submit()?;
        stages.rasterise = laps.lap()?;

        let terms = terms_of(loss, &scene.shape).expect("asked before");
        let mut commands = Commands::new(&gpu);
        images.differ(&mut commands, target, &loss.weights)?;
        if terms.high_pass > 0.0 {
            images.differ_in_detail(&mut commands, target, terms.high_pass, HIGH_FREQUENCIES)?;
        }
        images.mask_gradient(&mut commands, target);
        commands.submit()?;
        stages.loss = laps.lap()?;
        let mut commands = Commands::new(&gpu);
        images.rasterise_backward(&mut commands)?;
        commands.submit()?;
        stages.rasterise_backward = laps.lap()?;
        let mut commands = Commands::new(&gpu);
        self.anchors_backward(&gpu, &mut commands, target, loss, &terms)?;
        commands.submit()?;
        stages.anchors_backward = laps.lap()?;
        let mut commands = Commands::new(&gpu);
        if let Some((_, rate)) = coding.rate() {
            self.coding_backward(&gpu, &mut commands, rate)?;
        }
        let scene = self.scene.as_ref().expect("loaded before");
        self.terms.add_normality(&gpu, &mut commands, &terms, scene, &self.anchors)?;
        self.count(&mut commands, limit);
        commands.submit()?;
        stages.context_backward = laps.lap()?;
        self.report(target, loss, &terms, coding, n_pairs, stages)
    }

    /// Rounds the heads where a step draws them as they will be written.
    fn write_heads(&mut self, coding: &Coding<'_, f32>) -> Result<(), GpuError> {
        let scene = self.scene.as_mut().expect("loaded before");
        scene.on_integers = matches!(coding, Coding::Integers { .. });
        let Coding::Integers { head_step, .. } = coding else { return Ok(()) };
        let mut commands = Commands::new(&self.gpu);
        for head in &scene.heads {
            self.written.run(&mut commands, &head.layout, *head_step, &head.parameters.values, &head.written);
        }
        commands.submit()
    }

    /// From the gradients of the splats to those of the values of the view's anchors and of the heads.
    fn anchors_backward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        target: &TargetView<'_, f32>,
        loss: &Loss<'_, f32>,
        terms: &DeviceTerms,
    ) -> Result<(), GpuError> {
        let Self { images, anchors, .. } = self;
        let (scene, totals) = (self.scene.as_ref().expect("loaded before"), &images.totals);
        commands.clear(&anchors.d_gaussians);
        self.terms.add_opacity_target(gpu, commands, terms, anchors, totals)?;
        anchors.splats_backward(commands, scene, target.camera, &images.footprints, &images.d_splats);
        self.terms.add_volumes(gpu, commands, loss, anchors, totals)?;
        anchors.backward(gpu, commands, scene)
    }

    /// The rate's gradients, and those of the context model.
    fn coding_backward(&mut self, gpu: &Gpu, commands: &mut Commands<'_>, terms: &RateTerms) -> Result<(), GpuError> {
        let Self { images, anchors, coding, .. } = self;
        let scene = self.scene.as_ref().expect("loaded before");
        let (values, gradients, totals) = (&anchors.values, &anchors.gradients, (&images.totals, RATE));
        coding.backward(gpu, commands, scene, anchors.row_of_anchor(), values, gradients, terms, totals)
    }

    /// Counts gradients that are not sound, and splats.
    fn count(&self, commands: &mut Commands<'_>, limit: f32) {
        let scene = self.scene.as_ref().expect("loaded before");
        commands.clear(&self.counters);
        let of_context = scene.context.iter().flat_map(DeviceContext::gradients);
        let arrays = self.anchors.gradients.iter().chain(scene.heads.iter().map(|head| &head.gradient));
        let arrays = arrays.chain(of_context);
        let d_splats = (&self.images.d_splats as &dyn Bind, 9 * self.images.d_splats.len());
        for (values, n_values) in arrays.map(|array| (array as &dyn Bind, array.len())).chain([d_splats]) {
            self.sound.count(commands, values, n_values, limit, &self.counters, UNSOUND);
        }
        self.statistics.count(commands, &self.images.footprints, &self.counters, SPLATS);
    }

    /// Reads what the step found; waits.
    fn report(
        &self,
        target: &TargetView<'_, f32>,
        loss: &Loss<'_, f32>,
        terms: &DeviceTerms,
        coding: &Coding<'_, f32>,
        n_pairs: usize,
        stages: StageSeconds,
    ) -> Result<ResidentStep<f32>, GpuError> {
        let (totals, counters) = (self.images.totals.ask(&self.gpu), self.counters.ask(&self.gpu));
        let n_positive = self.coding.ask_positive(&self.gpu);
        let (totals, counters) = (totals.take(&self.gpu)?, counters.take(&self.gpu)?);
        let compared = self.images.loss_of(&totals, target);
        let (others, n_gaussians) = self.terms.sum(&self.gpu, loss, terms, (&self.images, &self.anchors), &totals)?;
        let lambda = loss.weights.dssim as f32;
        let mut total = (1.0 - lambda) * compared.l1 + lambda * (1.0 - compared.similarity) + others;
        let mut rate = None;
        if coding.rate().is_some() {
            let scene = self.scene.as_ref().expect("loaded before");
            let found = self.coding.rate(scene, &totals[RATE..RATE + N_RATE_TOTALS], &n_positive.take(&self.gpu)?);
            total += found.term;
            rate = Some(found.report);
        }
        let report = StepReport {
            loss: total,
            squared_error: compared.squared_sum / (3 * target.n_counted()) as f64,
            n_gaussians,
            n_splats: counters[SPLATS] as usize,
            n_pairs,
            exposure: compared.exposure,
            rate,
            stages,
        };
        let d_background = GpuImage::d_background_of(&totals);
        Ok(ResidentStep { report, d_background, is_sound: counters[UNSOUND] == 0 })
    }
}
