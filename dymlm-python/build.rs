//! Tells the linker of macOS that the process that loads the extension provides Python's symbols.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
