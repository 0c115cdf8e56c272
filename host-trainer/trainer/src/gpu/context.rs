//! A context model with a grid in the device's memory, with all that training moves of it.

use pocketsplat_core::context::N_GROUPS;

use super::group::Group;
use super::ops::adam::Adam;
use super::ops::hash_grid::GridPlaces;
use super::ops::head::HeadLayout;
use super::{Buffer, Commands, Gpu, GpuError};
use crate::ops::adam::{Moments, Step};
use crate::scene::{ContextNetwork, Scene};
use crate::step::{ContextMoments, ContextMomentsMut};

/// The context model of a scene, its moments and its gradients.
#[derive(Debug)]
pub(super) struct DeviceContext {
    pub(super) places: GridPlaces,
    pub(super) rows: Group,
    pub(super) d_rows: Buffer<f32>,
    /// The network's groups, then its taps.
    pub(super) network: Group,
    pub(super) layout: HeadLayout,
    pub(super) d_network: Buffer<f32>,
    pub(super) n_taps: usize,
    pub(super) base_steps: [f32; N_GROUPS],
}

fn parameters_of(network: &ContextNetwork<f32>) -> Vec<f32> {
    network.groups().concat()
}

impl DeviceContext {
    /// Copies the context model of a scene to the device.
    pub(super) fn upload(
        gpu: &Gpu,
        scene: &Scene<f32>,
        moments: &ContextMoments<'_, f32>,
    ) -> Result<Option<Self>, GpuError> {
        let Some(model) = scene.context.as_ref().filter(|model| model.shifts.is_none()) else { return Ok(None) };
        let units: Vec<[u16; 3]> = scene.anchors.lattice.iter().map(|cell| model.frame.unit(*cell)).collect();
        let network = &model.networks[0];
        let [first, second] = moments.networks.map(|networks| parameters_of(&networks[0]));
        let parameters = parameters_of(network);
        Ok(Some(Self {
            places: GridPlaces::new(gpu, &model.levels, &units)?,
            rows: Group::upload(gpu, "rows of the grid", &model.rows, moments.rows)?,
            d_rows: Buffer::zeros(gpu, "gradients of the grid", model.rows.len())?,
            d_network: Buffer::zeros(gpu, "gradients of the context network", parameters.len())?,
            network: Group::upload(gpu, "weights of the context network", &parameters, &Moments { first, second })?,
            layout: HeadLayout::of(&network.mlp),
            n_taps: network.n_taps,
            base_steps: model.base_steps,
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
        self.rows.store(gpu, &mut model.rows, moments.rows)?;
        let (mut weights, mut found) = (Vec::new(), Moments::default());
        self.network.store(gpu, &mut weights, &mut found)?;
        let [first, second] = moments.networks;
        let networks = [&mut model.networks[0], &mut first[0], &mut second[0]];
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

    /// Moves the network and the grid.
    pub(super) fn move_by(&self, adam: &Adam, commands: &mut Commands<'_>, [network, rows]: [Step<f32>; 2]) {
        self.network.move_by(adam, commands, network, &self.d_network);
        self.rows.move_by(adam, commands, rows, &self.d_rows);
    }

    /// Gradients of all parameters.
    pub(super) fn gradients(&self) -> [&Buffer<f32>; 2] {
        [&self.d_network, &self.d_rows]
    }
}
