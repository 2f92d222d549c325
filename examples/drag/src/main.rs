//! Drag an object over a floor and watch its shadow follow.
//!
//! ```sh
//! cargo run --release -p aogrid-drag
//! ```
//!
//! Left button: drag the robot, for example to the table. Keys: 1 no occlusion, 2 scalar occlusion,
//! 3 cones, multiplied, 4 cones, merged, 5 and 6 the same in tiles. E switches between uniform
//! ambient light and a sky between a red wall and a blue-green one, from which cones remove light
//! by direction and scalar occlusion only darkens. The title shows the time per frame.
//! `--screenshot OUT.png` draws a few frames, writes the last one and exits; digits and `e` after
//! it are keys to press beforehand.

mod pipelines;
mod renderer;
mod scene;
mod shadows;
mod sky;
mod targets;

use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

use aogrid_runtime::Combine;
use renderer::Renderer;
use shadows::Shading;
use winit::application::ApplicationHandler;
use winit::dpi::LogicalSize;
use winit::event::{ElementState, MouseButton, WindowEvent};
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::{Window, WindowId};

/// Frames drawn before a screenshot: a new window needs a few to settle.
const WARM_UP_FRAMES: u32 = 5;

/// The weight of the latest frame in the displayed moving average of frame times.
const SMOOTHING: f32 = 0.1;

/// The effect of a key.
#[derive(Clone, Copy)]
enum Action {
    Shade(Shading),
    ToggleSky,
}

/// The keys: their code in window events, their name on the command line, and their effect.
const KEYS: [(KeyCode, &str, Action); 9] = [
    (KeyCode::Digit1, "1", Action::Shade(Shading::None)),
    (KeyCode::Digit2, "2", Action::Shade(Shading::Occlusion)),
    (
        KeyCode::Digit3,
        "3",
        Action::Shade(Shading::Cone(Combine::Multiply)),
    ),
    (
        KeyCode::Digit4,
        "4",
        Action::Shade(Shading::Cone(Combine::Merge)),
    ),
    (
        KeyCode::Digit5,
        "5",
        Action::Shade(Shading::Tiled(Combine::Multiply)),
    ),
    (
        KeyCode::Digit6,
        "6",
        Action::Shade(Shading::Tiled(Combine::Merge)),
    ),
    (
        KeyCode::Digit7,
        "7",
        Action::Shade(Shading::Cone(Combine::Mean)),
    ),
    (
        KeyCode::Digit8,
        "8",
        Action::Shade(Shading::Tiled(Combine::Mean)),
    ),
    (KeyCode::KeyE, "e", Action::ToggleSky),
];

impl Action {
    fn run(self, renderer: &mut Renderer) {
        match self {
            Self::Shade(shading) => renderer.shading = shading,
            Self::ToggleSky => renderer.has_sky = !renderer.has_sky,
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let usage = "usage: drag [--screenshot OUT.png [1..8|e]...]";
    let screenshot = match (args.next().as_deref(), args.next()) {
        (None, _) => None,
        (Some("--screenshot"), Some(path)) => Some(path),
        _ => return Err(usage.into()),
    };
    let key = |key: String| KEYS.iter().find(|(_, name, _)| *name == key);
    let action = args.map(|arg| key(arg).map(|(.., action)| *action).ok_or(usage));
    let mut app = App {
        screenshot,
        initial_actions: action.collect::<Result<_, _>>()?,
        ..App::default()
    };
    EventLoop::new()?.run_app(&mut app)?;
    app.failure.map_or(Ok(()), Err)
}

#[derive(Default)]
struct App {
    shown: Option<(Arc<Window>, Renderer)>,
    screenshot: Option<String>,
    /// The actions of keys to press before the first frame.
    initial_actions: Vec<Action>,
    failure: Option<Box<dyn Error>>,
    cursor: [f32; 2],
    is_dragging: bool,
    frames: u32,
    milliseconds: f32,
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.shown.is_some() {
            return;
        }
        match open(event_loop) {
            Ok((window, mut renderer)) => {
                self.initial_actions
                    .iter()
                    .for_each(|action| action.run(&mut renderer));
                self.shown = Some((window, renderer));
            }
            Err(error) => self.fail(event_loop, error),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some((window, renderer)) = &mut self.shown else {
            return;
        };
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => renderer.resize([size.width, size.height]),
            WindowEvent::CursorMoved { position, .. } => {
                self.cursor = [position.x as f32, position.y as f32];
                if self.is_dragging {
                    renderer.move_object_to(self.cursor);
                }
            }
            WindowEvent::MouseInput {
                state,
                button: MouseButton::Left,
                ..
            } => {
                self.is_dragging = state == ElementState::Pressed;
            }
            WindowEvent::KeyboardInput { event, .. } => match event.physical_key {
                PhysicalKey::Code(KeyCode::Escape) => event_loop.exit(),
                PhysicalKey::Code(code) if event.state.is_pressed() && !event.repeat => {
                    let key = KEYS.iter().find(|(key, ..)| *key == code);
                    if let Some((.., action)) = key {
                        action.run(renderer);
                    }
                }
                _ => {}
            },
            WindowEvent::RedrawRequested => {
                let start = Instant::now();
                let drawn = renderer.draw();
                let window = window.clone();
                if let Err(error) = drawn {
                    return self.fail(event_loop, error);
                }
                self.update_title(&window, start);
                if let Err(error) = self.end_with_screenshot(event_loop) {
                    return self.fail(event_loop, error);
                }
                window.request_redraw();
            }
            _ => {}
        }
    }
}

impl App {
    fn update_title(&mut self, window: &Window, start: Instant) {
        let milliseconds = start.elapsed().as_secs_f32() * 1e3;
        self.frames += 1;
        self.milliseconds += SMOOTHING * (milliseconds - self.milliseconds);
        let shown = self.milliseconds;
        window.set_title(&format!("aogrid: {shown:.1} ms a frame; drag, 1 to 6, E"));
    }

    fn end_with_screenshot(&mut self, event_loop: &ActiveEventLoop) -> Result<(), Box<dyn Error>> {
        let (Some(path), Some((_, renderer))) = (&self.screenshot, &mut self.shown) else {
            return Ok(());
        };
        if self.frames >= WARM_UP_FRAMES {
            let (pixels, [width, height]) = renderer.screenshot()?;
            image::save_buffer(path, &pixels, width, height, image::ColorType::Rgba8)?;
            event_loop.exit();
        }
        Ok(())
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, error: Box<dyn Error>) {
        self.failure = Some(error);
        event_loop.exit();
    }
}

fn open(event_loop: &ActiveEventLoop) -> Result<(Arc<Window>, Renderer), Box<dyn Error>> {
    let attributes = Window::default_attributes()
        .with_title("aogrid")
        .with_inner_size(LogicalSize::new(768.0, 576.0));
    let window = Arc::new(event_loop.create_window(attributes)?);
    let size = window.inner_size();
    let renderer = Renderer::new(window.clone(), [size.width, size.height])?;
    window.request_redraw();
    Ok((window, renderer))
}
