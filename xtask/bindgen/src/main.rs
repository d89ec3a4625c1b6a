//! Writes the JavaScript by which a browser starts a program that was compiled for it, as `wasm-bindgen
//! --target web` does; the program of that name brings a server and much else that compiles for minutes.

use std::process::ExitCode;

use wasm_bindgen_cli_support::Bindgen;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [program, directory] = &arguments[..] else {
        eprintln!("vastex-bindgen takes a program (.wasm) and the directory to write into");
        return ExitCode::from(2);
    };
    let mut bindgen = Bindgen::new();
    let written =
        bindgen.input_path(program).typescript(false).web(true).and_then(|bindgen| bindgen.generate(directory));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{program}: {error:#}");
            ExitCode::FAILURE
        }
    }
}
