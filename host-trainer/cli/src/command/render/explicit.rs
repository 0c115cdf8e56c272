//! Pictures of explicit Gaussians.

use std::f64::consts::TAU;

use anyhow::{Result, bail};
use pocketsplat_capture::dataset::{Image, View};
use pocketsplat_trainer::explicit::render::Renderer as Drawer;
use pocketsplat_trainer::explicit::views::Stand;
use rayon::prelude::*;

use super::super::capture::{CaptureArgs, views_of};
use super::super::eval::Renderer;
use super::super::gaussians::GaussiansFile;
use super::super::stand::bulk_of;
use super::{Args, Shot, cameras};

/// Width and height of pictures from cameras of our own, px.
const SIDE_PX: u32 = 400;

/// Splats and the cameras that they are drawn with, all in one frame.
pub(super) struct Shown {
    pub(super) shots: Vec<Shot>,
    drawer: Drawer,
    /// RGB in 0..1.
    background: [f32; 3],
}

impl Shown {
    /// What the command line asks for.
    pub(super) fn read(args: &Args) -> Result<Self> {
        if args.renderer == Renderer::Reference {
            bail!("{} holds Gaussians and no bundle; leave out --renderer", args.bundle.display());
        }
        let file = GaussiansFile::read(&args.bundle, args.axes)?;
        if let Some(dataset) = &args.dataset {
            args.stand.refuse("the capture has cameras")?;
            return Self::of_capture(
                &file,
                &CaptureArgs { dataset: dataset.clone(), options: args.options.clone() },
                args,
            );
        }
        if let Some(path) = &args.camera {
            args.stand.refuse("--camera has some")?;
            let normalisation = Stand::normalisation(&bulk_of(&args.bundle, &file)?);
            let shots = cameras::of_file(path)?
                .into_iter()
                .map(|shot| Shot { camera: normalisation.camera(&file.camera(&shot.camera)), ..shot })
                .collect();
            return Ok(Self { shots, drawer: file.renderer_of_numbers(&normalisation), background: [0.0; 3] });
        }
        let size_px = args.options.resolution.map_or([SIDE_PX; 2], |frame| [frame.width_px, frame.height_px]);
        let stand = args.stand.stand(&args.bundle, &file)?;
        let n = args.orbit.unwrap_or(1);
        let name = |i: u16| if args.orbit.is_some() { format!("orbit {i}") } else { "preview".to_owned() };
        let normalisation = Stand::normalisation(&stand.bulk);
        let camera = |i: u16| normalisation.camera(&stand.turned(TAU * f64::from(i) / f64::from(n), size_px));
        Ok(Self {
            shots: (0..n).map(|i| Shot { name: name(i), camera: camera(i) }).collect(),
            drawer: file.renderer_of_numbers(&normalisation),
            background: [0.0; 3],
        })
    }

    fn of_capture(file: &GaussiansFile, source: &CaptureArgs, args: &Args) -> Result<Self> {
        let (_, capture) = file.load(source)?;
        let views = views_of(&capture, args.split)?;
        let shot = |view: &View| Shot { name: format!("view {}", view.name), camera: view.camera.clone() };
        let shots = match args.view {
            None => views.iter().map(shot).collect(),
            Some(index) => match views.get(index) {
                Some(view) => vec![shot(view)],
                None => bail!("--view {index} of {} views; choose 0 to {}", views.len(), views.len() - 1),
            },
        };
        Ok(Self { shots, drawer: file.renderer(&capture.normalisation), background: capture.background })
    }

    /// The cameras and what each shows.
    pub(super) fn draw(self) -> (Vec<Shot>, Vec<Image>) {
        let picture = |shot: &Shot| self.drawer.image(&shot.camera, self.background);
        let pictures = self.shots.par_iter().map(picture).collect();
        (self.shots, pictures)
    }
}
