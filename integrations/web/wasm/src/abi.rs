//! The functions that JavaScript calls.
//!
//! Bytes go in through memory of [`aogrid_alloc`], which the function that takes them frees. What comes
//! out is in [`aogrid_output`] until the next call. A function that can fail returns a negative number
//! or 0 as documented, and the output is then the message.

// The only unsafe code of the crate: addresses from JavaScript become slices.
#![allow(unsafe_code, reason = "a C interface takes addresses")]

use std::cell::RefCell;
use std::sync::Once;

use aogrid_bake_core::Preset;
use aogrid_grid_format::{Encoding, TexelFormat};
use glam::{DMat4, DVec3};

use crate::bake::{self, Settings};
use crate::model::Model;
use crate::truth::{Instance, Plane, Truth, View};

#[cfg(target_arch = "wasm32")]
#[link(wasm_import_module = "aogrid")]
unsafe extern "C" {
    /// Tells the page the finished share of a bake.
    fn progress(share: f32);
    /// Tells the page the message of a panic, which is a bug; the instance cannot be used after it.
    fn panicked(text: *const u8, length: usize);
}

#[derive(Default)]
struct State {
    models: Vec<Model>,
    truth: Option<Truth>,
    output: Vec<u8>,
    notes: Vec<u8>,
}

thread_local! {
    static STATE: RefCell<State> = RefCell::default();
}

/// Returns memory for `length` bytes.
#[unsafe(no_mangle)]
pub extern "C" fn aogrid_alloc(length: usize) -> *mut u8 {
    install_hook();
    let bytes = vec![0_u8; length].into_boxed_slice();
    Box::into_raw(bytes).cast()
}

/// The address of the output of the last call.
#[unsafe(no_mangle)]
pub extern "C" fn aogrid_output() -> *const u8 {
    STATE.with_borrow(|state| state.output.as_ptr())
}

/// The number of bytes of the output of the last call.
#[unsafe(no_mangle)]
pub extern "C" fn aogrid_output_length() -> usize {
    STATE.with_borrow(|state| state.output.len())
}

/// Loads a model from the bytes of a file and the name of that file. Returns its number, or −1 with the
/// message as the output.
///
/// # Safety
///
/// Both are memory of [`aogrid_alloc`] with these lengths, and not used afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn aogrid_load(
    bytes: *mut u8,
    length: usize,
    name: *mut u8,
    name_length: usize,
) -> i32 {
    let bytes = unsafe { taken(bytes, length) };
    let name = unsafe { taken(name, name_length) };
    STATE.with_borrow_mut(
        |state| match Model::load(&String::from_utf8_lossy(&name), bytes) {
            Ok(model) => {
                state.models.push(model);
                state.models.len() as i32 - 1
            }
            Err(message) => {
                state.output = message.into_bytes();
                -1
            }
        },
    )
}

/// Makes the corners of a model the output: three a triangle, each with a position relative to the
/// model's origin and a normal, six single floats.
#[unsafe(no_mangle)]
pub extern "C" fn aogrid_corners(model: usize) {
    STATE.with_borrow_mut(|state| {
        let floats = state.models[model].corner_floats();
        state.output = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    });
}

/// Bakes a model. `preset` is an index of [`Preset::ALL`]; `encoding` one of [`Encoding::ALL`], or −1
/// for the preset's; a resolution or ε of 0 is the preset's. Returns 0 with the grid file as the
/// output, or −1 with the message.
#[unsafe(no_mangle)]
pub extern "C" fn aogrid_bake(
    model: usize,
    preset: usize,
    resolution: u32,
    epsilon: f32,
    encoding: i32,
) -> i32 {
    let settings = Settings {
        preset: Preset::ALL[preset.min(Preset::ALL.len() - 1)],
        resolution: (resolution != 0).then_some([resolution; 3]),
        epsilon: (epsilon != 0.0).then_some(epsilon),
        encoding: usize::try_from(encoding)
            .ok()
            .map(|idx| Encoding::ALL[idx.min(2)]),
        format: TexelFormat::Unorm8,
    };
    STATE.with_borrow_mut(
        |state| match bake::bake(&state.models[model], &settings, &report) {
            Ok((bytes, notes)) => {
                state.output = bytes;
                state.notes = notes.join("\n").into_bytes();
                0
            }
            Err(message) => {
                state.output = message.into_bytes();
                -1
            }
        },
    )
}

/// Makes the notes of the last bake the output, a line each.
#[unsafe(no_mangle)]
pub extern "C" fn aogrid_notes() {
    STATE.with_borrow_mut(|state| state.output = std::mem::take(&mut state.notes));
}

/// Begins a ray-traced image of models that are loaded. `numbers` are: the width, the height, the eye
/// (3), world-from-clip in columns (16), the number of planes, for each its center and two half edges
/// (9), the number of instances, for each its model and world-from-object in columns (17).
///
/// # Safety
///
/// `numbers` is memory of [`aogrid_alloc`] for `count` double floats, and not used afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn aogrid_truth(numbers: *mut u8, count: usize) {
    let bytes = unsafe { taken(numbers, 8 * count) };
    let (numbers, _) = bytes.as_chunks::<8>();
    let mut numbers = numbers.iter().map(|number| f64::from_le_bytes(*number));
    let mut next = || numbers.next().unwrap_or_default();
    let view = View {
        size: [next() as usize, next() as usize],
        eye: vector(&mut next),
        world_from_clip: matrix(&mut next),
    };
    let planes: Vec<_> = (0..next() as usize)
        .map(|_| Plane {
            center: vector(&mut next),
            half_edges: [vector(&mut next), vector(&mut next)],
        })
        .collect();
    STATE.with_borrow_mut(|state| {
        let instances: Vec<_> = (0..next() as usize)
            .map(|_| Instance {
                model: next() as usize,
                world_from_object: matrix(&mut next),
            })
            .filter(|instance| instance.model < state.models.len())
            .collect();
        for instance in &instances {
            state.models[instance.model].prepare_rays();
        }
        state.truth = Some(Truth::new(&view, &planes, &instances, &state.models));
    });
}

/// Traces `passes` more rays a pixel, and makes 1 − AO of each pixel the output, as single floats.
#[unsafe(no_mangle)]
pub extern "C" fn aogrid_trace(passes: u32) {
    STATE.with_borrow_mut(|state| {
        let Some(truth) = &mut state.truth else {
            return;
        };
        for _ in 0..passes {
            truth.trace(&state.models);
        }
        let transmittance = truth.transmittance();
        state.output = transmittance.iter().flat_map(|t| t.to_le_bytes()).collect();
    });
}

fn vector(next: &mut impl FnMut() -> f64) -> DVec3 {
    DVec3::new(next(), next(), next())
}

fn matrix(next: &mut impl FnMut() -> f64) -> DMat4 {
    DMat4::from_cols_array(&std::array::from_fn(|_| next()))
}

/// Takes back memory of [`aogrid_alloc`].
///
/// # Safety
///
/// It is such memory, with this length, and taken once.
unsafe fn taken(bytes: *mut u8, length: usize) -> Vec<u8> {
    let slice = std::ptr::slice_from_raw_parts_mut(bytes, length);
    unsafe { Box::from_raw(slice) }.into_vec()
}

fn report(share: f32) {
    #[cfg(target_arch = "wasm32")]
    unsafe {
        progress(share);
    }
    #[cfg(not(target_arch = "wasm32"))]
    let _ = share;
}

/// Sends the message of panics to the page.
fn install_hook() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        #[cfg(target_arch = "wasm32")]
        std::panic::set_hook(Box::new(|info| {
            let text = info.to_string();
            unsafe { panicked(text.as_ptr(), text.len()) };
        }));
    });
}
