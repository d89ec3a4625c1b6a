//! The text by which a test asks a pool's hash table and the records, made of the modules that do so in every
//! shader.

use vastex_core::shader_constants;
use vastex_wgpu::FeedbackMode;

macro_rules! module {
    ($name:literal) => {
        include_str!(concat!("../../src/wgsl/", $name, ".wgsl"))
    };
}

/// Asks for each page by the hash table, and of each record for a word.
const ASK: &str = "
@group(0) @binding(2) var<storage, read_write> answers: array<vec4<u32>>;

@compute @workgroup_size(64)
fn ask(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&answers) {
        let asked = answers[id.x];
        let number = asked.z;
        answers[id.x] = vec4<u32>(
            vastexi_hashed_page_POOL(asked.xy),
            vastexi_param(number, asked.w).y,
            textureDimensions(vastexi_params).y,
            vastexi_table_length_POOL(),
        );
    }
}
";

/// The whole text, for tables in buffers or in textures.
pub(crate) fn text(mode: FeedbackMode) -> String {
    let mut text = String::new();
    for (name, value) in shader_constants::WGSL {
        text += &format!("const VASTEXI_{name} = {value}u;\n");
    }
    for (name, value) in [("NONE", u32::MAX), ("GROUP", 0), ("BINDING_TABLE_POOL", 0), ("BINDING_PARAMS", 1)]
    {
        text += &format!("const VASTEXI_{name} = {value}u;\n");
    }
    let modules = match mode {
        FeedbackMode::Raw => module!("arena_texture"),
        _ => module!("arena_buffer"),
    };
    text + modules + module!("param") + module!("hashed_pool") + ASK
}
