use std::ops::ControlFlow;
use std::pin::pin;
use std::task::{self, Poll, Waker};

use aogrid_bake_core::models::Model;
use aogrid_bake_core::{BakeOptions, Progress, UNOBSERVED};
use aogrid_baker_gpu::wgpu::{Limits, PollType};
use aogrid_baker_gpu::{AdapterSelector, BakeError, Baker, Context, ContextError};
use aogrid_tests::gpu;

use super::{bake, placed};

/// Returns a device for one test alone.
fn own_device(limits: Limits) -> Option<Context> {
    gpu()?;
    let instance = aogrid_baker_gpu::wgpu::Instance::new(
        aogrid_baker_gpu::wgpu::InstanceDescriptor::new_without_display_handle(),
    );
    let backends = aogrid_baker_gpu::wgpu::Backends::PRIMARY;
    let adapters = pollster::block_on(instance.enumerate_adapters(backends));
    let name = &gpu()?.adapter().name;
    let adapter = adapters.iter().find(|a| a.get_info().name == *name)?;
    Some(Context::with_limits(adapter, limits).expect("it gives another device"))
}

#[test]
fn a_lost_device_is_an_error_and_no_panic() {
    let mesh = Model::Table.mesh(None).unwrap();
    let spec = placed(&mesh, 24);
    let mut options = BakeOptions::paper();
    for max_distance in [None, Some(3.0)] {
        options.max_distance = max_distance;
        let Some(context) = own_device(Limits::defaults()) else {
            return;
        };
        let mut baker = Baker::new(&context, None);
        let mut ready = context
            .block_on(baker.prepare(&mesh, spec, &options))
            .unwrap();
        let destroy = |_: Progress| {
            context.device().destroy();
            ControlFlow::Continue(())
        };
        let lost = context.block_on(ready.bake(&destroy));
        assert!(matches!(lost, Err(BakeError::Lost(_))), "{lost:?}");
        drop(ready);
        let again = context.block_on(baker.prepare(&mesh, spec, &options)).err();
        assert!(matches!(again, Some(BakeError::Lost(_))), "{again:?}");
        // The loss of a caller's device is detected, too.
        let theirs = own_device(Limits::defaults()).unwrap();
        let ours = Context::from_device(theirs.device(), theirs.queue());
        let mut baker = Baker::new(&ours, None);
        let mut ready = ours.block_on(baker.prepare(&mesh, spec, &options)).unwrap();
        theirs.device().destroy();
        let lost = ours.block_on(ready.bake(UNOBSERVED));
        assert!(matches!(lost, Err(BakeError::Lost(_))), "{lost:?}");
    }
}

#[test]
fn small_limits_give_the_same_grid_or_an_error_that_says_so() {
    let mut small_limits = Limits::defaults();
    // WebGPU guarantees 128 times this.
    small_limits.max_storage_buffer_binding_size = 1 << 20;
    small_limits.max_buffer_size = 1 << 26;
    let Some(context) = own_device(small_limits) else {
        return;
    };
    let Some(usual) = gpu() else { return };
    let options = BakeOptions::paper();
    let mesh = Model::Robot.mesh(None).unwrap();
    let spec = placed(&mesh, 16);
    let expected = bake(usual, &mesh, spec, &options);
    assert_eq!(bake(&context, &mesh, spec, &options), expected);
    let large = Model::Sphere.mesh(Some(100_000)).unwrap();
    let spec = placed(&large, 8);
    let mut baker = Baker::new(&context, None);
    let error = context
        .block_on(baker.prepare(&large, spec, &options))
        .err();
    assert!(
        matches!(error, Some(BakeError::TooLarge { .. })),
        "{error:?}"
    );
}

/// As in a browser: the caller's event loop runs the device, and there is no clock to speak of.
#[test]
fn a_bake_needs_neither_a_blocking_wait_nor_a_clock() {
    let Some(context) = gpu() else { return };
    let mesh = Model::Table.mesh(None).unwrap();
    let spec = placed(&mesh, 12);
    for max_distance in [None, Some(1.0)] {
        let options = BakeOptions {
            max_distance,
            ..BakeOptions::paper()
        };
        let stopped = Context::from_device(context.device(), context.queue())
            .with_clock(|| std::time::Duration::ZERO);
        let mut baker = Baker::new(&stopped, None);
        let mut bake = pin!(async {
            let mut ready = baker.prepare(&mesh, spec, &options).await?;
            ready.bake(UNOBSERVED).await
        });
        let mut waits = 0;
        let raw = loop {
            let mut task = task::Context::from_waker(Waker::noop());
            match bake.as_mut().poll(&mut task) {
                Poll::Ready(result) => break result.unwrap(),
                Poll::Pending => waits += 1,
            }
            context.device().poll(PollType::Poll).unwrap();
        };
        assert!(waits > 0, "the future never waits for the device");
        assert!(raw == super::bake(context, &mesh, spec, &options));
    }
}

#[test]
fn a_missing_adapter_is_named() {
    let error = Context::new(&AdapterSelector::Named("Voodoo 2".into())).err();
    assert!(matches!(error, Some(ContextError::NotFound { .. })));
    let message = error.unwrap().to_string();
    assert!(
        message.starts_with("no adapter is named like `Voodoo 2`"),
        "{message}"
    );
}
