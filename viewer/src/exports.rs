//! The functions that `web/pocketsplat.js` calls.
//!
//! Arguments are numbers. Bytes go in through [`input`], a camera through [`camera`]. A function that can fail returns 1 or 0.
//! Behind 1 stand the names of its figures, with commas between them, in [`text`], and as many f64 in [`numbers`]; behind 0 stands
//! the error's message in [`text`].
#![expect(unsafe_code, reason = "a function without a mangled name is how a module is called")]

use std::cell::RefCell;

use pocketsplat_core::{Budget, Camera, DecodeError, Overflow, Quality, Residency, Rotation};

use crate::{Figures, Scene};

/// Numbers of a camera: rotation, translation, focal lengths, principal point, width, height.
const CAMERA_LEN: usize = 18;

#[derive(Default)]
struct Module {
    input: Vec<u8>,
    camera: [f32; CAMERA_LEN],
    scene: Option<Scene>,
    text: String,
    numbers: Vec<f64>,
}

thread_local! {
    static MODULE: RefCell<Module> = RefCell::default();
}

/// Runs `work` on the scene, if there is one, and keeps its answer for the caller.
fn on_scene(work: impl FnOnce(&mut Scene, &mut [f32; CAMERA_LEN]) -> Result<Figures, DecodeError>) -> u32 {
    MODULE.with_borrow_mut(|module| {
        let Module { camera, scene, text, numbers, .. } = module;
        let Some(scene) = scene else {
            *text = "no bundle is open".to_owned();
            return 0;
        };
        keep(work(scene, camera), text, numbers)
    })
}

fn keep(answer: Result<Figures, DecodeError>, text: &mut String, numbers: &mut Vec<f64>) -> u32 {
    text.clear();
    numbers.clear();
    match answer {
        Ok(figures) => {
            for (name, number) in figures {
                if !text.is_empty() {
                    text.push(',');
                }
                text.push_str(name);
                numbers.push(number);
            }
            1
        }
        Err(error) => {
            *text = error.to_string();
            0
        }
    }
}

/// Room for `len` bytes of a bundle, which [`open`] reads.
#[unsafe(no_mangle)]
extern "C" fn input(len: usize) -> *mut u8 {
    MODULE.with_borrow_mut(|module| {
        module.input = vec![0; len];
        module.input.as_mut_ptr()
    })
}

/// Opens the bundle in the input; once in the life of an instance, for its bytes stay.
#[unsafe(no_mangle)]
extern "C" fn open() -> u32 {
    MODULE.with_borrow_mut(|module| {
        let bytes = std::mem::take(&mut module.input).leak();
        let answer = Scene::open(bytes).map(|scene| module.scene.insert(scene).figures());
        keep(answer, &mut module.text, &mut module.numbers)
    })
}

/// The scene of the first `tiers` tiers.
#[unsafe(no_mangle)]
extern "C" fn tier(tiers: u8) -> u32 {
    on_scene(|scene, _| Ok(scene.tier_figures(tiers)))
}

/// The camera's numbers, to read and to write.
#[unsafe(no_mangle)]
extern "C" fn camera() -> *mut f32 {
    MODULE.with_borrow_mut(|module| module.camera.as_mut_ptr())
}

/// Sets the camera to the bundle's.
#[unsafe(no_mangle)]
extern "C" fn preview() -> u32 {
    on_scene(|scene, camera| {
        *camera = numbers_of(&scene.preview());
        Ok(Vec::new())
    })
}

/// How far away what the preview shows is.
#[unsafe(no_mangle)]
extern "C" fn focus() -> u32 {
    on_scene(|scene, _| Ok(scene.focus()))
}

/// Sets the camera to the bundle's, carried around the scene by `angle`, radians.
#[unsafe(no_mangle)]
extern "C" fn orbit(angle: f32) -> u32 {
    on_scene(|scene, camera| {
        *camera = numbers_of(&scene.preview().orbited(angle));
        Ok(Vec::new())
    })
}

/// The least and the most memory that are of use.
#[unsafe(no_mangle)]
extern "C" fn limits(width: u16, height: u16, tiers: u8, slabs: u32, cut: u8, detail: u32) -> u32 {
    on_scene(|scene, _| scene.limits(&budget(f64::INFINITY, [width, height], tiers, slabs, (cut, detail))))
}

/// What a decoder would do.
#[unsafe(no_mangle)]
extern "C" fn plan(ram: f64, width: u16, height: u16, tiers: u8, slabs: u32, cut: u8, detail: u32) -> u32 {
    on_scene(|scene, _| scene.plan(&budget(ram, [width, height], tiers, slabs, (cut, detail))))
}

/// The same, and makes the decoder.
#[unsafe(no_mangle)]
extern "C" fn bind(ram: f64, width: u16, height: u16, tiers: u8, slabs: u32, cut: u8, detail: u32) -> u32 {
    on_scene(|scene, _| scene.bind(&budget(ram, [width, height], tiers, slabs, (cut, detail))))
}

/// Draws what the camera sees.
#[unsafe(no_mangle)]
extern "C" fn render() -> u32 {
    on_scene(|scene, camera| scene.render(&camera_of(camera)?))
}

/// The pixels of the last frame: `[height, width, 4]`.
#[unsafe(no_mangle)]
extern "C" fn pixels() -> *const u8 {
    MODULE.with_borrow(|module| module.scene.as_ref().map_or(std::ptr::null(), |scene| scene.rgba().as_ptr()))
}

/// Names or message, UTF-8.
#[unsafe(no_mangle)]
extern "C" fn text() -> *const u8 {
    MODULE.with_borrow(|module| module.text.as_ptr())
}

/// Length of [`text`], bytes.
#[unsafe(no_mangle)]
extern "C" fn text_len() -> usize {
    MODULE.with_borrow(|module| module.text.len())
}

/// Figures.
#[unsafe(no_mangle)]
extern "C" fn numbers() -> *const f64 {
    MODULE.with_borrow(|module| module.numbers.as_ptr())
}

/// The most that a frame may take, model instructions: a minute or two, after which a file asks for more than anyone waits for.
const MOST_WORK: u64 = 100_000_000_000;

fn budget(ram: f64, [width, height]: [u16; 2], tiers: u8, slabs: u32, quality: (u8, u32)) -> Budget {
    let (alpha_cut, detail) = quality;
    let overflow = if slabs == 0 { Overflow::LeaveOut } else { Overflow::Slabs };
    // Without a limit it is no device's memory but the browser's.
    let residency = if ram.is_finite() { Residency::Auto } else { Residency::AutoWithSums };
    Budget::for_frame(width, height)
        // Saturates.
        .in_bytes(ram as usize)
        .with_tiers(tiers)
        .with_residency(residency)
        .with_overflow(overflow)
        .with_quality(Quality { alpha_cut, detail: detail != 0 })
        .with_most_work(MOST_WORK)
}

fn camera_of(numbers: &[f32; CAMERA_LEN]) -> Result<Camera, DecodeError> {
    let [r0, r1, r2, r3, r4, r5, r6, r7, r8, x, y, z, fx, fy, cx, cy, width, height] = *numbers;
    Ok(Camera {
        rotation: Rotation::new([r0, r1, r2, r3, r4, r5, r6, r7, r8])?,
        translation: [x, y, z],
        focal_px: [fx, fy],
        principal_px: [cx, cy],
        width_px: width as u16,
        height_px: height as u16,
    })
}

fn numbers_of(camera: &Camera) -> [f32; CAMERA_LEN] {
    let [r0, r1, r2, r3, r4, r5, r6, r7, r8] = camera.rotation.to_array();
    let ([x, y, z], [fx, fy], [cx, cy]) = (camera.translation, camera.focal_px, camera.principal_px);
    let [width, height] = [camera.width_px, camera.height_px].map(f32::from);
    [r0, r1, r2, r3, r4, r5, r6, r7, r8, x, y, z, fx, fy, cx, cy, width, height]
}
