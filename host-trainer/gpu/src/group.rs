//! An array of parameters on the device, with what Adam keeps of it.

use super::ops::adam::{Adam, Moments};
use super::{Buffer, Commands, Gpu, GpuError};
use pocketsplat_kernels::ops::adam;

/// Parameters and their moments.
#[derive(Debug)]
pub(super) struct Group {
    pub(super) values: Buffer<f32>,
    pub(super) moments: Moments,
}

impl Group {
    pub(super) fn upload(
        gpu: &Gpu,
        what: &'static str,
        values: &[f32],
        moments: &adam::Moments<f32>,
    ) -> Result<Self, GpuError> {
        Ok(Self { values: Buffer::upload(gpu, what, values)?, moments: Moments::upload(gpu, moments)? })
    }

    pub(super) fn store(
        &self,
        gpu: &Gpu,
        values: &mut Vec<f32>,
        moments: &mut adam::Moments<f32>,
    ) -> Result<(), GpuError> {
        *values = self.values.read(gpu)?;
        *moments = self.moments.read(gpu)?;
        Ok(())
    }

    pub(super) fn move_by(
        &self,
        adam: &Adam,
        commands: &mut Commands<'_>,
        step: adam::Step<f32>,
        gradient: &Buffer<f32>,
    ) {
        adam.update(commands, step, &self.values, &self.moments, gradient);
    }
}
