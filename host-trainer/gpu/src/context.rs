//! A context model in the device's memory, with all that training moves of it.

use pocketsplat_format::context::{GridFrame, N_GROUPS, N_LEVELS};

use super::group::Group;
use super::ops::adam::Adam;
use super::ops::heads::head::HeadLayout;
use super::ops::rate::hash_grid::GridPlaces;
use super::ops::rate::integer_network::{Integers, table_of_steps};
use super::{Buffer, Commands, Gpu, GpuError};
use pocketsplat_kernels::ops::adam::{Moments, Step};
use pocketsplat_kernels::scene::{ContextModel, ContextNetwork, Scene};
use pocketsplat_kernels::step::{ContextMoments, ContextMomentsMut};

/// A network with its moments and its gradient.
#[derive(Debug)]
pub(super) struct DeviceNetwork {
    /// Its groups, then its taps.
    pub(super) parameters: Group,
    pub(super) layout: HeadLayout,
    pub(super) gradient: Buffer<f32>,
    pub(super) n_taps: usize,
    /// What a step on integers made of the parameters.
    pub(super) integers: Integers,
}

/// The grid with its moments and its gradient.
#[derive(Debug)]
pub(super) struct DeviceGrid {
    pub(super) places: GridPlaces,
    pub(super) rows: Group,
    pub(super) gradient: Buffer<f32>,
}

/// What decides which anchor each follows, beside which of them are drawn.
#[derive(Debug)]
pub(super) struct Follows {
    pub(super) shifts: [u8; N_LEVELS],
    pub(super) frame: GridFrame,
    pub(super) lattice: Vec<[i32; 3]>,
    pub(super) prune_rank: Vec<f32>,
}

/// The context model of a scene.
#[derive(Debug)]
pub(super) struct DeviceContext {
    /// None where anchors follow anchors.
    pub(super) grid: Option<DeviceGrid>,
    /// One with a grid, else one for each level of anchors.
    pub(super) networks: Vec<DeviceNetwork>,
    /// Where anchors follow anchors: what decides which.
    pub(super) follows: Option<Follows>,
    pub(super) base_steps: [f32; N_GROUPS],
    /// [`table_of_steps`] of them.
    pub(super) step_table: Buffer<f32>,
}

impl DeviceNetwork {
    /// The parameters that a step asks: the trained ones, or what their integers stand for.
    pub(super) fn asked(&self, on_integers: bool) -> &Buffer<f32> {
        if on_integers { &self.integers.rounded } else { &self.parameters.values }
    }

    fn upload(gpu: &Gpu, network: &ContextNetwork<f32>, moments: [&ContextNetwork<f32>; 2]) -> Result<Self, GpuError> {
        let parameters_of = |network: &ContextNetwork<f32>| network.groups().concat();
        let ([first, second], parameters) = (moments.map(parameters_of), parameters_of(network));
        Ok(Self {
            gradient: Buffer::zeros(gpu, "gradients of the context network", parameters.len())?,
            parameters: Group::upload(gpu, "weights of the context network", &parameters, &Moments { first, second })?,
            integers: Integers::zeros(gpu, &HeadLayout::of(&network.mlp), parameters.len())?,
            layout: HeadLayout::of(&network.mlp),
            n_taps: network.n_taps,
        })
    }

    /// * `networks`: the parameters, the first and the second moments.
    fn store(&self, gpu: &Gpu, networks: [&mut ContextNetwork<f32>; 3]) -> Result<(), GpuError> {
        let (mut weights, mut found) = (Vec::new(), Moments::default());
        self.parameters.store(gpu, &mut weights, &mut found)?;
        for (network, values) in networks.into_iter().zip([weights, found.first, found.second]) {
            let mut rest = values.as_slice();
            for group in network.groups_mut() {
                let (own, after) = rest.split_at(group.len());
                group.copy_from_slice(own);
                rest = after;
            }
        }
        Ok(())
    }
}

impl DeviceGrid {
    fn upload(
        gpu: &Gpu,
        scene: &Scene<f32>,
        model: &ContextModel<f32>,
        moments: &Moments<f32>,
    ) -> Result<Self, GpuError> {
        let units: Vec<[u16; 3]> = scene.anchors.lattice.iter().map(|cell| model.frame.unit(*cell)).collect();
        Ok(Self {
            places: GridPlaces::new(gpu, &model.levels, &units)?,
            rows: Group::upload(gpu, "rows of the grid", &model.rows, moments)?,
            gradient: Buffer::zeros(gpu, "gradients of the grid", model.rows.len())?,
        })
    }
}

impl DeviceContext {
    /// Copies the context model of a scene to the device.
    pub(super) fn upload(
        gpu: &Gpu,
        scene: &Scene<f32>,
        moments: &ContextMoments<'_, f32>,
    ) -> Result<Option<Self>, GpuError> {
        let Some(model) = &scene.context else { return Ok(None) };
        let grid = match model.shifts {
            None => Some(DeviceGrid::upload(gpu, scene, model, moments.rows)?),
            Some(_) => None,
        };
        let [first, second] = moments.networks;
        let networks = model.networks.iter().zip(first.iter().zip(second));
        let networks = networks.map(|(network, (first, second))| DeviceNetwork::upload(gpu, network, [first, second]));
        Ok(Some(Self {
            grid,
            networks: networks.collect::<Result<_, _>>()?,
            follows: model.shifts.map(|shifts| Follows {
                shifts,
                frame: model.frame,
                lattice: scene.anchors.lattice.clone(),
                prune_rank: scene.anchors.prune_rank.clone(),
            }),
            base_steps: model.base_steps,
            step_table: Buffer::upload(gpu, "steps of exponents", &table_of_steps(model.base_steps))?,
        }))
    }

    /// Copies it back.
    pub(super) fn store(
        &self,
        gpu: &Gpu,
        scene: &mut Scene<f32>,
        moments: ContextMomentsMut<'_, f32>,
    ) -> Result<(), GpuError> {
        let model = scene.context.as_mut().expect("it was uploaded");
        if let Some(grid) = &self.grid {
            grid.rows.store(gpu, &mut model.rows, moments.rows)?;
        }
        let [first, second] = moments.networks;
        let networks = model.networks.iter_mut().zip(first.iter_mut().zip(second));
        for (own, (network, (first, second))) in self.networks.iter().zip(networks) {
            own.store(gpu, [network, first, second])?;
        }
        Ok(())
    }

    /// Moves the networks and the grid.
    pub(super) fn move_by(&self, adam: &Adam, commands: &mut Commands<'_>, [of_network, of_rows]: [Step<f32>; 2]) {
        for network in &self.networks {
            network.parameters.move_by(adam, commands, of_network, &network.gradient);
        }
        if let Some(grid) = &self.grid {
            grid.rows.move_by(adam, commands, of_rows, &grid.gradient);
        }
    }

    /// Gradients of all parameters.
    pub(super) fn gradients(&self) -> impl Iterator<Item = &Buffer<f32>> {
        self.networks.iter().map(|network| &network.gradient).chain(self.grid.iter().map(|grid| &grid.gradient))
    }
}
