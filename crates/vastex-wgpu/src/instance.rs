//! An instance of wgpu that asks the system for no window system but the one that is used.
//!
//! Made by itself, wgpu asks Vulkan for every window system that there is, and opens OpenGL beside it.
//! Drivers then look for displays that nobody uses: Mesa prints `error: XDG_RUNTIME_DIR is invalid or not set
//! in the environment` where there is no Wayland, and over the network a program without a window waits for
//! an X server.

/// An instance for the window system of `descriptor.display`, or for none where there is no display.
///
/// Of the backends that `descriptor` names OpenGL is only looked at where Vulkan has no adapter. Costs what
/// [`wgpu::Instance::new`] does. On systems other than Linux and its like it is that.
pub async fn instance_for(descriptor: wgpu::InstanceDescriptor) -> wgpu::Instance {
    #[cfg(any(target_os = "linux", target_os = "freebsd"))]
    if let Some(instance) = vulkan::instance(&descriptor).await {
        return instance;
    }
    wgpu::Instance::new(descriptor)
}

#[cfg(any(target_os = "linux", target_os = "freebsd"))]
mod vulkan {
    use std::ffi::CStr;

    use wgpu::hal::{self, api, vulkan};
    use wgpu::rwh::RawDisplayHandle;
    use wgpu::{Backends, Instance, InstanceDescriptor};

    const XLIB: &CStr = c"VK_KHR_xlib_surface";
    const XCB: &CStr = c"VK_KHR_xcb_surface";
    const WAYLAND: &CStr = c"VK_KHR_wayland_surface";

    /// An instance of Vulkan alone; `None` if it has no adapter or is not asked for.
    pub(super) async fn instance(descriptor: &InstanceDescriptor) -> Option<Instance> {
        if !descriptor.backends.contains(Backends::VULKAN) {
            return None;
        }
        let display = descriptor.display.as_ref().and_then(|display| display.display_handle().ok());
        let used = display.and_then(|display| extension_of(display.as_raw()));
        let described = hal::InstanceDescriptor {
            name: "vastex",
            flags: descriptor.flags,
            memory_budget_thresholds: descriptor.memory_budget_thresholds,
            backend_options: descriptor.backend_options.clone(),
            telemetry: None,
            display,
        };
        let instance = open(&described, used)?;
        let has_adapter = !instance.enumerate_adapters(Backends::VULKAN).await.is_empty();
        has_adapter.then_some(instance)
    }

    /// What a window needs of Vulkan on this window system.
    fn extension_of(display: RawDisplayHandle) -> Option<&'static CStr> {
        match display {
            RawDisplayHandle::Xlib(_) => Some(XLIB),
            RawDisplayHandle::Xcb(_) => Some(XCB),
            RawDisplayHandle::Wayland(_) => Some(WAYLAND),
            _ => None,
        }
    }

    #[expect(
        unsafe_code,
        reason = "wgpu's own constructor asks for every window system, and this one is unsafe to call"
    )]
    fn open(described: &hal::InstanceDescriptor<'_>, used: Option<&'static CStr>) -> Option<Instance> {
        let leave_out_unused = move |args: vulkan::CreateInstanceCallbackArgs<'_, '_, '_>| {
            args.extensions.retain(|&name| ![XLIB, XCB, WAYLAND].contains(&name) || Some(name) == used);
        };
        // SAFETY: wgpu takes each of the extensions that are left out only where the system has it, and looks
        // before it uses one; nothing else is changed.
        let instance =
            unsafe { vulkan::Instance::init_with_callback(described, Some(Box::new(leave_out_unused))) };
        // SAFETY: the instance was made just now, and nobody else has it.
        instance.ok().map(|instance| unsafe { Instance::from_hal::<api::Vulkan>(instance) })
    }
}
