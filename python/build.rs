//! On macOS a module leaves Python's symbols to whoever loads it. maturin says so to the linker; `cargo build` in the root says it here.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
