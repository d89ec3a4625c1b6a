//! Shader texts of tests with numbers that a pipeline is told, so that there is one text for all of them.

use std::fmt::Write as _;

/// A text, and the numbers of its `override`s.
#[derive(Clone, Debug)]
pub(crate) struct TestText {
    text: String,
    numbers: Vec<(&'static str, f64)>,
}

impl TestText {
    pub(crate) fn new(text: String) -> TestText {
        TestText { text, numbers: Vec::new() }
    }

    /// The text with a whole number of this name.
    pub(crate) fn with(mut self, name: &'static str, number: u32) -> TestText {
        write!(self.text, "\noverride {name}: u32 = 0u;\n").unwrap();
        self.told(name, number)
    }

    /// The text, which has a number of this name.
    pub(crate) fn told(mut self, name: &'static str, number: u32) -> TestText {
        self.numbers.push((name, number.into()));
        self
    }

    pub(crate) fn module(&self, device: &wgpu::Device) -> wgpu::ShaderModule {
        vastex_wgpu::shader_module(device, None, self.text.as_str())
    }

    /// What each stage of a pipeline of the module is told.
    pub(crate) fn options(&self) -> wgpu::PipelineCompilationOptions<'_> {
        wgpu::PipelineCompilationOptions { constants: &self.numbers, ..Default::default() }
    }
}
