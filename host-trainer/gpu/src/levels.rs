//! Coding where anchors follow anchors (ContextGS): a network for each level, the coarsest first.

use pocketsplat_format::context::{FEATURE_ONE, N_GROUPS, N_LEVELS};

use super::anchors::rooms;
use super::context::{DeviceNetwork, Follows};
use super::network_pass::{NetworkPass, PassKernels};
use super::ops::rate::parents::{Parents, Places};
use super::ops::rate::perturb::Perturb;
use super::scene::{DeviceScene, FEATURES, LOG_SCALES};
use super::{Buffer, Commands, Gpu, GpuError};
use pocketsplat_kernels::ops::rate::noise::Stream;
use pocketsplat_kernels::scene::{Anchors, INITIAL_MASK_LOGIT};
use pocketsplat_kernels::step::parents;

/// Its kernels, which anchors follow which, and what the last view was coded with.
#[derive(Debug)]
pub(super) struct GpuLevels {
    parents: Parents,
    /// Which anchors were drawn at all when the places were found; none before that.
    known: Option<Vec<u32>>,
    places: parents::Parents<f32>,
    /// `[n_anchors]`, places `[n_anchors, 3]`, the anchor that each follows, and what it gives.
    levels: Buffer<u32>,
    positions: Buffer<f32>,
    followed: Buffer<u32>,
    given: Buffer<f32>,
    /// All drawn anchors of levels 1 and 2.
    followed_of: [Buffer<u32>; N_LEVELS - 1],
    /// Their values, and the noise on these.
    values: [Buffer<f32>; 2],
    residuals: [Buffer<f32>; 2],
    giving: NetworkPass,
    of_view: [LevelOfView; N_LEVELS],
}

/// The anchors of a level that a view shows.
#[derive(Debug)]
struct LevelOfView {
    pass: NetworkPass,
    /// `[n]`, and their rows among the view's anchors.
    anchors: Buffer<u32>,
    rows: Buffer<u32>,
    /// `[n_sampled]` rows of the sample among the view's anchors.
    sampled: Buffer<u32>,
}

impl LevelOfView {
    fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let room = |what| Buffer::zeros(gpu, what, 1);
        Ok(Self {
            pass: NetworkPass::new(gpu)?,
            anchors: room("anchors of a level")?,
            rows: room("rows of a level")?,
            sampled: room("sampled rows of a level")?,
        })
    }
}

impl GpuLevels {
    /// Compiles the kernels.
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let room = |what| Buffer::zeros(gpu, what, 1);
        let words = |what| Buffer::zeros(gpu, what, 1);
        Ok(Self {
            parents: Parents::new(gpu)?,
            known: None,
            places: parents::Parents::default(),
            levels: words("levels of anchors")?,
            positions: room("places of anchors in their level")?,
            followed: words("anchors that are followed")?,
            given: room("what anchors give")?,
            followed_of: [words("anchors of level 1")?, words("anchors of level 2")?],
            values: rooms(gpu, "values that are given")?,
            residuals: rooms(gpu, "noise of values that are given")?,
            giving: NetworkPass::new(gpu)?,
            of_view: [LevelOfView::new(gpu)?, LevelOfView::new(gpu)?, LevelOfView::new(gpu)?],
        })
    }

    /// Forgets the places of a scene.
    pub(super) fn forget(&mut self) {
        self.known = None;
    }

    /// Finds, on the CPU, which anchors follow which, where that has changed.
    ///
    /// * `drawn`: `[n_anchors]`, 1 where an anchor is drawn at all.
    pub(super) fn find(&mut self, gpu: &Gpu, scene: &DeviceScene, drawn: &[u32]) -> Result<(), GpuError> {
        if self.known.as_deref() == Some(drawn) {
            return Ok(());
        }
        let Follows { shifts, frame, lattice, prune_rank } =
            scene.context.as_ref().and_then(|context| context.follows.as_ref()).expect("asked before");
        // One mask an anchor is enough.
        #[expect(clippy::cast_possible_truncation, reason = "a small number")]
        let logit = |drawn: &u32| if *drawn > 0 { INITIAL_MASK_LOGIT as f32 } else { f32::MIN };
        let anchors = Anchors {
            lattice: lattice.clone(),
            mask_logits: drawn.iter().map(logit).collect(),
            prune_rank: prune_rank.clone(),
            ..Anchors::default()
        };
        self.places.update(&scene.shape, &anchors, *shifts, frame);
        let places: Vec<_> = self.places.places().collect();
        #[expect(clippy::cast_possible_truncation, reason = "three levels")]
        let levels: Vec<u32> = places.iter().map(|(place, _)| place.level as u32).collect();
        let share = |part: i16| f32::from(part) / f32::from(FEATURE_ONE);
        let positions: Vec<f32> = places.iter().flat_map(|(place, _)| place.position.map(share)).collect();
        let followed: Vec<u32> = places.iter().map(|(_, followed)| *followed).collect();
        self.levels.write(gpu, &levels)?;
        self.positions.write(gpu, &positions)?;
        self.followed.write(gpu, &followed)?;
        let [features, log_scales, ..] = scene.widths();
        self.given.write(gpu, &vec![0.0; places.len() * (features + log_scales)])?;
        for (level, anchors) in (1..).zip(&mut self.followed_of) {
            anchors.write(gpu, &self.places.of_level(level))?;
        }
        self.known = Some(drawn.to_vec());
        Ok(())
    }

    /// Codes all anchors that others follow, the coarsest level first, wherever they stand: what they give is then known.
    pub(super) fn give(
        &mut self,
        gpu: &Gpu,
        scene: &DeviceScene,
        kernels: &PassKernels,
        perturb: &Perturb,
        stream: Stream,
    ) -> Result<(), GpuError> {
        let Self { parents, levels, positions, followed, given, followed_of, values, residuals, giving, .. } = self;
        let context = scene.context.as_ref().expect("asked before");
        let places = Places { levels, positions, parents: followed, given };
        let groups = scene.coded_groups();
        for level in (1..N_LEVELS).rev() {
            let (network, anchors) = (&context.networks[level], &followed_of[level - 1]);
            giving.sample.rows.items.fit(gpu, 0)?;
            giving.fit(gpu, network, anchors.len())?;
            let mut commands = Commands::new(gpu);
            parents.inputs(&mut commands, places, anchors, network.layout.n_in, &giving.inputs);
            giving.steps(&mut commands, kernels, network, context.base_steps, false);
            let arrays = [FEATURES, LOG_SCALES].map(|array| &scene.anchors[array].values);
            for (i, array) in arrays.into_iter().enumerate() {
                let group = groups[i];
                values[i].fit(gpu, anchors.len() * group.width)?;
                residuals[i].fit(gpu, anchors.len() * group.width)?;
                kernels.gather.run(&mut commands, array, group.width, anchors, &values[i]);
                let (values, residuals) = (&values[i], &residuals[i]);
                perturb.with_noise(&mut commands, stream, group, anchors, &giving.steps, values, residuals);
            }
            let [features, log_scales] = &*values;
            parents.give(&mut commands, &scene.shape, context.base_steps, anchors, [features, log_scales], given);
            commands.submit()?;
        }
        Ok(())
    }

    /// Predicts the steps of the view's anchors, and the distributions of the sample. Returns how many are in it.
    ///
    /// * `anchors`: `[n]` of the view. * `steps`: `[n, 3]`, overwritten.
    pub(super) fn forward(
        &mut self,
        gpu: &Gpu,
        scene: &DeviceScene,
        kernels: &PassKernels,
        anchors: &Buffer<u32>,
        steps: &Buffer<f32>,
        (stream, share): (Stream, f64),
    ) -> Result<usize, GpuError> {
        let Self { parents, levels, positions, followed, given, of_view, .. } = self;
        let context = scene.context.as_ref().expect("asked before");
        let places = Places { levels, positions, parents: followed, given };
        let mut commands = Commands::new(gpu);
        commands.clear(steps);
        commands.submit()?;
        let mut n_sampled = 0;
        for (level, (own, network)) in of_view.iter_mut().zip(&context.networks).enumerate() {
            let n = parents.of_level(gpu, Commands::new(gpu), places, anchors, level)?;
            own.rows.fit(gpu, n)?;
            own.anchors.fit(gpu, n)?;
            let mut commands = Commands::new(gpu);
            // The list is made again for the next level.
            let identity = Buffer::upload(gpu, "numbers", &(0..n as u32).collect::<Vec<_>>())?;
            kernels.gather.run(&mut commands, &parents.rows.items, 1, &identity, &own.rows);
            kernels.gather.run(&mut commands, anchors, 1, &own.rows, &own.anchors);
            commands.submit()?;
            let n_of_level = own.pass.choose(gpu, stream, share, &scene.view_weights, &own.anchors)?;
            n_sampled += n_of_level;
            own.sampled.fit(gpu, n_of_level)?;
            own.pass.fit(gpu, network, n)?;
            let mut commands = Commands::new(gpu);
            kernels.gather.run(&mut commands, &own.rows, 1, &own.pass.sample.rows.items, &own.sampled);
            parents.inputs(&mut commands, places, &own.anchors, network.layout.n_in, &own.pass.inputs);
            own.pass.steps(&mut commands, kernels, network, context.base_steps, false);
            own.pass.distributions(&mut commands, kernels, network, false);
            kernels.gather.add_back(&mut commands, &own.pass.steps, N_GROUPS, &own.rows, steps);
            commands.submit()?;
        }
        Ok(n_sampled)
    }

    /// The levels of the last view, with the rows of their samples among the view's anchors.
    pub(super) fn passes(&self) -> impl Iterator<Item = (&NetworkPass, &Buffer<u32>)> {
        self.of_view.iter().map(|level| (&level.pass, &level.sampled))
    }

    /// From the gradients of steps and outputs to those of the networks; what parents give takes none on.
    ///
    /// * `d_steps`: `[n, 3]` of the view's anchors.
    pub(super) fn backward(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        kernels: &mut PassKernels,
        networks: &[DeviceNetwork],
        d_steps: &Buffer<f32>,
    ) -> Result<(), GpuError> {
        for (own, network) in self.of_view.iter().zip(networks) {
            kernels.gather.run(commands, d_steps, N_GROUPS, &own.rows, &own.pass.d_steps);
            own.pass.backward(gpu, commands, kernels, network, false)?;
        }
        Ok(())
    }
}
